//! Bodies of tetrahedra for a bench, and the ground that a tool finds on them.

use palpate::Error;
use palpate::model::Vec3;
use palpate::model::body::Where;
use palpate::model::mesh::TetrahedralMesh;
use palpate::scene::{BodySpec, TetrahedraSpec, TissueSpec, Volume};

/// A mesh of `tissue` that is held where it is attached.
pub fn body(mesh: TetrahedralMesh, tissue: TissueSpec) -> Result<BodySpec, Error> {
    Ok(BodySpec::Tetrahedra(TetrahedraSpec {
        mesh: None,
        surface: None,
        element_size_m: None,
        surface_size_m: None,
        unit_m: 1.0,
        fixed: vec![Where::Group("attached".into())],
        tissue,
        regions: Vec::new(),
        volume: Some(Volume::new(mesh)?),
    }))
}

/// The highest point of the surface `triangles` of `mesh` above x, y (m); not a number beside it.
pub fn height(mesh: &TetrahedralMesh, triangles: &[[u32; 3]], at: [f64; 2]) -> f64 {
    let above = triangles.iter().filter_map(|triangle| {
        let [a, b, c] = triangle.map(|node| mesh.points[node as usize]);
        let twice = |p: Vec3, q: Vec3| (p.x - at[0]) * (q.y - at[1]) - (q.x - at[0]) * (p.y - at[1]);
        let areas = [twice(b, c), twice(c, a), twice(a, b)];
        let whole: f64 = areas.iter().sum();
        let faces_up = whole > 0.0 && areas.iter().all(|&area| area >= 0.0);
        faces_up.then(|| (areas[0] * a.z + areas[1] * b.z + areas[2] * c.z) / whole)
    });
    above.fold(f64::NAN, f64::max)
}
