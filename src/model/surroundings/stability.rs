//! Why a local model with reduced surroundings is stable wherever the body itself is.
//!
//! An explicit step d of M x'' + C x' + K x = 0 is stable if 4 M - 2 d C - d^2 K is positive definite. Patch, near part and reduced
//! surroundings together are the body in a subspace: the patch's coordinates and the shapes of the states. On a subspace
//! a positive definite matrix stays one, whatever patch, shapes and number of states. What is far off in a large body is in a subspace
//! too, with masses that are at least what they would be there (`beyond.rs`). So the step that was taken for the body, with
//! its margin of 1.3, holds for every window that can be made of it, and no window is looked at again before it serves.

use nalgebra::DMatrix;

use super::near::Near;
use super::uneven::{random, uneven};
use super::{Basis, RestingBody};
use crate::body::Body;
use crate::integrator::Spectrum;
use crate::linear_algebra::Matrix;

/// The least eigenvalue of 4 - M^-1/2 (2 d C + d^2 K) M^-1/2 for the local model of a window.
fn margin(body: &dyn Body, patch: &[u32], basis: &Basis, d: f64) -> f64 {
    let near = Near::new(&body.restriction(patch).unwrap(), patch.len());
    let (on_ring, states) = (basis.answers.shapes.to_matrix(), basis.states());
    let stiffness = Matrix::from_fn(states, states, |i, j| if i == j { basis.answers.stiffness[i] } else { 0.0 });
    let damping = basis.answers.damping.to_matrix();
    let k = near.beside(&near.stiffness, &on_ring, &stiffness, -1.0);
    let c = near.beside(&near.damping, &on_ring, &damping, -1.0);
    let m = near.beside(&near.mass, &on_ring, &Matrix::identity(states, states), 1.0);
    let weight = |i: usize| 1.0 / m[(i, i)].sqrt();
    let of_step = DMatrix::from_fn(m.nrows(), m.nrows(), |i, j| {
        weight(i) * weight(j) * (d * (c[(i, j)] + c[(j, i)]) + d * d * k[(i, j)])
    });
    4.0 - of_step.symmetric_eigenvalues().max()
}

#[test]
fn every_window_is_stable_in_the_steps_that_the_body_is_stable_in() {
    let mut seed = 11;
    let (mut windows, mut coarse, mut least) = (0, 0, f64::INFINITY);
    for number in 0..12 {
        let (mut body, _) = uneven(&mut seed);
        // Of every other body what is farther from the patch is coarse.
        let neighbours = if number % 2 == 0 { usize::MAX } else { 30 };
        let resting = RestingBody::new(&body).unwrap().with_neighbours(neighbours);
        let step = Spectrum::estimate(&mut body).stable_step() / 1.3;
        let triangles = body.surface().triangles.len();
        for _ in 0..100 {
            let mut number = |from: usize, to: usize| from + (random(&mut seed) * (to - from) as f64) as usize;
            let (triangle, size, states) =
                (number(0, triangles) as u32, [number(2, 4), number(2, 4), number(2, 4)], number(1, 60));
            let mut patch = Vec::new();
            body.patch(&[triangle], size, &mut patch);
            // What cannot be reduced does not serve, and a patch with nothing around it is the body itself.
            let Ok(Some(basis)) = Basis::compute(&resting, &patch, states) else { continue };
            if basis.states() == 0 {
                continue;
            }
            windows += 1;
            coarse += usize::from(resting.around(&patch).is_some());
            least = least.min(margin(&body, &patch, &basis, step));
        }
    }
    println!("{windows} windows, {coarse} of them with what is coarse, least eigenvalue {least:.3} of 4");
    assert!(windows > 1000 && coarse > 300, "{windows}, {coarse}");
    // 1.3 times the stable step is where the least may become 0; at the step itself that much is left.
    assert!(least > 4.0 * (1.0 - 1.0 / 1.3), "{least}");
}
