//! Which step a linear patch takes: the global model's, unless the patch as it is now asks for another.

use crate::contact::{Equations, Law};
use crate::linear::PatchTangent;
use crate::local::kind::Kind;
use crate::simulation::Stepping;

/// A step above this share of the stability limit is replaced: the limit is known up to a percent.
const STABLE_SHARE: f64 = 0.98;
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
    if needed > Kind::MOST_EXPLICIT_STEPS && law.equations != Equations::Paper {
        return implicit;
    }
    (Stepping { substeps: needed.clamp(stepping.substeps, MOST_SUBSTEPS.max(stepping.substeps)), ..stepping }, false)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::body::{Block, Body, State};
    use crate::linear::patch_of;
    use crate::mesh::Face;

    /// Of a patch of a block that is pressed flat to `share` of its height, with two steps of `step` seconds.
    fn chosen(share: f64, step: f64, equations: Equations) -> (u32, bool) {
        let block = Block::builder([6; 3], [0.05; 3]).damping_ratio(0.3).fix(Face::ZMin).build().unwrap();
        let mut state = State::at_rest(block.rest());
        state.positions.iter_mut().for_each(|x| x.z *= share);
        let (nodes, tangent) = patch_of(&block, &state);
        let inverse_masses: Vec<f64> = nodes.iter().map(|&node| block.inverse_masses()[node as usize]).collect();
        let law = Law { equations, ..Law::default() };
        let stepping = Stepping { tick: 2.0 * step, substeps: 2 };
        let (chosen, is_implicit) = stable_stepping(false, &tangent, &inverse_masses, stepping, &law);
        (chosen.substeps, is_implicit)
    }

    #[test]
    fn a_patch_at_rest_keeps_the_steps_of_the_global_model() {
        assert_eq!(chosen(1.0, 0.5e-3, Equations::Corrected), (2, false));
    }

    #[test]
    fn a_patch_pressed_flat_is_stiffer_along_the_surface_and_takes_shorter_steps() {
        // The limit is 1.16 ms at rest and 0.97 ms with springs that all lie nearly flat.
        assert_eq!(chosen(1.0, 1.05e-3, Equations::Corrected), (2, false));
        assert_eq!(chosen(0.3, 1.05e-3, Equations::Corrected), (3, false));
    }

    #[test]
    fn where_many_steps_are_asked_for_one_is_implicit_if_the_equations_have_one() {
        assert_eq!(chosen(0.3, 2e-3, Equations::Corrected), (1, true));
        assert_eq!(chosen(0.3, 2e-3, Equations::Paper), (6, false));
    }
}
