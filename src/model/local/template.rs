//! What the local models of a session are made from.

use std::sync::Arc;

use super::hold::Hold;
use super::linear::{Boundary, Layers, LinearPatch, LinearSpec, Yielding};
use super::parcel::{Departing, Model};
use super::predictive::Predictive;
use super::whole::Whole;
use super::{Feedback, Kind, LocalModel};
use crate::body::Body;
use crate::error::ModelError;
use crate::surroundings::{Condensation, RestingBody};

/// The recipe for the local models of a session: what they are made from.
///
/// ```
/// use palpate_model::Vec3;
/// use palpate_model::body::{Block, Body, State};
/// use palpate_model::contact::{Contact, Law, ToolMotion};
/// use palpate_model::local::{Kind, LocalModel, ResyncView, Template, ToolForecast};
/// use palpate_model::mesh::Face;
/// use palpate_model::simulation::{Simulation, Stepping};
/// use palpate_model::surroundings::Bases;
///
/// # fn main() -> Result<(), palpate_model::ModelError> {
/// let block = Block::builder([6; 3], [0.05; 3]).fix(Face::ZMin).build()?;
/// let template = Template::new(Kind::Patch, [4, 4, 2], &block)?;
/// let (state, triangle) = (State::at_rest(block.rest()), block.surface().triangles.len() as u32 - 5);
/// let contact = Contact::glued(triangle, [0.2, 0.3, 0.5]);
/// let stepping = Stepping { tick: 1e-3, substeps: 2 };
/// let mut global = Simulation::new(Box::new(block), state, contact, Law::default(), stepping)?;
///
/// // At every resync the local model is built from the global one; then it runs on by itself.
/// let mut model = template.empty();
/// let tools = &[ToolForecast::at_rest(Vec3::new(0.03, 0.03, 0.05))];
/// let (triangles, bases, patch) = (&[triangle], &Bases::default(), None);
/// let (global, nearest) = (&mut global, triangles);
/// model.rebuild(ResyncView { global, tick: 0, triangles, nearest, patch, tools, index: 0, horizon: 33, bases });
/// let start = tools[0].position;
/// let force = model.tick(&[ToolMotion::straight(start, start + Vec3::z() * 1e-3)]).force;
/// assert!(force.z < 0.0, "it pulls the tool back");
/// # Ok(())
/// # }
/// ```
#[derive(Clone, Debug)]
pub struct Template {
    /// The kind of model.
    pub kind: Kind,
    /// Patch nodes along the surface, along it, into depth.
    pub patch: [usize; 3],
    /// The body around its rest state, for the models that need it.
    pub resting: Option<Arc<RestingBody>>,
    /// Asked for, for every kind that can give it.
    feedback: Option<Feedback>,
    is_implicit: bool,
    /// Of the global model, in haptic ticks.
    period: u32,
    /// For the linear models.
    boundary: Boundary,
}

impl Template {
    /// A recipe for models of `body`; a patch has `patch` nodes along the surface, along it, into depth. It tells the global model what
    /// the model is best with, takes the global model's explicit steps, and expects a resync every 33 ticks.
    ///
    /// # Errors
    /// If the model needs a body that can be restricted or one that is held, and this is none.
    ///
    /// # Real-time
    /// Not real-time safe: allocates.
    pub fn new(kind: Kind, patch: [usize; 3], body: &dyn Body) -> Result<Self, ModelError> {
        let resting = || {
            RestingBody::new(body).ok_or_else(|| {
                let message =
                    format!("{:?} needs a body with `restriction` and `duplicate`, use another model", kind.name());
                ModelError::of("local.model", message)
            })
        };
        let period = 33;
        let boundary = match kind {
            Kind::LinearBoundary => Boundary::Drifting { ticks: period },
            Kind::ScaledBoundary => Boundary::Layered(Layers::new(body)),
            Kind::Condensed => Boundary::Yielding(Yielding::new(Condensation::new(resting()?.into())?)),
            _ => Boundary::Still,
        };
        let resting =
            if matches!(kind, Kind::Predicted | Kind::Predictive) { Some(Arc::new(resting()?)) } else { None };
        Ok(Self { kind, patch, resting, feedback: None, is_implicit: false, period, boundary })
    }

    /// Lets the models tell the global one `feedback`, as far as one of their kind can.
    ///
    /// # Real-time
    /// Wait-free, real-time safe.
    #[must_use]
    pub fn with_feedback(mut self, feedback: Feedback) -> Self {
        self.feedback = Some(feedback);
        self
    }

    /// Lets a linear patch take one implicit step per tick.
    ///
    /// # Real-time
    /// Wait-free, real-time safe.
    #[must_use]
    pub fn with_implicit_steps(mut self) -> Self {
        self.is_implicit = true;
        self
    }

    /// Sets the period of the global model to `ticks` haptic ticks.
    ///
    /// # Real-time
    /// Wait-free, real-time safe.
    #[must_use]
    pub fn with_period(mut self, ticks: u32) -> Self {
        self.period = ticks;
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
        self.kind.is_linear() && self.feedback() != Feedback::Trajectory
    }

    /// The feedback that was asked for, or the usual one of a kind that cannot give it.
    fn feedback(&self) -> Feedback {
        self.feedback.filter(|feedback| feedback.fits(self.kind)).unwrap_or(Feedback::of(self.kind))
    }

    /// An empty model for the side of the global one, if the local one is built on another computer: it serves nobody, and has a
    /// [parcel](LocalModel::parcel) of what [`empty`](Self::empty) is built from there.
    ///
    /// # Real-time
    /// Not real-time safe: allocates.
    pub fn departing(&self) -> Box<dyn LocalModel> {
        let spec = LinearSpec { size: self.patch, feedback: self.feedback(), is_implicit: self.is_implicit };
        let model = match self.kind {
            Kind::Predicted | Kind::Predictive => {
                Model::Predictive(Box::new(Predictive::new(self.patch, self.kind == Kind::Predictive)))
            }
            // What answers to the patch is not looked at here.
            kind if kind.is_linear() => Model::Linear(Box::new(LinearPatch::new(spec, Boundary::Still))),
            _ => Model::Hold,
        };
        Box::new(Departing::new(self.kind, model))
    }

    /// A recipe for models of another `kind` with a `patch` of its own for the same body, as it was made.
    ///
    /// # Errors
    /// Those of [`new`](Self::new).
    ///
    /// # Real-time
    /// Not real-time safe: allocates.
    pub fn of_kind(&self, kind: Kind, patch: [usize; 3], body: &dyn Body) -> Result<Self, ModelError> {
        let made = Self::new(kind, patch, body)?.with_period(self.period);
        Ok(Self { feedback: self.feedback, is_implicit: self.is_implicit, ..made })
    }

    /// An empty model, to be rebuilt in place. One of [`Kind::Full`] serves all tools; where nothing but `full` is wanted it is the
    /// [`Simulation`](crate::simulation::Simulation) itself.
    ///
    /// # Real-time
    /// Not real-time safe: allocates.
    pub fn empty(&self) -> Box<dyn LocalModel> {
        let spec = LinearSpec { size: self.patch, feedback: self.feedback(), is_implicit: self.is_implicit };
        match self.kind {
            Kind::Full => Box::new(Whole::default()),
            Kind::Predicted | Kind::Predictive => Box::new(Predictive::new(self.patch, self.kind == Kind::Predictive)),
            kind if kind.is_linear() => Box::new(LinearPatch::new(spec, self.boundary.clone())),
            _ => Box::new(Hold::default()),
        }
    }
}
