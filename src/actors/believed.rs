//! What is believed of a device: a state outside of its workspace, or farther away than a hand comes in the time, is a fault of
//! the device, and no model sees it.

use crate::devices::DeviceState;
use crate::model::Vec3;
use crate::runtime::Nanos;
use crate::safety::FASTEST_HAND_M_S;

/// The shortest time that a step is divided by (s): the noise of an encoder at a high rate is no motion.
const SHORTEST_STEP_S: f64 = 1e-3;

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
}

impl Believed {
    /// Believes `first`, read before the start.
    ///
    /// # Real-time
    /// A plain value: wait-free, real-time safe.
    pub fn new(bounds: Bounds, first: &DeviceState) -> Self {
        Self { bounds, first: first.position, last: None }
    }

    /// Believes a finite `state` read at `time`, or says why not. After a time without a state that was believed the device
    /// may be anywhere where a hand can have brought it.
    ///
    /// # Errors
    /// What is not believed, as the first of its kind.
    ///
    /// # Real-time
    /// Wait-free, real-time safe.
    pub fn believe(&mut self, state: &DeviceState, time: Nanos) -> Result<(), Disbelieved> {
        let position = state.position;
        let refused = |from: Vec3, most_m: f64, is_outside| {
            let distance_m = (position - from).norm();
            // A distance of numbers too large to square is no number.
            let is_good = distance_m <= most_m || most_m == f64::INFINITY;
            (!is_good).then_some(Disbelieved { count: 1, position, distance_m, most_m, is_outside })
        };
        let wrong = refused(self.first, self.bounds.reach_m, true).or_else(|| {
            let (last, then) = self.last?;
            let passed_s = time.saturating_sub(then).as_secs_f64().max(SHORTEST_STEP_S);
            refused(last, self.bounds.speed_m_s * passed_s, false)
        });
        match wrong {
            Some(wrong) => Err(wrong),
            None => {
                self.last = Some((position, time));
                Ok(())
            }
        }
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
        // A cable that was out for a while, and a state repeated for as long.
        assert_eq!(believed.believe(&at(0.1), Nanos(6 * MS)), Ok(()));
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
