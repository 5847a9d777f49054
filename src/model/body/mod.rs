//! Deformable bodies: what a simulation needs to know of one, the block of springs, and networks of any springs.

mod block;
mod cutout;
mod half_space;
pub(crate) mod kernel;
mod lattice_piece;
mod lattice_springs;
mod neighbourhood;
mod network;
mod region;
mod restriction;
mod shape;
mod spring;
mod stiffness;
mod stress;
mod tetrahedra;

pub use block::{Block, BlockBuilder};
pub use cutout::Cutout;
pub use kernel::InstructionSet;
pub(crate) use neighbourhood::{bounds, neighbourhood};
pub use network::{SpringNetwork, SpringNetworkBuilder};
pub use region::Region;
pub use restriction::Restriction;
pub use shape::Shape;
pub use spring::{Spring, SpringTangent};
pub(crate) use stiffness::Stiffened;
pub use stiffness::Stiffness;
pub use stress::von_mises;
pub use tetrahedra::{Tetrahedra, TetrahedraBuilder, Tissue, TissueRegion, Where};

use crate::mesh::Surface;
use crate::{Mat3, Vec3};

/// Positions (m) and velocities (m/s) of all nodes.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct State {
    /// The position of each node (m).
    pub positions: Vec<Vec3>,
    /// The velocity of each node (m/s).
    pub velocities: Vec<Vec3>,
}

impl State {
    /// The state of nodes that rest at `positions` (m).
    ///
    /// # Real-time
    /// Not real-time safe: allocates.
    pub fn at_rest(positions: &[Vec3]) -> Self {
        Self { positions: positions.to_vec(), velocities: vec![Vec3::zeros(); positions.len()] }
    }

    /// True if every number is finite.
    ///
    /// # Real-time
    /// Bounded, by the number of nodes; real-time safe.
    pub fn is_finite(&self) -> bool {
        self.positions.iter().chain(&self.velocities).all(|vector| vector.iter().all(|c| c.is_finite()))
    }
}

/// One block of a tangent: how the force on node `row` answers to node `column`.
///
/// # Real-time
/// A plain value: its methods are wait-free and real-time safe.
#[derive(Clone, Copy, Debug)]
pub struct TangentBlock {
    /// The node that feels the force.
    pub row: u32,
    /// The node that moves.
    pub column: u32,
    /// df_row / dx_column (N/m).
    pub position: Mat3,
    /// df_row / dv_column (N s/m).
    pub velocity: Mat3,
}

impl TangentBlock {
    /// The two blocks of `row` that a spring to `column` makes: on the diagonal stands the opposite of the coupling.
    pub fn pair(row: u32, column: u32, tangent: &SpringTangent) -> [Self; 2] {
        let block = |column, sign: f64| Self {
            row,
            column,
            position: tangent.position * sign,
            velocity: tangent.velocity * sign,
        };
        [block(column, 1.0), block(row, -1.0)]
    }
}

/// A deformable body: nodes, masses, internal forces, tangent and surface.
///
/// The block of springs is one implementation; a program brings its own by implementing this trait. Forces may be
/// non-linear in the positions and must be linear in the velocities. Masses need not be equal.
///
/// ```
/// use palpate_model::Vec3;
/// use palpate_model::body::{Block, Body, State};
///
/// # fn main() -> Result<(), palpate_model::ModelError> {
/// let mut body: Box<dyn Body> = Box::new(Block::builder([3; 3], [0.02; 3]).build()?);
/// let mut state = State::at_rest(body.rest());
/// state.positions[26].z += 0.001;
/// let mut forces = vec![Vec3::zeros(); body.rest().len()];
/// body.forces(&state, &mut forces);
/// assert!(forces[26].z < 0.0, "its springs pull the node back");
/// # Ok(())
/// # }
/// ```
pub trait Body: Send + Sync + std::fmt::Debug {
    /// Rest positions (m), one per node.
    ///
    /// # Real-time
    /// Bounded, must not allocate or block.
    fn rest(&self) -> &[Vec3];

    /// Inverse masses (1/kg), one per node; zero for a node that is held stationary.
    ///
    /// # Real-time
    /// Bounded, must not allocate or block.
    fn inverse_masses(&self) -> &[f64];

    /// The surface that tools touch.
    ///
    /// # Real-time
    /// Called once per substep: bounded, must not allocate or block.
    fn surface(&self) -> &Surface;

    /// Writes the internal force on every node (N) to `forces` (one per node).
    ///
    /// # Real-time
    /// Called once per substep: bounded, must not allocate or block.
    fn forces(&mut self, state: &State, forces: &mut [Vec3]);

    /// Writes the internal force on each of `nodes` (N) to `forces` (one per entry of `nodes`).
    ///
    /// # Real-time
    /// For the global actor, at each resync: bounded.
    fn node_forces(&self, state: &State, nodes: &[u32], forces: &mut [Vec3]);

    /// Calls `emit` for every tangent block in the rows of `nodes`; blocks of the same place are added.
    ///
    /// With `clamp` the negative geometric stiffness of compressed springs is left out: an explicit linear model with
    /// it diverges within one resync period.
    ///
    /// # Real-time
    /// For the global actor, at each resync: bounded.
    fn tangent(&self, state: &State, nodes: &[u32], clamp: bool, emit: &mut dyn FnMut(TangentBlock));

    /// A copy, for a global model that is started again after a fault and for models that reduce the body; `None`, the
    /// default, if there cannot be one: a fault of the global model then stops the run.
    ///
    /// # Real-time
    /// Not called in a tick: may allocate.
    fn duplicate(&self) -> Option<Box<dyn Body>> {
        None
    }

    /// What of the body depends on `nodes` (ids, each once), as a body of its own; `None`, the default, if it cannot be taken
    /// apart. Models that keep the body around the tool as it is, and what reduces the rest, need it, and a
    /// [`duplicate`](Self::duplicate).
    ///
    /// # Real-time
    /// For the global actor, when the window of a local model moves: bounded by the nodes, may allocate.
    fn restriction(&self, _nodes: &[u32]) -> Option<Restriction> {
        None
    }

    /// `nodes` (ids in increasing order) as a body of their own, between others that are held; the default is made of the
    /// [`restriction`](Self::restriction), `None` if there is none. Models that look ahead need no more of a large body than what is
    /// around the tool.
    ///
    /// # Real-time
    /// For the global actor, when the window of a local model moves: bounded by the nodes, may allocate.
    fn cutout(&self, nodes: &[u32]) -> Option<Cutout> {
        Cutout::of(self, nodes)
    }

    /// Contact modulus of the material at each node (Pa), one per node, E / (1 - nu^2) where all directions are alike; empty, the default,
    /// if it is not known. A tool with a shape sinks in as deep as this says where the body's elements are too coarse to show it.
    ///
    /// # Real-time
    /// Not called in a tick: allocates.
    fn contact_moduli(&self) -> Vec<f64> {
        Vec::new()
    }

    /// The elastic stress (Pa) at `node`, the mean of what is around it: of elements Cauchy's, of springs the virial. `None`, the default,
    /// if it is not known; what pressure there is need not be in it, see [`von_mises`].
    ///
    /// # Real-time
    /// For programs that draw: bounded.
    fn stress(&self, _state: &State, _node: u32) -> Option<Mat3> {
        None
    }

    /// The longest stable explicit step in `state`, the one whose [`forces`](Self::forces) were asked for last, over that at rest, at
    /// most 1: steps are divided where a body that is crushed has become too stiff for them. The default is 1: springs do not stiffen.
    ///
    /// # Real-time
    /// Called at steps of a haptic tick: bounded, must not allocate or block.
    fn stable_share(&mut self, _state: &State) -> f64 {
        1.0
    }

    /// What one evaluation of all forces takes (s) on no machine in particular, for runs that must be the same on all of
    /// them. The default is 0.3 us for each node.
    ///
    /// # Real-time
    /// Not called in a tick.
    fn nominal_evaluation(&self) -> f64 {
        0.3e-6 * self.rest().len() as f64
    }

    /// Puts the nodes of a patch around surface triangles `triangles` in place of `nodes`, each once, in increasing order
    /// and without held ones; `size` = nodes along the surface, along it, into depth, around a single triangle.
    ///
    /// The default grows rings of triangles along the surface until there are enough nodes; it has no depth.
    ///
    /// # Real-time
    /// For the global actor, at each resync: bounded; `nodes` may grow.
    fn patch(&self, triangles: &[u32], size: [usize; 3], nodes: &mut Vec<u32>) {
        let surface = self.surface();
        nodes.clear();
        for &triangle in triangles {
            let mut around: Vec<u32> = surface.triangles[triangle as usize].to_vec();
            let mut next = 0;
            while next < around.len() && around.len() < size[0] * size[1] {
                for &t in surface.at_node(around[next]) {
                    for node in surface.triangles[t as usize] {
                        if !around.contains(&node) {
                            around.push(node);
                        }
                    }
                }
                next += 1;
            }
            nodes.append(&mut around);
        }
        let inverse_masses = self.inverse_masses();
        nodes.retain(|&node| inverse_masses[node as usize] > 0.0);
        nodes.sort_unstable();
        nodes.dedup();
    }
}
