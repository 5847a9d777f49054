//! The same scene with less error of its own: what of the force is the substeps' doing, and what the mesh's.

use palpate::Error;
use palpate::model::integrator::Spectrum;
use palpate::scene::{BodySpec, Scene};

/// Elements of the finer mesh are so many times smaller: 3.4 times as many.
const FINER_MESH: f64 = 1.5;
/// And steps of the finer run.
const FINER_STEPS: u32 = 2;

/// A scene that is run with `full` for comparison.
pub(super) struct Finer {
    /// The difference, in a word or two.
    pub(super) name: &'static str,
    pub(super) scene: Result<Scene, Error>,
}

/// What can be finer in `scene`: the steps always, the mesh if it fills a surface.
pub(super) fn finer(scene: &Scene) -> Vec<Finer> {
    let steps = Finer { name: "full, 2x steps", scene: with_finer_steps(scene) };
    let mesh = with_finer_mesh(scene).transpose().map(|scene| Finer { name: "full, mesh/1.5", scene });
    [steps].into_iter().chain(mesh).collect()
}

fn with_finer_steps(scene: &Scene) -> Result<Scene, Error> {
    let tick_ms = 1e3 / scene.local.rate_hz;
    let per_ms = match (scene.global.substeps_per_ms, &scene.body) {
        (Some(per_ms), _) => per_ms,
        (None, Some(body)) => {
            let steps = Spectrum::estimate(&mut *body.build()?).substeps(1e-3 * tick_ms);
            (f64::from(steps) / tick_ms).ceil() as u32
        }
        (None, None) => return Err(Error::scene("body", "is missing")),
    };
    let mut finer = scene.clone();
    (finer.global.substeps_per_ms, finer.global.ticks_per_step) = (Some(FINER_STEPS * per_ms), 1);
    Ok(finer)
}

/// With as many substeps as the finer mesh needs; `None` for a body that fills no surface.
fn with_finer_mesh(scene: &Scene) -> Result<Option<Scene>, Error> {
    let Some(tetrahedra) = scene.body.as_ref().and_then(BodySpec::tetrahedra) else { return Ok(None) };
    let Some(body) = tetrahedra.refined(FINER_MESH)? else { return Ok(None) };
    let mut finer = Scene { body: Some(BodySpec::Tetrahedra(body)), ..scene.clone() };
    (finer.global.substeps_per_ms, finer.global.ticks_per_step) = (None, 1);
    Ok(Some(finer))
}
