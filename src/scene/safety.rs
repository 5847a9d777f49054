//! What stands between the computed force and the device.

/// Limits on the forces that reach a device. What a scene leaves out follows from the device and the rates.
#[derive(Clone, Debug, PartialEq, serde::Deserialize, serde::Serialize)]
#[serde(deny_unknown_fields, default)]
pub struct SafetySpec {
    /// Largest force (N); the device's own limit if absent.
    pub max_force_n: Option<f64>,
    /// Largest torque (N m); the device's own limit if absent, and none where the device exerts none.
    pub max_torque_n_m: Option<f64>,
    /// Largest change of the force (N/ms); the torque may change by the same share of its largest.
    pub max_slew_n_per_ms: f64,
    /// Time in which the force goes to zero when the run stops or fails, and comes back after a gap (ms).
    pub ramp_ms: f64,
    /// Tool speed from which on the force fades (m/s).
    pub fade_speed_m_s: f64,
    /// Tool speed from which on there is no force (m/s).
    pub stop_speed_m_s: f64,
    /// Energy that the tank of model swaps holds at the start, and at most (J).
    pub tank_j: f64,
    /// Energy in the tank below which no step of a swap passes unblended (J).
    pub tank_min_j: f64,
    /// Time over which a step is blended that the tank cannot pay (ms).
    pub swap_blend_ms: f64,
    /// Energy deficit at which no force is left (J).
    pub energy_tolerance_j: f64,
    /// Largest damping of the passivity controller (N s/m); what the device renders stably if absent.
    pub max_damping_n_s_per_m: Option<f64>,
    /// Largest stiffness of the virtual coupling (N/m); what the device renders stably if absent.
    pub max_stiffness_n_per_m: Option<f64>,
    /// The device's own mechanical damping (N s/m); what the device says if absent.
    pub device_damping_n_s_per_m: Option<f64>,
    /// The device's own dry friction (N); what the device says if absent.
    pub device_friction_n: Option<f64>,
    /// Smallest step of the device's position (m); what the device says if absent.
    pub device_resolution_m: Option<f64>,
    /// Delay from a command to the device's motors (ms); what the device says if absent.
    pub device_delay_ms: Option<f64>,
    /// Tool speed that may be nothing but noise (m/s); a step of the device's resolution per tick if absent.
    pub noise_m_s: Option<f64>,
    /// Age of the local model from which on the force fades (ms); three periods of the global model and its declared latency
    /// if absent, at least 100.
    pub max_age_ms: Option<f64>,
    /// Time in which the force of an old local model fades (ms).
    pub age_fade_ms: f64,
    /// Computed force (N) below which it has to be for four ticks before the device engages.
    pub engage_force_n: f64,
    /// Time over which the force ramps in once the device has engaged (ms).
    pub start_up_ms: f64,
    /// Ticks without a new state of the device after which its force goes to zero.
    pub watchdog_ticks: u32,
    /// Stages that are switched off.
    pub off: Vec<SafetyStage>,
}

impl SafetySpec {
    /// True if `stage` is not switched off.
    pub fn has(&self, stage: SafetyStage) -> bool {
        !self.off.contains(&stage)
    }
}

impl Default for SafetySpec {
    fn default() -> Self {
        Self {
            max_force_n: None,
            max_torque_n_m: None,
            max_slew_n_per_ms: 0.5,
            ramp_ms: 100.0,
            fade_speed_m_s: 1.0,
            stop_speed_m_s: 2.0,
            tank_j: 1e-3,
            tank_min_j: 1e-5,
            swap_blend_ms: 10.0,
            energy_tolerance_j: 2e-3,
            max_damping_n_s_per_m: None,
            max_stiffness_n_per_m: None,
            device_damping_n_s_per_m: None,
            device_friction_n: None,
            device_resolution_m: None,
            device_delay_ms: None,
            noise_m_s: None,
            max_age_ms: None,
            age_fade_ms: 200.0,
            engage_force_n: 0.2,
            start_up_ms: 2000.0,
            watchdog_ticks: 2,
            off: Vec::new(),
        }
    }
}

/// A stage of the safety pipeline, in its order.
#[derive(Clone, Copy, Debug, PartialEq, Eq, serde::Deserialize, serde::Serialize)]
#[serde(rename_all = "snake_case")]
pub enum SafetyStage {
    /// Numbers that are not finite become zero. Cannot be switched off.
    Finite,
    /// A force above the largest is shortened. Cannot be switched off.
    Clamp,
    /// A change of the force above the largest is shortened, at both places of the pipeline.
    Slew,
    /// The force fades for a tool that is too fast.
    ToolSpeed,
    /// Steps of model swaps are paid from a tank, or blended.
    Tank,
    /// Energy that the environment gives out beyond what it had is damped, or its force withdrawn.
    Passivity,
    /// The force of a local model that nobody renews fades.
    ModelAge,
    /// No force until the computed one was near zero, then a ramp.
    StartUp,
    /// The force of a silent device goes to zero.
    Watchdog,
}

impl SafetyStage {
    /// All stages, in the order of the pipeline.
    pub const ALL: [Self; 9] = [
        Self::Finite,
        Self::Clamp,
        Self::Slew,
        Self::ToolSpeed,
        Self::Tank,
        Self::Passivity,
        Self::ModelAge,
        Self::StartUp,
        Self::Watchdog,
    ];

    /// The name of the stage in scenes, logs and reports.
    pub fn name(self) -> &'static str {
        match self {
            Self::Finite => "finite",
            Self::Clamp => "clamp",
            Self::Slew => "slew",
            Self::ToolSpeed => "tool_speed",
            Self::Tank => "tank",
            Self::Passivity => "passivity",
            Self::ModelAge => "model_age",
            Self::StartUp => "start_up",
            Self::Watchdog => "watchdog",
        }
    }

    /// False for the two that no device may be without.
    pub fn can_be_off(self) -> bool {
        !matches!(self, Self::Finite | Self::Clamp)
    }
}
