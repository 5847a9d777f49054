//! A built graph and a run in progress.

use super::builder::{Execution, RuntimeBuilder};
use super::grant::{GrantHandle, SystemGrant};
use super::recorder::Registry;
use super::recording::Recording;
use super::reexecution::Reexecution;
use super::release::GroupRun;
use super::report::RuntimeReport;
use super::supervisor::{Control, StopHandle};
use super::threaded::{Threads, start_actors};
use super::virtual_time::VirtualRun;
use crate::error::{Error, ErrorKind};
use crate::time::Nanos;
use std::fmt;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};

/// How long a stop waits while no group ends before it gives up on those still running.
pub const STOP_BOUND: Duration = Duration::from_secs(5);

/// How often a waiting program looks at the supervisor's mailbox.
const POLL: Duration = Duration::from_millis(5);

/// A graph that was checked and can be started.
pub struct Runtime {
    execution: Execution,
    groups: Vec<GroupRun>,
    reexecution: Option<Reexecution>,
    registry: Arc<Registry>,
    grants: GrantHandle,
}

impl Runtime {
    /// A builder for a graph that runs in this execution.
    pub fn builder(execution: Execution) -> RuntimeBuilder {
        RuntimeBuilder::new(execution, None)
    }

    /// A builder for a graph that repeats `recording` in virtual time: it must be built as the recorded one was, with
    /// the same groups and ports in the same order. Exactly the recorded releases run, whatever rates, policies and
    /// [`until`](RuntimeBuilder::until) say, and every one of them sees through its ports what it saw then.
    ///
    /// A recording that lacks a record ends in a [fault](RuntimeReport::fault) that names what is missing.
    pub fn reexecution(recording: Recording) -> RuntimeBuilder {
        RuntimeBuilder::new(Execution::Virtual, Some(recording))
    }

    pub(super) fn new(
        execution: Execution,
        groups: Vec<GroupRun>,
        reexecution: Option<Reexecution>,
        registry: Arc<Registry>,
        grants: GrantHandle,
    ) -> Self {
        Self { execution, groups, reexecution, registry, grants }
    }

    /// Sets the threads up, then starts all actors one after the other on this thread, then releases the groups.
    ///
    /// In virtual time nothing is released yet: [`Running::wait_for`] executes.
    ///
    /// # Errors
    /// The error of the first actor whose start failed, after those already started were stopped; or
    /// [`ErrorKind::Runtime`] if the system gives no thread.
    pub fn start(self) -> Result<Running, Error> {
        let Self { execution, mut groups, reexecution, registry, grants } = self;
        let control = Control::new(groups.iter().filter(|group| !group.spec.observer).count());
        let names = groups.iter().map(|group| group.spec.name.clone()).collect();
        let executor = match execution {
            Execution::Threaded => Executor::Threaded(Threads::start(groups, Arc::clone(&control), &grants)?),
            Execution::Virtual => {
                grants.set(SystemGrant::of_virtual_time(groups.iter().map(|group| &group.spec)));
                start_actors(&mut groups)?;
                Executor::Virtual(VirtualRun::new(groups, reexecution, Arc::clone(&control)))
            }
        };
        Ok(Running { executor: Mutex::new(executor), control, names, registry, grants })
    }
}

impl fmt::Debug for Runtime {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let groups: Vec<_> = self.groups.iter().map(|group| &group.spec).collect();
        f.debug_struct("Runtime").field("execution", &self.execution).field("groups", &groups).finish_non_exhaustive()
    }
}

enum Executor {
    Threaded(Threads),
    Virtual(VirtualRun),
}

/// A run in progress. Dropping it stops it, within [`STOP_BOUND`] for each group that does not end.
pub struct Running {
    executor: Mutex<Executor>,
    control: Arc<Control>,
    names: Vec<String>,
    registry: Arc<Registry>,
    grants: GrantHandle,
}

impl Running {
    /// Lets the run go on for `span`, less if it ends before.
    ///
    /// Threads: sleeps and looks at the supervisor's mailbox. Virtual time: executes the releases of that span.
    pub fn wait_for(&self, span: Duration) {
        if let Executor::Virtual(run) = &mut *self.lock() {
            return run.advance(Nanos::from_duration(span));
        }
        let start = Instant::now();
        while !self.finished() {
            let Some(left) = span.checked_sub(start.elapsed()).filter(|left| !left.is_zero()) else { return };
            std::thread::sleep(left.min(POLL));
        }
    }

    /// Time since the start of the run: the clock's, or virtual time executed so far.
    pub fn elapsed(&self) -> Nanos {
        match &*self.lock() {
            Executor::Threaded(threads) => threads.elapsed(),
            Executor::Virtual(run) => run.now(),
        }
    }

    /// True when every group has ended: by [`until`](RuntimeBuilder::until), by a stop or by a fault.
    pub fn finished(&self) -> bool {
        match &mut *self.lock() {
            Executor::Threaded(threads) => threads.poll(),
            Executor::Virtual(run) => run.supervisor.all_ended(),
        }
    }

    /// Asks every group to end after the release it is in; returns at once.
    ///
    /// # Real-time
    /// Wait-free, real-time safe.
    pub fn request_stop(&self) {
        self.control.request_stop();
    }

    /// A handle that asks for the same from another thread, also from one that handles signals.
    pub fn stop_handle(&self) -> StopHandle {
        StopHandle(Arc::clone(&self.control))
    }

    /// Stops the run in order and reports. A fault of an actor is in the report, not an error.
    ///
    /// # Errors
    /// [`ErrorKind::Fault`] naming the groups that did not end within [`STOP_BOUND`]; their threads are given up.
    pub fn stop(self) -> Result<RuntimeReport, Error> {
        let stuck = self.end();
        if !stuck.is_empty() {
            return Err(Error::new(
                ErrorKind::Fault,
                format!(
                    "rate group `{}` did not end within {STOP_BOUND:?} of a stop and was given up; its tick or stop \
                     must return",
                    stuck.join("`, `")
                ),
            ));
        }
        let (groups, fault) = match &*self.lock() {
            Executor::Threaded(threads) => threads.supervisor.results(),
            Executor::Virtual(run) => run.supervisor.results(),
        };
        let grant = self.grants.get().unwrap_or_default();
        Ok(RuntimeReport { groups, grant, fault, lost_records: self.registry.lost() })
    }

    /// Ends the run if it has not ended; returns the groups that had to be given up.
    fn end(&self) -> Vec<String> {
        match &mut *self.lock() {
            Executor::Threaded(threads) => threads.join(&self.names, STOP_BOUND),
            Executor::Virtual(run) => {
                run.end_all();
                Vec::new()
            }
        }
    }

    fn lock(&self) -> MutexGuard<'_, Executor> {
        // Actors' panics are caught before they get here; the executor's own state stays whole.
        self.executor.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl Drop for Running {
    fn drop(&mut self) {
        self.end();
    }
}

impl fmt::Debug for Running {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Running").field("groups", &self.names).finish_non_exhaustive()
    }
}

#[cfg(all(test, not(loom)))]
mod tests {
    use super::*;
    use crate::runtime::{Outcome, RateGroup, actor_fn};

    #[test]
    fn a_run_can_be_shared_between_threads() {
        fn shared<T: Send + Sync>() {}
        shared::<Running>();
        shared::<StopHandle>();
    }

    #[test]
    fn a_group_that_does_not_return_is_given_up_and_observers_still_end() {
        let bound = Duration::from_millis(300);
        let (release, stuck) = std::sync::mpsc::channel::<()>();
        let stuck = actor_fn("stuck", move |_| {
            let _ = stuck.recv();
            Outcome::Continue
        });
        let mut graph = Runtime::builder(Execution::Threaded);
        graph.group(RateGroup::hz(100).name("stuck"), vec![stuck]);
        graph.group(RateGroup::hz(100).name("log").observer(), vec![]);
        let running = graph.build().unwrap().start().unwrap();
        running.wait_for(Duration::from_millis(30));
        let given_up = |bound| match &mut *running.lock() {
            Executor::Threaded(threads) => threads.join(&running.names, bound),
            Executor::Virtual(_) => unreachable!("the graph is threaded"),
        };
        assert_eq!(given_up(bound), ["stuck"]);
        // Check that a later stop, and the drop, do not wait for it again
        let again = Instant::now();
        assert_eq!(given_up(STOP_BOUND), ["stuck"]);
        assert!(again.elapsed() < STOP_BOUND);
        let error = running.stop().unwrap_err();
        assert_eq!(error.kind(), ErrorKind::Fault);
        assert!(error.to_string().contains("`stuck`"), "{error}");
        drop(release);
    }
}
