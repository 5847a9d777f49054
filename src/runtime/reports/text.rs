//! Numbers as people read them, the same in every table.

use crate::records::timing::SlipCounts;
use crate::time::Nanos;

/// A share in per cent, to one place.
pub(crate) fn percent(share: f64) -> String {
    format!("{:.1} %", 100.0 * share)
}

/// A time in the unit that keeps it short, to three places.
pub(crate) fn short(time: Nanos) -> String {
    let (unit, name) = match time.0 {
        0 => return "0".to_owned(),
        1..1_000_000 => (1e3, "us"),
        1_000_000..1_000_000_000 => (1e6, "ms"),
        _ => (1e9, "s"),
    };
    format!("{} {name}", places(time.0 as f64 / unit))
}

/// A measured time in the unit that keeps it short, to three figures: a percentile of a histogram is no more exact.
pub(crate) fn measured(time: Nanos) -> String {
    let unit = 10_u64.pow(time.0.max(1).ilog10().saturating_sub(2));
    short(Nanos((time.0 + unit / 2) / unit * unit))
}

/// At most three places behind the point.
pub(crate) fn places(value: f64) -> String {
    let text = format!("{value:.3}");
    text.trim_end_matches('0').trim_end_matches('.').to_owned()
}

/// What was counted, cause by cause: `3 late wake, 1 long tick`; empty if nothing was.
pub(crate) fn by_cause(counts: &SlipCounts) -> String {
    let counted = counts.iter().filter(|(_, count)| *count > 0);
    counted.map(|(cause, count)| format!("{count} {}", cause.name())).collect::<Vec<_>>().join(", ")
}
