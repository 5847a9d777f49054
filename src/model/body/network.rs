//! A body of any nodes and springs.

use std::collections::HashMap;

use super::kernel::{InstructionSet, NOMINAL_SPRING_S, NetworkKernel};
use super::lattice_piece::LatticePiece;
use super::stress::{enclosed, virial};
use super::{Body, Restriction, Spring, State, TangentBlock};
use crate::error::ModelError;
use crate::mesh::{Lists, Surface};
use crate::{Mat3, Vec3};

/// Point masses joined by an arbitrary list of springs; made by [`SpringNetwork::builder`].
///
/// Nodes keep the numbers that the builder got. For its forces they are renumbered inside and the springs put in batches
/// of eight without a common node; forces are bit-identical from run to run, and change in the last digits
/// with the order of nodes and springs.
///
/// ```
/// use palpate_model::Vec3;
/// use palpate_model::body::{Body, Spring, SpringNetwork};
///
/// # fn main() -> Result<(), palpate_model::ModelError> {
/// let corners = [Vec3::zeros(), Vec3::x() * 0.01, Vec3::y() * 0.01, Vec3::z() * 0.01];
/// let spring = |i: usize, j: usize| {
///     (i as u32, j as u32, Spring { stiffness: 30.0, damping: 0.1, rest_length: (corners[i] - corners[j]).norm() })
/// };
/// let springs = [spring(0, 1), spring(0, 2), spring(0, 3), spring(1, 2), spring(2, 3), spring(3, 1)];
/// let builder = SpringNetwork::builder(corners.to_vec()).masses(vec![1e-3; 4]).springs(springs).fix(0);
/// let network = builder.surface(vec![[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]]).build()?;
/// assert_eq!(network.springs().len(), 6);
/// # Ok(())
/// # }
/// ```
///
/// # Real-time
/// Its forces are bounded and real-time safe; to make it or a copy of it allocates.
#[derive(Clone, Debug)]
pub struct SpringNetwork {
    rest: Vec<Vec3>,
    inverse_masses: Vec<f64>,
    surface: Surface,
    springs: Vec<(u32, u32, Spring)>,
    /// Inside the surface at rest (m^3).
    volume: f64,
    /// The springs at each node.
    at_node: Lists,
    kernel: Kernel,
}

/// What computes the forces.
#[derive(Clone, Debug)]
enum Kernel {
    Any(NetworkKernel),
    /// Quicker, where the springs are some of a lattice's: in restrictions of a block.
    Lattice(Box<LatticePiece>),
}

/// Collects what a [`SpringNetwork`] is made of.
///
/// # Real-time
/// Not real-time safe: allocates. Before the run.
#[derive(Clone, Debug)]
pub struct SpringNetworkBuilder {
    rest: Vec<Vec3>,
    masses: Vec<f64>,
    held: Vec<u32>,
    springs: Vec<(u32, u32, Spring)>,
    triangles: Vec<[u32; 3]>,
}

impl SpringNetworkBuilder {
    /// Mass of each node (kg), one per node.
    #[must_use]
    pub fn masses(mut self, kg: Vec<f64>) -> Self {
        self.masses = kg;
        self
    }

    /// Holds `node` stationary.
    #[must_use]
    pub fn fix(mut self, node: u32) -> Self {
        self.held.push(node);
        self
    }

    /// Joins nodes `i` and `j`. Two nodes may have several springs.
    #[must_use]
    pub fn spring(mut self, i: u32, j: u32, spring: Spring) -> Self {
        self.springs.push((i, j, spring));
        self
    }

    /// Joins many pairs of nodes.
    #[must_use]
    pub fn springs(mut self, springs: impl IntoIterator<Item = (u32, u32, Spring)>) -> Self {
        self.springs.extend(springs);
        self
    }

    /// The triangles that tools touch: node numbers, counter-clockwise seen from outside.
    #[must_use]
    pub fn surface(mut self, triangles: Vec<[u32; 3]>) -> Self {
        self.triangles = triangles;
        self
    }

    /// Makes the network.
    ///
    /// # Errors
    /// If there are no nodes, a number is not finite, a mass or rest length is not positive, a stiffness or damping is
    /// negative, a spring joins a node to itself or to one at the same place, something names a node that is not there, or
    /// the surface is not a manifold.
    pub fn build(self) -> Result<SpringNetwork, ModelError> {
        let nodes = self.rest.len();
        if nodes == 0 || nodes >= u32::MAX as usize {
            return Err(ModelError::of("nodes", format!("{nodes}: at least 1 and less than 2^32 - 1 are needed")));
        }
        if let Some((n, x)) = self.rest.iter().enumerate().find(|(_, x)| !x.iter().all(|c| c.is_finite())) {
            let message = format!("node {n} is at {:?}: finite positions are needed", x.as_slice());
            return Err(ModelError::of("nodes", message));
        }
        if self.masses.len() != nodes {
            return Err(ModelError::of(
                "masses",
                format!("{} for {nodes} nodes: one each is needed", self.masses.len()),
            ));
        }
        if let Some((n, m)) = self.masses.iter().enumerate().find(|(_, m)| !(m.is_finite() && **m > 0.0)) {
            let message = format!("node {n} has {m} kg: a finite value above 0 is needed");
            return Err(ModelError::of("masses", message));
        }
        if let Some(node) = self.held.iter().find(|&&node| node as usize >= nodes) {
            return Err(ModelError::of("fix", format!("node {node}: there are only {nodes}")));
        }
        for (n, spring) in self.springs.iter().enumerate() {
            check(spring, &self.rest).map_err(|what| ModelError::of("springs", format!("spring {n}: {what}")))?;
        }
        let mut inverse_masses: Vec<f64> = self.masses.iter().map(|m| 1.0 / m).collect();
        for node in self.held {
            inverse_masses[node as usize] = 0.0;
        }
        let ends = self.springs.iter().zip(0..).flat_map(|(&(i, j, _), spring)| [(i, spring), (j, spring)]);
        let surface = Surface::new(nodes, self.triangles)?;
        Ok(SpringNetwork {
            volume: enclosed(&self.rest, &surface.triangles),
            surface,
            kernel: Kernel::Any(NetworkKernel::new(nodes, &self.springs)),
            rest: self.rest,
            inverse_masses,
            at_node: Lists::new(nodes, ends),
            springs: self.springs,
        })
    }
}

/// What is wrong with a spring.
fn check(&(i, j, spring): &(u32, u32, Spring), rest: &[Vec3]) -> Result<(), String> {
    if i.max(j) as usize >= rest.len() {
        return Err(format!("nodes {i} and {j}: there are only {}", rest.len()));
    }
    if i == j {
        return Err(format!("it joins node {i} to itself"));
    }
    if rest[i as usize] == rest[j as usize] {
        return Err(format!("nodes {i} and {j} are at the same place, so that it has no direction: move one of them"));
    }
    let not_negative = |value: f64| value.is_finite() && value >= 0.0;
    if !(not_negative(spring.stiffness) && not_negative(spring.damping)) {
        let Spring { stiffness, damping, .. } = spring;
        return Err(format!("stiffness {stiffness} and damping {damping}: finite values, 0 or more, are needed"));
    }
    if !(spring.rest_length.is_finite() && spring.rest_length > 0.0) {
        return Err(format!("rest length {}: a finite value above 0 is needed", spring.rest_length));
    }
    Ok(())
}

impl SpringNetwork {
    /// Starts a network of nodes at `rest` (m), without springs and surface; masses must be given.
    pub fn builder(rest: Vec<Vec3>) -> SpringNetworkBuilder {
        let (masses, held, springs, triangles) = Default::default();
        SpringNetworkBuilder { rest, masses, held, springs, triangles }
    }

    /// The springs and the nodes that they join, as the builder got them.
    pub fn springs(&self) -> &[(u32, u32, Spring)] {
        &self.springs
    }

    /// Computes the network's forces with `set`, to compare sets; the fastest one is chosen otherwise.
    ///
    /// # Errors
    /// If this machine does not have it.
    pub fn with_instruction_set(mut self, set: InstructionSet) -> Result<Self, ModelError> {
        let set = set.available()?;
        if let Kernel::Any(kernel) = &mut self.kernel {
            kernel.set_instruction_set(set);
        }
        Ok(self)
    }

    /// Computes the network's forces on `cores` cores: the calling thread and threads of its own, which copies share. Worth it
    /// from some 1,000 nodes on if the other cores are free. Forces are bit-identical from run to run for one number of
    /// cores. With more than one, evaluations are no longer real-time safe: they allocate and may block.
    ///
    /// # Errors
    /// If `cores` is 0 or the system refuses a thread.
    #[cfg(feature = "parallel")]
    pub fn on_cores(mut self, cores: usize) -> Result<Self, ModelError> {
        if let Kernel::Any(kernel) = &mut self.kernel {
            kernel.set_cores(&self.springs, cores)?;
        }
        Ok(self)
    }

    /// The restriction to `asked` of a body of springs with nodes at `rest`; `springs` gives those at a node, `piece` a quicker way to the
    /// forces on its nodes, if there is one.
    pub(super) fn restricted<I: Iterator<Item = (u32, u32, Spring)>>(
        rest: &[Vec3],
        inverse_masses: &[f64],
        asked: &[u32],
        springs: impl Fn(u32) -> I,
        piece: impl FnOnce(&[u32]) -> Option<LatticePiece>,
    ) -> Restriction {
        let ends = asked.iter().flat_map(|&node| springs(node).flat_map(|(i, j, _)| [i, j]));
        let nodes = Restriction::order(asked, ends, inverse_masses);
        let place: HashMap<u32, u32> = nodes.iter().copied().zip(0..).collect();
        let mut near = Vec::new();
        for (at, &node) in asked.iter().enumerate() {
            for (i, j, spring) in springs(node) {
                let other = place[&if i == node { j } else { i }];
                // One between two of the nodes is met from both.
                if other as usize >= asked.len() || at < other as usize {
                    near.push((place[&i], place[&j], spring));
                }
            }
        }
        let ends = near.iter().zip(0..).flat_map(|(&(i, j, _), spring)| [(i, spring), (j, spring)]);
        let body = Self {
            rest: nodes.iter().map(|&node| rest[node as usize]).collect(),
            inverse_masses: nodes.iter().map(|&node| inverse_masses[node as usize]).collect(),
            surface: Surface::default(),
            volume: 0.0,
            at_node: Lists::new(nodes.len(), ends),
            kernel: match piece(&nodes) {
                Some(piece) => Kernel::Lattice(Box::new(piece)),
                None => Kernel::Any(NetworkKernel::new(nodes.len(), &near)),
            },
            springs: near,
        };
        Restriction { nodes, body: Box::new(body) }
    }

    /// The share of a node in the volume that the surface encloses at rest (m^3): by the number of its springs.
    fn volume_of(&self, node: u32) -> Option<f64> {
        let share = self.at_node.of(node).len() as f64 / (2.0 * self.springs.len() as f64);
        Some(self.volume * share).filter(|volume| *volume > 0.0)
    }

    /// The springs at `node` and their other ends, with the differences of position and velocity to there.
    fn around<'a>(&'a self, state: &'a State, node: u32) -> impl Iterator<Item = (u32, Spring, Vec3, Vec3)> + 'a {
        self.at_node.of(node).iter().map(move |&spring| {
            let (i, j, spring) = self.springs[spring as usize];
            let other = if i == node { j } else { i };
            let (from, to) = (node as usize, other as usize);
            let along = state.positions[to] - state.positions[from];
            (other, spring, along, state.velocities[to] - state.velocities[from])
        })
    }
}

impl Body for SpringNetwork {
    fn rest(&self) -> &[Vec3] {
        &self.rest
    }

    fn inverse_masses(&self) -> &[f64] {
        &self.inverse_masses
    }

    fn surface(&self) -> &Surface {
        &self.surface
    }

    fn forces(&mut self, state: &State, forces: &mut [Vec3]) {
        match &mut self.kernel {
            Kernel::Any(kernel) => kernel.forces(&state.positions, &state.velocities, forces),
            Kernel::Lattice(piece) => piece.forces(&state.positions, &state.velocities, forces),
        }
    }

    fn node_forces(&self, state: &State, nodes: &[u32], forces: &mut [Vec3]) {
        for (&node, force) in nodes.iter().zip(forces) {
            let sum = |sum, (_, spring, along, closing): (u32, Spring, Vec3, Vec3)| sum + spring.force(along, closing);
            *force = self.around(state, node).fold(Vec3::zeros(), sum);
        }
    }

    fn tangent(&self, state: &State, nodes: &[u32], clamp: bool, emit: &mut dyn FnMut(TangentBlock)) {
        for &row in nodes {
            for (column, spring, along, closing) in self.around(state, row) {
                let tangent = spring.tangent(along, closing, clamp);
                TangentBlock::pair(row, column, &tangent).into_iter().for_each(&mut *emit);
            }
        }
    }

    fn restriction(&self, nodes: &[u32]) -> Option<Restriction> {
        let springs = |node| self.at_node.of(node).iter().map(|&spring| self.springs[spring as usize]);
        Some(Self::restricted(&self.rest, &self.inverse_masses, nodes, springs, |_| None))
    }

    fn stress(&self, state: &State, node: u32) -> Option<Mat3> {
        let volume = self.volume_of(node)?;
        Some(virial(self.around(state, node).map(|(_, spring, along, _)| (spring, along)), volume))
    }

    fn nominal_evaluation(&self) -> f64 {
        NOMINAL_SPRING_S * self.springs.len() as f64
    }

    fn duplicate(&self) -> Option<Box<dyn Body>> {
        Some(Box::new(self.clone()))
    }
}
