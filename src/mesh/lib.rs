//! Meshes for bodies of tetrahedra: files of volumes and surfaces, filling of closed surfaces, parametric organs.

mod error;
mod files;
mod surface;

pub use error::MeshError;
pub use files::{VolumeFile, read_surface, read_surface_file, read_volume, read_volume_file, write_msh};
pub use surface::SurfaceMesh;
