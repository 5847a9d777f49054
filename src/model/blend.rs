//! How the force moves from an old local model to a new one.

use super::Vec3;

/// A crossfade of two running models: the weight of the new one grows linearly over `ticks`; 0 ticks is a switch.
///
/// # Real-time
/// A plain value: its methods are wait-free and real-time safe.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Crossfade {
    ticks: u32,
    /// Ticks since the swap; `None` when no old model is needed any more.
    elapsed: Option<u32>,
    /// What the blend added to the new model's force in the last tick (N).
    residue: Vec3,
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

impl Crossfade {
    /// A blend over `ticks` haptic ticks.
    pub fn new(ticks: u32) -> Self {
        Self { ticks, ..Self::default() }
    }

    /// Starts with a new model in place: from now on both are asked.
    pub fn begin(&mut self) {
        self.elapsed = Some(0);
        self.jump = Jump::default();
    }

    /// True while the old model has to run too.
    pub fn needs_old(&self) -> bool {
        self.elapsed.is_some()
    }

    /// The blended force of one tick, and the resync's jump when the blend is over.
    pub fn mix(&mut self, new: Vec3, old: Vec3) -> (Vec3, Option<Jump>) {
        let Some(elapsed) = self.elapsed else { return (new, None) };
        let weight = if self.ticks == 0 { 1.0 } else { (f64::from(elapsed) / f64::from(self.ticks)).min(1.0) };
        let residue = (old - new) * (1.0 - weight);
        if elapsed == 0 {
            self.jump.before = (old - new).norm();
            // Before the swap the force was the old one: as if the blend had added all of the difference.
            self.residue = old - new;
        }
        self.jump.after = self.jump.after.max((residue - self.residue).norm());
        self.residue = residue;
        let over = weight >= 1.0;
        self.elapsed = (!over).then_some(elapsed + 1);
        (if over { new } else { new + residue }, over.then_some(self.jump))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn constant(ticks: u32) -> (Vec<f64>, Jump) {
        let mut blend = Crossfade::new(ticks);
        blend.begin();
        let mut forces = Vec::new();
        loop {
            let (force, done) = blend.mix(Vec3::x() * 2.0, Vec3::x());
            forces.push(force.x);
            if let Some(jump) = done {
                return (forces, jump);
            }
        }
    }

    #[test]
    fn a_switch_leaves_the_whole_jump() {
        let (forces, jump) = constant(0);
        assert_eq!(forces, [2.0]);
        assert_eq!(jump, Jump { before: 1.0, after: 1.0 });
    }

    #[test]
    fn a_crossfade_over_ten_ticks_leaves_a_tenth() {
        let (forces, jump) = constant(10);
        assert_eq!(forces[0], 1.0);
        assert_eq!(forces.len(), 11);
        assert!((jump.after - 0.1).abs() < 1e-12 && jump.before == 1.0);
        assert!(forces.windows(2).all(|f| f[1] > f[0]));
    }
}
