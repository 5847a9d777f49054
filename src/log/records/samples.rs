//! What a haptic tick leaves behind: one declaration for each record gives the plain struct, its form as one or two of the
//! runtime's 64-byte records, and, unless viewers have a message of their own for it, its protobuf message.

use super::packing::{packed, packed_field, record};
use crate::model::Turn;
use crate::model::contact::ContactMode;
use crate::runtime::Nanos;
use crate::runtime::Record;

/// The kind of local model that served a haptic tick, or what it fell back to.
///
/// # Real-time
/// A plain value: its methods are wait-free and real-time safe.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, PartialOrd, Ord)]
#[repr(u16)]
#[allow(missing_docs)]
pub enum ServedBy {
    #[default]
    Unknown = 0,
    Full = 1,
    Hold = 2,
    Patch = 3,
    LinearBoundary = 4,
    ScaledBoundary = 5,
    Condensed = 6,
    /// Also `predictive` without its basis: the ring moves as predicted for tools that stay where they are, whatever happens.
    Predicted = 7,
    Predictive = 8,
}

impl ServedBy {
    /// Every kind, in the order of the numbers.
    pub const ALL: [Self; 9] = [
        Self::Unknown,
        Self::Full,
        Self::Hold,
        Self::Patch,
        Self::LinearBoundary,
        Self::ScaledBoundary,
        Self::Condensed,
        Self::Predicted,
        Self::Predictive,
    ];

    /// The kind with this number; unknown numbers read as unknown.
    ///
    /// # Real-time
    /// Wait-free, real-time safe.
    pub fn from_code(code: u16) -> Self {
        Self::ALL.get(usize::from(code)).copied().unwrap_or_default()
    }

    /// The name in reports.
    ///
    /// # Real-time
    /// Wait-free, real-time safe.
    pub fn name(self) -> &'static str {
        match self {
            Self::Unknown => "unknown",
            Self::Full => "full",
            Self::Hold => "hold",
            Self::Patch => "patch",
            Self::LinearBoundary => "linear_boundary",
            Self::ScaledBoundary => "scaled_boundary",
            Self::Condensed => "condensed",
            Self::Predicted => "predicted",
            Self::Predictive => "predictive",
        }
    }
}

packed_field! {
    ServedBy: |at, value| at.record.code = value as u16, Self::from_code(at.record.code);
    ContactMode: |at, value| at.record.code = value as u16, Self::from_code(at.record.code);
}

record! {
    /// The force of one haptic tick, on the topic `/force`.
    ForceSample is "palpate.Force" on 0 {
        /// The end of the tick.
        time = 1,
        /// The force on the tool, mean over the tick, after blending and before the safety pipeline (N).
        force_n: [f64; 3] = 2,
        /// The version of the local model that served the tick.
        model_version: u32 = 3,
        /// The age of that model's last resync (s).
        model_age_s: f64 = 4,
        /// The energy that the tool has given to the simulation since the start, negative if it got some (J).
        energy_j: f64 = 5,
        /// The kind of that model in this tick.
        served_by: ServedBy = 6,
    } and {
        /// The torque on the tool about its centre, mean over the tick (N m); zero for a point.
        torque_n_m: [f64; 3] = 8,
    } of device 7
}

record! {
    /// The force that the device was commanded, on the topic `/force_commanded`.
    CommandSample is "palpate.CommandedForce" on 6 {
        /// The end of the tick whose force it is.
        time = 1,
        /// The force after the safety pipeline (N).
        force_n: [f64; 3] = 2,
        /// The safety stages that acted: a bit each, see `safety::Actions`.
        limits: u16 = 3,
        /// The passivity ledger: what the virtual environment has taken in less what it gave out, and what it stored at
        /// the start (J).
        energy_j: f64 = 4,
        /// The energy in the tank of model swaps (J).
        tank_j: f64 = 5,
    } and {
        /// The torque after the safety pipeline (N m); zero for a device that exerts none.
        torque_n_m: [f64; 3] = 7,
    } of device 6
}

/// The tool as the device reported it, on the topic `/tool`.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct ToolSample {
    /// The scheduled time of the release that read it.
    pub time: Nanos,
    /// The device's number of the sample.
    pub id: u32,
    /// The position (m).
    pub position_m: [f64; 3],
    /// The velocity (m/s).
    pub velocity_m_s: [f64; 3],
    /// The pressed buttons, a bit each.
    pub buttons: u16,
    /// The turn from the tool's own axes to those of the world.
    pub orientation: Turn,
    /// The number of the device in the scene, from 0.
    pub device: u16,
}

packed! { ToolSample on 1 { id, position_m, velocity_m_s, buttons } and { orientation } of device }

record! {
    /// The replacement of a local model by a newer one, on the topic `/resync`.
    Resync is "palpate.Resync" on 3 {
        /// The tick in which the blend ended and the new model served alone.
        time = 1,
        /// The new model's version.
        version: u32 = 2,
        /// The age of its state on arrival.
        age as age_ns: Nanos = 3,
        /// The difference of the new and the old model's force at the swap (N).
        jump_before_n: f64 = 4,
        /// The largest one-tick change of the force that the blend leaves of it (N).
        jump_after_n: f64 = 5,
        /// The energy that the tool has given to the simulation since the start, negative if it got some (J).
        energy_j: f64 = 6,
    } of device 7
}

record! {
    /// One release of the global model, on the topic `/global`.
    #[derive(Eq)]
    GlobalTick is "palpate.GlobalTick" on 4 {
        /// Its scheduled time.
        time = 1,
        /// The version that it published; 0 if it published none.
        version: u32 = 2,
        /// The haptic tick of the first tool sample taken.
        first_tick: u64 = 3,
        /// The haptic tick of the last tool sample taken: the model's state belongs to it.
        last_tick: u64 = 4,
    }
}

record! {
    /// The place of a probed node, on the topic `/probe`.
    ProbeSample is "palpate.Probe" on 5 {
        /// The end of the tick.
        time = 1,
        /// The node's id.
        node: u32 = 2,
        /// Its position in the local model, or in the newest global one if the node is outside the patch (m).
        local_m: [f64; 3] = 3,
        /// Its position in the newest global model that the tick could see (m).
        global_m: [f64; 3] = 4,
    } of device 5
}

record! {
    /// The state of the link to the global model's computer, on the topic `/link`.
    LinkSample is "palpate.Link" on 8 {
        /// The scheduled time of the release that looked.
        time = 1,
        /// The number of the connection: a new one begins where the one before had fallen silent.
        epoch: u32 = 2,
        /// The quickest round trip of the last 1.6 s; zero before the first.
        round_trip as round_trip_ns: Nanos = 3,
        /// How far the clock there is ahead, beyond the start of the two runs (s).
        clock_ahead_s: f64 = 4,
        /// How much faster it goes (parts per million).
        clock_drift_ppm: f64 = 5,
        /// Messages that were sent from here.
        sent: u64 = 6,
        /// Messages of this connection that came.
        received: u64 = 7,
        /// Messages of this connection that have not come yet, of those that were sent before the newest one that did.
        lost: u64 = 8,
    }
}
