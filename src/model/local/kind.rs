//! The local models by name.

/// The kinds of local models.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "serde", derive(serde::Deserialize, serde::Serialize), serde(rename_all = "snake_case"))]
pub enum Kind {
    /// The whole body at the haptic rate with all tools, a [`Simulation`](crate::simulation::Simulation): the reference that the
    /// others are measured against.
    Full,
    /// [`Hold`](super::Hold): the last force of the global model.
    Hold,
    /// The paper's: a linear patch in fixed surroundings.
    Patch,
    /// A linear patch in surroundings that move on with their velocity at the resync.
    LinearBoundary,
    /// A linear patch on springs scaled by depth.
    ScaledBoundary,
    /// A linear patch in surroundings that give way as at rest.
    Condensed,
    /// A non-linear patch in surroundings that move as predicted, whatever happens: [`Predictive`](Self::Predictive) without a
    /// basis.
    Predicted,
    /// A non-linear patch in surroundings that move as predicted, corrected by a reduced
    /// model of them.
    Predictive,
}

impl Kind {
    /// A linear patch whose stability asks for more takes one implicit step per tick: that costs as much as two explicit ones,
    /// and damps what four still show.
    pub const MOST_EXPLICIT_STEPS: u32 = 4;

    /// Every model, in order of cost.
    pub const ALL: [Self; 8] = [
        Self::Hold,
        Self::Patch,
        Self::LinearBoundary,
        Self::ScaledBoundary,
        Self::Condensed,
        Self::Predicted,
        Self::Predictive,
        Self::Full,
    ];

    /// The model's name in scene files, tables and logs.
    ///
    /// # Real-time
    /// Wait-free, real-time safe.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Full => "full",
            Self::Hold => "hold",
            Self::Patch => "patch",
            Self::LinearBoundary => "linear_boundary",
            Self::ScaledBoundary => "scaled_boundary",
            Self::Condensed => "condensed",
            Self::Predicted => "predicted",
            Self::Predictive => "predictive",
        }
    }

    /// True if the model holds a patch around the tool.
    ///
    /// # Real-time
    /// Wait-free, real-time safe.
    pub fn has_patch(self) -> bool {
        !matches!(self, Self::Full | Self::Hold)
    }

    /// True if the model's patch is linear: one that can take an implicit step.
    ///
    /// # Real-time
    /// Wait-free, real-time safe.
    pub fn is_linear(self) -> bool {
        matches!(self, Self::Patch | Self::LinearBoundary | Self::ScaledBoundary | Self::Condensed)
    }
}
