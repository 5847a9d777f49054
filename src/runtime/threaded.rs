//! The threaded executor: one thread per rate group, absolute sleeps, integer release times.
//!
//! After warm-up the loop allocates nothing, takes no lock and makes no system call but its sleep.

use super::grant::{GrantHandle, SystemGrant, ThreadGrant, set_up_thread};
use super::mailbox::{MailReceiver, MailSender, mailbox};
use super::os;
use super::pace::Pace;
use super::rate_group::{RateGroup, Wait};
use super::release::GroupRun;
use super::report::RuntimeFault;
use super::supervisor::{Control, Message, Supervisor};
use super::wake::Wake;
use crate::error::{Error, ErrorKind};
use crate::time::Nanos;
use crossbeam_channel::{Receiver, Sender, bounded};
use std::sync::Arc;
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

/// A slow group looks at the stop flag this often; longer than the period of 30 Hz, which so keeps its one sleep.
const SLICE_NS: u64 = 50_000_000;
/// Time for all threads to wake up and wait for release 0.
const LEAD_NS: u64 = 2_000_000;
/// How often a thread that waits for others looks again.
const POLL: Duration = Duration::from_millis(2);

/// What a thread waits for after its set-up.
struct Go {
    group: GroupRun,
    base_ns: u64,
}

/// The threads of a run.
pub(crate) struct Threads {
    handles: Vec<JoinHandle<()>>,
    mail: MailReceiver<Message>,
    control: Arc<Control>,
    base_ns: u64,
    /// Set when a join has waited long enough: nobody waits for the rest again.
    given_up: bool,
    /// When the last group was seen to end.
    ended_at: Option<Nanos>,
    pub(crate) supervisor: Supervisor,
}

impl Threads {
    /// Sets the threads up, tells the grant, starts the actors on the calling thread and lets everything go.
    pub(crate) fn start(mut groups: Vec<GroupRun>, control: Arc<Control>, grants: &GrantHandle) -> Result<Self, Error> {
        let mut grant = SystemGrant::of_machine();
        if groups.iter().any(|group| group.spec.priority.is_some()) {
            grant.mlock = os::lock_memory().map_or_else(|reason| reason, |()| "locked".to_owned());
        }
        // Each group reports at most a fault in a tick, one in its stop, and its end.
        let (post, mail) = mailbox(3 * groups.len());
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
        for (group, gate) in groups.into_iter().zip(gates) {
            // A thread waits at its gate until it gets its group, so this cannot fail.
            let _ = gate.send(Go { group, base_ns });
        }
        Ok(Self { handles, mail, control, base_ns, given_up: false, ended_at: None, supervisor })
    }

    /// Takes the mail; true when all groups have ended.
    pub(crate) fn poll(&mut self) -> bool {
        while let Some(message) = self.mail.poll() {
            self.supervisor.note(message);
        }
        let ended = self.supervisor.all_ended();
        if ended && self.ended_at.is_none() {
            self.ended_at = Some(since(self.base_ns));
        }
        ended
    }

    pub(crate) fn elapsed(&self) -> Nanos {
        self.ended_at.unwrap_or_else(|| since(self.base_ns))
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
        for (index, handle) in std::mem::take(&mut self.handles).into_iter().enumerate() {
            if self.supervisor.has_ended(index) {
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
        let wait = grant.wait;
        if set_up.send(grant).is_ok() {
            group_thread(&go, wait, &control, &post);
        }
    };
    let failed =
        |reason: String| Error::new(ErrorKind::Runtime, format!("no thread for rate group `{}`: {reason}", spec.name));
    let thread = std::thread::Builder::new().name(spec.name.clone()).spawn(body);
    let thread = thread.map_err(|error| failed(error.to_string()))?;
    let granted = granted.recv().map_err(|_| failed("it ended during its set-up".to_owned()))?;
    Ok((thread, gate, granted))
}

fn group_thread(go: &Receiver<Go>, wait: Wait, control: &Control, post: &MailSender<Message>) {
    // A closed gate means that the start failed elsewhere: nothing to run.
    let Ok(Go { mut group, base_ns }) = go.recv() else { return };
    let index = usize::from(group.index);
    let observer = group.spec.observer;
    let now = || since(base_ns);
    let leave = || if observer { control.observers_may_end() } else { control.stop_requested() };
    let sleep = |until: Nanos| wait_until(base_ns + until.0, wait, leave);
    let mut pace = Pace::new(&group);
    while let Some(due) = group.ledger.next_due() {
        let wake = match &mut pace {
            None => sleep(due).then(|| Wake::by_timer(due, now())),
            Some(pace) => pace.wait(&mut group, due, now, sleep),
        };
        let Some(wake) = wake else { break };
        if let Err(fault) = group.release(wake, |_| now(), |_| now()) {
            post_fault(post, control, fault);
            break;
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
    let (report, fault) = group.finish(now());
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

/// Waits until the clock has reached `due_ns`; false if it is time to leave instead.
fn wait_until(due_ns: u64, wait: Wait, leave: impl Fn() -> bool) -> bool {
    let margin_ns = match wait {
        Wait::SleepSpin { margin } => margin.0,
        Wait::Spin => u64::MAX,
        Wait::Auto | Wait::Sleep => 0,
    };
    let wake_ns = due_ns.saturating_sub(margin_ns);
    loop {
        if leave() {
            return false;
        }
        let now_ns = os::monotonic();
        if now_ns >= due_ns {
            return true;
        }
        if now_ns < wake_ns {
            os::sleep_until(wake_ns.min(now_ns + SLICE_NS));
        } else {
            std::hint::spin_loop();
        }
    }
}
