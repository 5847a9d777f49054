//! The bridge to parry: the signed distance from a closed surface. The only file of this crate that names it.

use std::collections::HashMap;

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
    /// Of `surface`, turned round if it is inside out.
    pub fn new(surface: &SurfaceMesh) -> Result<Self, MeshError> {
        let (points, mut triangles) = welded(surface)?;
        check_closed(&triangles)?;
        let (low, high) = points.iter().fold((points[0], points[0]), |(low, high), p| (low.inf(p), high.sup(p)));
        let corner = |node: u32| points[node as usize] - low;
        let six_fold = |[a, b, c]: [u32; 3]| corner(a).cross(&corner(b)).dot(&corner(c));
        let volume = triangles.iter().map(|&triangle| six_fold(triangle)).sum::<f64>() / 6.0;
        if volume < 0.0 {
            triangles.iter_mut().for_each(|triangle| triangle.swap(1, 2));
        }
        let vertices = points.iter().map(|&point| Vector::from(point)).collect();
        let mesh = TriMesh::with_flags(vertices, triangles, TriMeshFlags::ORIENTED)
            .map_err(|error| MeshError::new(format!("the surface cannot be filled: {error}")))?;
        Ok(Self { mesh, bounds: [low, high], volume: volume.abs() })
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

/// The points and triangles of `surface`, points at the same place being one and triangles without area left out.
fn welded(surface: &SurfaceMesh) -> Result<(Vec<Vec3>, Vec<[u32; 3]>), MeshError> {
    let mut at: HashMap<[u64; 3], u32> = HashMap::with_capacity(surface.points.len());
    let mut points = Vec::with_capacity(surface.points.len());
    let mut number = Vec::with_capacity(surface.points.len());
    for (n, point) in surface.points.iter().enumerate() {
        if !point.iter().all(|x| x.is_finite()) {
            return Err(MeshError::new(format!("point {n} of the surface is not finite")));
        }
        // Zero has two signs.
        let bits = [point.x, point.y, point.z].map(|x| (x + 0.0).to_bits());
        number.push(*at.entry(bits).or_insert_with(|| {
            points.push(*point);
            points.len() as u32 - 1
        }));
    }
    let mut triangles = Vec::with_capacity(surface.triangles.len());
    for (n, triangle) in surface.triangles.iter().enumerate() {
        if triangle.iter().any(|&node| node as usize >= number.len()) {
            let message = format!("triangle {n} of the surface names a point above the {} there are", number.len());
            return Err(MeshError::new(message));
        }
        let [a, b, c] = triangle.map(|node| number[node as usize]);
        if a != b && b != c && c != a {
            triangles.push([a, b, c]);
        }
    }
    match triangles.is_empty() {
        true => Err(MeshError::new("the surface has no triangles: nothing is inside it")),
        false => Ok((points, triangles)),
    }
}

/// That every edge is passed once in each direction.
fn check_closed(triangles: &[[u32; 3]]) -> Result<(), MeshError> {
    let mut passes: Vec<[u32; 2]> = triangles.iter().flat_map(|&[a, b, c]| [[a, b], [b, c], [c, a]]).collect();
    passes.sort_unstable();
    let twice = passes.windows(2).filter(|pair| pair[0] == pair[1]).count();
    let open = passes.iter().filter(|&&[a, b]| passes.binary_search(&[b, a]).is_err()).count();
    match (open, twice) {
        (0, 0) => Ok(()),
        (0, _) => Err(MeshError::new(format!(
            "the surface is not simple: {twice} edges have more than two triangles, or triangles turned against each other"
        ))),
        _ => Err(MeshError::new(format!(
            "the surface is not closed: {open} edges have one triangle, or two turned against each other; close it first"
        ))),
    }
}
