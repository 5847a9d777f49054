//! The report for a terminal: a verdict, then who was late and why, then what it did to the force.
//!
//! It fits 80 columns; nothing that palpate says is cut off.

use std::fmt;

use super::page::{Page, shown};
use super::units::Quantity;
use crate::log::{DeviceReport, GroupSummary, LoggedExecution, Percentiles, RunReport};
use crate::runtime::SlipCounts;

const EVENTS_SHOWN: usize = 4;
/// Lines for what the system granted.
const GRANT_LINES: usize = 10;

impl fmt::Display for RunReport {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let mut page = Page::default();
        page.head(self);
        page.about(self);
        page.line(String::new());
        page.groups(self);
        page.line(String::new());
        let devices = self.devices.iter().filter(|device| !device.is_empty());
        devices.for_each(|device| page.haptics(self, device));
        page.events(self);
        f.write_str(&page.text)
    }
}

impl Page {
    /// Adds what a report begins with: the verdict in a line.
    pub fn head(&mut self, report: &RunReport) {
        let (verdict, reason) = report.verdict();
        self.paragraph(&format!("{}: {reason}", verdict.name()));
    }

    /// Adds what the run was: execution, model and why, what is switched off, what the system granted.
    pub fn about(&mut self, report: &RunReport) {
        let Some(environment) = &report.environment else { return };
        self.line(String::new());
        let execution = match environment.execution {
            LoggedExecution::Virtual => "virtual",
            LoggedExecution::Threaded { .. } => "threaded",
        };
        self.named(
            "run",
            &format!(
                "{execution}, model {}, palpate {}, {}",
                environment.model, environment.palpate_version, environment.instruction_set
            ),
        );
        environment.body.iter().for_each(|body| self.named("body", body));
        environment.tools.iter().for_each(|tools| self.named("tool", tools));
        if let Some(reason) = &environment.model_reason {
            self.named("model", &format!("{}: {}", environment.model, reason.why));
            reason.warning.iter().for_each(|warning| self.named("warning", warning));
        }
        if !environment.safety_off.is_empty() {
            self.named("SAFETY OFF", &environment.safety_off.join(", "));
        }
        environment.coupling.iter().for_each(|design| self.named("coupling", design));
        let shown = shown(environment.granted.len(), GRANT_LINES);
        for (i, (what, granted)) in environment.granted.iter().take(shown).enumerate() {
            self.named(if i == 0 { "granted" } else { "" }, &format!("{what}: {granted}"));
        }
        self.hidden(environment.granted.len() - shown);
    }

    /// Adds the rate groups: periods, causes of slips and misses, percentiles.
    pub fn groups(&mut self, report: &RunReport) {
        self.line(format!(
            "{:<11}{:>10}{:>11}{:>11}{:>11}{:>13}",
            "group", "rate", "released", "skipped", "missed", "lost records"
        ));
        for group in &report.groups {
            let rate = group.rate_hz.map_or("-".to_owned(), |hz| format!("{hz} Hz"));
            let (skipped, missed) = (group.skipped.total(), group.missed.total());
            self.line(format!(
                "{:<11}{rate:>10}{:>11}{skipped:>11}{missed:>11}{:>13}",
                short(&group.name),
                group.released,
                group.lost_records
            ));
        }
        for (what, of) in
            [("skipped", (|group| group.skipped) as fn(&GroupSummary) -> SlipCounts), ("missed", |group| group.missed)]
        {
            for group in report.groups.iter().filter(|group| of(group).total() > 0) {
                self.paragraph(&format!("  {} {what}: {}", group.name, causes(of(group))));
            }
        }
        self.line(String::new());
        if !report.is_virtual() {
            self.times(report);
        } else if report.groups.iter().any(is_timed) {
            self.times(report);
            self.line("virtual time: lateness, execution and period error are declared, not measured".to_owned());
        } else {
            self.line("virtual time: every release at its time, and takes none".to_owned());
        }
    }

    /// Adds the percentiles of the rate groups' times.
    fn times(&mut self, report: &RunReport) {
        self.line(format!(
            "{:<11}{:<13}{:>8}{:>9}{:>10}{:>10}{:>10}{:>9}",
            "", "", "samples", "p50", "p90", "p99", "p99.9", "max"
        ));
        for group in &report.groups {
            percentiles(self, short(&group.name), "lateness", group.lateness);
            // Other programs' logs may know the lateness alone.
            for (what, found) in others(group).into_iter().filter(|(_, found)| found.count > 0 || group.released == 0) {
                percentiles(self, "", what, found);
            }
        }
    }

    /// Adds the haptics of one device: resyncs, model age, contact, force, energy and limits.
    pub fn haptics(&mut self, run: &RunReport, report: &DeviceReport) {
        if run.devices.len() > 1 {
            self.named("DEVICE", &report.name);
        }
        let resyncs = &report.resyncs;
        self.named("resyncs", &resyncs.jump_before_n.count.to_string());
        if resyncs.jump_before_n.count > 0 {
            let of = |p: Percentiles<f64>, show: fn(f64) -> Quantity| {
                format!(
                    "p50 {:>9}   p99 {:>9}   max {:>9}",
                    show(p.p50).to_string(),
                    show(p.p99).to_string(),
                    show(p.max).to_string()
                )
            };
            self.named("  jump", &format!("before blending  {}", of(resyncs.jump_before_n, Quantity::Newtons)));
            self.named("", &format!("after blending   {}", of(resyncs.jump_after_n, Quantity::Newtons)));
            self.named(
                "  age",
                &format!("on arrival       {}", of(resyncs.age_ns.map(|ns| ns as f64 / 1e9), Quantity::Seconds)),
            );
            self.named("", &format!("at each tick     {}", of(report.force.model_age_s, Quantity::Seconds)));
        }
        let shares: Vec<String> =
            report.force.shares().map(|(model, share)| format!("{} {:.2} %", model.name(), 100.0 * share)).collect();
        if !shares.is_empty() {
            self.named("served by", &shares.join(", "));
        }
        let contact = report.contact;
        self.named(
            "contact",
            &format!(
                "free {}, stick {}, slip {}, lost {} (haptic ticks)",
                contact.free, contact.stick, contact.slip, contact.lost
            ),
        );
        if let Some(touch) = &report.touch {
            let pressure = Quantity::Pascals(touch.peak_pressure_pa);
            let area = Quantity::SquareMetres(touch.area_at_peak_m2);
            let places = touch.most_places;
            self.named(
                "touch",
                &format!("{places} places at most, mean pressure up to {pressure}, {area} at the largest force"),
            );
        }
        let not_finite = match report.force.not_finite {
            0 => String::new(),
            count => format!(", {count} not finite"),
        };
        self.named(
            "force",
            &format!(
                "peak {}, commanded {}{not_finite}",
                Quantity::Newtons(report.force.peak_n),
                Quantity::Newtons(report.force.peak_commanded_n)
            ),
        );
        if report.limits.ticks > 0 {
            let energy = report.limits.energy;
            let [least, last, tank] = [energy.least_j, energy.last_j, energy.least_tank_j].map(|j| 1e3 * j);
            self.named("energy", &format!("ledger least {least:.3} mJ, end {last:.3} mJ; tank least {tank:.3} mJ"));
        }
        if report.limits.limited > 0 {
            let stages = report.limits.stages.iter().map(|(name, count)| format!("{name} {count}"));
            let share = 100.0 * report.limits.share();
            self.named("limits", &format!("{} ({share:.2} % of ticks)", stages.collect::<Vec<_>>().join(", ")));
        }
    }

    /// Adds the first events, and what is wrong with the log.
    pub fn events(&mut self, report: &RunReport) {
        let count = report.event_count as usize;
        let shown = shown(count, EVENTS_SHOWN).min(report.events.len());
        for (i, event) in report.events.iter().take(shown).enumerate() {
            let name = if i == 0 { "events" } else { "" };
            self.named(name, &format!("{:.3} s {}: {}", event.time.as_secs_f64(), event.level.name(), event.message));
        }
        self.hidden(count - shown);
        if let Some(damage) = &report.damage {
            self.named("damage", damage);
        }
    }

    fn hidden(&mut self, count: usize) {
        if count > 0 {
            self.named("", &format!("and {count} more"));
        }
    }
}

fn percentiles(page: &mut Page, group: &str, what: &str, p: Percentiles<u64>) {
    let cell = |ns: u64| if p.count == 0 { "-".to_owned() } else { Quantity::Nanoseconds(ns).to_string() };
    let [p50, p90, p99, p999, max] = [p.p50, p.p90, p.p99, p.p999, p.max].map(cell);
    page.line(format!("{group:<11}{what:<13}{:>8}{p50:>9}{p90:>10}{p99:>10}{p999:>10}{max:>9}", p.count));
}

/// What is known of a group's times beside its lateness.
fn others(group: &GroupSummary) -> [(&'static str, Percentiles<u64>); 3] {
    [("execution", group.execution), ("period error", group.period_error), ("jitter", group.jitter)]
}

/// True if any of its times is not zero.
fn is_timed(group: &GroupSummary) -> bool {
    group.lateness.max > 0 || others(group).iter().any(|(_, found)| found.max > 0)
}

fn causes(counts: SlipCounts) -> String {
    let named = counts.iter().filter(|&(_, count)| count > 0);
    named.map(|(cause, count)| format!("{} {count}", cause.name())).collect::<Vec<_>>().join(", ")
}

/// A name that fits its column.
fn short(name: &str) -> &str {
    name.char_indices().nth(10).map_or(name, |(at, _)| &name[..at])
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::log::{Analysis, Environment, GroupInfo, Level, LogRecord, Resync, TextEvent};
    use crate::report::page::WIDTH;
    use crate::runtime::Nanos;
    use crate::runtime::{SlipCause, TickTiming};

    fn busy_report() -> RunReport {
        let mut analysis = Analysis::default();
        let names = ["haptic", "global", "a_rather_long_name", "device"];
        analysis.set_environment(&Environment {
            execution: LoggedExecution::Threaded { start_unix_ns: 1 },
            model: "patch".into(),
            groups: names.map(|name| GroupInfo::new(name, 29.97)).into(),
            granted: (0..30).map(|i| (format!("grant_{i}"), "refused by the system".into())).collect(),
            ..Environment::default()
        });
        for group in 0..4 {
            for cause in SlipCause::ALL.into_iter().skip(1) {
                analysis.push(&LogRecord::Tick(TickTiming {
                    group,
                    end: Nanos(u64::MAX),
                    slips: u32::MAX,
                    cause,
                    ..TickTiming::default()
                }));
            }
        }
        analysis.push(&LogRecord::Resync(Resync { jump_before_n: -1e4, ..Resync::default() }));
        for _ in 0..1000 {
            analysis.push_text(&TextEvent {
                level: Level::Warning,
                message: "priorité ".repeat(20),
                ..TextEvent::default()
            });
        }
        RunReport { damage: Some("the log is cut off".into()), ..analysis.report() }
    }

    #[test]
    fn even_a_busy_report_fits_eighty_columns_and_its_head_says_what_matters() {
        let text = busy_report().to_string();
        assert!(text.lines().all(|line| line.chars().count() <= WIDTH), "{text}");
        assert!(text.starts_with("LATE: 85899345900 periods skipped and 20 deadlines missed"), "{text}");
        assert!(text.contains("\n  haptic skipped: late wake 4294967295, long tick 4294967295"), "{text}");
        assert!(text.contains("  jump     before blending  p50   10000 N   p99   10000 N"), "{text}");
        assert!(text.contains("and 996 more"), "{text}");
    }

    #[test]
    fn a_normal_report_fits_forty_lines() {
        let mut analysis = Analysis::default();
        analysis.set_environment(&Environment {
            groups: vec![GroupInfo::new("haptic", 1000.0), GroupInfo::new("global", 30.0)],
            granted: (0..30).map(|i| (format!("grant_{i}"), "refused".into())).collect(),
            ..Environment::default()
        });
        for group in 0..2 {
            analysis.push(&LogRecord::Tick(TickTiming { group, ..TickTiming::default() }));
        }
        analysis.push(&LogRecord::Resync(Resync::default()));
        let text = analysis.report().to_string();
        assert!(text.lines().count() <= 40, "{text}");
        assert!(text.contains("every release at its time"), "{text}");
    }

    #[test]
    fn a_long_grant_is_wrapped_and_nothing_of_it_is_lost() {
        let refusal =
            "SCHED_OTHER on cpu 1, sleep; SCHED_FIFO 80 refused: Operation not permitted (os error 1), see ulimit -r";
        let mut analysis = Analysis::default();
        analysis.set_environment(&Environment {
            granted: [("local".to_owned(), refusal.to_owned())].into(),
            ..Environment::default()
        });
        let text = analysis.report().to_string();
        assert!(text.lines().all(|line| line.chars().count() <= WIDTH), "{text}");
        let words = |text: &str| text.split_whitespace().map(str::to_owned).collect::<Vec<_>>().join(" ");
        assert!(words(&text).contains(refusal), "{text}");
    }
}
