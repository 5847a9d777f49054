//! A body cut out of a larger one: some of its nodes with all that pulls at them, and a rim that does not give way.

use std::collections::HashMap;

use super::{Body, Restriction, State, TangentBlock};
use crate::Vec3;
use crate::mesh::Surface;

/// Some nodes of a body as a body of its own: they move as they do in the whole one as long as the nodes around them, its rim, do what
/// they do there. What runs ahead in place of the whole body is one.
#[derive(Debug)]
pub struct Cutout {
    /// The id that each node of `body` has in the whole one.
    pub nodes: Vec<u32>,
    /// The id that each triangle of its surface has in the whole one's, in increasing order: those whose corners are all there.
    pub triangles: Vec<u32>,
    /// The part, in the numbering of `nodes` and `triangles`. All nodes but those that were asked for are held.
    pub body: Box<dyn Body>,
}

impl Cutout {
    /// The nodes `asked` of `whole`, by its restriction to them; `None` if it has none.
    pub(super) fn of(whole: &(impl Body + ?Sized), asked: &[u32]) -> Option<Self> {
        let Restriction { nodes, body } = whole.restriction(asked)?;
        let (surface, triangles) = part_of(whole.surface(), &nodes);
        let mut inverse_masses = body.inverse_masses().to_vec();
        inverse_masses[asked.len()..].fill(0.0);
        Some(Self { nodes, triangles, body: Box::new(Part { body, inverse_masses, surface }) })
    }
}

/// The triangles of a surface between `nodes`, in the numbering of these, and their ids.
pub(super) fn part_of(surface: &Surface, nodes: &[u32]) -> (Surface, Vec<u32>) {
    let place: HashMap<u32, u32> = nodes.iter().copied().zip(0..).collect();
    let corners = |triangle: u32| surface.triangles[triangle as usize].map(|node| place.get(&node).copied());
    let is_there = |&triangle: &u32| corners(triangle).iter().all(Option::is_some);
    let mut triangles: Vec<u32> =
        nodes.iter().flat_map(|&node| surface.at_node(node)).copied().filter(is_there).collect();
    triangles.sort_unstable();
    triangles.dedup();
    let local = |triangle: u32| triangles.binary_search(&triangle).map_or(Surface::NONE, |place| place as u32);
    let mut part = Surface::default();
    part.triangles = triangles.iter().map(|&t| corners(t).map(|corner| corner.unwrap_or(Surface::NONE))).collect();
    part.neighbours = triangles.iter().map(|&t| surface.neighbours[t as usize].map(local)).collect();
    part.index_nodes(nodes.len());
    (part, triangles)
}

/// A restriction whose rim is held, with a surface.
#[derive(Debug)]
struct Part {
    body: Box<dyn Body>,
    inverse_masses: Vec<f64>,
    surface: Surface,
}

impl Body for Part {
    fn rest(&self) -> &[Vec3] {
        self.body.rest()
    }

    fn inverse_masses(&self) -> &[f64] {
        &self.inverse_masses
    }

    fn surface(&self) -> &Surface {
        &self.surface
    }

    fn forces(&mut self, state: &State, forces: &mut [Vec3]) {
        self.body.forces(state, forces);
    }

    fn stable_share(&mut self, state: &State) -> f64 {
        self.body.stable_share(state)
    }

    fn node_forces(&self, state: &State, nodes: &[u32], forces: &mut [Vec3]) {
        self.body.node_forces(state, nodes, forces);
    }

    fn tangent(&self, state: &State, nodes: &[u32], clamp: bool, emit: &mut dyn FnMut(TangentBlock)) {
        self.body.tangent(state, nodes, clamp, emit);
    }

    fn restriction(&self, nodes: &[u32]) -> Option<Restriction> {
        self.body.restriction(nodes)
    }
}
