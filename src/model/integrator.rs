//! Explicit time stepping: symplectic Euler, its stability limit and the substeps that follow from it.

use super::Vec3;
use super::body::kernel::{InstructionSet, LANES, Simd, Work};
use super::body::{Body, State};

/// Below this magnitude positions (m) and velocities (m/s) are snapped to zero: a resting state must not decay into
/// denormals, which are a hundred times slower. Far below anything that a force can show.
const REST: f64 = 1e-30;

/// Without what is too small to matter.
#[inline(always)]
pub(super) fn snap(vector: Vec3) -> Vec3 {
    vector.map(|c| if c.abs() < REST { 0.0 } else { c })
}

/// v += d M^-1 f for every node.
///
/// # Real-time
/// Bounded, real-time safe.
pub(crate) fn accelerate(velocities: &mut [Vec3], forces: &[Vec3], inverse_masses: &[f64], d: f64) {
    InstructionSet::detect().run(Accelerate { velocities, forces, inverse_masses, d });
}

/// x += d v for every node that can move.
///
/// # Real-time
/// Bounded, real-time safe.
pub(crate) fn advance(positions: &mut [Vec3], velocities: &[Vec3], d: f64) {
    InstructionSet::detect().run(Advance { positions, velocities, d });
}

struct Accelerate<'a> {
    velocities: &'a mut [Vec3],
    forces: &'a [Vec3],
    inverse_masses: &'a [f64],
    d: f64,
}

impl Work for Accelerate<'_> {
    #[inline(always)]
    fn run<S: Simd>(self, s: S) {
        let Self { velocities, forces, inverse_masses, d } = self;
        // A patch has masses of the nodes that it moves alone: what is left of eights begins at the same node in all three.
        let nodes = velocities.len().min(forces.len()).min(inverse_masses.len());
        let (eights, velocities) = velocities[..nodes].as_chunks_mut::<LANES>();
        let (of_eights, forces) = forces[..nodes].as_chunks();
        let (weights, inverse_masses) = inverse_masses[..nodes].as_chunks();
        for ((velocity, force), weight) in eights.iter_mut().zip(of_eights).zip(weights) {
            let weight = s.mul(s.splat(d), s.load(weight));
            let (mut moving, force) = (s.load_vectors(velocity), s.load_vectors(force));
            for axis in 0..3 {
                moving[axis] = snapped(s, s.add(moving[axis], s.mul(force[axis], weight)));
            }
            s.store_vectors(moving, velocity);
        }
        for ((velocity, force), &inverse_mass) in velocities.iter_mut().zip(forces).zip(inverse_masses) {
            *velocity = snap(*velocity + force * (d * inverse_mass));
        }
    }
}

struct Advance<'a> {
    positions: &'a mut [Vec3],
    velocities: &'a [Vec3],
    d: f64,
}

impl Work for Advance<'_> {
    #[inline(always)]
    fn run<S: Simd>(self, s: S) {
        let Self { positions, velocities, d } = self;
        let nodes = positions.len().min(velocities.len());
        let (eights, positions) = positions[..nodes].as_chunks_mut::<LANES>();
        let (of_eights, velocities) = velocities[..nodes].as_chunks();
        for (position, velocity) in eights.iter_mut().zip(of_eights) {
            let (mut places, velocity) = (s.load_vectors(position), s.load_vectors(velocity));
            for axis in 0..3 {
                places[axis] = snapped(s, s.add(places[axis], s.mul(velocity[axis], s.splat(d))));
            }
            s.store_vectors(places, position);
        }
        for (position, velocity) in positions.iter_mut().zip(velocities) {
            *position = snap(*position + velocity * d);
        }
    }
}

/// [`snap`] of eight numbers: by their squares, which no set has to take the magnitude of.
#[inline(always)]
fn snapped<S: Simd>(s: S, value: S::V) -> S::V {
    s.keep(s.mask(u8::MAX), s.mul(value, value), s.splat(REST * REST), value)
}

/// Steps are chosen so many times as short as stability asks for, as elements that are bent or stretched are stiffer than at rest.
pub const MARGIN: f64 = 1.3;

/// Share of an eigenvalue up to which a body's is found.
const PRECISION: f64 = 1e-7;

/// The largest eigenvalues of a body's linearisation at rest; they bound the explicit step.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Spectrum {
    /// w^2, largest eigenvalue of M^-1 K (1/s^2).
    pub stiffness: f64,
    /// c, largest eigenvalue of M^-1 C (1/s).
    pub damping: f64,
}

impl Spectrum {
    /// Estimates both by power iteration on the body's own forces: central differences for K, exact for C.
    ///
    /// # Real-time
    /// Not real-time safe: allocates, and evaluates the body's forces hundreds of times.
    pub fn estimate(body: &mut dyn Body) -> Self {
        let rest = body.rest().to_vec();
        let mut state = State::at_rest(&rest);
        // Small against the element size, large against rounding: the forces at rest are odd in the displacement.
        let extent = rest.iter().flat_map(|x| x.iter()).fold(0.0_f64, |size, c| size.max(c.abs())).max(1e-9);
        let small = 1e-6 * extent;
        let (mut plus, mut minus) = (vec![Vec3::zeros(); rest.len()], vec![Vec3::zeros(); rest.len()]);
        let stiffness = largest_eigenvalue(body.inverse_masses().to_vec(), PRECISION, |direction, product| {
            let scale = small / direction.iter().map(|u| u.norm()).fold(0.0, f64::max).max(f64::MIN_POSITIVE);
            let mut displaced = |sign: f64, forces: &mut [Vec3]| {
                for ((x, rest), u) in state.positions.iter_mut().zip(&rest).zip(direction) {
                    *x = rest + u * (sign * scale);
                }
                body.forces(&state, forces);
            };
            displaced(1.0, &mut plus);
            displaced(-1.0, &mut minus);
            for ((product, plus), minus) in product.iter_mut().zip(&plus).zip(&minus) {
                *product = (minus - plus) / (2.0 * scale);
            }
        });
        let mut state = State::at_rest(&rest);
        let damping = largest_eigenvalue(body.inverse_masses().to_vec(), PRECISION, |direction, product| {
            state.velocities.copy_from_slice(direction);
            body.forces(&state, product);
            product.iter_mut().for_each(|force| *force = -*force);
        });
        Self { stiffness, damping }
    }

    /// The largest stable explicit step d (s): w^2 d^2 + 2 c d = 4.
    ///
    /// # Real-time
    /// Wait-free, real-time safe.
    pub fn stable_step(&self) -> f64 {
        if self.stiffness <= 0.0 && self.damping <= 0.0 {
            return f64::INFINITY;
        }
        // The root without cancellation, good for w^2 = 0 too.
        4.0 / (self.damping + (self.damping * self.damping + 4.0 * self.stiffness).sqrt())
    }

    /// Substeps per tick of `dt` (s): 1.3 times what stability asks for, at least one.
    ///
    /// # Real-time
    /// Wait-free, real-time safe.
    pub fn substeps(&self, dt: f64) -> u32 {
        (MARGIN * dt / self.stable_step()).ceil().max(1.0) as u32
    }
}

/// Power iteration for the largest eigenvalue of M^-1 A; `apply` computes A u. Deterministic; held nodes stay zero.
/// Ends when an iteration changes the estimate by less than its share `precision`.
pub(super) fn largest_eigenvalue(
    inverse_masses: Vec<f64>,
    precision: f64,
    mut apply: impl FnMut(&[Vec3], &mut [Vec3]),
) -> f64 {
    // A rough direction excites the stiffest modes; sines of incommensurable steps are never orthogonal to them.
    let mut direction: Vec<Vec3> = (0..inverse_masses.len())
        .map(|n| Vec3::new((1.9 * n as f64).sin(), (2.3 * n as f64).cos(), (2.9 * n as f64).sin()))
        .collect();
    for (u, &w) in direction.iter_mut().zip(&inverse_masses) {
        if w == 0.0 {
            *u = Vec3::zeros();
        }
    }
    let mut product = vec![Vec3::zeros(); direction.len()];
    let mut eigenvalue = 0.0;
    for iteration in 0..500 {
        let norm = direction.iter().map(Vec3::norm_squared).sum::<f64>().sqrt();
        if norm == 0.0 {
            return 0.0;
        }
        direction.iter_mut().for_each(|u| *u /= norm);
        apply(&direction, &mut product);
        for (product, &w) in product.iter_mut().zip(&inverse_masses) {
            *product *= w;
        }
        // |M^-1 A u| over |u|: grows towards the eigenvalue and needs no second product.
        let estimate = product.iter().map(Vec3::norm_squared).sum::<f64>().sqrt();
        let settled = (estimate - eigenvalue).abs() <= precision * estimate;
        eigenvalue = estimate;
        std::mem::swap(&mut direction, &mut product);
        if settled && iteration > 20 {
            break;
        }
    }
    eigenvalue
}

#[cfg(test)]
mod tests {
    use super::super::body::Block;
    use super::super::mesh::Face;
    use super::*;

    fn spectrum(stiffness: f64, mass: f64, zeta: f64) -> Spectrum {
        let builder = Block::builder([12; 3], [0.1; 3]).stiffness(stiffness).node_mass(mass).damping_ratio(zeta);
        Spectrum::estimate(&mut builder.fix(Face::ZMin).build().unwrap())
    }

    #[test]
    fn the_paper_block_has_the_known_largest_eigenvalue() {
        let spectrum = spectrum(30.0, 0.5e-3, 0.3);
        let (k, m) = (30.0, 0.5e-3);
        let b = 0.3 * (2.0_f64 * m * k).sqrt();
        assert!((spectrum.stiffness * m / k - 16.74).abs() < 0.02, "{}", spectrum.stiffness * m / k);
        assert!((spectrum.damping * m / b - 16.74).abs() < 0.02, "{}", spectrum.damping * m / b);
        assert_eq!(spectrum.substeps(1e-3), 2);
    }

    #[test]
    fn substeps_follow_stiffness_and_damping() {
        assert_eq!(spectrum(6.0, 1e-3, 1.0).substeps(1e-3), 2);
        assert!(spectrum(3000.0, 0.5e-3, 0.3).substeps(1e-3) >= 10);
        assert!(spectrum(30.0, 0.5e-3, 2.0).substeps(1e-3) > spectrum(30.0, 0.5e-3, 0.3).substeps(1e-3));
    }

    #[test]
    fn eight_nodes_at_once_go_as_each_alone() {
        let vector =
            |n: usize, at: f64| Vec3::new((at * n as f64).sin(), -(at * n as f64).cos(), 1e-29 / (n + 1) as f64);
        let (mut velocities, mut positions): (Vec<Vec3>, Vec<Vec3>) =
            (0..45).map(|n| (vector(n, 1.3), vector(n, 2.1))).unzip();
        let forces: Vec<Vec3> = (0..45).map(|n| vector(n, 3.7)).collect();
        let inverse_masses: Vec<f64> = (0..45).map(|n| (n % 3) as f64).collect();
        let mut alone = (velocities.clone(), positions.clone());
        for n in 0..45 {
            alone.0[n] = snap(alone.0[n] + forces[n] * (1e-3 * inverse_masses[n]));
            alone.1[n] = snap(alone.1[n] + alone.0[n] * 1e-3);
        }
        accelerate(&mut velocities, &forces, &inverse_masses, 1e-3);
        advance(&mut positions, &velocities, 1e-3);
        assert_eq!((velocities, positions), alone);
    }

    #[test]
    fn of_slices_of_unlike_lengths_the_nodes_that_all_have_go_on() {
        let mut velocities = vec![Vec3::zeros(); 45];
        accelerate(&mut velocities, &[Vec3::x(); 30], &[1.0; 19], 1.0);
        assert!(velocities.iter().enumerate().all(|(n, v)| v.x == if n < 19 { 1.0 } else { 0.0 }), "{velocities:?}");
        let mut positions = vec![Vec3::zeros(); 45];
        advance(&mut positions, &[Vec3::x(); 19], 1.0);
        assert!(positions.iter().enumerate().all(|(n, x)| x.x == if n < 19 { 1.0 } else { 0.0 }), "{positions:?}");
    }

    #[test]
    fn resting_states_do_not_decay_into_denormals() {
        let mut velocities = vec![Vec3::new(1e-29, 1e-31, -1e-300)];
        accelerate(&mut velocities, &[Vec3::zeros()], &[1.0], 1e-3);
        assert_eq!(velocities[0], Vec3::new(1e-29, 0.0, 0.0));
    }
}
