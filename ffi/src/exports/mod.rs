//! What C calls, and nothing else: pointers become values by `memory`, what happens is in the other modules.

pub mod library;
pub mod run;
pub mod setup;
pub mod show;
pub mod tick;
