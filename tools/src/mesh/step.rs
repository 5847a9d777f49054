//! The longest stable step of a mesh made of a reference tissue.

use palpate::model::body::{Tetrahedra, Tissue, Where};
use palpate::model::integrator::Spectrum;
use palpate::model::mesh::{Group, TetrahedralMesh};

/// The tissue that steps are told for.
pub const TISSUE: Tissue = Tissue::LIVER;

/// The longest stable step of the whole body, held at one node of each part and otherwise free (s): by the largest eigenvalues
/// of its stiffness and viscosity, with averaged nodal pressure. Or why it cannot be a body.
pub fn stable_step(mut mesh: TetrahedralMesh) -> Result<f64, String> {
    const HELD: &str = "held for the step";
    let mut nodes: Vec<u32> = mesh.parts().iter().map(|part| part.nodes[0]).collect();
    nodes.sort_unstable();
    mesh.groups = vec![Group { name: HELD.to_owned(), nodes, tetrahedra: Vec::new() }];
    let body = Tetrahedra::builder(mesh).tissue(TISSUE).fix(Where::Group(HELD.to_owned())).build();
    let mut body = body.map_err(|error| error.to_string())?;
    Ok(Spectrum::estimate(&mut body).stable_step())
}
