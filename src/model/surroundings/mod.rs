//! What lies around a patch: the part of the body that depends on it, the ring of nodes that this part reaches, and a reduced model of
//! everything beyond.

mod basis;
mod beyond;
mod condense;
mod cost;
mod coupling;
mod far;
mod force_errors;
mod near;
mod products;
mod reduced;
mod reduction;
mod resting;
mod square;
#[cfg(test)]
mod stability;
mod stored;
#[cfg(test)]
mod uneven;

pub use basis::{Bases, Basis};
pub use condense::Condensation;
pub(crate) use reduced::ReducedMotion;
pub use reduction::Reduction;
pub use resting::RestingBody;
