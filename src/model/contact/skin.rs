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
//! momentum is kept to the last digit. c is 2.8 edges, and goes to zero (y_k = x_k) towards sharp edges of the body. Under a tool
//! that touches much more than an edge is long each corner goes to its node, 1 - f of the way back to y_k: there the tool meets
//! [many corners](super::corners), and how fine the elements are, f, hangs on its [steady force](super::steady::Steady).

use super::grain::{COARSE, Grain, ramp};
use super::steady::Steady;
use crate::Vec3;
use crate::body::Body;
use crate::mesh::Surface;

/// c, in mean edges at the node.
const REACH: f64 = 2.8;
/// Nodes farther away than this share of c would count next to nothing.
const CUT: f64 = 0.91;
/// Edges, in tool radii, below which nothing is smoothed, and above which all of it is, on a body whose contact modulus is not known:
/// what is touched of it is not known either.
const EDGES: [f64; 2] = [0.235, 0.245];
/// Rounds in which edges are averaged over neighbours to say how fine they are: a tool meets all of the surface around it in one way, as it
/// would feel the border between smoothed corners and others.
const ROUNDS: usize = 8;
/// The least cosine between a node's normal and those of its triangles, at a sharp edge and on a smooth surface.
const COSINES: [f64; 2] = [0.75, 0.95];
/// How far an element by itself spreads a load on its node, squared, in squared edges.
const ELEMENT: f64 = 0.04;
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
    /// The mean edge of the body's triangles (m).
    mean_edge: f64,
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
            let coarse = if moduli.is_empty() { ramp(around[node as usize] / radius, EDGES) } else { 1.0 };
            let sigma = corner((surface, rest, &normals), node, [edge, coarse], &mut found);
            longest = longest.max(edge);
            if let Some(&modulus) = moduli.get(node as usize) {
                grains.push(Grain {
                    modulus,
                    variance: sigma * sigma + ELEMENT * edge * edge,
                    most: MOST_SUNK * edge,
                    edge: around[node as usize],
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
        let sides = surface.triangles.iter().flat_map(|&[a, b, c]| [[a, b], [b, c], [c, a]]);
        let sum: f64 = sides.map(|[a, b]| (rest[a as usize] - rest[b as usize]).norm()).sum();
        let mean_edge = sum / (3 * surface.triangles.len()).max(1) as f64;
        Self { starts, shares, depths, grains, mean_edge, stretch, reach }
    }

    /// How coarse the surface is for the tool, of `radius` (m).
    pub(crate) fn coarseness(&self, body: &dyn Body, radius: f64) -> Coarseness {
        let surface = body.surface();
        let nodes = || (0..body.rest().len() as u32).filter(|&node| !surface.at_node(node).is_empty());
        let smoothed = nodes().filter(|&node| !self.corner(node).is_empty()).count();
        let finest = nodes().filter_map(|node| Some(self.grains.get(node as usize)?.edge)).reduce(f64::min);
        Coarseness {
            edge: self.mean_edge,
            smoothed: smoothed as f64 / nodes().count().max(1) as f64,
            fine_from: finest.filter(|edge| *edge < COARSE[0] * radius).map(|edge| Steady::FINE * edge),
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

    /// Calls `visit` for the nodes that make the corner of `node` where elements are so `fine` (0 to 1), with their shares.
    pub(super) fn each_share(&self, node: u32, fine: f64, mut visit: impl FnMut(u32, f64)) {
        let corner = if fine < 1.0 { self.corner(node) } else { &[] };
        corner.iter().for_each(|&(other, share)| visit(other, share * (1.0 - fine)));
        let own = if corner.is_empty() { 1.0 } else { fine };
        if own > 0.0 {
            visit(node, own);
        }
    }

    /// The grain of the body at `weights` of three nodes, which are at `places` (m), if it is known.
    pub(super) fn grain(&self, nodes: [u32; 3], weights: &[f64; 3], places: &[Vec3; 3]) -> Option<Grain> {
        let mut mean = Grain { modulus: 0.0, variance: 0.0, most: 0.0, edge: 0.0 };
        for (node, weight) in nodes.into_iter().zip(weights) {
            let grain = self.grains.get(node as usize)?;
            mean.modulus += grain.modulus * weight;
            mean.variance += grain.variance * weight;
            mean.most += grain.most * weight;
            mean.edge += grain.edge * weight;
        }
        // What is shared by several corners is spread as far as they are apart: over the middle of a face the elements give way less
        // than over a node.
        for [i, j] in [[0, 1], [1, 2], [2, 0]] {
            mean.variance += 0.5 * weights[i] * weights[j] * (places[i] - places[j]).norm_squared();
        }
        (mean.modulus > 0.0).then_some(mean)
    }

    /// The mean edge of the body's triangles (m).
    pub(super) fn mean_edge(&self) -> f64 {
        self.mean_edge
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

    /// The mean edge around `node` (m); zero if the body's contact modulus is not known.
    pub(super) fn edge(&self, node: usize) -> f64 {
        self.grains.get(node).map_or(0.0, |grain| grain.edge)
    }

    /// That of a window: `nodes` are the ids of its nodes here, `place` gives the place of an id. Nodes whose corner is made of
    /// others than these are corners of no triangle that is looked at.
    pub(crate) fn localise(&self, nodes: &[u32], place: impl Fn(u32) -> Option<u32>, local: &mut Self) {
        local.starts.clear();
        local.shares.clear();
        local.depths.clear();
        local.grains.clear();
        (local.mean_edge, local.stretch, local.reach) = (self.mean_edge, self.stretch, self.reach);
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
    /// Where the surface is finest and the tool touches more than so far around (m, radius), elements are fine and it meets each corner at
    /// its node; `None` if they are coarse or fine whatever it touches.
    pub fine_from: Option<f64>,
    /// True if the tool sinks in beside the elements as deep as they cannot show.
    pub sinks: bool,
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

/// The unit normal at a node; zero where it has none.
fn normal_at(surface: &Surface, rest: &[Vec3], node: u32) -> Vec3 {
    let sum = surface.at_node(node).iter().fold(Vec3::zeros(), |sum, &t| {
        let [a, b, c] = surface.triangles[t as usize].map(|n| rest[n as usize]);
        sum + (b - a).cross(&(c - a))
    });
    let length = sum.norm();
    if length > 0.0 { sum / length } else { sum }
}
