//! What the local models of a session are made from.

use std::sync::Arc;

use super::boundary::{Boundary, Layers, Yielding};
use super::hold::Hold;
use super::linear::{LinearPatch, LinearSpec};
use super::predictive::{Prediction, Predictive};
use super::{Feedback, Kind, LocalModel};
use crate::body::Body;
use crate::error::ModelError;
use crate::surroundings::{Condensation, SpringGraph};

/// What the local models of a session are made from.
#[derive(Clone, Debug)]
pub struct Template {
    /// Which model.
    pub kind: Kind,
    /// Patch nodes along the surface, along it, into depth.
    pub patch: [usize; 3],
    /// The body's springs, for the models that need them.
    pub springs: Option<Arc<SpringGraph>>,
    feedback: Feedback,
    prediction: Prediction,
    is_implicit: bool,
    /// For the linear models.
    boundary: Boundary,
}

impl Template {
    /// For models of `body`; a patch has `patch` nodes along the surface, along it, into depth. It tells the global model what
    /// the model is best with, takes the global model's explicit steps, and expects a resync every 33 ticks.
    ///
    /// # Errors
    /// If the model needs springs and the body has none, or needs a body that is held.
    ///
    /// # Real-time
    /// Not real-time safe: allocates.
    pub fn new(kind: Kind, patch: [usize; 3], body: &dyn Body) -> Result<Self, ModelError> {
        let springs = || {
            SpringGraph::new(body).ok_or_else(|| {
                let message = format!("{:?} needs a body of springs, use another model", kind.name());
                ModelError::of("local.model", message)
            })
        };
        let boundary = match kind {
            Kind::LinearBoundary => Boundary::Drifting { ticks: 33 },
            Kind::ScaledBoundary => Boundary::Layered(Layers::new(body)),
            Kind::Condensed => Boundary::Yielding(Yielding::new(Condensation::new(springs()?)?)),
            _ => Boundary::Still,
        };
        let springs =
            if matches!(kind, Kind::Predicted | Kind::Predictive) { Some(Arc::new(springs()?)) } else { None };
        let (feedback, prediction) = (Feedback::of(kind), Prediction::default());
        Ok(Self { kind, patch, springs, feedback, prediction, is_implicit: false, boundary })
    }

    /// Tells the global model `feedback`.
    ///
    /// # Real-time
    /// Wait-free, real-time safe.
    #[must_use]
    pub fn with_feedback(mut self, feedback: Feedback) -> Self {
        self.feedback = feedback;
        self
    }

    /// `predictive` looks ahead by `prediction`.
    ///
    /// # Real-time
    /// Wait-free, real-time safe.
    #[must_use]
    pub fn with_prediction(mut self, prediction: Prediction) -> Self {
        self.prediction = prediction;
        self
    }

    /// A linear patch takes one implicit step per tick.
    ///
    /// # Real-time
    /// Wait-free, real-time safe.
    #[must_use]
    pub fn with_implicit_steps(mut self) -> Self {
        self.is_implicit = true;
        self
    }

    /// A period of the global model is `ticks` haptic ticks.
    ///
    /// # Real-time
    /// Wait-free, real-time safe.
    #[must_use]
    pub fn with_period(mut self, ticks: u32) -> Self {
        if let Boundary::Drifting { ticks: moving } = &mut self.boundary {
            *moving = ticks;
        }
        self
    }

    /// True if the models write a [`PatchGeometry`](super::PatchGeometry).
    ///
    /// # Real-time
    /// Wait-free, real-time safe.
    pub fn feeds_back(&self) -> bool {
        self.kind.is_linear() && self.feedback != Feedback::Trajectory
    }

    /// An empty model, to be rebuilt in place; `None` for [`Full`](super::Full), which is the simulation itself.
    ///
    /// # Real-time
    /// Not real-time safe: allocates.
    pub fn empty(&self) -> Option<Box<dyn LocalModel>> {
        let spec = LinearSpec { size: self.patch, feedback: self.feedback, is_implicit: self.is_implicit };
        Some(match (self.kind, &self.springs) {
            (Kind::Full, _) => return None,
            (Kind::Predicted | Kind::Predictive, Some(springs)) => {
                Box::new(Predictive::new(self.patch, self.prediction, Arc::clone(springs)))
            }
            (kind, _) if kind.is_linear() => Box::new(LinearPatch::new(spec, self.boundary.clone())),
            _ => Box::new(Hold::default()),
        })
    }
}
