//! Triangles whose corners are told by their places: what is at one place becomes one node.

use std::collections::HashMap;

use palpate_model::Vec3;

use crate::SurfaceMesh;

/// Collects triangles. Those with two corners at one place are left out: they have no area, and their neighbours close the gap.
#[derive(Debug, Default)]
pub struct Welded {
    mesh: SurfaceMesh,
    nodes: HashMap<[u64; 3], u32>,
}

impl Welded {
    /// Adds a triangle by its corners, which are finite.
    pub fn add(&mut self, corners: [Vec3; 3]) {
        let [a, b, c] = corners.map(|corner| self.node(corner));
        if a != b && b != c && c != a {
            self.mesh.triangles.push([a, b, c]);
        }
    }

    fn node(&mut self, place: Vec3) -> u32 {
        // Zero has two signs.
        let place = place.add_scalar(0.0);
        *self.nodes.entry([place.x, place.y, place.z].map(f64::to_bits)).or_insert_with(|| {
            self.mesh.points.push(place);
            self.mesh.points.len() as u32 - 1
        })
    }

    /// The surface.
    pub fn finish(self) -> SurfaceMesh {
        self.mesh
    }
}
