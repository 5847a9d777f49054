//! Rates, and how far ahead of the global model's state a local model has to reach.

use crate::error::Error;
use crate::runtime::{Nanos, Rate, RateGroup};
use crate::scene::Scene;

/// One period of service, and what catching up takes.
const PERIODS_AHEAD: f64 = 1.25;

/// On threads a result may be later than the work says by this factor: contact, integration, the prediction, other threads.
const LATE_WORK: f64 = 2.0;

/// How often the whole body's forces are evaluated: `substeps` times per haptic tick, by the global model once in `stride` ticks; and for
/// how many ticks ahead.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Timing {
    pub(crate) haptic: Rate,
    pub(crate) global: Rate,
    pub(super) substeps: u32,
    /// Haptic ticks that one step of the global model spans.
    pub(super) stride: u32,
    /// Haptic ticks that a local model may have to reach ahead.
    pub(crate) horizon: u32,
}

impl Timing {
    pub(super) fn new(
        [haptic, global]: [Rate; 2],
        [substeps, stride]: [u32; 2],
        lateness: Nanos,
        blend_ticks: u32,
    ) -> Self {
        Self { haptic, global, substeps, stride, horizon: horizon(haptic, global, lateness, blend_ticks) }
    }
}

/// The haptic and the global rate of `scene`.
pub(super) fn rates(scene: &Scene) -> Result<[Rate; 2], Error> {
    let rate = |field: &str, hz: f64| {
        Rate::from_hz(hz).ok_or_else(|| Error::scene(field, format!("is {hz}, which is no rate")))
    };
    Ok([rate("local.rate_hz", scene.local.rate_hz)?, rate("global.rate_hz", scene.global.rate_hz)?])
}

/// How late the results of the global group come: as declared, and on threads what following the tool takes at least.
/// `work` is nominal for a haptic tick, so that a run has the same horizon everywhere; more than a period late is a
/// slip, and no rule.
pub(super) fn lateness(global: &RateGroup, haptic: Rate, work: Nanos, in_real_time: bool) -> Nanos {
    let declared = global.declared_latency();
    if !in_real_time {
        return declared;
    }
    let period = global.rate().period();
    let ticks = haptic.as_hz() / global.rate().as_hz();
    declared.max(Nanos::from_secs_f64(LATE_WORK * work.as_secs_f64() * ticks).min(period))
}

/// Haptic ticks from the state that a local model is built from to the end of its service: its own `lateness`, one period
/// until the next, and the time to catch up and to blend.
fn horizon(haptic: Rate, global: Rate, lateness: Nanos, blend_ticks: u32) -> u32 {
    let periods = PERIODS_AHEAD + lateness.as_secs_f64() / global.period_s();
    ((periods * haptic.as_hz() / global.as_hz()).ceil() as u32).saturating_add(blend_ticks)
}

#[cfg(test)]
mod tests {
    use super::*;

    const HAPTIC: Rate = Rate::hz(1000);

    fn group(latency_ms: u64) -> RateGroup {
        RateGroup::hz(20).latency(Nanos(latency_ms * 1_000_000))
    }

    #[test]
    fn a_declared_latency_is_looked_through_in_virtual_time() {
        assert_eq!(lateness(&group(0), HAPTIC, Nanos(500_000), false), Nanos::ZERO);
        assert_eq!(lateness(&group(75), HAPTIC, Nanos(500_000), false), Nanos(75_000_000));
        assert_eq!(horizon(HAPTIC, Rate::hz(20), Nanos(75_000_000), 1), 63 + 75 + 1);
        assert_eq!(horizon(HAPTIC, Rate::hz(20), Nanos::ZERO, u32::MAX), u32::MAX, "and no sum is too large");
    }

    #[test]
    fn on_threads_the_work_of_a_period_is_looked_through_up_to_a_period() {
        assert_eq!(lateness(&group(0), HAPTIC, Nanos(100_000), true), Nanos(10_000_000));
        assert_eq!(lateness(&group(30), HAPTIC, Nanos(100_000), true), Nanos(30_000_000));
        assert_eq!(lateness(&group(0), HAPTIC, Nanos(900_000), true), Nanos(50_000_000));
    }
}
