//! A built graph and a run in progress.

use crate::accounting::ledger::Ledger;
use crate::admission::plan::Plan;
use crate::error::GraphError;
use crate::executor::Execution;
use crate::executor::disturbance::Disturb;
use crate::executor::hosted::HostedGroup;
use crate::executor::threaded::Threads;
use crate::executor::virtual_time::VirtualRun;
use crate::graph::view::GraphView;
use crate::graph::wiring::Wiring;
use crate::group::group_run::{GroupRun, start_actors};
use crate::primitives::exchange::ExchangeReader;
use crate::primitives::sync::lock;
use crate::rate_group::RateGroup;
use crate::records::recorder::Registry;
use crate::reexecution::replay::Reexecution;
use crate::reports::group_live::GroupLive;
use crate::reports::live::LiveReader;
use crate::reports::report::{GroupCost, RuntimeFault, RuntimeFaultKind, RuntimeReport};
use crate::reports::tell::{News, Teller};
use crate::supervision::restart::Restarter;
use crate::supervision::stop::{Control, STOP_BOUND, StopHandle};
use crate::system::grant::{GrantHandle, SystemGrant};
use crate::time::Nanos;
use std::sync::{Arc, Mutex};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

/// How often a waiting program looks at the supervisor's mailbox.
const POLL: Duration = Duration::from_millis(5);

/// How long a stop waits until the program's subscriber has heard the rest.
const TOLD_BOUND: Duration = Duration::from_secs(1);

/// A graph that was checked and can be started.
///
/// ```
/// use palpate_runtime::{Execution, Nanos, Outcome, RateGroup, Runtime, actor_fn};
/// use std::time::Duration;
///
/// let mut graph = Runtime::builder(Execution::Virtual);
/// graph.group(RateGroup::hz(100), vec![actor_fn("idle", |_| Outcome::Continue)]).until(Nanos(1_000_000_000));
/// let running = graph.build()?.start()?;
/// running.wait_for(Duration::MAX);
/// assert_eq!(running.stop().groups[0].released, 101);
/// # Ok::<(), palpate_runtime::GraphError>(())
/// ```
///
/// # Real-time
/// Not real-time safe: allocates, and starting it makes threads.
pub struct Runtime {
    pub(crate) execution: Execution,
    pub(crate) wiring: Arc<Wiring>,
    pub(crate) groups: Vec<GroupRun>,
    pub(crate) restarters: Vec<Option<(Restarter, ExchangeReader<Ledger>)>>,
    /// Virtual time: what makes each group late.
    pub(crate) disturbances: Vec<Option<Disturb>>,
    pub(crate) reexecution: Option<Reexecution>,
    pub(crate) registry: Arc<Registry>,
    pub(crate) grants: GrantHandle,
    /// Virtual time: measures what each release costs.
    pub(crate) measures_cost: bool,
}

impl Runtime {
    /// The schedule: what each group asks for, what the cores bear, which releases coincide, and what this system would
    /// refuse now. Nothing is started.
    ///
    /// # Errors
    /// [`GraphErrorKind::Refused`](crate::GraphErrorKind::Refused) if the process has been moved to fewer cores since the graph was built and no longer
    /// fits.
    pub fn plan(&self) -> Result<Plan, GraphError> {
        Ok(Plan { graph: self.graph(), ..Plan::of(self.execution, &self.specs())? })
    }

    /// The graph as it stands before the run: its groups with their actors, and its ports. Ends that were not declared
    /// by a [link](crate::RuntimeBuilder::link) are known once they have been used.
    pub fn graph(&self) -> GraphView {
        self.wiring.view(self.execution, &self.specs())
    }

    fn specs(&self) -> Vec<RateGroup> {
        self.groups.iter().map(|group| group.spec.clone()).collect()
    }

    /// Sets the threads up, then starts all actors one after the other on this thread, then releases the groups.
    ///
    /// In virtual time nothing is released yet: [`RunningGraph::wait_for`] executes.
    ///
    /// # Errors
    /// The error of the first actor whose start failed, after those already started were stopped; or
    /// [`GraphErrorKind::Refused`](crate::GraphErrorKind::Refused) if the system gives no thread.
    pub fn start(self) -> Result<RunningGraph, GraphError> {
        let Self {
            execution,
            wiring,
            mut groups,
            restarters,
            disturbances,
            reexecution,
            registry,
            grants,
            measures_cost,
        } = self;
        let control = Control::new(groups.iter().filter(|group| !group.spec.observer).count());
        let names: Vec<String> = groups.iter().map(|group| group.spec.name.clone()).collect();
        let live: Vec<LiveReader> = groups.iter().map(|group| group.shown.clone()).collect();
        let specs: Vec<RateGroup> = groups.iter().map(|group| group.spec.clone()).collect();
        let teller = Teller::new(&live, &wiring.view(execution, &specs).warnings);
        let picture = Picture { execution, specs, wiring };
        let mut hosted = Vec::new();
        let executor = match execution {
            Execution::Threaded => {
                let (threads, groups) = Threads::start(groups, restarters, Arc::clone(&control), &grants)?;
                hosted = groups;
                Executor::Threaded(threads)
            }
            Execution::Virtual => {
                grants.set(SystemGrant::of_virtual_time(groups.iter().map(|group| &group.spec)));
                start_actors(&mut groups)?;
                let restarters =
                    restarters.into_iter().map(|restart| restart.map(|(restarter, _)| restarter)).collect();
                let control = Arc::clone(&control);
                let run = VirtualRun::new(groups, restarters, disturbances, reexecution, control, measures_cost);
                Executor::Virtual(run)
            }
        };
        let executor = Arc::new(Mutex::new(Supervised { executor, teller }));
        let telling = watch(&executor).inspect_err(|_| {
            if let Executor::Threaded(threads) = &mut lock(&executor).executor {
                // Nobody else would: the groups have been released.
                hosted.clear();
                threads.join(&names, STOP_BOUND);
            }
        })?;
        let (telling, hosted) = (Mutex::new(telling), Mutex::new(hosted));
        Ok(RunningGraph { executor, control, names, live, picture, registry, grants, telling, hosted })
    }
}

/// Starts a thread that answers faults while the program does not look, if there is a group that can be started again,
/// and another, which is returned, that tells the program's subscriber what happens, if it has one: a subscriber may
/// block. They end with the run.
fn watch(executor: &Arc<Mutex<Supervised>>) -> Result<Option<JoinHandle<()>>, GraphError> {
    let (watched, heard) = match &*lock(executor) {
        Supervised { executor: Executor::Threaded(threads), teller } => (threads.need_watching(), teller.is_heard()),
        _ => (false, false),
    };
    let start = |name: &str, look: fn(&Mutex<Supervised>) -> Option<bool>| {
        let run = Arc::downgrade(executor);
        let watch = move || {
            while run.upgrade().is_some_and(|executor| look(&executor) == Some(false)) {
                std::thread::park_timeout(POLL);
            }
        };
        let thread = std::thread::Builder::new().name(name.to_owned()).spawn(watch);
        thread.map_err(|error| GraphError::refused(format!("no thread for the {name}: {error}")))
    };
    if watched {
        start("supervisor", |executor| lock(executor).poll())?;
    }
    heard.then(|| start("teller", poll_and_tell)).transpose()
}

/// Looks after the threads and tells what is new, the latter without the lock.
fn poll_and_tell(executor: &Mutex<Supervised>) -> Option<bool> {
    let mut supervised = lock(executor);
    let over = supervised.poll();
    let news = supervised.news(over == Some(true));
    drop(supervised);
    news.tell();
    over
}

impl_debug!(Runtime, "execution": |own| own.execution, "groups": |own| own.specs());

/// An executor and what it has told so far.
struct Supervised {
    executor: Executor,
    teller: Teller,
}

impl Supervised {
    /// Looks after the threads; true when the run is over, `None` in virtual time, which nobody has to look after.
    fn poll(&mut self) -> Option<bool> {
        let Executor::Threaded(threads) = &mut self.executor else { return None };
        Some(threads.poll())
    }

    /// What has not been told.
    fn news(&mut self, end: bool) -> News {
        match &self.executor {
            Executor::Threaded(threads) => self.teller.news(&threads.supervisor, end),
            Executor::Virtual(run) => self.teller.news(&run.supervisor, end),
        }
    }
}

enum Executor {
    Threaded(Threads),
    Virtual(VirtualRun),
}

/// What the graph's picture is drawn from.
struct Picture {
    execution: Execution,
    specs: Vec<RateGroup>,
    wiring: Arc<Wiring>,
}

/// A run in progress. Dropping it stops it, within [`STOP_BOUND`] for each group that does not end.
pub struct RunningGraph {
    executor: Arc<Mutex<Supervised>>,
    control: Arc<Control>,
    names: Vec<String>,
    live: Vec<LiveReader>,
    picture: Picture,
    registry: Arc<Registry>,
    grants: GrantHandle,
    /// Tells the program's subscriber, if threads run and there is one.
    telling: Mutex<Option<JoinHandle<()>>>,
    /// The hosted groups that nobody has taken.
    hosted: Mutex<Vec<HostedGroup>>,
}

impl RunningGraph {
    /// Takes the [hosted](crate::Release::Hosted) group of this name, for the thread that releases it; `None` if it was taken, if
    /// there is none, and in virtual time, where the clock releases it.
    ///
    /// # Real-time
    /// Not real-time safe: takes a lock.
    pub fn take_hosted(&mut self, name: &str) -> Option<HostedGroup> {
        let mut hosted = lock(&self.hosted);
        let place = hosted.iter().position(|group| group.name() == name)?;
        Some(hosted.swap_remove(place))
    }

    /// Lets the run go on for `span`, less if it ends before.
    ///
    /// Threads: sleeps and looks at the supervisor's mailbox. Virtual time: executes the releases of that span.
    ///
    /// # Real-time
    /// Not real-time safe: sleeps, or executes the run. Never from an actor: in virtual time it would wait for itself.
    pub fn wait_for(&self, span: Duration) {
        let mut supervised = lock(&self.executor);
        if let Executor::Virtual(run) = &mut supervised.executor {
            run.advance(Nanos::from_duration(span));
            let news = supervised.news(true);
            drop(supervised);
            return news.tell();
        }
        drop(supervised);
        let start = Instant::now();
        while !self.finished() {
            let Some(left) = span.checked_sub(start.elapsed()).filter(|left| !left.is_zero()) else { return };
            std::thread::sleep(left.min(POLL));
        }
    }

    /// Time since the start of the run: the clock's, or virtual time executed so far.
    ///
    /// # Real-time
    /// Not real-time safe: takes a lock. Never from an actor: in virtual time [`wait_for`](Self::wait_for) holds it.
    pub fn elapsed(&self) -> Nanos {
        match &lock(&self.executor).executor {
            Executor::Threaded(threads) => threads.elapsed(),
            Executor::Virtual(run) => run.now,
        }
    }

    /// True when every group has ended: by [`until`](crate::RuntimeBuilder::until), by a stop or by a fault.
    ///
    /// # Real-time
    /// Not real-time safe: takes a lock, may start a group again. Never from an actor, as [`elapsed`](Self::elapsed).
    pub fn finished(&self) -> bool {
        let mut supervised = lock(&self.executor);
        match (supervised.poll(), &supervised.executor) {
            (None, Executor::Virtual(run)) => run.supervisor.all_ended(),
            (over, _) => over.unwrap_or(true),
        }
    }

    /// The state of every group as it is now, in graph order: counts, lateness and execution time since the start.
    ///
    /// # Real-time
    /// Never disturbs a tick: wait-free on both sides. It allocates: for threads that show it.
    pub fn live(&self) -> Vec<GroupLive> {
        self.live.iter().map(LiveReader::read).collect()
    }

    /// The graph as it is now: groups with their times so far, ports with what went through them.
    ///
    /// # Real-time
    /// Never disturbs a tick. It takes a lock and allocates: for threads that show it, never from an actor.
    pub fn graph(&self) -> GraphView {
        self.picture_at(self.elapsed())
    }

    fn picture_at(&self, elapsed: Nanos) -> GraphView {
        let Picture { execution, specs, wiring } = &self.picture;
        wiring.view(*execution, specs).after(elapsed, self.live())
    }

    /// Asks every group to end after the release it is in; returns at once.
    ///
    /// # Real-time
    /// Wait-free, real-time safe.
    pub fn request_stop(&self) {
        self.control.request_stop();
    }

    /// A handle that asks the run to stop from another thread, also from one that handles signals.
    ///
    /// # Real-time
    /// Wait-free, real-time safe.
    pub fn stop_handle(&self) -> StopHandle {
        StopHandle(Arc::clone(&self.control))
    }

    /// Stops the run in order and reports. A fault of an actor is in the report, not an error; so is a group that did
    /// not end within [`STOP_BOUND`] and was given up with its thread.
    ///
    /// # Real-time
    /// Not real-time safe: waits for every group. Never from an actor: its own group is one of them.
    pub fn stop(self) -> RuntimeReport {
        let given_up = self.end();
        let supervised = lock(&self.executor);
        let (supervisor, at, costs) = match &supervised.executor {
            Executor::Threaded(threads) => (&threads.supervisor, threads.elapsed(), Vec::new()),
            Executor::Virtual(run) => {
                let cost = |(name, cpu): (&String, _)| GroupCost { name: name.clone(), cpu };
                (&run.supervisor, run.now, self.names.iter().zip(run.costs()).map(cost).collect())
            }
        };
        let ((mut groups, fault), restarts) = (supervisor.results(), supervisor.restarts.clone());
        for group in &mut groups {
            if let Some(shown) = self.live.iter().find(|shown| shown.name() == group.name) {
                (group.lateness, group.execution) = shown.times();
            }
        }
        let what = "of a stop and its wind-down and was given up; its tick or stop must return";
        let stuck = || {
            RuntimeFault::of_group(
                &given_up.join("`, `"),
                at,
                RuntimeFaultKind::GivenUp,
                format!("did not end within {STOP_BOUND:?} {what}"),
            )
        };
        let fault = fault.or_else(|| (!given_up.is_empty()).then(stuck));
        let grant = self.grants.get().unwrap_or_default();
        RuntimeReport {
            groups,
            graph: self.picture_at(at),
            grant,
            fault,
            restarts,
            lost_records: self.registry.lost(),
            costs,
        }
    }

    /// Ends the run if it has not ended; returns the groups that had to be given up.
    fn end(&self) -> Vec<String> {
        // Nobody releases these any more.
        lock(&self.hosted).clear();
        let mut supervised = lock(&self.executor);
        let given_up = match &mut supervised.executor {
            Executor::Threaded(threads) => threads.join(&self.names, STOP_BOUND),
            Executor::Virtual(run) => {
                run.end_all();
                Vec::new()
            }
        };
        let virtual_time = matches!(supervised.executor, Executor::Virtual(_));
        let news = virtual_time.then(|| supervised.news(true));
        drop(supervised);
        news.into_iter().for_each(News::tell);
        let telling = lock(&self.telling).take();
        // A subscriber that stops the run is on that thread, and one that blocks must not keep the program.
        if let Some(thread) = telling.filter(|telling| telling.thread().id() != std::thread::current().id()) {
            thread.thread().unpark();
            let start = Instant::now();
            while !thread.is_finished() && start.elapsed() < TOLD_BOUND {
                std::thread::sleep(Duration::from_millis(1));
            }
        }
        given_up
    }
}

impl Drop for RunningGraph {
    fn drop(&mut self) {
        self.end();
    }
}

impl_debug!(RunningGraph, "groups": |own| own.names.clone());

#[cfg(all(test, not(loom)))]
mod tests {
    use super::*;
    use crate::{Outcome, RateGroup, actor_fn};

    #[test]
    fn a_run_can_be_shared_between_threads() {
        fn shared<T: Send + Sync>() {}
        shared::<RunningGraph>();
        shared::<StopHandle>();
    }

    fn give_up(running: &RunningGraph, bound: Duration) -> Vec<String> {
        match &mut lock(&running.executor).executor {
            Executor::Threaded(threads) => threads.join(&running.names, bound),
            Executor::Virtual(_) => unreachable!("the graph is threaded"),
        }
    }

    #[test]
    fn a_stop_waits_for_a_wind_down_that_takes_longer_than_its_bound() {
        let mut graph = Runtime::builder(Execution::Threaded);
        let group = RateGroup::hz(100).wind_down(Nanos(2_000_000_000));
        graph.group(group, vec![actor_fn("idle", |_| Outcome::Continue)]);
        let running = graph.build().unwrap().start().unwrap();
        running.wait_for(Duration::from_millis(30));
        assert_eq!(give_up(&running, Duration::from_millis(800)), [] as [&str; 0]);
        let report = running.stop();
        assert_eq!((report.fault, report.groups.len()), (None, 1));
    }

    /// Panics, and does not return from its stop until it is let go.
    struct HangsInStop(std::sync::mpsc::Sender<()>, std::sync::mpsc::Receiver<()>);

    impl crate::Actor for HangsInStop {
        fn name(&self) -> &str {
            "hangs in stop"
        }

        fn tick(&mut self, _: &crate::TickContext) -> Outcome {
            panic!("injected")
        }

        fn stop(&mut self, _: &crate::TickContext) {
            let _ = self.0.send(());
            let _ = self.1.recv();
        }
    }

    #[test]
    fn a_panic_is_the_fault_also_if_its_group_is_given_up_in_the_stop_after_it() {
        let ((stops, stopping), (let_go, held)) = (std::sync::mpsc::channel(), std::sync::mpsc::channel());
        let mut actors = Some(vec![Box::new(HangsInStop(stops, held)) as Box<dyn crate::Actor>]);
        let factory = move || Ok(actors.take().expect("it is made once"));
        let mut graph = Runtime::builder(Execution::Threaded);
        graph.restartable(RateGroup::hz(100).name("stuck"), crate::Restart::default(), factory);
        let running = graph.build().unwrap().start().unwrap();
        stopping.recv().unwrap();
        assert_eq!(give_up(&running, Duration::from_millis(300)), ["stuck"]);
        let fault = running.stop().fault.unwrap();
        assert_eq!((fault.kind, fault.actor.as_str()), (RuntimeFaultKind::Panic, "hangs in stop"));
        drop(let_go);
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
        assert_eq!(give_up(&running, bound), ["stuck"]);
        // Check that a later stop, and the drop, do not wait for it again
        let again = Instant::now();
        assert_eq!(give_up(&running, STOP_BOUND), ["stuck"]);
        assert!(again.elapsed() < STOP_BOUND);
        let report = running.stop();
        assert_eq!(report.fault.map(|fault| fault.group).as_deref(), Some("stuck"));
        assert_eq!(report.groups.iter().map(|group| group.name.as_str()).collect::<Vec<_>>(), ["log"]);
        drop(release);
    }
}
