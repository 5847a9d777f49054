//! The actors of a haptic session: thin glue between models, devices, logs and the runtime.
//!
//! ```text
//! device --DeviceSample---> local --ToolTick, PatchGeometry--> global
//!        <--ComputedForce--       <--local model--              --Wishes--> basis
//!                                                               <--Bases--
//! every actor --records--> logger
//! ```
//!
//! There is a device and a local actor for each tool, and one global actor for all.

mod basis;
mod basis_store;
mod cause;
mod device;
mod global;
mod granted;
mod local;
mod log_file;
mod log_sink;
mod logger;
mod messages;
mod scene_watch;

pub use basis::{BasisActor, BasisPorts, Pace as BasisPace, Wishes};
pub use basis_store::BasisStore;
pub use cause::Cause;
pub(crate) use device::GAP_S;
pub use device::{DeviceActor, first_state};
pub use global::{GlobalActor, GlobalPlan, GlobalPorts, GlobalSharedPorts, SurroundingsPorts, ToolPorts};
pub use local::{LocalActor, LocalPorts, ModelSource};
pub use log_file::{LAST_WAIT, LogFile, MOST_WAITING};
pub use log_sink::{LogSink, Loss};
pub use logger::{LOG_FAILURE, LoggerActor, LoggerOutcome};
pub use messages::{Checkpoint, DeviceSample, ComputedForce, SurfaceView, ToolTick, ToolView};
pub use scene_watch::SceneWatch;
