//! What a simulation is told if it is the image of one on another computer.

use crate::Vec3;

/// What a simulation on another computer tells of the surroundings of tools, which its image cannot find out by itself.
#[derive(Clone, Debug, Default)]
pub(crate) struct Told {
    /// Nodes that each tool presses, with the force on each (N).
    pub(crate) exerted: Vec<Vec<(u32, Vec3)>>,
    /// How the patch's ring is predicted to move: positions (m), velocities (m/s) and near forces (N) at each substep.
    pub(crate) path: Vec<f64>,
}
