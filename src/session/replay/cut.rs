//! Where a log of a run with a fault is cut, and which releases before the cut may need something from behind it.
//!
//! Releases of different groups overlap. One that was due before the fault and still ran when the failed release began
//! can have seen what that one, or a later one, published: its input is gone with them. Whether a release ran that long
//! is not a matter of trust in its own record: the releases of a group follow one another, so every later one before the
//! cut must have woken behind it too.

use super::report::{LoggedFault, Unrepeated, UnrepeatedRelease};
use crate::runtime::{Nanos, RuntimeFault, RuntimeReport, TickTiming};

/// The end of what can be repeated.
#[derive(Debug)]
pub(super) struct Cut {
    pub(super) fault: LoggedFault,
    groups: Vec<Group>,
}

/// The releases of a group before the cut.
#[derive(Debug)]
struct Group {
    name: String,
    /// Number and time, in order.
    releases: Vec<(u64, Nanos)>,
    /// How many of them, from the last on, still ran at the time of the cut.
    overlapping: usize,
}

impl Cut {
    /// Before `fault`; groups with their names and all their releases. In virtual time nothing overlaps: a release sees
    /// what was there when it was due.
    pub(super) fn new<'a>(
        fault: LoggedFault,
        is_virtual: bool,
        groups: impl IntoIterator<Item = (String, &'a [TickTiming])>,
    ) -> Self {
        let time = fault.time;
        let group = |(name, timings): (String, &[TickTiming])| {
            let before: Vec<&TickTiming> = timings.iter().filter(|timing| timing.scheduled < time).collect();
            let woke_behind = before.iter().rev().take_while(|timing| timing.woke >= time).count();
            let ended_behind = before.iter().rev().nth(woke_behind).is_some_and(|timing| timing.end >= time);
            let overlapping = if is_virtual { 0 } else { woke_behind + usize::from(ended_behind) };
            Group { name, releases: before.iter().map(|timing| (timing.tick, timing.scheduled)).collect(), overlapping }
        };
        Self { fault, groups: groups.into_iter().map(group).collect() }
    }

    /// What a re-execution that ended with `fault` could not repeat.
    ///
    /// # Errors
    /// The fault, unless only releases are left that overlap the cut.
    pub(super) fn excuse(&self, report: &RuntimeReport, fault: RuntimeFault) -> Result<Unrepeated, RuntimeFault> {
        let mut releases = Vec::new();
        let mut explains = false;
        for group in &self.groups {
            let Some(done) = report.groups.iter().find(|done| done.name == group.name) else { return Err(fault) };
            let left = group.releases.get(done.released as usize..).unwrap_or_default();
            if left.len() > group.overlapping {
                return Err(fault);
            }
            // A fault inside of a release, which has then begun, is no gap.
            explains |= group.name == fault.group && left.first().is_some_and(|(_, time)| *time == fault.at);
            let unrepeated = |&(tick, time)| UnrepeatedRelease { group: group.name.clone(), tick, time };
            releases.extend(left.iter().map(unrepeated));
        }
        if explains { Ok(Unrepeated { releases, why: fault.what }) } else { Err(fault) }
    }

    /// The last release of `group` that was repeated, and from when on its samples are missing.
    pub(super) fn end_of(&self, group: &str, unrepeated: Option<&Unrepeated>) -> (Nanos, Nanos) {
        let left = unrepeated.into_iter().flat_map(|left| &left.releases);
        let first_left = left.filter(|left| left.group == group).map(|left| left.time).min();
        let end = first_left.unwrap_or(self.fault.time);
        let releases = self.groups.iter().find(|of| of.name == group).map_or(&[][..], |of| &of.releases);
        let last = releases.iter().map(|(_, time)| *time).take_while(|time| *time < end).last();
        (last.unwrap_or_default(), end)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::runtime::{GroupReport, Rate, RuntimeFaultKind};

    /// Due every 10 ns; each with the times at which it woke and ended.
    fn group(ran: &[[u64; 2]]) -> Vec<TickTiming> {
        let timing = |(tick, [woke, end]): (usize, &[u64; 2])| TickTiming {
            tick: tick as u64,
            scheduled: Nanos(tick as u64 * 10),
            woke: Nanos(*woke),
            end: Nanos(*end),
            ..TickTiming::default()
        };
        ran.iter().enumerate().map(timing).collect()
    }

    fn overlapping(is_virtual: bool, ran: &[[u64; 2]]) -> usize {
        let fault = LoggedFault { time: Nanos(40), what: String::new(), restarted: false };
        Cut::new(fault, is_virtual, [("local".to_owned(), &*group(ran))]).groups[0].overlapping
    }

    #[test]
    fn only_releases_that_still_ran_at_the_cut_overlap_it() {
        assert_eq!(overlapping(false, &[[0, 3], [10, 13], [20, 23], [30, 33], [40, 43]]), 0);
        assert_eq!(overlapping(false, &[[0, 3], [10, 13], [20, 23], [30, 47], [47, 50]]), 1);
        // One that went on for long, and the one that waited for it.
        assert_eq!(overlapping(false, &[[0, 3], [10, 13], [20, 45], [45, 47], [48, 50]]), 2);
        assert_eq!(overlapping(false, &[[0, 3], [10, 13], [20, 45], [45, 47]]), 2);
        assert_eq!(overlapping(true, &[[0, 43], [10, 53], [20, 63], [30, 73]]), 0);
    }

    // Check that a release that claims a late end, followed by one that woke before, is not believed.
    #[test]
    fn a_changed_end_excuses_nothing() {
        assert_eq!(overlapping(false, &[[0, 3], [10, 99], [20, 23], [30, 33], [40, 43]]), 0);
        assert_eq!(overlapping(false, &[[0, 3], [10, 99], [20, 23], [30, 43], [43, 46]]), 1);
    }

    /// The report of a re-execution that ran this many releases of `local` and `global`.
    fn report(released: [u64; 2]) -> RuntimeReport {
        let group = |(name, released): (&str, u64)| GroupReport {
            name: name.to_owned(),
            rate: Rate::hz(1000),
            released,
            skipped: 0,
            slips: Default::default(),
            elapsed_periods: released,
            missed_deadlines: 0,
            misses: Default::default(),
            degraded: 0,
            in_degraded_mode: 0,
            watchdog_takeovers: 0,
            lateness: Default::default(),
            execution: Default::default(),
        };
        let groups = ["local", "global"].into_iter().zip(released).map(group).collect();
        RuntimeReport {
            groups,
            graph: Default::default(),
            grant: Default::default(),
            fault: None,
            restarts: Vec::new(),
            lost_records: 0,
            costs: Vec::new(),
        }
    }

    // Check that what is excused is named, and that nothing else is: an earlier release, a fault inside of one.
    #[test]
    fn a_release_that_waits_for_what_came_after_the_cut_is_named() {
        let local = group(&[[0, 3], [10, 13], [20, 23], [30, 47], [47, 50]]);
        let global = group(&[[0, 9], [10, 12], [20, 22], [30, 33]]);
        let fault = LoggedFault { time: Nanos(40), what: String::new(), restarted: true };
        let cut = Cut::new(fault, false, [("local".to_owned(), &*local), ("global".to_owned(), &*global)]);
        let ended = |at| RuntimeFault {
            group: "local".to_owned(),
            actor: String::new(),
            at: Nanos(at),
            kind: RuntimeFaultKind::Recording,
            what: "release 3 waits".to_owned(),
        };
        let unrepeated = cut.excuse(&report([3, 4]), ended(30)).unwrap();
        let release = UnrepeatedRelease { group: "local".to_owned(), tick: 3, time: Nanos(30) };
        assert_eq!(unrepeated, Unrepeated { releases: vec![release], why: "release 3 waits".to_owned() });
        assert_eq!(cut.end_of("local", Some(&unrepeated)), (Nanos(20), Nanos(30)));
        assert_eq!(cut.end_of("global", Some(&unrepeated)), (Nanos(30), Nanos(40)));
        for (released, at) in [([2, 4], 20), ([3, 3], 30), ([4, 4], 30), ([3, 4], 20)] {
            assert_eq!(cut.excuse(&report(released), ended(at)), Err(ended(at)), "{released:?}");
        }
    }
}
