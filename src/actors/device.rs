//! The device actor: reads the tool at the start of a release, writes the force of the same release at its end.
//!
//! When the run stops, when nothing computes a force any more or when the device itself panicked, the force goes to zero
//! within the ramp time; after a gap in which nobody drove the device it starts from zero.

use super::believed::{Believed, Bounds, Disbelieved};
use super::cause::Cause;
use super::messages::{ComputedForce, DeviceSample, ToolView};
use crate::devices::{Calibration, Device, DeviceFault, DeviceState, ForceCommand};
use crate::error::{Error, ErrorKind};
use crate::log::{CommandSample, LogRecord, ToolSample};
use crate::model::Vec3;
use crate::runtime::Nanos;
use crate::runtime::{Actor, GroupMode, Outcome, OutletWriter, Reader, Recorder, TickContext, Writer};
use crate::safety::{Input, Output, Pipeline, Request};

/// A device that begins farther away tells another unit (m).
const FARTHEST_M: f64 = 1e3;

/// Releases without a new command after which the force goes to rest.
const COMMAND_EXPIRES: u32 = 2;

/// A time without a command (s) after which the device may have done anything: the force starts from zero.
pub(crate) const GAP_S: f64 = 0.1;

/// The ports of a [`DeviceActor`].
#[derive(Debug)]
pub struct DevicePorts {
    /// The device's newest state.
    pub samples: Writer<DeviceSample>,
    /// The newest force for it.
    pub commands: Reader<ComputedForce>,
    /// The newest tool and its forces for a program that draws.
    pub view: OutletWriter<ToolView>,
    /// The newest state that was not believed, for the log.
    pub disbelieved: OutletWriter<Disbelieved>,
    /// Records.
    pub recorder: Recorder,
}

/// Reads and writes one device; everything that is written passes the safety pipeline.
///
/// # Real-time
/// Bounded and real-time safe if the device is.
#[derive(Debug)]
pub struct DeviceActor {
    device: Box<dyn Device>,
    ports: DevicePorts,
    believed: Believed,
    disbelieved: u64,
    safety: Pipeline,
    /// Its number in the log.
    number: u16,
    last: DeviceSample,
    missed_commands: u32,
    /// Releases since the device gave a new state.
    stale_ticks: u32,
    /// Set while the device reads: still set after it panicked there.
    reading: bool,
}

impl DeviceActor {
    /// An actor for `device`, which has given its `first` state and is believed within `bounds`.
    pub fn new(
        device: Box<dyn Device>,
        first: DeviceState,
        bounds: Bounds,
        safety: Pipeline,
        ports: DevicePorts,
    ) -> Self {
        let (last, believed) = (DeviceSample { id: 0, state: first }, Believed::new(bounds, &first));
        let (number, disbelieved, missed_commands, stale_ticks, reading) = (0, 0, 0, 0, false);
        Self { device, ports, believed, disbelieved, safety, number, last, missed_commands, stale_ticks, reading }
    }

    /// The same as one of several: its records are those of device `number`.
    #[must_use]
    pub fn numbered(mut self, number: u16) -> Self {
        self.number = number;
        self
    }

    fn read(&mut self, ctx: &TickContext) -> Outcome {
        if self.reading {
            // It panicked: the last state is all there will be, and the run ends with a ramp.
            return Outcome::Continue;
        }
        self.stale_ticks = self.stale_ticks.saturating_add(1);
        self.reading = true;
        let state = self.device.read(ctx.scheduled);
        self.reading = false;
        match state.map(DeviceState::upright) {
            Ok(Some(state)) if state.is_finite() => {
                if let Err(wrong) = self.believed.believe(&state, ctx.scheduled) {
                    self.disbelieved += 1;
                    *self.ports.disbelieved.buffer() = Disbelieved { count: self.disbelieved, ..wrong };
                    self.ports.disbelieved.publish(ctx);
                    return Outcome::Degraded(Cause::DeviceImpossible.code());
                }
                self.last = DeviceSample { id: self.last.id.wrapping_add(1), state };
                self.stale_ticks = 0;
                Outcome::Continue
            }
            // No number, or four of an orientation that are no turn.
            Ok(_) => Outcome::Degraded(Cause::DeviceNotFinite.code()),
            Err(fault) => degraded(fault),
        }
    }
}

impl DeviceActor {
    fn safety_output(&mut self, ctx: &TickContext, command: &ComputedForce) -> Output {
        let dt = ctx.dt_nominal * (f64::from(ctx.slips) + 1.0);
        if dt >= GAP_S {
            return self.safety.release();
        }
        let rests = ctx.mode == GroupMode::Stopping || self.missed_commands > COMMAND_EXPIRES;
        let request = if rests { Request::Rest } else { Request::Force(command.force.into()) };
        // What happened in a tick counts once, however often its command is used.
        let is_new = self.missed_commands == 0;
        self.safety.apply(&Input {
            torque: command.torque.into(),
            stale_ticks: self.stale_ticks,
            model_age_ticks: command.age_ticks.saturating_add(self.missed_commands),
            swap_step: if is_new { command.swap_step.into() } else { [0.0; 3] },
            dissipated_j: if is_new { command.dissipated_j } else { 0.0 },
            ..Input::new(request, self.last.state.position.into(), dt)
        })
    }
}

impl Actor for DeviceActor {
    fn name(&self) -> &str {
        self.device.name()
    }

    fn wait(&mut self, timeout: Nanos) -> bool {
        self.device.wait(timeout.to_duration())
    }

    fn tick(&mut self, ctx: &TickContext) -> Outcome {
        let outcome = self.read(ctx);
        *self.ports.samples.buffer() = self.last;
        self.ports.samples.publish(ctx);
        let DeviceSample { id, state } = self.last;
        let sample = ToolSample {
            time: ctx.scheduled,
            id,
            position_m: state.position.into(),
            velocity_m_s: state.velocity.into(),
            buttons: state.buttons,
            orientation: state.orientation,
            device: self.number,
        };
        LogRecord::Tool(sample).push_to(&mut self.ports.recorder);
        outcome
    }

    fn commit(&mut self, ctx: &TickContext) -> Outcome {
        if self.ports.commands.refresh(ctx) {
            self.missed_commands = 0;
        } else if self.ports.commands.version() == 0 {
            // Release 0: nothing has been computed, so nothing is written.
            return Outcome::Continue;
        } else {
            self.missed_commands = self.missed_commands.saturating_add(1);
        }
        let command = *self.ports.commands.get();
        let Output { force, torque, actions, energy_j, tank_j } = self.safety_output(ctx, &command);
        // As long as the force would be taken up where it was, and no longer.
        let expires = ctx.scheduled + Nanos::from_secs_f64(GAP_S);
        let exerted = ForceCommand::until(Vec3::from(force), expires).with_torque(Vec3::from(torque));
        let outcome = self.device.write(exerted).map_or_else(degraded, |()| Outcome::Continue);
        let time = if self.missed_commands == 0 { command.time } else { ctx.scheduled };
        let (limits, device) = (actions.0, self.number);
        let sample = CommandSample { time, force_n: force, limits, energy_j, tank_j, torque_n_m: torque, device };
        LogRecord::Command(sample).push_to(&mut self.ports.recorder);
        let ComputedForce { position, mode, force: computed_force, torque: computed_torque, .. } = command;
        *self.ports.view.buffer() = ToolView {
            time,
            position,
            orientation: self.last.state.orientation,
            computed_force,
            commanded_force: exerted.force,
            computed_torque,
            commanded_torque: exerted.torque,
            mode,
        };
        self.ports.view.publish(ctx);
        outcome
    }

    fn recover(&mut self) -> bool {
        // Wherever the device panicked, a last chance to ramp out is better than a force that stays.
        true
    }

    fn stop(&mut self, _: &TickContext) {
        // A device that is gone cannot be told; there is nobody left to report to.
        let _ = self.device.write(ForceCommand::ZERO);
    }
}

/// The state of `device` before the start: without a first position there is no tool, a wrong one could lie inside the
/// body, and the first local model is built around it.
///
/// # Errors
/// [`ErrorKind::Device`] if it is not calibrated, gives none or one that is not finite, no turn or a kilometre away.
///
/// # Real-time
/// Not called in a tick: an error allocates.
pub fn first_state(device: &mut dyn Device) -> Result<DeviceState, Error> {
    let message = match (device.calibration(), device.read(Nanos::ZERO)) {
        (Calibration::Needed, _) => "it is not calibrated: calibrate it, then start again".to_owned(),
        (Calibration::Running, _) => "it is being calibrated: start again when that is done".to_owned(),
        (_, Ok(state)) if state.is_finite() && state.position.amax() > FARTHEST_M => {
            let place: [f64; 3] = state.position.into();
            format!("its first position is {place:?}, must lie within {FARTHEST_M} m of the origin")
        }
        (_, Ok(state)) if state.is_finite() => match state.upright() {
            Some(state) => return Ok(state),
            None => format!("its first orientation is {}, must be of length 1", state.orientation.coords),
        },
        (_, Ok(_)) => "its first state is not finite".to_owned(),
        (_, Err(fault)) => format!("no first state: {fault}"),
    };
    Err(Error::new(ErrorKind::Device, message).at(format!("device `{}`", device.name())))
}

fn degraded(fault: DeviceFault) -> Outcome {
    Outcome::Degraded(Cause::Device(fault).code())
}
