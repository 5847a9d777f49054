//! Collects what a body of tetrahedra is made of.

use super::{Tissue, TissueRegion};
use crate::body::Shape;
use crate::mesh::TetrahedralMesh;

/// A part of a mesh: a shape, or a named group of it.
#[derive(Clone, Debug, PartialEq)]
pub enum Where {
    /// All that lies in a shape.
    Shape(Shape),
    /// A group of the mesh.
    Group(String),
}

/// Collects what a body of tetrahedra is made of.
#[derive(Clone, Debug)]
pub struct TetrahedraBuilder {
    pub(super) mesh: TetrahedralMesh,
    pub(super) tissue: Tissue,
    pub(super) regions: Vec<TissueRegion>,
    pub(super) fixed: Vec<Where>,
    pub(super) nodal_pressure: bool,
}
