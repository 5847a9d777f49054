//! What a program changes of a session while it runs.

use super::prepare::ModelPlan;
use crate::actors::Tunable;
use crate::error::{Error, ErrorKind};
use crate::model::contact::Friction;
use crate::model::local::Kind;

/// Changes friction, stiffness and local model of a session that runs; its body goes on as it is.
///
/// What is set is taken by the next release of the global model, and reaches the force with the local model that is built then, within a
/// period or two of it; the resync's blend leads over. `full` takes friction and stiffness at its next tick. The log has what was taken
/// and when, so that a replay repeats it. Over a link friction and stiffness go to the global model on the other side.
///
/// ```
/// use palpate::model::local::Kind;
/// use palpate::prelude::*;
/// use std::time::Duration;
///
/// # fn main() -> Result<(), Error> {
/// let session = Session::from_scene(Scene::demo()).model(Kind::Patch).switchable().virtual_time();
/// let mut running = session.build()?.start()?;
/// let controls = running.take_controls().expect("there is one");
/// running.wait_for(Duration::from_millis(200));
/// controls.set_friction(0.2.into())?;
/// controls.set_stiffness(1.5)?;
/// controls.set_model(Kind::Full)?;
/// running.wait_for(Duration::from_millis(200));
/// assert!(controls.set_stiffness(1e6).is_err(), "its steps do not bear that");
/// assert!(running.stop().runtime.fault.is_none());
/// # Ok(())
/// # }
/// ```
///
/// # Real-time
/// Not for a tick: takes a lock that no tick takes.
#[derive(Debug)]
pub struct Controls {
    settings: Tunable,
    models: Vec<Kind>,
}

impl Controls {
    pub(super) fn new(settings: Tunable, plan: &ModelPlan) -> Self {
        Self { settings, models: plan.kinds.iter().map(|(kind, _)| *kind).collect() }
    }

    /// The friction that was set last, or that of the scene.
    pub fn friction(&self) -> Friction {
        self.settings.value().friction
    }

    /// The stiffness that was set last, in that of the scene.
    pub fn stiffness(&self) -> f64 {
        self.settings.value().stiffness.factor()
    }

    /// The local model that was set last, or that of the start.
    pub fn model(&self) -> Kind {
        self.settings.value().model
    }

    /// The local models that can be set: that of the start alone, unless the session is
    /// [switchable](super::SessionBuilder::switchable).
    pub fn models(&self) -> &[Kind] {
        &self.models
    }

    /// The largest stiffness that the session's explicit steps bear, in that of the scene, and the least that can be set.
    pub fn stiffness_limits(&self) -> std::ops::RangeInclusive<f64> {
        self.settings.stiffness_limits()
    }

    /// Sets the friction between the tools and the body.
    ///
    /// # Errors
    /// [`ErrorKind::Usage`] if it is none that the equations of the scene's contact have.
    pub fn set_friction(&self, friction: Friction) -> Result<(), Error> {
        self.settings.set_friction(friction).map_err(|words| Error::new(ErrorKind::Usage, words))
    }

    /// Sets the stiffness of the whole body, `factor` times that of the scene: its springs or its elements, the damping with its root,
    /// as the damping ratio stays. The body goes there at a rate that makes it ten times as stiff in half a second.
    ///
    /// # Errors
    /// [`ErrorKind::Usage`] with the limits if the session's explicit steps do not bear it: more of them take another session.
    pub fn set_stiffness(&self, factor: f64) -> Result<(), Error> {
        self.settings.set_stiffness(factor).map_err(|words| Error::new(ErrorKind::Usage, words))
    }

    /// Sets the local model: the next one that is built is of this kind.
    ///
    /// # Errors
    /// [`ErrorKind::Usage`] if it is not among [`models`](Self::models).
    pub fn set_model(&self, model: Kind) -> Result<(), Error> {
        if !self.models.contains(&model) {
            let names: Vec<_> = self.models.iter().map(|kind| kind.name()).collect();
            let words = format!("{} cannot be set while this session runs, {} can", model.name(), names.join(", "));
            return Err(Error::new(ErrorKind::Usage, words));
        }
        self.settings.set_model(model);
        Ok(())
    }
}
