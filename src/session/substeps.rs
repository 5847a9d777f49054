//! Explicit steps per haptic tick, from the stability limit.

use crate::error::Error;
use crate::model::body::Body;
use crate::model::integrator::Spectrum;

/// Steps of 0.1 us, the limit of `global.substeps_per_ms` too: a body that needs more would seem to hang.
const MAX_SUBSTEPS_PER_MS: f64 = 1e4;

/// Substeps per haptic tick: as asked, unless that is unstable, or from the stability limit; and what that asks for.
pub(super) fn substeps(body: &mut dyn Body, per_ms: Option<u32>, tick: f64) -> Result<(u32, u32), Error> {
    let spectrum = Spectrum::estimate(body);
    let stable = spectrum.stable_step();
    if stable.is_nan() || stable <= 0.0 {
        return Err(Error::scene("body", "gives forces near its rest positions that are not finite"));
    }
    let Some(per_ms) = per_ms else {
        let substeps = spectrum.substeps(tick);
        if f64::from(substeps) > MAX_SUBSTEPS_PER_MS * (tick * 1e3).max(1.0) {
            let message = format!(
                "needs {substeps} explicit steps per haptic tick to be stable, which no machine can do: less stiffness or \
                 damping, or more mass"
            );
            return Err(Error::scene("body", message));
        }
        return Ok((substeps, substeps));
    };
    let substeps = (f64::from(per_ms) * tick * 1e3 - 1e-9).ceil().max(1.0);
    if tick / substeps >= stable {
        let needed = (1.3e-3 / stable).ceil();
        let message = format!(
            "is {per_ms}, which is unstable for this stiffness, damping and mass: use {needed} or more, or leave it out"
        );
        return Err(Error::scene("global.substeps_per_ms", message));
    }
    Ok((substeps as u32, spectrum.substeps(tick)))
}
