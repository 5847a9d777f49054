//! Lateness over the run, with what was skipped and missed above it.

use palpate::runtime::SlipCause;

use super::causes::{CAUSES, class, key, legend, name, sign};
use super::chart_figure_in_two;
use super::distributions::short;
use crate::drawing::svg::{Axis, Chart, Line, Mark, Signs};
use crate::timing::GroupTiming;
use crate::units::duration;

/// The rows of signs, below the upper edge of the plot, and what they need of it.
const ROWS: [f64; 2] = [9.0, 22.0];
const SIGNS_NEED: f64 = 32.0;
/// What a chart needs around its plot.
const AROUND_PLOT: f64 = 64.0;
/// Signs closer than this cover each other.
const APART: f64 = 7.0;

/// Where signs of a cause are: the times (s).
pub(crate) struct Troubles {
    pub(crate) cause: SlipCause,
    pub(crate) skipped: Vec<f64>,
    pub(crate) missed: Vec<f64>,
}

/// When periods were skipped and deadlines missed, by cause; those without any left out.
pub(crate) fn troubles(group: &GroupTiming) -> Vec<Troubles> {
    let middle = group.over_time.width().as_secs_f64() / 2.0;
    let found = CAUSES.into_iter().map(|cause| {
        let when = |count: fn(&crate::timing::TickBin, usize) -> u64| {
            let bins = group.over_time.iter().filter(|(_, bin)| count(bin, cause as usize) > 0);
            bins.map(|(from, _)| from.as_secs_f64() + middle).collect::<Vec<f64>>()
        };
        Troubles { cause, skipped: when(|bin, cause| bin.skipped[cause]), missed: when(|bin, cause| bin.missed[cause]) }
    });
    found.filter(|troubles| !troubles.skipped.is_empty() || !troubles.missed.is_empty()).collect()
}

/// The signs of `troubles` in a plot that shows `range` on so many drawn units.
pub(crate) fn signs(troubles: &[Troubles], range: [f64; 2], across: f64) -> Vec<Signs> {
    let apart = APART / across * (range[1] - range[0]);
    let mut signs = Vec::new();
    for Troubles { cause, skipped, missed } in troubles {
        for (times, what, row, hollow) in [(skipped, "skipped", ROWS[0], ""), (missed, "missed", ROWS[1], " hollow")] {
            let mut at: Vec<f64> = Vec::new();
            for &time in times {
                if at.last().is_none_or(|last| time - last >= apart) {
                    at.push(time);
                }
            }
            signs.push(Signs {
                class: format!("{}{hollow}", class(*cause)),
                name: format!("{what}: {}", name(*cause)),
                sign: sign(*cause),
                row,
                at,
            });
        }
    }
    signs.retain(|signs| !signs.at.is_empty());
    signs
}

/// Lateness over time of one group.
pub(crate) fn lateness(group: &GroupTiming, range: [f64; 2]) -> String {
    let middle = group.over_time.width().as_secs_f64() / 2.0;
    let bins = || group.over_time.iter().filter(|(_, bin)| bin.released > 0);
    let line = |class: &str, name: &'static str, value: fn(&crate::timing::TickBin) -> f64| Line {
        class: class.to_owned(),
        name,
        points: bins().map(|(from, bin)| (from.as_secs_f64() + middle, value(bin).max(1.0))).collect(),
    };
    let lines = [
        line("c4", "done after it was due, latest", |bin| bin.response_max as f64),
        line("c1", "lateness, largest", |bin| bin.lateness_max as f64),
        line("c3 dashed", "lateness, mean", |bin| bin.lateness_sum as f64 / bin.released as f64),
    ];
    let deadline = group.deadline.map(|deadline| deadline.0 as f64);
    let values = || lines.iter().flat_map(|line| &line.points).map(|point| point.1).filter(|&value| value > 1.0);
    if values().next().is_none() {
        return String::new();
    }
    let least = values().fold(f64::MAX, f64::min);
    let most = values().chain(deadline).fold(0.0, f64::max);
    let troubles = troubles(group);
    let draw = |size: [f64; 2]| {
        let down = size[1] - AROUND_PLOT;
        let (low, mut high) = (least / 1.3, most * 1.6);
        if !troubles.is_empty() {
            high *= (high / low).powf(SIGNS_NEED / (down - SIGNS_NEED));
        }
        let y = Axis::log("", [low, high]).in_words(short);
        let mut chart =
            Chart::new(format!("{}: lateness over time", group.name), size, Axis::linear("t (s)", range), y);
        chart.lines = lines.to_vec();
        chart.levels = deadline.map(|at| Mark { at, label: "deadline".to_owned() }).into_iter().collect();
        chart.signs = signs(&troubles, range, size[0] - AROUND_PLOT);
        chart.to_svg()
    };
    let causes: Vec<SlipCause> = troubles.iter().map(|troubles| troubles.cause).collect();
    let lines = [
        ("c1", "largest lateness"),
        ("c3 dashed", "mean lateness"),
        ("c4", "latest end of the work, counted from when it was due"),
    ];
    let more = format!("in each {} of the run", duration(group.over_time.width().0));
    chart_figure_in_two(draw, &(key(&lines, &more) + &legend(&causes)))
}
