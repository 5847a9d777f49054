//! What a visitor changes of a session that runs, and what it is now.

use palpate::Error;
use palpate::model::contact::Friction;
use palpate::scene::ModelChoice;
use palpate::session::Controls;
use serde_json::{Value, json};

use crate::wish::Change;

/// Changes what `change` names.
///
/// # Errors
/// Of the first that cannot be; what came before is changed.
pub(crate) fn apply(controls: &Controls, change: &Change) -> Result<(), Error> {
    if change.friction.is_some() || change.static_friction.is_some() || change.stribeck_m_s.is_some() {
        controls.set_friction(friction(controls.friction(), change))?;
    }
    change.stiffness.map_or(Ok(()), |factor| controls.set_stiffness(factor))?;
    change.model.as_deref().and_then(kind).map_or(Ok(()), |model| controls.set_model(model))
}

/// The kind of a model that is named.
pub(crate) fn kind(name: &str) -> Option<palpate::model::local::Kind> {
    ModelChoice::from_name(name)?.named()
}

/// `before` with what `change` names. What breaks a tool loose is no less than what holds it back, and a coefficient that was one stays one.
fn friction(before: Friction, change: &Change) -> Friction {
    let kinetic = change.friction.unwrap_or(before.kinetic);
    let breakaway = change.static_friction.or(before.breaks_away().then_some(before.breakaway));
    let stribeck = change.stribeck_m_s.unwrap_or(before.stribeck);
    Friction { kinetic, breakaway: breakaway.unwrap_or(kinetic).max(kinetic), stribeck }
}

/// What it is now, for the page.
pub(crate) fn settings(controls: &Controls) -> Value {
    let Friction { kinetic, breakaway, stribeck } = controls.friction();
    let limits = controls.stiffness_limits();
    json!({
        // The page's sliders have no end for a tool that sticks whatever pulls at it.
        "friction": kinetic.is_finite().then_some(kinetic),
        "static_friction": breakaway.is_finite().then_some(breakaway),
        "stribeck_m_s": stribeck,
        "stiffness": controls.stiffness(),
        "stiffness_limits": [limits.start(), limits.end()],
        "model": controls.model().name(),
        "models": controls.models().iter().map(|kind| kind.name()).collect::<Vec<_>>(),
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn one_coefficient_stays_one_and_what_breaks_loose_is_never_less() {
        let both = |kinetic, breakaway| Friction { kinetic, breakaway, stribeck: 0.0 };
        let only = |mu| Change { friction: Some(mu), ..Change::default() };
        assert_eq!(friction(both(0.5, 0.5), &only(0.2)), both(0.2, 0.2));
        assert_eq!(friction(both(0.5, 0.8), &only(0.2)), both(0.2, 0.8));
        assert_eq!(friction(both(0.5, 0.8), &only(1.0)), both(1.0, 1.0));
        let loose = Change { static_friction: Some(0.9), stribeck_m_s: Some(0.01), ..Change::default() };
        assert_eq!(friction(both(0.5, 0.5), &loose), Friction { kinetic: 0.5, breakaway: 0.9, stribeck: 0.01 });
    }
}
