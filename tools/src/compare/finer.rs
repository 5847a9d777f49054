//! The same scene with less error of its own: what of the force is the substeps' doing, and what the mesh's.

use palpate::Error;
use palpate::model::integrator::Spectrum;
use palpate::scene::{BodySpec, Scene};

/// Elements of the finer mesh are so many times smaller: 3.4 times as many.
const FINER_MESH: f64 = 1.5;
/// And steps of the finer run.
const FINER_STEPS: f64 = 2.0;

/// What a session takes for the rounding of the steps of a tick.
const ROUNDING: f64 = 1e-9;

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
    let steps = match (scene.global.substeps_per_ms, &scene.body) {
        (Some(per_ms), _) => steps_per_tick(per_ms, tick_ms),
        (None, Some(body)) => f64::from(Spectrum::estimate(&mut *body.build()?).substeps(1e-3 * tick_ms)),
        (None, None) => return Err(Error::scene("body", "is missing")),
    };
    let mut finer = scene.clone();
    (finer.global.substeps_per_ms, finer.global.ticks_per_step) = (Some(per_ms(FINER_STEPS * steps, tick_ms)), 1);
    Ok(finer)
}

/// The steps of a tick, as a session rounds them up.
fn steps_per_tick(per_ms: u32, tick_ms: f64) -> f64 {
    (f64::from(per_ms) * tick_ms - ROUNDING).ceil().max(1.0)
}

/// The least number of steps per millisecond that gives a tick no fewer than `steps`: as many, unless whole numbers per millisecond pass
/// over that.
fn per_ms(steps: f64, tick_ms: f64) -> u32 {
    ((steps - 1.0 + ROUNDING) / tick_ms).floor() as u32 + 1
}

/// With as many substeps as the finer mesh needs; `None` for a body that fills no surface.
fn with_finer_mesh(scene: &Scene) -> Result<Option<Scene>, Error> {
    let Some(tetrahedra) = scene.body.as_ref().and_then(BodySpec::tetrahedra) else { return Ok(None) };
    let Some(body) = tetrahedra.refined(FINER_MESH)? else { return Ok(None) };
    let mut finer = Scene { body: Some(BodySpec::Tetrahedra(body)), ..scene.clone() };
    (finer.global.substeps_per_ms, finer.global.ticks_per_step) = (None, 1);
    Ok(Some(finer))
}

#[cfg(test)]
mod tests {
    use super::*;
    use palpate::scene::Scene;

    // Check ticks of a quarter of a millisecond, of whole milliseconds and of parts of them.
    #[test]
    fn the_finer_run_has_twice_the_steps_of_the_reference_at_every_haptic_rate() {
        let mut scene = Scene::demo();
        for rate_hz in [4000.0, 3000.0, 2000.0, 1500.0, 1000.0, 500.0] {
            scene.local.rate_hz = rate_hz;
            let tick_ms = 1e3 / rate_hz;
            let chosen =
                Spectrum::estimate(&mut *scene.body.as_ref().unwrap().build().unwrap()).substeps(1e-3 * tick_ms);
            for (per_ms, steps) in [(Some(2), steps_per_tick(2, tick_ms)), (None, f64::from(chosen))] {
                scene.global.substeps_per_ms = per_ms;
                let finer = with_finer_steps(&scene).unwrap().global.substeps_per_ms.unwrap();
                assert_eq!(steps_per_tick(finer, tick_ms), 2.0 * steps, "{rate_hz} Hz, {per_ms:?}: {finer}");
            }
        }
        // Where no whole number per millisecond gives them: 5 and 7 are possible.
        assert_eq!([4, 5].map(|per_ms| steps_per_tick(per_ms, 1.25)), [5.0, 7.0]);
        assert_eq!(per_ms(6.0, 1.25), 5);
    }
}
