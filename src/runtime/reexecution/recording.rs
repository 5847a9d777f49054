//! What has to be known of a run to repeat it: which releases ran, and what they saw through ports from other groups.

use crate::error::{GraphError, GraphErrorKind};
use crate::records::input::InputUse;
use crate::records::port_use::{PortUse, PortUseKind};
use crate::records::record::Record;
use crate::records::timing::{RecordedRelease, TickTiming};
use crate::reexecution::script::{PortScript, Script};
use crate::time::Nanos;
use std::collections::{BTreeMap, VecDeque};

/// The records of a run that decide what its actors computed: enough to run it again, release by release.
///
/// In real time, which model version a tick sees and which releases are skipped depends on threads and clocks. A graph
/// that was built with a [drain](crate::RuntimeBuilder::drain) from the start records these facts: one
/// [`TickTiming`] per release and a [`PortUse`] wherever a release saw something new from another group. With them,
/// [`Runtime::reexecution`](crate::Runtime::reexecution) runs the same actors in virtual time to the same results, bit
/// for bit, provided that
///
/// - actors get everything from ports, from their [context](crate::TickContext) (but for `now` and `dt_measured`, which
///   in virtual time are the scheduled ones), or from inputs that the program recorded itself,
/// - in every release of a group, what its actors take from other groups comes before what they give to them (read in
///   `tick`, publish after). Releases are repeated whole: one that holds an answer to its own publication cannot be,
/// - groups that are no observers take nothing from observers, which are not repeated,
/// - no actor failed: it ends at the first fault of one, and repeats neither the wind-down nor the restart that followed.
///
/// ```
/// use palpate_runtime::{Execution, Outcome, RateGroup, Recording, Runtime, RuntimeBuilder, actor_fn};
/// use palpate_runtime::Nanos;
/// use std::sync::{Arc, Mutex};
/// use std::time::Duration;
///
/// // Two groups on threads: how many of the fast one's samples each slow release sees is up to the machine.
/// fn graph(mut graph: RuntimeBuilder) -> (Vec<usize>, Recording) {
///     let (records, counts) = (Arc::new(Mutex::new(Vec::new())), Arc::new(Mutex::new(Vec::new())));
///     let (all, seen) = (Arc::clone(&records), Arc::clone(&counts));
///     let mut drain = graph.drain(); // before the ports, so that they are recorded
///     let (mut tx, mut rx) = graph.queue(1024);
///     let fast = actor_fn("fast", move |ctx| {
///         tx.push(ctx, ctx.tick);
///         Outcome::Continue
///     });
///     let slow = actor_fn("slow", move |ctx| {
///         seen.lock().unwrap().push(std::iter::from_fn(|| rx.pop(ctx)).count());
///         Outcome::Continue
///     });
///     let logger = actor_fn("logger", move |_| {
///         drain.drain(&mut all.lock().unwrap());
///         Outcome::Continue
///     });
///     graph.group(RateGroup::hz(1000), vec![fast]).group(RateGroup::hz(300), vec![slow]);
///     graph.group(RateGroup::hz(50).observer(), vec![logger]).until(Nanos(50_000_000));
///     let running = graph.build().unwrap().start().unwrap();
///     running.wait_for(Duration::MAX);
///     assert_eq!(running.stop().fault, None);
///     (counts.lock().unwrap().clone(), Recording::from_records(records.lock().unwrap().iter()))
/// }
///
/// let (counts, recording) = graph(Runtime::builder(Execution::Threaded));
/// let (again, _) = graph(Runtime::reexecution(recording));
/// assert_eq!(again, counts);
/// ```
///
/// # Real-time
/// Not real-time safe: allocates. For loggers, and for the time after a run.
#[derive(Clone, Debug, Default)]
pub struct Recording {
    releases: BTreeMap<u16, Vec<RecordedRelease>>,
    uses: BTreeMap<(u32, PortUseKind), Vec<PortUse>>,
    inputs: BTreeMap<u32, Vec<InputUse>>,
}

impl Recording {
    /// The recording in `records`; those of other kinds are passed over. Call it when the run has ended: the last
    /// record counts.
    pub fn from_records<'a>(records: impl IntoIterator<Item = &'a Record>) -> Self {
        let mut recording = Self::default();
        for record in records {
            TickTiming::from_record(record).iter().for_each(|timing| recording.push_timing(timing));
            PortUse::from_record(record).iter().for_each(|used| recording.push_use(used));
            InputUse::from_record(record).iter().for_each(|input| recording.push_input(input));
        }
        recording
    }

    /// Adds a release. Those of a group come in the order in which they ran.
    pub fn push_timing(&mut self, timing: &TickTiming) {
        self.releases.entry(timing.group).or_default().push(timing.into());
    }

    /// Adds the use of a port. Those of a kind and port come in the order in which they were made.
    pub fn push_use(&mut self, used: &PortUse) {
        self.uses.entry((used.port, used.kind)).or_default().push(*used);
    }

    /// Adds a value from outside. Those of a port come in the order in which they were taken.
    pub fn push_input(&mut self, input: &InputUse) {
        self.inputs.entry(input.port).or_default().push(*input);
    }

    /// Leaves out everything that was due at `time` or later. A release of the rest that needs something of it cannot
    /// be repeated and ends the re-execution with a fault that names it.
    #[must_use]
    pub fn before(mut self, time: Nanos) -> Self {
        for releases in self.releases.values_mut() {
            releases.retain(|release| release.scheduled < time);
        }
        for uses in self.uses.values_mut() {
            uses.retain(|used| used.time < time);
        }
        for inputs in self.inputs.values_mut() {
            inputs.retain(|input| input.time < time);
        }
        self
    }

    /// The number of releases of group `group`.
    pub fn released(&self, group: u16) -> u64 {
        self.releases.get(&group).map_or(0, |releases| releases.len() as u64)
    }

    /// The number of uses of ports by group `group`, values from outside included.
    pub fn port_uses(&self, group: u16) -> u64 {
        let uses = self.uses.values().flatten().filter(|used| used.group == group).count();
        (uses + self.inputs.values().flatten().filter(|input| input.group == group).count()) as u64
    }

    /// The scheduled time of the last release, zero without one.
    pub fn end(&self) -> Nanos {
        let last = |releases: &Vec<RecordedRelease>| releases.last().map(|release| release.scheduled);
        self.releases.values().filter_map(last).max().unwrap_or_default()
    }

    /// The ticks and scheduled times of the releases of group `group`, in order.
    pub fn releases(&self, group: u16) -> impl Iterator<Item = (u64, Nanos)> {
        self.releases.get(&group).into_iter().flatten().map(|release| (release.tick, release.scheduled))
    }

    /// Refuses a recording from which a record is missing; `name` gives groups their names.
    ///
    /// # Errors
    /// [`GraphErrorKind::Recording`], naming the first gap.
    pub fn check(&self, name: impl Fn(u16) -> String) -> Result<(), GraphError> {
        for (&group, releases) in &self.releases {
            let mut next = 0;
            for release in releases {
                if release.tick != next + u64::from(release.slips) {
                    let (tick, slips) = (release.tick, release.slips);
                    return Err(incomplete(format!(
                        "release {tick} of rate group `{}` comes after {slips} skipped ones, but the releases from \
                         {next} on are not accounted for",
                        name(group)
                    )));
                }
                next = release.tick + 1;
            }
        }
        for (port, inputs) in &self.inputs {
            if let Some(index) = inputs.iter().zip(0..).position(|(input, index)| input.sequence != index) {
                let (group, at) = (name(inputs[index].group), inputs[index].time);
                let place = format!(
                    "value {} from outside through port {port} of rate group `{group}`",
                    inputs[index].sequence
                );
                return Err(incomplete(format!("{place}, release due at {at}, follows value {index} that is missing")));
            }
        }
        self.uses.iter().try_for_each(|((port, kind), uses)| check_uses(*port, *kind, uses, &name))
    }

    /// The number of the last port with a use, plus one.
    pub(crate) fn ports(&self) -> u32 {
        self.uses.keys().map(|(port, _)| port + 1).chain(self.inputs.keys().map(|port| port + 1)).max().unwrap_or(0)
    }

    /// The number of the last group with a release, plus one.
    pub(crate) fn groups(&self) -> usize {
        self.releases.keys().map(|group| usize::from(*group) + 1).max().unwrap_or(0)
    }

    /// What ports must show.
    pub(crate) fn script(&self) -> Script {
        let uses = |port, kind| self.uses.get(&(port, kind)).into_iter().flatten().copied();
        let of_port = |port| PortScript {
            // A port is an exchange or a queue: one of the two is empty.
            reads: uses(port, PortUseKind::Took).chain(uses(port, PortUseKind::Saw)).collect(),
            inputs: self.inputs.get(&port).into_iter().flatten().copied().collect(),
            drops: uses(port, PortUseKind::Dropped).map(|used| used.count).collect(),
            ..PortScript::default()
        };
        Script::new((0..self.ports()).map(of_port).collect())
    }

    /// The releases of each of `groups` groups.
    pub(crate) fn into_releases(mut self, groups: usize) -> Vec<VecDeque<RecordedRelease>> {
        (0..groups).map(|group| self.releases.remove(&(group as u16)).unwrap_or_default().into()).collect()
    }
}

fn check_uses(port: u32, kind: PortUseKind, uses: &[PortUse], name: impl Fn(u16) -> String) -> Result<(), GraphError> {
    for (index, used) in uses.iter().enumerate() {
        let place = || format!("port {port} of rate group `{}`, release {}", name(used.group), used.tick);
        if used.sequence != index as u64 {
            let (sequence, what) = (used.sequence, kind.name());
            let message = format!("use {sequence} (`{what}`) of {} follows use {index} that is missing", place());
            return Err(incomplete(message));
        }
        if index > 0 && (used.count <= uses[index - 1].count || used.tick < uses[index - 1].tick) {
            return Err(incomplete(format!("the uses of {} do not follow one another", place())));
        }
    }
    Ok(())
}

fn incomplete(message: String) -> GraphError {
    GraphError::new(GraphErrorKind::Recording, format!("the recording is not complete: {message}"))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn timing(tick: u64, slips: u32) -> TickTiming {
        TickTiming { group: 1, tick, slips, scheduled: Nanos(tick * 10), ..TickTiming::default() }
    }

    fn took(tick: u64, count: u64, sequence: u64) -> PortUse {
        PortUse { time: Nanos(tick * 10), group: 1, port: 2, tick, count, sequence, ..PortUse::default() }
    }

    fn recording(timings: &[TickTiming], uses: &[PortUse]) -> Recording {
        let records: Vec<Record> =
            timings.iter().map(|t| (*t).into()).chain(uses.iter().map(|u| (*u).into())).collect();
        Recording::from_records(&records)
    }

    fn fault(recording: &Recording) -> String {
        recording.check(|group| format!("g{group}")).unwrap_err().to_string()
    }

    #[test]
    fn a_complete_recording_passes_and_every_missing_record_is_named() {
        let timings = [timing(0, 0), timing(3, 2), timing(4, 0)];
        let uses = [took(0, 1, 0), took(3, 5, 1), took(4, 6, 2)];
        let whole = recording(&timings, &uses);
        assert!(whole.check(|group| group.to_string()).is_ok());
        assert_eq!((whole.released(1), whole.port_uses(1), whole.end()), (3, 3, Nanos(40)));
        // Check that a missing first or middle one is noticed; the last one is a matter of the sums kept elsewhere
        for missing in 0..2 {
            let without = |index: usize| (0..3).filter(move |i| *i != index);
            let fewer: Vec<_> = without(missing).map(|i| timings[i]).collect();
            assert!(fault(&recording(&fewer, &uses)).contains("rate group `g1`"));
            let fewer: Vec<_> = without(missing).map(|i| uses[i]).collect();
            assert!(fault(&recording(&timings, &fewer)).contains("port 2 of rate group `g1`"));
        }
        // A use that goes back is no recording of a run.
        assert!(fault(&recording(&timings, &[took(0, 4, 0), took(3, 4, 1)])).contains("do not follow"));
    }

    #[test]
    fn what_comes_before_a_time_is_kept() {
        let cut = recording(&[timing(0, 0), timing(1, 0)], &[took(0, 1, 0), took(1, 2, 1)]).before(Nanos(10));
        assert_eq!((cut.released(1), cut.port_uses(1), cut.end()), (1, 1, Nanos(0)));
    }
}
