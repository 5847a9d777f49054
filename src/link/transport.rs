//! What carries messages to the other computer.

use super::{Hello, Lane};
use crate::error::Error;
use crate::runtime::Nanos;

/// Carries messages to another computer and back, perhaps late, more than once, in another order or not at all.
///
/// Times are those of the session on this side; only a simulated transport looks at them.
pub trait Transport: Send + std::fmt::Debug {
    /// Hands over a message; never waits. What cannot go is dropped.
    fn send(&mut self, lane: Lane, message: &[u8], now: Nanos);

    /// Puts the next message that has come in place of `message`; false if there is none.
    fn receive(&mut self, now: Nanos, message: &mut Vec<u8>) -> bool;

    /// Introduces the haptic side to the other one, before the session begins; waits until the first local models have come.
    ///
    /// # Errors
    /// If nobody answers in time, or the other side refuses: with one line that says why.
    fn connect(&mut self, hello: &Hello) -> Result<(), Error> {
        let _ = hello;
        Ok(())
    }

    /// Counts the peers: another one than before, such as a process that took the place of one that died, has another number.
    fn peer(&mut self) -> u64 {
        0
    }

    /// The session begins: what was handed over until now has been delivered before it.
    fn begin(&mut self) {}
}
