//! What a contact step works on: nodes, their surface, and where on it the tool is.

use super::skin::Skin;
use super::triangle::{contact_normal, interpolate, walk};
use super::{Contact, Law, ToolMotion, swept};
use crate::mesh::Surface;
use crate::{Vec3, integrator};

/// A released tool that is nearer than this is still tracked (m): touching again needs no new detection.
const TRACKED_GAP: f64 = 3e-4;

/// Nodes with a surface over them: a whole body, or a patch of one.
#[derive(Debug)]
pub struct Deformable<'a> {
    /// Positions of all nodes that the surface names (m).
    pub positions: &'a mut [Vec3],
    /// Their velocities (m/s).
    pub velocities: &'a mut [Vec3],
    /// Their inverse masses (1/kg); zero for nodes that this model does not move.
    pub inverse_masses: &'a [f64],
    /// The surface over these nodes.
    pub surface: &'a Surface,
    /// The triangles that detection looks at.
    pub candidates: &'a [u32],
}

impl Deformable<'_> {
    /// Moves every node with its velocity for `d` seconds.
    pub(super) fn drift(&mut self, d: f64) {
        integrator::advance(self.positions, self.velocities, d);
    }

    /// The nodes of a triangle.
    pub(super) fn corners(&self, triangle: u32) -> [usize; 3] {
        self.surface.triangles[triangle as usize].map(|node| node as usize)
    }

    /// The corner at `node` as a tool with that `skin` meets it where elements are so `fine` (m): now, and `ahead` seconds from now
    /// if nothing presses.
    pub(super) fn corner(&self, skin: &Skin, fine: f64, node: u32, ahead: f64) -> [Vec3; 2] {
        let [x, v] = [self.positions[node as usize], self.velocities[node as usize]];
        let corner = skin.corner(node);
        if corner.is_empty() || fine == 1.0 {
            return [x, x + v * ahead];
        }
        let [mean_x, mean_v] = corner.iter().fold([Vec3::zeros(); 2], |[x, v], &(other, share)| {
            [x + self.positions[other as usize] * share, v + self.velocities[other as usize] * share]
        });
        let [x, v] = [mean_x + (x - mean_x) * fine, mean_v + (v - mean_v) * fine];
        [x, x + v * ahead]
    }

    /// The share of the step after which the contact acts: 0 for one that exists, the hit's for a new one.
    pub(super) fn detect(&self, contact: &mut Contact, tool: ToolMotion, d: f64) -> Option<(u32, f64)> {
        if let Some(triangle) = contact.triangle {
            return Some((triangle, 0.0));
        }
        let hit = swept::find(self.surface, self.candidates, self.positions, self.velocities, tool, d)?;
        contact.triangle = Some(hit.triangle);
        contact.weights = hit.weights;
        Some((hit.triangle, hit.share))
    }

    /// After a step without sticking: to the triangle under the tool, or off when the tool has left the surface.
    pub(super) fn reseat(&self, contact: &mut Contact, law: &Law, from: u32, tool: &Vec3) {
        let (triangle, weights) = walk(self.surface, self.positions, from, tool);
        (contact.triangle, contact.weights) = (Some(triangle), weights);
        if !contact.is_touching() {
            let normal = contact_normal(law.normals, self.surface, self.positions, triangle, &weights);
            let point = interpolate(&weights, &self.corners(triangle).map(|node| self.positions[node]));
            if normal.dot(&(tool - point)) > TRACKED_GAP {
                contact.triangle = None;
            }
        }
    }
}
