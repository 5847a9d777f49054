//! What stands between a computed force and a device: one stage per file, pure functions of state and time.
//!
//! The order, the promises and the test of each are in `docs/safety.md`. Every action is reported as a bit of [`Actions`].

mod actions;
mod clamp;
mod controller;
pub mod coupling;
mod finite;
mod ledger;
mod limits;
mod model_age;
mod pipeline;
mod ramp;
mod slew;
mod start_up;
mod tank;
mod tool_speed;
mod watchdog;

pub use actions::Actions;
pub use clamp::clamp;
pub use controller::{Controlled, Passivity, control};
pub use finite::finite;
pub use ledger::Ledger;
pub use limits::{DeviceLimits, Limits};
pub use model_age::{AgeFade, ModelAge};
pub use pipeline::{Input, Output, Pipeline, Request};
pub use ramp::Ramp;
pub use slew::slew;
pub use start_up::{Engagement, StartUp};
pub use tank::{Tank, TankState};
pub use tool_speed::{ToolSpeed, speed_gain};
pub use watchdog::Watchdog;

/// A force in space (N).
pub type Force = [f64; 3];

fn norm(force: Force) -> f64 {
    dot(force, force).sqrt()
}

fn dot(a: [f64; 3], b: [f64; 3]) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}
