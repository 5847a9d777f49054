//! The global and the local model's part of a scene: rates, sizes, feedback, steps, blending.

use std::path::PathBuf;

pub use crate::model::local::BlendKind;
pub use crate::model::local::{Feedback, Kind as LocalModelKind};

pub use crate::model::local::Prediction;
use crate::model::surroundings::LEAST_PCT;
pub use crate::model::surroundings::Size as BasisSize;

use super::ModelChoice;

/// The slow, detailed simulation.
#[derive(Clone, Copy, Debug, PartialEq, serde::Deserialize, serde::Serialize)]
#[serde(deny_unknown_fields, default)]
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
#[derive(Clone, Debug, PartialEq, serde::Deserialize, serde::Serialize)]
#[serde(deny_unknown_fields, default)]
pub struct LocalSpec {
    /// Releases per second.
    pub rate_hz: f64,
    /// Which local model.
    pub model: ModelChoice,
    /// The largest expected error (rms, % of the peak force, see DESIGN.md): of a model that `auto` may choose, 1 if absent;
    /// and of `predictive`, whose `patch` and `basis` become that large if they are absent. It sizes no other model.
    pub error_pct: Option<f64>,
    /// Patch window: nodes along the surface, along it, into depth. If absent, what `error_pct` needs with `predictive`, or
    /// 4 x 4 x 2.
    pub patch: Option<[usize; 3]>,
    /// States of the reduced surroundings (`predictive`); 0 for a ring that only moves as predicted. If absent, what
    /// `error_pct` needs, or 50 without that.
    pub basis: Option<usize>,
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
            error_pct: None,
            patch: None,
            basis: None,
            basis_folder: None,
            prediction: Prediction::default(),
            feedback: None,
            step: StepKind::default(),
            blend: BlendSpec::default(),
            coupling: false,
        }
    }
}

impl LocalSpec {
    /// The largest expected error of a model that `auto` may choose (%).
    pub fn chosen_within_pct(&self) -> f64 {
        self.error_pct.unwrap_or(1.0)
    }

    /// The patch window that was asked for, or 4 x 4 x 2: what a session takes unless it sizes it by `error_pct`.
    pub fn patch_size(&self) -> [usize; 3] {
        self.patch.unwrap_or([4, 4, 2])
    }

    /// Names the model that `auto` chose: a budget below what `predictive` keeps was met with a warning, and what it keeps is
    /// asked of it.
    pub(crate) fn name_chosen(&mut self, kind: LocalModelKind) {
        self.model = kind.into();
        if kind == LocalModelKind::Predictive {
            self.error_pct = self.error_pct.map(|error_pct| error_pct.max(LEAST_PCT));
        }
    }

    /// How large a basis is to be: a number of states that is given counts, then the budget.
    pub fn basis_size(&self) -> BasisSize {
        match (self.basis, self.error_pct) {
            (Some(states), _) => BasisSize::States(states),
            // `auto` may choose a model that does not meet less, and says so.
            (None, Some(error_pct)) => BasisSize::ErrorPct(error_pct.max(LEAST_PCT)),
            (None, None) => BasisSize::States(50),
        }
    }
}

/// How a linear patch is stepped through a haptic tick.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, serde::Deserialize, serde::Serialize)]
#[serde(rename_all = "snake_case")]
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
#[derive(Clone, Copy, Debug, Default, PartialEq, serde::Deserialize, serde::Serialize)]
#[serde(deny_unknown_fields)]
pub struct BlendSpec {
    /// The way.
    pub kind: BlendKind,
    /// How long (ms); not used by `none`.
    #[serde(default)]
    pub ms: f64,
}
