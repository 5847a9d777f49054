//! Repeating a recorded run in virtual time, bit for bit.

pub(crate) mod recording;
pub(crate) mod replay;
pub(crate) mod script;
