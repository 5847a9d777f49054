//! The part of a body of tetrahedra that depends on some of its nodes.

use std::collections::HashMap;

use super::element::Element;
use super::solid::Solid;
use super::{Tetrahedra, Tissue};
use crate::body::Restriction;
use crate::body::kernel::TetrahedraKernel;
use crate::mesh::{LeftOut, Surface, TetrahedralMesh};

impl Tetrahedra {
    /// All terms of the energy that depend on `nodes`: the elements that touch them, and with average pressures the averages of
    /// these elements' nodes. Those hang on one more ring of elements, which have nothing but a volume; nodes of that ring
    /// that touch none of `nodes`' elements have no average.
    pub(super) fn restricted(&self, nodes: &[u32]) -> Restriction {
        let solid = &self.solid;
        let full = solid.touching(nodes);
        let ring = solid.corners(&full);
        let elements = if solid.inverse_volumes.is_some() { solid.touching(&ring) } else { full.clone() };
        let order = Restriction::order(nodes, solid.corners(&elements), &self.inverse_masses);

        let place: HashMap<u32, u32> = order.iter().copied().zip(0..).collect();
        let part: Vec<Element> = elements
            .iter()
            .map(|number| {
                let whole = &solid.elements[*number as usize];
                let element = Element { nodes: whole.nodes.map(|node| place[&node]), ..*whole };
                match full.binary_search(number) {
                    Ok(_) => element,
                    Err(_) => Element { shear_modulus: 0.0, viscosity: 0.0, ..element },
                }
            })
            .collect();
        let inverse_volume = |all: &Vec<f64>, node: &u32| match ring.binary_search(node) {
            Ok(_) => all[*node as usize],
            Err(_) => 0.0,
        };
        let inverse_volumes: Option<Vec<f64>> =
            solid.inverse_volumes.as_ref().map(|all| order.iter().map(|node| inverse_volume(all, node)).collect());
        let tissues: Vec<Tissue> = elements.iter().map(|&element| self.tissues[element as usize]).collect();
        let mesh = TetrahedralMesh {
            points: order.iter().map(|&node| self.mesh.points[node as usize]).collect(),
            tetrahedra: part.iter().map(|element| element.nodes).collect(),
            groups: Vec::new(),
        };
        let body = Self {
            surface: Surface::default(),
            kernel: TetrahedraKernel::new(order.len(), &part, inverse_volumes.as_deref()),
            stiffening: self.stiffening.of_part(order.len()),
            volume: part.iter().map(|element| element.volume).sum(),
            solid: Solid::new(order.len(), part, inverse_volumes),
            inverse_masses: order.iter().map(|&node| self.inverse_masses[node as usize]).collect(),
            left_out: LeftOut::default(),
            mesh,
            tissues,
        };
        Restriction { nodes: order, body: Box::new(body) }
    }
}
