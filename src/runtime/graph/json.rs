//! The picture of a graph as JSON.

use crate::executor::Execution;
use crate::graph::view::{GraphGroup, GraphPort, GraphView, PortEnd};
use crate::primitives::histogram::Histogram;
use crate::records::timing::SlipCounts;
use crate::reports::group_live::GroupLive;

impl GraphView {
    /// The picture as JSON: one object with `execution`, `elapsed_ns`, `groups`, `ports` and `warnings`. Times are in
    /// nanoseconds.
    ///
    /// # Real-time
    /// Not real-time safe: allocates.
    pub fn to_json(&self) -> String {
        of(self)
    }
}

/// The whole picture: a line per group and port.
fn of(view: &GraphView) -> String {
    let execution = match view.execution {
        Execution::Virtual => "virtual",
        Execution::Threaded => "threaded",
    };
    let elapsed = optional(view.elapsed.map(|elapsed| elapsed.0));
    let groups = lines(view.groups.iter().map(group));
    let ports = lines(view.ports.iter().map(|port| self::port(view, port)));
    let warnings = lines(view.warnings.iter().map(|warning| string(warning)));
    format!(
        "{{\n\"execution\": \"{execution}\",\n\"elapsed_ns\": {elapsed},\n\"groups\": [{groups}],\n\"ports\": [{ports}],\n\
         \"warnings\": [{warnings}]\n}}\n"
    )
}

fn lines(items: impl Iterator<Item = String>) -> String {
    let items: Vec<_> = items.collect();
    if items.is_empty() { String::new() } else { format!("\n  {}\n", items.join(",\n  ")) }
}

fn group(group: &GraphGroup) -> String {
    let cores: Vec<_> = group.cores.iter().map(usize::to_string).collect();
    let actors: Vec<_> = group.actors.iter().map(|actor| string(actor)).collect();
    format!(
        "{{\"name\": {}, \"rate_hz\": {}, \"period_ns\": {}, \"deadline_ns\": {}, \"budget_ns\": {}, \"cores\": [{}], \
         \"policy\": {}, \"observer\": {}, \"actors\": [{}], \"measured\": {}}}",
        string(&group.name),
        group.rate.as_hz(),
        group.rate.period().0,
        group.deadline.0,
        optional(group.budget.map(|budget| budget.0)),
        cores.join(", "),
        string(&group.policy),
        group.observer,
        actors.join(", "),
        group.measured.as_ref().map_or("null".to_owned(), measured)
    )
}

fn measured(live: &GroupLive) -> String {
    format!(
        "{{\"released\": {}, \"skipped\": {}, \"missed\": {}, \"skipped_by_cause\": {}, \"missed_by_cause\": {}, \
         \"lateness_ns\": {}, \"execution_ns\": {}}}",
        live.released,
        live.skipped,
        live.missed,
        causes(&live.slips),
        causes(&live.misses),
        times(&live.lateness),
        times(&live.execution)
    )
}

fn causes(counts: &SlipCounts) -> String {
    let counts = counts.iter().filter(|(_, count)| *count > 0);
    let counts: Vec<_> = counts.map(|(cause, count)| format!("{}: {count}", string(cause.name()))).collect();
    format!("{{{}}}", counts.join(", "))
}

fn times(times: &Histogram) -> String {
    let [p50, p99] = [0.5, 0.99].map(|q| times.percentile(q).0);
    format!("{{\"count\": {}, \"p50\": {p50}, \"p99\": {p99}, \"max\": {}}}", times.count(), times.max().0)
}

fn port(view: &GraphView, port: &GraphPort) -> String {
    let end = |end: &PortEnd| string(&view.in_words(end));
    format!(
        "{{\"name\": {}, \"kind\": \"{}\", \"carries\": {}, \"from\": {}, \"to\": {}, \"sent\": {}, \"taken\": {}, \
         \"dropped\": {}}}",
        string(&port.name),
        port.kind.name(),
        string(&port.carries),
        end(&port.from),
        end(&port.to),
        port.sent,
        port.taken,
        port.dropped
    )
}

fn optional(number: Option<u64>) -> String {
    number.map_or("null".to_owned(), |number| number.to_string())
}

fn string(text: &str) -> String {
    let mut quoted = String::from('"');
    for c in text.chars() {
        match c {
            '"' | '\\' => quoted.extend(['\\', c]),
            c if c.is_control() => quoted.push_str(&format!("\\u{:04x}", u32::from(c))),
            c => quoted.push(c),
        }
    }
    quoted.push('"');
    quoted
}
