//! Which step a linear patch takes: the global model's, unless the patch as it is now asks for another.

use super::super::contact::{Equations, Law};
use super::super::simulation::Stepping;
use super::super::tangent::PatchTangent;

/// A step above this share of the stability limit is replaced: the limit is known up to a percent.
const STABLE_SHARE: f64 = 0.98;
/// Where stability asks for more, one implicit step is cheaper.
const MOST_EXPLICIT_STEPS: u32 = 4;
/// With the paper's equations, which have no implicit step: a tick stays bounded.
const MOST_SUBSTEPS: u32 = 32;

/// The steps until the next resync, and whether they are implicit.
///
/// The global model's `stepping` is stable for the body at rest. Springs that are turned, stretched or quickly closing are
/// stiffer, so the patch's own K and C at the resync are asked: where they do not bear the step, a few more explicit ones or
/// one implicit step per tick take its place.
pub(super) fn stable_stepping(
    is_implicit: bool,
    tangent: &PatchTangent,
    inverse_masses: &[f64],
    stepping: Stepping,
    law: &Law,
) -> (Stepping, bool) {
    let implicit = (Stepping { substeps: 1, ..stepping }, true);
    if is_implicit {
        return implicit;
    }
    let spectrum = tangent.spectrum(inverse_masses);
    if stepping.step() <= STABLE_SHARE * spectrum.stable_step() {
        return (stepping, false);
    }
    let needed = spectrum.substeps(stepping.tick);
    if needed > MOST_EXPLICIT_STEPS && law.equations != Equations::Paper {
        return implicit;
    }
    (Stepping { substeps: needed.clamp(stepping.substeps, MOST_SUBSTEPS.max(stepping.substeps)), ..stepping }, false)
}

#[cfg(test)]
mod tests {
    use super::super::super::Vec3;
    use super::super::super::body::{Block, Body, State};
    use super::super::super::mesh::Face;
    use super::*;

    /// A patch of a block that is pressed flat to `share` of its height, at a closing speed of `speed` (m/s) there.
    fn chosen(share: f64, speed: f64, equations: Equations) -> (u32, bool) {
        let block = Block::builder([6; 3], [0.05; 3]).damping_ratio(0.3).fix(Face::ZMin).build().unwrap();
        let mut state = State::at_rest(block.rest());
        for (x, v) in state.positions.iter_mut().zip(&mut state.velocities) {
            *v = Vec3::z() * (speed * x.z / 0.05);
            x.z *= share;
        }
        let mut nodes = Vec::new();
        block.patch(&[block.surface().triangles.len() as u32 - 5], [4, 4, 2], &mut nodes);
        let mut tangent = PatchTangent::default();
        let place = |node: u32| nodes.iter().position(|&other| other == node);
        tangent.rebuild(&block, &state, &nodes, &place, &|_, _| 1.0);
        let inverse_masses: Vec<f64> = nodes.iter().map(|&node| block.inverse_masses()[node as usize]).collect();
        let law = Law { equations, ..Law::default() };
        let stepping = Stepping { tick: 1e-3, substeps: 2 };
        let (chosen, is_implicit) = stable_stepping(false, &tangent, &inverse_masses, stepping, &law);
        (chosen.substeps, is_implicit)
    }

    #[test]
    fn a_patch_at_rest_keeps_the_steps_of_the_global_model() {
        assert_eq!(chosen(1.0, 0.0, Equations::Corrected), (2, false));
    }

    #[test]
    fn springs_that_part_quickly_while_they_are_short_ask_for_another_step() {
        // b s / L is a stiffness across the spring: with L a hundredth of the rest length far above k.
        assert_eq!(chosen(0.01, 20.0, Equations::Corrected), (1, true));
        let (substeps, is_implicit) = chosen(0.01, 20.0, Equations::Paper);
        assert!(substeps > 4 && !is_implicit, "{substeps}");
    }
}
