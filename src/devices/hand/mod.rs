//! A simulated force-feedback device and the hand that holds it, moves it and lets it go.
//!
//! Per axis m x'' = F_command + F_hand - b x' - F_c sgn(x'), with the hand a mass that moves with the device, a damper and
//! a spring to where it wants to be. Around it: what a real device adds to a loop, which is an encoder step, a velocity
//! from differences, a command that is held until the next, a transport with delay and jitter, and a largest force.
//!
//! It turns as it moves, about its own place and as easily about every axis: I w' = T_command + T_hand - c w, with the hand an
//! inertia, a damper and a spring to how it wants the device to be turned. The orientation is told as it is.
//!
//! Everything is a function of scheduled times and commands: a run in virtual time, or one that is executed again, meets
//! the same hand.

mod plant;
mod spec;
mod transport;
mod turning;

pub(super) use plant::{Load, Motion};
pub(crate) use spec::SpecFault;
pub use spec::{Axis, HandSpec, PlantSpec};

use super::{Capabilities, Device, DeviceFault, DeviceState, ForceCommand, ToolPath};
use crate::error::Error;
use crate::model::{Pose, Vec3};
use crate::runtime::Nanos;
use transport::Transport;
use turning::{Turning, Twist};

/// A simulated device in a simulated hand.
///
/// # Real-time
/// Real-time safe: allocates nothing, bounded by the time since the last read over the step of the integration.
#[derive(Clone, Debug)]
pub struct Hand {
    /// Where the hand wants to be, and how turned.
    intended: ToolPath,
    plant: PlantSpec,
    hand: HandSpec,
    release: Nanos,
    capabilities: Capabilities,
    transport: Transport,
    step: Nanos,
    now: Nanos,
    axes: [Motion; 3],
    turning: Turning,
    /// What the motors do.
    command: ForceCommand,
    told: Told,
}

/// What was told last, and when.
#[derive(Clone, Copy, Debug)]
struct Told {
    time: Nanos,
    position: Vec3,
    velocity: Vec3,
}

impl Hand {
    /// A `plant` with these `capabilities`, in a `hand` that wants to follow the path `intended`.
    ///
    /// # Errors
    /// [`ErrorKind::Scene`](crate::ErrorKind::Scene) with the name of a parameter that cannot be.
    ///
    /// # Real-time
    /// Not real-time safe: allocates.
    pub fn new(
        intended: ToolPath,
        plant: PlantSpec,
        hand: HandSpec,
        capabilities: Capabilities,
    ) -> Result<Self, Error> {
        let fault = plant.fault().or_else(|| hand.fault());
        let fault = fault.or_else(|| capabilities.fault().map(|words| ("capabilities", format!(": {words}"))));
        if let Some((field, message)) = fault {
            return Err(Error::scene(field, message));
        }
        let Pose { position, orientation } = intended.pose_at(0.0);
        let start = plant.start_m.map_or(position, Vec3::from);
        let axes = std::array::from_fn(|axis| Motion { place: start[axis], velocity: 0.0 });
        let delay = Nanos::from_secs_f64(plant.delay_ms * 1e-3);
        let mut device = Self {
            release: hand.release_s.map_or(Nanos(u64::MAX), Nanos::from_secs_f64),
            transport: Transport::new(delay, plant.jitter_ms * 1e-3, plant.seed),
            step: Nanos::from_secs_f64(plant.step_ms * 1e-3),
            intended,
            plant,
            hand,
            capabilities,
            now: Nanos::ZERO,
            axes,
            turning: Turning { orientation, ..Turning::default() },
            command: ForceCommand::ZERO,
            told: Told { time: Nanos::ZERO, position: start, velocity: Vec3::zeros() },
        };
        device.told.position = device.measured();
        Ok(device)
    }

    /// Moves on to `time`, in steps that end on multiples of the step and wherever something changes in between.
    fn advance(&mut self, time: Nanos) {
        while self.now < time {
            if let Some(command) = self.transport.arrived(self.now) {
                self.command = command;
            }
            let next_on_grid = Nanos((self.now.0 / self.step.0 + 1).saturating_mul(self.step.0));
            let changes = [self.transport.next_arrival(), Some(self.command.expires), Some(self.release)];
            let next_change = changes.into_iter().flatten().filter(|change| *change > self.now).min();
            let end = next_on_grid.min(time).min(next_change.unwrap_or(time));
            self.step_to(end);
            self.now = end;
        }
        if let Some(command) = self.transport.arrived(self.now) {
            self.command = command;
        }
    }

    fn step_to(&mut self, end: Nanos) {
        let (start_s, dt) = (self.now.as_secs_f64(), end.saturating_sub(self.now).as_secs_f64());
        let grip = if self.now < self.release { self.hand.level_at(start_s) } else { 0.0 };
        let (intended, force) = (self.intended.pose_at(start_s), self.saturated(self.now));
        for axis in &self.plant.axes {
            let axis = *axis as usize;
            let load = Load {
                mass_kg: self.plant.mass_kg + grip * self.hand.mass_kg,
                damping_n_s_per_m: self.plant.damping_n_s_per_m + grip * self.hand.damping_n_s_per_m,
                stiffness_n_per_m: grip * self.hand.stiffness_n_per_m,
                intended_m: intended.position[axis],
                force_n: force[axis] + self.plant.bias_n[axis],
                friction_n: self.plant.friction_n,
            };
            self.axes[axis] = self.axes[axis].after(dt, &load);
        }
        let twist = Twist {
            inertia_kg_m2: self.plant.inertia_kg_m2 + grip * self.hand.inertia_kg_m2,
            damping_n_m_s_per_rad: self.plant.turning_damping_n_m_s_per_rad
                + grip * self.hand.turning_damping_n_m_s_per_rad,
            stiffness_n_m_per_rad: grip * self.hand.turning_stiffness_n_m_per_rad,
            intended: intended.orientation,
            torque_n_m: self.saturated_torque(self.now),
        };
        self.turning = self.turning.after(dt, &twist);
    }

    /// The force of the motors at `time` (N).
    fn saturated(&self, time: Nanos) -> Vec3 {
        shortened(self.command.at(time), self.capabilities.max_force_n)
    }

    /// The torque of the motors at `time` (N m).
    fn saturated_torque(&self, time: Nanos) -> Vec3 {
        match self.plant.max_torque_n_m.or(self.capabilities.max_torque_n_m) {
            Some(most) => shortened(self.command.torque_at(time), most),
            None => Vec3::zeros(),
        }
    }

    fn place(&self) -> Vec3 {
        Vec3::new(self.axes[0].place, self.axes[1].place, self.axes[2].place)
    }

    /// The position that the encoders tell (m).
    fn measured(&self) -> Vec3 {
        let step = self.plant.encoder_step_m;
        if step > 0.0 { self.place().map(|c| (c / step).round() * step) } else { self.place() }
    }
}

impl Device for Hand {
    fn name(&self) -> &str {
        "hand"
    }

    fn capabilities(&self) -> Capabilities {
        self.plant.capabilities(self.capabilities)
    }

    fn read(&mut self, time: Nanos) -> Result<DeviceState, DeviceFault> {
        self.advance(time);
        let position = self.measured();
        let dt = time.saturating_sub(self.told.time).as_secs_f64();
        if dt > 0.0 {
            let difference = (position - self.told.position) / dt;
            // The exact step of a low-pass of first order over a held input, whatever the time between two reads.
            let share = self.plant.velocity_cutoff_hz.map_or(1.0, |hz| -(-std::f64::consts::TAU * hz * dt).exp_m1());
            let velocity = self.told.velocity + (difference - self.told.velocity) * share;
            self.told = Told { time, position, velocity };
        }
        let orientation = self.turning.orientation;
        Ok(DeviceState { position, velocity: self.told.velocity, orientation, buttons: 0 })
    }

    fn write(&mut self, command: ForceCommand) -> Result<(), DeviceFault> {
        if !command.is_finite() {
            self.transport.send(self.now, ForceCommand::ZERO);
            return Err(DeviceFault::Refused);
        }
        self.transport.send(self.now, command);
        Ok(())
    }

    fn exerted(&self) -> Option<Vec3> {
        Some(self.saturated(self.now))
    }

    fn exerted_torque(&self) -> Option<Vec3> {
        Some(self.saturated_torque(self.now))
    }
}

/// `vector`, no longer than `most`.
pub(super) fn shortened(vector: Vec3, most: f64) -> Vec3 {
    let norm = vector.norm();
    if norm <= most { vector } else { vector * (most / norm) }
}

#[cfg(test)]
mod tests;
