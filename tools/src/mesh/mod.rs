//! What a mesh of tetrahedra consists of, how good it is and which step it allows.

mod report;
mod step;

pub(crate) use report::{MeshReport, SurfaceReport};
