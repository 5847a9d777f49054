//! What is believed of a device: a state outside of its workspace, or farther away than a hand comes in the time, is a fault of
//! the device, and no model sees it.

use crate::devices::DeviceState;
use crate::model::Vec3;
use crate::runtime::Nanos;
use crate::safety::FASTEST_HAND_M_S;

/// The shortest time that a step is divided by (s): the noise of an encoder at a high rate is no motion.
const SHORTEST_STEP_S: f64 = 1e-3;

/// The longest time that a step is divided by while the same position is told again and again, as by a device slower than its
/// group, or positions that are not believed (s).
const LONGEST_STEP_S: f64 = 5e-3;

/// The time for which positions far from the last one must agree with each other to be believed (s): by then no force is
/// left.
const SETTLES_S: f64 = 0.1;

/// How far and how fast a device is believed to go.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Bounds {
    /// Largest distance from the first position (m).
    pub reach_m: f64,
    /// Largest speed (m/s).
    pub speed_m_s: f64,
}

impl Bounds {
    /// The bounds of what has been believed before.
    pub const NONE: Self = Self { reach_m: f64::INFINITY, speed_m_s: f64::INFINITY };

    /// The bounds of a device that reaches so far (m). One whose tool no hand moves may jump: a path says so.
    ///
    /// # Real-time
    /// A plain value: wait-free, real-time safe.
    pub fn of(reach_m: f64, is_held: bool) -> Self {
        Self { reach_m, speed_m_s: if is_held { FASTEST_HAND_M_S } else { f64::INFINITY } }
    }
}

/// The newest state that was not believed, for whoever tells of it.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Disbelieved {
    /// Number of them so far.
    pub count: u64,
    /// The position that was told (m).
    pub position: Vec3,
    /// Its distance (m) from the first position, or from the last that was believed, and the largest possible.
    pub distance_m: f64,
    /// The largest distance that is believed (m).
    pub most_m: f64,
    /// True if it lies outside of the workspace, false if it is too far from the last one.
    pub is_outside: bool,
}

impl std::fmt::Display for Disbelieved {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let [x, y, z]: [f64; 3] = self.position.into();
        let from = if self.is_outside { "where it began" } else { "where it was" };
        write!(
            f,
            "it told [{x}, {y}, {z}] m, {:.4} m from {from}, and at most {:.4} m can be",
            self.distance_m, self.most_m
        )
    }
}

/// The last state that was believed, and the bounds for the next.
#[derive(Clone, Copy, Debug)]
pub struct Believed {
    bounds: Bounds,
    first: Vec3,
    /// The place and the time of its read; none before the first one of the run, which comes as long after the very first as
    /// the start takes.
    last: Option<(Vec3, Nanos)>,
    /// The newest place that was not believed, its time, and since when places agree with it.
    doubted: Option<(Vec3, Nanos, Nanos)>,
    /// The time of the newest state.
    told: Nanos,
}

impl Believed {
    /// Believes `first`, read before the start.
    ///
    /// # Real-time
    /// A plain value: wait-free, real-time safe.
    pub fn new(bounds: Bounds, first: &DeviceState) -> Self {
        Self { bounds, first: first.position, last: None, doubted: None, told: Nanos::ZERO }
    }

    /// Believes a finite `state` read at `time`, or says why not. After a time without states the device may be anywhere
    /// where a hand can have brought it. One that goes on telling places far from the last is believed when these have
    /// agreed with each other for a tenth of a second.
    ///
    /// # Errors
    /// What is not believed, as the first of its kind.
    ///
    /// # Real-time
    /// Wait-free, real-time safe.
    pub fn believe(&mut self, state: &DeviceState, time: Nanos) -> Result<(), Disbelieved> {
        let position = state.position;
        let was_told = std::mem::replace(&mut self.told, time);
        let refused = |from: Vec3, most_m: f64, is_outside| {
            let distance_m = (position - from).norm();
            // A distance of numbers too large to square is no number.
            let is_good = distance_m <= most_m || most_m == f64::INFINITY;
            (!is_good).then_some(Disbelieved { count: 1, position, distance_m, most_m, is_outside })
        };
        let step_m = |passed_s: f64| self.bounds.speed_m_s * passed_s.max(SHORTEST_STEP_S);
        let since = |then: Nanos| time.saturating_sub(then).as_secs_f64();
        let wrong = refused(self.first, self.bounds.reach_m, true).or_else(|| {
            let (last, then) = self.last?;
            // States that came meanwhile told nothing new or nothing true: they are no time in which a hand moved unseen.
            let most_s = if was_told > then { since(was_told) + LONGEST_STEP_S } else { f64::INFINITY };
            refused(last, step_m(since(then).min(most_s)), false)
        });
        let Some(wrong) = wrong else {
            // A position that is told again is as old as it was.
            if self.last.is_none_or(|(last, _)| last != position) {
                self.last = Some((position, time));
            }
            self.doubted = None;
            return Ok(());
        };
        let agreed = self.doubted.filter(|&(place, then, _)| refused(place, step_m(since(then)), false).is_none());
        let begun = agreed.map_or(time, |(.., begun)| begun);
        self.doubted = Some((position, time, begun));
        if wrong.is_outside || since(begun) < SETTLES_S {
            return Err(wrong);
        }
        (self.last, self.doubted) = (Some((position, time)), None);
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const MS: u64 = 1_000_000;

    fn at(x: f64) -> DeviceState {
        DeviceState { position: Vec3::new(x, 0.0, 0.0), ..DeviceState::default() }
    }

    #[test]
    fn a_place_outside_of_the_workspace_and_a_step_that_no_hand_makes_are_not_believed() {
        let mut believed = Believed::new(Bounds::of(0.3, true), &at(0.05));
        assert_eq!(believed.believe(&at(0.055), Nanos(MS)), Ok(()));
        let wrong = believed.believe(&at(1000.0), Nanos(2 * MS)).unwrap_err();
        let words = "it told [1000, 0, 0] m, 999.9500 m from where it began, and at most 0.3000 m can be";
        assert_eq!(wrong.to_string(), words);
        let wrong = believed.believe(&at(0.1), Nanos(2 * MS)).unwrap_err();
        assert_eq!((wrong.is_outside, wrong.most_m), (false, 0.01));
        for extreme in [f64::MAX, -f64::MAX] {
            assert!(believed.believe(&at(extreme), Nanos(3 * MS)).is_err());
        }
        // A cable that was out for a while: nothing was told.
        assert_eq!(believed.believe(&at(0.1), Nanos(30 * MS)), Ok(()));
    }

    #[test]
    fn a_lie_is_not_believed_for_being_repeated_and_a_device_that_begins_anew_is_after_a_while() {
        let mut believed = Believed::new(Bounds::of(0.3, true), &at(0.0));
        assert_eq!(believed.believe(&at(0.0), Nanos(MS)), Ok(()));
        assert!((2..50).all(|ms| believed.believe(&at(0.2), Nanos(ms * MS)).is_err()));
        assert_eq!(believed.believe(&at(0.02), Nanos(50 * MS)), Ok(()), "the truth is, at once");
        let first = (51..300).find(|&ms| believed.believe(&at(0.2), Nanos(ms * MS)).is_ok());
        assert_eq!(first, Some(151));
        // Check that places which jump about never are.
        assert!((151..900).step_by(2).all(|ms| {
            believed.believe(&at(0.0), Nanos(ms * MS)).is_err()
                && believed.believe(&at(0.1), Nanos((ms + 1) * MS)).is_err()
        }));
    }

    #[test]
    fn a_device_slower_than_its_group_is_believed() {
        // 60 Hz, 2 m/s.
        let mut believed = Believed::new(Bounds::of(3.0, true), &at(0.0));
        let told = |ms: u64| 2e-3 * (ms - ms % 17) as f64;
        assert!((1..1000).all(|ms| believed.believe(&at(told(ms)), Nanos(ms * MS)).is_ok()));
    }

    #[test]
    fn noise_at_a_high_rate_is_believed_and_a_path_may_jump() {
        let mut believed = Believed::new(Bounds::of(0.3, true), &at(0.0));
        assert!((1..100).all(|n| believed.believe(&at(60e-6 * (n % 2) as f64), Nanos(n * 1000)).is_ok()));
        let mut path = Believed::new(Bounds::of(0.3, false), &at(0.0));
        assert_eq!(path.believe(&at(0.29), Nanos(MS)), Ok(()));
        assert!(path.believe(&at(0.31), Nanos(2 * MS)).is_err());
        assert_eq!(Believed::new(Bounds::NONE, &at(0.0)).believe(&at(1e300), Nanos(MS)), Ok(()));
    }
}
