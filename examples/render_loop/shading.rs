//! From triangles to flat coloured patches: normals, light, and splitting where the surface curves.

use std::collections::HashMap;

use palpate::model::Vec3;

/// A piece of one colour.
pub struct Facet {
    pub corners: [Vec3; 3],
    pub color: [u8; 3],
    /// Edges of the mesh among its own, by the corner opposite to them.
    pub edges: [bool; 3],
}

/// Triangles whose normals have a smaller cosine than this between them meet in a crease.
const CREASE: f64 = 0.15;
/// An edge is cut into a piece for each such difference of its ends' normals, up to so many.
const CURVED: f64 = 0.1;
const MOST_PIECES: usize = 4;

/// The body's colour, and the colour where it is pressed in by `DEEP` metres.
const BODY: Vec3 = Vec3::new(222.0, 106.0, 96.0);
const PRESSED: Vec3 = Vec3::new(255.0, 186.0, 130.0);
const DEEP: f64 = 0.009;

/// Facets of all triangles, for an eye in direction `towards(point)`; `top` is the height of the body at rest (m).
pub fn facets(triangles: &[[u32; 3]], positions: &[Vec3], top: f64, towards: impl Fn(&Vec3) -> Vec3) -> Vec<Facet> {
    let corners = |t: &[u32; 3]| t.map(|node| positions[node as usize]);
    // Twice the area long, so that sums are weighted by area.
    let normals: Vec<Vec3> = triangles.iter().map(corners).map(|[a, b, c]| (b - a).cross(&(c - a))).collect();
    let mut at_node: HashMap<u32, Vec<usize>> = HashMap::new();
    for (t, triangle) in triangles.iter().enumerate() {
        for &node in triangle {
            at_node.entry(node).or_default().push(t);
        }
    }
    let bends_into = |t: usize, other: usize| {
        let shared = triangles[t].iter().filter(|node| triangles[other].contains(node)).count();
        shared == 2 && normals[t].normalize().dot(&normals[other].normalize()) > CREASE
    };
    // The mean over the triangles at a node that can be reached without crossing a crease: the same for all of them.
    let smooth = |t: usize, node: u32| {
        let (mut reached, mut next) = (vec![t], 0);
        while next < reached.len() {
            for &other in &at_node[&node] {
                if !reached.contains(&other) && bends_into(reached[next], other) {
                    reached.push(other);
                }
            }
            next += 1;
        }
        reached.iter().map(|&t| normals[t]).sum::<Vec3>().normalize()
    };
    let mut facets = Vec::new();
    for (t, triangle) in triangles.iter().enumerate() {
        let points = corners(triangle);
        let at = triangle.map(|node| smooth(t, node));
        let spread = (0..3).map(|i| (at[i] - at[(i + 1) % 3]).norm()).fold(0.0, f64::max);
        let pieces = ((spread / CURVED).ceil() as usize).clamp(1, MOST_PIECES);
        let edges = drawn_edges(&points);
        for (places, edges) in split(pieces, edges) {
            let on_surface = places.map(|weights| rounded(&points, &at, weights));
            let centre = on_surface.iter().map(|(point, _)| point).sum::<Vec3>() / 3.0;
            let normal = on_surface.iter().map(|(_, normal)| normal).sum::<Vec3>().normalize();
            let [a, b, c] = on_surface.map(|(point, _)| point);
            if (b - a).cross(&(c - a)).dot(&towards(&centre)) <= 0.0 {
                continue;
            }
            facets.push(Facet { corners: [a, b, c], color: lit(&centre, &normal, &towards(&centre), top), edges });
        }
    }
    facets
}

/// Cuts a triangle's edges into `pieces` each: barycentric corners and drawn edges of the parts.
fn split(pieces: usize, edges: [bool; 3]) -> impl Iterator<Item = ([[f64; 3]; 3], [bool; 3])> {
    let place = move |i: usize, j: usize| {
        let (u, v) = (i as f64 / pieces as f64, j as f64 / pieces as f64);
        [1.0 - u - v, u, v]
    };
    (0..pieces).flat_map(move |j| (0..pieces - j).map(move |i| (i, j))).flat_map(move |(i, j)| {
        // A part has an edge of the whole where its row is the outermost.
        let outer = [i + j + 1 == pieces && edges[0], i == 0 && edges[1], j == 0 && edges[2]];
        let upright = ([place(i, j), place(i + 1, j), place(i, j + 1)], outer);
        let turned =
            (i + j + 2 <= pieces).then(|| ([place(i + 1, j), place(i + 1, j + 1), place(i, j + 1)], [false; 3]));
        [Some(upright), turned].into_iter().flatten()
    })
}

/// A point of the triangle and its normal, moved towards the tangent planes of the corners (Phong tessellation), so
/// that a coarse mesh looks as round as it is felt.
fn rounded(corners: &[Vec3; 3], normals: &[Vec3; 3], weights: [f64; 3]) -> (Vec3, Vec3) {
    let mix = |values: &[Vec3; 3]| values[0] * weights[0] + values[1] * weights[1] + values[2] * weights[2];
    let flat = mix(corners);
    let on_plane: [Vec3; 3] = std::array::from_fn(|i| flat - normals[i] * normals[i].dot(&(flat - corners[i])));
    (flat.lerp(&mix(&on_plane), 0.6), mix(normals).normalize())
}

/// Every edge but the longest: on a lattice these are the edges of its cells, without their diagonals.
fn drawn_edges(corners: &[Vec3; 3]) -> [bool; 3] {
    let length = |opposite: usize| (corners[(opposite + 1) % 3] - corners[(opposite + 2) % 3]).norm();
    let longest = (0..3).max_by(|&a, &b| length(a).total_cmp(&length(b)));
    std::array::from_fn(|opposite| Some(opposite) != longest)
}

/// Sky light from above, a lamp from the upper left, a highlight.
fn lit(point: &Vec3, normal: &Vec3, to_eye: &Vec3, top: f64) -> [u8; 3] {
    let lamp = Vec3::new(-0.55, -0.45, 0.70).normalize();
    let sky = 0.45 + 0.13 * normal.z;
    let diffuse = 0.52 * normal.dot(&lamp).max(0.0);
    let highlight = 46.0 * normal.dot(&(lamp + to_eye).normalize()).max(0.0).powi(24);
    let depth = if normal.z > 0.5 { ((top - point.z) / DEEP).clamp(0.0, 1.0) } else { 0.0 };
    let color = BODY + (PRESSED - BODY) * (depth * depth * (3.0 - 2.0 * depth));
    let color = color * (sky + diffuse) + Vec3::repeat(highlight);
    [color.x, color.y, color.z].map(|channel| channel.round().clamp(0.0, 255.0) as u8)
}
