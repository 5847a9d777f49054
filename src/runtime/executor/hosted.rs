//! A group that a thread of the program's own releases, such as the haptic loop of an application that has one.

use crate::accounting::timeline::Wake;
use crate::executor::beginning::since;
use crate::executor::group_thread::{GroupThread, next_due};
use crate::reports::report::RuntimeFaultKind;
use crate::system::os;
use crate::time::Nanos;
use std::sync::Arc;

/// The outcome of a call of [`HostedGroup::release`].
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum HostRelease {
    /// A release ran.
    Ran,
    /// No release: this period has had its own. Call again.
    Early,
    /// No release, and there will be none any more: drop the group.
    Ended,
}

/// A [hosted](crate::Release::Hosted) group of a run on threads: its actors run in [`release`](Self::release), on the thread that
/// calls it.
///
/// Time zero of the run is its first release: the threads of the other groups wait for it. From then on a release is run as it would
/// be for a frame of a [device](crate::Release::DevicePaced): the next one of the nominal grid, from seven eighths of a period before
/// it is due, or the one nearest in time, and the periods between are skipped with the cause
/// [`StalledPeer`](crate::SlipCause::StalledPeer). A host that is silent is not waited for, and nobody releases the group in its
/// place. After a stop was requested the group [winds down](crate::RateGroup::wind_down) by the releases that follow.
///
/// Dropping it stops its actors, on the thread that does so, and asks the run to stop; a run whose stop waits for it gives it up
/// after [`STOP_BOUND`](crate::STOP_BOUND).
///
/// ```
/// use palpate_runtime::{Execution, HostRelease, Outcome, RateGroup, Runtime, actor_fn};
///
/// let mut graph = Runtime::builder(Execution::Threaded);
/// let group = RateGroup::hz(1000).name("haptic").hosted();
/// graph.group(group, vec![actor_fn("idle", |_| Outcome::Continue)]);
/// let mut running = graph.build()?.start()?;
/// let mut haptic = running.take_hosted("haptic").expect("it is hosted");
/// assert_eq!(haptic.release(), HostRelease::Ran);
/// drop(haptic);
/// assert_eq!(running.stop().groups[0].released, 1);
/// # Ok::<(), palpate_runtime::GraphError>(())
/// ```
pub struct HostedGroup {
    /// `None` only while it is dropped.
    thread: Option<GroupThread>,
    ended: bool,
}

impl HostedGroup {
    pub(crate) fn new(mut thread: GroupThread) -> Self {
        let beginning = Arc::clone(&thread.link.beginning);
        thread.group.time_actors(move || beginning.elapsed());
        Self { thread: Some(thread), ended: false }
    }

    /// The name of the group.
    ///
    /// # Real-time
    /// Wait-free, real-time safe.
    pub fn name(&self) -> &str {
        self.thread.as_ref().map_or("", |thread| &thread.group.spec.name)
    }

    /// Readies the calling thread for releases: touches the stack that a tick may need. Policy and core of the thread are the
    /// program's.
    ///
    /// # Real-time
    /// Not real-time safe: faults pages.
    pub fn prepare_thread(&self) {
        os::touch_stack();
    }

    /// Runs the release that the present time asks for, if any.
    ///
    /// # Real-time
    /// Bounded and real-time safe if the actors are: reads the clock. A fault of an actor allocates its text. Where others wait for
    /// time zero, the first call sets it.
    pub fn release(&mut self) -> HostRelease {
        let Some(thread) = self.thread.as_mut().filter(|_| !self.ended) else { return HostRelease::Ended };
        let beginning = &thread.link.beginning;
        let base_ns = beginning.get().unwrap_or_else(|| beginning.set(os::monotonic()));
        let now = || since(base_ns);
        let group = &mut thread.group;
        let stops = !group.ledger.winding_down && thread.link.control.stop_requested();
        if stops && !group.begin_wind_down(now()) || next_due(group, now).is_none() {
            self.ended = true;
            return HostRelease::Ended;
        }
        let at = now();
        if at < group.ledger.next_frame_from() {
            return HostRelease::Early;
        }
        let Err(fault) = group.release(Wake::by_frame(at), |_| now(), |_| now()) else { return HostRelease::Ran };
        // The overrun policy has stopped the run in place of a release.
        let ran = !matches!(fault.kind, RuntimeFaultKind::Overrun { .. });
        self.ended = thread.after(fault, now()).is_break();
        match (ran, self.ended) {
            (true, _) => HostRelease::Ran,
            (false, false) => HostRelease::Early,
            (false, true) => HostRelease::Ended,
        }
    }

    /// Time since time zero; none before.
    ///
    /// # Real-time
    /// Wait-free, real-time safe.
    pub fn elapsed(&self) -> Nanos {
        self.thread.as_ref().map_or(Nanos::ZERO, |thread| thread.link.beginning.elapsed())
    }
}

impl Drop for HostedGroup {
    fn drop(&mut self) {
        if let Some(thread) = self.thread.take() {
            thread.link.control.request_stop();
            thread.end(None);
        }
    }
}

impl_debug!(HostedGroup, "name": |own| own.name().to_owned(), "ended": |own| own.ended);
