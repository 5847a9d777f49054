//! Bodies of linear tetrahedra with tissue's own parameters.

mod builder;
mod element;
mod part;
mod places;
mod restriction;
mod solid;
mod stiffening;
mod tissue;
mod window;

pub use builder::TetrahedraBuilder;
pub(crate) use element::Element;
pub use part::Where;
pub use tissue::{Tissue, TissueRegion};

use super::kernel::{InstructionSet, NOMINAL_ELEMENT_S, TetrahedraKernel};
use super::{Body, Restriction, State, TangentBlock};
use crate::error::ModelError;
use crate::mesh::{LeftOut, Surface, TetrahedralMesh};
use crate::{Mat3, Vec3};
use solid::Solid;
use stiffening::Stiffening;

/// A body of linear tetrahedra, made by [`Tetrahedra::builder`]: a continuum of stable neo-Hookean tissue with Young's modulus,
/// Poisson's ratio, density and viscosity, lumped masses and, by default, average nodal pressure.
///
/// With F the deformation gradient of an element and J = det F its energy density is
/// `mu/2 (tr F^T F - 3) - mu (J - 1) + lambda/2 (J - 1)^2`; it survives inversion, and for small strains is Hooke's law of E
/// and nu. Viscous stress is `F (2 eta Edot)`, Edot the rate of Green's strain.
///
/// ```
/// use palpate_model::Vec3;
/// use palpate_model::body::{Body, Shape, Tetrahedra, Tissue, Where};
/// use palpate_model::mesh::TetrahedralMesh;
///
/// # fn main() -> Result<(), palpate_model::ModelError> {
/// let points = [[0.0; 3], [0.02, 0.0, 0.0], [0.0, 0.02, 0.0], [0.0, 0.0, 0.02]].map(Vec3::from).to_vec();
/// let mesh = TetrahedralMesh { points, tetrahedra: vec![[0, 1, 2, 3]], groups: vec![] };
/// let bottom = Where::Shape(Shape::Layer { axis: 2, from: 0.0, to: 0.001 });
/// let body = Tetrahedra::builder(mesh).tissue(Tissue::LIVER).fix(bottom).build()?;
/// let mass = 1.0 / body.inverse_masses()[3];
/// assert!((mass - 1060.0 * body.volume() / 4.0).abs() < 1e-12);
/// # Ok(())
/// # }
/// ```
///
/// # Real-time
/// Its forces are bounded and real-time safe; to make it or a copy of it allocates.
#[derive(Clone, Debug)]
pub struct Tetrahedra {
    mesh: TetrahedralMesh,
    left_out: LeftOut,
    tissues: Vec<Tissue>,
    inverse_masses: Vec<f64>,
    surface: Surface,
    solid: Solid,
    volume: f64,
    kernel: TetrahedraKernel,
    stiffening: Stiffening,
}

impl Tetrahedra {
    /// Starts a body of `mesh`, of liver and with average nodal pressure; what is held must be given.
    pub fn builder(mesh: TetrahedralMesh) -> TetrahedraBuilder {
        let (tissue, regions, fixed) = (Tissue::LIVER, Vec::new(), Vec::new());
        TetrahedraBuilder { mesh, tissue, regions, fixed, nodal_pressure: true }
    }

    /// Number of elements.
    pub fn element_count(&self) -> usize {
        self.solid.elements.len()
    }

    /// The mesh, as [`TetrahedralMesh::cleaned`] left it: its nodes and elements have the body's numbers.
    pub fn mesh(&self) -> &TetrahedralMesh {
        &self.mesh
    }

    /// What was changed in the mesh that the builder got.
    pub fn left_out(&self) -> LeftOut {
        self.left_out
    }

    /// The tissue of `element`.
    ///
    /// # Panics
    /// If there is no such element.
    pub fn tissue_of(&self, element: u32) -> &Tissue {
        &self.tissues[element as usize]
    }

    /// Volume at rest (m^3).
    pub fn volume(&self) -> f64 {
        self.volume
    }

    /// Computes the body's forces with `set`, to compare sets; the fastest one is chosen otherwise. Bits are the same on all.
    ///
    /// # Errors
    /// If this machine does not have it.
    pub fn with_instruction_set(mut self, set: InstructionSet) -> Result<Self, ModelError> {
        self.kernel.set_instruction_set(set.available()?);
        Ok(self)
    }

    /// Computes the body's forces on `cores` cores: the calling thread and threads of its own, which copies share. Worth it
    /// from some 2,000 elements on if the other cores are free. Forces are bit-identical from run to run for one number of
    /// cores. With more than one, evaluations are no longer real-time safe: they allocate and may block.
    ///
    /// # Errors
    /// If `cores` is 0 or the system refuses a thread.
    #[cfg(feature = "parallel")]
    pub fn on_cores(mut self, cores: usize) -> Result<Self, ModelError> {
        self.kernel.set_cores(&self.solid.elements, cores)?;
        Ok(self)
    }
}

impl Body for Tetrahedra {
    fn rest(&self) -> &[Vec3] {
        &self.mesh.points
    }

    fn inverse_masses(&self) -> &[f64] {
        &self.inverse_masses
    }

    fn surface(&self) -> &Surface {
        &self.surface
    }

    fn forces(&mut self, state: &State, forces: &mut [Vec3]) {
        self.kernel.forces(&state.positions, &state.velocities, forces);
    }

    fn node_forces(&self, state: &State, nodes: &[u32], forces: &mut [Vec3]) {
        self.solid.node_forces(state, nodes, forces);
    }

    fn tangent(&self, state: &State, nodes: &[u32], clamp: bool, emit: &mut dyn FnMut(TangentBlock)) {
        self.solid.tangent(state, nodes, clamp, emit);
    }

    fn stable_share(&mut self, state: &State) -> f64 {
        self.stiffening.share(&self.kernel, &self.solid, &self.inverse_masses, state)
    }

    fn duplicate(&self) -> Option<Box<dyn Body>> {
        Some(Box::new(self.clone()))
    }

    fn restriction(&self, nodes: &[u32]) -> Option<Restriction> {
        Some(self.restricted(nodes))
    }

    fn contact_moduli(&self) -> Vec<f64> {
        let mut sums = vec![(0.0, 0.0); self.rest().len()];
        for (element, nodes) in self.mesh.tetrahedra.iter().enumerate() {
            let tissue = self.tissue_of(element as u32);
            let modulus = tissue.young_modulus / (1.0 - tissue.poisson_ratio * tissue.poisson_ratio);
            for &node in nodes {
                sums[node as usize].0 += modulus;
                sums[node as usize].1 += 1.0;
            }
        }
        sums.into_iter().map(|(sum, count)| if count > 0.0 { sum / count } else { 0.0 }).collect()
    }

    fn stress(&self, state: &State, node: u32) -> Option<Mat3> {
        self.solid.shear_stress(state, node)
    }

    fn nominal_evaluation(&self) -> f64 {
        NOMINAL_ELEMENT_S * self.solid.elements.len() as f64
    }

    /// The nearest nodes around each triangle's centroid at rest, as many as `size` makes, that it reaches through elements.
    fn patch(&self, triangles: &[u32], size: [usize; 3], nodes: &mut Vec<u32>) {
        nodes.clear();
        let (count, mut seen) = (size.iter().product(), vec![0; self.rest().len()]);
        for (&triangle, number) in triangles.iter().zip(1..) {
            window::grow(self, self.surface.triangles[triangle as usize], count, (&mut seen, number), nodes);
        }
        nodes.sort_unstable();
        nodes.dedup();
    }
}
