//! Collects what a body of tetrahedra is made of.

use super::element::Element;
use super::places::Places;
use super::solid::Solid;
use super::stiffening::Stiffening;
use super::{Tetrahedra, Tissue, TissueRegion, Where};
use crate::Mat3;
use crate::body::kernel::TetrahedraKernel;
use crate::error::ModelError;
use crate::integrator::Spectrum;
use crate::mesh::{MeshQuality, Surface, TetrahedralMesh};

/// Shares of the body's extent by which a place may miss the boundary of a shape and lie on it: files of single precision are good to 6e-8.
const ROUNDING: f64 = 1e-6;
/// Shortest stable step (s): a tick of 1 ms would have more than two hundred substeps.
const SHORTEST_STEP: f64 = 5e-6;
/// The step that the worst element alone allows is good to this factor.
const DOUBT: f64 = 4.0;

/// Collects what a body of tetrahedra is made of. Defaults: liver, average nodal pressure, nothing held.
///
/// # Real-time
/// Not real-time safe: allocates. Before the run.
#[derive(Clone, Debug)]
pub struct TetrahedraBuilder {
    pub(super) mesh: TetrahedralMesh,
    pub(super) tissue: Tissue,
    pub(super) regions: Vec<TissueRegion>,
    pub(super) fixed: Vec<Where>,
    pub(super) nodal_pressure: bool,
}

impl TetrahedraBuilder {
    /// Smallest and largest extent of a body (m): beyond them its file is most likely in another unit.
    pub const EXTENT_M: [f64; 2] = [1e-3, 10.0];

    /// What the body is made of.
    #[must_use]
    pub fn tissue(mut self, tissue: Tissue) -> Self {
        self.tissue = tissue;
        self
    }

    /// Takes the pressure of an element from the volumes around its nodes (Bonet and Burton 1998, Joldes, Wittek and Miller
    /// 2009) and not from its own alone, which locks near incompressibility: linear tetrahedra have too few ways to move.
    #[must_use]
    pub fn nodal_pressure(mut self, is_averaged: bool) -> Self {
        self.nodal_pressure = is_averaged;
        self
    }

    /// Makes a part of the body of something else; a later region wins where several give the same.
    #[must_use]
    pub fn region(mut self, region: TissueRegion) -> Self {
        self.regions.push(region);
        self
    }

    /// Holds the nodes of `place` stationary.
    #[must_use]
    pub fn fix(mut self, place: Where) -> Self {
        self.fixed.push(place);
        self
    }

    /// Makes the body.
    ///
    /// # Errors
    /// If the mesh cannot be simulated ([`TetrahedralMesh::cleaned`]) or is above 10 m or below 1 mm large; a number of the
    /// tissue or a region is impossible; a region holds no element, or differs in nothing; a group is not in the mesh; nothing
    /// is held, or not every connected part; or the explicit step would be below 5 us.
    pub fn build(self) -> Result<Tetrahedra, ModelError> {
        self.tissue.check().map_err(|error| error.at("tissue"))?;
        let (mesh, left_out) = self.mesh.cleaned().map_err(|error| error.at("mesh"))?;
        let quality = mesh.quality();
        check_extent(&quality)?;
        let places = Places { mesh: &mesh, tolerance: quality.extent().max() * ROUNDING };
        let tissues = places.tissues(self.tissue, &self.regions)?;
        let is_held = places.held(&self.fixed)?;
        check_parts(&mesh, &is_held)?;

        let elements: Vec<Element> =
            mesh.tetrahedra.iter().zip(&tissues).map(|(&nodes, tissue)| element(&mesh, nodes, tissue)).collect();
        let nodes = mesh.points.len();
        let (mut masses, mut volumes) = (vec![0.0; nodes], vec![0.0; nodes]);
        for (element, tissue) in elements.iter().zip(&tissues) {
            for node in element.nodes {
                masses[node as usize] += tissue.density * element.volume / 4.0;
                volumes[node as usize] += element.volume;
            }
        }
        let inverse = |values: Vec<f64>| values.into_iter().map(|value| 1.0 / value).collect::<Vec<f64>>();
        let mut inverse_masses = inverse(masses);
        inverse_masses.iter_mut().zip(is_held).filter(|(_, is_held)| *is_held).for_each(|(w, _)| *w = 0.0);
        let inverse_volumes = self.nodal_pressure.then(|| inverse(volumes));
        let mut solid = Solid::new(nodes, elements, inverse_volumes);
        let stiffening = Stiffening::new(&mut solid, &inverse_masses, &mesh.points);
        let kernel = TetrahedraKernel::new(nodes, &solid.elements, solid.inverse_volumes.as_deref());
        let mut body = Tetrahedra {
            surface: Surface::new(nodes, mesh.surface_triangles()).map_err(|error| error.at("mesh"))?,
            stiffening,
            kernel,
            solid,
            volume: quality.volume,
            mesh,
            left_out,
            tissues,
            inverse_masses,
        };
        check_step(&mut body)?;
        Ok(body)
    }
}

fn element(mesh: &TetrahedralMesh, nodes: [u32; 4], tissue: &Tissue) -> Element {
    let [a, b, c, d] = nodes.map(|node| mesh.points[node as usize]);
    let edges = Mat3::from_columns(&[b - a, c - a, d - a]);
    Element {
        nodes,
        // No element of a cleaned mesh is flat.
        inverse: edges.try_inverse().unwrap_or_else(Mat3::zeros),
        volume: edges.determinant() / 6.0,
        shear_modulus: tissue.shear_modulus(),
        bulk: tissue.lame() + tissue.shear_modulus(),
        viscosity: tissue.viscosity,
        spare: 1.0,
    }
}

fn check_extent(quality: &MeshQuality) -> Result<(), ModelError> {
    let extent = quality.extent();
    let [least, most] = TetrahedraBuilder::EXTENT_M;
    if extent.max() >= least && extent.max() <= most {
        return Ok(());
    }
    let [x, y, z] = extent.into();
    let message = format!(
        "the body is {x:.3e} x {y:.3e} x {z:.3e} m large, {least} to {most} m are possible: give the metres per unit of the mesh, 0.001 for millimetres"
    );
    Err(ModelError::of("unit_m", message))
}

/// Every connected part is to be held somewhere: what floats has no rest state and drifts off.
fn check_parts(mesh: &TetrahedralMesh, is_held: &[bool]) -> Result<(), ModelError> {
    if !is_held.contains(&true) {
        let message = "nothing is held: name a group of the mesh or a shape whose nodes are to stay where they are";
        return Err(ModelError::of("fixed", message));
    }
    let parts = mesh.parts();
    let Some(part) = parts.iter().find(|part| part.nodes.iter().all(|&node| !is_held[node as usize])) else {
        return Ok(());
    };
    let sum: crate::Vec3 = part.nodes.iter().map(|&node| mesh.points[node as usize]).sum();
    let [x, y, z] = (sum / part.nodes.len() as f64).into();
    let message = format!(
        "the mesh has {} parts, and {} of {} elements around ({x:.4}, {y:.4}, {z:.4}) m is not held: hold it too, or leave it out of the mesh",
        parts.len(),
        part.name,
        part.tetrahedra.len(),
    );
    Err(ModelError::of("fixed", message))
}

/// Refuses a body whose steps would be too short, by its worst element.
fn check_step(body: &mut Tetrahedra) -> Result<(), ModelError> {
    let alone = |(number, element): (usize, &Element)| {
        // A wave through the smallest height, and the rate at which viscosity slows a node that moves along it.
        let gradient = smallest_height(element).recip();
        let tissue = &body.tissues[number];
        let (stiffness, damping) = (2.0 * tissue.wave_speed() * gradient, gradient * gradient * tissue.viscosity);
        let spectrum = Spectrum { stiffness: stiffness * stiffness, damping: 8.0 * damping / tissue.density };
        (number, spectrum.stable_step())
    };
    let elements = body.solid.elements.iter().enumerate().map(alone);
    let Some((worst, step)) = elements.min_by(|a, b| a.1.total_cmp(&b.1)) else { return Ok(()) };
    if step >= DOUBT * SHORTEST_STEP {
        return Ok(());
    }
    let step = Spectrum::estimate(body).stable_step();
    if step >= SHORTEST_STEP {
        return Ok(());
    }
    let height = smallest_height(&body.solid.elements[worst]);
    let [x, y, z] = body.mesh.centroid(worst as u32).into();
    let message = format!(
        "the longest stable step is {:.2} us, at least {:.0} us are needed: element {worst} at ({x:.4}, {y:.4}, {z:.4}) m is the worst, {:.2e} m high; mend the mesh, or take a softer or less viscous tissue",
        step * 1e6,
        SHORTEST_STEP * 1e6,
        height
    );
    Err(ModelError::of("mesh", message))
}

/// The smallest height of a corner above the opposite face (m): the inverse of the largest gradient of a shape function.
fn smallest_height(element: &Element) -> f64 {
    let first = element.inverse.row_sum().norm();
    1.0 / element.inverse.row_iter().map(|row| row.norm()).fold(first, f64::max)
}
