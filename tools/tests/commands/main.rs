//! The command from outside: what each of its parts writes, refuses and leaves behind.

#[path = "../support/mod.rs"]
mod support;

mod compare;
mod contract;
mod exports;
mod log;
mod mesh;
mod reduce;
mod timing;
