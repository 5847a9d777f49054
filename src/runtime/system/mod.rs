//! What the operating system is asked for, and what it granted.

pub(crate) mod grant;
pub(crate) mod machine;
pub(crate) mod os;
pub(crate) mod stopwatch;
pub(crate) mod wait;
