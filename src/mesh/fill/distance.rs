//! The bridge to parry: the signed distance from a closed surface. The only file of this crate that names it.

use palpate_model::Vec3;
use parry3d_f64::math::Vector;
use parry3d_f64::query::PointQuery;
use parry3d_f64::shape::{TriMesh, TriMeshFlags};

use super::ImplicitShape;
use crate::{MeshError, SurfaceMesh};

/// A closed surface with a bounding volume tree and pseudo-normals (Baerentzen and Aanaes 2005), which say what is inside.
pub(super) struct Closed {
    mesh: TriMesh,
    bounds: [Vec3; 2],
    /// Enclosed by the surface (m^3).
    pub volume: f64,
}

impl Closed {
    /// Of `surface` as it is when it is [cleaned](SurfaceMesh::cleaned).
    pub fn new(surface: &SurfaceMesh) -> Result<Self, MeshError> {
        let (surface, _) = surface.clone().cleaned()?;
        let volume = surface.volume();
        let SurfaceMesh { points, triangles } = surface;
        let (low, high) = points.iter().fold((points[0], points[0]), |(low, high), p| (low.inf(p), high.sup(p)));
        let vertices = points.iter().map(|&point| Vector::from(point)).collect();
        let mesh = TriMesh::with_flags(vertices, triangles, TriMeshFlags::ORIENTED)
            .map_err(|error| MeshError::new(format!("the surface cannot be filled: {error}")))?;
        Ok(Self { mesh, bounds: [low, high], volume })
    }

    /// The corners of each triangle (m).
    pub fn triangles(&self) -> impl Iterator<Item = [Vec3; 3]> {
        self.mesh.triangles().map(|triangle| [triangle.a, triangle.b, triangle.c].map(Vec3::from))
    }
}

impl ImplicitShape for Closed {
    fn signed_distance(&self, point: &Vec3) -> f64 {
        let from = Vector::from(*point);
        let nearest = self.mesh.project_local_point(from, false);
        let distance = (nearest.point - from).length();
        if nearest.is_inside { -distance } else { distance }
    }

    fn bounds(&self) -> [Vec3; 2] {
        self.bounds
    }
}
