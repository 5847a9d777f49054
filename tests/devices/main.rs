//! Devices in sessions of virtual time: the bounds of what they take, and the hand that holds one.

#[path = "../common/mod.rs"]
mod common;
#[path = "../session_support/mod.rs"]
mod session_support;

mod bounds;
mod hand;
