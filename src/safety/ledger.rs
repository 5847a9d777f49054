//! Passivity, the observer: how much energy the virtual environment has taken in through the tool.
//!
//! Hannaford and Ryu, "Time-domain passivity control of haptic interfaces", IEEE Trans. Robotics and Automation 18 (2002).
//! The device holds f(k-1) until release k, so what it did on the way from x(k-1) to x(k) is exactly f(k-1) . (x(k) -
//! x(k-1)): nothing is estimated. f is the force on the tool that was really commanded, so whatever a later stage cut from
//! the answer of the controller is not forgotten.

use super::{Force, dot, norm};

/// No hand on a device is faster (m/s).
const FASTEST_HAND_M_S: f64 = 10.0;

/// The energy of one contact.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Ledger {
    /// E(k) + E(0): taken in less given out, and what was stored at the start (J).
    balance_j: f64,
    last: Option<[f64; 3]>,
}

impl Ledger {
    /// A ledger of an environment that stores `stored_j` (J) at the start.
    ///
    /// # Real-time
    /// Wait-free, real-time safe.
    pub fn new(stored_j: f64) -> Self {
        Self { balance_j: stored_j, last: None }
    }

    /// Books the motion of the tool to `position` (m) within `dt` (s) under the held force `held` (N), and gives the
    /// velocity (m/s) and whether it was believed: a step that no hand makes is a fault of the measurement, not work.
    ///
    /// # Real-time
    /// Wait-free, real-time safe.
    pub fn book(&mut self, held: Force, position: [f64; 3], dt: f64) -> ([f64; 3], bool) {
        let moved = self.last.map_or([0.0; 3], |last| std::array::from_fn(|i| position[i] - last[i]));
        self.last = Some(position);
        let velocity = moved.map(|c| c / dt);
        let believed = norm(velocity) <= FASTEST_HAND_M_S;
        if believed {
            self.balance_j -= dot(held, moved);
        }
        (velocity, believed)
    }

    /// E(k) + E(0) (J): while it is not negative the environment is passive.
    ///
    /// # Real-time
    /// Wait-free, real-time safe.
    pub fn balance_j(&self) -> f64 {
        self.balance_j
    }

    /// Forgets where the tool was: over a gap nobody knows what was exerted.
    ///
    /// # Real-time
    /// Wait-free, real-time safe.
    pub fn forget_position(&mut self) {
        self.last = None;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    // Check that a sampled spring gives out exactly K T v x more than it takes in: the leak that the literature names.
    #[test]
    fn the_ledger_sees_the_leak_of_a_sampled_spring() {
        let (k, v, ticks) = (500.0, 0.1, 100);
        let mut ledger = Ledger::new(0.0);
        let place = |n: i32| v * 1e-3 * f64::from(if n <= ticks { n } else { 2 * ticks - n });
        let mut held = [0.0; 3];
        for n in 0..=2 * ticks {
            ledger.book(held, [-place(n), 0.0, 0.0], 1e-3);
            held = [k * place(n), 0.0, 0.0];
        }
        let leak = k * (v * 1e-3) * (v * 1e-3) * f64::from(ticks);
        assert!((ledger.balance_j() + leak).abs() < 1e-15, "{} J, not {leak}", ledger.balance_j());
    }

    #[test]
    fn the_first_position_and_the_one_after_a_gap_cost_nothing() {
        let mut ledger = Ledger::new(0.5);
        assert_eq!(ledger.book([1.0; 3], [9.0; 3], 1e-3), ([0.0; 3], true));
        ledger.forget_position();
        assert_eq!(ledger.book([1.0; 3], [-9.0; 3], 1e-3), ([0.0; 3], true));
        assert_eq!(ledger.balance_j(), 0.5);
        assert!(!ledger.book([1.0; 3], [-9.02, -9.0, -9.0], 1e-3).1);
        assert_eq!(ledger.balance_j(), 0.5, "a teleport is no work");
    }
}
