//! What two threads share without waiting for each other: the newest value, ordered values, messages, times, numbers.

pub mod exchange;
pub(crate) mod fenced_counter;
pub(crate) mod histogram;
pub mod ring;
pub(crate) mod sync;
