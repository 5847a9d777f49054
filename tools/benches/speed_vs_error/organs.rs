//! The whole of speed against error: organs from coarse to fine, as tetrahedra and as lattices, and every local model, against the finest
//! solution.

mod cases;
mod lattice;
mod words;

use palpate::Error;
use palpate::model::Vec3;
use palpate::model::body::Body;
use palpate::model::local::Kind as LocalModelKind;
use palpate::runtime::Nanos;
use palpate::scene::Scene;
use palpate::session::Session;
use palpate_cli::compare::{CompareOptions, Comparison, Measured};

use crate::{Part, common};
use cases::{ORGANS, Organ};

/// The size that the local models run on, of an organ's sizes.
const MIDDLE: usize = 2;

/// One body, or one local model on the middle one.
struct Run {
    /// Of its elements or springs (mm).
    size_mm: f64,
    nodes: usize,
    /// Elements or springs.
    parts: usize,
    measured: Measured,
}

/// A local model on the middle mesh.
struct Local {
    model: String,
    is_late: bool,
    measured: Measured,
}

/// All that was measured on an organ.
struct Study {
    organ: Organ,
    finest: Run,
    /// The coarser ones.
    tetrahedra: Vec<Run>,
    lattices: Vec<Run>,
    middle: usize,
    /// `full` on the middle mesh with twice the substeps.
    finer_steps: Option<Measured>,
    locals: Vec<Local>,
    /// Models that did not come to the end of their run, and why.
    missing: Vec<(String, String)>,
}

/// Two forces' distance: root of the mean square and largest (% of the finest's peak).
#[derive(Clone, Copy)]
struct Distance {
    rms: f64,
    max: f64,
}

impl Study {
    fn distance(&self, run: &Measured, from: &Measured) -> Distance {
        let scale = 100.0 / self.finest.measured.peak_n();
        let [run, from] = [run, from].map(|run| &run.devices[0].trace);
        let ticks = run.forces_n.len().max(1) as f64;
        let errors = || run.differences_n(from);
        Distance {
            rms: scale * (errors().map(|error| error * error).sum::<f64>() / ticks).sqrt(),
            max: scale * errors().fold(0.0, f64::max),
        }
    }

    /// The error of all together: against the finest solution.
    fn whole(&self, run: &Measured) -> Distance {
        self.distance(run, &self.finest.measured)
    }

    fn of(organ: Organ, is_quick: bool) -> Result<Self, Error> {
        let (sizes, middle) = if is_quick { (&organ.sizes_mm[..2], 0) } else { (&organ.sizes_mm[..], MIDDLE) };
        let finest_mm = sizes[sizes.len() - 1];
        eprintln!("{}: {finest_mm} mm", organ.name);
        let mesh = organ.mesh(finest_mm)?;
        let bounds = mesh
            .points
            .iter()
            .fold([Vec3::repeat(f64::INFINITY), Vec3::repeat(f64::NEG_INFINITY)], |[low, high], point| {
                [low.inf(point), high.sup(point)]
            });
        let path = organ.path(&mesh)?;
        let scene = organ.scene(path.clone());
        let finest = tetrahedra(&organ, &scene, finest_mm)?;
        let (mut meshes, mut lattices, mut compared) = (Vec::new(), Vec::new(), None);
        for (place, &size_mm) in sizes.iter().enumerate() {
            eprintln!("{}: {size_mm} mm", organ.name);
            if place == middle {
                let scene = Scene { body: Some(organ.body(organ.mesh(size_mm)?)?), ..scene.clone() };
                compared = Some(models(&scene, is_quick)?);
            }
            if size_mm != finest_mm {
                meshes.push(tetrahedra(&organ, &scene, size_mm)?);
            }
            let network = lattice::lattice(&organ, bounds, 1e-3 * size_mm)?;
            let (nodes, parts) = (network.inverse_masses().len(), network.springs().len());
            let measured = Measured::of_full(cases::session(network, path.clone()))?;
            lattices.push(Run { size_mm, nodes, parts, measured });
        }
        let Comparison { runs, finer, .. } = compared.unwrap_or_default();
        let missing = runs.iter().filter_map(|run| Some((run.model.clone(), run.missing()?.to_owned()))).collect();
        let locals = runs.into_iter().filter_map(|run| {
            let measured = run.measured()?.clone();
            Some(Local { is_late: run.latency != Nanos::ZERO, model: run.model, measured })
        });
        Ok(Self {
            finer_steps: finer.first().and_then(|run| run.measured()).cloned(),
            locals: locals.collect(),
            tetrahedra: meshes,
            organ,
            finest,
            lattices,
            middle,
            missing,
        })
    }
}

fn tetrahedra(organ: &Organ, scene: &Scene, size_mm: f64) -> Result<Run, Error> {
    let mesh = organ.mesh(size_mm)?;
    let (nodes, parts) = (mesh.points.len(), mesh.tetrahedra.len());
    let scene = Scene { body: Some(organ.body(mesh)?), ..scene.clone() };
    Ok(Run { size_mm, nodes, parts, measured: Measured::of_full(Session::from_scene(scene))? })
}

/// Every local model, in time and one period late.
fn models(scene: &Scene, is_quick: bool) -> Result<Comparison, Error> {
    let models = if is_quick { vec![LocalModelKind::Hold] } else { Vec::new() };
    let options = CompareOptions { models, finer: true, ..CompareOptions::default() };
    Comparison::measure(scene, &options, |at| {
        if at.until.is_none() {
            eprintln!("  {} {} ms late", at.model, at.latency.0 as f64 / 1e6);
        }
    })
}

/// `text` with this section in place of the one that it had, or before its first.
pub fn replaced(text: &str, section: &str) -> String {
    let first = text.find("\n## ").map_or(text.len(), |at| at + 1);
    let start = text.find(words::HEADING).unwrap_or(first);
    let rest = &text[start..];
    let end = match rest.strip_prefix(words::HEADING) {
        Some(after) => after.find("\n## ").map_or(text.len(), |at| start + words::HEADING.len() + at + 1),
        None => start,
    };
    format!("{}{section}\n{}", &text[..start], &text[end..])
}

pub fn part(is_quick: bool) -> Result<Part, Error> {
    let organs = ORGANS.into_iter().take(if is_quick { 1 } else { ORGANS.len() });
    let studies = organs.map(|organ| Study::of(organ, is_quick)).collect::<Result<Vec<_>, _>>()?;
    let date = common::measured_on("cargo bench --bench speed_vs_error -- --organs");
    Ok(Part {
        text: words::section(&studies, &date),
        pictures: vec![(words::PICTURE.to_owned(), words::picture(&studies))],
    })
}
