//! What actors say to each other and to programs that watch.

use crate::devices::DeviceState;
use crate::model::body::Stiffness;
use crate::model::contact::ContactMode;
use crate::model::simulation::{Simulation, Snapshot};
use crate::model::{Pose, Turn, Vec3};
use crate::runtime::{Nanos, OutletWriter, TickContext};

/// The device's newest state, numbered.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct DeviceSample {
    /// Counts successful reads from 1.
    pub id: u32,
    /// What was read.
    pub state: DeviceState,
}

/// The tool at the end of one haptic tick of the local model.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct ToolTick {
    /// The haptic tick.
    pub tick: u64,
    /// The tool.
    pub pose: Pose,
    /// It was put there, and did not go: another one has taken its place, and touches nothing yet.
    pub is_put: bool,
}

/// The newest force for the device, as the local model computed it. What is written is a
/// [`ForceCommand`](crate::devices::ForceCommand), after the safety pipeline and with an expiry.
///
/// # Real-time
/// A plain value.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct ComputedForce {
    /// End of the tick that it belongs to.
    pub time: Nanos,
    /// Mean force over that tick (N).
    pub force: Vec3,
    /// Mean torque about the tool's centre over that tick (N m).
    pub torque: Vec3,
    /// Age of the local model that it comes from (ticks of the local group).
    pub age_ticks: u32,
    /// How much of its change a swap of local models made (N).
    pub swap_step: Vec3,
    /// What friction took of the tool's motion (J).
    pub dissipated_j: f64,
    /// Where the simulated tool is (m).
    pub position: Vec3,
    /// State of its contact.
    pub mode: ContactMode,
}

/// The newest tool and its two forces, for a program that draws.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct ToolView {
    /// End of the haptic tick.
    pub time: Nanos,
    /// Tool position (m).
    pub position: Vec3,
    /// The turn from the tool's own axes to those of the world, as the device told it last.
    pub orientation: Turn,
    /// Force on the tool that the model computed (N), before the safety pipeline: nobody feels it.
    pub computed_force: Vec3,
    /// Force that the device was commanded (N): what the hand feels. It is zero while nothing may be felt, such as at the start
    /// or after a fault, however large the computed one is.
    pub commanded_force: Vec3,
    /// Torque about the tool's centre that the model computed (N m), before the safety pipeline.
    pub computed_torque: Vec3,
    /// Torque that the device was commanded (N m); zero for a device that exerts none.
    pub commanded_torque: Vec3,
    /// State of the contact.
    pub mode: ContactMode,
}

/// The newest state of the body, for a program that draws.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct SurfaceView {
    /// The time that it belongs to.
    pub time: Nanos,
    /// Position of every node (m); the triangles are those of the body's surface. Behind a link nodes below it stay where they began.
    pub positions: Vec<Vec3>,
    /// How stiff the body is, in that which it was made with.
    pub stiffness: Stiffness,
}

/// Shows the body at `time` to all who look.
///
/// # Real-time
/// Wait-free, real-time safe.
pub fn show(surfaces: &mut [OutletWriter<SurfaceView>], ctx: &TickContext, time: Nanos, body: &Simulation) {
    let positions = &body.state().positions;
    for surface in surfaces {
        let view = surface.buffer();
        (view.time, view.stiffness) = (time, body.stiffness());
        view.positions.clear();
        view.positions.extend_from_slice(positions);
        surface.publish(ctx);
    }
}

/// The global model after its last good resync: what it goes on from when it is started again.
#[derive(Clone, Debug, Default)]
pub struct Checkpoint {
    /// Each tool at the haptic tick that the state belongs to.
    pub tools: Vec<ToolTick>,
    /// The body and what its tools touch.
    pub simulation: Snapshot,
}
