//! palpate: an actor-based real-time runtime for multi-rate haptic simulation of deformable bodies.

pub mod error;
pub mod log;
pub mod report;
pub mod runtime;
pub mod scene;
pub mod time;

pub use error::{Error, ErrorKind};
