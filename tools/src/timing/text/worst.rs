//! The worst ticks: who was late, why, and what it did to the force.

use palpate::report::Page;
use palpate::runtime::SlipCause;

use crate::timing::{TimingReport, WorstTick};
use crate::units::{duration, force, plural};

/// Periods shown on each side of a tick.
const NEIGHBOURS: u64 = 4;
/// From the lowest to the highest bar: each is twice as long after the release was due as the one before.
const BARS: [char; 8] =
    ['\u{2581}', '\u{2582}', '\u{2583}', '\u{2584}', '\u{2585}', '\u{2586}', '\u{2587}', '\u{2588}'];
/// The end of a bar that is lower than the highest: 1/16 of the deadline.
const LOWEST: f64 = 1.0 / 16.0;
const SKIPPED: char = 'x';
const UNKNOWN: char = '.';

/// The worst of them in a sentence, if it was too late.
pub(super) fn sentence(page: &mut Page, report: &TimingReport) {
    if let Some(worst) = report.worst.first().filter(|worst| worst.is_trouble()) {
        page.named("worst", &in_words(worst));
    }
}

/// What happened to one tick.
pub(crate) fn in_words(worst: &WorstTick) -> String {
    let at = worst.timing.scheduled.as_secs_f64();
    let mut text = format!("{} at {at:.3} s was overdue by {}", worst.group, duration(worst.overdue.0));
    let mut slowest = worst.actors.iter().max_by_key(|(_, spent)| *spent).into_iter();
    text += &match worst.cause {
        SlipCause::None if worst.is_trouble() => ", the log does not say why".to_owned(),
        SlipCause::None => ", in time".to_owned(),
        SlipCause::LongTick if worst.timing.missed() => {
            let took = worst.timing.end.saturating_sub(worst.timing.start).0;
            let by =
                slowest.next().map_or(String::new(), |(actor, spent)| format!(", {actor} {} of it", duration(spent.0)));
            format!(": its own work took {}{by}", duration(took))
        }
        SlipCause::LongTick => ": the release before took too long".to_owned(),
        SlipCause::LateWake => {
            let meanwhile = match worst.meanwhile.as_slice() {
                [] => String::new(),
                others => format!(" while {} worked", others.join(" and ")),
            };
            format!(": its thread was woken too late{meanwhile}")
        }
        SlipCause::StalledPeer => ": the device or another group did not deliver".to_owned(),
        SlipCause::Policy => ": the overrun policy gave periods up".to_owned(),
        SlipCause::Fault => ": it had failed and was started again".to_owned(),
    };
    if worst.timing.slips > 0 {
        text += &format!(", {} skipped", plural(worst.timing.slips.into(), "period", "periods"));
    }
    if let Some(step) = worst.force_step_n {
        text += &format!("; the force changed by at most {} in a tick", force(step));
    }
    text
}

/// One line for each, with its neighbours as bars.
pub(super) fn table(page: &mut Page, report: &TimingReport) {
    if report.worst.is_empty() {
        return;
    }
    page.line(String::new());
    page.line(format!(
        "{:<10}{:>8}{:>9}{:>9}{:>7}  {:<9}{:>9}  {}",
        "worst", "t (s)", "tick", "overdue", "of due", "around", "step", "cause"
    ));
    for worst in &report.worst {
        let group: String = worst.group.chars().take(9).collect();
        let step = worst.force_step_n.map_or("-".to_owned(), force);
        let skipped = match worst.timing.slips {
            0 => String::new(),
            slips => format!(", {slips}"),
        };
        let cause = match worst.cause {
            SlipCause::None if worst.is_trouble() => "not said",
            SlipCause::None => "in time",
            cause => cause.name(),
        };
        page.line(format!(
            "{group:<10}{:>8.3}{:>9}{:>9}{:>6.2}x  {:<9}{step:>9}  {cause}{skipped}",
            worst.timing.scheduled.as_secs_f64(),
            worst.timing.tick,
            duration(worst.overdue.0),
            worst.severity,
            around(worst),
        ));
    }
}

/// A bar for the time that each period around a tick took until it was done, `x` for a skipped one.
fn around(worst: &WorstTick) -> String {
    let own =
        |tick: u64| worst.moment.ticks.iter().find(|other| other.group == worst.timing.group && other.tick == tick);
    let skipped = |tick: u64| {
        let later = worst.moment.ticks.iter().filter(|other| other.group == worst.timing.group && other.tick > tick);
        later.min_by_key(|other| other.tick).is_some_and(|next| next.tick - tick <= u64::from(next.slips))
    };
    let tick = worst.timing.tick;
    let shown = tick.saturating_sub(NEIGHBOURS)..=tick.saturating_add(NEIGHBOURS);
    let bar = |tick: u64| match own(tick) {
        Some(other) => {
            let deadline = other.deadline.saturating_sub(other.scheduled).0.max(1);
            let share = other.end.saturating_sub(other.scheduled).0 as f64 / deadline as f64;
            let height = (share / LOWEST).max(1.0).log2().ceil() as usize;
            BARS[height.min(BARS.len() - 1)]
        }
        None if skipped(tick) => SKIPPED,
        None => UNKNOWN,
    };
    shown.map(bar).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::timing::analysis::Moment;
    use palpate::runtime::Nanos;
    use palpate::runtime::TickTiming;

    const MS: u64 = 1_000_000;

    fn worst() -> WorstTick {
        let tick = |tick: u64, took: u64, slips| TickTiming {
            tick,
            scheduled: Nanos(tick * MS),
            end: Nanos(tick * MS + took),
            deadline: Nanos((tick + 1) * MS),
            slips,
            cause: SlipCause::LateWake,
            ..TickTiming::default()
        };
        let timing = tick(14, 100_000, 2);
        WorstTick {
            group: "local".into(),
            timing,
            overdue: Nanos(2_100_000),
            severity: 2.1,
            cause: SlipCause::LateWake,
            meanwhile: vec!["global".into()],
            force_step_n: Some(0.25),
            moment: Moment {
                ticks: vec![tick(10, 10, 0), tick(11, 900_000, 0), timing, tick(15, 62_500, 0), tick(16, 9 * MS, 0)],
                ..Moment::default()
            },
            ..WorstTick::default()
        }
    }

    #[test]
    fn a_tick_is_shown_among_its_neighbours() {
        assert_eq!(around(&worst()), "\u{2581}\u{2585}xx\u{2582}\u{2581}\u{2588}..");
    }

    #[test]
    fn the_sentence_says_who_why_and_what_it_did() {
        let words = "local at 0.014 s was overdue by 2.10 ms: its thread was woken too late while global worked, \
                     2 periods skipped; the force changed by at most 250 mN in a tick";
        assert_eq!(in_words(&worst()), words);
    }
}
