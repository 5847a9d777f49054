//! How the force moves from an old local model to a new one.

use crate::{Vec3, Wrench};

/// The ways of blending an old model's force into a new one's.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Deserialize, serde::Serialize), serde(rename_all = "snake_case"))]
pub enum BlendKind {
    /// The new model's force at once.
    #[default]
    None,
    /// Old and new model both run; the force moves linearly from one to the other.
    Crossfade,
    /// The new model runs; the step to it is added to its force and decays smoothly.
    Offset,
}

/// The blend of one resync after the other, each over a number of ticks.
///
/// # Real-time
/// A plain value: its methods are wait-free and real-time safe.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Blend {
    kind: BlendKind,
    ticks: u32,
    /// Ticks since the swap; `None` when it is over.
    elapsed: Option<u32>,
    /// The step at the swap: the old model's force and torque less the new one's.
    step: Wrench,
    /// What the blend added to the new model's in the last tick.
    residue: Wrench,
    /// What the swap and its blend changed in the last tick (N).
    step_now: Vec3,
    jump: Jump,
}

/// The discontinuity of one resync.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Jump {
    /// Difference of the new and the old model's force in the first tick (N).
    pub before: f64,
    /// Largest one-tick change of the force that the blend leaves of it (N).
    pub after: f64,
}

impl Blend {
    /// A blend of the given kind over `ticks` haptic ticks; 0 ticks is a switch.
    pub fn new(kind: BlendKind, ticks: u32) -> Self {
        Self { kind, ticks: if kind == BlendKind::None { 0 } else { ticks }, ..Self::default() }
    }

    /// Starts with a new model in place.
    pub(crate) fn begin(&mut self) {
        self.elapsed = Some(0);
        self.jump = Jump::default();
    }

    /// True until the force is the new model's alone.
    pub(crate) fn is_under_way(&self) -> bool {
        self.elapsed.is_some()
    }

    /// True while the old model has to run too: as long as a crossfade lasts, else in the first tick.
    pub(crate) fn needs_old(&self) -> bool {
        match self.kind {
            BlendKind::Crossfade => self.is_under_way(),
            BlendKind::None | BlendKind::Offset => self.elapsed == Some(0),
        }
    }

    /// How much of the force's change in the last tick was the swap's, not the model's (N). Read it after [`mix`](Self::mix).
    pub(crate) fn step_now(&self) -> Vec3 {
        self.step_now
    }

    /// The blended force and torque of one tick, and the resync's jump when the blend is over. `old` is read where it is
    /// [needed](Self::needs_old).
    pub(crate) fn mix(&mut self, new: Wrench, old: Wrench) -> (Wrench, Option<Jump>) {
        let Some(elapsed) = self.elapsed else {
            self.step_now = Vec3::zeros();
            return (new, None);
        };
        if elapsed == 0 {
            self.step = old - new;
            self.jump.before = self.step.force.norm();
            // Before the swap the force was the old one: as if the blend had added all of the difference.
            self.residue = self.step;
        }
        let share = if self.ticks == 0 { 1.0 } else { (f64::from(elapsed) / f64::from(self.ticks)).min(1.0) };
        let residue = match self.kind {
            BlendKind::Crossfade => (old - new) * (1.0 - share),
            BlendKind::None | BlendKind::Offset => self.step * (1.0 - minimum_jerk(share)),
        };
        self.step_now = (self.residue - residue).force;
        self.jump.after = self.jump.after.max(self.step_now.norm());
        self.residue = residue;
        let over = share >= 1.0;
        self.elapsed = (!over).then_some(elapsed + 1);
        (if over { new } else { new + residue }, over.then_some(self.jump))
    }
}

/// From 0 to 1 with neither velocity nor acceleration at the ends.
fn minimum_jerk(share: f64) -> f64 {
    share * share * share * (10.0 + share * (6.0 * share - 15.0))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn constant(kind: BlendKind, ticks: u32) -> (Vec<f64>, Jump) {
        let mut blend = Blend::new(kind, ticks);
        blend.begin();
        let mut forces = Vec::new();
        loop {
            let (force, done) = blend.mix((Vec3::x() * 2.0).into(), Vec3::x().into());
            forces.push(force.force.x);
            if let Some(jump) = done {
                return (forces, jump);
            }
        }
    }

    #[test]
    fn a_switch_leaves_the_whole_jump() {
        for (kind, ticks) in [(BlendKind::None, 10), (BlendKind::Crossfade, 0), (BlendKind::Offset, 0)] {
            let (forces, jump) = constant(kind, ticks);
            assert_eq!(forces, [2.0]);
            assert_eq!(jump, Jump { before: 1.0, after: 1.0 });
        }
    }

    #[test]
    fn a_crossfade_over_ten_ticks_leaves_a_tenth() {
        let (forces, jump) = constant(BlendKind::Crossfade, 10);
        assert_eq!(forces[0], 1.0);
        assert_eq!(forces.len(), 11);
        assert!((jump.after - 0.1).abs() < 1e-12 && jump.before == 1.0);
        assert!(forces.windows(2).all(|f| f[1] > f[0]));
    }

    #[test]
    fn an_offset_decays_smoothly_and_asks_the_old_model_once() {
        let (forces, jump) = constant(BlendKind::Offset, 10);
        assert_eq!((forces[0], forces.len()), (1.0, 11));
        assert!(forces.windows(2).all(|f| f[1] > f[0]));
        // 15/8 of the mean slope in the middle, next to nothing at both ends.
        assert!(jump.after < 1.9 * 0.1 && jump.after > 0.17, "{jump:?}");
        assert!(forces[1] - forces[0] < 0.01 && forces[10] - forces[9] < 0.01, "{forces:?}");

        let mut blend = Blend::new(BlendKind::Offset, 4);
        blend.begin();
        assert!(blend.needs_old());
        blend.mix(Vec3::x().into(), Wrench::default());
        for _ in 0..4 {
            assert!(blend.is_under_way() && !blend.needs_old());
            // The old model no longer counts.
            assert!(blend.mix(Vec3::x().into(), Vec3::repeat(f64::NAN).into()).0.force.x <= 1.0);
        }
        assert!(!blend.is_under_way());
    }
}
