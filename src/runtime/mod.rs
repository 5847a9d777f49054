//! The runtime: threads, time, messages, records; no physics.

pub mod record;
