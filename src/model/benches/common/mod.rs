//! What benches share whose contestants take turns.
#![allow(dead_code)]

use std::time::Instant;

use palpate_model::Vec3;
use palpate_model::body::State;

/// A deformed and moving state: nothing is zero or on a lattice line.
pub fn deformed(rest: &[Vec3]) -> State {
    let wobble =
        |n: usize, a: f64| Vec3::new((a * n as f64).sin(), (1.7 * a * n as f64).cos(), (2.9 * a * n as f64).sin());
    State {
        positions: rest.iter().enumerate().map(|(n, x)| x + wobble(n, 0.7) * 3e-4).collect(),
        velocities: (0..rest.len()).map(|n| wobble(n, 0.3) * 0.1).collect(),
    }
}

/// Its name, and what is measured.
pub type Contestant = (String, Box<dyn FnMut()>);

/// Contestants take turns; seconds of one call of each, the least of all rounds.
pub fn least(contestants: &mut [Contestant], rounds: usize, calls: usize) -> Vec<f64> {
    let mut least = vec![f64::INFINITY; contestants.len()];
    for _ in 0..rounds {
        for ((_, call), least) in contestants.iter_mut().zip(&mut least) {
            call();
            let start = Instant::now();
            (0..calls).for_each(|_| call());
            *least = least.min(start.elapsed().as_secs_f64() / calls as f64);
        }
    }
    least
}
