//! From triangles to flat coloured pieces: normals, light, and splitting where the surface curves.

use std::collections::HashMap;

use palpate::model::Vec3;

/// A triangle of the surface, cut into pieces that follow its curvature.
pub struct Shaded {
    /// Pieces that show their outer side, each of one colour.
    pub pieces: Vec<([Vec3; 3], [u8; 3])>,
    /// Around the triangle, along its edges.
    pub outline: Vec<Vec3>,
}

/// Triangles whose normals have a smaller cosine than this between them meet in a crease.
const CREASE: f64 = 0.15;
/// An edge is cut into a part for each such difference of its ends' normals, up to so many.
const CURVED: f64 = 0.17;
const MOST_CUTS: usize = 3;

/// The body's colour, and the colour where it is pressed in by `DEEP` metres.
const BODY: Vec3 = Vec3::new(190.0, 74.0, 66.0);
const PRESSED: Vec3 = Vec3::new(255.0, 190.0, 120.0);
const DEEP: f64 = 0.006;

/// The triangles of a surface whose nodes are at `positions` and were at `rest` (m), for an eye in direction
/// `towards(point)`; those that turn their back to it are left out.
pub fn shade(
    triangles: &[[u32; 3]],
    rest: &[Vec3],
    positions: &[Vec3],
    towards: impl Fn(&Vec3) -> Vec3,
) -> Vec<Shaded> {
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
    let seen_from_outside = |[a, b, c]: [Vec3; 3]| (b - a).cross(&(c - a)).dot(&towards(&a)) > 0.0;
    let shaded = triangles.iter().enumerate().map(|(t, triangle)| {
        let points = corners(triangle);
        let at = triangle.map(|node| smooth(t, node));
        let [a, b, c] = triangle.map(|node| rest[node as usize]);
        let inwards = (c - a).cross(&(b - a)).normalize();
        let depths = triangle.map(|node| (positions[node as usize] - rest[node as usize]).dot(&inwards));
        let spread = (0..3).map(|i| (at[i] - at[(i + 1) % 3]).norm()).fold(0.0, f64::max);
        let cuts = ((spread / CURVED).ceil() as usize).clamp(1, MOST_CUTS);
        let piece = |places: [[f64; 3]; 3]| {
            let on_surface = places.map(|weights| rounded(&points, &at, weights));
            let normal = on_surface.iter().map(|(_, normal)| normal).sum::<Vec3>().normalize();
            let depth =
                places.iter().flatten().zip(depths.iter().cycle()).map(|(w, depth)| w * depth).sum::<f64>() / 3.0;
            let corners = on_surface.map(|(point, _)| point);
            seen_from_outside(corners).then(|| (corners, lit(&normal, &towards(&corners[0]), depth)))
        };
        let outline = outline(cuts).map(|weights| rounded(&points, &at, weights).0).collect();
        Shaded { pieces: split(cuts).filter_map(piece).collect(), outline }
    });
    shaded.filter(|triangle| !triangle.pieces.is_empty()).collect()
}

/// Cuts a triangle's edges into `cuts` parts each: barycentric corners of the pieces.
fn split(cuts: usize) -> impl Iterator<Item = [[f64; 3]; 3]> {
    let place = move |i: usize, j: usize| {
        let (u, v) = (i as f64 / cuts as f64, j as f64 / cuts as f64);
        [1.0 - u - v, u, v]
    };
    (0..cuts).flat_map(move |j| (0..cuts - j).map(move |i| (i, j))).flat_map(move |(i, j)| {
        let upright = [place(i, j), place(i + 1, j), place(i, j + 1)];
        let turned = (i + j + 2 <= cuts).then(|| [place(i + 1, j), place(i + 1, j + 1), place(i, j + 1)]);
        [Some(upright), turned].into_iter().flatten()
    })
}

/// Barycentric places around a triangle, at the corners of the pieces.
fn outline(cuts: usize) -> impl Iterator<Item = [f64; 3]> {
    (0..3 * cuts).map(move |n| {
        let (corner, part) = (n / cuts, (n % cuts) as f64 / cuts as f64);
        let mut place = [0.0; 3];
        (place[corner], place[(corner + 1) % 3]) = (1.0 - part, part);
        place
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

/// Sky light from above, a lamp from the upper left, a highlight.
fn lit(normal: &Vec3, to_eye: &Vec3, depth: f64) -> [u8; 3] {
    let lamp = Vec3::new(-0.55, -0.45, 0.70).normalize();
    let sky = 0.45 + 0.13 * normal.z;
    let diffuse = 0.52 * normal.dot(&lamp).max(0.0);
    let highlight = 46.0 * normal.dot(&(lamp + to_eye).normalize()).max(0.0).powi(24);
    let depth = (depth / DEEP).clamp(0.0, 1.0);
    let color = BODY + (PRESSED - BODY) * (depth * depth * (3.0 - 2.0 * depth));
    let color = color * (sky + diffuse) + Vec3::repeat(highlight);
    [color.x, color.y, color.z].map(|channel| channel.round().clamp(0.0, 255.0) as u8)
}
