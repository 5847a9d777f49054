//! The global and the local model's part of a scene: rates, sizes, feedback, steps, blending.

use std::path::PathBuf;

use super::sizes::Sizes;
use crate::model::local::{BlendKind, Feedback, Kind};
use crate::model::simulation::Simulation;

/// The global model of a scene: the slow, detailed simulation.
#[derive(Clone, Copy, Debug, PartialEq, serde::Deserialize, serde::Serialize)]
#[serde(deny_unknown_fields, default)]
pub struct GlobalSpec {
    /// Releases per second.
    pub rate_hz: f64,
    /// Explicit steps per millisecond; chosen from the stability limit if absent.
    pub substeps_per_ms: Option<u32>,
    /// Haptic ticks that one step of the whole body spans; more than one where its stability allows steps longer than a haptic tick. Not in
    /// `full`, which is simulated at the haptic rate.
    pub ticks_per_step: u32,
    /// Cores that compute the forces of the whole body, also where it is simulated at the haptic rate (`full`); more than one takes the
    /// feature `parallel`.
    pub cores: usize,
    /// Nodes around a window that run ahead for its prediction; of a larger body the rest goes on as it does.
    pub ahead_nodes: usize,
    /// Time after its release at which a result becomes visible, in virtual time (ms).
    pub compute_latency_ms: f64,
    /// Time that making the reduced surroundings of a patch takes, in virtual time (ms); if absent, what it takes on no machine in
    /// particular.
    pub basis_latency_ms: Option<f64>,
}

impl Default for GlobalSpec {
    fn default() -> Self {
        Self {
            rate_hz: 30.0,
            substeps_per_ms: None,
            ticks_per_step: 1,
            cores: 1,
            ahead_nodes: Simulation::AHEAD,
            compute_latency_ms: 0.0,
            basis_latency_ms: None,
        }
    }
}

/// The local model of a scene: the fast, small simulation around a tool.
#[derive(Clone, Debug, PartialEq, serde::Deserialize, serde::Serialize)]
#[serde(deny_unknown_fields, default)]
pub struct LocalSpec {
    /// Releases per second.
    pub rate_hz: f64,
    /// Name of the local model, or `auto`.
    pub model: ModelChoice,
    /// The error (rms, % of the peak force) that 19 of 20 random scenes are to be within: of a model that `auto` may choose, 1 if
    /// absent; and of `predictive`, which becomes smaller if that does and neither `patch` nor `basis` is given.
    pub error_pct: Option<f64>,
    /// Patch window: nodes along the surface, along it, into depth. If absent, what
    /// [`Scene::patch_size`](super::Scene::patch_size) says.
    pub patch: Option<[usize; 3]>,
    /// States of the reduced surroundings (`predictive`); 0 for a ring that only moves as predicted. If absent, 250, or
    /// fewer if they do for `error_pct`.
    pub basis: Option<usize>,
    /// Folder in which bases are kept from run to run; relative to the current one. If absent, it is the user's cache for a scene
    /// that was read from a file and runs in real time, and none for others.
    pub basis_folder: Option<PathBuf>,
    /// False for bases that are kept nowhere.
    pub keep_bases: bool,
    /// The data that the global model takes over from the local one; if absent, those that the model is best with.
    pub feedback: Option<Feedback>,
    /// The way in which a linear patch is stepped.
    pub step: StepKind,
    /// The way in which a resync's discontinuity is spread over time.
    pub blend: BlendSpec,
    /// True for a tool that hangs on the device by a spring and damper whose gains follow from the device and the body.
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
            keep_bases: true,
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

    /// The budget that sizes `predictive`, and the sizes; `None` where a number is given.
    pub(crate) fn budget(&self) -> Option<(f64, Sizes)> {
        let error_pct = self.error_pct.filter(|_| self.patch.is_none() && self.basis.is_none())?;
        Some((error_pct, Sizes::within(error_pct)))
    }

    /// The number of states that the reduced surroundings of `predictive` are to have.
    pub fn basis_states(&self) -> usize {
        self.basis.unwrap_or_else(|| self.budget().map_or(Sizes::USUAL, |(_, sizes)| sizes).states)
    }
}

/// The way in which a linear patch is stepped through a haptic tick.
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

/// The way in which a resync's discontinuity is spread over time.
#[derive(Clone, Copy, Debug, Default, PartialEq, serde::Deserialize, serde::Serialize)]
#[serde(deny_unknown_fields)]
pub struct BlendSpec {
    /// The kind of blend.
    pub kind: BlendKind,
    /// Length of the blend (ms), at most a period of the global model; not used by `none`.
    #[serde(default)]
    pub ms: f64,
}

/// A local model by name, or the choice of one.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub enum ModelChoice {
    /// The cheapest that fits the rates and meets [`LocalSpec::error_pct`], chosen when a
    /// session is built.
    #[default]
    Auto,
    /// The model of this name.
    Named(Kind),
}

impl ModelChoice {
    /// Every choice by name: the models in order of cost, then `auto`.
    pub const NAMES: &'static [&'static str] = &NAMES;

    /// The name of the choice in scene files.
    pub fn name(self) -> &'static str {
        match self {
            Self::Auto => AUTO,
            Self::Named(kind) => kind.name(),
        }
    }

    /// The choice that is called `name`.
    pub fn from_name(name: &str) -> Option<Self> {
        let named = || Kind::ALL.into_iter().find(|kind| kind.name() == name).map(Self::Named);
        if name == AUTO { Some(Self::Auto) } else { named() }
    }

    /// The model, if it is named.
    pub fn named(self) -> Option<Kind> {
        match self {
            Self::Auto => None,
            Self::Named(kind) => Some(kind),
        }
    }

    /// True if `holds` is true of the model, or of every one that could be chosen.
    pub(crate) fn all(self, holds: impl Fn(Kind) -> bool) -> bool {
        match self {
            Self::Auto => Kind::ALL.into_iter().all(holds),
            Self::Named(kind) => holds(kind),
        }
    }
}

const AUTO: &str = "auto";

const NAMES: [&str; Kind::ALL.len() + 1] = {
    let mut names = [AUTO; Kind::ALL.len() + 1];
    let mut index = 0;
    while index < Kind::ALL.len() {
        names[index] = Kind::ALL[index].name();
        index += 1;
    }
    names
};

impl From<Kind> for ModelChoice {
    fn from(kind: Kind) -> Self {
        Self::Named(kind)
    }
}

impl serde::Serialize for ModelChoice {
    fn serialize<S: serde::Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.serialize_str(self.name())
    }
}

impl<'de> serde::Deserialize<'de> for ModelChoice {
    fn deserialize<D: serde::Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        struct Name;
        impl serde::de::Visitor<'_> for Name {
            type Value = ModelChoice;

            fn expecting(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
                f.write_str("the name of a local model")
            }

            fn visit_str<E: serde::de::Error>(self, name: &str) -> Result<ModelChoice, E> {
                ModelChoice::from_name(name).ok_or_else(|| E::unknown_variant(name, ModelChoice::NAMES))
            }
        }
        deserializer.deserialize_str(Name)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_name_is_that_of_one_choice_and_auto_is_no_model() {
        for name in ModelChoice::NAMES {
            assert_eq!(ModelChoice::from_name(name).map(ModelChoice::name), Some(*name));
        }
        assert_eq!(ModelChoice::NAMES.len(), Kind::ALL.len() + 1);
        assert_eq!(ModelChoice::default().named(), None);
        assert_eq!(ModelChoice::from_name("boundary"), None);
    }
}
