//! How much shorter the stable step of a crushed body is.
//!
//! A nearly incompressible body is as stiff as its pressures answer to its volumes. With average nodal pressure their part of the
//! linearisation is a sum over nodes, w^2 = lambda/4 M^-1 sum h h^T / V, h the gradients of the volumes around the node by the positions.
//! These are areas, and grow where elements are flattened. The largest term of one node follows the largest eigenvalue closely: on
//! spheres that were pressed 4 to 12 mm deep into tissue with a Poisson's ratio of 0.45 and 0.49, at 0.05 to 3 m/s, their ratio was 0.9
//! to 1.4 times that at rest wherever steps have to be divided. Where each element has its own pressure, a node's own block of lambda h h^T / V
//! takes that place. Viscosity brakes a node by its own block of C, which grows with the square of the stretch: also where elements are drawn
//! out or sheared.

use super::solid::{Solid, volume_gradients};
use crate::body::State;
use crate::body::kernel::TetrahedraKernel;
use crate::integrator::Spectrum;
use crate::{Mat3, Vec3};

/// The largest eigenvalue over the largest term of a node: 2.2 to 3.7 at rest.
const COUPLED: f64 = 2.6;
/// The same of a node's own block of the pressures of single elements, over that of averaged ones: the block has three directions.
const OWN: f64 = 0.5;
/// The largest eigenvalue of viscosity over the largest term of a node: 1.1 to 1.4.
const BRAKED: f64 = 1.4;

/// Finds the node that allows the shortest step.
#[derive(Clone, Debug)]
pub(super) struct Stiffening {
    /// The longest stable step at rest, by the same measure (s).
    at_rest: f64,
    /// Working memory: nodes of stretched elements, and for each node if it is one of them, and a sum that is zero in between.
    stretched: Vec<u32>,
    is_stretched: Vec<bool>,
    sums: Vec<Vec3>,
}

impl Stiffening {
    /// Of a body at rest, whose elements learn what they have to spare.
    pub(super) fn new(solid: &mut Solid, inverse_masses: &[f64], rest: &[Vec3]) -> Self {
        let mut new = Self::with(f64::INFINITY, rest.len());
        let (state, nodes) = (State::at_rest(rest), 0..rest.len() as u32);
        let steps: Vec<f64> = nodes.map(|node| new.stable_step(solid, inverse_masses, &state, node)).collect();
        new.at_rest = steps.iter().copied().fold(f64::INFINITY, f64::min);
        for element in &mut solid.elements {
            let longest = element.nodes.map(|node| steps[node as usize]).into_iter().fold(f64::INFINITY, f64::min);
            element.spare = longest / new.at_rest;
        }
        new
    }

    /// Of a part with `nodes` nodes of the body, which takes the body's steps.
    pub(super) fn of_part(&self, nodes: usize) -> Self {
        Self::with(self.at_rest, nodes)
    }

    fn with(at_rest: f64, nodes: usize) -> Self {
        let (stretched, is_stretched) = (Vec::with_capacity(nodes), vec![false; nodes]);
        Self { at_rest, stretched, is_stretched, sums: vec![Vec3::zeros(); nodes] }
    }

    /// The longest stable step in `state`, the last that the `kernel` has evaluated, over that at rest; at most 1.
    pub(super) fn share(
        &mut self,
        kernel: &TetrahedraKernel,
        solid: &Solid,
        inverse_masses: &[f64],
        state: &State,
    ) -> f64 {
        let Self { stretched, is_stretched, .. } = self;
        kernel.stretched(|nodes| {
            for node in nodes {
                if !std::mem::replace(&mut is_stretched[node as usize], true) {
                    stretched.push(node);
                }
            }
        });
        let mut share: f64 = 1.0;
        while let Some(node) = self.stretched.pop() {
            self.is_stretched[node as usize] = false;
            share = share.min(self.stable_step(solid, inverse_masses, state, node) / self.at_rest);
        }
        share
    }

    /// The longest stable step of `node` (s).
    fn stable_step(&mut self, solid: &Solid, inverse_masses: &[f64], state: &State, node: u32) -> f64 {
        let (mut shear, mut damping, mut own) = (0.0, Mat3::zeros(), 0.0);
        for element in solid.at(node) {
            let root = element.bulk.sqrt();
            let (moved, gradient) = (element.moved(state), element.gradient(node));
            for (corner, area) in element.nodes.into_iter().zip(volume_gradients(&moved)) {
                self.sums[corner as usize] += area * root;
                own += if corner == node { element.bulk / element.volume * area.norm_squared() } else { 0.0 };
            }
            shear += element.shear_modulus * element.volume * gradient.norm_squared();
            if element.viscosity > 0.0 {
                let stretch = moved.edges * element.inverse;
                let along = stretch * gradient;
                damping += (stretch * stretch.transpose() * gradient.norm_squared() + along * along.transpose())
                    * (element.viscosity * element.volume);
            }
        }
        let swelling = |corner: u32| {
            std::mem::take(&mut self.sums[corner as usize]).norm_squared() * inverse_masses[corner as usize]
        };
        let swelling: f64 = solid.at(node).flat_map(|element| element.nodes).map(swelling).sum();
        let inverse_mass = inverse_masses[node as usize];
        let pressure = match &solid.inverse_volumes {
            Some(inverse_volumes) => 0.25 * swelling * inverse_volumes[node as usize],
            None => OWN * own * inverse_mass,
        };
        let stiffness = COUPLED * (pressure + shear * inverse_mass);
        // Near the largest eigenvalue of the block, without an iteration.
        let damping = BRAKED * (damping * damping).norm().sqrt() * inverse_mass;
        Spectrum { stiffness, damping }.stable_step()
    }
}
