//! The global and the local model's part of a scene: rates, sizes, feedback, steps, blending.

use std::path::PathBuf;

pub use crate::model::blend::BlendKind;
pub use crate::model::local::{Feedback, Kind as LocalModelKind};

pub use crate::model::local::Prediction;

use super::ModelChoice;

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
#[derive(Clone, Debug, PartialEq)]
#[cfg_attr(feature = "scene", derive(serde::Deserialize, serde::Serialize), serde(deny_unknown_fields, default))]
pub struct LocalSpec {
    /// Releases per second.
    pub rate_hz: f64,
    /// Which local model.
    pub model: ModelChoice,
    /// The largest expected error of a model that `auto` may choose (rms, % of the peak force, see DESIGN.md).
    pub error_pct: f64,
    /// Patch window: nodes along the surface, along it, into depth.
    pub patch: [usize; 3],
    /// States of the reduced surroundings (`predictive`); 0 for a ring that only moves as predicted.
    pub basis: usize,
    /// Bases are kept in this folder from run to run; relative to the current one.
    pub basis_folder: Option<PathBuf>,
    /// How `predictive` looks ahead.
    pub prediction: Prediction,
    /// What the global model learns from the local one; what the model is best with if absent.
    pub feedback: Option<Feedback>,
    /// How a linear patch is stepped.
    pub step: StepKind,
    /// How a resync's discontinuity is spread.
    pub blend: BlendSpec,
    /// The tool hangs on the device by a spring and damper whose gains follow from the device and the body.
    pub coupling: bool,
}

impl Default for LocalSpec {
    fn default() -> Self {
        Self {
            rate_hz: 1000.0,
            model: ModelChoice::default(),
            error_pct: 1.0,
            patch: [4, 4, 2],
            basis: 50,
            basis_folder: None,
            prediction: Prediction::default(),
            feedback: None,
            step: StepKind::default(),
            blend: BlendSpec::default(),
            coupling: false,
        }
    }
}

/// How a linear patch is stepped through a haptic tick.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[cfg_attr(feature = "scene", derive(serde::Deserialize, serde::Serialize), serde(rename_all = "snake_case"))]
pub enum StepKind {
    /// Explicit while the stability limit asks for few steps per tick, implicit beyond.
    #[default]
    Auto,
    /// The global model's explicit steps.
    Explicit,
    /// One implicit step per tick.
    Implicit,
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
