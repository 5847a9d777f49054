//! The slowest modes of a large system.

use super::congruence::Congruence;
use super::linalg::{Matrix, append_orthonormal, pencil_eigen, product};
use super::system::{SecondOrder, not_held};
use palpate_model::ModelError;

/// The largest number of steps of the iteration.
const STEPS: usize = 60;
/// Frequencies squared that change by less than this share in a step are found.
const TOLERANCE: f64 = 1e-10;

/// w^2 (rad^2/s^2) and shapes (n x count) of the `count` slowest undamped modes, by block inverse iteration (Bathe 1973) from the answers to forces that differ from
/// coordinate to coordinate.
pub(super) fn slow_modes(system: &SecondOrder, count: usize) -> Result<(Vec<f64>, Matrix), ModelError> {
    let n = system.coordinates();
    let count = count.min(n);
    let width = (2 * count + 4).min(n);
    let factor = system.factorised(0.0)?;
    let mut block =
        Matrix::from_fn(n, width, |row, column| ((row * (2 * column + 1)) as f64 * 0.7 + column as f64).sin());
    let mut last = vec![0.0; count];
    for _ in 0..STEPS {
        let answers = factor.solve(system.times_mass(&block));
        let mut basis = Matrix::zeros(n, 0);
        append_orthonormal(&mut basis, &answers, 1e-12);
        // Modes of the mass-normalised problem in that span.
        let small = Congruence::new(system, &basis);
        let (values, vectors) = pencil_eigen(&small.stiffness, &small.mass).ok_or_else(not_held)?;
        block = product(&basis, &vectors);
        let found = values.iter().take(count).zip(&last).all(|(new, old)| (new - old).abs() <= TOLERANCE * new);
        last = values[..count.min(values.len())].to_vec();
        if found {
            break;
        }
    }
    let count = count.min(block.ncols());
    Ok((last, block.columns(0, count).into_owned()))
}
