//! palpate: an actor-based real-time runtime for multi-rate haptic simulation of deformable bodies.

pub mod actors;
pub mod devices;
pub mod error;
pub mod log;
pub mod model;
pub mod report;
pub mod runtime;
pub mod safety;
pub mod scene;
pub mod session;
pub mod time;

pub use devices::{Device, DeviceFault, DeviceState};
pub use error::{Error, ErrorKind};
pub use session::{Running, Session, SessionBuilder, Summary, Viewer};

/// What most programs need.
pub mod prelude {
    pub use crate::devices::{Capabilities, Device, DeviceFault, DeviceState, ToolPath};
    pub use crate::error::Error;
    pub use crate::model::Vec3;
    pub use crate::model::body::Block;
    pub use crate::model::mesh::Face;
    pub use crate::runtime::RateGroup;
    pub use crate::session::Session;
    pub use crate::time::Nanos;
}
