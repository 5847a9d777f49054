//! What lies around a patch: the springs that reach out of it, the ring of nodes that they reach, and a reduced model of
//! everything beyond.

mod accuracy;
mod basis;
mod condense;
mod estimate;
mod far;
mod graph;
mod near;
mod products;
mod reduced;
mod reduction;
mod stored;

pub use accuracy::{Estimate, Size};
pub use basis::{Bases, Basis};
pub use condense::Condensation;
pub use graph::SpringGraph;
pub(crate) use reduced::ReducedMotion;
pub use reduction::Reduction;
