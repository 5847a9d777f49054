//! Which contacts of a scene are looked at.

use std::collections::BTreeMap;

use palpate::Error;
use palpate::model::Vec3;
use palpate::model::body::Body;
use palpate::model::mesh::{Face, Lattice};
use palpate::scene::{NodeSpec, Scene};

use crate::reduce::findings::FaceMap;

/// Without a wish, every node of the contact's face is looked at if there are no more than this.
const MANY_CONTACTS: usize = 150;
/// And so many of each other face.
const SOME_CONTACTS: usize = 25;
/// A node is seen from a side if the surface there is turned towards it by at least this (the cosine of 60 degrees).
const TURNED: f64 = 0.5;

/// The contact that stands for a scene: the node that the tool is glued to, else the one that it touches first, else the middle of the top.
pub(super) fn contact_node(
    scene: &Scene,
    (body, naming): (&dyn Body, &Naming),
    wish: Option<NodeSpec>,
) -> Result<u32, Error> {
    let glued = || scene.glued_node(0, body).map(|node| node.map(|node| ("device.attach_node", node)));
    let named = match wish {
        Some(node) => Some(("node", scene.surface_node("node", node, body)?)),
        None => glued()?,
    };
    match named {
        Some((field, id)) if !body.surface().has_node(id) || body.inverse_masses()[id as usize] == 0.0 => {
            Err(Error::scene(field, format!("{} is no node of the surface that can move", naming.node(id))))
        }
        Some((_, id)) => Ok(id),
        None => scene.first_touched(body).ok_or_else(|| Error::scene("body", "no node of the surface can move")),
    }
}

/// The outward normal of the surface at a node, the mean of its triangles'; upwards for one inside.
pub(super) fn outward(body: &dyn Body, node: u32) -> [f64; 3] {
    let (rest, surface) = (body.rest(), body.surface());
    let normal = |&triangle: &u32| {
        let [a, b, c] = surface.triangles[triangle as usize].map(|node| rest[node as usize]);
        (b - a).cross(&(c - a))
    };
    let sum: Vec3 = surface.at_node(node).iter().map(normal).sum();
    sum.try_normalize(0.0).unwrap_or(Vec3::z()).into()
}

/// The mean length of the surface's edges (m).
fn edge_m(body: &dyn Body) -> f64 {
    let rest = body.rest();
    let sides =
        |&[a, b, c]: &[u32; 3]| [[a, b], [b, c], [c, a]].map(|[a, b]| (rest[b as usize] - rest[a as usize]).norm());
    let lengths: Vec<f64> = body.surface().triangles.iter().flat_map(sides).collect();
    lengths.iter().sum::<f64>() / lengths.len().max(1) as f64
}

/// A body's nodes as reports name them, and how far apart they are.
#[derive(Clone, Copy, Debug)]
pub(super) struct Naming {
    lattice: Option<Lattice>,
    /// Distance of neighbouring nodes along each axis (m).
    pub(super) spacing_m: [f64; 3],
}

impl Naming {
    /// Of the `body` of a scene.
    pub(super) fn of(scene: &Scene, body: &dyn Body) -> Self {
        let block = scene.body.as_ref().and_then(|spec| spec.mass_spring()).map(|spec| &spec.block);
        let spacing_m = match block {
            Some(block) => std::array::from_fn(|axis| block.size_m[axis] / (block.nodes[axis] - 1) as f64),
            None => [edge_m(body); 3],
        };
        Self { lattice: block.map(|block| Lattice { nodes: block.nodes }), spacing_m }
    }

    /// A node in words.
    pub(super) fn node(&self, node: u32) -> String {
        match self.lattice {
            Some(lattice) => format!("node {:?}", lattice.coordinates(node)),
            None => format!("node {node}"),
        }
    }

    /// True if a patch of `size` is not larger than the body.
    pub(super) fn has_room(&self, size: [usize; 3]) -> bool {
        self.lattice.is_none_or(|lattice| (0..3).all(|axis| size[axis] <= lattice.nodes[axis]))
    }
}

/// Contacts of a body as they are seen from one side, on a grid of places.
#[derive(Debug)]
pub(super) struct ContactGrid {
    pub(super) face: Face,
    axes: [usize; 2],
    places_m: [Vec<f64>; 2],
    ends_m: [[f64; 2]; 2],
    /// The node at each pair of places, the first axis fastest.
    pub(super) nodes: Vec<Option<u32>>,
}

impl ContactGrid {
    /// The sides of `body` that can move, each at every `every`-th node; without, closely where the contact at `node` is.
    pub(super) fn all(body: &dyn Body, naming: &Naming, every: Option<usize>, node: u32) -> Vec<Self> {
        let is_movable = |node: &u32| body.inverse_masses()[*node as usize] > 0.0;
        let grid = |face: Face| {
            let of = |every: usize| match naming.lattice {
                Some(lattice) => Self::of_lattice(body, face, lattice, every),
                None => Self::seen(body, face, every as f64 * naming.spacing_m[0]),
            };
            match every {
                Some(every) => Some(of(every.max(1))),
                None => (1..).map(of).find(|grid| {
                    let is_touched = grid.seen_at(body, node);
                    grid.nodes.iter().flatten().count() <= if is_touched { MANY_CONTACTS } else { SOME_CONTACTS }
                }),
            }
        };
        let grids = Face::ALL.into_iter().filter_map(grid);
        grids.filter(|grid| grid.nodes.iter().flatten().any(is_movable)).collect()
    }

    fn axes(face: Face) -> [usize; 2] {
        match face.axis() {
            0 => [1, 2],
            1 => [0, 2],
            _ => [0, 1],
        }
    }

    /// True if `node` faces this side, whether it is one of the grid's or between them.
    fn seen_at(&self, body: &dyn Body, node: u32) -> bool {
        side_of(body, node, self.face) >= TURNED
    }

    /// Every so many nodes of the face of a block, both ends among them.
    fn of_lattice(body: &dyn Body, face: Face, lattice: Lattice, every: usize) -> Self {
        let axes = Self::axes(face);
        let places = axes.map(|axis| {
            let last = lattice.nodes[axis] - 1;
            let count = last.div_ceil(every).max(1);
            (0..=count).map(|n| (2 * n * last + count) / (2 * count)).collect::<Vec<usize>>()
        });
        let across = if face.is_max() { lattice.nodes[face.axis()] - 1 } else { 0 };
        let id = |a: usize, b: usize| {
            let mut at = [0; 3];
            (at[face.axis()], at[axes[0]], at[axes[1]]) = (across, a, b);
            lattice.id(at)
        };
        let at = |axis: usize, node: u32| body.rest()[node as usize][axis];
        let places_m = [
            places[0].iter().map(|&a| at(axes[0], id(a, 0))).collect(),
            places[1].iter().map(|&b| at(axes[1], id(0, b))).collect(),
        ];
        // The outer nodes are the body's edges.
        let ends_m = places_m.each_ref().map(|places: &Vec<f64>| [places[0], places[places.len() - 1]]);
        let nodes = places[1].iter().flat_map(|&b| places[0].iter().map(move |&a| Some(id(a, b))));
        Self { face, axes, places_m, ends_m, nodes: nodes.collect() }
    }

    /// What is seen of any body from a side through a grid of `width` (m): in each cell the outermost node that faces it.
    fn seen(body: &dyn Body, face: Face, width: f64) -> Self {
        let (axes, rest) = (Self::axes(face), body.rest());
        let on_surface = || (0..rest.len() as u32).filter(|&node| body.surface().has_node(node));
        let end = |axis: usize, of: fn(f64, f64) -> f64, first: f64| {
            on_surface().map(|node| rest[node as usize][axis]).fold(first, of)
        };
        let low = axes.map(|axis| end(axis, f64::min, f64::INFINITY));
        let high = axes.map(|axis| end(axis, f64::max, f64::NEG_INFINITY));
        let cells: [usize; 2] = [0, 1].map(|n| ((high[n] - low[n]) / width).ceil().max(1.0) as usize);
        let cell =
            |node: u32| [0, 1].map(|n| (((rest[node as usize][axes[n]] - low[n]) / width) as usize).min(cells[n] - 1));
        let sign = if face.is_max() { 1.0 } else { -1.0 };
        let height = |node: u32| sign * rest[node as usize][face.axis()];
        let mut outermost: BTreeMap<[usize; 2], u32> = BTreeMap::new();
        for node in on_surface().filter(|&node| side_of(body, node, face) >= TURNED) {
            let seen = outermost.entry(cell(node)).or_insert(node);
            if height(node) > height(*seen) {
                *seen = node;
            }
        }
        let middle = |n: usize| (0..cells[n]).map(|at| low[n] + (at as f64 + 0.5) * width).collect();
        let nodes = (0..cells[1]).flat_map(|b| (0..cells[0]).map(move |a| [a, b]));
        let nodes = nodes.map(|at| outermost.get(&at).copied()).collect();
        let ends_m = [0, 1].map(|n| [low[n], high[n]]);
        Self { face, axes, places_m: [middle(0), middle(1)], ends_m, nodes }
    }

    /// An empty map of these contacts.
    pub(super) fn map(self) -> FaceMap {
        let [first_m, second_m] = self.places_m;
        FaceMap {
            face: self.face.name().to_owned(),
            axes: self.axes.map(|axis| ["x", "y", "z"][axis].to_owned()),
            first_m,
            second_m,
            ends_m: self.ends_m,
            contacts: Vec::new(),
        }
    }
}

/// How far the surface at `node` is turned towards a side: the cosine of the angle.
fn side_of(body: &dyn Body, node: u32, face: Face) -> f64 {
    let sign = if face.is_max() { 1.0 } else { -1.0 };
    sign * outward(body, node)[face.axis()]
}

#[cfg(test)]
mod tests {
    use super::*;
    use palpate::scene::BuiltIn;

    // Check a body whose contacts are in the middles of a grid's cells, not at its ends.
    #[test]
    fn a_map_ends_where_the_body_does() {
        let scene = BuiltIn::named("liver").unwrap().load();
        let body = scene.body.as_ref().unwrap().build().unwrap();
        let naming = Naming::of(&scene, &*body);
        let rest = body.rest();
        for grid in ContactGrid::all(&*body, &naming, Some(4), 0) {
            let axes = grid.axes;
            let map = grid.map();
            for (axis, (places, [from, to])) in
                axes.into_iter().zip([&map.first_m, &map.second_m].into_iter().zip(map.ends_m))
            {
                assert!(rest.iter().all(|x| (from..=to).contains(&x[axis])), "{}: {from} to {to}", map.face);
                assert!(from < places[0] && (places.len() == 1 || places[places.len() - 2] < to), "{}", map.face);
            }
        }
    }
}
