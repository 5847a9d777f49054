//! The rate groups that a session's scene and program ask for.

use super::tools::Tool;
use crate::actors::GAP_S;
use crate::error::{Error, ErrorKind};
use crate::log::SceneFrame;
use crate::runtime::{Execution, Nanos, OverrunPolicy, Rate, RateGroup, Release, pinnable_cores};
use crate::scene::{DeviceKind, DeviceSpec, GlobalSpec};

/// The name of the group that reduces surroundings.
pub(crate) const BASIS: &str = "basis";
/// How often records are taken to the log.
const LOGGER: Rate = Rate::hz(20);
/// How often they are taken to a log with `/scene`: a picture per release.
const LOGGER_WITH_SCENE: Rate = Rate::hz(SceneFrame::RATE_HZ);

/// The priority of the haptic thread: above everything but the kernel's own.
const HAPTIC_PRIORITY: u8 = 80;

/// The global group: the program's, or one of the scene's rate, with the scene's latency, which is the program's if that has none.
///
/// # Errors
/// On threads, if the latency is above the period.
pub(super) fn global_group(
    given: Option<RateGroup>,
    spec: &GlobalSpec,
    rate: Rate,
    execution: Execution,
) -> Result<RateGroup, Error> {
    let group = given.unwrap_or_else(|| RateGroup::new(rate)).name("global");
    let latency_ms = spec.compute_latency_ms;
    if execution == Execution::Threaded && latency_ms > 1e3 * rate.period_s() {
        let message = format!(
            "is {latency_ms}, which is above the period of {:.3} ms: in real time a result must be there before the next \
             release; lower it, or run in virtual time (--virtual)",
            1e3 * rate.period_s()
        );
        return Err(Error::scene("global.compute_latency_ms", message));
    }
    Ok(group.latency(Nanos::from_secs_f64(latency_ms * 1e-3)))
}

/// The haptic group: the program's, or one with a core of its own; real-time unless the program wants it otherwise, and
/// with time to bring the force to rest. Released by the device if that is the only one and has replies to wait for.
pub(super) fn local_group(
    given: Option<RateGroup>,
    rate: Rate,
    tools: &[Tool],
    devices: &[DeviceSpec],
    execution: Execution,
) -> RateGroup {
    let group = given.unwrap_or_else(|| {
        let group = RateGroup::new(rate);
        match pinnable_cores()[..] {
            // On a single core the haptic thread preempts the others; pinning would gain nothing.
            [] | [_] => group,
            [.., last] => group.pin(last),
        }
    });
    // Policy and core of a program's own thread are its own affair.
    let group = if group.is_hosted() { group } else { group.realtime_by_default(HAPTIC_PRIORITY) };
    let ramp_s = tools.iter().map(|tool| tool.limits.ramp_s).fold(0.0, f64::max);
    let group = group.name("local").wind_down(Nanos::from_secs_f64(ramp_s + RAMP_MARGIN_S));
    // A device that exerts no force needs the time only to show in the log what would have been done.
    let exerts_force = tools.iter().any(|tool| tool.device.exerts_force());
    let group = if exerts_force { group.wind_down_at_end() } else { group };
    match (devices, execution) {
        ([DeviceSpec { kind: DeviceKind::Haply, haply: Some(spec), .. }], Execution::Threaded)
            if !group.is_hosted() =>
        {
            let watchdog = Nanos::from_secs_f64(spec.watchdog_ms * 1e-3).max(group.rate().period());
            group.device_paced(watchdog)
        }
        _ => group,
    }
}

/// Releases of the wind-down that may be skipped without shortening the ramp (s).
const RAMP_MARGIN_S: f64 = 0.005;

/// The group that reduces surroundings, for wishes that come at `rate`.
pub(super) fn basis_group(rate: Rate) -> RateGroup {
    RateGroup::new(rate).name(BASIS).background()
}

/// The group that takes records to the log, and pictures to one with `/scene`.
pub(super) fn logger_group(with_scene: bool) -> RateGroup {
    RateGroup::new(if with_scene { LOGGER_WITH_SCENE } else { LOGGER }).name("logger").observer()
}

/// What a rate group can ask for and a session cannot give.
pub(super) fn check_group(field: &str, group: &RateGroup) -> Result<(), Error> {
    let own = || group.clone();
    let wrong = if own().offset(Nanos::ZERO) != own() {
        "has an offset, but device and models count from release 0: leave it out"
    } else if own().observer() == own() {
        "is an observer, which a session's groups cannot be: leave it out"
    } else if field == "local" && own().latency(Nanos::ZERO) != own() {
        "has a latency, which only the global group's results can have: leave it out"
    } else if field == "local" && own().overrun(OverrunPolicy::Rephase) == own() {
        "has the policy Rephase, but the tool's samples and the models belong to the nominal grid of ticks: use another"
    } else if field == "local" && own().catches_up().as_secs_f64() > 0.5 * GAP_S {
        "catches up after stops that the force must come back from slowly (0.1 s): catch up at most 0.05 s, or use Skip"
    } else if field == "global" && own().release(Release::Periodic) != own() {
        "is paced by a device or hosted, which only the local group can be: leave it out"
    } else {
        return Ok(());
    };
    Err(Error::new(ErrorKind::Runtime, wrong).at(field))
}
