//! Static condensation, with and without modes of what is left out.

use palpate::model::ModelError;

use super::congruence::Congruence;
use super::krylov::Projection;
use super::linalg::Matrix;
use super::modal::slow_modes;
use super::system::SecondOrder;

/// Guyan's reduction (1965, AIAA J. 3): the coordinates in `kept` (in increasing order) stay, all others follow as they do at rest. Exact
/// at rest for ports at the kept coordinates; mass and damping go along.
///
/// # Errors
/// If nothing holds the system.
pub fn guyan(system: &SecondOrder, kept: &[usize]) -> Result<Projection, ModelError> {
    Ok(Projection::new(system, constraint_modes(system, kept)?))
}

/// [`guyan`] for K and C, with the mass of the kept coordinates alone: what a patch with a condensed boundary has.
///
/// # Errors
/// If nothing holds the system.
pub fn condensed(system: &SecondOrder, kept: &[usize]) -> Result<Projection, ModelError> {
    let Projection { basis, model } = guyan(system, kept)?;
    let mass = system.part(kept).mass();
    Ok(Projection { basis, model: model.with_mass(mass) })
}

/// Craig and Bampton's reduction (1968, AIAA J. 6): [`guyan`] and the `modes` slowest modes of the others while the kept are held.
///
/// # Errors
/// If nothing holds the system.
pub fn craig_bampton(system: &SecondOrder, kept: &[usize], modes: usize) -> Result<Projection, ModelError> {
    let constraint = constraint_modes(system, kept)?;
    let others = others(system, kept);
    let (_, shapes) = slow_modes(&system.part(&others), modes)?;
    let mut basis = constraint.resize_horizontally(kept.len() + shapes.ncols(), 0.0);
    for (place, &row) in others.iter().enumerate() {
        for mode in 0..shapes.ncols() {
            basis[(row, kept.len() + mode)] = shapes[(place, mode)];
        }
    }
    Ok(Projection::new(system, basis))
}

/// The coordinates in `kept` with all others held: the paper's local model, from any body.
pub fn patch(system: &SecondOrder, kept: &[usize]) -> Projection {
    let basis = Matrix::from_fn(system.coordinates(), kept.len(), |row, column| f64::from(kept[column] == row));
    let model = Congruence::whole(&system.part(kept));
    Projection { basis, model }
}

fn others(system: &SecondOrder, kept: &[usize]) -> Vec<usize> {
    (0..system.coordinates()).filter(|at| kept.binary_search(at).is_err()).collect()
}

/// How all coordinates follow the kept ones at rest, n x kept.
fn constraint_modes(system: &SecondOrder, kept: &[usize]) -> Result<Matrix, ModelError> {
    let others = others(system, kept);
    let mut basis = Matrix::from_fn(system.coordinates(), kept.len(), |row, column| f64::from(kept[column] == row));
    if others.is_empty() {
        return Ok(basis);
    }
    let forces = -system.times_stiffness(&basis).select_rows(&others);
    let followed = system.part(&others).solve(0.0, forces)?;
    for (place, &row) in others.iter().enumerate() {
        basis.row_mut(row).copy_from(&followed.row(place));
    }
    Ok(basis)
}
