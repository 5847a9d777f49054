//! What the local models of a session are made from.

use std::sync::Arc;

use super::super::body::Body;
use super::super::surroundings::{Condensation, SpringGraph};
use super::{
    Condensed, Feedback, Hold, Kind, Layered, LinearBoundary, LinearSpec, LocalModel, Patch, Prediction, Predictive,
    ScaledBoundary, Yielding,
};
use crate::error::ModelError;

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
    period_ticks: u32,
    surroundings: Surroundings,
}

/// What is found out about the body once.
#[derive(Clone, Debug)]
enum Surroundings {
    None,
    Layered(Layered),
    Yielding(Yielding),
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
        let surroundings = match kind {
            Kind::ScaledBoundary => Surroundings::Layered(Layered::new(body)),
            Kind::Condensed => Surroundings::Yielding(Yielding::new(Condensation::new(springs()?)?)),
            _ => Surroundings::None,
        };
        let springs =
            if matches!(kind, Kind::Predicted | Kind::Predictive) { Some(Arc::new(springs()?)) } else { None };
        let feedback = Feedback::of(kind);
        Ok(Self {
            kind,
            patch,
            springs,
            feedback,
            prediction: Prediction::default(),
            is_implicit: false,
            period_ticks: 33,
            surroundings,
        })
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
        self.period_ticks = ticks;
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
        Some(match (self.kind, &self.surroundings, &self.springs) {
            (Kind::Full, ..) => return None,
            (Kind::Patch, ..) => Box::new(Patch::new(spec)),
            (Kind::LinearBoundary, ..) => Box::new(LinearBoundary::new(spec, self.period_ticks)),
            (Kind::ScaledBoundary, Surroundings::Layered(layered), _) => Box::new(ScaledBoundary::new(spec, *layered)),
            (Kind::Condensed, Surroundings::Yielding(yielding), _) => Box::new(Condensed::new(spec, yielding.clone())),
            (Kind::Predicted | Kind::Predictive, _, Some(springs)) => {
                Box::new(Predictive::new(self.patch, self.prediction, Arc::clone(springs)))
            }
            (Kind::Hold | Kind::ScaledBoundary | Kind::Condensed | Kind::Predicted | Kind::Predictive, ..) => {
                Box::new(Hold::default())
            }
        })
    }
}
