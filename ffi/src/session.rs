//! A session that runs: what threads other than that of the haptic loop do with it.

use std::cell::RefCell;
use std::ffi::{CString, c_char};
use std::sync::Arc;
use std::time::{Duration, Instant};

use palpate::devices::{HostSide, PointerHandle};
use palpate::runtime::{HostedGroup, Rate, StopHandle};
use palpate::session::{Controls, Running, Summary, Viewer};

use crate::code::{Failure, PalpateCode};
use crate::contacts::Contacts;
use crate::fair_mutex::FairMutex;
use crate::handles::Handles;
use crate::types::{PalpateContact, PalpateSummary};

pub(crate) static SESSIONS: Handles<Live> = Handles::new("session");

/// For how long a wait in virtual time keeps others from the session, as long as one period takes less.
const SLICE: Duration = Duration::from_millis(50);
/// The least of virtual time that a wait runs at once, however long that takes.
const LEAST_SLICE: Duration = Duration::from_millis(1);
/// How often a wait on threads looks whether the session has ended.
const POLL: Duration = Duration::from_millis(5);

/// The session itself, for whoever has its turn; `None` once it has been stopped.
pub(crate) type Shared = FairMutex<Option<Running>>;

/// A session that runs.
pub(crate) struct Live {
    pub(crate) running: Arc<Shared>,
    pub(crate) is_virtual: bool,
    pub(crate) stop: StopHandle,
    pub(crate) viewer: Option<Viewer>,
    pub(crate) controls: Option<Controls>,
    pub(crate) pointer: Option<PointerHandle>,
    /// `None` if they are not shared.
    pub(crate) contacts: Option<Contacts>,
    pub(crate) host: Host,
}

/// Who ticks the session.
pub(crate) enum Host {
    /// Threads of palpate's.
    Palpate,
    /// The thread that will attach itself.
    Awaited(Box<Seat>),
    /// The thread that has.
    Attached,
}

/// What a thread needs to tick a session.
pub(crate) struct Seat {
    /// `None` in virtual time.
    pub(crate) group: Option<Box<HostedGroup>>,
    pub(crate) devices: Vec<HostSide>,
    pub(crate) haptic: Rate,
}

impl Live {
    pub(crate) fn new(mut running: Running, is_virtual: bool, hosts: Option<(Vec<HostSide>, Rate)>) -> Self {
        let host = match hosts {
            None => Host::Palpate,
            Some((devices, haptic)) => {
                Host::Awaited(Box::new(Seat { group: running.take_haptic_group().map(Box::new), devices, haptic }))
            }
        };
        Self {
            stop: running.stop_handle(),
            viewer: running.take_viewer(),
            controls: running.take_controls(),
            pointer: running.take_pointer(0),
            contacts: running.take_records().map(Contacts::new),
            running: Arc::new(FairMutex::new(Some(running))),
            is_virtual,
            host,
        }
    }

    pub(crate) fn controls(&self) -> Result<&Controls, Failure> {
        self.controls.as_ref().ok_or_else(|| Failure::argument("this session has no controls"))
    }

    pub(crate) fn viewer(&mut self) -> Result<&mut Viewer, Failure> {
        self.viewer.as_mut().ok_or_else(|| Failure::argument("this session shows no surface"))
    }

    /// Where the tools touch in the newest tick that is known.
    pub(crate) fn newest_contacts(&mut self) -> Result<Vec<PalpateContact>, Failure> {
        let contacts = self.contacts.as_mut().ok_or_else(|| {
            Failure::argument("contacts are not shared: call palpate_setup_share_contacts before the start")
        })?;
        let viewer = self.viewer.as_mut().ok_or_else(|| Failure::argument("no surface"))?;
        let triangles = viewer.triangles();
        Ok(contacts.newest(&triangles, &viewer.surface().positions))
    }
}

/// The session waits, or runs that much of virtual time; less if it ends before, also because another thread stops it, which does not
/// have to wait for this one.
pub(crate) fn wait(running: &Shared, is_virtual: bool, seconds: f64) -> Result<(), Failure> {
    let span = Duration::try_from_secs_f64(seconds)
        .map_err(|_| Failure::argument(format!("seconds is {seconds}, must be 0 or more")))?;
    // One that has been stopped is told here only: later it has ended while this waited.
    with_running(running, |_| ())?;
    if is_virtual {
        run_for(running, span)
    } else {
        sleep_for(running, span)
    }
    Ok(())
}

/// Waits on threads, which need nobody for it.
fn sleep_for(running: &Shared, span: Duration) {
    let start = Instant::now();
    while !has_ended(running) {
        let Some(left) = span.checked_sub(start.elapsed()).filter(|left| !left.is_zero()) else { return };
        std::thread::sleep(left.min(POLL));
    }
}

/// Runs virtual time in slices, between which it is others' turn; what it comes to does not depend on them.
fn run_for(running: &Shared, span: Duration) {
    let (mut left, mut slice) = (span, LEAST_SLICE);
    while !(left.is_zero() || has_ended(running)) {
        let part = left.min(slice);
        let start = Instant::now();
        if with_running(running, |running| running.wait_for(part)).is_err() {
            return;
        }
        left -= part;
        let took_long = start.elapsed() > SLICE;
        slice = if took_long { (slice / 2).max(LEAST_SLICE) } else { slice.saturating_mul(2) };
    }
}

/// True of one that has been stopped too.
fn has_ended(running: &Shared) -> bool {
    running.lock().as_ref().is_none_or(Running::finished)
}

pub(crate) fn with_running<R>(running: &Shared, with: impl FnOnce(&Running) -> R) -> Result<R, Failure> {
    running
        .lock()
        .as_ref()
        .map(with)
        .ok_or_else(|| Failure::new(PalpateCode::BadHandle, "the session has been stopped"))
}

/// The figures of a run.
pub(crate) fn figures(summary: &Summary) -> PalpateSummary {
    let report = &summary.report;
    let devices = || report.devices.iter();
    let most = |values: &mut dyn Iterator<Item = f64>| values.fold(0.0, f64::max);
    PalpateSummary {
        size: size_of::<PalpateSummary>() as u32,
        tools: report.devices.len() as u32,
        duration_s: report.duration.as_secs_f64(),
        ticks: devices().map(|device| device.force.ticks).sum(),
        resyncs: devices().map(|device| device.resyncs.jump_before_n.count).sum(),
        skipped: report.skipped(),
        missed: report.missed(),
        peak_force_n: most(&mut devices().map(|device| device.force.peak_n)),
        peak_commanded_n: most(&mut devices().map(|device| device.force.peak_commanded_n)),
    }
}

thread_local! {
    static REPORT: RefCell<CString> = RefCell::default();
}

/// Keeps the report of the session that this thread has stopped.
pub(crate) fn keep_text(text: String) {
    let text = CString::new(text.replace('\0', " ")).unwrap_or_default();
    REPORT.with_borrow_mut(|kept| *kept = text);
}

/// Where it is, until the next one.
pub(crate) fn kept_text() -> *const c_char {
    REPORT.with_borrow(|kept| kept.as_ptr())
}
