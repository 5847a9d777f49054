//! A logged run, executed again from what it was given, and what it computes compared with the log bit for bit.

mod compare;
mod cut;
mod fields;
mod logged;
mod report;

pub use report::{Compared, Difference, LoggedFault, ReplayReport, Unrepeated, UnrepeatedRelease};

use std::path::Path;
use std::time::Duration;

use super::parts::Parts;
use super::prepare::{Prepared, prepare};
use super::wire::{Rerun, start};
use crate::devices::{Capabilities, Device, DeviceState, Replayed, ReplayedSample};
use crate::error::{Error, ErrorKind};
use crate::runtime::{Actor, Execution, Nanos, Recording, RuntimeReport};
use crate::scene::{BodySpec, DeviceSpec, ModelChoice, Scene};
use compare::{Comparer, Comparison, End};
use cut::Cut;
use logged::Logged;

/// Simulated time between two reports of progress.
const STEP: Duration = Duration::from_millis(200);

/// A log that has passed every check and can be replayed; made by [`Session::replay`](super::Session::replay) or
/// [`SessionBuilder::replay`](super::SessionBuilder::replay).
#[derive(Debug)]
pub struct Replay {
    prepared: Prepared,
    recording: Recording,
    comparison: Comparison,
    /// Of what is repeated, and of the log.
    ends: [Nanos; 2],
    cut: Option<Cut>,
}

impl Replay {
    /// Of a scene's log: everything is in it.
    pub(super) fn of_scene(log: &Path) -> Result<Self, Error> {
        let logged = Logged::read(log)?;
        if logged.scene.body.is_none() {
            let message = "its body is a program's own: only that program can replay it, with `SessionBuilder::replay`";
            return Err(Error::new(ErrorKind::Log, message).at(log.display().to_string()));
        }
        let parts = Parts::new(None, logged.scene.clone());
        Self::new(parts, logged, log)
    }

    /// Of a log that was written by a session built as `parts` are.
    pub(super) fn of_parts(parts: Parts, log: &Path) -> Result<Self, Error> {
        Self::new(parts, Logged::read(log)?, log)
    }

    fn new(mut parts: Parts, logged: Logged, log: &Path) -> Result<Self, Error> {
        let place = log.display().to_string();
        let max_force_n = logged.scene.safety.max_force_n;
        // What the device of the run was: this one has no force.
        let (safety, logged_safety) = (&mut parts.scene.safety, &logged.scene.safety);
        safety.max_force_n = max_force_n;
        safety.max_torque_n_m = logged.scene.safety.max_torque_n_m;
        safety.max_damping_n_s_per_m = logged_safety.max_damping_n_s_per_m;
        safety.noise_m_s = logged_safety.noise_m_s;
        safety.max_stiffness_n_per_m = logged_safety.max_stiffness_n_per_m;
        safety.device_damping_n_s_per_m = logged_safety.device_damping_n_s_per_m;
        safety.device_friction_n = logged_safety.device_friction_n;
        safety.device_resolution_m = logged_safety.device_resolution_m;
        safety.device_delay_ms = logged_safety.device_delay_ms;
        // What the machine of the log chose, and not what this one would.
        if parts.scene.local.model == ModelChoice::Auto {
            parts.scene.local.model = logged.scene.local.model;
        }
        // Those of the program's own are not in the log, where they differ from device to device.
        let mut own = std::mem::take(&mut parts.devices).into_iter().map(|(_, device)| device.capabilities());
        let device = |(spec, (first, samples)): (&DeviceSpec, (DeviceState, Vec<ReplayedSample>))| {
            let known = own.next().unwrap_or_else(|| spec.capabilities());
            let capabilities = Capabilities {
                max_force_n: max_force_n.unwrap_or(known.max_force_n),
                max_torque_n_m: logged.scene.safety.max_torque_n_m.or(known.max_torque_n_m),
                ..known
            };
            (spec.name.clone(), Box::new(Replayed::new(first, samples, capabilities)) as Box<dyn Device>)
        };
        parts.devices = logged.scene.devices.iter().zip(logged.tools).map(device).collect();
        parts.is_replay = true;
        parts.options.execution = Execution::Virtual;
        // How far models reach ahead, and the bases that were wished for, are part of the recording.
        parts.options.in_real_time = logged.in_real_time;
        parts.options.log = None;
        parts.options.keep_records = false;
        let prepared = prepare(parts).map_err(|error| error.at(&place))?;
        let difference = first_difference(&prepared.scene.to_toml()?, &logged.scene.to_toml()?);
        if let Some((here, there)) = difference {
            let message = format!("it is the log of another session: `{there}` was run, this one has `{here}`");
            return Err(Error::new(ErrorKind::Log, message).at(place));
        }
        let mesh =
            |scene: &Scene| scene.body.as_ref().and_then(BodySpec::tetrahedra).and_then(|spec| spec.volume.clone());
        if mesh(&prepared.scene).zip(mesh(&logged.scene)).is_some_and(|(here, there)| here.mesh() != there.mesh()) {
            let message = "it is the log of another session: its body has another mesh than this one's";
            return Err(Error::new(ErrorKind::Log, message).at(place));
        }
        let Logged { recording, comparison, end, cut, .. } = logged;
        Ok(Self { prepared, ends: [recording.end(), end], recording, comparison, cut })
    }

    /// The scheduled time of the last release that is repeated.
    pub fn end(&self) -> Nanos {
        self.ends[0]
    }

    /// Executes the log in simulated time and compares every sample that it computes.
    ///
    /// # Errors
    /// If the session cannot be started again. A difference, or a re-execution that does not get to the end, is part of
    /// the report.
    pub fn run(self) -> Result<ReplayReport, Error> {
        self.run_with(|_| ())
    }

    /// Does what [`run`](Self::run) does, and tells `progress` from time to time how much has been executed.
    ///
    /// # Errors
    /// If the session cannot be started again.
    pub fn run_with(self, mut progress: impl FnMut(Nanos)) -> Result<ReplayReport, Error> {
        let Self { prepared, recording, comparison, ends, cut } = self;
        let compared = comparison.clone();
        let taker = Box::new(|drain| Box::new(Comparer::new(drain, compared)) as Box<dyn Actor>);
        let running = start(prepared, Some(Rerun { recording, taker }))?;
        while !running.finished() {
            running.wait_for(STEP);
            progress(running.elapsed().min(ends[0]));
        }
        Ok(report(&comparison, ends[1], cut, running.stop().runtime))
    }
}

fn report(comparison: &Comparison, end: Nanos, cut: Option<Cut>, mut runtime: RuntimeReport) -> ReplayReport {
    let (unrepeated, fault) = match (runtime.fault.take(), &cut) {
        (Some(fault), Some(cut)) => match cut.excuse(&runtime, fault) {
            Ok(unrepeated) => (Some(unrepeated), None),
            Err(fault) => (None, Some(fault)),
        },
        (fault, _) => (None, fault),
    };
    let ends = cut.as_ref().map(|cut| {
        let (last_local, local) = cut.end_of("local", unrepeated.as_ref());
        // After a fault of the re-execution the model lags because of that.
        let last_local = if fault.is_none() { last_local } else { Nanos::ZERO };
        End { local, last_local, global: cut.end_of("global", unrepeated.as_ref()).1 }
    });
    let ([force, commanded, others @ ..], first_difference) = comparison.finish(ends);
    let logged_fault = cut.map(|cut| cut.fault);
    let others = others.to_vec();
    ReplayReport { force, commanded, others, first_difference, end, logged_fault, unrepeated, fault }
}

/// The first line in which two texts differ.
fn first_difference(one: &str, other: &str) -> Option<(String, String)> {
    if one == other {
        return None;
    }
    let (mut one, mut other) = (one.lines(), other.lines());
    loop {
        let pair = (one.next().unwrap_or_default(), other.next().unwrap_or_default());
        if pair.0 != pair.1 {
            return Some((pair.0.to_owned(), pair.1.to_owned()));
        }
    }
}
