//! Meshes for bodies of tetrahedra: files of volumes and surfaces, filling of closed surfaces, parametric organs.

mod error;
mod surface;

pub use error::MeshError;
pub use surface::SurfaceMesh;
