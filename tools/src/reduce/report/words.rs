//! What a reduction comes to, in sentences.

use super::figures::{by, figure, hertz, percent, published_ratio, ratio, time};
use crate::reduce::findings::{Locality, MeasuredLocality, ReductionRow, ReductionStudy};
use crate::units::plural;

/// How the errors of the tables are to be read.
pub(super) const MEASURES: &str = "The paper does not define its % error. `error %` is 2 (sum of the Hankel singular values left out) / \
     (sum of all), the measure that fits its published column in trend and magnitude, not in digits; `H-inf %` is the largest error of the \
     frequency response over its largest gain. `ratio` is computed over published; nothing is fitted to it.";

/// Where the published rows say less than they seem to.
pub(super) const ROUNDING: &str = "Published errors below 1e-10 % are rounding: there the order asked for is above the numerical \
     rank, and fewer states are kept.";

/// How the errors of responses are to be read.
pub(super) const RESPONSES: &str = "Errors are norms of the difference over all channels, over the norm of the reference at the same \
     frequency. `estimate` is the model's own for its worst, made without the reference.";

/// How the maps are to be read.
pub(super) const LOCALITY: &str = "Errors are norms of the difference of the 3 x 3 dynamic stiffnesses of patch and whole body at the \
     contact, over the norm of the whole body's; between resyncs: rms over the logarithm of the frequency.";

/// Times of a debug build are no times.
pub(super) fn debug_note() -> Option<&'static str> {
    cfg!(debug_assertions).then_some("This is a debug build: its times are not those of a release build.")
}

/// Is it local or not, in a sentence.
pub fn locality_verdict(locality: &Locality) -> String {
    let verdict = match Extent::of(locality) {
        Extent::Throughout => "Local at this contact",
        Extent::BetweenResyncs => "Local at this contact between resyncs, not at rest",
        Extent::None => "Not local",
    };
    format!("{verdict}. {}", what_is_left_out(locality))
}

/// How far the paper's assumption holds at the contact.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Extent {
    /// Between resyncs and at rest.
    Throughout,
    /// Between resyncs: a push that is held is another one until the global model puts it right.
    BetweenResyncs,
    None,
}

impl Extent {
    /// A force at rest is as good as one between resyncs within the same limit.
    pub(super) fn of(locality: &Locality) -> Self {
        match locality.is_local {
            false => Self::None,
            true if locality.contact.at_rest_pct <= locality.band_limit_pct => Self::Throughout,
            true => Self::BetweenResyncs,
        }
    }
}

/// What the tables come to, in a sentence; `None` without tables.
pub(super) fn tables_verdict(study: &ReductionStudy) -> Option<String> {
    let rows: Vec<&ReductionRow> = study.tables.iter().flat_map(|table| &table.rows).collect();
    let count = rows.len();
    let stable = match rows.iter().filter(|row| !row.is_stable).count() {
        _ if count == 0 => return None,
        0 => "all of them stable".to_owned(),
        unstable => format!("{unstable} of them not stable"),
    };
    let ratios = rows.iter().copied().filter_map(published_ratio);
    let [low, high] = ratios.fold([f64::INFINITY, 0.0], |[low, high], ratio| [ratio.min(low), ratio.max(high)]);
    let errors = if low <= high {
        format!(", with {} to {} times the published errors", figure(low), figure(high))
    } else {
        String::new()
    };
    let timed = rows.iter().filter(|row| row.published_s.is_some());
    let [ours, theirs] = timed.fold([0.0, 0.0], |[a, b], row| [a + row.seconds, b + row.published_s.unwrap_or(0.0)]);
    let times = if theirs > 0.0 {
        format!("; {} for those that took the paper {}", time(ours), time(theirs))
    } else {
        String::new()
    };
    Some(format!("{}, {stable}{errors}{times}.", plural(count as u64, "reduced model", "reduced models")))
}

/// What the patch leaves out, in a sentence.
pub(super) fn what_is_left_out(locality: &Locality) -> String {
    let (low, high) = (hertz(locality.band_hz[0]), hertz(locality.band_hz[1]));
    let contact = &locality.contact;
    let worst = band_errors(locality).last().copied();
    let over = worst.map_or(String::new(), |worst| {
        format!(", and {} between resyncs at the worst contact of the surface", percent(worst))
    });
    format!(
        "Without what lies outside the patch of {} nodes, the force at the contact is {} off between resyncs ({low} to {high} Hz) \
         and {} at rest{over}. It counts as local up to {} between resyncs and {} at rest.",
        by(&locality.patch),
        percent(contact.band_pct),
        percent(contact.at_rest_pct),
        percent(locality.band_limit_pct),
        percent(locality.at_rest_limit_pct),
    )
}

/// Errors in the band of all contacts, least first.
pub(super) fn band_errors(locality: &Locality) -> Vec<f64> {
    let contacts = locality.faces.iter().flat_map(|face| face.contacts.iter().flatten());
    let mut errors: Vec<f64> = contacts.map(|contact| contact.band_pct).filter(|error| error.is_finite()).collect();
    errors.sort_unstable_by(f64::total_cmp);
    errors
}

/// The contact that is looked at closely.
pub(super) fn contact(locality: &Locality) -> String {
    let contact = &locality.contact;
    let [x, y, z] = contact.position_m.map(|m| figure(1e3 * m));
    format!(
        "Contact: node {} at ({x}, {y}, {z}) mm, stiffness of the whole body along the normal {} N/m at rest; error of the patch \
         {} at rest, {} between resyncs (rms), {} at the worst frequency there.",
        contact.node,
        figure(contact.stiffness_n_per_m),
        percent(contact.at_rest_pct),
        percent(contact.band_pct),
        percent(contact.worst_pct),
    )
}

/// What the error budget needs.
pub(super) fn budget(locality: &Locality) -> Option<String> {
    let budget = locality.budget?;
    let patch = match budget.patch {
        Some(patch) => format!("a patch of {} nodes between held surroundings", by(&patch)),
        None => "no patch between held surroundings".to_owned(),
    };
    let states = match budget.states {
        Some(1) => "1 state of reduced surroundings (`predictive`)".to_owned(),
        Some(states) => format!("{states} states of reduced surroundings (`predictive`)"),
        None => "no number of states of reduced surroundings (`predictive`)".to_owned(),
    };
    Some(format!(
        "An error of {} between resyncs is met by {patch}, and by {states} around the scene's patch.",
        percent(budget.error_pct)
    ))
}

/// Predicted against measured.
pub(super) fn measured(measured: &MeasuredLocality) -> String {
    let pair = |measured: f64, predicted: f64| {
        let ratio = ratio(predicted, measured).map_or("-".to_owned(), figure);
        format!("{} (predicted {}, predicted / measured {ratio})", percent(measured), percent(predicted))
    };
    format!(
        "Measured in the time domain with the non-linear models: {} for twelve tones between resyncs, {} at rest.",
        pair(measured.measured_pct, measured.predicted_pct),
        pair(measured.measured_at_rest_pct, measured.predicted_at_rest_pct),
    )
}

/// What was made by what, and how long it took.
pub(super) fn facts(study: &ReductionStudy) -> String {
    let took = super::figures::time(study.seconds);
    format!("palpate {}; {took} for all of it", env!("CARGO_PKG_VERSION"))
}

#[cfg(test)]
mod tests {
    use super::super::sample::sample;
    use super::*;

    #[test]
    fn the_verdict_comes_first_and_has_its_figures() {
        let mut locality = sample().locality.unwrap();
        assert_eq!(
            locality_verdict(&locality),
            "Not local. Without what lies outside the patch of 4 x 4 x 2 nodes, the force at the contact is 7.20 % off between \
             resyncs (10 to 1000 Hz) and 64.0 % at rest, and 24.0 % between resyncs at the worst contact of the surface. It counts as \
             local up to 20.0 % between resyncs and 100 % at rest."
        );
        locality.is_local = true;
        locality.faces.clear();
        let verdict = locality_verdict(&locality);
        assert!(verdict.starts_with("Local at this contact between resyncs, not at rest. "), "{verdict}");
        assert!(verdict.contains("64.0 % at rest. It counts"), "{verdict}");
        locality.contact.at_rest_pct = 12.0;
        assert!(locality_verdict(&locality).starts_with("Local at this contact. "));
    }

    #[test]
    fn the_tables_have_a_sentence_without_ratios_to_rounding() {
        let mut study = sample();
        assert_eq!(
            tables_verdict(&study).unwrap(),
            "13 reduced models, 1 of them not stable, with 0.400 to 2.10 times the published errors; 37.8 ms for those that \
             took the paper 779 s."
        );
        study.tables.truncate(2);
        study.tables.remove(0);
        study.tables[0].rows.iter_mut().for_each(|row| row.published_s = None);
        assert_eq!(tables_verdict(&study).unwrap(), "2 reduced models, all of them stable.");
        study.tables.clear();
        assert_eq!(tables_verdict(&study), None);
    }

    #[test]
    fn a_budget_that_nothing_meets_says_so() {
        let mut locality = sample().locality.unwrap();
        assert!(budget(&locality).unwrap().contains("0.500 % between resyncs is met by a patch of 10 x 10 x 6 nodes"));
        let budget_of = locality.budget.as_mut().unwrap();
        (budget_of.patch, budget_of.states) = (None, Some(1));
        let words = budget(&locality).unwrap();
        assert!(words.contains("no patch between held") && words.contains("1 state of"), "{words}");
        locality.budget = None;
        assert_eq!(budget(&locality), None);
    }

    #[test]
    fn measured_and_predicted_have_their_ratio() {
        let words = measured(&sample().locality.unwrap().measured.unwrap());
        assert!(
            words.contains("6.00 % (predicted 7.20 %, predicted / measured 1.20) for twelve tones between resyncs"),
            "{words}"
        );
    }
}
