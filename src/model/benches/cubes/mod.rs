//! Cubes of tetrahedra.

use palpate_model::Vec3;
use palpate_model::body::{Shape, Tetrahedra, Tissue, Where};
use palpate_model::mesh::TetrahedralMesh;

/// A cube of about so many elements, with its bottom held.
pub fn cube(elements: usize, edge: f64, is_averaged: bool) -> Tetrahedra {
    let cells = (elements as f64 / 6.0).cbrt().round() as usize;
    let nodes = cells + 1;
    let id = |at: [usize; 3]| (at[0] + nodes * (at[1] + nodes * at[2])) as u32;
    let mut mesh = TetrahedralMesh::default();
    for n in 0..nodes.pow(3) {
        let at = [n % nodes, n / nodes % nodes, n / (nodes * nodes)];
        mesh.points.push(Vec3::from(at.map(|c| c as f64 * edge / cells as f64)));
    }
    for n in 0..cells.pow(3) {
        let first = [n % cells, n / cells % cells, n / (cells * cells)];
        for (axes, is_odd) in [
            ([0, 1, 2], false),
            ([0, 2, 1], true),
            ([1, 0, 2], true),
            ([1, 2, 0], false),
            ([2, 0, 1], false),
            ([2, 1, 0], true),
        ] {
            let mut at = first;
            let mut corners = [id(at); 4];
            for (n, axis) in axes.into_iter().enumerate() {
                at[axis] += 1;
                corners[n + 1] = id(at);
            }
            if is_odd {
                corners.swap(2, 3);
            }
            mesh.tetrahedra.push(corners);
        }
    }
    let bottom = Where::Shape(Shape::Layer { axis: 2, from: 0.0, to: 0.0 });
    let builder = Tetrahedra::builder(mesh).tissue(Tissue::LIVER).nodal_pressure(is_averaged);
    builder.fix(bottom).build().expect("a valid body")
}
