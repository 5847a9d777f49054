//! The actors of a haptic session: thin glue between models, devices, logs and the runtime.
//!
//! ```text
//! devices --DeviceSample---> local --ToolTick, PatchGeometry--> global
//!         <--ComputedForce--       <--local models--             --Wishes--> basis
//!                                                                <--Bases--
//! every actor --records--> logger
//! ```
//!
//! There is a device actor for each tool, and one local and one global actor for all. What a program changes while it runs, `Settings`,
//! goes to the global actor and comes to the local one with the next models. Where there is a link, two bridges stand between the local
//! actor and the global one. For `full` one actor with the whole body stands in place of both:
//!
//! ```text
//! devices --DeviceSample---> whole
//!         <--ComputedForce--
//! ```

mod basis;
mod basis_store;
mod believed;
mod bridge;
mod cause;
mod device;
mod global;
mod global_ports;
mod global_tool;
mod local;
mod log_file;
mod log_sink;
mod logger;
mod messages;
mod model_maker;
mod next_models;
mod scene_watch;
mod settings;
mod throttle;
mod ticks;
mod tool;
mod touched;
mod tunable;
mod whole;

pub(crate) use basis::{BasisActor, BasisPorts, Pace as BasisPace, Wishes};
pub(crate) use basis_store::BasisStore;
pub(crate) use believed::{Bounds, Disbelieved};
pub(crate) use bridge::{BasesPorts, Beyond, GlobalBridge, GlobalBridgePorts, HapticBridge, HapticBridgePorts};
pub(crate) use device::{DeviceActor, DevicePorts, GAP_S, first_state};
pub(crate) use global::{GlobalActor, GlobalPlan};
pub(crate) use global_ports::{GlobalPorts, GlobalSharedPorts, SurroundingsPorts, ToolPorts};
pub(crate) use local::{LocalActor, LocalPorts, LocalSide, LocalSource};
pub(crate) use messages::{Checkpoint, ComputedForce, DeviceSample, ToolTick};
pub(crate) use model_maker::ModelMaker;
pub(crate) use scene_watch::SceneWatch;
pub(crate) use settings::Settings;
pub(crate) use tool::{LocalTool, LocalToolPorts};
pub(crate) use tunable::Tunable;
pub(crate) use whole::WholeActor;

// Part of what a session shows.
pub use logger::LOG_FAILURE;
pub use messages::{SurfaceView, ToolView};

// A log file for programs that drive the logger themselves, and the causes in its records.
pub use cause::Cause;
pub use log_file::LogFile;
pub use log_sink::{LogSink, Loss};
pub use logger::{LoggerActor, LoggerOutcome};
