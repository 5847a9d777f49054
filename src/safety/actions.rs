//! Which stages acted.

/// The stages that acted on a command, a bit each.
///
/// # Real-time
/// A plain value: its methods are wait-free and real-time safe.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub struct Actions(pub u16);

impl Actions {
    /// A force that was not finite was replaced by zero.
    pub const FINITE: Self = Self(1);
    /// A force above the limit was shortened.
    pub const CLAMP: Self = Self(1 << 1);
    /// A change above the limit was shortened.
    pub const SLEW: Self = Self(1 << 2);
    /// The force was on its way to rest or back.
    pub const RAMP: Self = Self(1 << 3);
    /// The tool was too fast.
    pub const TOOL_SPEED: Self = Self(1 << 4);
    /// A step of a model swap that the tank could not pay was blended.
    pub const TANK: Self = Self(1 << 5);
    /// Damping was added against an energy deficit.
    pub const PASSIVITY: Self = Self(1 << 6);
    /// Force was withdrawn against an energy deficit.
    pub const WITHDRAWN: Self = Self(1 << 7);
    /// The local model was too old.
    pub const MODEL_AGE: Self = Self(1 << 8);
    /// The force was not engaged yet, or ramping in for the first time.
    pub const START_UP: Self = Self(1 << 9);
    /// The stages made a force that was not finite; it was replaced by zero.
    pub const FINAL_FINITE: Self = Self(1 << 10);
    /// The stages made a force above the limit; it was shortened.
    pub const FINAL_CLAMP: Self = Self(1 << 11);
    /// The stages made a change above the limit; it was shortened.
    pub const FINAL_SLEW: Self = Self(1 << 12);
    /// The device had said nothing new for too long.
    pub const WATCHDOG: Self = Self(1 << 13);

    /// Names of the bits, lowest first.
    pub const NAMES: [&'static str; 14] = [
        "finite",
        "clamp",
        "slew",
        "ramp",
        "tool_speed",
        "tank",
        "passivity",
        "withdrawn",
        "model_age",
        "start_up",
        "final_finite",
        "final_clamp",
        "final_slew",
        "watchdog",
    ];

    /// True if every bit of `other` is set.
    pub fn contains(self, other: Self) -> bool {
        self.0 & other.0 == other.0
    }

    /// Sets the bits of `stage` if it `acted`.
    pub(super) fn note(&mut self, acted: bool, stage: Self) {
        if acted {
            self.0 |= stage.0;
        }
    }
}
