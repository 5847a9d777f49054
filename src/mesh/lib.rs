//! Meshes for bodies of tetrahedra: files of volumes and surfaces, filling of closed surfaces, parametric organs.

mod error;
mod files;
mod fill;
pub mod organs;
mod surface;

pub use error::MeshError;
pub use files::{VolumeFile, read_surface, read_surface_file, read_volume, read_volume_file, write_msh};
pub use fill::{ImplicitShape, Sizes, fill, fill_shape};
pub use surface::{SurfaceFindings, SurfaceMesh, SurfacePart};

// The tests within the crate measure with what its other tests measure with.
#[cfg(test)]
extern crate self as palpate_mesh;
#[cfg(test)]
#[path = "tests/support/mod.rs"]
mod support;
