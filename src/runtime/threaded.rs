//! The threaded executor: one thread per rate group, absolute sleeps, integer release times.
//!
//! After warm-up the loop allocates nothing, takes no lock and makes no system call but its sleep.

use super::deadline::Ledger;
use super::exchange::ExchangeReader;
use super::grant::{GrantHandle, SystemGrant, ThreadGrant, set_up_thread};
use super::mailbox::{MailReceiver, MailSender, mailbox};
use super::os;
use super::pace::Pace;
use super::panic_hook;
use super::rate_group::RateGroup;
use super::release::GroupRun;
use super::report::RuntimeFault;
use super::restart::Restarter;
use super::running::STOP_BOUND;
use super::supervisor::{Control, Failure, Flag, Message, Supervisor};
use super::wait::Waiter;
use super::wake::Wake;
use crate::error::{Error, ErrorKind};
use crate::time::Nanos;
use crossbeam_channel::{Receiver, Sender, bounded};
use std::sync::Arc;
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

/// Time for all threads to wake up and wait for release 0.
const LEAD_NS: u64 = 2_000_000;
/// A fault in a tick, one in a stop and the end, or as many failures as a poll can find.
const MAIL_PER_GROUP: usize = 8;
/// How often a thread that waits for others looks again.
const POLL: Duration = Duration::from_millis(2);

/// What a thread waits for after its set-up.
struct Go {
    group: GroupRun,
    base_ns: u64,
    incarnation: usize,
    /// A fault is for the supervisor to answer, who may start the group again.
    restartable: bool,
    left_behind: Arc<Flag>,
}

/// A group's place among the threads.
struct Seat {
    handle: Option<JoinHandle<()>>,
    restart: Option<(Restarter, ExchangeReader<Ledger>)>,
    incarnation: usize,
    /// When the present thread was started.
    started: Nanos,
    /// Tells the present thread that it is not waited for any more.
    left_behind: Arc<Flag>,
}

/// The threads of a run.
pub(crate) struct Threads {
    seats: Vec<Seat>,
    post: MailSender<Message>,
    mail: MailReceiver<Message>,
    control: Arc<Control>,
    base_ns: u64,
    /// Set when somebody has waited long enough: nobody waits for the rest again.
    given_up: bool,
    /// Since when only observers are left.
    closing: Option<Instant>,
    /// When the last group that is no observer was seen to end.
    ended_at: Option<Nanos>,
    pub(crate) supervisor: Supervisor,
}

impl Threads {
    /// Sets the threads up, tells the grant, starts the actors on the calling thread and lets everything go.
    pub(crate) fn start(
        mut groups: Vec<GroupRun>,
        restarters: Vec<Option<(Restarter, ExchangeReader<Ledger>)>>,
        control: Arc<Control>,
        grants: &GrantHandle,
    ) -> Result<Self, Error> {
        panic_hook::install();
        let mut grant = SystemGrant::of_machine();
        if groups.iter().any(|group| group.spec.priority.is_some()) {
            grant.mlock = os::lock_memory().map_or_else(|reason| reason, |()| "locked".to_owned());
        }
        // Each group reports at most a fault in a tick, one in its stop, and its end; a restarted one again and again.
        let (post, mail) = mailbox(MAIL_PER_GROUP * groups.len());
        let mut handles = Vec::new();
        let mut gates = Vec::new();
        for group in &groups {
            let (thread, gate, granted) = spawn(&group.spec, &control, &post)?;
            handles.push(thread);
            gates.push(gate);
            grant.timer_slack = worse(grant.timer_slack, granted.timer_slack);
            grant.groups.push(granted.group);
        }
        grants.set(grant);
        start_actors(&mut groups)?;
        let base_ns = os::monotonic() + LEAD_NS;
        let supervisor = Supervisor::new(groups.len());
        let mut seats = Vec::new();
        for (((group, gate), restart), handle) in groups.into_iter().zip(gates).zip(restarters).zip(handles) {
            let left_behind = Arc::new(Flag::default());
            let restartable = restart.as_ref().is_some_and(|(restarter, _)| restarter.may_restart());
            let go = Go { group, base_ns, incarnation: 0, restartable, left_behind: Arc::clone(&left_behind) };
            // A thread waits at its gate until it gets its group, so this cannot fail.
            let _ = gate.send(go);
            seats.push(Seat { handle: Some(handle), restart, incarnation: 0, started: Nanos::ZERO, left_behind });
        }
        Ok(Self { seats, post, mail, control, base_ns, given_up: false, closing: None, ended_at: None, supervisor })
    }

    /// True if there is something to do besides counting what ends.
    pub(crate) fn need_watching(&self) -> bool {
        self.seats.iter().any(|seat| seat.restart.is_some())
    }

    /// Takes the mail and starts groups again; true when all groups have ended, or only observers are left that had
    /// [`STOP_BOUND`] to close what they hold.
    pub(crate) fn poll(&mut self) -> bool {
        while let Some(message) = self.mail.poll() {
            match message {
                Message::Failed(failure) => self.answer(failure),
                message => self.supervisor.note(message),
            }
        }
        for index in 0..self.seats.len() {
            if let Some(books) = self.hung(index) {
                self.leave_behind(index, books);
            }
        }
        let only_observers = self.control.observers_may_end();
        if only_observers && self.ended_at.is_none() {
            self.ended_at = Some(since(self.base_ns));
        }
        if self.supervisor.all_ended() {
            return true;
        }
        let closing = only_observers.then(|| *self.closing.get_or_insert_with(Instant::now));
        self.given_up |= closing.is_some_and(|begun| begun.elapsed() > STOP_BOUND);
        self.given_up
    }

    /// Starts a group again that has failed, or lets the run stop.
    fn answer(&mut self, failure: Box<Failure>) {
        let seat = &mut self.seats[failure.group];
        if failure.incarnation != seat.incarnation {
            return;
        }
        if let Some(handle) = seat.handle.take() {
            // It has posted its last message and is about to end.
            let _ = handle.join();
        }
        let allowed = seat.restart.as_ref().is_some_and(|(restarter, _)| restarter.may_restart());
        if self.control.stop_requested() || !allowed {
            self.give_up(failure);
        } else if let Err(error) = self.restart(failure.group, failure.fault.clone(), failure.books) {
            let what = format!("{}; it could not be started again: {error}", failure.fault.what);
            self.give_up(Box::new(Failure { fault: RuntimeFault { what, ..failure.fault }, ..*failure }));
        }
    }

    fn give_up(&mut self, failure: Box<Failure>) {
        // A fault while everything ends anyway is still a fault.
        self.control.request_stop();
        self.control.group_ended();
        self.supervisor.note(Message::Failed(failure));
    }

    fn restart(&mut self, index: usize, fault: RuntimeFault, books: Ledger) -> Result<(), Error> {
        let seat = &mut self.seats[index];
        let Some((restarter, reader)) = &mut seat.restart else { return Ok(()) };
        let (group, fresh) = restarter.again(fault, books, since(self.base_ns))?;
        *reader = fresh;
        let (thread, gate, _) = spawn(&group.spec, &self.control, &self.post)?;
        seat.incarnation += 1;
        seat.started = since(self.base_ns);
        seat.left_behind = Arc::new(Flag::default());
        seat.handle = Some(thread);
        let go = Go {
            group,
            base_ns: self.base_ns,
            incarnation: seat.incarnation,
            // Also after the last restart: a fault then comes here and stops the run.
            restartable: true,
            left_behind: Arc::clone(&seat.left_behind),
        };
        let _ = gate.send(go);
        Ok(())
    }

    /// The books of a restartable group whose release has not returned for too long.
    fn hung(&mut self, index: usize) -> Option<Ledger> {
        let seat = &mut self.seats[index];
        let (restarter, books) = seat.restart.as_mut()?;
        if self.control.stop_requested() || self.supervisor.has_ended(index) {
            return None;
        }
        books.refresh();
        let books = *books.get();
        // What was due before its thread was there is not its fault.
        let limit = books.next_due()?.max(seat.started) + restarter.policy.hung_after;
        (since(self.base_ns) > limit).then_some(books)
    }

    fn leave_behind(&mut self, index: usize, books: Ledger) {
        let now = since(self.base_ns);
        let seat = &mut self.seats[index];
        let Some((restarter, _)) = &mut seat.restart else { return };
        seat.left_behind.raise();
        // Its thread may never end: nobody joins it.
        seat.handle = None;
        let at = books.next_due().unwrap_or(now);
        restarter.abandoned(at);
        let waited = restarter.policy.hung_after;
        let allowed = restarter.may_restart();
        let what = format!("did not return within {waited} and was left behind");
        let fault = RuntimeFault { group: restarter.group().to_owned(), actor: String::new(), at, what };
        let report = restarter.report(&books);
        let failure = Failure { group: index, incarnation: seat.incarnation, fault, report, books };
        seat.incarnation += 1;
        if !allowed {
            return self.give_up(Box::new(failure));
        }
        if let Err(error) = self.restart(index, failure.fault.clone(), books) {
            let what = format!("{}; it could not be started again: {error}", failure.fault.what);
            self.give_up(Box::new(Failure { fault: RuntimeFault { what, ..failure.fault }, ..failure }));
        }
    }

    pub(crate) fn elapsed(&self) -> Nanos {
        self.ended_at.unwrap_or_else(|| since(self.base_ns))
    }

    /// Faults that were answered by a restart.
    pub(crate) fn restarts(&self) -> Vec<RuntimeFault> {
        let restarter = |seat: &'_ Seat| seat.restart.as_ref().map(|(restarter, _)| restarter.restarts.clone());
        self.seats.iter().filter_map(restarter).flatten().collect()
    }

    /// Requests a stop and waits for all groups, `bound` for each step of the way: a group that does not end is given
    /// up, then the observers get the same time to close what they hold. Returns the names of the groups given up.
    pub(crate) fn join(&mut self, names: &[String], bound: Duration) -> Vec<String> {
        self.control.request_stop();
        let mut progress = (self.supervisor.ended(), Instant::now());
        while !self.poll() && !self.given_up {
            if self.supervisor.ended() != progress.0 {
                progress = (self.supervisor.ended(), Instant::now());
            } else if progress.1.elapsed() > bound {
                self.given_up = self.control.abandon();
                progress.1 = Instant::now();
            }
            std::thread::sleep(POLL);
        }
        for (index, seat) in self.seats.iter_mut().enumerate() {
            if let Some(handle) = seat.handle.take().filter(|_| self.supervisor.has_ended(index)) {
                // Panics of actors were caught inside, and the report has already come.
                let _ = handle.join();
            }
        }
        let lost = |(index, name): (usize, &String)| (!self.supervisor.has_ended(index)).then(|| name.clone());
        names.iter().enumerate().filter_map(lost).collect()
    }
}

fn since(base_ns: u64) -> Nanos {
    Nanos(os::monotonic().saturating_sub(base_ns))
}

/// Keeps a refusal over a grant, so that one thread's refusal is not lost.
fn worse(a: String, b: String) -> String {
    if a.starts_with("refused") { a } else { b }
}

/// Starts all actors in group order; if one fails, stops those already started.
pub(crate) fn start_actors(groups: &mut [GroupRun]) -> Result<(), Error> {
    for index in 0..groups.len() {
        if let Err(error) = groups[index].start() {
            groups[..=index].iter_mut().for_each(GroupRun::undo_start);
            return Err(error);
        }
    }
    Ok(())
}

/// Starts the thread of a group and waits until it has set itself up.
fn spawn(
    spec: &RateGroup,
    control: &Arc<Control>,
    post: &MailSender<Message>,
) -> Result<(JoinHandle<()>, Sender<Go>, ThreadGrant), Error> {
    let (gate, go) = bounded(1);
    let (set_up, granted) = bounded(1);
    let (control, post, own) = (Arc::clone(control), post.clone(), spec.clone());
    let body = move || {
        let grant = set_up_thread(&own);
        let waiter = grant.waiter;
        if set_up.send(grant).is_ok() {
            group_thread(&go, waiter, &control, &post);
        }
    };
    let failed =
        |reason: String| Error::new(ErrorKind::Runtime, format!("no thread for rate group `{}`: {reason}", spec.name));
    let thread = std::thread::Builder::new().name(spec.name.clone()).spawn(body);
    let thread = thread.map_err(|error| failed(error.to_string()))?;
    let granted = granted.recv().map_err(|_| failed("it ended during its set-up".to_owned()))?;
    Ok((thread, gate, granted))
}

fn group_thread(go: &Receiver<Go>, mut waiter: Waiter, control: &Control, post: &MailSender<Message>) {
    // A closed gate means that the start failed elsewhere: nothing to run.
    let Ok(Go { mut group, base_ns, incarnation, restartable, left_behind }) = go.recv() else { return };
    group.close_when(Arc::clone(&left_behind));
    let index = usize::from(group.index);
    let observer = group.spec.observer;
    let now = || since(base_ns);
    let mut pace = Pace::new(&group);
    let mut failed = None;
    loop {
        let Some(due) = group.ledger.next_due() else {
            if group.spec.wind_down_at_end && group.begin_wind_down() {
                continue;
            }
            break;
        };
        let winding_down = group.is_winding_down();
        let leave = || match observer {
            true => control.observers_may_end(),
            false => !winding_down && control.stop_requested(),
        };
        let mut sleep = |until: Nanos| waiter.until(base_ns + until.0, leave).map(|woke_ns| Nanos(woke_ns - base_ns));
        let wake = match &mut pace {
            None => Ok(sleep(due).map(|woke| Wake::by_timer(due, woke))),
            Some(pace) => pace.wait(&mut group, due, now, |until| sleep(until).is_some()),
        };
        let result = match wake {
            Ok(Some(wake)) => group.release(wake, |_| now(), |_| now()),
            Ok(None) if group.begin_wind_down() => continue,
            Ok(None) => break,
            Err(fault) => Err(fault),
        };
        if left_behind.is_raised() {
            // Its place is taken: it says nothing any more, and its actors go with it.
            return;
        }
        if let Err(fault) = result {
            if restartable {
                failed = Some(fault);
                break;
            }
            post_fault(post, control, fault);
            if !group.begin_wind_down() {
                break;
            }
        }
    }
    if observer {
        while !control.observers_may_end() {
            std::thread::sleep(POLL);
        }
        if let Err(fault) = group.last_tick(now()) {
            post_fault(post, control, fault);
        }
    }
    let books = group.ledger;
    let (report, fault) = group.finish(now());
    if let Some(fault) = failed {
        post.try_send(Message::Failed(Box::new(Failure { group: index, incarnation, fault, report, books })));
        return;
    }
    if let Some(fault) = fault {
        post_fault(post, control, fault);
    }
    if !observer {
        control.group_ended();
    }
    post.try_send(Message::Ended(index, Box::new(report)));
}

fn post_fault(post: &MailSender<Message>, control: &Control, fault: RuntimeFault) {
    post.try_send(Message::Fault(fault));
    control.request_stop();
}
