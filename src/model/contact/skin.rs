//! The surface as a tool of some size meets it: where its elements are coarse against the tool, corners of triangles are means
//! of the nodes around them.
//!
//! A node that is pressed alone gives way twice as much as the middle of an edge, and four times as much as a place that is
//! shared by many. A tool that covers many nodes does not notice. One that is as large as an element would: its force would
//! double between a node and the middle of a face. So each corner k of a triangle is at
//!
//! ```text
//! y_k = sum_j s_kj x_j,   s_kj ~ (1 - |X_j - X_k|^2 / c^2)^2 (N_j . N_k)^2,   sum_j s_kj = 1,   sum_j s_kj (X_j - X_k) || N_k
//! ```
//!
//! over the nodes around it, X at rest, N the normals there. Forces on a corner go to the nodes with the same shares, so
//! momentum is kept to the last digit. c is 2.8 edges where edges are longer than half the tool's radius, and goes to zero
//! (y_k = x_k) at a quarter: there the tool meets several triangles at once. Towards sharp edges of the body it goes to zero as
//! well.

use crate::Vec3;
use crate::body::{Body, Stiffness};
use crate::mesh::Surface;

/// c, in mean edges at the node.
const REACH: f64 = 2.8;
/// Nodes farther away than this share of c would count next to nothing.
const CUT: f64 = 0.91;
/// Edges, in tool radii, below which nothing is smoothed, and above which all of it is.
const EDGES: [f64; 2] = [0.235, 0.245];
/// Rounds in which edges are averaged over neighbours for that: a tool meets all of the surface around it in one way, as it would feel the
/// border between smoothed corners and others.
const ROUNDS: usize = 8;
/// The least cosine between a node's normal and those of its triangles, at a sharp edge and on a smooth surface.
const COSINES: [f64; 2] = [0.75, 0.95];
/// How far an element by itself spreads a load on its node, squared, in squared edges.
const ELEMENT: f64 = 0.04;
/// Elements that are pressed together give way more than in proportion: by this times the square of what they show, over the whole depth.
const CRUSHED: f64 = 0.05;
/// The most that a tool sinks in beside the elements, in edges.
const MOST_SUNK: f64 = 0.6;

/// The corners of the triangles as a tool of some size meets them, and how deep it sinks in where the elements cannot show it.
#[derive(Clone, Debug, Default)]
pub(crate) struct Skin {
    /// Where the shares of each node's corner begin; empty if no corner is smoothed.
    starts: Vec<u32>,
    shares: Vec<(u32, f64)>,
    /// How far each corner lies below its node at rest (m): convex surfaces shrink, and the tool is met there all the same.
    depths: Vec<f64>,
    /// Of each node; empty if the body's contact modulus is not known.
    grains: Vec<Grain>,
    /// No smoothed corner moves farther than its nodes do by more than this factor.
    stretch: f64,
    /// No smoothed corner is farther than this from its node (m), unless its triangles are stretched to more than twice their size.
    reach: f64,
}

impl Skin {
    /// For a tool of `radius` (m) on `body`.
    pub(crate) fn new(body: &dyn Body, radius: f64) -> Self {
        let (surface, rest, moduli) = (body.surface(), body.rest(), body.contact_moduli());
        let normals: Vec<Vec3> = (0..rest.len() as u32).map(|node| normal_at(surface, rest, node)).collect();
        let (mut starts, mut shares, mut depths) = (vec![0], Vec::new(), Vec::with_capacity(rest.len()));
        let (mut found, mut grains, mut longest) = (Vec::new(), Vec::new(), 0.0_f64);
        let edges = edges(surface, rest);
        let around = averaged(surface, edges.clone());
        for node in 0..rest.len() as u32 {
            let edge = edges[node as usize];
            let coarse = ramp(around[node as usize] / radius, EDGES);
            let sigma = corner((surface, rest, &normals), node, [edge, coarse], &mut found);
            longest = longest.max(edge);
            if let Some(&modulus) = moduli.get(node as usize) {
                grains.push(Grain {
                    share: coarse,
                    modulus,
                    variance: sigma * sigma + ELEMENT * edge * edge,
                    most: MOST_SUNK * edge,
                });
            }
            let centre =
                found.iter().fold(Vec3::zeros(), |sum, &(n, s)| sum + (rest[n as usize] - rest[node as usize]) * s);
            depths.push(-centre.dot(&normals[node as usize]));
            shares.append(&mut found);
            starts.push(shares.len() as u32);
        }
        let sizes = starts.windows(2).map(|ends| &shares[ends[0] as usize..ends[1] as usize]);
        let stretch = sizes.map(|corner| corner.iter().map(|(_, share)| share.abs()).sum()).fold(1.0, f64::max);
        if shares.len() == rest.len() {
            (starts, shares, depths) = Default::default();
        }
        let reach = if starts.is_empty() { 0.0 } else { 2.0 * longest };
        Self { starts, shares, depths, grains, stretch, reach }
    }

    /// How coarse the surface is for the tool.
    pub(crate) fn coarseness(&self, body: &dyn Body) -> Coarseness {
        let (surface, rest) = (body.surface(), body.rest());
        let sides = surface.triangles.iter().flat_map(|&[a, b, c]| [[a, b], [b, c], [c, a]]);
        let sum: f64 = sides.map(|[a, b]| (rest[a as usize] - rest[b as usize]).norm()).sum();
        let nodes = || (0..rest.len() as u32).filter(|&node| !surface.at_node(node).is_empty());
        let smoothed = nodes().filter(|&node| !self.corner(node).is_empty()).count();
        Coarseness {
            edge: sum / (3 * surface.triangles.len()).max(1) as f64,
            smoothed: smoothed as f64 / nodes().count().max(1) as f64,
            sinks: !self.grains.is_empty(),
        }
    }

    /// True if every corner is its node.
    pub(super) fn is_none(&self) -> bool {
        self.starts.is_empty()
    }

    /// The nodes that make the corner of `node`, with their shares; none if it is the node itself.
    pub(crate) fn corner(&self, node: u32) -> &[(u32, f64)] {
        match self.starts.get(node as usize..node as usize + 2) {
            Some(&[from, to]) if to - from > 1 => &self.shares[from as usize..to as usize],
            _ => &[],
        }
    }

    /// The grain of the body at `weights` of three nodes, which are at `places` (m), if it is known.
    pub(super) fn grain(&self, nodes: [u32; 3], weights: &[f64; 3], places: &[Vec3; 3]) -> Option<Grain> {
        let mut mean = Grain { modulus: 0.0, variance: 0.0, most: 0.0, share: 0.0 };
        for (node, weight) in nodes.into_iter().zip(weights) {
            let grain = self.grains.get(node as usize)?;
            mean.modulus += grain.modulus * weight;
            mean.variance += grain.variance * weight;
            mean.most += grain.most * weight;
            mean.share += grain.share * weight;
        }
        // What is shared by several corners is spread as far as they are apart: over the middle of a face the elements give way less
        // than over a node.
        for [i, j] in [[0, 1], [1, 2], [2, 0]] {
            mean.variance += 0.5 * weights[i] * weights[j] * (places[i] - places[j]).norm_squared();
        }
        (mean.modulus > 0.0).then_some(mean)
    }

    /// How much farther than its nodes a smoothed corner may move, as a factor.
    pub(super) fn stretch(&self) -> f64 {
        self.stretch
    }

    /// How far smoothed corners may be from their nodes (m).
    pub(super) fn reach(&self) -> f64 {
        self.reach
    }

    /// How far the corner of `node` lies below it at rest (m).
    pub(super) fn depth(&self, node: usize) -> f64 {
        self.depths.get(node).copied().unwrap_or(0.0)
    }

    /// That of a window: `nodes` are the ids of its nodes here, `place` gives the place of an id. Nodes whose corner is made of
    /// others than these are corners of no triangle that is looked at.
    pub(crate) fn localise(&self, nodes: &[u32], place: impl Fn(u32) -> Option<u32>, local: &mut Self) {
        local.starts.clear();
        local.shares.clear();
        local.depths.clear();
        local.grains.clear();
        (local.stretch, local.reach) = (self.stretch, self.reach);
        if !self.grains.is_empty() {
            local.grains.extend(nodes.iter().map(|&node| self.grains[node as usize]));
        }
        if self.starts.is_empty() {
            return;
        }
        local.starts.push(0);
        for &node in nodes {
            let corner = self.corner(node);
            if corner.iter().all(|&(other, _)| place(other).is_some()) {
                local.shares.extend(corner.iter().filter_map(|&(other, share)| Some((place(other)?, share))));
                local.depths.push(self.depth(node as usize));
            } else {
                local.depths.push(0.0);
            }
            local.starts.push(local.shares.len() as u32);
        }
    }
}

/// The nodes of one corner with their shares: the node alone if it is not smoothed, as where its mean `edge` (m) is not `coarse` (0 to 1).
/// Returns how far its nodes spread along the surface in every direction (m).
fn corner(
    (surface, rest, normals): (&Surface, &[Vec3], &[Vec3]),
    node: u32,
    [edge, coarse]: [f64; 2],
    found: &mut Vec<(u32, f64)>,
) -> f64 {
    found.clear();
    found.push((node, 1.0));
    let (here, normal) = (rest[node as usize], normals[node as usize]);
    let triangles = surface.at_node(node);
    if triangles.is_empty() {
        return 0.0;
    }
    let corners = |t: u32| surface.triangles[t as usize];
    let mut flatness = 1.0_f64;
    for &t in triangles {
        let [a, b, c] = corners(t).map(|n| rest[n as usize]);
        let across = (b - a).cross(&(c - a));
        flatness = flatness.min(across.dot(&normal) / across.norm().max(f64::MIN_POSITIVE));
    }
    let reach = REACH * edge * coarse * ramp(flatness, COSINES);
    if reach < edge {
        return 0.0;
    }
    // Along the surface from node to node, as far as they count.
    let mut next = 0;
    while next < found.len() {
        for &t in surface.at_node(found[next].0) {
            for other in corners(t) {
                let is_new = found.iter().all(|&(known, _)| known != other);
                if is_new && (rest[other as usize] - here).norm() < CUT * reach {
                    found.push((other, 0.0));
                }
            }
        }
        next += 1;
    }
    let tangent = if normal.x.abs() < 0.6 { normal.cross(&Vec3::x()) } else { normal.cross(&Vec3::y()) }.normalize();
    let axes = [tangent, normal.cross(&tangent)];
    let along = |other: u32| axes.map(|axis| axis.dot(&(rest[other as usize] - here)));
    for (other, share) in found.iter_mut() {
        let far = (rest[*other as usize] - here).norm_squared();
        let alike = normals[*other as usize].dot(&normal).max(0.0);
        *share = (1.0 - far / (reach * reach)).powi(2) * alike * alike;
    }
    // Shares that are tilted so that their centre lies over the node: linear fields are met as they are.
    let (mut first, mut second) = ([0.0; 2], [[0.0; 2]; 2]);
    for &(other, share) in found.iter() {
        let xi = along(other);
        for i in 0..2 {
            first[i] += share * xi[i];
            (0..2).for_each(|j| second[i][j] += share * xi[i] * xi[j]);
        }
    }
    let determinant = second[0][0] * second[1][1] - second[0][1] * second[1][0];
    let tilt = [
        -(second[1][1] * first[0] - second[0][1] * first[1]) / determinant,
        -(second[0][0] * first[1] - second[1][0] * first[0]) / determinant,
    ];
    let mut sum = 0.0;
    for (other, share) in found.iter_mut() {
        let xi = along(*other);
        *share *= 1.0 + tilt[0] * xi[0] + tilt[1] * xi[1];
        sum += *share;
    }
    let is_good = determinant > 0.0 && found.iter().all(|&(_, share)| share >= -0.05 * sum) && sum > 0.0;
    if is_good {
        found.iter_mut().for_each(|(_, share)| *share /= sum);
        let squares: f64 =
            found.iter().map(|&(other, share)| share * along(other).iter().map(|xi| xi * xi).sum::<f64>()).sum();
        (0.5 * squares.max(0.0)).sqrt()
    } else {
        found.truncate(1);
        found[0].1 = 1.0;
        0.0
    }
}

/// How coarse the surface of a body is against a tool, and what is done about it.
///
/// # Real-time
/// A plain value: its methods are wait-free and real-time safe.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Coarseness {
    /// The mean edge of the triangles at rest (m).
    pub edge: f64,
    /// The share of the surface's nodes whose corner is a mean of the nodes around: 0 where the elements are fine against the tool.
    pub smoothed: f64,
    /// True if the tool sinks in beside the elements as deep as they cannot show.
    pub sinks: bool,
}

/// How coarse the body is at some place, for a tool that sinks in.
///
/// The elements show the sinking of a load that is spread over them, c F with c = 1 / (2 sqrt(pi) sigma E*), sigma the spread of
/// corners and elements together, and under large loads a little more. A sphere on a half space sinks in by
/// (9 F^2 / (16 R E*^2))^(1/3) (Hertz 1882). What the elements lack of that the tool sinks in beside them.
#[derive(Clone, Copy, Debug)]
pub(super) struct Grain {
    /// The body's contact modulus (Pa).
    modulus: f64,
    /// sigma^2 (m^2), along any one direction.
    variance: f64,
    /// The tool does not sink in deeper than this beside the elements (m).
    most: f64,
    /// How coarse the elements are against the tool, from 0 to 1: fine ones show all of it themselves.
    share: f64,
}

impl Grain {
    /// That of the body as stiff as it is now.
    pub(super) fn stiffened(self, stiffness: Stiffness) -> Self {
        Self { modulus: self.modulus * stiffness.factor(), ..self }
    }

    /// What a sphere of `radius` (m) touches under `force` (N), pi (3 F R / (4 E*))^(2/3) (m^2, Hertz 1882), and how much of that coarse
    /// elements leave to be told by it.
    pub(super) fn touched(&self, radius: f64, force: f64) -> (f64, f64) {
        // Never more than its section, however soft the body is.
        let reach = (0.75 * force * radius / self.modulus).cbrt().min(radius);
        (std::f64::consts::PI * reach * reach, self.share)
    }

    /// What a sphere of `radius` (m) sinks in beside the elements while `steady` (N) has pressed on the mean of the last
    /// milliseconds.
    pub(super) fn sinking(&self, radius: f64, steady: f64) -> Sinking {
        let shown = 1.0 / (2.0 * (std::f64::consts::PI * self.variance).sqrt() * self.modulus);
        let hertz = (9.0 / (16.0 * radius * self.modulus * self.modulus)).cbrt();
        // The elements lack most where they show the share s of the depth, 2 - 3 s - 4 c s^2 = 0.
        let at_turn = ((9.0 + 32.0 * CRUSHED).sqrt() - 3.0) / (8.0 * CRUSHED);
        let turn = (at_turn * hertz / shown).powi(3);
        // A stranger's stiffness may be beyond every body: nothing is known of what the elements lack.
        if ![shown, hertz, turn].iter().all(|figure| figure.is_finite()) {
            return Sinking { shown: 0.0, hertz: 0.0, turn: 0.0, share: 0.0, most: self.most };
        }
        let whole = Sinking { shown, hertz, turn, share: 1.0, most: self.most };
        let share = if steady > turn { (whole.beyond(steady) / whole.beyond(turn)).max(0.0) } else { 1.0 };
        Sinking { share: share * self.share, ..whole }
    }

    /// How much of a load at that squared distance (m^2) counts as one here.
    pub(super) fn nearness(&self, squared: f64) -> f64 {
        (1.0 - squared / (16.0 * self.variance)).max(0.0).powi(2)
    }
}

/// How deep a tool sinks in beside the elements, by its force: what they lack, up to where they lack most. Beyond, where they
/// show more and more of it, all of it fades with the steady force and not with that of one step: a depth that shrank under a
/// growing force would have no single answer.
#[derive(Clone, Copy, Debug)]
pub(super) struct Sinking {
    shown: f64,
    hertz: f64,
    turn: f64,
    share: f64,
    most: f64,
}

impl Sinking {
    /// The depth (m) under `force` (N); it grows with the force.
    pub(super) fn at(&self, force: f64) -> f64 {
        self.lacking(force) * self.bend(force)
    }

    /// The largest depth (m).
    pub(super) fn most(&self) -> f64 {
        self.at(self.turn)
    }

    /// The depth around `force` (N), as linear in it.
    pub(super) fn tangent(&self, force: f64) -> Sunk {
        if force >= self.turn {
            return Sunk { offset: self.most(), slope: 0.0 };
        }
        // At no force it would be infinitely steep.
        let force = force.max(1e-9 * self.turn);
        let root = force.cbrt();
        let crushed = 4.0 / 3.0 * CRUSHED * self.shown * (self.shown / self.hertz) * root;
        let slope = self.share * (2.0 / 3.0 * self.hertz / root - self.shown - crushed) * self.bend(force).powi(9);
        Sunk { offset: self.at(force) - slope * force, slope }
    }

    /// What the elements lack (m) under `force` (N).
    fn lacking(&self, force: f64) -> f64 {
        self.share * self.beyond(force.clamp(0.0, self.turn))
    }

    /// The same of elements that are coarse by all means, where they show more and more of it too.
    fn beyond(&self, force: f64) -> f64 {
        let [whole, shown] = [self.hertz * (force * force).cbrt(), self.shown * force];
        if shown == 0.0 { whole } else { whole - shown - CRUSHED * shown * (shown / whole) }
    }

    /// How much of that the tool sinks in: nearly all, but never as much as `most`. It comes near to that in a bend,
    /// x / (1 + (x / most)^8)^(1/8): at a corner the surface, which the tool has left behind, would have to keep up with it from one
    /// step to the next, and its inertia would be felt as a jump.
    fn bend(&self, force: f64) -> f64 {
        (1.0 + (self.lacking(force) / self.most).powi(8)).sqrt().sqrt().sqrt().recip()
    }
}

/// The mean of `of` over the triangles' other corners around a node, each as often as it is one; 0 for a node of no triangle.
fn mean_beside(surface: &Surface, node: u32, of: impl Fn(u32) -> f64) -> f64 {
    let corners = surface.at_node(node).iter().flat_map(|&t| surface.triangles[t as usize]);
    let others = corners.filter(|&other| other != node);
    let (sum, count) = others.fold((0.0, 0), |(sum, count), other| (sum + of(other), count + 1));
    sum / f64::from(count.max(1))
}

/// The mean edge at each node (m).
fn edges(surface: &Surface, rest: &[Vec3]) -> Vec<f64> {
    let length = |node: u32, other: u32| (rest[other as usize] - rest[node as usize]).norm();
    (0..rest.len() as u32).map(|node| mean_beside(surface, node, |other| length(node, other))).collect()
}

/// The same averaged over what is around each node.
fn averaged(surface: &Surface, mut edges: Vec<f64>) -> Vec<f64> {
    for _ in 0..ROUNDS {
        let around =
            |node: u32| 0.5 * (edges[node as usize] + mean_beside(surface, node, |other| edges[other as usize]));
        edges = (0..edges.len() as u32).map(around).collect();
    }
    edges
}

/// 0 below the first bound, 1 above the second, smooth in between.
fn ramp(value: f64, [low, high]: [f64; 2]) -> f64 {
    let share = ((value - low) / (high - low)).clamp(0.0, 1.0);
    share * share * (3.0 - 2.0 * share)
}

/// The unit normal at a node; zero where it has none.
fn normal_at(surface: &Surface, rest: &[Vec3], node: u32) -> Vec3 {
    let sum = surface.at_node(node).iter().fold(Vec3::zeros(), |sum, &t| {
        let [a, b, c] = surface.triangles[t as usize].map(|n| rest[n as usize]);
        sum + (b - a).cross(&(c - a))
    });
    let length = sum.norm();
    if length > 0.0 { sum / length } else { sum }
}

/// A depth that is linear in the force.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Sunk {
    /// Without a force (m).
    offset: f64,
    /// m/N.
    pub(super) slope: f64,
}

impl Sunk {
    /// The depth (m) under `force` (N).
    pub(super) fn at(&self, force: f64) -> f64 {
        self.offset + self.slope * force
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Of a sphere of 8 mm on elements of 9 mm and 16 kPa.
    fn sinking(steady: f64) -> Sinking {
        Grain { modulus: 16e3, variance: 64e-6, most: 3e-3, share: 1.0 }.sinking(8e-3, steady)
    }

    #[test]
    fn nothing_sinks_in_where_the_stiffness_is_beyond_every_body() {
        for modulus in [f64::INFINITY, 1e300, 1e-300, 5e-324] {
            let grain = Grain { modulus, variance: 64e-6, most: 3e-3, share: 1.0 };
            let sinking = grain.sinking(8e-3, 1.0);
            let Sunk { offset, slope } = sinking.tangent(1.0);
            assert_eq!([sinking.at(1.0), sinking.most(), offset, slope], [0.0; 4], "{modulus}");
        }
    }

    #[test]
    fn a_tool_sinks_in_deeper_under_more_force_and_less_where_elements_show_all_of_it() {
        let depths: Vec<f64> = (0..1000).map(|n| sinking(0.0).at(5e-3 * f64::from(n))).collect();
        assert!(depths.windows(2).all(|pair| pair[1] >= pair[0]) && depths[0] == 0.0);
        assert!((depths[60] - 2.3e-3).abs() < 2e-4, "{}", depths[60]);
        assert!(depths[999] <= 3e-3);
        // Under a steady force far beyond the turn the elements show all of it.
        assert_eq!(sinking(1e3).most(), 0.0);
    }

    /// Check that how fast it sinks in changes little by little: under 1 % more force by at most a tenth of the steepest where the
    /// most is near, and by nothing like that at once.
    #[test]
    fn a_tool_that_comes_near_to_the_most_does_not_stop_at_once() {
        let sinking = sinking(0.0);
        let slopes: Vec<f64> = (0..400).map(|n| sinking.tangent(0.05 * 1.01_f64.powi(n)).slope).collect();
        let largest = slopes.windows(2).map(|pair| (pair[0] - pair[1]) / pair[0]).fold(0.0, f64::max);
        assert!(slopes.windows(2).all(|pair| pair[1] <= pair[0]) && sinking.most() > 0.9 * 3e-3);
        assert!(largest < 0.1, "{largest}");
    }

    #[test]
    fn the_tangent_touches_the_depth_and_is_never_less() {
        let sinking = sinking(0.0);
        for n in 1..400 {
            let force = 1e-2 * f64::from(n);
            let tangent = sinking.tangent(force);
            assert!((tangent.at(force) - sinking.at(force)).abs() < 1e-15);
            assert!(
                (0..400).all(|m| tangent.at(1e-2 * f64::from(m)) >= sinking.at(1e-2 * f64::from(m)) - 1e-12),
                "{force}"
            );
        }
        assert!(sinking.tangent(0.0).offset.abs() < 1e-5);
    }
}
