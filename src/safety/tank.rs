//! The energy tank: what a swap of local models may cost.
//!
//! A resync changes the force at once, whatever the tool does: an active step, which no spring or damper would make. As in
//! the tanks of variable impedance control (Ferraguti, Secchi and Fantuzzi 2013), T = x_t^2 / 2 is filled by what the
//! environment dissipates, and an active term passes only while T > T_min. A step J that passes costs what it can do more
//! than one that is blended over the time t: the work J v t / 2 on a tool that moves with v, and J^2 t^2 / (4 m) on one
//! that it sets in motion itself. A step that the tank cannot pay is blended.

use super::force::{Force, dot, norm};

/// The limits of the energy tank that pays for steps of model swaps.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Tank {
    /// Energy that the tank holds at the start, and at most (J).
    pub capacity_j: f64,
    /// Energy below which nothing active passes (J).
    pub min_j: f64,
    /// Time over which a step is blended that cannot be paid (s).
    pub blend_s: f64,
}

impl Default for Tank {
    fn default() -> Self {
        Self { capacity_j: 1e-3, min_j: 1e-5, blend_s: 0.01 }
    }
}

/// Mass of the lightest tool (kg): the Phantom's, of those that are common.
const LIGHTEST_TOOL_KG: f64 = 0.05;

/// What is in the tank, and what is still held back of steps.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TankState {
    energy_j: f64,
    held_back: Force,
    /// How much of `held_back` goes per second (N/s).
    rate: f64,
}

impl TankState {
    /// A full tank.
    pub(crate) fn new(limits: &Tank) -> Self {
        Self { energy_j: limits.capacity_j, held_back: [0.0; 3], rate: 0.0 }
    }

    /// What is in it (J).
    pub(crate) fn energy_j(&self) -> f64 {
        self.energy_j
    }

    /// Adds what was dissipated (J).
    pub(crate) fn fill(&mut self, limits: &Tank, dissipated_j: f64) {
        // Also refuses what is no number.
        if dissipated_j > 0.0 {
            self.energy_j = (self.energy_j + dissipated_j).min(limits.capacity_j);
        }
    }

    /// The force in place of `force` (N), which contains a step of `step` (N) from a swap, for a tool of `velocity` (m/s);
    /// and whether something is held back of it.
    pub(crate) fn pass(
        &mut self,
        limits: &Tank,
        force: Force,
        step: Force,
        velocity: [f64; 3],
        dt: f64,
    ) -> (Force, bool) {
        let size = norm(self.held_back);
        let left = if size > self.rate * dt { 1.0 - self.rate * dt / size } else { 0.0 };
        self.held_back = self.held_back.map(|c| c * left);
        let size = norm(step);
        if size > 0.0 && size.is_finite() {
            let pushed = size * limits.blend_s;
            let cost = 0.5 * pushed * dot(velocity, velocity).sqrt() + pushed * pushed / (4.0 * LIGHTEST_TOOL_KG);
            if self.energy_j - cost > limits.min_j {
                self.energy_j -= cost;
            } else {
                self.held_back = std::array::from_fn(|i| self.held_back[i] - step[i]);
                self.rate = norm(self.held_back) / limits.blend_s;
            }
        }
        let acts = self.held_back != [0.0; 3];
        (if acts { std::array::from_fn(|i| force[i] + self.held_back[i]) } else { force }, acts)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const STEP: Force = [0.4, 0.0, 0.0];

    #[test]
    fn a_full_tank_lets_a_step_pass_and_pays_for_it() {
        let limits = Tank::default();
        let mut tank = TankState::new(&limits);
        assert_eq!(tank.pass(&limits, [1.4, 0.0, 0.0], STEP, [0.0, 0.1, 0.0], 1e-3), ([1.4, 0.0, 0.0], false));
        // 0.4 N over 10 ms: half of 0.4 mJ on a tool of 0.1 m/s, and the square of 4 mN s by 0.2 kg.
        let cost = 0.5 * 4e-3 * 0.1 + 16e-6 / 0.2;
        assert!((limits.capacity_j - tank.energy_j() - cost).abs() < 1e-15);
    }

    #[test]
    fn an_empty_tank_blends_it_and_what_is_dissipated_fills_it_again() {
        let limits = Tank::default();
        let mut tank = TankState { energy_j: 0.0, ..TankState::new(&limits) };
        let (first, acted) = tank.pass(&limits, [1.4, 0.0, 0.0], STEP, [0.0; 3], 1e-3);
        assert!(acted && (first[0] - 1.0).abs() < 1e-12, "the old force: {first:?}");
        let forces: Vec<f64> =
            (0..11).map(|_| tank.pass(&limits, [1.4, 0.0, 0.0], [0.0; 3], [0.0; 3], 1e-3).0[0]).collect();
        assert!(forces.windows(2).all(|pair| pair[1] >= pair[0] && pair[1] - pair[0] < 0.0401), "{forces:?}");
        assert_eq!(forces[10], 1.4);
        tank.fill(&limits, f64::NAN);
        assert_eq!(tank.energy_j(), 0.0);
        tank.fill(&limits, 1.0);
        assert_eq!(tank.energy_j(), limits.capacity_j);
        assert!(!tank.pass(&limits, [1.4, 0.0, 0.0], STEP, [0.0; 3], 1e-3).1);
    }
}
