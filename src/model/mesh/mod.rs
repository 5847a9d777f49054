//! Topology: the lattice of a block and triangle surfaces with their adjacency, and the search for the nearest triangle.

mod lattice;
mod lists;
mod nearest;
mod surface;
mod tetrahedral;

pub use lattice::{Face, Lattice};
pub(crate) use lists::Lists;
pub(crate) use nearest::NearestTriangle;
pub use surface::Surface;
pub use tetrahedral::{Group, LeftOut, MeshQuality, TetrahedralMesh};
