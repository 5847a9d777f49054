//! Which part of the surface the next local models have to hold.

use super::forecast::ToolForecast;
use crate::error::ModelError;
use crate::mesh::{NearestTriangle, Surface};
use crate::simulation::Simulation;
use crate::{Pose, Vec3};

/// A window that is made ahead has room around a tool with a shape, in tool radii: where that goes a little aside or sooner, the
/// same window serves.
const ROOM: f64 = 0.3;

/// Finds the surface triangles under the tool, now and where it is going.
#[derive(Clone, Debug)]
pub struct Aim {
    nearest: NearestTriangle,
}

impl Aim {
    /// A search over `surface` with nodes at `positions` (m).
    ///
    /// # Errors
    /// If the surface has no triangles.
    ///
    /// # Real-time
    /// Not real-time safe: allocates.
    pub fn new(surface: &Surface, positions: &[Vec3]) -> Result<Self, ModelError> {
        Ok(Self { nearest: NearestTriangle::new(surface, positions)? })
    }

    /// Moves the nodes of the surface to `positions` (m).
    ///
    /// # Real-time
    /// For the global actor: bounded, allocates nothing.
    pub fn refit(&mut self, positions: &[Vec3]) {
        self.nearest.refit(positions);
    }

    /// Puts the triangles for a window of tool number `index` that is made `after` seconds from now in place of `triangles`: the
    /// one under the tool then, those that it comes over in the `lead` seconds that follow if it goes on or back, and all that its
    /// shape may touch there. One that is made now begins with the triangle of the contact, one that is made ahead has room around
    /// the shape; a tool that is glued goes nowhere else. The surface has to be where the last [`refit`](Self::refit) put it.
    ///
    /// # Real-time
    /// For the global actor: bounded; allocates.
    pub fn triangles(
        &self,
        (simulation, index): (&Simulation, usize),
        tool: &ToolForecast,
        [after, lead]: [f64; 2],
        triangles: &mut Vec<u32>,
    ) {
        triangles.clear();
        let contact = simulation.contact(index);
        let touched = contact.triangle.filter(|_| after == 0.0);
        triangles.push(touched.unwrap_or_else(|| self.nearest.find(&tool.unbraked(after))));
        if contact.glued {
            return;
        }
        let margin = if after == 0.0 { 0.0 } else { ROOM * simulation.shape(index).radius() };
        let ways = tool.ways(after, lead);
        triangles.extend(ways.clone().skip(1).map(|place| self.nearest.find(&place)));
        let touch = simulation.touch(index);
        if !touch.has_shape() {
            return;
        }
        let surface = (simulation.body().surface(), &*simulation.state().positions);
        for position in ways {
            let pose = Pose { position, orientation: tool.orientation };
            touch.footprint(&self.nearest, surface, &pose, margin, triangles);
        }
    }
}
