//! Which nodes of the body a scene names.

use super::device::field;
use super::{BodySpec, InitialSpec, NodeSpec, Scene};
use crate::error::Error;
use crate::model::Vec3;
use crate::model::body::Body;
use crate::model::mesh::Lattice;

impl Scene {
    /// The node of `body` that the tool of the `index`-th device is glued to; `None` if it is not.
    ///
    /// # Errors
    /// [`ErrorKind::Scene`](crate::ErrorKind::Scene) if the body has no such node.
    pub fn glued_node(&self, index: usize, body: &dyn Body) -> Result<Option<u32>, Error> {
        let Some(node) = self.devices.get(index).and_then(|device| device.attach_node) else { return Ok(None) };
        let field = format!("{}.attach_node", field(index, self.devices.len()));
        self.surface_node(&field, node, body).map(Some)
    }

    /// The number of a node of the surface of `body`, which `field` names.
    ///
    /// # Errors
    /// [`ErrorKind::Scene`](crate::ErrorKind::Scene) if the body has no such node.
    pub fn surface_node(&self, field: &str, node: NodeSpec, body: &dyn Body) -> Result<u32, Error> {
        Nodes::of(body, self).of_surface(field, node)
    }
}

/// The nodes of a body, as a scene names them.
pub(crate) struct Nodes<'a> {
    body: &'a dyn Body,
    lattice: Option<Lattice>,
}

impl<'a> Nodes<'a> {
    pub(crate) fn of(body: &'a dyn Body, scene: &Scene) -> Self {
        let block = scene.body.as_ref().and_then(BodySpec::mass_spring);
        Self { body, lattice: block.map(|spec| Lattice { nodes: spec.block.nodes }) }
    }

    /// The number of `node`, which `field` names.
    ///
    /// # Errors
    /// If the body has no such node, or a point is nowhere near it.
    pub(crate) fn id(&self, field: &str, node: NodeSpec) -> Result<u32, Error> {
        self.among(field, node, &|_| true)
    }

    /// The same where a node of the surface is meant.
    ///
    /// # Errors
    /// As [`id`](Self::id).
    pub(crate) fn of_surface(&self, field: &str, node: NodeSpec) -> Result<u32, Error> {
        self.among(field, node, &|id| self.body.surface().has_node(id))
    }

    /// The nodes that an equilibrium holds, and where (m): first the one that is pulled.
    ///
    /// # Errors
    /// If one is not there, or the pulled one cannot move.
    pub(crate) fn held(&self, initial: &InitialSpec) -> Result<Vec<(u32, Vec3)>, Error> {
        const PULL: &str = "initial.pull.node";
        let rest = |id: u32| self.body.rest()[id as usize];
        let pulled = self.id(PULL, initial.pull.node)?;
        if self.body.inverse_masses()[pulled as usize] == 0.0 {
            return Err(Error::scene(PULL, format!("node {pulled} is held, it cannot be pulled")));
        }
        let mut held = vec![(pulled, rest(pulled) + Vec3::from(initial.pull.offset_m))];
        for &node in &initial.hold {
            let id = self.id("initial.hold", node)?;
            if id == pulled {
                let message = format!("node {id} is the pulled node, it cannot be held as well");
                return Err(Error::scene("initial.hold", message));
            }
            held.push((id, rest(id)));
        }
        Ok(held)
    }

    fn among(&self, field: &str, node: NodeSpec, is_meant: &dyn Fn(u32) -> bool) -> Result<u32, Error> {
        let nodes = self.body.rest().len() as u32;
        match node {
            NodeSpec::Lattice(place) => match self.lattice {
                Some(lattice) if (0..3).all(|axis| place[axis] < lattice.nodes[axis]) => Ok(lattice.id(place)),
                Some(_) => Err(Error::scene(field, format!("{place:?} is outside the body"))),
                None => Err(Error::scene(field, "is a place in a block, which the body is not")),
            },
            NodeSpec::Number(id) if id < nodes => Ok(id),
            NodeSpec::Number(id) => {
                let message = format!("node {id} is outside the body, nodes run from 0 to {}", nodes - 1);
                Err(Error::scene(field, message))
            }
            NodeSpec::Near { near_m } => self.nearest(field, near_m.into(), is_meant),
        }
    }

    /// The nearest of the nodes that are meant. A point that is farther away than the body is large has another unit.
    fn nearest(&self, field: &str, point: Vec3, is_meant: &dyn Fn(u32) -> bool) -> Result<u32, Error> {
        let rest = self.body.rest();
        let away_m = |id: u32| (rest[id as usize] - point).norm();
        let nearest =
            (0..rest.len() as u32).filter(|&id| is_meant(id)).min_by(|&a, &b| away_m(a).total_cmp(&away_m(b)));
        let size_m = rest.iter().map(|node| (node - rest[0]).norm()).fold(0.0, f64::max);
        match nearest {
            Some(id) if away_m(id) <= size_m => Ok(id),
            _ => {
                let (place, away_m): ([f64; 3], _) = (point.into(), nearest.map_or(f64::NAN, away_m));
                let message = format!("{place:?} m is {away_m:.3} m from the nearest node, is it in metres?");
                Err(Error::scene(field, message))
            }
        }
    }
}
