//! Studies as data: what the commands `compare` and `reduce` print with `--json`.

use palpate::model::local::Kind;
use palpate::runtime::Nanos;
use palpate::scene::{NodeSpec, Scene as EngineScene};
use palpate_cli::compare::{CompareOptions, Comparison, to_json};
use palpate_cli::{ReduceOptions, reduction_json};
use pyo3::prelude::*;

use crate::errors::{OrRaise, usage};
use crate::scene::Scene;
use crate::session::Session;

/// Runs a scene with each local model in simulated time, against "full", the whole body at the haptic rate.
///
/// subject: a Scene, its path or dictionary, or a Session. models: names; all without. latencies_ms: how late the global model's results are
/// (ms); 0 and one period without. finer: also "full" with smaller steps and elements.
///
/// Gives what `palpate compare --json` prints: `models` holds for each model and latency `error_percent` (rms, max, jump, of the peak force)
/// and `cost` (tick_p99_ns, total_s_per_s and so on). Forces and errors are the same every time, costs are measured. Other threads of Python
/// run meanwhile.
#[pyfunction]
#[pyo3(signature = (subject, *, models = None, latencies_ms = None, duration_s = None, finer = false))]
pub(crate) fn compare<'py>(
    subject: &Bound<'py, PyAny>,
    models: Option<Vec<String>>,
    latencies_ms: Option<Vec<f64>>,
    duration_s: Option<f64>,
    finer: bool,
) -> PyResult<Bound<'py, PyAny>> {
    let py = subject.py();
    let kind = |name: String| {
        let known = || Kind::ALL.map(Kind::name).join(", ");
        let found = Kind::ALL.into_iter().find(|kind| kind.name() == name);
        found.ok_or_else(|| usage(py, "models", &format!("has {name:?}, the local models are {}", known())))
    };
    let models = models.unwrap_or_default().into_iter().map(kind).collect::<PyResult<_>>()?;
    let latency = |ms: f64| {
        let is_good = ms.is_finite() && ms >= 0.0;
        is_good
            .then(|| Nanos((ms * 1e6).round() as u64))
            .ok_or_else(|| usage(py, "latencies_ms", "must be numbers of at least 0"))
    };
    let latencies = latencies_ms.unwrap_or_default().into_iter().map(latency).collect::<PyResult<_>>()?;
    let options = CompareOptions { models, latencies, duration_s, finer };
    let (scene, name) = scene_of(subject)?;
    let compared = py.detach(|| {
        let mut comparison = Comparison::measure(&scene, &options, |_| ())?;
        comparison.scene = name;
        Ok(to_json(&comparison))
    });
    data(py, compared.or_raise(py)?)
}

/// Says where the local model of a scene may be trusted: how much of the force its patch captures, at rest and in the band, over the surface.
///
/// subject: as for compare. patch: nodes along the surface, along it, into depth, in place of the scene's. node: the surface node that is
/// looked at closely, its number or (i, j, k). every: looks at every so many nodes. error_pct: finds the patch and the states that keep the
/// error below this. order: states of the reduced models. measure: also measures the error in the time domain.
///
/// Gives what `palpate reduce --json` prints; `["locality"]["local"]` is the verdict.
#[pyfunction]
#[pyo3(signature = (subject, *, patch = None, node = None, every = None, error_pct = None, order = None, measure = false))]
pub(crate) fn reduce<'py>(
    subject: &Bound<'py, PyAny>,
    patch: Option<[usize; 3]>,
    node: Option<&Bound<'_, PyAny>>,
    every: Option<usize>,
    error_pct: Option<f64>,
    order: Option<usize>,
    measure: bool,
) -> PyResult<Bound<'py, PyAny>> {
    let py = subject.py();
    let node = node.map(|node| {
        let number = || node.extract().map(NodeSpec::Number);
        node.extract::<[usize; 3]>().map(NodeSpec::Lattice).or_else(|_| number())
    });
    let node = node
        .transpose()
        .map_err(|_: PyErr| usage(py, "node", "must be a number, or the indices (i, j, k) in a block"))?;
    let options = ReduceOptions { patch, node, every, error_pct, order, measure };
    let (scene, name) = scene_of(subject)?;
    data(py, py.detach(|| reduction_json(&scene, &name, &options)).or_raise(py)?)
}

/// The scene that is studied, and its name.
fn scene_of(subject: &Bound<'_, PyAny>) -> PyResult<(EngineScene, String)> {
    if let Ok(session) = subject.cast::<Session>() {
        return session.get().scene_to_study(subject.py());
    }
    let scene = Scene::of(subject)?;
    Ok((scene.get().scene.clone(), scene.get().name.clone()))
}

/// A JSON document as Python's values.
fn data(py: Python<'_>, json: String) -> PyResult<Bound<'_, PyAny>> {
    py.import("json")?.call_method1("loads", (json,))
}
