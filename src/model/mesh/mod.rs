//! Topology: the lattice of a block and triangle surfaces with their adjacency.

mod lattice;
mod lists;
mod surface;

pub use lattice::{Face, Lattice};
pub(crate) use lists::Lists;
pub use surface::{NONE, Surface};
