//! The last stage: a device that says nothing new is not pushed.

use super::force::{Force, slew};
use super::start_up::Ramp;

/// The limit on how long a device may be silent before its force goes to zero.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Watchdog {
    /// Number of ticks without a new state after which it acts.
    pub max_stale_ticks: u32,
}

impl Default for Watchdog {
    fn default() -> Self {
        Self { max_stale_ticks: 2 }
    }
}

impl Watchdog {
    /// The command in place of `command` (N), and whether it acted: towards zero as fast as `limit` (N) from the command
    /// `last` allows, and back by `ramp` once the device speaks again.
    pub(super) fn guard(
        self,
        stale_ticks: u32,
        last: Force,
        command: Force,
        limit: f64,
        ramp: &mut Ramp,
    ) -> (Force, bool) {
        if stale_ticks <= self.max_stale_ticks {
            return (command, false);
        }
        ramp.release();
        (slew(last, [0.0; 3], limit).0, true)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn silence_ends_in_zero_force_and_a_ramp() {
        let (watchdog, mut ramp) = (Watchdog::default(), Ramp::new(0.1));
        let held = [0.0, 0.0, 1.2];
        assert_eq!(watchdog.guard(2, held, held, 0.5, &mut ramp), (held, false));
        let mut last = held;
        let forces: Vec<f64> = (3..6)
            .map(|stale| {
                last = watchdog.guard(stale, last, held, 0.5, &mut ramp).0;
                last[2]
            })
            .collect();
        assert!((forces[0] - 0.7).abs() < 1e-12 && (forces[1] - 0.2).abs() < 1e-12 && forces[2] == 0.0, "{forces:?}");
        assert_eq!(ramp.advance(true, 1e-3), 0.01, "it comes back by the ramp");
    }
}
