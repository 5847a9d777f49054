//! Why the window and the reduced surroundings of `predictive` are as large as they are, where an error budget says it.

use super::choice::{extended, unsure};
use crate::log::ModelReason;
use crate::model::local::Kind;
use crate::scene::Scene;

/// `of_model` with what the budget of `scene` comes to in `kind`, if it decides.
pub(super) fn reason(of_model: Option<ModelReason>, scene: &Scene, kind: Kind) -> Option<ModelReason> {
    let Some((error_pct, sizes)) = scene.local.budget().filter(|_| kind == Kind::Predictive) else { return of_model };
    let ([a, b, c], states, kept_pct) = (scene.patch_size(), sizes.states, sizes.kept_pct);
    let why = format!(
        "error_pct = {error_pct} takes patch {a} x {b} x {c} and {states} states (19 of 20 random scenes: {kept_pct} %)"
    );
    let missed = (kept_pct > error_pct).then(|| unsure(error_pct, kind, kept_pct));
    Some(extended(of_model, why, missed))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn scene(error_pct: Option<f64>) -> Scene {
        let mut scene = Scene::of_program().with_model(Kind::Predictive);
        scene.local.error_pct = error_pct;
        scene
    }

    #[test]
    fn a_loose_budget_takes_less_and_a_tight_one_the_usual_sizes_with_a_warning() {
        let reason = |error_pct| reason(None, &scene(Some(error_pct)), Kind::Predictive).unwrap();
        let loose = reason(6.0);
        assert_eq!(loose.why, "error_pct = 6 takes patch 4 x 4 x 2 and 150 states (19 of 20 random scenes: 2.9 %)");
        assert_eq!(loose.warning, None);
        assert!(reason(2.5).why.contains("patch 6 x 6 x 3 and 250 states") && reason(2.5).warning.is_none());
        let tight = reason(1.0);
        assert!(tight.why.contains("patch 6 x 6 x 3 and 250 states"), "{tight:?}");
        let warning = "error_pct = 1 is not sure, predictive may be 1.8 % off (1 of 20 random scenes: more)";
        assert_eq!(tight.warning.as_deref(), Some(warning));
    }

    #[test]
    fn numbers_win_and_other_models_are_not_sized() {
        let mut named = scene(Some(6.0));
        named.local.basis = Some(50);
        assert_eq!((named.patch_size(), named.local.basis_states()), ([6, 6, 3], 50));
        assert_eq!(reason(None, &named, Kind::Predictive), None);
        assert_eq!(reason(None, &scene(None), Kind::Predictive), None);
        assert_eq!(reason(None, &scene(Some(6.0)).with_model(Kind::Patch), Kind::Patch), None);
        assert_eq!(scene(Some(60.0)).with_model(Kind::Predicted).patch_size(), [6, 6, 3]);
    }
}
