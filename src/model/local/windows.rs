//! The windows that local models are made for: few, which cover the surface, so that what is made for one serves whenever a
//! tool comes there.

use super::forecast::LOOKS;
use crate::body::Body;
use crate::contact::ToolShape;
use crate::mesh::{NearestTriangle, Surface};
use crate::simulation::Simulation;
use crate::{Pose, Vec3};

/// How far from the surface the middle of a tool with a shape is that presses into it, in its radii.
const HEIGHT: f64 = 0.7;

/// Triangles under the tool that a window is to hold: there, ahead, behind and where it was. Those that a shape touches follow.
const WAYS: usize = 3 * LOOKS + 1;
/// Those of them that it must hold: there and ahead.
const AHEAD: usize = LOOKS + 1;

/// Windows of so many nodes along the surface have all nodes around a tool well inside. In smaller ones, as on tissue, next to none
/// would have, and the states of a basis would be spread over a larger ring: there it is the nodes beyond the three edges alone. Of what
/// a shape presses there these are mostly a part already.
const ROOMY: usize = 5;

/// Windows around a tool that are made ready before it comes there.
const NEIGHBOURS: usize = 7;

/// Windows whose normals have this cosine between them look the same way.
const ALIKE: f64 = 0.5;

/// What a node of the ring costs in a tick, in nodes of the body: its forces, and its share of two products with as many states as usual.
const RING: f64 = 2.8;

/// A window takes all of a body of so many times its nodes even if a narrow ring would cost a tick less: the global model need not look
/// ahead then.
const SMALL: f64 = 3.0;

/// Windows of one size. Lengths in mean edges of the surface.
struct Layer {
    /// The distance of the middles of neighbours.
    spacing: f64,
    /// Nodes along the surface, both ways, more than a window is to have.
    more: usize,
    /// The way that a tool with a shape may go in one.
    way: f64,
}

/// For a tool that stays near its place, one that moves, and one that moves fast.
const LAYERS: [Layer; 3] = [
    Layer { spacing: 1.5, more: 0, way: 1.0 },
    Layer { spacing: 2.5, more: 3, way: 2.5 },
    Layer { spacing: 4.0, more: 7, way: 4.5 },
];

/// Patches of one size whose middles lie all over the surface, for one tool.
#[derive(Clone, Debug, Default)]
pub struct Windows {
    /// Nodes along the surface, along it, into depth, around each triangle that is to be held.
    size: [usize; 3],
    /// The middle of each surface triangle at rest (m).
    triangles: Vec<Vec3>,
    /// They are wide enough for all nodes around a tool.
    is_roomy: bool,
    windows: Vec<Window>,
}

#[derive(Clone, Debug)]
struct Window {
    /// At rest (m).
    middle: Vec3,
    /// The outward unit normal there.
    normal: Vec3,
    /// No node is farther from the middle at rest (m).
    reach: f64,
    /// Node ids in increasing order.
    patch: Vec<u32>,
    /// Of the first window of its size.
    layer: usize,
}

/// The nodes and triangles that other tools press than the one for which a window is chosen: it is to hold them too, if there is one.
#[derive(Clone, Debug, Default)]
pub struct Beside {
    /// The nodes that they press, or may press before the next model serves, in increasing order.
    pub soon: Vec<u32>,
    /// Those that they press now.
    pub now: Vec<u32>,
    /// The triangles that they touch, or are nearest to.
    pub triangles: Vec<u32>,
}

impl Windows {
    /// Those of tool number `tool`: of `size` nodes along the surface, along it, into depth around a point; around all that a shape may
    /// touch of three nodes along the surface, as that is wide by itself.
    ///
    /// # Real-time
    /// Not real-time safe: allocates, and looks at all pairs of windows and triangles.
    pub fn new(simulation: &Simulation, tool: usize, size: [usize; 3]) -> Self {
        let (body, shape, touch) = (simulation.body(), simulation.shape(tool), simulation.touch(tool));
        let (rest, surface) = (body.rest(), &body.surface().triangles);
        let corners: Vec<[Vec3; 3]> = surface.iter().map(|triangle| triangle.map(|node| rest[node as usize])).collect();
        let triangles: Vec<Vec3> = corners.iter().map(|[a, b, c]| (a + b + c) / 3.0).collect();
        let edges = corners.iter().map(|[a, b, c]| (b - a).norm() + (c - b).norm() + (a - c).norm());
        let edge = edges.sum::<f64>() / (3.0 * corners.len().max(1) as f64);
        let mut windows: Vec<Window> = Vec::new();
        let mut around = Vec::new();
        // A point touches no more than the triangle that it is over.
        let nearest = touch.has_shape().then(|| NearestTriangle::new(body.surface(), rest).ok()).flatten();
        for Layer { spacing, more, way } in LAYERS {
            let first = windows.len();
            let size = match shape {
                ToolShape::Point => [size[0] + more, size[1] + more, size[2]],
                _ => [3, 3, size[2]],
            };
            let margin = (0.5 * spacing + way) * edge + shape.half_axis().norm();
            for (triangle, middle) in (0..).zip(&triangles) {
                let [a, b, c] = corners[triangle as usize];
                let normal = (b - a).cross(&(c - a)).try_normalize(0.0).unwrap_or_default();
                // One around the corner does not reach as far here.
                let is_beside = |window: &Window| {
                    (window.middle - middle).norm() < spacing * edge && window.normal.dot(&normal) > ALIKE
                };
                if windows[first..].iter().any(is_beside) {
                    continue;
                }
                around.clear();
                around.push(triangle);
                let pose = Pose::from(middle + normal * (HEIGHT * shape.radius()));
                if let Some(nearest) = &nearest {
                    touch.footprint(nearest, (body.surface(), rest), &pose, margin, &mut around);
                }
                let mut patch = Vec::new();
                simulation.patch(tool, &around, size, &mut patch);
                windows.push(Window { middle: *middle, normal, reach: 0.0, patch, layer: first });
            }
            extend_over_small(body, &mut windows, first);
        }
        for Window { middle, reach, patch, .. } in &mut windows {
            *reach = patch.iter().map(|&node| (rest[node as usize] - *middle).norm()).fold(0.0, f64::max);
        }
        Self { size, triangles, is_roomy: size[0].min(size[1]) >= ROOMY, windows }
    }

    /// Puts the patch for tool number `tool` over `triangles` in place of `nodes`. True if it is a usable one.
    ///
    /// It is that of the least `usable` window that holds all that the tool presses there well inside: at the edge of a window it is
    /// next to a ring that moves as predicted. If there is none, as much of the way as one holds well inside; then all of the way
    /// ahead, be it at the edge. Else the tool has a patch of its own, as always one that is glued and goes nowhere.
    ///
    /// Of several windows the one is taken in whose middle all that lies best. One that holds what others will press `beside` too comes
    /// before one that holds what they press now, and that before others; in its middle is then what lies between all of them.
    ///
    /// # Real-time
    /// For the global actor: looks at all windows; `nodes` may grow.
    pub fn choose(
        &self,
        (simulation, tool): (&Simulation, usize),
        triangles: &[u32],
        beside: &Beside,
        usable: impl Fn(&[u32]) -> bool,
        nodes: &mut Vec<u32>,
    ) -> bool {
        if !simulation.contact(tool).glued {
            // All of a fast tool's way may be in none: then as much of it as one holds.
            let mut on_way = |least: usize, well_inside: bool| {
                (least..=WAYS + 1).rev().find_map(|count| {
                    let first = if count > WAYS { triangles } else { &triangles[..count.min(triangles.len())] };
                    let longer = if count < WAYS { count + 1 } else { triangles.len() };
                    let left_out = triangles.get(count..longer).unwrap_or_default();
                    if count <= WAYS && left_out.iter().all(|triangle| first.contains(triangle)) {
                        // The same triangles as those of the longer way, which no window holds.
                        return None;
                    }
                    simulation.pressed_at(tool, first, nodes);
                    if well_inside {
                        self.add_around(simulation.body(), first, nodes);
                    }
                    let shared = [&beside.soon, &beside.now].into_iter().filter(|nodes| !nodes.is_empty());
                    let together = || first.iter().chain(&beside.triangles);
                    let rest = simulation.body().rest();
                    let mut shared = shared.filter_map(|also| self.best(rest, together(), [nodes, also], &usable));
                    shared.next().or_else(|| self.best(rest, first.iter(), [nodes, &[]], &usable))
                })
            };
            if let Some(window) = on_way(1, true).or_else(|| on_way(AHEAD, false)) {
                window.patch.clone_into(nodes);
                return true;
            }
        }
        simulation.patch(tool, triangles, self.size, nodes);
        usable(nodes)
    }

    /// The patch of the largest windows that holds most of `patch`, whose middle is nearest to `triangle`: for a tool of which
    /// nobody knows yet where it goes.
    ///
    /// # Real-time
    /// For the global actor: looks at all windows.
    pub fn widest(&self, triangle: u32, patch: &[u32]) -> Option<&[u32]> {
        let at = self.triangles[triangle as usize];
        let layer = self.windows.last()?.layer;
        let rank = |window: &Window| {
            let missing = patch.iter().filter(|node| window.patch.binary_search(node).is_err()).count();
            (missing, (window.middle - at).norm_squared())
        };
        let ranked = self.windows[layer..].iter().map(|window| (rank(window), window));
        let best = ranked.min_by(|((a, near), _), ((b, far), _)| a.cmp(b).then(near.total_cmp(far)));
        best.map(|(_, window)| &window.patch[..])
    }

    /// Adds to the nodes that are `pressed` at `triangles` those that a window has to hold too, to have a tool well inside: those around
    /// each of them, or in small windows those beyond the edges of the triangles. In increasing order, each once.
    fn add_around(&self, body: &dyn Body, triangles: &[u32], pressed: &mut Vec<u32>) {
        let surface = body.surface();
        let add = |triangle: u32, pressed: &mut Vec<u32>| {
            let corners = surface.triangles[triangle as usize].into_iter();
            pressed.extend(corners.filter(|&node| body.inverse_masses()[node as usize] > 0.0));
        };
        if self.is_roomy {
            for n in 0..pressed.len() {
                surface.at_node(pressed[n]).iter().for_each(|&triangle| add(triangle, pressed));
            }
        } else {
            let beyond = triangles.iter().flat_map(|&triangle| surface.neighbours[triangle as usize]);
            beyond.filter(|&triangle| triangle != Surface::NONE).for_each(|triangle| add(triangle, pressed));
        }
        pressed.sort_unstable();
        pressed.dedup();
    }

    /// The least of the usable windows that hold what is `pressed`, and of these the one in whose middle `triangles` lie best.
    fn best<'a>(
        &self,
        rest: &[Vec3],
        triangles: impl Iterator<Item = &'a u32> + Clone,
        pressed: [&[u32]; 2],
        usable: impl Fn(&[u32]) -> bool,
    ) -> Option<&Window> {
        let holds = |patch: &[u32]| pressed.into_iter().flatten().all(|node| patch.binary_search(node).is_ok());
        let first = pressed.into_iter().flatten().copied().next();
        let mut best: Option<(&Window, f64)> = None;
        for window in &self.windows {
            if best.is_some_and(|(best, _)| best.layer != window.layer) {
                break;
            }
            // Most windows do not reach as far as the first node.
            if first.is_some_and(|node| (rest[node as usize] - window.middle).norm() > window.reach)
                || !holds(&window.patch)
            {
                continue;
            }
            let far = |&triangle: &u32| (self.triangles[triangle as usize] - window.middle).norm_squared();
            let farthest = triangles.clone().map(far).fold(0.0, f64::max);
            if best.is_none_or(|(_, least)| farthest < least) && usable(&window.patch) {
                best = Some((window, farthest));
            }
        }
        best.map(|(window, _)| window)
    }

    /// The patches of the seven least windows nearest to `triangle`, the nearest first.
    ///
    /// # Real-time
    /// For the global actor: looks at all windows, allocates.
    pub fn around(&self, triangle: u32) -> impl Iterator<Item = &[u32]> {
        self.nearest(triangle, 0).take(NEIGHBOURS).map(|window| &window.patch[..])
    }

    /// The patches of the largest windows that look the way of the one at `triangle`, the nearest first: a tool may go anywhere.
    ///
    /// # Real-time
    /// For the global actor: looks at all windows, allocates.
    pub fn widest_around(&self, triangle: u32) -> impl Iterator<Item = &[u32]> {
        let mut all = self.nearest(triangle, self.windows.last().map_or(0, |window| window.layer)).peekable();
        let normal = all.peek().map(|first| first.normal).unwrap_or_default();
        all.filter(move |window| window.normal.dot(&normal) > ALIKE).map(|window| &window.patch[..])
    }

    fn nearest(&self, triangle: u32, layer: usize) -> impl Iterator<Item = &Window> {
        let at = self.triangles[triangle as usize];
        let far = |window: &Window| (window.middle - at).norm_squared();
        let of_layer = self.windows.iter().filter(|window| window.layer == layer);
        let mut all: Vec<(f64, &Window)> = of_layer.map(|window| (far(window), window)).collect();
        all.sort_by(|a, b| a.0.total_cmp(&b.0));
        all.into_iter().map(|(_, window)| window)
    }
}

/// Lets the `windows` of one size, from the `first` on, take all of a `body` that costs a tick no more than such a window with its ring does,
/// or little: nothing is around it then that would have to be foretold or reduced.
///
/// Where all of them do, the first is left: one is as good as another, and each would be looked at in every period.
fn extend_over_small(body: &dyn Body, windows: &mut Vec<Window>, first: usize) {
    let all: Vec<u32> = (0..).zip(body.inverse_masses()).filter(|&(_, &w)| w > 0.0).map(|(node, _)| node).collect();
    let of_size = &mut windows[first..];
    let parts = of_size.iter().map(|window| &window.patch).filter(|patch| patch.len() < all.len());
    if let Some(sample) = parts.max_by_key(|patch| patch.len())
        && let Some(near) = body.restriction(sample)
    {
        let with_ring = 1.0 + RING * near.ring(sample.len()).len() as f64 / sample.len() as f64;
        let most = with_ring.max(SMALL);
        let is_small = |patch: &[u32]| all.len() as f64 <= most * patch.len() as f64;
        let small = of_size.iter_mut().filter(|window| is_small(&window.patch));
        small.for_each(|window| all.clone_into(&mut window.patch));
    }
    if of_size.iter().all(|window| window.patch == all) {
        windows.truncate(first + 1);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::body::{Block, State};
    use crate::contact::{Contact, Law};
    use crate::mesh::Face;
    use crate::simulation::Stepping;

    const SIZE: [usize; 3] = [4, 4, 2];

    /// A block with cells of 10 mm.
    fn simulation(nodes: [usize; 3], shape: ToolShape) -> Simulation {
        let size = nodes.map(|count| 0.01 * (count - 1) as f64);
        let block = Block::builder(nodes, size).fix(Face::ZMin).build().unwrap();
        let (state, stepping) = (State::at_rest(block.rest()), Stepping { tick: 1e-3, substeps: 4 });
        let sim = Simulation::new(Box::new(block), state, Contact::default(), Law::default(), stepping).unwrap();
        sim.with_shape(0, shape)
    }

    /// The triangles of the top.
    fn top(simulation: &Simulation) -> Vec<u32> {
        let (rest, triangles) = (simulation.body().rest(), &simulation.body().surface().triangles);
        let highest = rest.iter().map(|place| place.z).fold(0.0, f64::max);
        let is_on_top = |triangle: &[u32; 3]| triangle.iter().all(|&node| rest[node as usize].z > highest - 1e-4);
        (0..triangles.len() as u32).filter(|&t| is_on_top(&triangles[t as usize])).collect()
    }

    #[test]
    fn every_place_is_well_inside_one_of_few_windows() {
        for shape in [ToolShape::Point, ToolShape::Sphere { radius: 8e-3 }] {
            let simulation = simulation([9; 3], shape);
            let windows = Windows::new(&simulation, 0, SIZE);
            let (mut pressed, mut patch, mut used) = (Vec::new(), Vec::new(), Vec::new());
            let top = top(&simulation);
            for &triangle in &top {
                assert!(windows.choose((&simulation, 0), &[triangle], &Beside::default(), |_| true, &mut patch));
                simulation.pressed_at(0, &[triangle], &mut pressed);
                windows.add_around(simulation.body(), &[triangle], &mut pressed);
                assert!(pressed.iter().all(|node| patch.contains(node)), "{shape:?}: triangle {triangle}");
                assert!(patch.is_sorted());
                used.push(patch.clone());
            }
            used.sort();
            used.dedup();
            assert!(4 * used.len() < top.len(), "{shape:?}: {} windows for {} triangles", used.len(), top.len());
        }
    }

    #[test]
    fn a_way_takes_the_least_window_that_holds_it_or_most_of_it() {
        let simulation = simulation([9; 3], ToolShape::Point);
        let windows = Windows::new(&simulation, 0, SIZE);
        let nearest = crate::mesh::NearestTriangle::new(simulation.body().surface(), simulation.body().rest()).unwrap();
        let at = |x: f64| nearest.find(&Vec3::new(x, 0.041, 0.08));
        let mut patch = Vec::new();
        let mut chosen = |triangles: &[u32]| {
            assert!(windows.choose((&simulation, 0), triangles, &Beside::default(), |_| true, &mut patch));
            patch.clone()
        };
        let resting = chosen(&[at(0.041)]);
        assert_eq!(resting.len(), SIZE.iter().product::<usize>());
        let fast = chosen(&[at(0.021), at(0.031), at(0.041), at(0.041)]);
        assert!(fast.len() > resting.len());
        assert!(windows.widest(at(0.041), &resting).unwrap().len() > fast.len());
        // From edge to edge is more than any window holds: it holds the first half.
        let [edge, middle] = [at(0.001), at(0.031)];
        let too_far = chosen(&[edge, middle, at(0.061), at(0.079)]);
        let corners = |triangle: u32| simulation.body().surface().triangles[triangle as usize];
        assert!([edge, middle].into_iter().flat_map(corners).all(|node| too_far.contains(&node)));
    }

    #[test]
    fn a_window_takes_all_of_a_body_that_costs_no_more_than_its_ring() {
        for (nodes, takes_all) in [([5; 3], [true; 3]), ([9, 9, 5], [false, true, true]), ([11; 3], [false; 3])] {
            let simulation = simulation(nodes, ToolShape::Point);
            let movable = simulation.body().inverse_masses().iter().filter(|&&w| w > 0.0).count();
            let mut windows = Windows::new(&simulation, 0, SIZE).windows;
            // At the bottom, which is held, there are fewer nodes in each.
            windows.retain(|window| window.normal.z > ALIKE);
            windows.dedup_by_key(|window| window.layer);
            let all = windows.iter().map(|window| window.patch.len() == movable);
            assert_eq!(all.collect::<Vec<_>>(), takes_all, "{nodes:?}");
        }
    }

    #[test]
    fn a_tool_at_the_edge_of_a_window_takes_a_larger_one_or_its_own_before_it_leaves() {
        let simulation = simulation([9; 3], ToolShape::Point);
        let windows = Windows::new(&simulation, 0, SIZE);
        let all = &windows.windows;
        let largest = all.last().unwrap().layer;
        let holds = |triangle: u32, window: &Window| {
            let corners = &simulation.body().surface().triangles[triangle as usize];
            corners.iter().all(|node| window.patch.contains(node))
        };
        let has_inside = |triangle: u32, window: &Window| {
            let mut around = simulation.body().surface().triangles[triangle as usize].to_vec();
            windows.add_around(simulation.body(), &[triangle], &mut around);
            around.iter().all(|node| window.patch.contains(node))
        };
        let choose = |way: &[u32], usable: &[&Window]| {
            let usable = |patch: &[u32]| usable.iter().any(|window| window.patch == patch);
            let mut patch = Vec::new();
            let is_usable = windows.choose((&simulation, 0), way, &Beside::default(), usable, &mut patch);
            is_usable.then_some(patch)
        };
        let (top, mut found) = (top(&simulation), 0);
        for &triangle in &top {
            let at_its_edge = |small: &&Window| holds(triangle, small) && !has_inside(triangle, small);
            let Some(small) = all.iter().find(at_its_edge) else { continue };
            let outside = *top.iter().find(|&&other| !holds(other, small)).unwrap();
            let well = all[largest..].iter().find(|large| has_inside(triangle, large)).unwrap();
            assert_eq!(choose(&[triangle], &[small, well]).unwrap(), well.patch);
            assert_eq!(choose(&[triangle], &[small]).unwrap(), small.patch, "it stays in it");
            assert_eq!(choose(&[triangle, outside], &[small]), None);
            found += 1;
        }
        assert!(found > 0);
    }

    #[test]
    fn around_a_sphere_are_all_neighbours_of_what_it_presses_and_in_small_windows_what_is_beyond_the_edges() {
        let simulation = simulation([9; 3], ToolShape::Sphere { radius: 8e-3 });
        let [roomy, small] = [true, false].map(|is_roomy| Windows { is_roomy, ..Windows::default() });
        let (triangles, triangle) = (&simulation.body().surface().triangles, top(&simulation)[40]);
        let mut pressed = Vec::new();
        simulation.pressed_at(0, &[triangle], &mut pressed);
        assert!(pressed.len() > 3, "more than the triangle's corners");
        let touches = |triangle: &&[u32; 3]| triangle.iter().any(|node| pressed.contains(node));
        let mut neighbours: Vec<u32> = triangles.iter().filter(touches).flatten().copied().collect();
        neighbours.sort_unstable();
        neighbours.dedup();
        roomy.add_around(simulation.body(), &[triangle], &mut pressed);
        assert_eq!(pressed, neighbours);
        let mut corners = triangles[triangle as usize].to_vec();
        small.add_around(simulation.body(), &[triangle], &mut corners);
        assert_eq!(corners.len(), 3 + 3);
    }

    #[test]
    fn a_window_that_is_ready_comes_before_a_better_one_that_is_not() {
        let simulation = simulation([9; 3], ToolShape::Point);
        let windows = Windows::new(&simulation, 0, SIZE);
        let triangle = top(&simulation)[40];
        let (mut best, mut ready) = (Vec::new(), Vec::new());
        windows.choose((&simulation, 0), &[triangle], &Beside::default(), |_| true, &mut best);
        assert!(windows.choose((&simulation, 0), &[triangle], &Beside::default(), |patch| patch != best, &mut ready));
        assert_ne!(best, ready);
        assert!(
            !windows.choose((&simulation, 0), &[triangle], &Beside::default(), |_| false, &mut ready),
            "none is ready"
        );
        assert!(windows.around(triangle).count() == 7 && windows.around(triangle).any(|patch| patch == best));
        let largest: Vec<&[u32]> = windows.widest_around(triangle).collect();
        assert!(!largest.is_empty() && largest.iter().all(|patch| patch.len() > best.len()));
        assert!(largest.contains(&windows.widest(triangle, &best).unwrap()));
    }
}
