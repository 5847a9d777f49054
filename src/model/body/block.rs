//! The block of point masses joined by springs to all 26 neighbours: the paper's body.

use super::cutout::part_of;
use super::half_space::contact_modulus;
use super::kernel::{InstructionSet, LatticeKernel, NOMINAL_SPRING_S};
use super::lattice_piece::LatticePiece;
use super::lattice_springs::LatticeSprings;
use super::region::{Material, Region, materials};
use super::stress::virial;
use super::{Body, Cutout, Restriction, Spring, SpringNetwork, State, TangentBlock};
use crate::error::ModelError;
use crate::mesh::{Face, Lattice, Surface};
use crate::{Mat3, Vec3};

/// A block of nodes and springs; made by [`Block::builder`].
///
/// ```
/// use palpate_model::body::Block;
/// use palpate_model::mesh::Face;
///
/// # fn main() -> Result<(), palpate_model::ModelError> {
/// let builder = Block::builder([12; 3], [0.1; 3]).stiffness(30.0).damping_ratio(0.3).node_mass(0.5e-3);
/// let block = builder.fix(Face::ZMin).build()?;
/// assert_eq!(block.springs().len(), 18_788);
/// # Ok(())
/// # }
/// ```
///
/// # Real-time
/// Its forces are bounded and real-time safe; to make it or a copy of it allocates.
#[derive(Clone, Debug)]
pub struct Block {
    lattice: Lattice,
    rest: Vec<Vec3>,
    inverse_masses: Vec<f64>,
    surface: Surface,
    springs: LatticeSprings,
    kernel: LatticeKernel,
}

/// Collects what a [`Block`] is made of. Defaults: k 30 N/m, zeta 0.3, node mass 0.5 g, nothing held.
///
/// # Real-time
/// Not real-time safe: allocates. Before the run.
#[derive(Clone, Debug)]
pub struct BlockBuilder {
    nodes: [usize; 3],
    size: [f64; 3],
    material: Material,
    regions: Vec<Region>,
    fixed: Vec<Face>,
}

impl BlockBuilder {
    /// Stiffness of every spring (N/m).
    #[must_use]
    pub fn stiffness(mut self, n_per_m: f64) -> Self {
        self.material.stiffness = n_per_m;
        self
    }

    /// Damping ratio zeta of every spring: b = zeta sqrt(2 m k), the paper's definition.
    #[must_use]
    pub fn damping_ratio(mut self, zeta: f64) -> Self {
        self.material.damping_ratio = zeta;
        self
    }

    /// Mass of every node (kg).
    #[must_use]
    pub fn node_mass(mut self, kg: f64) -> Self {
        self.material.node_mass = kg;
        self
    }

    /// Makes a part of the block of something else; a later region wins where several give the same.
    ///
    /// A node has the material of the regions that hold its rest position. A spring between two materials is half a
    /// spring of each in series: k = 2 k1 k2 / (k1 + k2), as a rod that changes halfway, and b likewise from each node's
    /// own b = zeta sqrt(2 m k), so 0 if one of them is.
    #[must_use]
    pub fn region(mut self, region: Region) -> Self {
        self.regions.push(region);
        self
    }

    /// Holds the nodes of `face` stationary.
    #[must_use]
    pub fn fix(mut self, face: Face) -> Self {
        self.fixed.push(face);
        self
    }

    /// Refuses regions that cannot be or hold no node.
    ///
    /// # Errors
    /// If there is one: `region[index].key` and what is wrong with it. If the numbers of nodes cannot be, that.
    pub fn check_regions(&self) -> Result<(), ModelError> {
        materials(self.lattice()?, self.size, self.material, &self.regions).map(drop)
    }

    fn lattice(&self) -> Result<Lattice, ModelError> {
        let nodes = self.nodes;
        let refused = |why: String| Err(ModelError::of("nodes", format!("{nodes:?}: {why}")));
        if nodes.iter().any(|&n| n < 2) {
            return refused("at least 2 per axis are needed".to_owned());
        }
        let total = nodes.iter().try_fold(1_usize, |total, &n| total.checked_mul(n));
        if total.is_none_or(|total| total > Block::MAX_NODES) {
            return refused(format!("at most {} in all are possible, take fewer along an axis", Block::MAX_NODES));
        }
        Ok(Lattice { nodes })
    }

    /// Makes the block.
    ///
    /// # Errors
    /// If a number is not finite, a mass, stiffness or size is not positive, an axis has less than two nodes, all have more than
    /// [`Block::MAX_NODES`], or a region holds no node or differs in nothing.
    pub fn build(self) -> Result<Block, ModelError> {
        let positive = |value: f64| value.is_finite() && value > 0.0;
        let Material { stiffness, damping_ratio, node_mass } = self.material;
        let lattice = self.lattice()?;
        if !self.size.iter().all(|&length| positive(length)) {
            return Err(ModelError::of("size_m", format!("{:?}: three lengths above 0 are needed", self.size)));
        }
        for (field, value) in [("node_mass_kg", node_mass), ("stiffness_n_per_m", stiffness)] {
            if !positive(value) {
                return Err(ModelError::of(field, format!("{value}: a finite value above 0 is needed")));
            }
        }
        if !(damping_ratio.is_finite() && damping_ratio >= 0.0) {
            return Err(ModelError::of("damping_ratio", format!("{damping_ratio}: 0 or more is needed")));
        }
        let spacing: [f64; 3] = std::array::from_fn(|axis| self.size[axis] / (self.nodes[axis] - 1) as f64);
        let at = |id: usize| lattice.coordinates(id as u32);
        let held = |id: usize| self.fixed.iter().any(|&face| face.holds(at(id), self.nodes));
        let materials = materials(lattice, self.size, self.material, &self.regions)?;
        let springs = LatticeSprings::new(&lattice, spacing, &materials);
        let inverse_mass = |id: usize| if held(id) { 0.0 } else { 1.0 / materials[id].node_mass };
        Ok(Block {
            lattice,
            rest: (0..lattice.len())
                .map(|id| {
                    let at = at(id);
                    Vec3::from_fn(|axis, _| at[axis] as f64 * spacing[axis])
                })
                .collect(),
            inverse_masses: (0..lattice.len()).map(inverse_mass).collect(),
            surface: Surface::new(lattice.len(), lattice.surface_triangles())?,
            kernel: LatticeKernel::new(&springs),
            springs,
        })
    }
}

impl Block {
    /// The most nodes of a block; a million have 13 million springs, minutes of work for a second of simulation.
    pub const MAX_NODES: usize = 1_000_000;

    /// Starts a block of `nodes` per axis and `size` (m).
    pub fn builder(nodes: [usize; 3], size: [f64; 3]) -> BlockBuilder {
        let material = Material { stiffness: 30.0, damping_ratio: 0.3, node_mass: 0.5e-3 };
        BlockBuilder { nodes, size, material, regions: Vec::new(), fixed: Vec::new() }
    }

    /// The lattice of the nodes: their numbering and neighbours.
    pub fn lattice(&self) -> Lattice {
        self.lattice
    }

    /// Every spring once, with the nodes that it joins.
    pub fn springs(&self) -> Vec<(u32, u32, Spring)> {
        let mut springs = Vec::with_capacity(self.springs.len());
        for node in 0..self.rest.len() as u32 {
            let ahead = self.springs.neighbours(&self.lattice, node).filter(|&(other, _)| other > node);
            springs.extend(ahead.map(|(other, spring)| (node, other, spring)));
        }
        springs
    }

    /// The smallest box that has `nodes` and all ends of their springs, and the nodes in it, in increasing order.
    fn box_around(&self, nodes: &[u32]) -> Option<(Lattice, Vec<u32>)> {
        let at = || nodes.iter().map(|&node| self.lattice.coordinates(node));
        let low = at().reduce(|a, b| std::array::from_fn(|axis| a[axis].min(b[axis])))?;
        let high = at().reduce(|a, b| std::array::from_fn(|axis| a[axis].max(b[axis])))?;
        let low = low.map(|c| c.saturating_sub(1));
        let lattice =
            Lattice { nodes: std::array::from_fn(|axis| (high[axis] + 2).min(self.lattice.nodes[axis]) - low[axis]) };
        let whole = |id: u32| {
            let at = lattice.coordinates(id);
            self.lattice.id(std::array::from_fn(|axis| low[axis] + at[axis]))
        };
        Some((lattice, (0..lattice.len() as u32).map(whole).collect()))
    }

    /// The name of the instruction set that forces of blocks are computed with on this machine.
    pub fn instruction_set() -> &'static str {
        InstructionSet::detect().name()
    }

    /// Computes the block's forces with `set`, to compare sets; the fastest one is chosen otherwise.
    ///
    /// # Errors
    /// If this machine does not have it.
    pub fn with_instruction_set(mut self, set: InstructionSet) -> Result<Self, ModelError> {
        self.kernel.set_instruction_set(set.available()?);
        Ok(self)
    }

    /// Computes the block's forces on `cores` cores: the calling thread and threads of its own, which copies share. Worth it
    /// from some 1,000 nodes on if the other cores are free. Forces are bit-identical from run to run for one number of
    /// cores. With more than one, evaluations are no longer real-time safe: they allocate and may block.
    ///
    /// # Errors
    /// If `cores` is 0 or the system refuses a thread.
    #[cfg(feature = "parallel")]
    pub fn on_cores(mut self, cores: usize) -> Result<Self, ModelError> {
        self.kernel.set_cores(&self.springs, cores)?;
        Ok(self)
    }
}

impl Body for Block {
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
        self.kernel.forces(&self.springs, &state.positions, &state.velocities, forces);
    }

    fn node_forces(&self, state: &State, nodes: &[u32], forces: &mut [Vec3]) {
        for (&node, force) in nodes.iter().zip(forces) {
            let (x, v) = (state.positions[node as usize], state.velocities[node as usize]);
            *force = self.springs.neighbours(&self.lattice, node).fold(Vec3::zeros(), |sum, (other, spring)| {
                sum + spring.force(state.positions[other as usize] - x, state.velocities[other as usize] - v)
            });
        }
    }

    fn tangent(&self, state: &State, nodes: &[u32], clamp: bool, emit: &mut dyn FnMut(TangentBlock)) {
        for &row in nodes {
            let (x, v) = (state.positions[row as usize], state.velocities[row as usize]);
            for (column, spring) in self.springs.neighbours(&self.lattice, row) {
                let along = state.positions[column as usize] - x;
                let closing = state.velocities[column as usize] - v;
                let tangent = spring.tangent(along, closing, clamp);
                TangentBlock::pair(row, column, &tangent).into_iter().for_each(&mut *emit);
            }
        }
    }

    fn duplicate(&self) -> Option<Box<dyn Body>> {
        Some(Box::new(self.clone()))
    }

    fn restriction(&self, nodes: &[u32]) -> Option<Restriction> {
        let springs = |node: u32| {
            let ends = move |(other, spring)| (node.min(other), node.max(other), spring);
            self.springs.neighbours(&self.lattice, node).map(ends)
        };
        let piece = |all: &[u32]| {
            let (lattice, ids) = self.box_around(nodes)?;
            let mut is_asked = vec![false; ids.len()];
            let place = |id: &u32| ids.binary_search(id).ok().map(|place| place as u32);
            nodes.iter().filter_map(place).for_each(|place| is_asked[place as usize] = true);
            let mut springs = self.springs.part(&lattice, &ids);
            springs.retain(|place| is_asked[place]);
            let rest: Vec<Vec3> = ids.iter().map(|&id| self.rest[id as usize]).collect();
            LatticePiece::new(springs, all.iter().filter_map(place).collect(), &rest)
        };
        Some(SpringNetwork::restricted(&self.rest, &self.inverse_masses, nodes, springs, piece))
    }

    fn cutout(&self, nodes: &[u32]) -> Option<Cutout> {
        // The rim has all ends of their springs; those between its own nodes are there too and move nothing.
        let (lattice, ids) = self.box_around(nodes)?;
        let springs = self.springs.part(&lattice, &ids);
        let inverse_mass =
            |&id: &u32| if nodes.binary_search(&id).is_ok() { self.inverse_masses[id as usize] } else { 0.0 };
        let (surface, triangles) = part_of(&self.surface, &ids);
        let body = Self {
            lattice,
            rest: ids.iter().map(|&id| self.rest[id as usize]).collect(),
            inverse_masses: ids.iter().map(inverse_mass).collect(),
            surface,
            kernel: self.kernel.of_part(&springs),
            springs,
        };
        Some(Cutout { nodes: ids, triangles, body: Box::new(body) })
    }

    fn contact_moduli(&self) -> Vec<f64> {
        let place = |at: [usize; 3]| self.rest[self.lattice.id(at) as usize];
        let step = place([1, 1, 1]) - place([0, 0, 0]);
        let volume = step.x * step.y * step.z;
        let pull = |offset: [isize; 3]| {
            let along = Vec3::from_fn(|axis, _| offset[axis] as f64 * step[axis]);
            (along.normalize(), along.norm_squared() / volume)
        };
        // Of springs of 1 N/m.
        let of_faces =
            [Vec3::x(), Vec3::y(), Vec3::z()].map(|normal| contact_modulus(&Lattice::FORWARD.map(pull), normal));
        let of_node = |node: u32| {
            let springs = || self.springs.neighbours(&self.lattice, node);
            let stiffness: f64 = springs().map(|(_, spring)| spring.stiffness).sum::<f64>() / springs().count() as f64;
            let at = self.lattice.coordinates(node);
            let is_of_face = |axis: &usize| at[*axis] == 0 || at[*axis] + 1 == self.lattice.nodes[*axis];
            let faces = (0..3).filter(is_of_face).map(|axis| of_faces[axis]);
            let count = faces.clone().count();
            stiffness * if count == 0 { of_faces.iter().sum::<f64>() / 3.0 } else { faces.sum::<f64>() / count as f64 }
        };
        (0..self.rest.len() as u32).map(of_node).collect()
    }

    fn stress(&self, state: &State, node: u32) -> Option<Mat3> {
        let at = self.lattice.coordinates(node);
        let corner = |at: [usize; 3]| self.rest[self.lattice.id(at) as usize];
        let step = corner([1, 1, 1]) - corner([0, 0, 0]);
        // Half of a cell belongs to a node of a face, a quarter to one of an edge.
        let ends = (0..3).filter(|&axis| at[axis] == 0 || at[axis] + 1 == self.lattice.nodes[axis]).count();
        let volume = step.x * step.y * step.z * 0.5_f64.powi(ends as i32);
        let x = state.positions[node as usize];
        let springs = self.springs.neighbours(&self.lattice, node);
        Some(virial(springs.map(|(other, spring)| (spring, state.positions[other as usize] - x)), volume))
    }

    fn nominal_evaluation(&self) -> f64 {
        NOMINAL_SPRING_S * self.springs.len() as f64
    }

    fn patch(&self, triangles: &[u32], size: [usize; 3], nodes: &mut Vec<u32>) {
        nodes.clear();
        let corners = triangles.iter().map(|&triangle| self.surface.triangles[triangle as usize]);
        self.lattice.window(corners, size, nodes);
        nodes.retain(|&node| self.inverse_masses[node as usize] > 0.0);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_paper_block_has_18788_springs() {
        let block = Block::builder([12; 3], [0.1; 3]).fix(Face::ZMin).build().unwrap();
        assert_eq!(block.springs().len(), 18_788);
        assert_eq!(block.inverse_masses().iter().filter(|&&w| w == 0.0).count(), 144);
    }

    // Check that nothing is allocated for it, nor computed that overflows.
    #[test]
    fn a_block_of_more_nodes_than_possible_is_refused_in_a_line() {
        let axis = 100_000;
        for nodes in [[axis; 3], [usize::MAX; 3], [2, 2, Block::MAX_NODES / 4 + 1]] {
            let builder = Block::builder(nodes, [0.1; 3]);
            let refused = builder.check_regions().unwrap_err();
            assert_eq!(builder.build().unwrap_err(), refused);
            let message = refused.to_string();
            assert!(message.starts_with("nodes: [") && message.contains("at most 1000000 in all"), "{message}");
            assert!(!message.contains('\n'), "{message}");
        }
        assert!(Block::builder([2, 2, Block::MAX_NODES / 4], [0.1; 3]).lattice().is_ok());
    }

    #[test]
    fn forces_vanish_at_rest() {
        let mut block = Block::builder([4, 5, 6], [0.1, 0.07, 0.2]).build().unwrap();
        let mut forces = vec![Vec3::x(); 120];
        block.forces(&State::at_rest(&block.rest.clone()), &mut forces);
        assert!(forces.iter().all(|force| force.norm() < 1e-14));
    }

    #[test]
    fn forces_of_single_nodes_agree_with_the_kernel() {
        let mut block = Block::builder([4, 5, 6], [0.1, 0.07, 0.2]).build().unwrap();
        let mut state = State::at_rest(block.rest());
        for (n, x) in state.positions.iter_mut().enumerate() {
            *x += Vec3::new((n as f64).sin(), (2.0 * n as f64).cos(), (3.0 * n as f64).sin()) * 2e-3;
        }
        let mut all = vec![Vec3::zeros(); 120];
        block.forces(&state, &mut all);
        let nodes = [0, 17, 63, 119];
        let mut some = [Vec3::zeros(); 4];
        block.node_forces(&state, &nodes, &mut some);
        for (&node, force) in nodes.iter().zip(&some) {
            assert!((all[node as usize] - force).norm() < 1e-13);
        }
    }
}
