//! A worst moment as a picture that needs no script: for print, and for those who switch scripts off.

use std::fmt::Write;

use palpate::runtime::Nanos;

use super::super::causes::{class, sign};
use super::super::distributions::short;
use super::view::{Lane, Trace, View};
use crate::drawing::html::escaped;
use crate::drawing::svg::round_step;

const WIDTH: f64 = 920.0;
const LEFT: f64 = 84.0;
const RIGHT: f64 = 12.0;
const LANE: f64 = 40.0;
const FORCE: f64 = 90.0;
const GAP: f64 = 14.0;
const FOOT: f64 = 36.0;
/// Where a bar lies in its lane, and the bar of the lateness.
const BAR: [f64; 2] = [12.0, 18.0];
const LATE: [f64; 2] = [19.0, 4.0];
/// A hatched span must be so wide to bear a sign.
const SIGN_NEEDS: f64 = 11.0;
/// Nothing is drawn narrower.
const LEAST_WIDTH: f64 = 0.7;

struct Picture<'a> {
    view: &'a View<'a>,
    svg: String,
}

/// The part around the worst tick as SVG.
pub(crate) fn still(view: &View<'_>, title: &str) -> String {
    let traces = if view.traces.is_empty() { 0.0 } else { GAP + FORCE };
    let lanes = LANE * view.lanes.len() as f64;
    let height = 8.0 + lanes + traces + FOOT;
    let mut picture = Picture { view, svg: String::new() };
    let title = escaped(title);
    let _ = writeln!(
        picture.svg,
        "<svg class=\"moment\" viewBox=\"0 0 {WIDTH} {height}\" role=\"img\" aria-label=\"{title}\">"
    );
    picture.axis(8.0, lanes + traces);
    for (number, lane) in view.lanes.iter().enumerate() {
        picture.lane(lane, 8.0 + LANE * number as f64);
    }
    if traces > 0.0 {
        picture.force(&view.traces, 8.0 + lanes + GAP);
    }
    picture.svg.push_str("</svg>\n");
    picture.svg
}

impl Picture<'_> {
    fn x(&self, time: Nanos) -> f64 {
        let [from, to] = self.view.focus.map(|time| self.view.relative(time) as f64);
        let place = (self.view.relative(time) as f64 - from) / (to - from).max(1.0);
        LEFT + place.clamp(0.0, 1.0) * (WIDTH - LEFT - RIGHT)
    }

    fn shows(&self, from: Nanos, to: Nanos) -> bool {
        to >= self.view.focus[0] && from <= self.view.focus[1]
    }

    fn text(&mut self, x: f64, y: f64, anchor: &str, text: &str) {
        let _ = writeln!(self.svg, "<text x=\"{x:.1}\" y=\"{y:.1}\" text-anchor=\"{anchor}\">{}</text>", escaped(text));
    }

    fn axis(&mut self, top: f64, down: f64) {
        let [from, to] = self.view.focus.map(|time| self.view.relative(time) as f64);
        let step = round_step(((to - from) / 6.0).max(1.0));
        let (first, last) = ((from / step).ceil() as i64, (to / step).floor() as i64);
        for tick in first..=last {
            let at = tick as f64 * step;
            let x = LEFT + (at - from) / (to - from).max(1.0) * (WIDTH - LEFT - RIGHT);
            let class = if tick == 0 { "due" } else { "grid" };
            let _ = writeln!(self.svg, "<path class=\"{class}\" d=\"M{x:.1} {top}v{down}\"/>");
            let sign = if at < 0.0 { "\u{2212}" } else { "" };
            self.text(x, top + down + 14.0, "middle", &format!("{sign}{}", short(at.abs())));
        }
        let words = format!("time from {:.6} s, when the worst tick was due", self.view.due.as_secs_f64());
        self.text(LEFT + 0.5 * (WIDTH - LEFT - RIGHT), top + down + 30.0, "middle", &words);
    }

    fn lane(&mut self, lane: &Lane<'_>, top: f64) {
        let name: String = lane.name.chars().take(12).collect();
        self.text(LEFT - 8.0, top + 25.0, "end", &name);
        let _ = writeln!(self.svg, "<path class=\"lane\" d=\"M{LEFT} {:.1}H{:.1}\"/>", top + LANE, WIDTH - RIGHT);
        let (mut late, mut work, mut deadlines) = (String::new(), String::new(), String::new());
        let mut above = String::new();
        for bar in &lane.bars {
            let timing = bar.timing;
            for (cause, from, to) in bar.skipped(lane.period) {
                if self.shows(from, to) {
                    let (x, end) = (self.x(from), self.x(to));
                    let wide = (end - x).max(LEAST_WIDTH);
                    let class = class(cause);
                    let _ = writeln!(
                        above,
                        "<rect class=\"skipped {class}\" x=\"{x:.1}\" y=\"{:.1}\" width=\"{wide:.1}\" height=\"{}\" fill=\"url(#hatch{})\"/>",
                        top + BAR[0],
                        BAR[1],
                        cause as u8
                    );
                    if wide >= SIGN_NEEDS {
                        let path = sign(cause).path(x + 0.5 * wide, top + 6.0);
                        let _ = writeln!(above, "<path class=\"sign {class}\" d=\"{path}\"/>");
                    }
                }
            }
            if !self.shows(timing.scheduled, timing.end.max(timing.deadline)) {
                continue;
            }
            let [due, woke, start, end, deadline] =
                [timing.scheduled, timing.woke, timing.start, timing.end, timing.deadline].map(|time| self.x(time));
            let rectangle = |into: &mut String, from: f64, to: f64, [y, high]: [f64; 2]| {
                let wide = (to - from).max(LEAST_WIDTH);
                let _ = write!(into, "M{from:.1} {:.1}h{wide:.1}v{high}h{:.1}z", top + y, -wide);
            };
            rectangle(&mut late, due, woke, LATE);
            if timing.missed() {
                let mut path = String::new();
                rectangle(&mut path, start, end, BAR);
                let class = class(timing.cause);
                let mark = sign(timing.cause).path((end - 5.0).max(start), top + 6.0);
                let _ = writeln!(
                    above,
                    "<path class=\"missed {class}\" d=\"{path}\"/><path class=\"sign hollow {class}\" d=\"{mark}\"/>"
                );
            } else {
                rectangle(&mut work, start, end, BAR);
            }
            if timing.deadline > timing.scheduled && self.shows(timing.deadline, timing.deadline) {
                let _ = write!(deadlines, "M{deadline:.1} {:.1}v{:.1}", top + 9.0, 24.0);
            }
            if *timing == self.view.worst.timing {
                let wide = (end - start).max(LEAST_WIDTH) + 4.0;
                let _ = writeln!(
                    above,
                    "<rect class=\"worst\" x=\"{:.1}\" y=\"{:.1}\" width=\"{wide:.1}\" height=\"{}\"/>",
                    start - 2.0,
                    top + BAR[0] - 2.0,
                    BAR[1] + 4.0
                );
            }
        }
        let _ = writeln!(
            self.svg,
            "<path class=\"deadlines\" d=\"{deadlines}\"/><path class=\"late\" d=\"{late}\"/><path class=\"work\" d=\"{work}\"/>\n{above}"
        );
    }

    fn force(&mut self, traces: &[Trace], top: f64) {
        let shown = |time: &Nanos| self.shows(*time, *time);
        let points = || traces.iter().flat_map(|trace| &trace.points).filter(|point| shown(&point.0));
        let values = points().flat_map(|point| [Some(point.1), point.2]).flatten().filter(|value| value.is_finite());
        let (low, high) =
            values.fold((f64::MAX, 0.0), |(low, high), value| (f64::min(low, value), f64::max(high, value)));
        if low > high {
            return;
        }
        // From zero, unless the force stays in a small range far from it.
        let low = if low > 0.6 * high { low - 0.15 * (high - low).max(1e-3 * high) } else { 0.0 };
        let high = if high > low { high + 0.05 * (high - low) } else { low + 1.0 };
        let place = |value: f64| top + FORCE * (1.0 - (value - low) / (high - low));
        let mut paths = String::new();
        for (number, trace) in traces.iter().enumerate() {
            let (mut before, mut after) = (String::new(), String::new());
            for (time, force, commanded) in trace.points.iter().filter(|point| shown(&point.0)) {
                let x = self.x(*time);
                let add = |into: &mut String, value: f64| {
                    if value.is_finite() {
                        let step = if into.is_empty() { 'M' } else { 'L' };
                        let _ = write!(into, "{step}{x:.1} {:.1}", place(value));
                    }
                };
                add(&mut before, *force);
                commanded.iter().for_each(|commanded| add(&mut after, *commanded));
            }
            let (first, second) = (2 * number % 6 + 1, 2 * number % 6 + 2);
            let _ = writeln!(
                paths,
                "<path class=\"line c{first}\" d=\"{before}\"/><path class=\"line dashed c{second}\" d=\"{after}\"/>"
            );
        }
        self.svg.push_str(&paths);
        let _ = writeln!(self.svg, "<path class=\"lane\" d=\"M{LEFT} {:.1}H{:.1}\"/>", top + FORCE, WIDTH - RIGHT);
        self.text(LEFT - 8.0, top + 0.5 * FORCE + 4.0, "end", "force");
        self.text(LEFT - 8.0, top + 9.0, "end", &crate::units::force(high));
        self.text(LEFT - 8.0, top + FORCE, "end", &crate::units::force(low));
    }
}
