//! Which local model is right for a body on a machine: the decision behind `model = "auto"`.

use std::fmt;

use super::body::Start;
use super::situation::Situation;
use super::timing::Timing;
use crate::log::ModelReason;
use crate::model::local::Kind;
use crate::runtime::{Execution, Nanos};
use crate::scene::{ModelChoice, Scene, Sizes};

/// A local model that was chosen, and why.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub struct Choice {
    /// The model that was chosen.
    pub model: Kind,
    /// The reason for the choice, and what falls short if something does.
    pub reason: ModelReason,
}

impl fmt::Display for Choice {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}: {}", self.model.name(), self.reason.why)?;
        self.reason.warning.iter().try_for_each(|warning| write!(f, "; warning: {warning}"))
    }
}

/// `reason` with what else was decided, and what that misses.
pub(super) fn extended(reason: Option<ModelReason>, why: String, missed: Option<String>) -> ModelReason {
    match reason {
        Some(ModelReason { why: first, warning }) => {
            ModelReason { why: format!("{first}; {why}"), warning: warning.or(missed) }
        }
        None => ModelReason { why, warning: missed },
    }
}

/// What is said of a budget that more than one scene of twenty is expected to break.
pub(super) fn unsure(error_pct: f64, kind: Kind, kept_pct: f64) -> String {
    format!(
        "error_pct = {error_pct} is not sure, {} may be {kept_pct} % off (1 of 20 random scenes: more)",
        kind.name()
    )
}

/// What is to be expected of a model one global period late: force error rms in % of the peak, which 19 of 20 of the scenes seen in
/// docs/population.md were within.
fn expected_error_pct(kind: Kind) -> f64 {
    match kind {
        Kind::Hold => 60.0,
        Kind::Patch => 78.0,
        Kind::LinearBoundary => 82.0,
        Kind::ScaledBoundary => 74.0,
        Kind::Condensed => 42.0,
        Kind::Predicted => 28.0,
        Kind::Predictive => Sizes::USUAL.kept_pct,
        Kind::Full => 0.0,
    }
}

/// The model that `scene` names, or the one that is right for it, which it names then. With that the reason, and what a force
/// evaluation takes if that was measured or taken to be.
pub(super) fn model(
    scene: &mut Scene,
    start: &mut Start,
    timing: Timing,
    execution: Execution,
) -> (Kind, Option<Choice>, Option<Nanos>) {
    match scene.local.model {
        ModelChoice::Named(kind) => (kind, None, None),
        ModelChoice::Auto => {
            let situation = Situation::of(scene, &mut *start.body, &start.state, timing, execution);
            let choice = choose(&situation);
            scene.local.model = choice.model.into();
            (choice.model, Some(choice), Some(situation.evaluation))
        }
    }
}

/// The cheapest model that fits the rates and meets `error_pct`; if there is none, the best that fits.
///
/// `full` comes first: the others need the same work for their global model, and more. Then in order of cost. Where none
/// meets the error, a tight `full` comes before a model that is wrong.
fn choose(situation: &Situation) -> Choice {
    let error = situation.error_pct;
    if situation.fits(Kind::Full) {
        let why = format!("{}, and nothing beats full where it fits", situation.full_in_words("takes"));
        return Choice { model: Kind::Full, reason: ModelReason { why, warning: None } };
    }
    let fits = |kind: &Kind| situation.load(*kind) <= 1.0;
    let is_other = |kind: &Kind| *kind != Kind::Full && situation.possible.contains(kind);
    let others: Vec<Kind> = Kind::ALL.into_iter().filter(is_other).collect();
    let full = situation.full_in_words("would take");
    if let Some(&model) = others.iter().filter(|kind| fits(kind)).find(|kind| expected_error_pct(**kind) <= error) {
        let why = format!(
            "{full}; {} meets {error} % (19 of 20 random scenes: {} %)",
            model.name(),
            expected_error_pct(model)
        );
        return Choice { model, reason: ModelReason { why, warning: None } };
    }
    let by_error = |a: &&Kind, b: &&Kind| expected_error_pct(**a).total_cmp(&expected_error_pct(**b));
    if let Some(share) = situation.tight_share() {
        let why = format!("{}, and no other model that fits meets {error} %", situation.full_in_words("takes"));
        let percent = 100.0 * share;
        let warning = Some(format!("the typical tick takes {percent:.0} % of its period, some will be late"));
        return Choice { model: Kind::Full, reason: ModelReason { why, warning } };
    }
    if let Some(&model) = others.iter().filter(|kind| fits(kind)).min_by(by_error) {
        let name = model.name();
        // The one that would have been nearest, if it only fitted.
        let why = match others.iter().filter(|kind| !fits(kind)).min_by(by_error) {
            Some(&better) if expected_error_pct(better) < expected_error_pct(model) => {
                format!("{full}, and {}; {name} is the best that fits", situation.excess(better))
            }
            _ => format!("{full}; {name} is the best that fits this body"),
        };
        let expected = expected_error_pct(model);
        let warning = Some(unsure(error, model, expected));
        return Choice { model, reason: ModelReason { why, warning } };
    }
    let by_load = |a: &Kind, b: &Kind| situation.load(*a).total_cmp(&situation.load(*b));
    let model = situation.possible.iter().copied().min_by(|a, b| by_load(a, b).then(by_error(&a, &b)));
    let model = model.unwrap_or(Kind::Full);
    let expected = expected_error_pct(model);
    let why = format!("{full}, and {}; {} asks for least", situation.excess(model), model.name());
    let warning = format!("no model fits this machine with a margin, and an error of {expected} % is to be expected");
    Choice { model, reason: ModelReason { why, warning: Some(warning) } }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Two substeps at 1 kHz and 30 Hz on two cores, 42 ticks ahead, 1 % wanted, every model possible.
    fn situation(evaluation_us: u64) -> Situation {
        Situation {
            evaluation: Nanos(evaluation_us * 1000),
            origin: "measured",
            stride: 1,
            substeps: 2,
            haptic_period_s: 1e-3,
            global_period_s: 1.0 / 30.0,
            ahead_ticks: 42,
            ahead_share: 1.0,
            cores: 2,
            error_pct: 1.0,
            states: 50,
            devices: 1,
            possible: Kind::ALL.to_vec(),
        }
    }

    /// A tick of `full` takes more than half of its period, and the look ahead of the others is short.
    fn beyond_full() -> Situation {
        Situation { ahead_ticks: 20, ..situation(220) }
    }

    #[track_caller]
    fn assert_chosen(situation: &Situation, model: Kind, why: &[&str], warning: Option<&str>) {
        let choice = choose(situation);
        let text = choice.to_string();
        assert_eq!(choice.model, model, "{text}");
        assert!(why.iter().all(|words| choice.reason.why.contains(words)), "{why:?} in {text}");
        match (&choice.reason.warning, warning) {
            (None, None) => {}
            (Some(given), Some(words)) => assert!(given.contains(words), "{words:?} in {text}"),
            _ => panic!("{text}"),
        }
    }

    #[test]
    fn nothing_beats_full_where_it_fits_however_much_error_is_allowed() {
        for error_pct in [0.1, 1.0, 50.0] {
            let small = Situation { error_pct, ..situation(38) };
            assert_chosen(&small, Kind::Full, &["takes 95 us of 1 ms (measured)", "nothing beats full"], None);
        }
    }

    #[test]
    fn over_a_link_a_model_is_chosen_that_has_one() {
        let of = |evaluation_us, error_pct| {
            let possible = Kind::ALL.into_iter().filter(|kind| *kind != Kind::Full).collect();
            Situation { possible, error_pct, ..situation(evaluation_us) }
        };
        let why = ["full has no global model beyond the link", "predictive meets 10 %"];
        assert_chosen(&of(38, 10.0), Kind::Predictive, &why, None);
        // A tight one is none either.
        assert_chosen(&of(315, 1.0), Kind::Condensed, &["beyond the link"], Some("condensed may be 42 % off"));
    }

    #[test]
    fn full_is_one_model_for_all_devices_and_the_others_are_one_for_each() {
        let of = |devices| Situation { devices, ..situation(38) };
        assert_eq!(of(4).load(Kind::Full), of(1).load(Kind::Full));
        assert_chosen(&of(4), Kind::Full, &["takes 95 us of 1 ms", "nothing beats full"], None);
    }

    #[test]
    fn predictive_is_chosen_where_full_does_not_fit_and_the_global_period_holds_the_prediction() {
        let why = ["would take 550 us of 1 ms (measured)", "predictive meets 10 %", "19 of 20 random scenes: 1.8 %"];
        assert_chosen(&Situation { error_pct: 10.0, ..beyond_full() }, Kind::Predictive, &why, None);
        // Most scenes are within 1 %, but not 19 of 20.
        let farther = Situation { ahead_ticks: 2, ..situation(350) };
        assert_chosen(&farther, Kind::Predictive, &["the best that fits"], Some("predictive may be 1.8 % off"));
    }

    #[test]
    fn of_a_large_body_a_part_runs_ahead_and_predictive_fits_where_full_does_not() {
        // 0.85 of a core to follow the tool, and 1.26 times that to run all of the body ahead.
        let whole = Situation { error_pct: 10.0, ..situation(340) };
        assert_ne!(choose(&whole).model, Kind::Predictive);
        let part = Situation { ahead_share: 0.1, ..whole };
        assert_chosen(&part, Kind::Predictive, &["would take 850 us of 1 ms", "predictive meets 10 %"], None);
    }

    #[test]
    fn a_cheaper_model_is_chosen_where_so_much_error_is_allowed() {
        for (error_pct, model) in [(45.0, Kind::Condensed), (65.0, Kind::Hold), (8.0, Kind::Predictive)] {
            let choice = choose(&Situation { error_pct, ..beyond_full() });
            assert!(choice.model == model && choice.reason.warning.is_none(), "{choice}");
        }
    }

    #[test]
    fn a_tight_full_is_better_than_a_model_that_is_wrong() {
        let why = ["takes 788 us of 1 ms", "no other model that fits meets 1 %"];
        assert_chosen(&situation(315), Kind::Full, &why, Some("takes 79 % of its period, some will be late"));
        // On a single core both rates would not fit for `predictive`.
        assert_chosen(&Situation { cores: 1, ..situation(240) }, Kind::Full, &["takes 600 us"], Some("60 %"));
    }

    #[test]
    fn what_misses_the_error_is_said_with_by_how_much_and_what_was_too_dear() {
        let why =
            ["would take 875 us of 1 ms", "would need 65.9 ms of 33.3 ms for predictive", "condensed is the best"];
        assert_chosen(&situation(350), Kind::Condensed, &why, Some("condensed may be 42 % off"));
        // A body that is not made of springs.
        let possible = vec![Kind::Hold, Kind::Patch, Kind::LinearBoundary, Kind::ScaledBoundary, Kind::Full];
        let own = Situation { possible, ..situation(350) };
        assert_chosen(&own, Kind::Hold, &["the best that fits this body"], Some("error_pct = 1 is not sure"));
    }

    #[test]
    fn a_tick_of_a_patch_has_to_fit_too() {
        // At 20 kHz and 4 substeps a predictive patch takes 30 us of 50 us.
        let fast = Situation { haptic_period_s: 5e-5, ahead_ticks: 840, substeps: 4, error_pct: 10.0, ..situation(9) };
        assert_chosen(&fast, Kind::Condensed, &["a tick of predictive would take 30 us of 50 us"], Some("not sure"));
    }

    #[test]
    fn the_least_load_is_left_where_nothing_fits() {
        for cores in [1, 2] {
            let choice = choose(&Situation { cores, ..situation(5000) });
            assert!(![Kind::Full, Kind::Predicted, Kind::Predictive].contains(&choice.model), "{choice}");
            assert!(choice.reason.warning.is_some_and(|warning| warning.contains("no model fits")));
        }
    }
}
