//! The charts of a distribution: histogram, percentile curve, execution by actor.

use palpate::runtime::Nanos;

use super::{HALF, chart_figure};
use crate::drawing::svg::{Axis, Bars, Chart, Line, Mark};
use crate::timing::{GroupTiming, Shape};
use crate::units::{duration, trimmed};

/// A quarter of an octave: room on both sides of a logarithmic axis.
const ROOM: f64 = 1.19;
/// A bar of one is as high as this below it.
const LEAST_COUNT: f64 = 0.5;

/// The distribution charts of one group.
pub(crate) fn charts(group: &GroupTiming) -> String {
    let mut out = String::from("<div class=\"charts\">\n");
    let deadline = group.deadline.map(|deadline| (deadline, "deadline"));
    if is_measured(&group.lateness) {
        let title = format!("{}: lateness", group.name);
        let svg = histogram(&title, "lateness", &group.lateness, "c1", deadline.as_slice());
        out.push_str(&chart_figure(
            &svg,
            "How often a wake-up was how late. Both axes are logarithmic: a single outlier is a bar.",
        ));
        let title = format!("{}: percentiles", group.name);
        out.push_str(&chart_figure(
            &percentile_curve(&title, &[("lateness", &group.lateness), ("execution", &group.execution)], deadline),
            "What share of the releases stayed below: each step to the right is ten times rarer. Solid: lateness; dashed: \
             execution.",
        ));
    }
    let budget = group.budget.map(|budget| (budget, "budget"));
    let limits: Vec<(Nanos, &str)> = budget.into_iter().chain(deadline).collect();
    if is_measured(&group.execution) {
        let title = format!("{}: execution", group.name);
        let svg = histogram(&title, "execution", &group.execution, "c2", &limits);
        let above = group.budget.map_or(String::new(), |budget| above_budget(&group.execution, budget));
        out.push_str(&chart_figure(&svg, &format!("How long a release worked, all actors together.{above}")));
    }
    for actor in group.actors.iter().filter(|actor| is_measured(&actor.execution)) {
        let title = format!("{}: execution of {}", group.name, actor.name);
        let svg = histogram(&title, "execution", &actor.execution, "c3", &limits);
        out.push_str(&chart_figure(
            &svg,
            "The part of this actor; budget and deadline are those of the whole release.",
        ));
    }
    out.push_str("</div>\n");
    out
}

/// What it means that releases are right of the line of their budget, if some are.
fn above_budget(execution: &Shape, budget: Nanos) -> String {
    if execution.percentiles.max <= budget.0 {
        return String::new();
    }
    // The share that is not above it, by the curve of all values.
    let within =
        execution.curve.iter().take_while(|&&(_, value)| value <= budget.0).last().map_or(0.0, |&(share, _)| share);
    format!(
        " Up to {:.0} % of them took longer than the budget of {}, which is what the schedule was checked with: the cores bore less \
         than was planned, and only the deadline says whether a release was late.",
        100.0 * (1.0 - within),
        short(budget.0 as f64)
    )
}

/// False if there is nothing, or all of it is zero: declared and not measured.
pub(crate) fn is_measured(shape: &Shape) -> bool {
    shape.percentiles.max > 0
}

/// A duration in ns as a label of an axis.
pub(crate) fn short(ns: f64) -> String {
    trimmed(duration(ns.round() as u64))
}

/// A count as a label of an axis.
fn count(count: f64) -> String {
    match count {
        1e6.. => format!("{} M", count / 1e6),
        1e3.. => format!("{} k", count / 1e3),
        _ => format!("{count}"),
    }
}

fn histogram(title: &str, what: &str, shape: &Shape, class: &str, limits: &[(Nanos, &str)]) -> String {
    let ends = |values: [f64; 2]| [values[0] / ROOM, values[1] * ROOM];
    let first = shape.bins.first().map_or(1.0, |bin| bin.from);
    let last = shape.bins.last().map_or(1.0, |bin| bin.to);
    // A limit far away would squeeze the distribution: it is shown if it is within two decades.
    let shown: Vec<&(Nanos, &str)> = limits.iter().filter(|limit| (limit.0.0 as f64) < 100.0 * last).collect();
    let limit = shown.iter().map(|limit| limit.0.0 as f64);
    let range = limit.fold([first, last], |[low, high], at| [low.min(at), high.max(at)]);
    let highest = shape.bins.iter().map(|bin| bin.count).max().unwrap_or(1) as f64;
    let x = Axis::log(what, ends(range)).in_words(short);
    let y = Axis::log("releases", [LEAST_COUNT, 2.0 * highest.max(5.0)]).in_words(count);
    let mut chart = Chart::new(title, HALF, x, y);
    let bars = shape.bins.iter().filter(|bin| bin.count > 0).map(|bin| (bin.from, bin.to, bin.count as f64)).collect();
    chart.bars = vec![Bars { class, name: what, bars }];
    let mark = |limit: &&(Nanos, &str)| Mark { at: limit.0.0 as f64, label: limit.1.to_owned() };
    chart.marks = shown.iter().map(mark).collect();
    chart.to_svg()
}

/// A share (%) of the axis of rarity: one in so many is beyond.
fn share(rarity: f64) -> String {
    let decimals = (rarity.log10().round() - 2.0).max(0.0) as usize;
    format!("{:.decimals$}", 100.0 * (1.0 - 1.0 / rarity))
}

fn percentile_curve(title: &str, shapes: &[(&str, &Shape)], deadline: Option<(Nanos, &str)>) -> String {
    let samples = shapes.iter().map(|(_, shape)| shape.percentiles.count).max().unwrap_or(1) as f64;
    // The maximum belongs to the end of the axis.
    let end = 2.0 * samples.max(5.0);
    let mut lines = Vec::new();
    let mut values = deadline.map_or([f64::MAX, 0.0], |(deadline, _)| [deadline.0 as f64; 2]);
    for (number, (name, shape)) in shapes.iter().enumerate() {
        let mut points = Vec::new();
        let mut before = None;
        for &(share, value) in &shape.curve {
            let (x, y) = (if share < 1.0 { 1.0 / (1.0 - share) } else { end }, (value as f64).max(1.0));
            // A step, as each value is one of the samples.
            points.extend(before.filter(|&before| before != y).map(|before| (x, before)));
            points.push((x, y));
            before = Some(y);
            values = [values[0].min(y), values[1].max(y)];
        }
        let dashed = if number > 0 { " dashed" } else { "" };
        lines.push(Line { class: format!("c{}{dashed}", number + 1), name, points });
    }
    let x = Axis::log("share of releases (%)", [1.0, end]).in_words(share);
    let y = Axis::log("", [values[0] / ROOM, values[1] * 2.0]).in_words(short);
    let mut chart = Chart::new(title, HALF, x, y);
    chart.lines = lines;
    chart.levels = deadline.map(|(at, label)| Mark { at: at.0 as f64, label: label.to_owned() }).into_iter().collect();
    chart.to_svg()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn labels_of_axes_are_short() {
        assert_eq!([1.0, 1e3, 2e5, 1e6].map(count), ["1", "1 k", "200 k", "1 M"]);
        assert_eq!([1.0, 10.0, 1e3, 1e6].map(share), ["0", "90", "99.9", "99.9999"]);
        assert_eq!([1.0, 1e4, 2e6, 1.5e9].map(short), ["1 ns", "10 us", "2 ms", "1.5 s"]);
    }
}
