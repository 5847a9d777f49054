//! Which release of a recording runs next.
//!
//! Of every group the releases run in their order. Among the groups, the earliest-scheduled release runs whose recorded
//! reads are all there: its ports show exactly what they showed then, whatever ran in between.

use crate::error::GraphError;
use crate::group::group_run::GroupRun;
use crate::records::timing::RecordedRelease;
use crate::reexecution::recording::Recording;
use crate::reexecution::script::Script;
use crate::reports::report::{RuntimeFault, RuntimeFaultKind};
use std::collections::VecDeque;

/// A recording that is being re-executed.
#[derive(Debug)]
pub(crate) struct Reexecution {
    /// What is left to run, by group.
    releases: Vec<VecDeque<RecordedRelease>>,
    script: Script,
}

/// What can be done next.
pub(crate) enum Step {
    /// This group's next release can run.
    Run(usize, RecordedRelease),
    /// Releases are left and none can run.
    Stuck(RuntimeFault),
    /// Nothing is left.
    Over,
}

impl Reexecution {
    /// The re-execution of `recording` by a graph of `groups` with `ports` ports that follow `script`.
    ///
    /// # Errors
    /// [`GraphErrorKind::Recording`](crate::GraphErrorKind::Recording) for a recording with gaps, [`GraphErrorKind::Refused`](crate::GraphErrorKind::Refused) for one of another graph.
    pub(crate) fn new(
        recording: Recording,
        script: Script,
        groups: &[GroupRun],
        ports: u32,
    ) -> Result<Self, GraphError> {
        let name =
            |group: u16| groups.get(usize::from(group)).map_or(format!("group-{group}"), |g| g.spec.name.clone());
        recording.check(name)?;
        if recording.ports() > ports || recording.groups() > groups.len() {
            let message = format!(
                "the recording is one of another graph: it has {} groups and {} ports, this one {} and {ports}",
                recording.groups(),
                recording.ports(),
                groups.len()
            );
            return Err(GraphError::refused(message));
        }
        let mut releases = recording.into_releases(groups.len());
        // Observers follow their own schedule.
        groups.iter().zip(&mut releases).filter(|(group, _)| group.spec.observer).for_each(|(_, left)| left.clear());
        Ok(Self { releases, script })
    }

    /// True if group `index` has no release left.
    pub(crate) fn is_over(&self, index: usize) -> bool {
        self.releases[index].is_empty()
    }

    /// What can be done next by `groups`.
    pub(crate) fn next(&self, groups: &[Option<GroupRun>]) -> Step {
        let mut stuck = None;
        let mut ready: Option<(usize, RecordedRelease)> = None;
        for (index, group) in groups.iter().enumerate() {
            let (Some(group), Some(release)) = (group, self.releases[index].front()) else { continue };
            if ready.is_some_and(|(_, earliest)| earliest.scheduled <= release.scheduled) {
                continue;
            }
            match self.script.missing(group.index, release.tick) {
                None => ready = Some((index, *release)),
                Some(missing) => {
                    let what = format!(
                        "the recording is not complete: release {} waits for number {} of port {}, which has {}",
                        release.tick, missing.needed.count, missing.needed.port, missing.produced
                    );
                    stuck.get_or_insert(fault(group, release, what));
                }
            }
        }
        match (ready, stuck) {
            (Some((index, release)), _) => Step::Run(index, release),
            (None, Some(fault)) => Step::Stuck(fault),
            (None, None) => Step::Over,
        }
    }

    /// Strikes out the release that group `index` has just run, and sees whether it did all that was recorded.
    pub(crate) fn done(&mut self, index: usize, group: &GroupRun) -> Result<(), RuntimeFault> {
        let Some(release) = self.releases[index].pop_front() else { return Ok(()) };
        match self.script.left_out(group.index, release.tick, release.scheduled) {
            None => Ok(()),
            Some((tick, port)) => {
                let what = format!("the re-execution left the recording: release {tick} has not read port {port}");
                Err(fault(group, &release, what))
            }
        }
    }
}

fn fault(group: &GroupRun, release: &RecordedRelease, what: String) -> RuntimeFault {
    RuntimeFault::of_group(&group.spec.name, release.scheduled, RuntimeFaultKind::Recording, what)
}
