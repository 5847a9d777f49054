//! The 64-byte records that leave real-time threads, and the rings that they leave through.

pub(crate) mod input;
pub(crate) mod port_use;
pub(crate) mod record;
pub(crate) mod recorder;
pub(crate) mod timing;
