//! The bridge to parry: the surface triangle nearest to a point, and those around it. The only file that names it.

use parry3d_f64::bounding_volume::Aabb;
use parry3d_f64::math::Vector;
use parry3d_f64::query::PointQueryWithLocation;
use parry3d_f64::shape::TriMesh;

use super::Surface;
use crate::Vec3;
use crate::error::ModelError;

/// A surface with a bounding volume tree that follows its nodes.
#[derive(Clone)]
pub(crate) struct NearestTriangle {
    mesh: TriMesh,
    /// Node of each mesh vertex: the tree holds surface nodes only.
    nodes: Vec<u32>,
    vertices: Vec<Vector>,
}

impl std::fmt::Debug for NearestTriangle {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("NearestTriangle").field("nodes", &self.nodes.len()).finish_non_exhaustive()
    }
}

impl NearestTriangle {
    /// Over `surface` with nodes at `positions`.
    ///
    /// # Errors
    /// If the surface has no triangles.
    ///
    /// # Real-time
    /// Not real-time safe: allocates.
    pub(crate) fn new(surface: &Surface, positions: &[Vec3]) -> Result<Self, ModelError> {
        let nodes: Vec<u32> = (0..positions.len() as u32).filter(|&node| surface.has_node(node)).collect();
        let vertices: Vec<Vector> = nodes.iter().map(|&node| Vector::from(positions[node as usize])).collect();
        let vertex = |node: u32| nodes.binary_search(&node).unwrap_or(0) as u32;
        let triangles = surface.triangles.iter().map(|triangle| triangle.map(vertex)).collect();
        let mesh = TriMesh::new(vertices.clone(), triangles)
            .map_err(|error| ModelError::new(format!("the surface cannot be searched: {error}")).at("body"))?;
        Ok(Self { mesh, nodes, vertices })
    }

    /// Moves the nodes to `positions`.
    ///
    /// # Real-time
    /// For the global actor: refits the tree in place, allocates nothing.
    pub(crate) fn refit(&mut self, positions: &[Vec3]) {
        for (vertex, &node) in self.vertices.iter_mut().zip(&self.nodes) {
            *vertex = Vector::from(positions[node as usize]);
        }
        self.mesh.set_vertices(&self.vertices);
    }

    /// The triangle nearest to `point`; 0 if no number is finite.
    ///
    /// # Real-time
    /// For the global actor: bounded, allocates nothing.
    pub(crate) fn find(&self, point: &Vec3) -> u32 {
        // A hollow mesh: a tool inside the body also has a nearest triangle.
        let (_, (triangle, _)) = self.mesh.project_local_point_and_get_location(Vector::from(*point), false);
        triangle
    }

    /// The triangles whose boxes come as near as `distance` (m) to the box around two ends, in increasing order.
    ///
    /// # Real-time
    /// For the global actor: bounded; allocates.
    pub(crate) fn around(&self, [one, other]: &[Vec3; 2], distance: f64) -> Vec<u32> {
        let reach = Vec3::repeat(distance);
        let (low, high) = (one.inf(other) - reach, one.sup(other) + reach);
        let near = Aabb::new(Vector::from(low), Vector::from(high));
        let mut found: Vec<u32> = self.mesh.bvh().intersect_aabb(&near).collect();
        found.sort_unstable();
        found
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::body::{Block, Body};

    #[test]
    fn the_nearest_triangle_follows_moving_nodes() {
        let block = Block::builder([5; 3], [0.1; 3]).build().unwrap();
        let mut nearest = NearestTriangle::new(block.surface(), block.rest()).unwrap();
        let above = Vec3::new(0.06, 0.03, 0.13);
        let on_top = |t: u32, x: &[Vec3]| block.surface().triangles[t as usize].iter().all(|&n| x[n as usize].z > 0.09);
        assert!(on_top(nearest.find(&above), block.rest()));
        // With the block moved up by its height, the same point is nearest to the lower half.
        let moved: Vec<Vec3> = block.rest().iter().map(|x| x + Vec3::z() * 0.1).collect();
        nearest.refit(&moved);
        let triangle = nearest.find(&Vec3::new(0.06, 0.03, 0.09));
        assert!(block.surface().triangles[triangle as usize].iter().all(|&n| moved[n as usize].z < 0.101));
    }

    #[test]
    fn whatever_has_a_corner_near_is_around_and_nothing_far_is() {
        let block = Block::builder([7; 3], [0.1; 3]).build().unwrap();
        let mut nearest = NearestTriangle::new(block.surface(), block.rest()).unwrap();
        let moved: Vec<Vec3> = block.rest().iter().map(|x| x + Vec3::new(0.3 * x.y, 0.0, 0.2 * x.x)).collect();
        nearest.refit(&moved);
        let ends = [Vec3::new(0.04, 0.05, 0.12), Vec3::new(0.06, 0.05, 0.13)];
        for distance in [0.0, 0.01, 0.03, 1.0] {
            let found = nearest.around(&ends, distance);
            assert!(found.is_sorted());
            for (triangle, corners) in (0..).zip(&block.surface().triangles) {
                let far = corners.map(|node| ends.map(|end| (moved[node as usize] - end).norm()));
                let least = far.as_flattened().iter().copied().fold(f64::INFINITY, f64::min);
                let is_around = found.binary_search(&triangle).is_ok();
                assert!(is_around || least > distance, "{triangle}");
                // No box is larger than two cells with their shear, and the ends are 22 mm apart.
                assert!(!is_around || least < 3.0_f64.sqrt() * distance + 0.06, "{triangle}");
            }
        }
    }
}
