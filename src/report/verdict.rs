//! The one line that a report begins with.

use super::units::plural;
use crate::log::{Level, RunReport};

/// The verdict on a run, best first.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum RunVerdict {
    /// Every period kept, every deadline met, nothing lost.
    Ok,
    /// The timing is good, but records are missing.
    Incomplete,
    /// Periods were skipped or deadlines missed.
    Late,
    /// A rate group failed and was started again; the run went on.
    Restarted,
    /// An actor failed.
    Failed,
}

impl RunVerdict {
    /// The name in reports.
    pub fn name(self) -> &'static str {
        match self {
            Self::Ok => "OK",
            Self::Incomplete => "INCOMPLETE",
            Self::Late => "LATE",
            Self::Restarted => "RESTARTED",
            Self::Failed => "FAILED",
        }
    }
}

impl RunReport {
    /// The verdict on a run and the reason in words.
    pub fn verdict(&self) -> (RunVerdict, String) {
        let time = match (self.is_virtual(), &self.environment) {
            (true, _) => "virtual time",
            (false, Some(_)) => "real time",
            (false, None) => "run time",
        };
        let ran = format!("{:.3} s of {time}", self.duration.as_secs_f64());
        let (skipped, missed, lost) = (self.skipped(), self.missed(), self.lost_records());
        if self.worst_event == Some(Level::Error) {
            if let (None, Some(restart)) = (&self.fault, &self.restart) {
                let (skipped, missed) = (plural(skipped, "period", "periods"), plural(missed, "deadline", "deadlines"));
                let restart = &restart.message;
                return (RunVerdict::Restarted, format!("{restart}; {skipped} skipped and {missed} missed in {ran}"));
            }
            let reason = self.fault.as_ref().map_or("an actor failed", |fault| &fault.message);
            return (RunVerdict::Failed, format!("{reason}, in {ran}"));
        }
        if skipped > 0 || missed > 0 {
            let skipped = plural(skipped, "period", "periods");
            let missed = plural(missed, "deadline", "deadlines");
            return (RunVerdict::Late, format!("{skipped} skipped and {missed} missed in {ran}"));
        }
        if lost > 0 {
            return (RunVerdict::Incomplete, format!("{} lost in {ran}", plural(lost, "record", "records")));
        }
        if self.damage.is_some() {
            return (RunVerdict::Incomplete, format!("the log is damaged after {ran}"));
        }
        if self.groups.iter().all(|group| group.released == 0) {
            return (RunVerdict::Incomplete, "the log holds no ticks".to_owned());
        }
        if self.groups.iter().all(|group| group.execution.count == 0) {
            let released: u64 = self.groups.iter().map(|group| group.released).sum();
            return (RunVerdict::Ok, format!("the lateness of {released} wake-ups, and nothing else, is known"));
        }
        (RunVerdict::Ok, format!("{ran}, every period kept, every deadline met"))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::log::{Analysis, Environment, LogRecord, TextEvent};
    use crate::runtime::Nanos;
    use crate::runtime::{SlipCause, TickTiming};

    fn analysis(slips: u32) -> Analysis {
        let mut analysis = Analysis::default();
        analysis.set_environment(&Environment::default());
        analysis.push(&LogRecord::Tick(TickTiming {
            scheduled: Nanos(1_500_000_000),
            tick: 1500,
            slips,
            cause: SlipCause::LateWake,
            deadline: Nanos(1_501_000_000),
            ..TickTiming::default()
        }));
        analysis
    }

    fn report(slips: u32) -> RunReport {
        analysis(slips).report()
    }

    #[test]
    fn the_gravest_finding_decides() {
        let good = (RunVerdict::Ok, "1.500 s of virtual time, every period kept, every deadline met".to_owned());
        assert_eq!(report(0).verdict(), good);
        let late = report(3).verdict();
        assert_eq!(
            late,
            (RunVerdict::Late, "3 periods skipped and 0 deadlines missed in 1.500 s of virtual time".into())
        );
        let cut = RunReport { damage: Some("cut".into()), ..report(0) };
        assert_eq!(cut.verdict().0, RunVerdict::Incomplete);
        let both = RunReport { worst_event: Some(Level::Error), ..report(3) };
        assert_eq!(both.verdict().0, RunVerdict::Failed);
    }

    fn after(events: Vec<TextEvent>) -> (RunVerdict, String) {
        let mut analysis = analysis(3);
        events.iter().for_each(|event| analysis.push_text(event));
        analysis.report().verdict()
    }

    fn event(s: u64, level: Level, message: &str) -> TextEvent {
        TextEvent { time: Nanos(s), level, message: message.to_owned() }
    }

    fn panicked(s: u64, group: &str) -> TextEvent {
        event(s, Level::Error, &format!("{group}: actor 0 panicked"))
    }

    fn restarted(s: u64, group: &str) -> TextEvent {
        event(s, Level::Warning, &format!("{group}: restarted after a fault, restart 1"))
    }

    #[test]
    fn a_fault_that_a_restart_answered_is_told_from_one_that_ended_the_run() {
        let (found, why) = after(vec![panicked(5, "global"), restarted(6, "global")]);
        assert_eq!(found, RunVerdict::Restarted);
        assert!(why.starts_with("global: restarted after a fault, restart 1; 3 periods skipped"), "{why}");
        // Check that neither another group's restart nor an earlier one answers a fault
        assert_eq!(after(vec![panicked(5, "local"), restarted(6, "global")]).0, RunVerdict::Failed);
        assert_eq!(after(vec![restarted(6, "global"), panicked(7, "global")]).0, RunVerdict::Failed);
        assert_eq!(after(vec![panicked(7, "global"), restarted(6, "global")]).0, RunVerdict::Failed);
    }

    #[test]
    fn a_fault_counts_however_many_events_were_before_it() {
        let warnings = (0..500).map(|s| event(s, Level::Warning, "local: degraded, cause 1"));
        let (found, why) = after(warnings.chain([panicked(500, "local")]).collect());
        assert_eq!((found, why.as_str()), (RunVerdict::Failed, "local: actor 0 panicked, in 1.500 s of virtual time"));
        let restarts = (0..500).flat_map(|s| [panicked(s, "global"), restarted(s, "global")]);
        assert_eq!(after(restarts.clone().collect()).0, RunVerdict::Restarted);
        let (found, why) = after(restarts.chain([panicked(500, "global")]).collect());
        assert_eq!((found, why.as_str()), (RunVerdict::Failed, "global: actor 0 panicked, in 1.500 s of virtual time"));
    }
}
