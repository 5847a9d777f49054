//! The element types of Gmsh that files have.

use crate::files::collected::TETRAHEDRON;

/// Number of nodes and name, by the number of the type.
pub fn element_type(number: i64) -> Option<(usize, &'static str)> {
    Some(match number {
        1 => (2, "lines"),
        2 => (3, "triangles"),
        3 => (4, "quadrangles"),
        4 => (4, TETRAHEDRON),
        5 => (8, "hexahedra"),
        6 => (6, "prisms"),
        7 => (5, "pyramids"),
        8 => (3, "second-order lines"),
        9 => (6, "second-order triangles"),
        10 => (9, "second-order quadrangles"),
        11 => (10, "second-order tetrahedra"),
        12 => (27, "second-order hexahedra"),
        13 => (18, "second-order prisms"),
        14 => (14, "second-order pyramids"),
        15 => (1, "points"),
        16 => (8, "second-order quadrangles"),
        17 => (20, "second-order hexahedra"),
        18 => (15, "second-order prisms"),
        19 => (13, "second-order pyramids"),
        20 => (9, "third-order triangles"),
        21 => (10, "third-order triangles"),
        22 => (12, "fourth-order triangles"),
        23 => (15, "fourth-order triangles"),
        24 => (15, "fifth-order triangles"),
        25 => (21, "fifth-order triangles"),
        26 => (4, "third-order lines"),
        27 => (5, "fourth-order lines"),
        28 => (6, "fifth-order lines"),
        29 => (20, "third-order tetrahedra"),
        30 => (35, "fourth-order tetrahedra"),
        31 => (56, "fifth-order tetrahedra"),
        92 => (64, "third-order hexahedra"),
        93 => (125, "fourth-order hexahedra"),
        _ => return None,
    })
}
