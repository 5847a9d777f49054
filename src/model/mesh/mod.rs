//! Topology: the lattice of a block and triangle surfaces with their adjacency.

mod lattice;
mod surface;

pub use lattice::{Face, Lattice};
pub use surface::{NONE, Surface};
