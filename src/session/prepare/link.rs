//! The link of a scene, as it is simulated, and what it makes late.

use crate::error::Error;
use crate::link::Conditions;
use crate::model::body::Body;
use crate::runtime::{Nanos, Rate, RateGroup};
use crate::scene::LinkSpec;

/// The name of the group of the bridges.
pub(crate) use crate::log::LINK_GROUP as LINK;

/// By default a local model that is older exerts no force: nobody looks farther ahead.
const OLDEST: Nanos = Nanos(300_000_000);

/// What is done to messages.
pub(super) fn conditions(spec: &LinkSpec) -> Conditions {
    let ms = |ms: f64| Nanos::from_secs_f64(1e-3 * ms);
    Conditions {
        delay: ms(spec.delay_ms),
        jitter: ms(spec.jitter_ms),
        loss: spec.loss,
        duplicate: spec.duplicate,
        reorder: spec.reorder,
        tcp: spec.tcp,
        bits_per_s: spec.rate_mbit_s.map(|rate| 1e6 * rate),
        down: spec.down_s.iter().map(|outage| outage.map(Nanos::from_secs_f64)).collect(),
        seed: spec.seed,
    }
}

/// How late the results are that come over it, beside what makes them late without: the tool's samples take one way, the models the
/// other, and a bridge passes on at its next tick what comes between two.
pub(super) fn lateness(spec: Option<&LinkSpec>, [haptic, global]: [Rate; 2], own: Nanos) -> Nanos {
    let Some(spec) = spec else { return own };
    let round_trip = Nanos::from_secs_f64(1e-3 * 2.0 * spec.delay_ms);
    let repeats = if spec.loss > 0.0 { repeats(round_trip, global) } else { Nanos::ZERO };
    let jitter = Nanos::from_secs_f64(1e-3 * spec.jitter_ms);
    (own + round_trip + jitter + repeats + haptic.period()).min(OLDEST.max(own))
}

/// How late results are over a real link, beside what makes them late without: nobody knows beforehand whether something will be lost.
pub(super) fn real_lateness(round_trip: Nanos, global: Rate) -> Nanos {
    (round_trip + repeats(round_trip, global)).min(OLDEST)
}

/// How much later they are where packets are lost: a model of many of them comes a round trip later as a rule, and some so late that the
/// one before has to serve for another period.
fn repeats(round_trip: Nanos, global: Rate) -> Nanos {
    round_trip + global.period()
}

/// The group of the bridges: they pass on every tick, and nobody waits for them.
pub(super) fn group(haptic: Rate) -> RateGroup {
    RateGroup::new(haptic).name(LINK)
}

/// The haptic side has a body of its own, to build models of.
///
/// # Errors
/// If there cannot be two of `body`.
pub(super) fn check(spec: Option<&LinkSpec>, body: &dyn Body) -> Result<(), Error> {
    if spec.is_some() && body.duplicate().is_none() {
        return Err(Error::scene("link", "needs a body that can be copied, by `Body::duplicate`: one for each side"));
    }
    Ok(())
}
