//! Fine elements under a tool: it meets their corners and not what is between them.
//!
//! A sphere that touches a flat triangle touches it elsewhere when the triangle turns, by R times the angle. The force goes with the place, which
//! resists the turn as a spring of F R does: on elements much smaller than R stiffer than they are themselves, so that explicit steps that
//! carry the elements would not carry it, and the force of a sphere that is held would not come to rest. At a corner it stays where it is.

use super::closest;
use super::grain::COARSE;
use super::near::Near;
use super::touch::Touch;
use super::vicinity::Vicinity;
use crate::Vec3;

/// The corners of a vicinity, and which of them are places that the tool may touch.
#[derive(Clone, Debug, Default)]
pub(super) struct Corners {
    /// Normals of those within reach, longer where triangles are larger (m^2).
    outward: Vec<Vec3>,
    is_met: Vec<bool>,
}

impl Corners {
    /// Makes room for the corners of a body of so many nodes.
    pub(super) fn make_room(&mut self, nodes: usize) {
        self.outward.reserve(nodes);
        self.is_met.reserve(nodes);
    }

    /// Calls `keep` for each corner that would overlap with a tool whose axis is there; none where elements are coarse. Corners are pushed so much
    /// farther than the tool's surface that the triangles between them, which are chords, lie on it in the mean. `corners` are those of the
    /// `vicinity` at the start of the step and at its end if nothing presses (m), `squares` how far they are from the axis then, squared.
    pub(super) fn find(
        &mut self,
        (vicinity, corners, squares): (&Vicinity, &[[Vec3; 2]], &[f64]),
        touch: &Touch,
        axis: &[Vec3; 2],
        mut keep: impl FnMut(Near),
    ) {
        let (fine, radius) = (touch.steady.fineness, touch.shape.radius());
        self.is_met.clear();
        self.is_met.resize(vicinity.nodes.len(), false);
        if fine == 0.0 {
            return;
        }
        for ((is_met, &node), squared) in self.is_met.iter_mut().zip(&vicinity.nodes).zip(squares) {
            *is_met = squared.sqrt() < radius + beyond(touch, node as usize);
        }
        self.outward.clear();
        self.outward.resize(vicinity.nodes.len(), Vec3::zeros());
        for places in &vicinity.corners {
            let [a, b, c] = places.map(|place| place as usize);
            if !(self.is_met[a] || self.is_met[b] || self.is_met[c]) {
                continue;
            }
            let (first, second) = (corners[b][1] - corners[a][1], corners[c][1] - corners[a][1]);
            let across = first.cross(&second);
            [a, b, c].into_iter().for_each(|place| self.outward[place] += across);
        }
        // A vicinity numbers its nodes in the order in which its triangles name them.
        let mut next = 0;
        for (&triangle, places) in vicinity.triangles.iter().zip(&vicinity.corners) {
            for (corner, &number) in places.iter().enumerate() {
                if number != next {
                    continue;
                }
                next += 1;
                let number = number as usize;
                if !std::mem::take(&mut self.is_met[number]) {
                    continue;
                }
                let [from, place] = corners[number];
                let share = closest::share_at(axis, &place);
                let away = axis[0] + (axis[1] - axis[0]) * share - place;
                let gap = away.norm() - radius - beyond(touch, vicinity.nodes[number] as usize);
                if gap >= 0.0 || away.dot(&self.outward[number]) <= 0.0 {
                    continue;
                }
                let Some(normal) = away.try_normalize(0.0) else { continue };
                self.is_met[number] = true;
                let weights = [0, 1, 2].map(|other| if other == corner { 1.0 } else { 0.0 });
                keep(Near { triangle, weights, from, place, normal, gap, share });
            }
        }
    }

    /// True if all three corners are met.
    pub(super) fn are_all_met(&self, places: &[u32; 3]) -> bool {
        places.iter().all(|place| self.is_met[*place as usize])
    }

    /// True if all corners with a weight are met: what is between them cannot overlap by more than a chord.
    pub(super) fn are_met(&self, places: &[u32; 3], weights: &[f64; 3]) -> bool {
        places.iter().zip(weights).all(|(place, weight)| *weight == 0.0 || self.is_met[*place as usize])
    }
}

/// How far from the tool's own surface the corner at `node` is met (m).
pub(super) fn beyond(touch: &Touch, node: usize) -> f64 {
    let (skin, fine) = (&touch.skin, touch.steady.fineness);
    // Along a capsule surfaces that it has pressed in are straight.
    let curved = if touch.shape.half_axis() == Vec3::zeros() { 1.0 } else { 0.5 };
    (1.0 - fine) * skin.depth(node) + fine * curved * mean_chord(skin.edge(node), touch.shape.radius())
}

/// How deep a place of a triangle whose corners lie on a sphere of `radius` (m) is inside it (m); no deeper than where elements are as coarse as
/// fine ones can be.
pub(super) fn chord(corners: &[Vec3; 3], weights: &[f64; 3], radius: f64) -> f64 {
    let sides = [[0, 1], [1, 2], [2, 0]];
    let squares = sides.map(|[i, j]| weights[i] * weights[j] * (corners[i] - corners[j]).norm_squared());
    (squares.iter().sum::<f64>() / (2.0 * radius)).min(mean_chord(COARSE[1] * radius, radius) * 4.0 / 3.0)
}

/// The same in the mean over triangles with that `edge` (m).
pub(super) fn mean_chord(edge: f64, radius: f64) -> f64 {
    edge * edge / (8.0 * radius)
}

#[cfg(test)]
mod tests {
    use super::super::triangle::interpolate;
    use super::*;

    #[test]
    fn a_chord_is_what_triangles_lack_of_the_sphere_through_their_corners() {
        let (radius, edge) = (10e-3_f64, 1e-3_f64);
        let around = edge / 3.0_f64.sqrt();
        let corners = [0.0, 1.0, 2.0].map(|n: f64| {
            let (y, x) = (n * std::f64::consts::TAU / 3.0).sin_cos();
            Vec3::new(around * x, around * y, (radius * radius - around * around).sqrt())
        });
        let lacking = |weights: &[f64; 3]| radius - interpolate(weights, &corners).norm();
        let (mut sum, mut count) = (0.0, 0.0);
        for i in 0..60 {
            for j in 0..60 - i {
                let [u, v] = [f64::from(i), f64::from(j)].map(|n| (n + 1.0 / 3.0) / 60.0);
                let weights = [1.0 - u - v, u, v];
                assert!((lacking(&weights) - chord(&corners, &weights, radius)).abs() < 1e-3 * edge * edge / radius);
                (sum, count) = (sum + lacking(&weights), count + 1.0);
            }
        }
        assert!((sum / count / mean_chord(edge, radius) - 1.0).abs() < 0.02, "{}", sum / count);
    }
}
