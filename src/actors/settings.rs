//! What is changed of a session while it runs: friction, stiffness, local model.

use crate::model::body::Stiffness;
use crate::model::contact::Friction;
use crate::model::local::Kind;
use crate::model::simulation::Simulation;
use crate::runtime::InputValue;

/// What is wanted from the next release of the global model on; of the whole body from the next tick on. The log has it as it was
/// taken, so that a replay takes the same.
///
/// # Real-time
/// A plain value.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Settings {
    /// Friction between tools and body.
    pub friction: Friction,
    /// What the body's stiffness goes to.
    pub stiffness: Stiffness,
    /// The kind of the local models.
    pub model: Kind,
}

impl Settings {
    /// Puts friction and stiffness to `body`; the kind of the local models is for whoever makes them.
    ///
    /// # Real-time
    /// Wait-free, real-time safe.
    pub fn put_to(self, body: &mut Simulation) {
        body.set_friction(self.friction);
        body.approach_stiffness(self.stiffness);
    }
}

impl InputValue for Settings {
    fn to_words(self) -> [u64; 5] {
        let Self { friction: Friction { kinetic, breakaway, stribeck }, stiffness, model } = self;
        let kind = Kind::ALL.iter().position(|kind| *kind == model).unwrap_or(0);
        let [kinetic, breakaway, stribeck, stiffness] =
            [kinetic, breakaway, stribeck, stiffness.factor()].map(f64::to_bits);
        [kinetic, breakaway, stribeck, stiffness, kind as u64]
    }

    /// Of a damaged log: what no session is set to is as it was made.
    fn from_words([kinetic, breakaway, stribeck, stiffness, kind]: [u64; 5]) -> Self {
        let [kinetic, breakaway, stribeck, stiffness] = [kinetic, breakaway, stribeck, stiffness].map(f64::from_bits);
        Self {
            friction: Friction { kinetic, breakaway, stribeck },
            stiffness: Stiffness::times(stiffness).unwrap_or_default(),
            model: usize::try_from(kind).ok().and_then(|kind| Kind::ALL.get(kind)).copied().unwrap_or(Kind::Hold),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn settings_survive_the_trip_through_a_record() {
        for model in Kind::ALL {
            let friction = Friction { kinetic: 0.3, breakaway: f64::INFINITY, stribeck: 1e-3 };
            let settings = Settings { friction, stiffness: Stiffness::times(1.7).unwrap(), model };
            assert_eq!(Settings::from_words(settings.to_words()), settings);
        }
        let damaged = Settings::from_words([0, 0, 0, f64::NAN.to_bits(), 99]);
        assert_eq!((damaged.stiffness, damaged.model), (Stiffness::default(), Kind::Hold));
    }
}
