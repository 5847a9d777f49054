//! The worst moments for the script, as JSON inside the page.

use std::fmt::Write;

use super::super::causes::{CAUSES, name, sign};
use super::super::summary::{at, what_happened};
use super::view::{Bar, Lane, Trace, View};
use crate::drawing::html::JsonString;

/// The moments as JSON that cannot end the script element around it.
///
/// Times are nanoseconds from when the worst tick was due. A tick is `[tick, due, lateness, start, execution, deadline, missed,
/// cause, [[cause, from, to], ...] of what was skipped before it, [what each actor took]]`.
pub(crate) fn data(views: &[View<'_>]) -> String {
    let causes = list(CAUSES.iter(), |out, &cause| {
        let (number, name, path) = (cause as u8, JsonString(name(cause)), JsonString(&sign(cause).path(0.0, 0.0)));
        let _ = write!(out, "{{\"number\":{number},\"name\":{name},\"sign\":{path}}}");
    });
    let moments = list(views.iter(), moment);
    format!("{{\"causes\":{causes},\n\"moments\":{moments}}}")
}

fn moment(out: &mut String, view: &View<'_>) {
    let span = |[from, to]: [palpate::runtime::Nanos; 2]| format!("[{},{}]", view.relative(from), view.relative(to));
    let place = view.place().map_or("null".to_owned(), |(lane, tick)| format!("[{lane},{tick}]"));
    let _ = write!(
        out,
        "\n{{\"due_s\":{},\"range\":{},\"focus\":{},\"worst\":{place},\"title\":{},\"words\":{},\"lanes\":{},\"forces\":{}}}",
        view.due.as_secs_f64(),
        span(view.range),
        span(view.focus),
        JsonString(&format!("{} at {}", view.worst.group, at(view.worst))),
        JsonString(&what_happened(view.worst).replace('`', "")),
        list(view.lanes.iter(), |out, one| lane(out, view, one)),
        list(view.traces.iter(), |out, trace| force(out, view, trace))
    );
}

fn lane(out: &mut String, view: &View<'_>, lane: &Lane<'_>) {
    let actors = list(lane.actors.iter(), |out, actor| {
        let _ = write!(out, "{}", JsonString(actor));
    });
    let ticks = list(lane.bars.iter(), |out, bar| tick(out, view, lane, bar));
    let _ = write!(out, "{{\"name\":{},\"actors\":{actors},\"ticks\":{ticks}}}", JsonString(&lane.name));
}

fn tick(out: &mut String, view: &View<'_>, lane: &Lane<'_>, bar: &Bar<'_>) {
    let timing = bar.timing;
    let lateness = timing.woke.saturating_sub(timing.scheduled).0;
    let execution = timing.end.saturating_sub(timing.start).0;
    let [due, start, deadline] = [timing.scheduled, timing.start, timing.deadline].map(|time| view.relative(time));
    let skipped = list(bar.skipped(lane.period).iter(), |out, &(cause, from, to)| {
        let _ = write!(out, "[{},{},{}]", cause as u8, view.relative(from), view.relative(to));
    });
    let spent = list(bar.spent.iter(), |out, spent| {
        let _ = write!(out, "{}", spent.0);
    });
    let (missed, cause) = (u8::from(timing.missed()), timing.cause as u8);
    let number = timing.tick;
    let _ =
        write!(out, "[{number},{due},{lateness},{start},{execution},{deadline},{missed},{cause},{skipped},{spent}]");
}

/// Only what is finite: JSON has no other numbers.
fn force(out: &mut String, view: &View<'_>, trace: &Trace) {
    let number = |value: f64| if value.is_finite() { format!("{value:.4}") } else { "null".to_owned() };
    let points = list(trace.points.iter(), |out, &(time, force, commanded)| {
        let commanded = commanded.map_or("null".to_owned(), number);
        let _ = write!(out, "[{},{},{commanded}]", view.relative(time), number(force));
    });
    let _ = write!(out, "{{\"name\":{},\"points\":{points}}}", JsonString(&trace.name));
}

fn list<T>(items: impl Iterator<Item = T>, mut write: impl FnMut(&mut String, T)) -> String {
    let mut out = String::from("[");
    for (place, item) in items.enumerate() {
        if place > 0 {
            out.push(',');
        }
        write(&mut out, item);
    }
    out.push(']');
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lists_are_json() {
        assert_eq!(list([1, 2].iter(), |out, n| out.push_str(&n.to_string())), "[1,2]");
        assert!(data(&[]).ends_with("\"moments\":[]}"));
    }
}
