//! What stands between a computed force and a device: one stage per file, pure functions of state and time.
//!
//! The order, the promises and the test of each are in `docs/safety.md`. Every action is reported as a bit of [`Actions`].
//! All of it is bounded, allocates nothing and is real-time safe.

mod actions;
pub(crate) mod coupling;
mod force;
mod limits;
mod model_age;
mod passivity;
mod pipeline;
mod start_up;
mod tank;
#[cfg(test)]
mod tests;
mod tool_speed;
mod torque;
mod watchdog;

pub use actions::Actions;
pub use limits::{DeviceLimits, Limits};
pub(crate) use model_age::ModelAge;
pub(crate) use passivity::FASTEST_HAND_M_S;
pub use passivity::Passivity;
pub use pipeline::{Input, Output, Pipeline, Request};
pub(crate) use start_up::StartUp;
pub(crate) use tank::Tank;
pub(crate) use tool_speed::ToolSpeed;
pub(crate) use watchdog::Watchdog;
