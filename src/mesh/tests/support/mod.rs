//! Shapes to fill, and what is measured on a mesh without the code under test.

#![allow(dead_code)]

use std::collections::HashMap;

use palpate_mesh::{ImplicitShape, SurfaceMesh};
use palpate_model::Vec3;
use palpate_model::mesh::TetrahedralMesh;

/// A shape by its distance, within `reach` of the origin.
pub struct Shape<F> {
    pub distance: F,
    pub reach: f64,
}

impl<F: Fn(&Vec3) -> f64> ImplicitShape for Shape<F> {
    fn signed_distance(&self, point: &Vec3) -> f64 {
        (self.distance)(point)
    }

    fn bounds(&self) -> [Vec3; 2] {
        [Vec3::repeat(-self.reach), Vec3::repeat(self.reach)]
    }
}

/// A sum of waves about as long as an element: any pattern of signs comes up in it.
pub fn noise(seed: u64, waves: usize) -> Shape<impl Fn(&Vec3) -> f64> {
    let mut state = seed.wrapping_mul(2).wrapping_add(1);
    let mut random = move || {
        state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (state >> 11) as f64 / (1_u64 << 53) as f64
    };
    let waves: Vec<(Vec3, f64)> =
        (0..waves).map(|_| (Vec3::from_fn(|_, _| 12.0 * (random() - 0.5)), std::f64::consts::TAU * random())).collect();
    let distance = move |x: &Vec3| {
        let wave: f64 = waves.iter().map(|(k, phase)| (k.dot(x) + phase).sin()).sum();
        (wave / 3.0).max(x.norm() - 3.0)
    };
    Shape { distance, reach: 3.1 }
}

/// A rotation by as many radians as `axis` is long.
pub fn turn(axis: Vec3) -> palpate_model::Mat3 {
    let angle = axis.norm();
    let k = axis.normalize().cross_matrix();
    palpate_model::Mat3::identity() + k * angle.sin() + k * k * (1.0 - angle.cos())
}

/// A torus about the z axis with this many nodes around and along.
pub fn torus(major: f64, minor: f64, nodes: [usize; 2], place: impl Fn(Vec3) -> Vec3) -> SurfaceMesh {
    let [n, m] = nodes;
    let angle = |i: usize, n: usize| std::f64::consts::TAU * i as f64 / n as f64;
    let points = (0..n * m).map(|at| {
        let (u, v) = (angle(at % n, n), angle(at / n, m));
        let r = major + minor * v.cos();
        place(Vec3::new(r * u.cos(), r * u.sin(), minor * v.sin()))
    });
    let id = |i: usize, j: usize| (i % n + n * (j % m)) as u32;
    let triangles = (0..n * m).flat_map(|at| {
        let (i, j) = (at % n, at / n);
        let [a, b, c, d] = [id(i, j), id(i + 1, j), id(i + 1, j + 1), id(i, j + 1)];
        [[a, b, c], [a, c, d]]
    });
    SurfaceMesh { points: points.collect(), triangles: triangles.collect() }
}

/// A cube of edge 1 around the origin, of twelve triangles.
pub fn cube(place: impl Fn(Vec3) -> Vec3) -> SurfaceMesh {
    let points =
        (0..8).map(|n| place(Vec3::new((n & 1) as f64, (n >> 1 & 1) as f64, (n >> 2) as f64).add_scalar(-0.5)));
    let quads = [[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]];
    let triangles = quads.iter().flat_map(|&[a, b, c, d]| [[a, b, c], [a, c, d]]).collect();
    SurfaceMesh { points: points.collect(), triangles }
}

/// The volume of all elements.
pub fn volume(mesh: &TetrahedralMesh) -> f64 {
    let corners = mesh.tetrahedra.iter().map(|element| element.map(|node| mesh.points[node as usize]));
    corners.map(|[a, b, c, d]| (b - a).cross(&(c - a)).dot(&(d - a)) / 6.0).sum()
}

/// The smallest and the largest dihedral angle (degrees); an inverted element has none and panics.
pub fn angles(mesh: &TetrahedralMesh) -> [f64; 2] {
    let mut found = [180.0_f64, 0.0];
    for element in &mesh.tetrahedra {
        let x = element.map(|node| mesh.points[node as usize]);
        assert!((x[1] - x[0]).cross(&(x[2] - x[0])).dot(&(x[3] - x[0])) > 0.0, "element {element:?} is not positive");
        for [a, b, c, d] in [[0, 1, 2, 3], [0, 2, 1, 3], [0, 3, 1, 2], [1, 2, 0, 3], [1, 3, 0, 2], [2, 3, 0, 1]] {
            let edge = (x[b] - x[a]).normalize();
            let across = |c: usize| (x[c] - x[a]) - edge * edge.dot(&(x[c] - x[a]));
            let angle = across(c).angle(&across(d)).to_degrees();
            found = [found[0].min(angle), found[1].max(angle)];
        }
    }
    found
}

/// Faces of one element, counter-clockwise from outside; panics at a face of three.
pub fn outer_faces(mesh: &TetrahedralMesh) -> Vec<[u32; 3]> {
    let mut faces: HashMap<[u32; 3], (usize, [u32; 3])> = HashMap::new();
    for &[a, b, c, d] in &mesh.tetrahedra {
        for face in [[a, c, b], [a, b, d], [b, c, d], [a, d, c]] {
            let mut key = face;
            key.sort_unstable();
            faces.entry(key).or_insert((0, face)).0 += 1;
        }
    }
    assert!(faces.values().all(|(count, _)| *count <= 2));
    faces.into_values().filter(|(count, _)| *count == 1).map(|(_, face)| face).collect()
}
