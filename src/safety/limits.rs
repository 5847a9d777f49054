//! What the pipeline is told before a run.

use super::model_age::ModelAge;
use super::passivity::Passivity;
use super::start_up::StartUp;
use super::tank::Tank;
use super::tool_speed::ToolSpeed;
use super::watchdog::Watchdog;

/// The properties of a device that limits and gains follow from.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct DeviceLimits {
    /// Largest force (N).
    pub max_force_n: f64,
    /// Largest torque (N m); `None` if it exerts none.
    pub max_torque_n_m: Option<f64>,
    /// Largest stiffness that it renders stably at its own rate (N/m).
    pub max_stiffness_n_per_m: f64,
    /// Largest damping that it renders stably (N s/m).
    pub max_damping_n_s_per_m: f64,
    /// Mechanical damping of the device itself (N s/m).
    pub damping_n_s_per_m: f64,
    /// Dry friction of the device itself (N); 0 if it is not known.
    pub friction_n: f64,
    /// Smallest step of the position that it tells (m); 0 if it is not known.
    pub resolution_m: f64,
    /// Delay from a computed force to a felt one, beyond the hold of one tick (s).
    pub delay_s: f64,
}

impl DeviceLimits {
    /// A device of which only the largest force is known. The others are those of a Touch, the least of the common desktop
    /// devices: 400 N/m and 4 N s/m at 1 kHz, and the mechanical damping that the sampled wall asks for at that stiffness,
    /// K T / 2.
    ///
    /// # Real-time
    /// Wait-free, real-time safe.
    pub fn of_force(max_force_n: f64) -> Self {
        Self {
            max_force_n,
            max_torque_n_m: None,
            max_stiffness_n_per_m: 400.0,
            max_damping_n_s_per_m: 4.0,
            damping_n_s_per_m: 400.0 * 1e-3 / 2.0,
            friction_n: 0.0,
            resolution_m: 0.0,
            delay_s: 0.0,
        }
    }
}

/// The limits of the safety pipeline; a stage that has none is off.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Limits {
    /// Largest force (N).
    pub max_force_n: f64,
    /// Largest torque (N m); without one none is commanded.
    pub max_torque_n_m: Option<f64>,
    /// Largest change of the force (N/s), infinite if there is none; the torque may change by the same share of its largest.
    pub max_slew_n_per_s: f64,
    /// Time in which the force goes to zero when it has to, and comes back afterwards (s).
    pub ramp_s: f64,
    /// Period of the local group (s).
    pub tick_s: f64,
    /// Limits of the stage that lets the force of a fast tool fade.
    pub(crate) tool_speed: Option<ToolSpeed>,
    /// Limits of the tank that pays for steps of model swaps.
    pub(crate) tank: Option<Tank>,
    /// Limits of the passivity controller.
    pub passivity: Option<Passivity>,
    /// Limits of the stage that lets the force of an old model fade.
    pub(crate) model_age: Option<ModelAge>,
    /// Limits of the start-up.
    pub(crate) start_up: Option<StartUp>,
    /// Limits of the watchdog over a silent device.
    pub(crate) watchdog: Option<Watchdog>,
}

impl Limits {
    /// Limits with every stage at its default, at 1 kHz, for a `device` in an environment that stores nothing at the start.
    ///
    /// # Real-time
    /// Wait-free, real-time safe.
    pub fn new(device: &DeviceLimits) -> Self {
        Self {
            tool_speed: Some(ToolSpeed::default()),
            tank: Some(Tank::default()),
            passivity: Some(Passivity {
                stored_j: 0.0,
                tolerance_j: 2e-3,
                max_damping_n_s_per_m: device.max_damping_n_s_per_m,
                noise_m_s: device.resolution_m / 1e-3,
            }),
            model_age: Some(ModelAge::default()),
            start_up: Some(StartUp::default()),
            watchdog: Some(Watchdog::default()),
            max_torque_n_m: device.max_torque_n_m,
            ..Self::bare(device.max_force_n)
        }
    }

    /// Limits with finite check, clamp to `max_force_n` (N), slew limit and ramp alone.
    ///
    /// # Real-time
    /// Wait-free, real-time safe.
    pub fn bare(max_force_n: f64) -> Self {
        Self {
            max_force_n,
            max_torque_n_m: None,
            max_slew_n_per_s: 500.0,
            ramp_s: 0.1,
            tick_s: 1e-3,
            tool_speed: None,
            tank: None,
            passivity: None,
            model_age: None,
            start_up: None,
            watchdog: None,
        }
    }
}
