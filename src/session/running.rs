//! A session that runs, and what is left of it afterwards.

use std::fmt;
use std::sync::{Arc, Mutex, PoisonError};
use std::time::Duration;

use super::controls::Controls;
use super::records::SharedRecords;
use crate::actors::{LoggerOutcome, SurfaceView, ToolView};
use crate::devices::PointerHandle;
use crate::error::Error;
use crate::log::{LogRecord, RunReport};
use crate::model::body::{Body, State, von_mises};
use crate::model::mesh::Surface;
use crate::runtime::{GroupLive, HostedGroup, Nanos, OutletReader, RunningGraph, RuntimeReport, StopHandle};
use crate::runtime::{Histogram, HistogramReader};

/// A session that runs. Dropping it commands zero force and joins its threads, within
/// [`STOP_BOUND`](crate::runtime::STOP_BOUND) per group.
///
/// ```
/// use palpate::prelude::*;
/// use std::time::Duration;
///
/// # fn main() -> Result<(), Error> {
/// let running = Session::from_scene(Scene::demo()).virtual_time().build()?.start()?;
/// running.wait_for(Duration::from_millis(50));
/// assert!(!running.finished() && running.elapsed() >= Nanos::from_secs_f64(0.05));
/// let summary = running.stop();
/// assert!(summary.runtime.fault.is_none());
/// # Ok(())
/// # }
/// ```
///
/// # Real-time
/// Not for actors and devices, which stop a run by its [`stop_handle`](Self::stop_handle).
#[derive(Debug)]
pub struct Running {
    runtime: RunningGraph,
    outcome: LoggerOutcome,
    memory: Option<Memory>,
    outside: Outside,
    until: Option<Nanos>,
    builds: Option<HistogramReader>,
}

impl Running {
    pub(super) fn new(
        runtime: RunningGraph,
        outcome: LoggerOutcome,
        memory: Option<Memory>,
        outside: Outside,
        until: Option<Nanos>,
        builds: Option<HistogramReader>,
    ) -> Self {
        Self { runtime, outcome, memory, outside, until, builds }
    }

    /// Waits for `span`, or until the run has ended; in virtual time, runs that much of it.
    pub fn wait_for(&self, span: Duration) {
        self.runtime.wait_for(span);
    }

    /// Waits until the run has ended by itself; returns at once for one that has no end.
    pub fn wait(&self) {
        if self.until.is_some() {
            self.runtime.wait_for(Duration::MAX);
        }
    }

    /// Time since the start, simulated in virtual time.
    pub fn elapsed(&self) -> Nanos {
        self.runtime.elapsed()
    }

    /// The time at which the run ends by itself; `None` if it does not.
    pub fn until(&self) -> Option<Nanos> {
        self.until
    }

    /// True once the run has ended, by itself or by a fault.
    pub fn finished(&self) -> bool {
        self.runtime.finished()
    }

    /// Tells of every rate group how it stands now: counts, lateness and execution time since the start.
    ///
    /// # Real-time
    /// Never disturbs a tick: wait-free on both sides. It allocates: for threads that show it.
    pub fn live(&self) -> Vec<GroupLive> {
        self.runtime.live()
    }

    /// A handle that stops the run from another thread or from that of a signal handler.
    pub fn stop_handle(&self) -> StopHandle {
        self.runtime.stop_handle()
    }

    /// Takes the haptic group, if the session's local group is [hosted](crate::runtime::RateGroup::hosted): devices and local models
    /// then tick where the program [releases](HostedGroup::release) it. `None` if it was taken, and in virtual time, where
    /// [`wait_for`](Self::wait_for) releases it.
    pub fn take_haptic_group(&mut self) -> Option<HostedGroup> {
        self.runtime.take_hosted("local")
    }

    /// Takes the viewer, which shows the newest surface, tool and force to a program that draws; there is one, for one thread.
    pub fn take_viewer(&mut self) -> Option<Viewer> {
        self.outside.viewer.take()
    }

    /// Takes what moves the tool of `device`, counted from 0, if that follows a pointer.
    pub fn take_pointer(&mut self, device: usize) -> Option<PointerHandle> {
        self.outside.pointers.get_mut(device)?.take()
    }

    /// Takes the end at which records come while the session runs, if they are
    /// [shared](super::SessionBuilder::share_records).
    pub fn take_records(&mut self) -> Option<SharedRecords> {
        self.outside.records.take()
    }

    /// Takes what changes friction, stiffness and local model while the session runs; there is one, for one thread.
    pub fn take_controls(&mut self) -> Option<Controls> {
        self.outside.controls.take()
    }

    /// Ends the run and says how it went. A fault, a group that had to be given up or a log that could not be written is
    /// part of the summary.
    pub fn stop(self) -> Summary {
        let runtime = self.runtime.stop();
        let (report, log_error) = self.outcome.take();
        let records = self.memory.map(|memory| memory.take()).unwrap_or_default();
        let builds = self.builds.map(|builds| builds.snapshot());
        Summary { report, runtime, log_error, records, builds }
    }
}

/// What a program outside the graph may take of a session that runs.
#[derive(Debug)]
pub(super) struct Outside {
    pub(super) viewer: Option<Viewer>,
    /// In the order of the devices.
    pub(super) pointers: Vec<Option<PointerHandle>>,
    pub(super) records: Option<SharedRecords>,
    pub(super) controls: Option<Controls>,
}

/// Records kept in memory.
#[derive(Clone, Debug, Default)]
pub(super) struct Memory(Arc<Mutex<Vec<LogRecord>>>);

impl Memory {
    fn take(&self) -> Vec<LogRecord> {
        std::mem::take(&mut *self.0.lock().unwrap_or_else(PoisonError::into_inner))
    }

    pub(super) fn push(&self, record: LogRecord) {
        self.0.lock().unwrap_or_else(PoisonError::into_inner).push(record);
    }
}

/// A view of a running session for a program that draws: the newest surface, tools and forces, without disturbing a tick.
///
/// ```
/// use palpate::prelude::*;
/// use std::time::Duration;
///
/// # fn main() -> Result<(), Error> {
/// let mut running = Session::from_scene(Scene::demo()).virtual_time().build()?.start()?;
/// let mut viewer = running.take_viewer().expect("there is one");
/// running.wait_for(Duration::from_millis(100));
/// for [a, b, c] in viewer.triangles().iter().map(|nodes| nodes.map(|node| node as usize)) {
///     let corners = &viewer.surface().positions;
///     let _ = (corners[a], corners[b], corners[c]); // draw it
/// }
/// println!("the hand feels {} N at {} m", viewer.tool().commanded_force, viewer.tool().position);
/// # Ok(())
/// # }
/// ```
#[derive(Debug)]
pub struct Viewer {
    triangles: Arc<[[u32; 3]]>,
    surface: OutletReader<SurfaceView>,
    /// A copy of the body, as it was made, and where its nodes are: for what is computed of the surface that is shown.
    body: Option<(Box<dyn Body>, State)>,
    /// In the order of the devices.
    tools: Vec<OutletReader<ToolView>>,
}

impl Viewer {
    pub(super) fn new(body: &Surface, surface: OutletReader<SurfaceView>, tools: Vec<OutletReader<ToolView>>) -> Self {
        Self { triangles: body.triangles.as_slice().into(), surface, body: None, tools }
    }

    /// The same, which can tell the stress of `body`, if that can be copied and knows it.
    pub(super) fn with_stress(mut self, body: &dyn Body) -> Self {
        let state = State::at_rest(body.rest());
        let first = body.surface().triangles.first().and_then(|corners| body.stress(&state, corners[0]));
        self.body = first.and_then(|_| body.duplicate()).map(|body| (body, state));
        self
    }

    /// True if it can tell the stress of the body: if the session [shares its records](super::SessionBuilder::share_records), the body is
    /// none of a program's own that does not know it, and the global model is not behind a link.
    pub fn knows_stress(&self) -> bool {
        self.body.is_some()
    }

    /// Puts the equivalent stress of von Mises (Pa) at each of `nodes`, in the surface that was [taken](Self::surface) last, in place of
    /// `stress`: of elements from Cauchy's, of springs from the virial, without what dampers carry. It stays empty if the body does not
    /// know it.
    ///
    /// # Real-time
    /// For this side: some microseconds for each node. The session's threads do nothing for it.
    pub fn stress(&mut self, nodes: &[u32], stress: &mut Vec<f64>) {
        stress.clear();
        let Some((body, state)) = &mut self.body else { return };
        let SurfaceView { positions, stiffness, .. } = self.surface.get();
        state.positions.clone_from(positions);
        let of = |&node: &u32| body.stress(state, node).map_or(0.0, |stress| stiffness.factor() * von_mises(&stress));
        stress.extend(nodes.iter().map(of));
    }

    /// Node ids of the surface triangles, counter-clockwise seen from outside; they never change.
    pub fn triangles(&self) -> Arc<[[u32; 3]]> {
        Arc::clone(&self.triangles)
    }

    /// The newest positions of all nodes, at the rate of the global model. From behind a link come those of the surface, and the others stay
    /// where they began.
    ///
    /// # Real-time
    /// Wait-free, for this side and for the writer.
    pub fn surface(&mut self) -> &SurfaceView {
        self.surface.refresh();
        self.surface.get()
    }

    /// The newest tool and force, at the haptic rate: of the first device, if there are several.
    ///
    /// # Real-time
    /// Wait-free, for this side and for the writer.
    pub fn tool(&mut self) -> ToolView {
        self.tools().next().unwrap_or_default()
    }

    /// The newest tool and force of every device.
    ///
    /// # Real-time
    /// Wait-free, for this side and for the writer.
    pub fn tools(&mut self) -> impl Iterator<Item = ToolView> {
        self.tools.iter_mut().map(|tool| {
            tool.refresh();
            *tool.get()
        })
    }
}

/// An account of a run: its figures, its faults, and its records if they were kept.
///
/// ```
/// use palpate::prelude::*;
///
/// # fn main() -> Result<(), Error> {
/// let session = Session::from_scene(Scene::demo()).virtual_time().duration_s(0.1).keep_records();
/// let summary = session.build()?.run()?;
/// assert!(summary.runtime.fault.is_none() && summary.log_error.is_none());
/// assert_eq!(summary.report.devices[0].force.ticks, 100);
/// println!("{summary}{} records", summary.records.len());
/// # Ok(())
/// # }
/// ```
#[derive(Debug)]
pub struct Summary {
    /// Timing, resyncs, force, contact, limits and events.
    pub report: RunReport,
    /// The runtime's own counts, the rights that the system granted, and the fault that ended the run, if any.
    pub runtime: RuntimeReport,
    /// The error that ended the log before its time, if one did.
    pub log_error: Option<Error>,
    /// All records, if they were [kept](super::SessionBuilder::keep_records).
    pub records: Vec<LogRecord>,
    /// CPU time of building the local models of each resync, if [it was measured](super::SessionBuilder::measure_cost); none for
    /// `full`, which is never built anew.
    pub builds: Option<Histogram>,
}

impl fmt::Display for Summary {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        if self.report.groups.is_empty() {
            // The logger, which counts all that, was given up: the runtime's own sums are what is left.
            return writeln!(f, "{}", self.runtime);
        }
        self.report.fmt(f)?;
        for fault in &self.runtime.restarts {
            writeln!(f, "restarted: {fault}")?;
        }
        if let Some(fault) = &self.runtime.fault {
            writeln!(f, "fault: {fault}")?;
        }
        if let Some(error) = &self.log_error {
            writeln!(f, "log: {error}")?;
        }
        Ok(())
    }
}
