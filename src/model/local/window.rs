//! The part of a body that a local model holds: its nodes, and the surface around them, in compact numbering.

use crate::Vec3;
use crate::body::Body;
use crate::contact::Contact;
use crate::mesh::{NONE, Surface};
use crate::surroundings::SpringGraph;

/// Patch nodes first; then, if the model asks for them, the nodes that a spring joins to the patch: the ring, which can
/// move, and held ones; then the rim: surface nodes that contact needs for normals and walking.
#[derive(Clone, Debug, Default)]
pub(super) struct Window {
    /// Global id of each local node.
    pub nodes: Vec<u32>,
    /// How many of them the patch moves; they come first, in increasing order.
    pub movable: usize,
    /// How many ring nodes follow, in increasing order; 0 if they were not asked for.
    pub ring: usize,
    /// The surface over local nodes: every triangle that shares a node with one that the tool can press.
    pub surface: Surface,
    /// Global id of each local triangle.
    pub triangles: Vec<u32>,
    /// Local triangles with a movable node, and those around the centre: those that detection looks at.
    pub candidates: Vec<u32>,
    /// By local node: true for those that give way in the body, but not here.
    beyond: Vec<bool>,
    /// Local place of each global node and triangle, or [`NONE`]; as long as the body, only touched entries change.
    local_node: Vec<u32>,
    local_triangle: Vec<u32>,
    /// Of the patch: the ring, and held nodes.
    neighbours: [Vec<u32>; 2],
}

impl Window {
    /// Makes the window anew around surface triangles `triangles` for the nodes that `patch` gives, in increasing order, with
    /// the ring if `springs` are given; costs as much as the patch, whatever the body.
    pub(super) fn rebuild(
        &mut self,
        body: &dyn Body,
        triangles: &[u32],
        springs: Option<&SpringGraph>,
        patch: impl FnOnce(&mut Vec<u32>),
    ) {
        let whole = body.surface();
        self.forget();
        self.local_node.resize(body.rest().len(), NONE);
        self.local_triangle.resize(whole.triangles.len(), NONE);
        patch(&mut self.nodes);
        self.movable = self.nodes.len();
        for (place, &node) in self.nodes.iter().enumerate() {
            self.local_node[node as usize] = place as u32;
        }
        self.neighbours.iter_mut().for_each(Vec::clear);
        if let Some(springs) = springs {
            let [ring, held] = &mut self.neighbours;
            springs.neighbours(&self.nodes, ring, held);
        }
        self.ring = self.neighbours[0].len();
        for list in 0..self.neighbours.len() {
            for place in 0..self.neighbours[list].len() {
                self.add_node(self.neighbours[list][place]);
            }
        }
        // On a held face nothing moves, but the tool is to be found there too.
        for &triangle in triangles {
            for node in whole.triangles[triangle as usize] {
                self.add_node(node);
            }
        }
        // First the triangles of movable nodes and those asked for (the candidates), then those around their corners (for
        // normals).
        self.grow(whole, 0..self.movable);
        for &triangle in triangles {
            self.add_triangle(triangle);
        }
        let candidates = self.triangles.len();
        let corners: Vec<u32> = self.triangles.iter().flat_map(|&t| whole.triangles[t as usize]).collect();
        for node in corners {
            self.add_triangles(whole, node);
        }
        self.add_corners(whole, candidates);
        self.candidates.clear();
        self.candidates.extend(0..candidates as u32);

        self.surface.triangles.clear();
        self.surface.neighbours.clear();
        for &t in &self.triangles {
            self.surface.triangles.push(whole.triangles[t as usize].map(|node| self.local_node[node as usize]));
            let local = |t: u32| if t == NONE { NONE } else { self.local_triangle[t as usize] };
            self.surface.neighbours.push(whole.neighbours[t as usize].map(local));
        }
        self.surface.index_nodes(self.nodes.len());

        let masses = body.inverse_masses();
        self.beyond.clear();
        self.beyond.resize(self.movable, false);
        self.beyond.extend(self.nodes[self.movable..].iter().map(|&node| masses[node as usize] > 0.0));
    }

    fn add_node(&mut self, node: u32) {
        if self.local_node[node as usize] == NONE {
            self.local_node[node as usize] = self.nodes.len() as u32;
            self.nodes.push(node);
        }
    }

    /// Adds the triangles at the nodes of `places`, and then their missing corners.
    fn grow(&mut self, whole: &Surface, places: std::ops::Range<usize>) {
        let start = self.triangles.len();
        for place in places {
            self.add_triangles(whole, self.nodes[place]);
        }
        self.add_corners(whole, start);
    }

    fn add_triangles(&mut self, whole: &Surface, node: u32) {
        for &t in whole.at_node(node) {
            self.add_triangle(t);
        }
    }

    fn add_triangle(&mut self, triangle: u32) {
        if self.local_triangle[triangle as usize] == NONE {
            self.local_triangle[triangle as usize] = self.triangles.len() as u32;
            self.triangles.push(triangle);
        }
    }

    fn add_corners(&mut self, whole: &Surface, start: usize) {
        for place in start..self.triangles.len() {
            for node in whole.triangles[self.triangles[place] as usize] {
                self.add_node(node);
            }
        }
    }

    fn forget(&mut self) {
        self.nodes.drain(..).for_each(|node| self.local_node[node as usize] = NONE);
        self.triangles.drain(..).for_each(|t| self.local_triangle[t as usize] = NONE);
    }

    /// Local place of a global node.
    pub(super) fn node(&self, global: u32) -> Option<u32> {
        self.local_node.get(global as usize).copied().filter(|&place| place != NONE)
    }

    /// Local place of a global triangle.
    pub(super) fn triangle(&self, global: u32) -> Option<u32> {
        self.local_triangle.get(global as usize).copied().filter(|&place| place != NONE)
    }

    /// Place of a global node among the movable ones.
    pub(super) fn movable(&self, global: u32) -> Option<usize> {
        self.node(global).map(|place| place as usize).filter(|&place| place < self.movable)
    }

    /// The contact in local numbering. One outside the window cannot be followed here: detection starts anew.
    pub(super) fn localised(&self, contact: &Contact) -> Contact {
        match contact.triangle.and_then(|triangle| self.triangle(triangle)) {
            Some(triangle) => Contact { triangle: Some(triangle), ..*contact },
            None => Contact { glued: contact.glued, ..Contact::default() },
        }
    }

    /// The contact in the body's numbering.
    pub(super) fn globalised(&self, contact: &Contact) -> Contact {
        Contact { triangle: contact.triangle.map(|triangle| self.triangles[triangle as usize]), ..*contact }
    }

    /// True if `contact`, in local numbering, presses on a node that gives way in the body, but not here.
    pub(super) fn has_left(&self, contact: &Contact) -> bool {
        let touched = contact.triangle.filter(|_| contact.is_touching());
        touched.is_some_and(|t| self.surface.triangles[t as usize].iter().any(|&node| self.beyond[node as usize]))
    }

    /// Writes the inverse mass of each local node (1/kg), zero for those that the patch does not move.
    pub(super) fn gather_movable(&self, inverse_masses: &[f64], local: &mut Vec<f64>) {
        local.clear();
        local.extend(self.nodes[..self.movable].iter().map(|&node| inverse_masses[node as usize]));
        local.resize(self.nodes.len(), 0.0);
    }

    /// Copies the window's share of a global array.
    pub(super) fn gather(&self, global: &[Vec3], local: &mut Vec<Vec3>) {
        local.clear();
        local.extend(self.nodes.iter().map(|&node| global[node as usize]));
    }
}
