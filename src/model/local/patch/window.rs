//! The part of a body that a patch holds, in compact numbering.

use crate::Vec3;
use crate::body::{Body, bounds};
use crate::contact::{Contact, Skin, Touch};
use crate::mesh::Surface;

/// A tool that presses more than this share of its force on nodes outside has left the patch, ...
const BEYOND: f64 = 0.02;
/// ... and so has one that would touch at more than this share of its places outside. What is at the rim presses less.
const UNMOVED: f64 = 0.1;

/// Patch nodes first; then, if the model asks for them, the other nodes of the body's restriction to the patch: the ring,
/// which can move, and held ones; then the rim: surface nodes that contact needs for normals and walking.
#[derive(Clone, Debug, Default)]
pub(in crate::local) struct Window {
    /// Global id of each local node.
    pub(in crate::local) nodes: Vec<u32>,
    /// How many of them the patch moves; they come first, in increasing order.
    pub(in crate::local) movable: usize,
    /// How many ring nodes follow, in increasing order; 0 if they were not asked for.
    pub(in crate::local) ring: usize,
    /// The surface over local nodes: every triangle that shares a node with one that the tool can press.
    pub(in crate::local) surface: Surface,
    /// Global id of each local triangle.
    pub(in crate::local) triangles: Vec<u32>,
    /// Local triangles with a movable node, and those around the centre: those that detection looks at.
    pub(in crate::local) candidates: Vec<u32>,
    /// By local node: true for those that give way in the body, but not here.
    beyond: Vec<bool>,
    /// Local place of each global node and triangle, or [`Surface::NONE`]; as long as the body, only touched entries change.
    local_node: Vec<u32>,
    local_triangle: Vec<u32>,
}

impl Window {
    /// Makes the window anew around surface triangles `triangles` for the nodes that `patch` gives, in increasing order, and
    /// those that `neighbours` gives for them, the ring and held ones, to be met with `skins`; costs as much as the patch, whatever the
    /// body.
    pub(in crate::local) fn rebuild<'a>(
        &mut self,
        body: &dyn Body,
        triangles: &[u32],
        skins: impl Iterator<Item = &'a Skin>,
        patch: impl FnOnce(&mut Vec<u32>),
        neighbours: impl FnOnce(&[u32]) -> [&'a [u32]; 2],
    ) {
        let whole = body.surface();
        self.forget();
        self.local_node.resize(body.rest().len(), Surface::NONE);
        self.local_triangle.resize(whole.triangles.len(), Surface::NONE);
        patch(&mut self.nodes);
        self.movable = self.nodes.len();
        for (place, &node) in self.nodes.iter().enumerate() {
            self.local_node[node as usize] = place as u32;
        }
        let [ring, held] = neighbours(&self.nodes);
        self.ring = ring.len();
        ring.iter().chain(held).for_each(|&node| self.add_node(node));
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
        // Corners of candidates as tools with a shape meet them.
        for skin in skins {
            for place in 0..3 * candidates {
                let node = whole.triangles[self.triangles[place / 3] as usize][place % 3];
                skin.corner(node).iter().for_each(|&(other, _)| self.add_node(other));
            }
        }
        self.candidates.clear();
        self.candidates.extend(0..candidates as u32);

        self.surface.triangles.clear();
        self.surface.neighbours.clear();
        for &t in &self.triangles {
            self.surface.triangles.push(whole.triangles[t as usize].map(|node| self.local_node[node as usize]));
            let local = |t: u32| if t == Surface::NONE { Surface::NONE } else { self.local_triangle[t as usize] };
            self.surface.neighbours.push(whole.neighbours[t as usize].map(local));
        }
        self.surface.index_nodes(self.nodes.len());

        let masses = body.inverse_masses();
        self.beyond.clear();
        self.beyond.resize(self.movable, false);
        self.beyond.extend(self.nodes[self.movable..].iter().map(|&node| masses[node as usize] > 0.0));
    }

    fn add_node(&mut self, node: u32) {
        if self.local_node[node as usize] == Surface::NONE {
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
        if self.local_triangle[triangle as usize] == Surface::NONE {
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
        self.nodes.drain(..).for_each(|node| self.local_node[node as usize] = Surface::NONE);
        self.triangles.drain(..).for_each(|t| self.local_triangle[t as usize] = Surface::NONE);
    }

    /// Local place of a global node.
    pub(in crate::local) fn node(&self, global: u32) -> Option<u32> {
        self.local_node.get(global as usize).copied().filter(|&place| place != Surface::NONE)
    }

    /// Local place of a global triangle.
    pub(in crate::local) fn triangle(&self, global: u32) -> Option<u32> {
        self.local_triangle.get(global as usize).copied().filter(|&place| place != Surface::NONE)
    }

    /// Place of a global node among the movable ones.
    pub(in crate::local) fn movable(&self, global: u32) -> Option<usize> {
        self.node(global).map(|place| place as usize).filter(|&place| place < self.movable)
    }

    /// The contact in local numbering. One outside the window cannot be followed here: detection starts anew.
    pub(in crate::local) fn localised(&self, contact: &Contact) -> Contact {
        match contact.triangle.and_then(|triangle| self.triangle(triangle)) {
            Some(triangle) => Contact { triangle: Some(triangle), ..*contact },
            None => Contact { glued: contact.glued, ..Contact::default() },
        }
    }

    /// The contact in the body's numbering.
    pub(in crate::local) fn globalised(&self, contact: &Contact) -> Contact {
        Contact { triangle: contact.triangle.map(|triangle| self.triangles[triangle as usize]), ..*contact }
    }

    /// True if a tool presses on nodes that give way in the body, but not here.
    pub(in crate::local) fn has_left(&self, touch: &Touch) -> bool {
        let beyond = |&&(node, _): &&(u32, Vec3)| self.beyond[node as usize];
        if touch.has_shape() {
            // The far ends of a smoothed corner bear next to nothing.
            let force = |sum: f64, (_, force): &(u32, Vec3)| sum + force.norm();
            let outside = touch.pressed().iter().filter(beyond).fold(0.0, force);
            return outside > BEYOND * touch.pressed().iter().fold(0.0, force)
                || touch.unmoved(|node| self.beyond[node as usize]) > UNMOVED;
        }
        let contact = &touch.contact;
        let touched = contact.triangle.filter(|_| contact.is_touching());
        touched.is_some_and(|t| self.surface.triangles[t as usize].iter().any(|&node| self.beyond[node as usize]))
    }

    /// Writes the inverse mass of each local node (1/kg), zero for those that the patch does not move.
    pub(in crate::local) fn gather_movable(&self, inverse_masses: &[f64], local: &mut Vec<f64>) {
        local.clear();
        local.extend(self.nodes[..self.movable].iter().map(|&node| inverse_masses[node as usize]));
        local.resize(self.nodes.len(), 0.0);
    }

    /// The diagonal of the box around the patch whose nodes are at `rest` (m).
    pub(in crate::local) fn extent(&self, rest: &[Vec3]) -> f64 {
        let [low, high] = bounds(self.nodes[..self.movable].iter().map(|&node| &rest[node as usize]));
        (high - low).norm()
    }

    /// Copies the window's share of a global array.
    pub(in crate::local) fn gather(&self, global: &[Vec3], local: &mut Vec<Vec3>) {
        local.clear();
        local.extend(self.nodes.iter().map(|&node| global[node as usize]));
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::body::Block;
    use crate::mesh::Face;

    /// A tool meets a corner that lacks a node nowhere near where it is.
    #[test]
    fn every_tool_finds_all_nodes_of_the_corners_that_it_may_meet() {
        let body = Block::builder([9; 3], [0.08; 3]).fix(Face::ZMin).build().unwrap();
        let skins = [Skin::default(), Skin::new(&body, 6e-3), Skin::new(&body, 1.2e-2)];
        let top = |&node: &u32| body.rest()[node as usize].z > 0.079;
        let patch: Vec<u32> = (0..body.rest().len() as u32).filter(top).skip(30).take(4).collect();
        let triangles: Vec<u32> = body.surface().at_node(patch[0]).to_vec();
        let mut window = Window::default();
        window.rebuild(&body, &triangles, skins.iter(), |nodes| nodes.extend(&patch), |_| [&[], &[]]);
        assert!(window.candidates.len() > triangles.len());
        for skin in &skins {
            let mut local = Skin::default();
            skin.localise(&window.nodes, |node| window.node(node), &mut local);
            for &triangle in &window.candidates {
                for corner in window.surface.triangles[triangle as usize] {
                    let global = skin.corner(window.nodes[corner as usize]);
                    assert_eq!(local.corner(corner).len(), global.len());
                }
            }
        }
    }
}
