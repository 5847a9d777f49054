//! One rate group at work: its actors, its faults, its releases; the same in both executions.

pub(crate) mod group_run;
pub(crate) mod lease;
pub(crate) mod members;
pub(crate) mod panic_hook;
