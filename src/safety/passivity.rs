//! Stage 5, passivity: an observer keeps the energy that the virtual environment has taken in through the tool, and a
//! controller pays back what the environment has given out beyond what it had.
//!
//! Hannaford and Ryu, "Time-domain passivity control of haptic interfaces", IEEE Trans. Robotics and Automation 18 (2002).
//! The device holds f(k-1) until release k, so what it did on the way from x(k-1) to x(k) is exactly f(k-1) . (x(k) -
//! x(k-1)): nothing is estimated. f is the force on the tool that was really commanded, so whatever a later stage cut from
//! the answer of the controller is not forgotten.
//!
//! The damper is theirs: with the balance E + E(0) < 0 it adds -alpha v, alpha = -(E + E(0)) / (dt
//! |v|^2), no more than the device renders stably. What that cap leaves is carried: the balance stays negative. The cap also
//! means that the damper alone guarantees nothing, so the deficit withdraws the force as well, all of it at the tolerance. It does
//! so whichever way the tool moves: what depended on the motion's direction would switch with every tremor, and what switches
//! within a tick of delay gives out energy by itself.

use super::force::{Force, dot, norm};

/// The limits of the passivity controller.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Passivity {
    /// Energy that the environment stores at the start (J).
    pub stored_j: f64,
    /// Deficit at which no force is left (J).
    pub tolerance_j: f64,
    /// Largest damping (N s/m): what the device renders stably.
    pub max_damping_n_s_per_m: f64,
    /// Speed up to which a motion may be nothing but noise: no damping (m/s).
    pub noise_m_s: f64,
}

impl Passivity {
    /// The deficit that can stand in the ledger after all (J), for commands up to `max_force_n` that change by
    /// `max_slew_n_per_s` at most and a tool no faster than `speed_m_s`: the tolerance, and what the force does in the tick
    /// `dt` (s) before it is noticed and while the slew limit still lets it go.
    ///
    /// # Real-time
    /// Wait-free, real-time safe.
    pub fn bound_j(&self, max_force_n: f64, max_slew_n_per_s: f64, speed_m_s: f64, dt: f64) -> f64 {
        self.tolerance_j + max_force_n * speed_m_s * (dt + max_force_n / (2.0 * max_slew_n_per_s))
    }
}

/// What the controller made of a force.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Controlled {
    /// The force (N).
    pub force: Force,
    /// Damping that was added (N s/m).
    pub damping: f64,
    /// The force was shortened.
    pub withdrew: bool,
}

/// The force in place of `force` (N) with `balance_j` = E + E(0) in the ledger, for a tool that moves with `velocity` (m/s).
pub(crate) fn control(limits: &Passivity, balance_j: f64, force: Force, velocity: [f64; 3], dt: f64) -> Controlled {
    // Also what is no number: an unknown balance is no surplus.
    if balance_j >= 0.0 {
        return Controlled { force, damping: 0.0, withdrew: false };
    }
    let deficit = if balance_j.is_finite() { -balance_j / limits.tolerance_j } else { 1.0 };
    let speed_squared = dot(velocity, velocity);
    let moves = speed_squared > limits.noise_m_s * limits.noise_m_s;
    let share = (1.0 - deficit).max(0.0);
    let kept = force.map(|c| c * share);
    let wanted = deficit * limits.tolerance_j / (dt * speed_squared);
    let damping = if moves { wanted.min(limits.max_damping_n_s_per_m) } else { 0.0 };
    let damping = if damping.is_finite() { damping } else { 0.0 };
    Controlled { force: std::array::from_fn(|i| kept[i] - damping * velocity[i]), damping, withdrew: kept != force }
}

/// No hand on a device is faster (m/s): the force is gone at a fifth of it (`safety.stop_speed_m_s`), and a quick reach of the
/// free arm has 2 to 4 m/s.
pub(crate) const FASTEST_HAND_M_S: f64 = 10.0;

/// A device whose position stays the same for longer is at rest (s): those with 60 states a second have a new one every 17 ms.
const SLOWEST_DEVICE_S: f64 = 0.02;

/// The energy of one contact.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Ledger {
    /// E(k) + E(0): taken in less given out, and what was stored at the start (J).
    balance_j: f64,
    last: Option<[f64; 3]>,
    /// How fast the tool was when it was last told to be somewhere else (m/s), how long it had taken to get there, and how long ago
    /// that is (s).
    velocity: [f64; 3],
    took: f64,
    since: f64,
}

impl Ledger {
    /// A ledger of an environment that stores `stored_j` (J) at the start.
    pub(crate) fn new(stored_j: f64) -> Self {
        Self { balance_j: stored_j, ..Self::default() }
    }

    /// Books the motion of the tool to `position` (m) within `dt` (s) under the held force `held` (N), and gives the
    /// velocity (m/s) and whether it was believed: a step that no hand makes is a fault of the measurement, not work.
    ///
    /// A device that is slower than the ticks repeats a position. Its tool is as fast as before for as long as the last step took, and
    /// from then on as if that step were about to come.
    pub(crate) fn book(&mut self, held: Force, position: [f64; 3], dt: f64) -> ([f64; 3], bool) {
        let Some(last) = self.last.replace(position) else { return ([0.0; 3], true) };
        self.since += dt;
        if position == last {
            let slower = (self.took / self.since).min(1.0);
            return (self.velocity.map(|c| c * slower), true);
        }
        let moved: [f64; 3] = std::array::from_fn(|i| position[i] - last[i]);
        self.took = self.since.min(SLOWEST_DEVICE_S).max(dt);
        self.since = 0.0;
        let velocity = moved.map(|c| c / self.took);
        let believed = norm(velocity) <= FASTEST_HAND_M_S;
        self.velocity = if believed { velocity } else { [0.0; 3] };
        if believed {
            self.balance_j -= dot(held, moved);
        }
        (velocity, believed)
    }

    /// E(k) + E(0) (J): while it is not negative the environment is passive.
    pub(crate) fn balance_j(&self) -> f64 {
        self.balance_j
    }

    /// Forgets where the tool was: over a gap nobody knows what was exerted.
    pub(crate) fn forget_position(&mut self) {
        *self = Self { balance_j: self.balance_j, ..Self::default() };
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const LIMITS: Passivity =
        Passivity { stored_j: 0.0, tolerance_j: 1e-3, max_damping_n_s_per_m: 5.0, noise_m_s: 0.01 };

    #[test]
    fn a_passive_environment_is_left_alone() {
        let controlled = control(&LIMITS, 0.0, [1.0, 2.0, 3.0], [0.1; 3], 1e-3);
        assert_eq!((controlled.force, controlled.damping, controlled.withdrew), ([1.0, 2.0, 3.0], 0.0, false));
    }

    // Check that the damper asks for exactly the deficit in one tick, where the cap allows it.
    #[test]
    fn the_damper_pays_the_deficit_back_in_one_tick_or_as_much_as_the_device_can() {
        let (v, dt) = (0.2, 1e-3);
        let paid = control(&LIMITS, -1e-5, [0.0; 3], [v, 0.0, 0.0], dt);
        assert!((paid.force[0] * v * dt + 1e-5).abs() < 1e-18, "{paid:?}");
        let capped = control(&LIMITS, -1e-3, [0.0; 3], [v, 0.0, 0.0], dt);
        assert_eq!(capped.damping, 5.0);
        assert_eq!(control(&LIMITS, -1e-4, [0.0; 3], [0.009, 0.0, 0.0], dt).damping, 0.0, "noise is not damped");
    }

    #[test]
    fn a_deficit_takes_its_share_of_the_force_whichever_way_the_tool_moves() {
        let limits = Passivity { max_damping_n_s_per_m: 0.0, ..LIMITS };
        let force = |balance: f64, v: [f64; 3]| control(&limits, balance, [1.0, 0.0, 2.0], v, 1e-3).force;
        for v in [[0.1, 0.0, 0.0], [-0.1, 0.0, 0.0], [0.0; 3]] {
            let quarter = force(-0.25e-3, v);
            assert!((quarter[0] - 0.75).abs() < 1e-12 && (quarter[2] - 1.5).abs() < 1e-12, "{quarter:?}");
            assert_eq!([force(-1e-3, v), force(-2e-3, v), force(f64::NAN, v)], [[0.0; 3]; 3]);
        }
    }

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

    // A device with 60 states a second that repeats each: it is as fast as its hand, and not seventeen times as fast in one tick of as many.
    #[test]
    fn a_slow_device_is_as_fast_as_its_hand_and_comes_to_rest() {
        let (mut ledger, hand) = (Ledger::new(0.0), 0.3);
        let mut speeds = Vec::new();
        for tick in 0..300 {
            let told = f64::from((tick / 17).min(10)) * 17e-3 * hand;
            speeds.push(norm(ledger.book([0.0; 3], [told, 0.0, 0.0], 1e-3).0));
        }
        assert!(speeds[17..187].iter().all(|speed| (speed - hand).abs() < 1e-9), "{speeds:?}");
        assert!(speeds[187..].windows(2).all(|pair| pair[1] <= pair[0]) && speeds[299] < 0.2 * hand, "{speeds:?}");
        // After a rest it is not taken for slow.
        assert!(norm(ledger.book([0.0; 3], [10.0, 0.0, 0.0], 1e-3).0) > FASTEST_HAND_M_S);
    }
}
