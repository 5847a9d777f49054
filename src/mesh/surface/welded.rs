//! Triangles whose corners are told by their places: what is at one place becomes one node.

use std::collections::HashMap;

use palpate_model::Vec3;

use crate::SurfaceMesh;

/// What tells a place from others, to the last bit.
pub type PlaceKey = [u64; 3];

/// The key of a place.
pub fn place_key(place: &Vec3) -> PlaceKey {
    // Zero has two signs.
    <[f64; 3]>::from(place.add_scalar(0.0)).map(f64::to_bits)
}

/// Collects triangles. Those with two corners at one place are left out: they have no area, and their neighbours close the gap.
#[derive(Debug, Default)]
pub struct Welded {
    mesh: SurfaceMesh,
    nodes: HashMap<PlaceKey, u32>,
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
        let key = place_key(&place);
        *self.nodes.entry(key).or_insert_with(|| {
            self.mesh.points.push(Vec3::from(key.map(f64::from_bits)));
            self.mesh.points.len() as u32 - 1
        })
    }

    /// The surface.
    pub fn finish(self) -> SurfaceMesh {
        self.mesh
    }
}
