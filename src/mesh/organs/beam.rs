//! A beam, for checks against beam theory.

use palpate_model::Vec3;
use palpate_model::mesh::{Group, TetrahedralMesh};

use crate::MeshError;

/// The ways from a corner of a cube to the opposite one, along the axes in turn (Kuhn's six tetrahedra); an even order first.
const ORDERS: [[usize; 3]; 6] = [[0, 1, 2], [0, 2, 1], [1, 2, 0], [1, 0, 2], [2, 0, 1], [2, 1, 0]];

/// A beam of this extent (m) from the origin along the axes, with six elements in each cube of about `element_m`; neighbouring cubes mirror each
/// other, so that the mesh prefers no diagonal. Groups: `attached`, the nodes at x = 0; `tip`, those at the other end.
///
/// # Errors
/// If a length is not above zero, or there would be above 2 million cubes.
pub fn beam(extent: [f64; 3], element_m: f64) -> Result<TetrahedralMesh, MeshError> {
    if !extent.iter().chain([&element_m]).all(|&x| x > 0.0 && x.is_finite()) {
        return Err(MeshError::new(format!(
            "a beam of {extent:?} m in elements of {element_m} m: lengths above zero are needed"
        )));
    }
    let wanted = extent.map(|x| (x / element_m).round().max(1.0));
    if wanted.iter().product::<f64>() > 2e6 {
        return Err(MeshError::new(format!("elements of {element_m} m are too small for a beam of {extent:?} m")));
    }
    let [nx, ny, nz] = wanted.map(|n| n as usize);
    let id = |[i, j, k]: [usize; 3]| (i + (nx + 1) * (j + (ny + 1) * k)) as u32;
    let mut mesh = TetrahedralMesh::default();
    for k in 0..=nz {
        for j in 0..=ny {
            let point =
                |i: usize| Vec3::from([0, 1, 2].map(|axis| extent[axis] * [i, j, k][axis] as f64 / wanted[axis]));
            mesh.points.extend((0..=nx).map(point));
        }
    }
    for cell in (0..nx * ny * nz).map(|n| [n % nx, n / nx % ny, n / nx / ny]) {
        // From the corner with even numbers.
        let start = cell.map(|n| n + n % 2);
        let mirrored = cell.iter().filter(|&&n| n % 2 == 1).count() % 2 == 1;
        for (n, order) in ORDERS.iter().enumerate() {
            let mut corner = start;
            let mut element = [id(start); 4];
            for (step, &axis) in order.iter().enumerate() {
                corner[axis] = 2 * cell[axis] + 1 - start[axis];
                element[step + 1] = id(corner);
            }
            if mirrored != (n % 2 == 1) {
                element.swap(2, 3);
            }
            mesh.tetrahedra.push(element);
        }
    }
    let end = |name: &str, i: usize| {
        let nodes = (0..=nz).flat_map(|k| (0..=ny).map(move |j| id([i, j, k]))).collect();
        Group { name: name.into(), nodes, tetrahedra: Vec::new() }
    };
    mesh.groups = vec![end("attached", 0), end("tip", nx)];
    Ok(mesh)
}
