//! A session: a body, a tool, and what moves it; run in simulated time, or started on threads.

use std::path::{Path, PathBuf};
use std::time::Duration;

use palpate::Session as EngineSession;
use palpate::model::local::Kind;
use palpate::scene::Scene as EngineScene;
use palpate::session::{Running, SessionBuilder, Summary};
use pyo3::prelude::*;
use pyo3::types::PyDict;
use toml::{Table, Value};

use crate::body::keyword;
use crate::errors::{OrRaise, exception, usage};
use crate::live::Live;
use crate::own_body::{OwnBody, has_tangent, is_body};
use crate::own_device::{Failure, NOT_REAL_TIME, OwnDevice};
use crate::path::tool_path;
use crate::recording::Recording;
use crate::run::Run;
use crate::subject::{described, of_body};
use crate::toml_value::table;

/// How much simulated time passes between two looks at Ctrl-C.
const STEP: Duration = Duration::from_millis(10);

/// A session: a body, a tool, and what moves it.
///
/// subject: a Block, Tetrahedra, a Scene, the path or dictionary of one, or a body of one's own: an object with `nodes` (n, 3),
/// `inverse_masses` (n,), `triangles` (m, 3) and `forces(positions, velocities)`, all (n, 3) (N). The rest is put over what the scene says.
///
/// device: an object with `read(time_s)`, which gives the tool's position, or a tuple of position and velocity, and, if it takes forces,
/// `write(force)`; `max_force_n` is what it can exert. Devices and bodies that are written in Python run in simulated time only.
///
/// tool: Point(), Sphere(radius_m) or Capsule(radius_m, length_m). path: a file (t_s,x_m,y_m,z_m), one place (x, y, z), or rows of (t_s,
/// x_m, y_m, z_m), with (qw, qx, qy, qz) behind them for a tool that turns; linear in between. attach_node: the surface node that the tool
/// is glued to, (i, j, k) of a block or its number. model: "auto", "full", "hold", "patch", "predictive" and so on. friction: Coulomb's
/// coefficient, "stick" for a tool that sticks. error_pct: what 19 of 20 random scenes are to keep (rms, % of the peak force). patch: nodes
/// along the surface, along it, into depth. basis: states of the reduced surroundings. crossfade_ms: resyncs are blended over so long. probes: nodes
/// whose position is logged, numbers or (i, j, k). duration_s: simulated time; without, what the scene says, or that of the path. rate_hz,
/// global_rate_hz: of the local and the global model. settings: any tables of a scene file, such as {"safety": {...}}.
///
/// Raises SceneError with the field of a scene file and what would be right.
#[pyclass(frozen, module = "palpate")]
pub(crate) struct Session {
    scene: EngineScene,
    name: String,
    /// Written in Python: a body in place of the scene's, a device in place of its first.
    own_body: Option<Py<PyAny>>,
    own_device: Option<Py<PyAny>>,
}

#[pymethods]
impl Session {
    #[new]
    #[pyo3(signature = (subject, *, tool = None, path = None, device = None, attach_node = None, model = None, friction = None, error_pct = None,
                        patch = None, basis = None, crossfade_ms = None, probes = None, duration_s = None, rate_hz = None,
                        global_rate_hz = None, settings = None))]
    #[expect(clippy::too_many_arguments, reason = "they have names where they are given")]
    fn new(
        subject: &Bound<'_, PyAny>,
        tool: Option<&Bound<'_, PyAny>>,
        path: Option<&Bound<'_, PyAny>>,
        device: Option<&Bound<'_, PyAny>>,
        attach_node: Option<&Bound<'_, PyAny>>,
        model: Option<&Bound<'_, PyAny>>,
        friction: Option<&Bound<'_, PyAny>>,
        error_pct: Option<&Bound<'_, PyAny>>,
        patch: Option<&Bound<'_, PyAny>>,
        basis: Option<&Bound<'_, PyAny>>,
        crossfade_ms: Option<f64>,
        probes: Option<&Bound<'_, PyAny>>,
        duration_s: Option<&Bound<'_, PyAny>>,
        rate_hz: Option<&Bound<'_, PyAny>>,
        global_rate_hz: Option<&Bound<'_, PyAny>>,
        settings: Option<&Bound<'_, PyDict>>,
    ) -> PyResult<Self> {
        let py = subject.py();
        let mut changes = settings.map_or(Ok(Table::new()), |settings| table(settings, ""))?;
        let given = [
            ("device", "tool", tool),
            ("device", "attach_node", attach_node),
            ("local", "model", model),
            ("contact", "friction", friction),
            ("local", "error_pct", error_pct),
            ("local", "patch", patch),
            ("local", "basis", basis),
            ("run", "duration_s", duration_s),
            ("local", "rate_hz", rate_hz),
            ("global", "rate_hz", global_rate_hz),
        ];
        for (table, key, given) in given {
            if let Some(value) = keyword(given, &format!("{table}.{key}"))? {
                if matches!(changes.get(table), Some(Value::Array(_))) {
                    let message = format!("is for one {table}, and settings has a list of them: say it there");
                    return Err(usage(py, key, &message));
                }
                put(&mut changes, table, key, value);
            }
        }
        if let Some(ms) = crossfade_ms {
            let blend = Table::from_iter([("kind".into(), "crossfade".into()), ("ms".into(), Value::Float(ms))]);
            put(&mut changes, "local", "blend", Value::Table(blend));
        }
        if let Some(nodes) = keyword(probes, "probe")? {
            let nodes = match nodes {
                Value::Array(nodes) => nodes,
                node => vec![node],
            };
            let probe = |node| Value::Table(Table::from_iter([("node".to_owned(), node)]));
            changes.insert("probe".into(), Value::Array(nodes.into_iter().map(probe).collect()));
        }
        if path.is_some() && device.is_some() {
            return Err(usage(py, "path", "moves the tool, and so does the device: leave one out"));
        }
        let path = path.map(tool_path).transpose()?;
        let own_device = device.map(|device| {
            OwnDevice::new(device, Failure::default())?;
            PyResult::Ok(device.clone().unbind())
        });
        let own_device = own_device.transpose()?;
        let is_own = is_body(subject)?;
        let (scene, name) = match is_own {
            true => (of_body(py, None, changes, path)?, subject.get_type().name()?.to_string()),
            false => described(subject, changes, path)?,
        };
        py.detach(|| scene.validate()).or_raise(py)?;
        if is_own {
            OwnBody::new(subject, Failure::default())?;
            if !has_tangent(subject)? && scene.local.model.named() != Some(Kind::Full) {
                let message = "local models are made of a body's tangent, and this one has none: give it tangent(positions, velocities, nodes, \
                               clamp), or use model=\"full\"";
                return Err(usage(py, "model", message));
            }
        }
        Ok(Self { scene, name, own_body: is_own.then(|| subject.clone().unbind()), own_device })
    }

    /// Runs it in simulated time, on this thread, as fast as the machine allows: bit for bit the same every time, and what `palpate run
    /// --virtual` computes. Other threads of Python run meanwhile; Ctrl-C ends it.
    ///
    /// log: a file (MCAP) to write, overwritten if it exists; log_scene: with pictures for viewers.
    ///
    /// Raises SceneError if something cannot work, FaultError with the run so far as `error.run` if the run ended in a fault.
    #[pyo3(signature = (*, log = None, log_scene = false))]
    fn run(&self, py: Python<'_>, log: Option<PathBuf>, log_scene: bool) -> PyResult<Run> {
        let failure = Failure::default();
        let builder = logged(self.builder(py, &failure)?.virtual_time().keep_records(), log.as_deref(), log_scene);
        let running = py.detach(|| builder.build()?.start());
        // What Python raised says more than what the engine made of it.
        failure.raise()?;
        let running = running.or_raise(py)?;
        let (summary, interrupt) = py.detach(|| to_its_end(running, &failure));
        interrupt?;
        finished(py, summary, &self.name)
    }

    /// Starts it in real time, on threads of its own: the session runs while Python does something else.
    ///
    /// log: a file (MCAP) to write, overwritten if it exists; without, records are kept in memory, some megabyte a second. log_scene: with
    /// pictures for viewers. endless: runs until it is stopped, whatever the duration.
    ///
    /// Raises SceneError or RefusedError if something cannot work, UsageError if a device or body is written in Python.
    #[pyo3(signature = (*, log = None, log_scene = false, endless = false))]
    fn start(&self, py: Python<'_>, log: Option<PathBuf>, log_scene: bool, endless: bool) -> PyResult<Live> {
        let own = [("device", &self.own_device), ("subject", &self.own_body)];
        if let Some((argument, _)) = own.iter().find(|(_, object)| object.is_some()) {
            return Err(usage(py, argument, NOT_REAL_TIME));
        }
        let mut builder = logged(self.builder(py, &Failure::default())?.share_records(), log.as_deref(), log_scene);
        if log.is_none() {
            builder = builder.keep_records();
        }
        if endless {
            builder = builder.endless();
        }
        let running = py.detach(|| builder.build()?.start()).or_raise(py)?;
        Ok(Live::new(running, log, self.name.clone()))
    }

    /// The schedule in real time: what each rate group asks for, what the cores bear, what this system would refuse. Nothing is started.
    fn plan(&self, py: Python<'_>) -> PyResult<String> {
        let builder = self.builder(py, &Failure::default())?;
        py.detach(|| builder.build()?.plan()).or_raise(py).map(|plan| plan.to_string())
    }

    /// The local model that would be chosen and why; None if one was named.
    fn choice(&self, py: Python<'_>) -> PyResult<Option<String>> {
        let builder = self.builder(py, &Failure::default())?;
        let built = py.detach(|| builder.virtual_time().build());
        Ok(built.or_raise(py)?.choice().map(ToString::to_string))
    }

    fn __repr__(&self) -> String {
        format!("<palpate.Session of {}, model {}>", self.name, self.scene.local.model.name())
    }
}

impl Session {
    /// What the engine makes the session of; exceptions of what is written in Python go to `failure`.
    fn builder(&self, py: Python<'_>, failure: &Failure) -> PyResult<SessionBuilder> {
        let mut builder = EngineSession::from_scene(self.scene.clone()).open_haply_with(palpate_haply::open);
        if let Some(body) = &self.own_body {
            builder = builder.body(OwnBody::new(body.bind(py), failure.clone())?);
        }
        if let Some(device) = &self.own_device {
            builder = builder.device(OwnDevice::new(device.bind(py), failure.clone())?);
        }
        Ok(builder)
    }

    /// The scene for a study, and its name.
    ///
    /// # Errors
    /// `UsageError` if a part of it is written in Python, which is no part of a scene.
    pub(crate) fn scene_to_study(&self, py: Python<'_>) -> PyResult<(EngineScene, String)> {
        if self.own_body.is_some() || self.own_device.is_some() {
            return Err(usage(
                py,
                "subject",
                "has a part that is written in Python, and a study needs a scene that can be run again and again",
            ));
        }
        Ok((self.scene.clone(), self.name.clone()))
    }
}

/// With a log, if one is wanted.
fn logged(builder: SessionBuilder, log: Option<&Path>, log_scene: bool) -> SessionBuilder {
    let builder = log.into_iter().fold(builder, |builder, log| builder.log(log));
    if log_scene { builder.log_scene() } else { builder }
}

fn put(tables: &mut Table, name: &str, key: &str, value: Value) {
    if let Value::Table(table) = tables.entry(name).or_insert_with(|| Value::Table(Table::new())) {
        table.insert(key.to_owned(), value);
    }
}

/// Runs to the end, or until something written in Python fails or somebody presses Ctrl-C.
fn to_its_end(running: Running, failure: &Failure) -> (Summary, PyResult<()>) {
    let mut interrupt = Ok(());
    while !running.finished() && interrupt.is_ok() {
        running.wait_for(STEP);
        interrupt = failure.raise().and_then(|()| Python::attach(|py| py.check_signals()));
    }
    let summary = running.stop();
    (summary, interrupt.and_then(|()| failure.raise()))
}

/// The run of which `summary` is left.
///
/// # Errors
/// `FaultError` with the run if it ended in a fault.
pub(crate) fn finished(py: Python<'_>, summary: Summary, name: &str) -> PyResult<Run> {
    let recording = py.detach(|| Recording::of_run(summary));
    let fault = recording.faults.join("; ");
    let run = Run::new(py, recording)?;
    if fault.is_empty() {
        return Ok(run);
    }
    let error = exception(py, "FaultError", name, &fault, None);
    error.value(py).setattr("run", run)?;
    Err(error)
}
