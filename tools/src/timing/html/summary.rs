//! The top of the page: who was late, why, and what it did to the force, in ten seconds.

use std::fmt::Write;

use palpate::report::RunVerdict;

use super::causes::words;
use super::named_figures::Numbers;
use crate::drawing::html::{escaped, sentence};
use crate::timing::{TimingReport, WorstTick};
use crate::units::{duration, force, plural};

/// Groups that get a card of their own.
const GROUP_CARDS: usize = 2;

const CHAPTERS: &str = "<nav aria-label=\"Chapters\"><a href=\"#groups\">Groups</a> <a href=\"#lateness\">Lateness</a> \
    <a href=\"#worst\">Worst ticks</a> <a href=\"#force\">Force and model age</a> <a href=\"#environment\">Environment</a></nav>\n";

/// Verdict, the worst that happened, key figures.
pub(crate) fn summary(report: &TimingReport, name: &str, numbers: &Numbers) -> String {
    let (verdict, reason) = report.run.verdict();
    let class = match verdict {
        RunVerdict::Ok => "good",
        RunVerdict::Incomplete | RunVerdict::Restarted => "fair",
        RunVerdict::Late | RunVerdict::Failed => "bad",
    };
    let mut out = format!(
        "<header>\n<p class=\"faint\">Timing of <code>{}</code></p>\n\
         <h1 class=\"{class}\"><span class=\"verdict\">{}</span> {}</h1>\n<p class=\"lead\">{}</p>\n",
        escaped(name),
        verdict.name(),
        escaped(&reason),
        sentence(&worst_in_words(report))
    );
    if report.run.is_virtual() {
        out.push_str("<p class=\"note\">Virtual time: lateness is zero by construction and not measured.</p>\n");
    }
    for (what, text) in [("Damaged log: ", report.run.damage.as_deref()), ("", lost(report).as_deref())] {
        if let Some(text) = text {
            let _ = writeln!(out, "<p class=\"note\">{what}{}</p>", escaped(text));
        }
    }
    out.push_str(&cards(report, numbers));
    out.push_str(CHAPTERS);
    out.push_str("</header>\n");
    out
}

fn lost(report: &TimingReport) -> Option<String> {
    let lost = report.run.lost_records();
    (lost > 0).then(|| format!("{} lost: what follows lacks them.", plural(lost, "record was", "records were")))
}

/// The worst tick in one or two sentences.
pub(crate) fn worst_in_words(report: &TimingReport) -> String {
    let Some(worst) = report.worst.first() else {
        let latest = report.run.groups.iter().max_by_key(|group| group.lateness.max);
        return match latest.filter(|group| group.lateness.count > 0) {
            None => "There is nothing to look at: no release of any group is in the log.".to_owned(),
            Some(group) if group.lateness.max == 0 => "No release took any time that was measured.".to_owned(),
            Some(group) => format!(
                "The latest wake-up was `{}`'s, {} after it was due; the log does not say which release it was.",
                group.name,
                duration(group.lateness.max)
            ),
        };
    };
    if !worst.is_trouble() {
        return format!(
            "Nobody was late. The closest call: `{}` was done {} after it was due at {}, which is {:.0} % of its deadline.",
            worst.group,
            duration(worst.overdue.0),
            at(worst),
            100.0 * worst.severity
        );
    }
    format!("Worst: `{}` at {}, {}", worst.group, at(worst), what_happened(worst))
}

/// The moment of a tick.
pub(crate) fn at(worst: &WorstTick) -> String {
    format!("{:.4} s", worst.timing.scheduled.as_secs_f64())
}

/// What was wrong with a tick, why, and what came of it.
pub(crate) fn what_happened(worst: &WorstTick) -> String {
    let mut text = format!("done {} after it was due", duration(worst.overdue.0));
    if worst.is_trouble() {
        let _ = write!(text, " ({:.1} deadlines)", worst.severity);
        match worst.timing.slips {
            0 => text.push_str(", deadline missed"),
            slips => {
                let _ = write!(text, ", {} skipped", plural(slips.into(), "period", "periods"));
            }
        }
        let _ = write!(text, ": {}", words(worst.cause));
    }
    if !worst.meanwhile.is_empty() {
        let names: Vec<String> = worst.meanwhile.iter().map(|name| format!("`{name}`")).collect();
        let _ = write!(text, "; meanwhile {} was at work", names.join(" and "));
    }
    text.push('.');
    match worst.force_step_n {
        Some(0.0) => text.push_str(" The force did not change there."),
        Some(step) => {
            let _ = write!(text, " The force changed there by at most {} from one tick to the next.", force(step));
        }
        None => {}
    }
    text
}

fn cards(report: &TimingReport, numbers: &Numbers) -> String {
    let mut cards: Vec<(String, String)> = vec![
        ("run time".to_owned(), numbers.show("duration")),
        ("periods skipped".to_owned(), numbers.show("skipped")),
        ("deadlines missed".to_owned(), numbers.show("missed")),
    ];
    let foreground = report.groups.iter().filter(|group| !group.background && group.lateness.percentiles.max > 0);
    for group in foreground.take(GROUP_CARDS) {
        for (what, figure) in [("p99", "p99"), ("max", "max")] {
            let figure = numbers.show(&format!("{}.lateness.{figure}", group.name));
            cards.push((format!("{} lateness, {what}", group.name), figure));
        }
    }
    for device in &report.run.devices {
        let prefix = if device.name.is_empty() { String::new() } else { format!("{}.", device.name) };
        let of = |what: &str| match device.name.as_str() {
            "" => what.to_owned(),
            name => format!("{name}: {what}"),
        };
        if device.resyncs.jump_after_n.count > 0 {
            let figure = numbers.show(&format!("{prefix}resync.jump_after.max"));
            cards.push((of("largest resync step"), figure));
        }
        if device.force.ticks > 0 {
            cards.push((of("model age, p99"), numbers.show(&format!("{prefix}force.model_age.p99"))));
            cards.push((of("peak force"), numbers.show(&format!("{prefix}force.peak"))));
        }
    }
    let busiest = report.cores.iter().filter_map(|core| Some((core.cpu?, core.share())));
    if let Some((cpu, _)) = busiest.max_by(|a, b| a.1.total_cmp(&b.1)) {
        cards.push((format!("busy on core {cpu}"), numbers.show(&format!("core{cpu}.utilisation"))));
    }
    cards.push(("records lost".to_owned(), numbers.show("lost_records")));
    let mut out = String::from("<dl class=\"cards\">\n");
    for (what, figure) in cards {
        let _ = writeln!(out, "<div><dt>{}</dt><dd>{figure}</dd></div>", escaped(&what));
    }
    out.push_str("</dl>\n");
    out
}

#[cfg(test)]
mod tests {
    use super::*;
    use palpate::runtime::Nanos;
    use palpate::runtime::{SlipCause, TickTiming};

    #[test]
    fn the_worst_is_told_with_its_cause_and_what_it_did() {
        let timing = TickTiming {
            scheduled: Nanos(1_234_500_000),
            end: Nanos(1_234_800_000),
            deadline: Nanos(1_235_500_000),
            slips: 7,
            ..TickTiming::default()
        };
        let worst = WorstTick {
            group: "local".into(),
            timing,
            overdue: Nanos(7_300_000),
            severity: 7.3,
            cause: SlipCause::LateWake,
            meanwhile: vec!["global".into()],
            force_step_n: Some(0.3),
            ..WorstTick::default()
        };
        let report = TimingReport { worst: vec![worst], ..TimingReport::default() };
        let expected = "Worst: `local` at 1.2345 s, done 7.30 ms after it was due (7.3 deadlines), 7 periods skipped: its thread \
                        was woken too late: the system or another thread had the core; meanwhile `global` was at work. The \
                        force changed there by at most 300 mN from one tick to the next.";
        assert_eq!(worst_in_words(&report), expected);
    }
}
