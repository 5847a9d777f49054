//! Devices: what moves the tool and feels the force. One file per device; a program brings its own.
//!
//! | device | what it is |
//! | --- | --- |
//! | [`Scripted`] | follows a path, ignores the force |
//! | [`Hand`] | a simulated device held by a simulated hand, which lets go |
//! | [`Hosted`] | a device that the program reads and writes itself, in a loop of its own |
//! | [`Pointer`] | a tool on a spring behind a mouse, a finger or a pen |
//!
//! A scene can also name a log whose tool is replayed, and faults that any device is to have.
//!
//! A program's own device runs the same [conformance suite](conformance) as these.

mod capabilities;
pub mod conformance;
mod device;
mod elsewhere;
mod fault;
mod faulty;
mod hand;
mod hosted;
mod pointer;
mod replayed;
mod scripted;
mod state;
mod tool_path;

pub use capabilities::Capabilities;
pub use device::Device;
pub(crate) use elsewhere::{Elsewhere, ElsewhereHandle, FASTEST_M_S};
pub use fault::{DeviceFault, SafetyStop};
pub use faulty::{FaultKind, FaultSpec, Faulty};
pub use hand::{Axis, Hand, HandSpec, PlantSpec};
pub use hosted::{HostSide, Hosted};
pub use pointer::{Pointer, PointerHandle, PointerSpec};
pub use replayed::{Replayed, ReplayedSample};
pub use scripted::Scripted;
pub use state::{Calibration, DeviceState, ForceCommand};
pub use tool_path::ToolPath;
