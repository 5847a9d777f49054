//! A body of another stiffness than it was made with: what changes while a session runs.

use super::{Body, Restriction, State, TangentBlock};
use crate::mesh::Surface;
use crate::{Mat3, Vec3};

/// The stiffness of a body's material, in that which it was made with: 1 as it was made.
///
/// # Real-time
/// A plain value: its methods are wait-free and real-time safe.
#[derive(Clone, Copy, Debug, PartialEq, PartialOrd)]
pub struct Stiffness(f64);

impl Default for Stiffness {
    /// As the body was made.
    fn default() -> Self {
        Self(1.0)
    }
}

impl Stiffness {
    /// The fastest change, as a share per second: ten times as stiff within half a second. A deformed body that stiffens pushes.
    const RATE: f64 = 4.6;

    /// So many times as stiff, if that is a positive number.
    ///
    /// # Real-time
    /// Wait-free, real-time safe.
    pub fn times(factor: f64) -> Option<Self> {
        (factor > 0.0 && factor.is_finite()).then_some(Self(factor))
    }

    /// s: every elastic force is so many times as large.
    ///
    /// # Real-time
    /// Wait-free, real-time safe.
    pub fn factor(self) -> f64 {
        self.0
    }

    /// sqrt(s): every damping force is so many times as large, as b = ratio * sqrt(2 m k) (the paper's definition) keeps its ratio.
    /// Everything in the body is that much faster, and its largest stable step that much shorter.
    ///
    /// # Real-time
    /// Wait-free, real-time safe.
    pub fn root(self) -> f64 {
        self.0.sqrt()
    }

    /// The stiffest body that `substeps` explicit steps in `tick` (s) bear if its largest stable one is `stable_step` (s) as it was
    /// made: with the margin that steps are chosen by, and no less than as it was made.
    ///
    /// # Real-time
    /// Wait-free, real-time safe.
    pub fn largest(stable_step: f64, tick: f64, substeps: u32) -> Self {
        let root = f64::from(substeps) * stable_step / (crate::integrator::MARGIN * tick);
        Self((root * root).max(1.0))
    }

    /// This, after `dt` seconds on the way to `target`.
    #[must_use]
    pub(crate) fn towards(self, target: Self, dt: f64) -> Self {
        let most = (Self::RATE * dt).exp();
        let ratio = target.0 / self.0;
        if (1.0 / most..=most).contains(&ratio) { target } else { Self(self.0 * ratio.clamp(1.0 / most, most)) }
    }
}

/// A body that is s times as stiff as the one inside: f(x, v) = s g(x, v / sqrt(s)).
///
/// Forces are linear in the velocities, so elastic ones are s times as large and damping ones sqrt(s) times; the mass stays. That is
/// the same motion in a time that runs sqrt(s) times as fast.
#[derive(Debug)]
pub(crate) struct Stiffened {
    made: Box<dyn Body>,
    stiffness: Stiffness,
    /// Working memory: where the nodes are, with velocities in the time of the body as it was made.
    slowed: State,
}

impl Stiffened {
    pub(crate) fn new(made: Box<dyn Body>) -> Self {
        Self::times(made, Stiffness::default())
    }

    fn times(made: Box<dyn Body>, stiffness: Stiffness) -> Self {
        let slowed = State::at_rest(made.rest());
        Self { made, stiffness, slowed }
    }

    /// The body as it was made.
    pub(crate) fn as_made(&self) -> &dyn Body {
        &*self.made
    }

    pub(crate) fn stiffness(&self) -> Stiffness {
        self.stiffness
    }

    /// # Real-time
    /// Wait-free, real-time safe.
    pub(crate) fn set_stiffness(&mut self, stiffness: Stiffness) {
        self.stiffness = stiffness;
    }

    /// A copy, if the body can make one of itself.
    pub(crate) fn copy(&self) -> Option<Self> {
        Some(Self::times(self.made.duplicate()?, self.stiffness))
    }

    fn is_as_made(&self) -> bool {
        self.stiffness == Stiffness::default()
    }
}

fn slow(state: &State, stiffness: Stiffness, slowed: &mut State) {
    slowed.positions.clone_from(&state.positions);
    slowed.velocities.clear();
    slowed.velocities.extend(state.velocities.iter().map(|velocity| velocity / stiffness.root()));
}

impl Body for Stiffened {
    fn rest(&self) -> &[Vec3] {
        self.made.rest()
    }

    fn inverse_masses(&self) -> &[f64] {
        self.made.inverse_masses()
    }

    fn surface(&self) -> &Surface {
        self.made.surface()
    }

    fn forces(&mut self, state: &State, forces: &mut [Vec3]) {
        if self.is_as_made() {
            return self.made.forces(state, forces);
        }
        slow(state, self.stiffness, &mut self.slowed);
        self.made.forces(&self.slowed, forces);
        forces.iter_mut().for_each(|force| *force *= self.stiffness.factor());
    }

    fn stable_share(&mut self, state: &State) -> f64 {
        self.made.stable_share(state)
    }

    fn node_forces(&self, state: &State, nodes: &[u32], forces: &mut [Vec3]) {
        if self.is_as_made() {
            return self.made.node_forces(state, nodes, forces);
        }
        let mut slowed = State::default();
        slow(state, self.stiffness, &mut slowed);
        self.made.node_forces(&slowed, nodes, forces);
        forces.iter_mut().for_each(|force| *force *= self.stiffness.factor());
    }

    fn tangent(&self, state: &State, nodes: &[u32], clamp: bool, emit: &mut dyn FnMut(TangentBlock)) {
        if self.is_as_made() {
            return self.made.tangent(state, nodes, clamp, emit);
        }
        let (mut slowed, stiffness) = (State::default(), self.stiffness);
        slow(state, stiffness, &mut slowed);
        self.made.tangent(&slowed, nodes, clamp, &mut |block| {
            let (position, velocity) = (block.position * stiffness.factor(), block.velocity * stiffness.root());
            emit(TangentBlock { position, velocity, ..block });
        });
    }

    fn duplicate(&self) -> Option<Box<dyn Body>> {
        Some(Box::new(self.copy()?))
    }

    fn restriction(&self, nodes: &[u32]) -> Option<Restriction> {
        let restriction = self.made.restriction(nodes)?;
        if self.is_as_made() {
            return Some(restriction);
        }
        let Restriction { nodes, body } = restriction;
        Some(Restriction { nodes, body: Box::new(Self::times(body, self.stiffness)) })
    }

    fn contact_moduli(&self) -> Vec<f64> {
        self.made.contact_moduli().into_iter().map(|modulus| modulus * self.stiffness.factor()).collect()
    }

    fn stress(&self, state: &State, node: u32) -> Option<Mat3> {
        Some(self.made.stress(state, node)? * self.stiffness.factor())
    }

    fn nominal_evaluation(&self) -> f64 {
        self.made.nominal_evaluation()
    }

    fn patch(&self, triangles: &[u32], size: [usize; 3], nodes: &mut Vec<u32>) {
        self.made.patch(triangles, size, nodes);
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;
    use crate::body::Block;
    use crate::integrator::Spectrum;
    use crate::mesh::Face;

    fn block(stiffness: f64) -> Block {
        Block::builder([4; 3], [0.03; 3]).stiffness(stiffness).damping_ratio(0.3).fix(Face::ZMin).build().unwrap()
    }

    /// The nodes of `body` thrown about by what `seed` says, and moving.
    fn thrown(body: &dyn Body, seed: f64) -> State {
        let mut state = State::at_rest(body.rest());
        let wave =
            |n: usize, k: f64| Vec3::new((k * n as f64).sin(), (1.7 * k * n as f64).cos(), (2.3 * k + n as f64).sin());
        for (n, (x, v)) in state.positions.iter_mut().zip(&mut state.velocities).enumerate() {
            (*x, *v) = (*x + wave(n, seed) * 1e-3, wave(n, seed + 1.0) * 0.1);
        }
        state
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(64))]

        /// Check against the paper's definition: k and b = ratio sqrt(2 m k) of a block that was made so stiff.
        #[test]
        fn a_stiffened_block_is_the_block_that_is_made_of_that_stiffness(factor in 0.1..10.0_f64, seed in 0.3..2.0_f64) {
            let (mut made, mut stiffened) = (block(30.0 * factor), Stiffened::new(Box::new(block(30.0))));
            stiffened.set_stiffness(Stiffness::times(factor).unwrap());
            let state = thrown(&made, seed);
            let (mut a, mut b) = (vec![Vec3::zeros(); 64], vec![Vec3::zeros(); 64]);
            made.forces(&state, &mut a);
            stiffened.forces(&state, &mut b);
            let size = a.iter().map(Vec3::norm).fold(0.0, f64::max);
            prop_assert!(a.iter().zip(&b).all(|(a, b)| (a - b).norm() <= 1e-12 * size));
            let nodes: Vec<u32> = (20..40).collect();
            for clamp in [true, false] {
                let (mut ours, mut theirs) = (Vec::new(), Vec::new());
                stiffened.tangent(&state, &nodes, clamp, &mut |block| ours.push(block));
                made.tangent(&state, &nodes, clamp, &mut |block| theirs.push(block));
                prop_assert_eq!(ours.len(), theirs.len());
                for (ours, theirs) in ours.iter().zip(&theirs) {
                    prop_assert!((ours.position - theirs.position).norm() <= 1e-10 * theirs.position.norm().max(1.0));
                    prop_assert!((ours.velocity - theirs.velocity).norm() <= 1e-10 * theirs.velocity.norm().max(1e-6));
                }
            }
        }

        /// Check that no way to a stiffness overshoots it or is faster than it may be.
        #[test]
        fn stiffness_goes_to_its_target_and_stays(from in 0.1..10.0_f64, to in 0.1..10.0_f64) {
            let target = Stiffness::times(to).unwrap();
            let mut now = Stiffness::times(from).unwrap();
            for _ in 0..1100 {
                let next = now.towards(target, 1e-3);
                prop_assert!((next.0 / now.0).ln().abs() <= 4.7e-3);
                prop_assert!((to - next.0).abs() <= (to - now.0).abs());
                now = next;
            }
            prop_assert_eq!(now, target);
        }
    }

    #[test]
    fn a_body_as_it_was_made_is_the_same_to_the_last_bit() {
        let (mut made, mut same) = (block(30.0), Stiffened::new(Box::new(block(30.0))));
        let state = thrown(&made, 0.7);
        let (mut a, mut b) = (vec![Vec3::zeros(); 64], vec![Vec3::zeros(); 64]);
        made.forces(&state, &mut a);
        same.forces(&state, &mut b);
        assert_eq!(a, b);
    }

    #[test]
    fn the_stiffest_body_that_its_steps_bear_asks_for_just_these_steps() {
        let spectrum = Spectrum::estimate(&mut block(30.0));
        for substeps in 1..5 {
            let most = Stiffness::largest(spectrum.stable_step(), 1e-3, substeps);
            let needed = |factor: f64| Spectrum::estimate(&mut block(30.0 * factor)).substeps(1e-3);
            assert!(most.factor() == 1.0 || needed(0.999 * most.factor()) <= substeps, "{most:?}");
            assert!(needed(1.01 * most.factor()) > substeps, "{most:?}");
        }
    }
}
