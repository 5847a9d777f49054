//! The worst moments for the script, as JSON inside the page.

use super::super::causes::{CAUSES, name, sign};
use super::super::summary::{at, what_happened};
use super::view::{Bar, Lane, Trace, View};
use crate::drawing::html::JsonString;

/// The moments as JSON that cannot end the script element around it.
///
/// Times are nanoseconds from when the worst tick was due. A tick is `[tick, due, lateness, start, execution, deadline, missed,
/// cause, [[cause, from, to], ...] of what was skipped before it, [what each actor took]]`.
pub(crate) fn data(views: &[View<'_>]) -> String {
    let causes = list(CAUSES, |cause| {
        let (number, name, path) = (cause as u8, JsonString(name(cause)), JsonString(&sign(cause).path(0.0, 0.0)));
        format!("{{\"number\":{number},\"name\":{name},\"sign\":{path}}}")
    });
    format!("{{\"causes\":{causes},\n\"moments\":{}}}", list(views, moment))
}

fn moment(view: &View<'_>) -> String {
    let span = |[from, to]: [palpate::runtime::Nanos; 2]| format!("[{},{}]", view.relative(from), view.relative(to));
    let place = view.place().map_or("null".to_owned(), |(lane, tick)| format!("[{lane},{tick}]"));
    format!(
        "\n{{\"due_s\":{},\"range\":{},\"focus\":{},\"worst\":{place},\"title\":{},\"words\":{},\"lanes\":{},\"forces\":{}}}",
        view.due.as_secs_f64(),
        span(view.range),
        span(view.focus),
        JsonString(&format!("{} at {}", view.worst.group, at(view.worst))),
        JsonString(&what_happened(view.worst).replace('`', "")),
        list(&view.lanes, |one| lane(view, one)),
        list(&view.traces, |trace| force(view, trace))
    )
}

fn lane(view: &View<'_>, lane: &Lane<'_>) -> String {
    let actors = list(&lane.actors, |actor| JsonString(actor).to_string());
    let ticks = list(&lane.bars, |bar| tick(view, lane, bar));
    format!("{{\"name\":{},\"actors\":{actors},\"ticks\":{ticks}}}", JsonString(&lane.name))
}

fn tick(view: &View<'_>, lane: &Lane<'_>, bar: &Bar<'_>) -> String {
    let timing = bar.timing;
    let lateness = timing.woke.saturating_sub(timing.scheduled).0;
    let execution = timing.end.saturating_sub(timing.start).0;
    let [due, start, deadline] = [timing.scheduled, timing.start, timing.deadline].map(|time| view.relative(time));
    let skipped = list(bar.skipped(lane.period), |(cause, from, to)| {
        format!("[{},{},{}]", cause as u8, view.relative(from), view.relative(to))
    });
    let spent = list(bar.spent, |spent| spent.0.to_string());
    let (missed, cause) = (u8::from(timing.missed()), timing.cause as u8);
    let number = timing.tick;
    format!("[{number},{due},{lateness},{start},{execution},{deadline},{missed},{cause},{skipped},{spent}]")
}

/// Only what is finite: JSON has no other numbers.
fn force(view: &View<'_>, trace: &Trace) -> String {
    let number = |value: f64| if value.is_finite() { format!("{value:.4}") } else { "null".to_owned() };
    let points = list(&trace.points, |&(time, force, commanded)| {
        let commanded = commanded.map_or("null".to_owned(), number);
        format!("[{},{},{commanded}]", view.relative(time), number(force))
    });
    format!("{{\"name\":{},\"points\":{points}}}", JsonString(&trace.name))
}

fn list<T>(items: impl IntoIterator<Item = T>, of: impl Fn(T) -> String) -> String {
    format!("[{}]", items.into_iter().map(of).collect::<Vec<_>>().join(","))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lists_are_json() {
        assert_eq!(list([1, 2], |n| n.to_string()), "[1,2]");
        assert!(data(&[]).ends_with("\"moments\":[]}"));
    }
}
