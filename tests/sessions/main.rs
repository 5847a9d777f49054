//! Whole sessions in virtual time: contact, the safety layer, tools, bases and couplings, tick for tick.

#[path = "../common/mod.rs"]
mod common;
#[path = "../session_support/mod.rs"]
mod session_support;

mod bases;
mod builder;
mod coupling;
mod safety;
mod tools;
mod virtual_time;
