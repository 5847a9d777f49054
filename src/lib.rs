//! palpate: an actor-based real-time runtime for multi-rate haptic simulation of deformable bodies.

pub mod actors;
pub mod devices;
pub mod error;
pub mod log;
pub mod model;
pub mod runtime;
pub mod safety;
pub mod scene;
pub mod time;

pub use error::{Error, ErrorKind};
