//! The global and the local model's part of a scene: rates, sizes, feedback, blending.

pub use crate::model::local::Prediction;

/// The slow, detailed simulation.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "scene", derive(serde::Deserialize, serde::Serialize), serde(deny_unknown_fields, default))]
pub struct GlobalSpec {
    /// Releases per second.
    pub rate_hz: f64,
    /// Explicit steps per millisecond; chosen from the stability limit if absent.
    pub substeps_per_ms: Option<u32>,
    /// Virtual time: how long after its release a result becomes visible (ms).
    pub compute_latency_ms: f64,
    /// Virtual time: the same for the reduced surroundings of a patch (ms).
    pub basis_latency_ms: f64,
}

impl Default for GlobalSpec {
    fn default() -> Self {
        Self { rate_hz: 30.0, substeps_per_ms: None, compute_latency_ms: 0.0, basis_latency_ms: 0.0 }
    }
}

/// The fast, small simulation.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "scene", derive(serde::Deserialize, serde::Serialize), serde(deny_unknown_fields, default))]
pub struct LocalSpec {
    /// Releases per second.
    pub rate_hz: f64,
    /// Which local model.
    pub model: LocalModelKind,
    /// Patch window: nodes along the surface, along it, into depth.
    pub patch: [usize; 3],
    /// States of the reduced surroundings (`predictive`); 0 for a ring that only moves as predicted.
    pub basis: usize,
    /// How `predictive` looks ahead.
    pub prediction: Prediction,
    /// What the global model learns from the local one.
    pub feedback: Option<Feedback>,
    /// How a resync's discontinuity is spread.
    pub blend: BlendSpec,
}

impl Default for LocalSpec {
    fn default() -> Self {
        Self {
            rate_hz: 1000.0,
            model: LocalModelKind::default(),
            patch: [4, 4, 2],
            basis: 50,
            prediction: Prediction::default(),
            feedback: None,
            blend: BlendSpec::default(),
        }
    }
}

/// The local models.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "scene", derive(serde::Deserialize, serde::Serialize), serde(rename_all = "snake_case"))]
pub enum LocalModelKind {
    /// The whole body at the haptic rate: the reference that the others are measured against.
    Full,
    /// The last force of the global model.
    Hold,
    /// The paper's: a linear patch in fixed surroundings.
    #[default]
    Patch,
    /// A non-linear patch in surroundings that move as predicted, corrected by a reduced model of them.
    Predictive,
}

impl LocalModelKind {
    /// Every model, in order of cost.
    pub const ALL: [Self; 4] = [Self::Hold, Self::Patch, Self::Predictive, Self::Full];

    /// Its name in scene files and tables.
    pub fn name(self) -> &'static str {
        match self {
            Self::Full => "full",
            Self::Hold => "hold",
            Self::Patch => "patch",
            Self::Predictive => "predictive",
        }
    }
}

/// What the global model learns from the local one, besides the tool's trajectory.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "scene", derive(serde::Deserialize, serde::Serialize), serde(rename_all = "snake_case"))]
pub enum Feedback {
    /// Nothing: it resolves the contact along the tool's trajectory itself.
    Trajectory,
    /// The patch's positions, velocities and contact replace its own: the paper's.
    Geometry,
}

impl Feedback {
    /// True if `model` can give it: only a patch has a geometry of its own.
    pub fn fits(self, model: LocalModelKind) -> bool {
        self == Self::Trajectory || model == LocalModelKind::Patch
    }
}

/// How a resync's discontinuity is spread over time.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[cfg_attr(feature = "scene", derive(serde::Deserialize, serde::Serialize), serde(deny_unknown_fields))]
pub struct BlendSpec {
    /// The way.
    pub kind: BlendKind,
    /// How long (ms); not used by `none`.
    #[cfg_attr(feature = "scene", serde(default))]
    pub ms: f64,
}

/// The ways of blending.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[cfg_attr(feature = "scene", derive(serde::Deserialize, serde::Serialize), serde(rename_all = "snake_case"))]
pub enum BlendKind {
    /// The new model's force at once.
    #[default]
    None,
    /// Old and new model both run; the force moves linearly from one to the other.
    Crossfade,
}
