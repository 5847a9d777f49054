//! FrictionSpec: one coefficient, or two and the fall from one to the other.

use crate::error::Error;
use crate::model::contact::Equations;
use crate::scene::{ContactSpec, FrictionSpec};

/// Far above any speed over which the friction of a surface falls; a larger number has the wrong unit.
const MAX_STRIBECK_M_S: f64 = 10.0;

const STATIC: &str = "contact.static_friction";
const STRIBECK: &str = "contact.stribeck_m_s";

pub(super) fn validate(contact: &ContactSpec) -> Result<(), Error> {
    let breakaway = contact.static_friction;
    match contact.friction {
        FrictionSpec::Coefficient(coefficient) if !(coefficient.is_finite() && coefficient >= 0.0) => {
            let message = format!("is {coefficient}, must be a finite number of at least 0 or \"stick\" (no bound)");
            return Err(Error::scene("contact.friction", message));
        }
        FrictionSpec::Coefficient(coefficient) => {
            if let Some(breakaway) = breakaway
                && !(breakaway.is_finite() && breakaway >= coefficient)
            {
                let message =
                    format!("is {breakaway}, must be a finite number of at least contact.friction, {coefficient}");
                return Err(Error::scene(STATIC, message));
            }
        }
        FrictionSpec::Stick if breakaway.is_some() => {
            let message = "does nothing with friction = \"stick\", which never slides: leave one of them out";
            return Err(Error::scene(STATIC, message));
        }
        FrictionSpec::Stick => {}
    }
    let stribeck = contact.stribeck_m_s;
    if !(0.0..=MAX_STRIBECK_M_S).contains(&stribeck) {
        let message = format!("is {stribeck}, must be 0 to {MAX_STRIBECK_M_S} m/s");
        return Err(Error::scene(STRIBECK, message));
    }
    if stribeck > 0.0 && breakaway.is_none_or(|breakaway| breakaway <= contact.friction.coefficient()) {
        let message = "does nothing without a static_friction above friction: give one, or leave it out";
        return Err(Error::scene(STRIBECK, message));
    }
    if contact.equations == Equations::Paper && contact.law().friction.breaks_away() {
        let message = "is not in the printed equations, which have one coefficient: leave it out or use equations = \"corrected\"";
        return Err(Error::scene(STATIC, message));
    }
    Ok(())
}
