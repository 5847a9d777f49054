//! Friction of a surface: what it takes to break it loose, and what it feels while it slides.

use super::ContactMode;
use crate::Vec3;
use crate::bytes::{BytesReader, BytesWriter};

/// Rounds for the speed of sliding. They come down on it from above, so that fewer than it takes leave a speed that is a little
/// too high and a friction that is a little too low, never one outside the cone.
const ROUNDS: usize = 32;
/// A round that changes the speed by less than this share was the last.
const CONVERGED: f64 = 1e-12;

/// Coulomb friction that may take more to break loose than to keep sliding, with the fall from one to the other that Stribeck
/// measured.
///
/// A contact that sticks holds up to `breakaway` N under the normal force N. One that slides at v m/s feels mu(v) N with
///
/// ```text
/// mu(v) = kinetic + (breakaway - kinetic) exp(-(v / stribeck)^2)
/// ```
///
/// Which of the two it does is settled by what it did in the step before: a contact that stuck sticks on as long as the
/// breakaway force holds it; one that slid, or is new, sticks only where it could not slide on. Between the two limits it
/// stays what it was, so that no step length makes it change from one to the other and back.
///
/// One number makes the friction of Coulomb, `Friction::from(0.5)`; an infinite one sticks until it is pulled off.
///
/// ```
/// use palpate_model::Vec3;
/// use palpate_model::contact::{ContactMode, Friction};
///
/// let rubber = Friction { kinetic: 0.4, breakaway: 0.8, stribeck: 0.0 };
/// // 0.6 mN s would hold the surface that is pressed with 1 mN s: less than it takes to break it loose, more than it takes
/// // to keep it sliding.
/// let holds = Vec3::new(6e-4, 0.0, 0.0);
/// assert_eq!(rubber.resolve(true, holds, 1e-3, 1000.0), (ContactMode::Stick, holds));
/// let (mode, impulse) = rubber.resolve(false, holds, 1e-3, 1000.0);
/// assert_eq!(mode, ContactMode::Slip);
/// assert!((impulse.x - 4e-4).abs() < 1e-15);
/// ```
///
/// # Real-time
/// A plain value: its methods are wait-free and real-time safe.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Friction {
    /// The coefficient of fast sliding, at least 0; infinite for a contact that never slides.
    pub kinetic: f64,
    /// The coefficient that breaks a sticking contact loose; below `kinetic` it counts as that.
    pub breakaway: f64,
    /// The speed (m/s) over which the coefficient falls from one to the other; 0 for a fall at once.
    pub stribeck: f64,
}

impl From<f64> for Friction {
    fn from(coefficient: f64) -> Self {
        Self { kinetic: coefficient, breakaway: coefficient, stribeck: 0.0 }
    }
}

impl Friction {
    /// True if it takes more to break loose than to keep sliding; else there is one coefficient, `kinetic`.
    pub fn breaks_away(&self) -> bool {
        self.breakaway > self.kinetic
    }

    /// The same with no coefficient above `most`.
    pub(super) fn at_most(&self, most: f64) -> Self {
        Self { kinetic: self.kinetic.min(most), breakaway: self.breakaway.min(most), ..*self }
    }

    /// Appends it to what crosses a link.
    ///
    /// # Real-time
    /// Not for a tick: allocates.
    pub fn write(&self, to: &mut BytesWriter<'_>) {
        [self.kinetic, self.breakaway, self.stribeck].into_iter().for_each(|number| to.f64(number));
    }

    /// Takes what [`write`](Self::write) has appended; `None` if it is no friction.
    ///
    /// # Real-time
    /// Wait-free, real-time safe.
    pub fn read(from: &mut BytesReader<'_>) -> Option<Self> {
        // That of a contact that never slides is infinite.
        let mut coefficient = || from.u64().map(f64::from_bits).filter(|&coefficient| coefficient >= 0.0);
        let [kinetic, breakaway] = [coefficient()?, coefficient()?];
        Some(Self { kinetic, breakaway, stribeck: from.f64().filter(|&speed| speed >= 0.0)? })
    }

    /// The coefficient of a contact that slides at `speed` (m/s).
    pub fn sliding(&self, speed: f64) -> f64 {
        if !self.is_gradual() {
            return self.kinetic;
        }
        let share = (-(speed / self.stribeck).powi(2)).exp();
        self.kinetic + (self.breakaway - self.kinetic) * share
    }

    /// True if the coefficient of sliding depends on the speed.
    pub(super) fn is_gradual(&self) -> bool {
        self.breaks_away() && self.stribeck > 0.0
    }

    /// The coefficient up to which a contact sticks for sure, one that stuck in the step before and one that did not.
    pub(super) fn holding(&self, was_sticking: bool) -> f64 {
        if was_sticking && self.breaks_away() { self.breakaway } else { self.kinetic }
    }

    /// What a contact does in a step, and the tangential impulse (N s) that follows: to stick it takes `holds` (N s), `normal`
    /// (N s) presses it, and its point has the `compliance` S (1/kg).
    ///
    /// The speed v of sliding solves v = |u_t| - S mu(v) J_n with u_t = S `holds` and J_n = `normal`; of several solutions the
    /// fastest is taken, and where there is none the contact sticks. The impulse has the direction of `holds`, is within the
    /// cone of `breakaway`, and never turns the sliding round. Without a press, and for what is not a number, there is none.
    pub fn resolve(&self, was_sticking: bool, holds: Vec3, normal: f64, compliance: f64) -> (ContactMode, Vec3) {
        let size = holds.norm();
        // Written so that what is not a number releases.
        if !(normal > 0.0 && size.is_finite()) {
            return (ContactMode::Free, Vec3::zeros());
        }
        if size > self.holding(was_sticking) * normal
            && let Some(limit) = self.slipping(size, normal, compliance)
        {
            return (ContactMode::Slip, holds * (limit / size));
        }
        (ContactMode::Stick, holds)
    }

    /// The size of the impulse (N s) of a contact that slides, `None` if it cannot.
    fn slipping(&self, holds: f64, normal: f64, compliance: f64) -> Option<f64> {
        let mut limit = self.kinetic * normal;
        if !self.is_gradual() {
            return Some(limit);
        }
        // mu falls with v, so that v is an upper bound of every solution, and so is what follows from it.
        let mut speed = compliance * (holds - limit);
        for _ in 0..ROUNDS {
            limit = self.sliding(speed) * normal;
            let next = compliance * (holds - limit);
            if next.is_nan() || next <= 0.0 {
                // Sticking: within the cone but for rounding, and for a compliance that is not a number.
                let most = self.breakaway * normal;
                return (holds > most).then_some(most);
            }
            if speed - next <= CONVERGED * speed {
                break;
            }
            speed = next;
        }
        Some(limit)
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    fn frictions() -> impl Strategy<Value = Friction> {
        let stribeck = prop_oneof![Just(0.0), 1e-4..1.0_f64];
        (0.0..2.0_f64, 0.0..2.0_f64, stribeck).prop_map(|(kinetic, more, stribeck)| Friction {
            kinetic,
            breakaway: kinetic + more,
            stribeck,
        })
    }

    fn tangential() -> impl Strategy<Value = Vec3> {
        (-2e-3..2e-3_f64, -2e-3..2e-3_f64).prop_map(|(x, y)| Vec3::new(x, y, 0.0))
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(4000))]

        #[test]
        fn no_impulse_leaves_the_cone_of_breakaway(
            friction in frictions(), sticks in any::<bool>(), holds in tangential(), normal in 0.0..2e-3_f64, s in 1.0..1e5_f64,
        ) {
            let (mode, impulse) = friction.resolve(sticks, holds, normal, s);
            prop_assert!(impulse.norm() <= friction.breakaway * normal * (1.0 + 1e-14));
            prop_assert_eq!(mode == ContactMode::Free, normal == 0.0);
            prop_assert!(mode != ContactMode::Stick || impulse == holds);
        }

        /// Check that friction slows sliding, never turns it round, and so gives it no energy.
        #[test]
        fn friction_opposes_sliding_and_gives_it_no_energy(
            friction in frictions(), sticks in any::<bool>(), holds in tangential(), normal in 1e-6..2e-3_f64, s in 1.0..1e5_f64,
        ) {
            let (mode, impulse) = friction.resolve(sticks, holds, normal, s);
            if mode != ContactMode::Slip {
                return Ok(());
            }
            let (before, after) = (holds * s, (holds - impulse) * s);
            prop_assert!(after.dot(&before) > 0.0 && after.cross(&before).norm() <= 1e-14 * before.norm_squared());
            prop_assert!(after.norm() <= before.norm());
            prop_assert!(impulse.norm() >= friction.kinetic * normal * (1.0 - 1e-14), "never below fast sliding");
        }

        /// Check that the step before decides, and nothing else, between the two limits.
        #[test]
        fn a_contact_that_stuck_holds_up_to_breakaway_and_one_that_slid_up_to_what_it_can_slide_with(
            friction in frictions(), share in 0.0..2.0_f64, normal in 1e-6..2e-3_f64, s in 1.0..1e5_f64,
        ) {
            let Friction { kinetic, breakaway, stribeck } = friction;
            let size = (kinetic + (breakaway - kinetic) * (share - 0.5)).max(0.0) * normal;
            let holds = Vec3::new(0.0, size, 0.0);
            let modes = [true, false].map(|sticks| friction.resolve(sticks, holds, normal, s).0);
            prop_assert_eq!(modes[0] == ContactMode::Stick, size <= breakaway * normal);
            if size <= kinetic * normal {
                prop_assert_eq!(modes[1], ContactMode::Stick);
            } else if size > breakaway * normal || stribeck == 0.0 {
                prop_assert_eq!(modes[1], ContactMode::Slip);
            }
        }

        /// Check the speed against a scan from above: the first change of sign there is the fastest solution.
        #[test]
        fn the_fastest_solution_is_taken(
            friction in frictions(), above in 1.0..3.0_f64, normal in 1e-6..2e-3_f64, s in 1.0..1e4_f64,
        ) {
            let kinetic = friction.kinetic;
            let holds = above * kinetic * normal;
            let most = s * (holds - kinetic * normal);
            if friction.stribeck == 0.0 || most == 0.0 {
                return Ok(());
            }
            let left = |v: f64| v - s * (holds - friction.sliding(v) * normal);
            let (mode, impulse) = friction.resolve(false, Vec3::x() * holds, normal, s);
            let speed = if mode == ContactMode::Slip { s * (holds - impulse.x) } else { 0.0 };
            for n in 1..1000 {
                let v = most + (speed - most) * f64::from(n) / 1000.0;
                prop_assert!(left(v) >= -1e-9 * most, "{v} of {most} is faster than {speed}");
            }
            prop_assert!(impulse.x >= kinetic * normal * (1.0 - 1e-14) || mode == ContactMode::Stick);
        }

        /// Check that one number is the plain law, to the last bit.
        #[test]
        fn one_coefficient_is_the_friction_of_coulomb(
            mu in 0.0..2.0_f64, sticks in any::<bool>(), holds in tangential(), normal in 1e-6..2e-3_f64, s in 1.0..1e5_f64,
        ) {
            let limit = mu * normal;
            let expected = if holds.norm() > limit {
                (ContactMode::Slip, holds * (limit / holds.norm()))
            } else {
                (ContactMode::Stick, holds)
            };
            prop_assert_eq!(Friction::from(mu).resolve(sticks, holds, normal, s), expected);
            prop_assert_eq!(Friction::from(f64::INFINITY).resolve(sticks, holds, normal, s), (ContactMode::Stick, holds));
        }
    }

    #[test]
    fn what_is_not_a_number_gives_no_force() {
        let friction = Friction { kinetic: 0.4, breakaway: 0.8, stribeck: 0.01 };
        let none = (ContactMode::Free, Vec3::zeros());
        for sticks in [true, false] {
            assert_eq!(friction.resolve(sticks, Vec3::repeat(f64::NAN), 1.0, 1.0), none);
            assert_eq!(friction.resolve(sticks, Vec3::repeat(f64::INFINITY), 1.0, 1.0), none);
            assert_eq!(friction.resolve(sticks, Vec3::x(), f64::NAN, 1.0), none);
            assert_eq!(friction.resolve(sticks, Vec3::x(), -1.0, 1.0), none);
            let (_, impulse) = friction.resolve(sticks, Vec3::x(), 1.0, f64::NAN);
            assert!(impulse.norm() <= 0.8, "{impulse}");
        }
        assert_eq!(friction.sliding(f64::INFINITY), 0.4);
        assert_eq!(Friction::from(f64::INFINITY).sliding(1.0), f64::INFINITY);
    }
}
