//! Volumes of linear tetrahedra, with named groups of nodes and elements.

mod checks;
mod faces;
mod parts;
mod quality;

pub use checks::LeftOut;
pub use quality::MeshQuality;

use crate::Vec3;

/// A volume of linear tetrahedra as a mesh file holds it.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct TetrahedralMesh {
    /// The position of each node (m).
    pub points: Vec<Vec3>,
    /// The four nodes of each element.
    pub tetrahedra: Vec<[u32; 4]>,
    /// Named parts: physical groups of the file, or those that a generator gave.
    pub groups: Vec<Group>,
}

/// A named part of a mesh.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Group {
    /// The name, as in the file.
    pub name: String,
    /// All nodes of the group, in increasing order: of a group of surfaces or points as of one of elements.
    pub nodes: Vec<u32>,
    /// The elements of the group, in increasing order; empty for a group of surfaces, curves or points.
    pub tetrahedra: Vec<u32>,
}

impl TetrahedralMesh {
    /// The group of this name.
    ///
    /// # Real-time
    /// Bounded, by the number of groups.
    pub fn group(&self, name: &str) -> Option<&Group> {
        self.groups.iter().find(|group| group.name == name)
    }

    /// The mesh with coordinates in metres: those it has, in units of `metres_per_unit`.
    ///
    /// # Real-time
    /// Not for a tick: as long as there are nodes.
    #[must_use]
    pub fn scaled(mut self, metres_per_unit: f64) -> Self {
        self.points.iter_mut().for_each(|point| *point *= metres_per_unit);
        self
    }

    /// The mean of the element's corners (m).
    ///
    /// # Real-time
    /// Wait-free, real-time safe.
    pub fn centroid(&self, element: u32) -> Vec3 {
        self.corners(element).iter().sum::<Vec3>() / 4.0
    }

    /// The positions of the element's corners (m).
    fn corners(&self, element: u32) -> [Vec3; 4] {
        self.tetrahedra[element as usize].map(|node| self.points[node as usize])
    }
}
