//! What can be wrong with the limits of a scene.

use super::super::SafetySpec;
use super::check::{at_most_ms, not_negative, positive};
use crate::error::Error;

/// A force that fades longer than this is no stop any more (ms).
const LONGEST_RAMP_MS: f64 = 2000.0;
/// A minute: longer is a wrong unit (ms).
const LONGEST_MS: f64 = 60_000.0;

/// Refuses limits that cannot be, or switch off what no device may be without.
pub(super) fn validate(safety: &SafetySpec) -> Result<(), Error> {
    if let Some(force_n) = safety.max_force_n {
        positive("safety.max_force_n", force_n)?;
    }
    if let Some(torque_n_m) = safety.max_torque_n_m {
        positive("safety.max_torque_n_m", torque_n_m)?;
    }
    positive("safety.max_slew_n_per_ms", safety.max_slew_n_per_ms)?;
    positive("safety.ramp_ms", safety.ramp_ms)?;
    if safety.ramp_ms > LONGEST_RAMP_MS {
        let message = format!("is {}, a stop may take {LONGEST_RAMP_MS} ms at most", safety.ramp_ms);
        return Err(Error::scene("safety.ramp_ms", message));
    }
    not_negative("safety.fade_speed_m_s", safety.fade_speed_m_s)?;
    positive("safety.stop_speed_m_s", safety.stop_speed_m_s)?;
    if safety.stop_speed_m_s <= safety.fade_speed_m_s {
        let (stop, fade) = (safety.stop_speed_m_s, safety.fade_speed_m_s);
        let message = format!("is {stop}, must be above safety.fade_speed_m_s, which is {fade}");
        return Err(Error::scene("safety.stop_speed_m_s", message));
    }
    positive("safety.tank_j", safety.tank_j)?;
    not_negative("safety.tank_min_j", safety.tank_min_j)?;
    positive("safety.energy_tolerance_j", safety.energy_tolerance_j)?;
    for (field, value) in [
        ("safety.max_damping_n_s_per_m", safety.max_damping_n_s_per_m),
        ("safety.device_friction_n", safety.device_friction_n),
        ("safety.device_resolution_m", safety.device_resolution_m),
        ("safety.device_delay_ms", safety.device_delay_ms),
        ("safety.noise_m_s", safety.noise_m_s),
    ] {
        not_negative(field, value.unwrap_or(0.0))?;
    }
    positive("safety.max_stiffness_n_per_m", safety.max_stiffness_n_per_m.unwrap_or(1.0))?;
    positive("safety.device_damping_n_s_per_m", safety.device_damping_n_s_per_m.unwrap_or(1.0))?;
    positive("safety.engage_force_n", safety.engage_force_n)?;
    for (field, ms) in [
        ("safety.swap_blend_ms", safety.swap_blend_ms),
        ("safety.max_age_ms", safety.max_age_ms.unwrap_or(1.0)),
        ("safety.age_fade_ms", safety.age_fade_ms),
        ("safety.start_up_ms", safety.start_up_ms),
    ] {
        positive(field, ms)?;
        at_most_ms(field, ms, LONGEST_MS)?;
    }
    match safety.off.iter().find(|stage| !stage.can_be_off()) {
        None => Ok(()),
        Some(stage) => {
            let message =
                format!("names {:?}, which no device may be without: it cannot be switched off", stage.name());
            Err(Error::scene("safety.off", message))
        }
    }
}
