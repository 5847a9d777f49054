//! Graphs in virtual time: what is refused, how releases slip and why, and the order of what happens at once.

#[path = "../support/mod.rs"]
mod support;

mod graph;
mod order;
mod slips;
