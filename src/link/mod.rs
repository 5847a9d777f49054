//! The way between two computers: device and local model on one, global model and bases on the other.
//!
//! [`Message`]s are what crosses, a [`Transport`] carries them. One transport is here, a [virtual link](VirtualLink) whose delay, loss
//! and the like are those of a scene; others are of crates that know a network. What crosses is made and taken by two bridge actors, and
//! neither the local nor the global actor can tell that the other is elsewhere.

mod clock;
mod hello;
mod lane;
mod message;
mod transport;
mod virtual_link;

pub use clock::Clock;
pub use hello::Hello;
pub use lane::{LINES, Lane};
pub use message::{Header, LARGEST, MOST_TICKS, Message, Refused, VERSION};
pub use transport::Transport;
pub use virtual_link::{Conditions, VirtualEnd, VirtualLink};

/// A haptic machine, as the global side meets it: the way to it, and what it says of itself.
pub type HapticMachine = (Box<dyn Transport>, Hello);
