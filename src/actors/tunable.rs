//! What may be changed of a session while it runs, and how far.

use super::settings::Settings;
use crate::model::body::Stiffness;
use crate::model::contact::{Equations, Friction};
use crate::model::local::Kind;
use crate::runtime::{Parameter, ParameterReader};

/// The largest coefficient of friction, but for an infinite one: no surface has more.
const MOST_FRICTION: f64 = 10.0;
/// How much softer a body may be made: a body next to nothing holds no tool.
const SOFTEST: f64 = 0.01;

/// The settings of a session, from outside: what cannot be is refused, whoever asks for it.
#[derive(Clone, Debug)]
pub struct Tunable {
    settings: Parameter<Settings>,
    stiffest: Stiffness,
    equations: Equations,
}

impl Tunable {
    /// Of `settings`, of a body that may become so stiff, with contacts by those equations.
    ///
    /// # Real-time
    /// Wait-free, real-time safe.
    pub fn new(settings: Parameter<Settings>, stiffest: Stiffness, equations: Equations) -> Self {
        Self { settings, stiffest, equations }
    }

    /// What was set last.
    ///
    /// # Real-time
    /// Not for a real-time tick: takes a lock.
    pub fn value(&self) -> Settings {
        self.settings.value()
    }

    /// The end of the actor that takes what is set.
    ///
    /// # Real-time
    /// Not for a real-time tick: takes a lock.
    pub fn reader(&self) -> ParameterReader<Settings> {
        self.settings.reader()
    }

    /// The largest stiffness that explicit steps bear, in that of the scene, and the least that can be set.
    ///
    /// # Real-time
    /// Wait-free, real-time safe.
    pub fn stiffness_limits(&self) -> std::ops::RangeInclusive<f64> {
        SOFTEST..=self.stiffest.factor()
    }

    /// Sets the friction between the tools and the body.
    ///
    /// # Errors
    /// If it is none that the equations of the scene's contact have; why.
    ///
    /// # Real-time
    /// Not for a real-time tick: takes a lock.
    pub fn set_friction(&self, friction: Friction) -> Result<(), String> {
        let Friction { kinetic, breakaway, stribeck } = friction;
        if friction == self.value().friction {
            return Ok(());
        }
        let is_coefficient = |mu: f64| (0.0..=MOST_FRICTION).contains(&mu) || mu == f64::INFINITY;
        if !(is_coefficient(kinetic) && is_coefficient(breakaway) && stribeck >= 0.0 && stribeck.is_finite()) {
            return Err(format!(
                "friction is {kinetic} and {breakaway} over {stribeck} m/s, must be 0 to {MOST_FRICTION} or unbounded, over 0 m/s or \
                 more"
            ));
        }
        if self.equations == Equations::Paper && friction.breaks_away() {
            return Err("the printed equations have one coefficient of friction".to_owned());
        }
        self.settings.update(|settings| settings.friction = friction);
        Ok(())
    }

    /// Sets the stiffness of the whole body, `factor` times that of the scene.
    ///
    /// # Errors
    /// If the session's explicit steps do not bear it; why.
    ///
    /// # Real-time
    /// Not for a real-time tick: takes a lock.
    pub fn set_stiffness(&self, factor: f64) -> Result<(), String> {
        let limits = self.stiffness_limits();
        let stiffness = Stiffness::times(factor).filter(|_| limits.contains(&factor)).ok_or_else(|| {
            let (least, most) = (limits.start(), limits.end());
            format!(
                "a stiffness of {factor:.3} times the scene's is not within {least} to {most:.3}, which its explicit steps bear"
            )
        })?;
        self.settings.update(|settings| settings.stiffness = stiffness);
        Ok(())
    }

    /// Sets the kind of the local models, which is one that the session has.
    ///
    /// # Real-time
    /// Not for a real-time tick: takes a lock.
    pub fn set_model(&self, model: Kind) {
        self.settings.update(|settings| settings.model = model);
    }
}
