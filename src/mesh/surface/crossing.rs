//! Where a surface crosses itself.

use palpate_model::Vec3;

use super::SurfaceMesh;
use super::checks::place;
use crate::error::MeshError;

/// How far from a plane a point is of it, in units of the largest coordinate: what rounding makes of points in one plane.
const PLANE: f64 = 1e-12;

/// A triangle in its box.
struct Boxed {
    low: Vec3,
    high: Vec3,
    triangle: u32,
}

impl SurfaceMesh {
    /// Refuses a surface with two triangles that pass through each other.
    ///
    /// # Errors
    /// With the place of such a pair.
    pub(super) fn check_crossing(&self) -> Result<(), MeshError> {
        let boxed = |triangle: u32| {
            let [a, b, c] = self.corners(triangle);
            Boxed { low: a.inf(&b).inf(&c), high: a.sup(&b).sup(&c), triangle }
        };
        let mut boxes: Vec<Boxed> = (0..self.triangles.len() as u32).map(boxed).collect();
        let extent = |axis: usize| {
            let ends = boxes.iter().fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), b| {
                (low.min(b.low[axis]), high.max(b.high[axis]))
            });
            ends.1 - ends.0
        };
        // Swept along the longest axis, few boxes are open at a time.
        let axis = (0..3).max_by(|&a, &b| extent(a).total_cmp(&extent(b))).unwrap_or(0);
        boxes.sort_unstable_by(|a, b| a.low[axis].total_cmp(&b.low[axis]));
        let largest = self.points.iter().map(|point| point.amax()).fold(0.0, f64::max);
        for (number, one) in boxes.iter().enumerate() {
            let open = boxes[number + 1..].iter().take_while(|other| other.low[axis] <= one.high[axis]);
            for other in open.filter(|other| (0..3).all(|n| one.low[n] <= other.high[n] && other.low[n] <= one.high[n]))
            {
                if let Some(at) = self.crossing(one.triangle, other.triangle, PLANE * largest) {
                    let message = format!("the surface crosses itself at {}: mend it first", place(&at));
                    return Err(MeshError::new(message));
                }
            }
        }
        Ok(())
    }

    /// Where a side of one triangle passes through the other; what is nearer to a plane than `touching` does not pass it.
    fn crossing(&self, one: u32, other: u32, touching: f64) -> Option<Vec3> {
        let [a, b] = [one, other].map(|triangle| self.triangles[triangle as usize]);
        if a.iter().filter(|node| b.contains(node)).count() > 1 {
            return None;
        }
        let [a, b] = [one, other].map(|triangle| self.corners(triangle));
        let sides = |[p, q, r]: [Vec3; 3]| [[p, q], [q, r], [r, p]];
        let through =
            |sides: [[Vec3; 2]; 3], triangle| sides.into_iter().find_map(|side| passage(side, triangle, touching));
        through(sides(a), b).or_else(|| through(sides(b), a))
    }
}

/// Where the line from `p` to `q` passes through a triangle.
fn passage([p, q]: [Vec3; 2], [a, b, c]: [Vec3; 3], touching: f64) -> Option<Vec3> {
    let normal = (b - a).cross(&(c - a));
    let (from, to) = (normal.dot(&(p - a)), normal.dot(&(q - a)));
    if from.abs().min(to.abs()) <= touching * normal.norm() || (from > 0.0) == (to > 0.0) {
        return None;
    }
    let along = q - p;
    let side = |u: &Vec3, v: &Vec3| along.dot(&(u - p).cross(&(v - p)));
    let sides = [side(&a, &b), side(&b, &c), side(&c, &a)];
    // Through its edge, too: that is another's as well.
    let is_within = sides.iter().all(|&side| side >= 0.0) || sides.iter().all(|&side| side <= 0.0);
    is_within.then(|| p + along * (from / (from - to)))
}

#[cfg(test)]
mod tests {
    use super::*;

    const TRIANGLE: [Vec3; 3] = [Vec3::new(0.0, 0.0, 0.0), Vec3::new(1.0, 0.0, 0.0), Vec3::new(0.0, 1.0, 0.0)];

    #[test]
    fn a_line_passes_through_inside_and_edge_and_not_where_it_ends_or_beside() {
        let line =
            |x: f64, y: f64, from: f64, to: f64| passage([Vec3::new(x, y, from), Vec3::new(x, y, to)], TRIANGLE, 1e-12);
        assert_eq!(line(0.25, 0.25, -1.0, 1.0), Some(Vec3::new(0.25, 0.25, 0.0)));
        assert_eq!(line(0.5, 0.5, 3.0, -1.0), Some(Vec3::new(0.5, 0.5, 0.0)));
        assert_eq!(line(0.25, 0.25, 1e-13, -1.0), None);
        assert_eq!(line(0.25, 0.25, 1.0, 2.0), None);
        assert_eq!(line(0.6, 0.6, -1.0, 1.0), None);
    }

    #[test]
    fn flat_sides_in_any_direction_do_not_cross_themselves() {
        // Many coplanar triangles, turned so that rounding leaves none of them in one plane.
        let block = palpate_model::mesh::Lattice { nodes: [7; 3] };
        let turn = turned_about_a_skew_axis();
        let points =
            (0..block.len() as u32).map(|node| turn(Vec3::from(block.coordinates(node).map(|n| n as f64 * 0.01))));
        let surface = SurfaceMesh { points: points.collect(), triangles: block.surface_triangles() };
        let (_, findings) = surface.cleaned().unwrap();
        assert_eq!(findings.parts.len(), 1);
    }

    /// A rotation about a skew axis.
    fn turned_about_a_skew_axis() -> impl Fn(Vec3) -> Vec3 {
        let axis = Vec3::new(0.3, -0.5, 0.8).normalize();
        let (sin, cos) = 0.7_f64.sin_cos();
        move |x| x * cos + axis.cross(&x) * sin + axis * (axis.dot(&x) * (1.0 - cos)) + Vec3::new(0.1, 0.2, -0.3)
    }
}
