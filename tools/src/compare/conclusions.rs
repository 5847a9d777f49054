//! What a comparison comes to, in sentences: where `full` is enough, where another model is worth it, and where none is.

use palpate::runtime::Nanos;

use super::figures::{ComparedRun, Comparison, Measured};
use super::{figure, latency_in_words, name};
use crate::units::duration;

/// Costs that differ by less are called the same: they are measured, and differ from run to run.
const MARGIN: f64 = 0.1;

/// Errors (% rms) that a model is asked to stay within.
const NEAR: [f64; 2] = [1.0, 5.0];

impl Comparison {
    /// The conclusions, one line each.
    ///
    /// `full` has no error, so another model can only win by cost: per haptic tick, which decides whether a rate can be kept,
    /// or in total, haptic and global group together.
    pub fn conclusions(&self) -> Vec<String> {
        if self.full.peak_n() == 0.0 {
            return vec!["`full` gives no force on this scene: there is nothing to compare".to_owned()];
        }
        let mut lines = vec![fit(self)];
        if self.runs.iter().any(|run| run.measured().is_some()) {
            lines.extend(against_full(self));
            lines.extend(NEAR.map(|limit| nearest(self, limit)));
        }
        lines.extend(own_error(self));
        let degraded = self.runs.iter().filter(|run| run.measured().is_some_and(|run| run.degraded > 0));
        lines.extend(degraded.map(|run| {
            let count = run.measured().map_or(0, |run| run.degraded);
            format!("{}: {count} releases gave a degraded result, such as a force that was not finite", name(run))
        }));
        if self.is_debug_build {
            lines
                .push("measured with a debug build: costs are several times those of `cargo run --release`".to_owned());
        }
        lines
    }
}

/// Does `full` fit the haptic tick, and how large might the body be?
fn fit(comparison: &Comparison) -> String {
    let (p99, period) = (comparison.full.cost.tick_p99, comparison.haptic_period);
    let nodes = comparison.nodes as f64 * period.0 as f64 / p99.0.max(1) as f64;
    let times = format!("CPU p99 {} of {}", duration(p99.0), duration(period.0));
    let line = format!(
        "cost grows with the nodes, so its p99 fits up to some {} nodes (a run is refused only where its least time does not fit)",
        two_digits(nodes)
    );
    match full_fits(comparison) {
        true => format!("`full` fits the haptic tick here ({times}): no other model is needed on this scene; {line}"),
        false => format!("`full` does not fit the haptic tick here ({times}): another model is needed; {line}"),
    }
}

/// True if `full` can keep the haptic rate on this machine.
pub(super) fn full_fits(comparison: &Comparison) -> bool {
    comparison.full.cost.tick_p99 <= comparison.haptic_period
}

/// Who is cheaper than `full` in which way, and who in none.
fn against_full(comparison: &Comparison) -> Vec<String> {
    let full = &comparison.full;
    let in_total = |run: &Measured| run.cost.total_load() < (1.0 - MARGIN) * full.cost.total_load();
    let per_tick = |run: &Measured| (run.cost.tick_p50.0 as f64) < (1.0 - MARGIN) * full.cost.tick_p50.0 as f64;
    let is_worse = |run: &Measured| run.error.rms > 0.0 && !in_total(run);
    let (load, margin) = (figure(1e3 * full.cost.total_load()), 100.0 * MARGIN);
    let no_gain = |run: &Measured| is_worse(run) && !per_tick(run);
    let said = |what: &str, asked: &dyn Fn(&Measured) -> bool| {
        let those = list(comparison, asked);
        (!those.is_empty()).then(|| format!("{what}: {}", those.join(", ")))
    };
    // That nothing is cheaper must be said; what nobody is besides need not be.
    let cheaper = format!("cheaper than `full` in total ({load} ms/s) by more than {margin} %");
    let cheaper = said(&cheaper, &in_total).unwrap_or_else(|| format!("{cheaper}: none"));
    let worse = said("worse than `full` in error and not cheaper in total", &is_worse);
    [Some(cheaper), worse, said("of these, not cheaper in a haptic tick either", &no_gain)]
        .into_iter()
        .flatten()
        .collect()
}

/// The cheapest per haptic tick within an error, for each latency.
fn nearest(comparison: &Comparison, limit: f64) -> String {
    let at = |latency: Nanos| {
        let within =
            |run: &&ComparedRun| run.latency == latency && run.measured().is_some_and(|run| run.error.rms <= limit);
        let tick = |run: &&ComparedRun| run.measured().map(|run| run.cost.tick_p50);
        let cheapest = comparison.runs.iter().filter(within).min_by_key(tick);
        let found = cheapest.and_then(|run| Some((&run.model, run.measured()?))).map(|(model, run)| {
            format!("{model} ({} %, {} per tick)", figure(run.error.rms), duration(run.cost.tick_p50.0))
        });
        format!("{} {}", in_words(comparison, latency), found.unwrap_or_else(|| "none".to_owned()))
    };
    let found: Vec<String> = comparison.latencies().into_iter().map(at).collect();
    format!("cheapest tick within {limit} % rms of `full`: {}", found.join("; "))
}

/// How far the reference is from finer ones, beside what the best local model adds.
fn own_error(comparison: &Comparison) -> Option<String> {
    let rms = |run: &ComparedRun| run.measured().map(|run| run.error.rms);
    let finer = comparison.finer.iter().filter_map(|run| Some((&run.model, rms(run)?)));
    let finer: Vec<String> = finer.map(|(name, rms)| format!("{name} {} %", figure(rms))).collect();
    let of_model = |run: &ComparedRun| Some((rms(run)?, name(run)));
    let best = comparison.runs.iter().filter_map(of_model).min_by(|a, b| a.0.total_cmp(&b.0));
    let best =
        best.map_or(String::new(), |(rms, name)| format!("; the nearest local model ({name}) adds {} %", figure(rms)));
    (!finer.is_empty()).then(|| format!("`full` itself is off from a finer one by (rms): {}{best}", finer.join(", ")))
}

/// The models of which runs are `asked` for; with the latency where that is not so for all latencies of the model.
fn list(comparison: &Comparison, asked: &dyn Fn(&Measured) -> bool) -> Vec<String> {
    let runs = || comparison.runs.iter().filter_map(|run| Some((run, run.measured()?)));
    let all = |model: &str| runs().filter(|(run, _)| run.model == model).all(|(_, measured)| asked(measured));
    let names = runs().filter(|(_, measured)| asked(measured)).map(|(run, _)| match all(&run.model) {
        true => run.model.clone(),
        false => format!("{} ({})", run.model, in_words(comparison, run.latency)),
    });
    let mut names: Vec<String> = names.collect();
    names.dedup();
    names
}

/// A latency in a sentence.
fn in_words(comparison: &Comparison, latency: Nanos) -> String {
    latency_in_words(comparison, latency, "in time")
}

/// A count with two digits that mean something.
fn two_digits(count: f64) -> String {
    let unit = 10_f64.powf((count.max(1.0).log10().floor() - 1.0).max(0.0));
    format!("{}", (count / unit).round() * unit)
}

#[cfg(test)]
mod tests {
    use super::super::figures::{ForceDeviation, ForceTrace, MeasuredDevice, ModelCost, RunOutcome};
    use super::*;

    fn measured(rms: f64, tick_us: u64, total: f64) -> Measured {
        let tick = Nanos(tick_us * 1000);
        let cost = ModelCost { tick_p50: tick, tick_p99: tick, haptic_load: total, ..ModelCost::default() };
        let trace = ForceTrace { forces_n: vec![[0.0, 0.0, 1.0]], ..ForceTrace::default() };
        let error = ForceDeviation { rms, ..ForceDeviation::default() };
        Measured::new(cost, 0, vec![MeasuredDevice { error, trace, ..MeasuredDevice::default() }])
    }

    fn comparison(full_us: u64, runs: &[(&str, u64, Measured)]) -> Comparison {
        let run = |(model, latency_ms, run): &(&str, u64, Measured)| ComparedRun {
            model: (*model).to_owned(),
            latency: Nanos(latency_ms * 1_000_000),
            outcome: RunOutcome::Measured(Box::new(run.clone())),
        };
        Comparison {
            nodes: 1000,
            haptic_period: Nanos(1_000_000),
            full: measured(0.0, full_us, full_us as f64 * 1e-3),
            runs: runs.iter().map(run).collect(),
            ..Comparison::default()
        }
    }

    #[test]
    fn full_is_said_to_fit_or_not_with_the_size_at_which_that_changes() {
        let fits = Comparison::conclusions(&comparison(100, &[])).concat();
        assert!(fits.contains("fits the haptic tick here (CPU p99 100 us of 1.00 ms)"), "{fits}");
        assert!(fits.contains("no other model is needed") && fits.contains("up to some 10000 nodes"), "{fits}");
        let not = Comparison::conclusions(&comparison(4100, &[])).concat();
        assert!(not.contains("does not fit the haptic tick") && not.contains("up to some 240 nodes"), "{not}");
    }

    #[test]
    fn models_are_named_where_they_win_and_where_they_never_do() {
        let lines = Comparison::conclusions(&comparison(
            100,
            &[
                ("hold", 0, measured(0.5, 2, 0.2)),
                ("hold", 33, measured(6.0, 1, 0.01)),
                ("patch", 0, measured(4.0, 7, 0.05)),
                ("patch", 33, measured(9.0, 200, 0.3)),
            ],
        ));
        let ends = [
            "in total (100 ms/s) by more than 10 %: hold (33 ms late), patch (in time)",
            "not cheaper in total: hold (in time), patch (33 ms late)",
            "not cheaper in a haptic tick either: patch (33 ms late)",
            "within 1 % rms of `full`: in time hold (0.500 %, 2.00 us per tick); 33 ms late none",
            "within 5 % rms of `full`: in time hold (0.500 %, 2.00 us per tick); 33 ms late none",
        ];
        let same = Comparison::conclusions(&comparison(
            100,
            &[("hold", 0, measured(0.5, 99, 0.099)), ("hold", 33, measured(0.5, 99, 0.101))],
        ));
        assert!(same[2].ends_with("total: hold") && same[3].ends_with("either: hold"), "{same:?}");
        assert_eq!(lines.len(), 1 + ends.len());
        for (line, end) in lines[1..].iter().zip(ends) {
            assert!(line.ends_with(end), "{line:?} does not end with {end:?}");
        }
    }

    #[test]
    fn a_scene_without_force_and_degraded_results_are_said() {
        let mut without = comparison(100, &[]);
        without.full.devices[0].trace.forces_n = vec![[0.0; 3]];
        assert!(without.conclusions().concat().contains("nothing to compare"));
        let run = Measured { degraded: 3, ..measured(1.0, 2, 0.2) };
        assert!(
            Comparison::conclusions(&comparison(100, &[("patch", 33, run)]))
                .concat()
                .contains("patch 33 ms late: 3 releases")
        );
    }

    // Check that results are not said to be in time where they come over a link.
    #[test]
    fn over_a_link_a_latency_is_what_is_added_to_it() {
        let runs = [("hold", 0, measured(0.5, 2, 0.2)), ("hold", 33, measured(6.0, 1, 0.01))];
        let link = palpate::scene::LinkSpec { delay_ms: 33.0, ..Default::default() };
        let comparison = Comparison { link: Some(link), ..comparison(100, &runs) };
        let text = comparison.conclusions().join("\n");
        assert!(!text.contains("in time") && !text.contains("ms late"), "{text}");
        assert!(
            text.contains("hold (with 33 ms added)") && text.contains("`full`: with nothing added hold ("),
            "{text}"
        );
    }
}
