//! Which contacts of a scene are looked at.

use palpate::Error;
use palpate::model::body::{Block, Body};
use palpate::model::mesh::{Face, Lattice};
use palpate::scene::Scene;

use crate::reduce::findings::FaceMap;

/// Without a wish, every node of the contact's face is looked at if there are no more than this.
const MANY_CONTACTS: usize = 150;
/// And so many of each other face.
const SOME_CONTACTS: usize = 25;

/// The contact that stands for a scene: the node that the tool is glued to, else the one that it touches first, else the middle of the top.
pub(super) fn contact_node(scene: &Scene, block: &Block, wish: Option<[usize; 3]>) -> Result<u32, Error> {
    let lattice = block.lattice();
    let glued = scene.glued_node(0, block)?.map(|id| ("device.attach_node", lattice.coordinates(id)));
    let named = wish.map(|node| ("node", node)).or(glued);
    if let Some((field, node)) = named {
        let inside = (0..3).all(|axis| node[axis] < lattice.nodes[axis]);
        let id = if inside { lattice.id(node) } else { u32::MAX };
        if !inside || !block.surface().has_node(id) || block.inverse_masses()[id as usize] == 0.0 {
            return Err(Error::scene(field, format!("{node:?} is no node of the surface that can move")));
        }
        return Ok(id);
    }
    scene.first_touched(block).ok_or_else(|| Error::scene("body.block.fixed", "no node of the surface can move"))
}

/// The outward direction of the face that a node lies on; the top's for one inside.
pub(super) fn outward(block: &Block, node: u32) -> [f64; 3] {
    let at = block.lattice().coordinates(node);
    let faces = [Face::ZMax, Face::YMax, Face::YMin, Face::XMax, Face::XMin, Face::ZMin];
    let face = faces.into_iter().find(|face| face.holds(at, block.lattice().nodes)).unwrap_or(Face::ZMax);
    let mut direction = [0.0; 3];
    direction[face.axis()] = if face.is_max() { 1.0 } else { -1.0 };
    direction
}

/// The nodes of a face on a grid of every so many nodes, both ends among them.
#[derive(Debug)]
pub(super) struct FaceGrid {
    pub(super) face: Face,
    axes: [usize; 2],
    places: [Vec<usize>; 2],
    lattice: Lattice,
}

impl FaceGrid {
    /// The faces of `block` that can move, each with every `every`-th node; without, closely where the contact at `node` is.
    pub(super) fn all(block: &Block, every: Option<usize>, node: u32) -> Vec<Self> {
        let lattice = block.lattice();
        let touched = lattice.coordinates(node);
        let grid = |face: Face| {
            let many = if face.holds(touched, lattice.nodes) { MANY_CONTACTS } else { SOME_CONTACTS };
            let of = |every: usize| Self::new(face, lattice, every);
            match every {
                Some(every) => Some(of(every.max(1))),
                None => (1..).map(of).find(|grid| grid.nodes().count() <= many),
            }
        };
        let grids = Face::ALL.into_iter().filter_map(grid);
        grids.filter(|grid| grid.nodes().any(|node| block.inverse_masses()[node as usize] > 0.0)).collect()
    }

    fn new(face: Face, lattice: Lattice, every: usize) -> Self {
        let axes = match face.axis() {
            0 => [1, 2],
            1 => [0, 2],
            _ => [0, 1],
        };
        let places = axes.map(|axis| {
            let last = lattice.nodes[axis] - 1;
            let count = last.div_ceil(every).max(1);
            (0..=count).map(|n| (2 * n * last + count) / (2 * count)).collect()
        });
        Self { face, axes, places, lattice }
    }

    /// Ids of the nodes, the first axis fastest.
    pub(super) fn nodes(&self) -> impl Iterator<Item = u32> {
        let across = if self.face.is_max() { self.lattice.nodes[self.face.axis()] - 1 } else { 0 };
        let pairs = self.places[1].iter().flat_map(move |&b| self.places[0].iter().map(move |&a| (a, b)));
        pairs.map(move |(a, b)| {
            let mut at = [0; 3];
            (at[self.face.axis()], at[self.axes[0]], at[self.axes[1]]) = (across, a, b);
            self.lattice.id(at)
        })
    }

    /// An empty map of these contacts.
    pub(super) fn map(&self, block: &Block) -> FaceMap {
        let along = |which: usize| {
            let axis = self.axes[which];
            let rest = |&n: &usize| {
                let mut at = [0; 3];
                at[axis] = n;
                block.rest()[self.lattice.id(at) as usize][axis]
            };
            self.places[which].iter().map(rest).collect()
        };
        FaceMap {
            face: self.face.name().to_owned(),
            axes: self.axes.map(|axis| ["x", "y", "z"][axis].to_owned()),
            first_m: along(0),
            second_m: along(1),
            contacts: Vec::new(),
        }
    }
}
