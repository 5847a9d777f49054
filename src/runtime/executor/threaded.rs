//! The threaded executor: one thread per rate group, absolute sleeps, integer release times, and a supervisor that starts
//! again what failed.

use crate::accounting::ledger::Ledger;
use crate::error::GraphError;
use crate::executor::beginning::Beginning;
use crate::executor::group_thread::{GroupThread, Link};
use crate::executor::hosted::HostedGroup;
use crate::group::group_run::{GroupRun, start_actors};
use crate::group::lease::Lease;
use crate::group::panic_hook;
use crate::primitives::exchange::ExchangeReader;
use crate::rate_group::RateGroup;
use crate::reports::report::{RuntimeFault, RuntimeFaultKind};
use crate::supervision::overdue::{Overdue, OverdueWatch};
use crate::supervision::restart::Restarter;
use crate::supervision::stop::{Control, STOP_BOUND};
use crate::supervision::supervisor::{Failure, Message, Restarted, Supervisor};
use crate::system::grant::{GrantHandle, GroupGrant, SystemGrant, ThreadGrant, set_up_thread};
use crate::system::os::{self, ThreadProbe};
use crate::time::Nanos;
use crossbeam_channel::{Receiver, Sender, bounded, unbounded};
use std::fs::File;
use std::sync::Arc;
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

/// Time for all threads to wake up and wait for release 0.
const LEAD_NS: u64 = 2_000_000;
/// How often a thread that waits for others looks again.
const POLL: Duration = Duration::from_millis(2);
/// Between two polls no more than this counts as waiting: if the whole process or machine stood still, nobody hung.
const LONGEST_STEP: Nanos = Nanos(50_000_000);

/// A group's place among the threads.
struct Seat {
    handle: Option<JoinHandle<()>>,
    /// `None` if the group is not restartable, or while a replacement is made.
    restart: Option<(Restarter, ExchangeReader<Ledger>)>,
    incarnation: usize,
    lease: Arc<Lease>,
    /// What its actors failed of, while they stop.
    failing: Option<RuntimeFault>,
    /// `None` for a hosted group, whose thread is none of ours.
    probe: Option<ThreadProbe>,
    watch: OverdueWatch,
}

/// The threads of a run.
pub(crate) struct Threads {
    seats: Vec<Seat>,
    post: Sender<Message>,
    /// Polled, never waited at: to wake a parked receiver would cost a group's thread a mutex and a futex.
    mail: Receiver<Message>,
    control: Arc<Control>,
    grants: GrantHandle,
    beginning: Arc<Beginning>,
    polled: Nanos,
    /// The longest time that a group takes to come to rest.
    wind_down: Duration,
    /// Set when somebody has waited long enough: nobody waits for the rest again.
    given_up: bool,
    /// Since when only observers are left.
    closing: Option<Instant>,
    /// When the last group that is no observer was seen to end.
    ended_at: Option<Nanos>,
    /// Open for as long as the run lasts.
    _awake: Option<File>,
    pub(crate) supervisor: Supervisor,
}

impl Threads {
    /// Sets the threads up, tells the grant, starts the actors on the calling thread and lets everything go; with that the groups
    /// that have no thread, whose first release is what the others then wait for.
    pub(crate) fn start(
        mut groups: Vec<GroupRun>,
        restarters: Vec<Option<(Restarter, ExchangeReader<Ledger>)>>,
        control: Arc<Control>,
        grants: &GrantHandle,
    ) -> Result<(Self, Vec<HostedGroup>), GraphError> {
        panic_hook::install();
        let mut grant = SystemGrant::of_machine();
        if groups.iter().any(|group| group.spec.is_realtime()) {
            grant.mlock = os::lock_memory().map_or_else(|reason| reason, |()| "locked".to_owned());
        }
        let (post, mail) = unbounded();
        let mut places = Vec::new();
        for group in &groups {
            if group.spec.is_hosted() {
                grant.groups.push(GroupGrant::hosted(&group.spec));
                places.push(None);
                continue;
            }
            let (thread, gate, granted) = spawn(&group.spec)?;
            places.push(Some((thread, gate, granted.probe)));
            grant.timer_slack = worse(grant.timer_slack, granted.timer_slack);
            grant.groups.push(granted.group);
        }
        // Who may not have a real-time policy gains little by it.
        let real_time = grant.groups.iter().any(SystemGrant::is_realtime);
        let awake = real_time.then(os::stay_awake);
        if let Some(awake) = &awake {
            grant.idle_states = awake.as_ref().map_or_else(String::clone, |_| "held off".to_owned());
        }
        grants.set(grant);
        start_actors(&mut groups)?;
        let wind_down = groups.iter().map(|group| group.spec.wind_down).max().unwrap_or_default().to_duration();
        let beginning = Arc::new(Beginning::new());
        if places.iter().all(Option::is_some) {
            beginning.set(os::monotonic() + LEAD_NS);
        }
        let supervisor = Supervisor::new(groups.len());
        let (mut seats, mut hosted) = (Vec::new(), Vec::new());
        for ((group, place), restart) in groups.into_iter().zip(places).zip(restarters) {
            let lease = Arc::new(Lease::default());
            let (control, post) = (Arc::clone(&control), post.clone());
            let link =
                Link { beginning: Arc::clone(&beginning), incarnation: 0, lease: Arc::clone(&lease), control, post };
            let restartable = restart.as_ref().is_some_and(|(restarter, _)| restarter.may_restart());
            let thread = GroupThread { group, restartable, watched: restart.is_some(), link };
            let (handle, probe) = match place {
                Some((handle, gate, probe)) => {
                    // A thread waits at its gate until it gets its group, so this cannot fail.
                    let _ = gate.send(thread);
                    (Some(handle), Some(probe))
                }
                None => {
                    hosted.push(HostedGroup::new(thread));
                    (None, None)
                }
            };
            let watch = OverdueWatch::default();
            seats.push(Seat { handle, restart, incarnation: 0, lease, failing: None, probe, watch });
        }
        let threads = Self {
            seats,
            post,
            mail,
            control,
            grants: grants.clone(),
            beginning,
            polled: Nanos::ZERO,
            wind_down,
            given_up: false,
            closing: None,
            ended_at: None,
            _awake: awake.and_then(Result::ok),
            supervisor,
        };
        Ok((threads, hosted))
    }

    /// True if there is something to do besides counting what ends.
    pub(crate) fn need_watching(&self) -> bool {
        self.seats.iter().any(|seat| seat.restart.is_some())
    }

    /// Takes the mail and lets failed groups start again; true when all groups have ended, or only observers are left
    /// that had [`STOP_BOUND`] to close what they hold.
    pub(crate) fn poll(&mut self) -> bool {
        while let Ok(message) = self.mail.try_recv() {
            match message {
                Message::Failing(group, incarnation, fault) => {
                    let seat = &mut self.seats[group];
                    if incarnation == seat.incarnation {
                        seat.failing = Some(fault);
                    }
                }
                Message::Failed(failure) => self.answer(failure),
                Message::Restarted(begun) => self.install(*begun),
                Message::NotRestarted(failure) => self.give_up(failure),
                message => self.supervisor.note(message),
            }
        }
        self.watch();
        let only_observers = self.control.observers_may_end();
        if only_observers && self.ended_at.is_none() {
            self.ended_at = Some(self.beginning.elapsed());
        }
        if self.supervisor.all_ended() {
            return true;
        }
        let closing = only_observers.then(|| *self.closing.get_or_insert_with(Instant::now));
        self.given_up |= closing.is_some_and(|begun| begun.elapsed() > STOP_BOUND);
        self.given_up
    }

    /// Lets a group start again that has failed, or the run stop.
    fn answer(&mut self, failure: Box<Failure>) {
        let seat = &mut self.seats[failure.group];
        if failure.incarnation != seat.incarnation {
            return;
        }
        if let Some(handle) = seat.handle.take() {
            // It has posted its last message and is about to end.
            let _ = handle.join();
        }
        self.succeed(failure);
    }

    /// Starts the thread that takes the place of the one that failed.
    fn succeed(&mut self, failure: Box<Failure>) {
        let seat = &mut self.seats[failure.group];
        let restarter = seat.restart.take().map(|(restarter, _)| restarter).filter(Restarter::may_restart);
        // What has begun to come to rest is not begun anew.
        let is_over = self.control.stop_requested() || failure.books.winding_down;
        let Some(restarter) = restarter.filter(|_| !is_over) else {
            return self.give_up(failure);
        };
        seat.incarnation += 1;
        seat.lease = Arc::new(Lease::default());
        (seat.watch, seat.failing) = (OverdueWatch::default(), None);
        let link = Link {
            incarnation: seat.incarnation,
            beginning: Arc::clone(&self.beginning),
            lease: Arc::clone(&seat.lease),
            control: Arc::clone(&self.control),
            post: self.post.clone(),
        };
        match link.replace(restarter, failure) {
            Ok(handle) => seat.handle = Some(handle),
            Err(failure) => self.give_up(failure),
        }
    }

    /// A replacement has made the actors and goes on.
    fn install(&mut self, begun: Restarted) {
        let seat = &mut self.seats[begun.group];
        (seat.restart, seat.probe) = (Some((begun.restarter, begun.books)), Some(begun.probe));
        self.supervisor.restarts.push(begun.failure.fault);
        self.grants.replace(begun.group, begun.grant);
    }

    fn give_up(&mut self, failure: Box<Failure>) {
        // A fault while everything ends anyway is still a fault.
        self.control.request_stop();
        self.control.group_ended();
        self.supervisor.note(Message::Failed(failure));
    }

    /// Looks for releases that do not return.
    fn watch(&mut self) {
        let now = self.beginning.elapsed();
        let step = now.saturating_sub(self.polled).min(LONGEST_STEP);
        self.polled = now;
        for index in 0..self.seats.len() {
            if self.hangs(index, now, step) {
                self.leave_behind(index, now);
            }
        }
    }

    /// True if a restartable group's release hangs.
    fn hangs(&mut self, index: usize, now: Nanos, step: Nanos) -> bool {
        let seat = &mut self.seats[index];
        let Some((restarter, books)) = &mut seat.restart else { return false };
        if self.control.stop_requested() || self.supervisor.has_ended(index) {
            return false;
        }
        books.refresh();
        let books = books.get();
        let Some(due) = books.next_due() else { return false };
        // Of the time since the last look, what it was overdue for; a device-paced group may wait for its device.
        let late = step.min(now.saturating_sub(due + restarter.spec.watchdog().unwrap_or_default()));
        let Some(probe) = seat.probe else { return false };
        let (release, limit) = (books.elapsed_periods(), restarter.policy.hung_after);
        match seat.watch.look(release, late, limit, probe.cpu(), || probe.is_ready()) {
            Overdue::Waited => false,
            Overdue::Starved => {
                restarter.starved(due);
                false
            }
            Overdue::Hung => true,
        }
    }

    fn leave_behind(&mut self, index: usize, now: Nanos) {
        let seat = &mut self.seats[index];
        let Some((restarter, books)) = &mut seat.restart else { return };
        let release = books.get().elapsed_periods();
        books.refresh();
        if books.get().elapsed_periods() != release || !seat.lease.revoke() {
            // It has just come back.
            return;
        }
        // Nothing is booked any more: these are the last.
        books.refresh();
        let books = *books.get();
        // Its thread may never end: nobody joins it, and it takes the core from nobody.
        seat.handle = None;
        seat.probe.iter().for_each(ThreadProbe::put_behind);
        let at = books.next_due().unwrap_or(now);
        restarter.abandoned(at);
        let what = format!("did not return within {} and was left behind", restarter.policy.hung_after);
        let fault = match seat.failing.take() {
            Some(fault) => RuntimeFault { what: format!("{}; its stop {what}", fault.what), ..fault },
            None => RuntimeFault::of_group(&restarter.spec.name, at, RuntimeFaultKind::Hung, what),
        };
        let (report, incarnation) = (books.report(&restarter.spec), seat.incarnation);
        self.succeed(Box::new(Failure { group: index, incarnation, fault, report, books }));
    }

    pub(crate) fn elapsed(&self) -> Nanos {
        self.ended_at.unwrap_or_else(|| self.beginning.elapsed())
    }

    /// Requests a stop and waits for all groups, `bound` for each step of the way and the longest wind-down: a group that
    /// does not end is given up, then the observers get the same time to close what they hold. Returns the names of the
    /// groups given up.
    pub(crate) fn join(&mut self, names: &[String], bound: Duration) -> Vec<String> {
        self.control.request_stop();
        let mut progress = (self.supervisor.ended(), Instant::now());
        while !self.poll() && !self.given_up {
            if self.supervisor.ended() != progress.0 {
                progress = (self.supervisor.ended(), Instant::now());
            } else if progress.1.elapsed() > bound + self.wind_down {
                self.given_up = self.control.abandon();
                progress.1 = Instant::now();
            }
            std::thread::sleep(POLL);
        }
        for (index, seat) in self.seats.iter_mut().enumerate() {
            if let Some(fault) = seat.failing.take() {
                // Whatever it does since then is the consequence.
                self.supervisor.note(Message::Fault(fault));
            }
            if let Some(handle) = seat.handle.take().filter(|_| self.supervisor.has_ended(index)) {
                // Panics of actors were caught inside, and the report has already come.
                let _ = handle.join();
            }
        }
        let lost = |(index, name): (usize, &String)| (!self.supervisor.has_ended(index)).then(|| name.clone());
        names.iter().enumerate().filter_map(lost).collect()
    }
}

/// Keeps a refusal over a grant, so that one thread's refusal is not lost.
fn worse(a: String, b: String) -> String {
    if a.starts_with("refused") { a } else { b }
}

/// Starts a thread for a group and waits until it has set itself up; it then waits for its group.
fn spawn(spec: &RateGroup) -> Result<(JoinHandle<()>, Sender<GroupThread>, ThreadGrant), GraphError> {
    let (gate, go) = bounded::<GroupThread>(1);
    let (set_up, granted) = bounded(1);
    let own = spec.clone();
    let body = move || {
        let grant = set_up_thread(&own);
        let waiter = grant.waiter;
        // A closed gate means that the start failed elsewhere: nothing to run.
        if set_up.send(grant).is_ok()
            && let Ok(thread) = go.recv()
        {
            thread.run(waiter);
        }
    };
    let failed = |reason: String| GraphError::refused(format!("no thread for rate group `{}`: {reason}", spec.name));
    let thread = spec.thread().spawn(body);
    let thread = thread.map_err(|error| failed(error.to_string()))?;
    let granted = granted.recv().map_err(|_| failed("it ended during its set-up".to_owned()))?;
    Ok((thread, gate, granted))
}
