//! The windows that local models are made for: few, which cover the surface, so that what is made for one serves whenever a
//! tool comes there.

use super::aim::LOOKS;
use crate::contact::ToolShape;
use crate::simulation::Simulation;
use crate::{Pose, Vec3};

/// How far from the surface the middle of a tool with a shape is that presses into it, in its radii.
const HEIGHT: f64 = 0.7;

/// Windows of one size. Lengths in mean edges of the surface.
struct Layer {
    /// The distance of the middles of neighbours.
    spacing: f64,
    /// Nodes along the surface, both ways, more than a window is to have.
    more: usize,
    /// The way that a tool with a shape may go in one.
    way: f64,
}

/// For a tool that stays near its place, and for one that moves fast.
const LAYERS: [Layer; 2] = [Layer { spacing: 1.5, more: 0, way: 1.0 }, Layer { spacing: 2.5, more: 3, way: 2.5 }];

/// Patches of one size whose middles lie all over the surface, for one tool.
#[derive(Clone, Debug, Default)]
pub struct Windows {
    /// Nodes along the surface, along it, into depth, around each triangle that is to be held.
    size: [usize; 3],
    /// The middle of each surface triangle at rest (m).
    triangles: Vec<Vec3>,
    windows: Vec<Window>,
}

#[derive(Clone, Debug)]
struct Window {
    /// At rest (m).
    middle: Vec3,
    /// Node ids in increasing order.
    patch: Vec<u32>,
    /// Of the first window of its size.
    layer: usize,
}

impl Windows {
    /// Those of tool number `tool`, of `size` nodes along the surface, along it, into depth around a point; around all that a shape may
    /// touch two less along the surface, as that is wide by itself.
    ///
    /// # Real-time
    /// Not real-time safe: allocates, and looks at all pairs of windows and triangles.
    pub fn new(simulation: &Simulation, tool: usize, size: [usize; 3]) -> Self {
        let (body, shape) = (simulation.body(), simulation.shape(tool));
        let (rest, surface) = (body.rest(), &body.surface().triangles);
        let corners: Vec<[Vec3; 3]> = surface.iter().map(|triangle| triangle.map(|node| rest[node as usize])).collect();
        let triangles: Vec<Vec3> = corners.iter().map(|[a, b, c]| (a + b + c) / 3.0).collect();
        let edges = corners.iter().map(|[a, b, c]| (b - a).norm() + (c - b).norm() + (a - c).norm());
        let edge = edges.sum::<f64>() / (3.0 * corners.len().max(1) as f64);
        let mut windows: Vec<Window> = Vec::new();
        let mut around = Vec::new();
        for Layer { spacing, more, way } in LAYERS {
            let first = windows.len();
            let size = match shape {
                ToolShape::Point => [size[0] + more, size[1] + more, size[2]],
                _ => [2, 2, size[2]],
            };
            let margin = (0.5 * spacing + way) * edge + shape.half_axis().norm();
            for (triangle, middle) in (0..).zip(&triangles) {
                if windows[first..].iter().any(|window| (window.middle - middle).norm() < spacing * edge) {
                    continue;
                }
                around.clear();
                around.push(triangle);
                let [a, b, c] = corners[triangle as usize];
                let normal = (b - a).cross(&(c - a)).try_normalize(0.0).unwrap_or_default();
                let pose = Pose::from(middle + normal * (HEIGHT * shape.radius()));
                simulation.resting_footprint(tool, &pose, margin, &mut around);
                let mut patch = Vec::new();
                simulation.patch(tool, &around, size, &mut patch);
                windows.push(Window { middle: *middle, patch, layer: first });
            }
        }
        Self { size, triangles, windows }
    }

    /// Puts the patch for tool number `tool` over `triangles` in place of `nodes`: of the windows that are `usable` and hold all that
    /// it presses there the one in whose middle they lie best, or one of its own if there is none. A tool that is glued, and goes
    /// nowhere, always has its own. True if it is a usable one.
    ///
    /// # Real-time
    /// For the global actor: looks at all windows; `nodes` may grow.
    pub fn choose(
        &self,
        (simulation, tool): (&Simulation, usize),
        triangles: &[u32],
        usable: impl Fn(&[u32]) -> bool,
        nodes: &mut Vec<u32>,
    ) -> bool {
        if !simulation.contact(tool).glued {
            // All of a fast tool's way may be in none: then as much of it as one holds.
            let mut window = (1..=LOOKS as usize + 1).rev().filter_map(|count| {
                let first = if count > LOOKS as usize { triangles } else { &triangles[..count.min(triangles.len())] };
                simulation.pressed_at(tool, first, nodes);
                self.best(first, nodes, &usable)
            });
            if let Some(window) = window.next() {
                window.patch.clone_into(nodes);
                return true;
            }
        }
        simulation.patch(tool, triangles, self.size, nodes);
        usable(nodes)
    }

    fn best(&self, triangles: &[u32], pressed: &[u32], usable: impl Fn(&[u32]) -> bool) -> Option<&Window> {
        let holds = |patch: &[u32]| pressed.iter().all(|node| patch.binary_search(node).is_ok());
        let mut best: Option<(&Window, f64)> = None;
        for window in &self.windows {
            if best.is_some_and(|(best, _)| best.layer != window.layer) {
                break;
            }
            let far = |&triangle: &u32| (self.triangles[triangle as usize] - window.middle).norm_squared();
            let farthest = triangles.iter().map(far).fold(0.0, f64::max);
            if best.is_none_or(|(_, least)| farthest < least) && holds(&window.patch) && usable(&window.patch) {
                best = Some((window, farthest));
            }
        }
        best.map(|(window, _)| window)
    }

    /// The patches of the `count` windows nearest to `triangle`, the nearest first.
    ///
    /// # Real-time
    /// For the global actor: looks at all windows, allocates.
    pub fn around(&self, triangle: u32, count: usize) -> impl Iterator<Item = &[u32]> {
        let at = self.triangles[triangle as usize];
        let far = |window: &Window| (window.middle - at).norm_squared();
        let mut all: Vec<(f64, &Window)> =
            self.windows.iter().take_while(|window| window.layer == 0).map(|window| (far(window), window)).collect();
        all.sort_by(|a, b| a.0.total_cmp(&b.0));
        all.truncate(count);
        all.into_iter().map(|(_, window)| &window.patch[..])
    }
}
