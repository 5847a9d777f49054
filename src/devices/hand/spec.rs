//! The parameters of a simulated device and of the hand that holds it.

use super::super::Capabilities;

/// What is wrong with a parameter: its name and what would be right.
pub(crate) type SpecFault = (&'static str, String);

/// An axis of space, in scenes `x`, `y` or `z`.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, serde::Deserialize, serde::Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Axis {
    /// The first axis.
    X,
    /// The second axis.
    Y,
    /// The third axis.
    Z,
}

/// A simulated device: a mass with friction along each axis, and what lies between its motors and sensors and the program.
#[derive(Clone, Debug, PartialEq, serde::Deserialize, serde::Serialize)]
#[serde(deny_unknown_fields, default)]
pub struct PlantSpec {
    /// Moving mass m (kg).
    pub mass_kg: f64,
    /// Viscous friction b (N s/m).
    pub damping_n_s_per_m: f64,
    /// Coulomb friction F_c of each axis (N): below it the device sticks.
    pub friction_n: f64,
    /// A constant force, such as a weight that nothing balances (N).
    pub bias_n: [f64; 3],
    /// The axes along which it moves; it stands still along the others.
    pub axes: Vec<Axis>,
    /// Position at which the device starts, at rest (m); where the hand wants to be if absent.
    pub start_m: Option<[f64; 3]>,
    /// Step of the position that it tells (m); 0 for none.
    pub encoder_step_m: f64,
    /// Cut-off of the low-pass filter over the differences of position that it tells as velocity (Hz); none if `None`. A scene
    /// that leaves it out has 100.
    pub velocity_cutoff_hz: Option<f64>,
    /// Delay from a command to the motors (ms). A delay on the way of the state has the same effect on a loop: add it.
    pub delay_ms: f64,
    /// Largest random addition to the delay of a command (ms), evenly spread; no command overtakes another.
    pub jitter_ms: f64,
    /// Seed of the jitter.
    pub seed: u64,
    /// Longest step of the integration (ms).
    pub step_ms: f64,
    /// Moment of inertia about every axis through the tool (kg m^2).
    pub inertia_kg_m2: f64,
    /// Viscous friction of its turning (N m s/rad).
    pub turning_damping_n_m_s_per_rad: f64,
    /// Largest torque of its motors (N m); those of the profile if absent, which have none.
    pub max_torque_n_m: Option<f64>,
}

impl Default for PlantSpec {
    /// A small device of 100 g with an encoder step of 30 um, without delay. It turns as a pen of 30 g and 14 cm does.
    fn default() -> Self {
        Self {
            mass_kg: 0.1,
            damping_n_s_per_m: 0.1,
            friction_n: 0.05,
            bias_n: [0.0; 3],
            axes: vec![Axis::X, Axis::Y, Axis::Z],
            start_m: None,
            encoder_step_m: 30e-6,
            velocity_cutoff_hz: Some(100.0),
            delay_ms: 0.0,
            jitter_ms: 0.0,
            seed: 0,
            step_ms: 0.1,
            inertia_kg_m2: 5e-5,
            turning_damping_n_m_s_per_rad: 1e-4,
            max_torque_n_m: None,
        }
    }
}

/// Beyond this a transport is broken, not slow (ms).
const LONGEST_DELAY_MS: f64 = 100.0;
/// A step of the integration (ms): finer ones cost more than a tick, coarser ones hide the device.
const STEP_MS: std::ops::RangeInclusive<f64> = 0.001..=10.0;

impl PlantSpec {
    /// The abilities of such a device: of the plant what it has, of the rest what `profile` says.
    pub(crate) fn capabilities(&self, profile: Capabilities) -> Capabilities {
        let known = |value: f64| Some(value).filter(|value| *value > 0.0);
        let degrees_of_freedom = [Axis::X, Axis::Y, Axis::Z].iter().filter(|axis| self.axes.contains(axis)).count();
        Capabilities {
            degrees_of_freedom: degrees_of_freedom as u8,
            position_resolution_m: known(self.encoder_step_m).or(profile.position_resolution_m),
            damping_n_s_per_m: known(self.damping_n_s_per_m).or(profile.damping_n_s_per_m),
            friction_n: known(self.friction_n).or(profile.friction_n),
            max_torque_n_m: self.max_torque_n_m.or(profile.max_torque_n_m),
            delay_s: known(1e-3 * (self.delay_ms + self.jitter_ms)).or(profile.delay_s),
            ..profile
        }
    }

    pub(crate) fn fault(&self) -> Option<SpecFault> {
        let not_negative = [
            ("damping_n_s_per_m", self.damping_n_s_per_m),
            ("friction_n", self.friction_n),
            ("encoder_step_m", self.encoder_step_m),
            ("delay_ms", self.delay_ms),
            ("jitter_ms", self.jitter_ms),
            ("turning_damping_n_m_s_per_rad", self.turning_damping_n_m_s_per_rad),
        ];
        let positive = [("mass_kg", Some(self.mass_kg)), ("inertia_kg_m2", Some(self.inertia_kg_m2))];
        let positive = positive.into_iter().chain([("max_torque_n_m", self.max_torque_n_m)]);
        let positive = positive.filter_map(|(field, value)| Some((field, value?)));
        if let Some(fault) = positive.into_iter().find_map(|(field, value)| not_positive(field, value)) {
            return Some(fault);
        }
        if let Some(fault) = not_negative.into_iter().find_map(|(field, value)| negative(field, value)) {
            return Some(fault);
        }
        for (field, value) in [("bias_n", Some(self.bias_n)), ("start_m", self.start_m)] {
            if let Some(value) = value.filter(|value| !value.iter().all(|c| c.is_finite())) {
                return Some((field, format!("is {value:?}, must be three finite numbers")));
            }
        }
        if self.axes.is_empty() {
            return Some(("axes", "is empty, name at least one of \"x\", \"y\" and \"z\"".to_owned()));
        }
        if let Some(fault) = self.velocity_cutoff_hz.and_then(|hz| not_positive("velocity_cutoff_hz", hz)) {
            return Some(fault);
        }
        if self.delay_ms + self.jitter_ms > LONGEST_DELAY_MS {
            let (delay_ms, jitter_ms) = (self.delay_ms, self.jitter_ms);
            let message =
                format!("and jitter_ms are {delay_ms} and {jitter_ms}, must be {LONGEST_DELAY_MS} ms at most");
            return Some(("delay_ms", message));
        }
        if !STEP_MS.contains(&self.step_ms) {
            let message = format!("is {}, must be {} to {} ms", self.step_ms, STEP_MS.start(), STEP_MS.end());
            return Some(("step_ms", message));
        }
        None
    }
}

/// A hand that holds the device: its mass moves with the device, and a spring draws both to where it wants to be.
#[derive(Clone, Debug, PartialEq, serde::Deserialize, serde::Serialize)]
#[serde(deny_unknown_fields, default)]
pub struct HandSpec {
    /// Mass of hand and arm that moves with the device (kg).
    pub mass_kg: f64,
    /// Damping of the hand, against rest (N s/m).
    pub damping_n_s_per_m: f64,
    /// Stiffness of the spring to the intended place (N/m).
    pub stiffness_n_per_m: f64,
    /// Firmness of the grip over time: rows of time (s) and level. The level multiplies mass, inertia, both dampings and both
    /// stiffnesses; linear in between, held outside; 1 throughout if empty.
    pub grip: Vec<[f64; 2]>,
    /// Time at which the hand lets go for good (s); never if absent.
    pub release_s: Option<f64>,
    /// Moment of inertia of the fingers that turn with the device (kg m^2).
    pub inertia_kg_m2: f64,
    /// Damping of the hand's turning, against rest (N m s/rad).
    pub turning_damping_n_m_s_per_rad: f64,
    /// Stiffness of the spring to the intended orientation (N m/rad).
    pub turning_stiffness_n_m_per_rad: f64,
}

impl Default for HandSpec {
    /// A light grip.
    fn default() -> Self {
        Self {
            mass_kg: 0.1,
            damping_n_s_per_m: 4.0,
            stiffness_n_per_m: 300.0,
            grip: Vec::new(),
            release_s: None,
            inertia_kg_m2: 1e-4,
            turning_damping_n_m_s_per_rad: 0.015,
            turning_stiffness_n_m_per_rad: 1.0,
        }
    }
}

impl HandSpec {
    pub(crate) fn fault(&self) -> Option<SpecFault> {
        let numbers = [
            ("mass_kg", self.mass_kg),
            ("damping_n_s_per_m", self.damping_n_s_per_m),
            ("stiffness_n_per_m", self.stiffness_n_per_m),
            ("release_s", self.release_s.unwrap_or_default()),
            ("inertia_kg_m2", self.inertia_kg_m2),
            ("turning_damping_n_m_s_per_rad", self.turning_damping_n_m_s_per_rad),
            ("turning_stiffness_n_m_per_rad", self.turning_stiffness_n_m_per_rad),
        ];
        if let Some(fault) = numbers.into_iter().find_map(|(field, value)| negative(field, value)) {
            return Some(fault);
        }
        let rows = self.grip.iter();
        if let Some(row) = rows.clone().find(|row| !row.iter().all(|value| value.is_finite() && *value >= 0.0)) {
            return Some(("grip", format!("has the row {row:?}, time (s) and level must be finite and at least 0")));
        }
        let unordered = self.grip.windows(2).find(|pair| pair[1][0] <= pair[0][0]);
        unordered.map(|pair| ("grip", format!("has {} s after {} s, times must increase", pair[1][0], pair[0][0])))
    }

    /// How firmly it holds at `time_s` (s).
    pub(super) fn level_at(&self, time_s: f64) -> f64 {
        let next = self.grip.partition_point(|row| row[0] <= time_s);
        match (next.checked_sub(1).and_then(|last| self.grip.get(last)), self.grip.get(next)) {
            (None, None) => 1.0,
            (Some(row), None) | (None, Some(row)) => row[1],
            (Some([from_s, from]), Some([to_s, to])) => from + (to - from) * (time_s - from_s) / (to_s - from_s),
        }
    }
}

fn not_positive(field: &'static str, value: f64) -> Option<SpecFault> {
    let is_good = value.is_finite() && value > 0.0;
    (!is_good).then(|| (field, format!("is {value}, must be a finite number above 0")))
}

fn negative(field: &'static str, value: f64) -> Option<SpecFault> {
    let is_good = value.is_finite() && value >= 0.0;
    (!is_good).then(|| (field, format!("is {value}, must be a finite number of at least 0")))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_grip_is_linear_between_its_rows_and_held_outside() {
        let hand = HandSpec { grip: vec![[1.0, 1.0], [2.0, 0.2]], ..HandSpec::default() };
        let levels = [0.0, 1.0, 1.5, 2.0, 9.0].map(|time_s| hand.level_at(time_s));
        assert_eq!(levels, [1.0, 1.0, 0.6, 0.2, 0.2]);
        assert_eq!(HandSpec::default().level_at(3.0), 1.0);
    }

    #[test]
    fn what_cannot_be_is_named() {
        let plant = PlantSpec::default();
        for (bad, field) in [
            (PlantSpec { mass_kg: 0.0, ..plant.clone() }, "mass_kg"),
            (PlantSpec { friction_n: -0.1, ..plant.clone() }, "friction_n"),
            (PlantSpec { bias_n: [0.0, f64::NAN, 0.0], ..plant.clone() }, "bias_n"),
            (PlantSpec { axes: Vec::new(), ..plant.clone() }, "axes"),
            (PlantSpec { start_m: Some([f64::INFINITY; 3]), ..plant.clone() }, "start_m"),
            (PlantSpec { velocity_cutoff_hz: Some(0.0), ..plant.clone() }, "velocity_cutoff_hz"),
            (PlantSpec { jitter_ms: 101.0, ..plant.clone() }, "delay_ms"),
            (PlantSpec { step_ms: 0.0, ..plant.clone() }, "step_ms"),
            (PlantSpec { inertia_kg_m2: 0.0, ..plant.clone() }, "inertia_kg_m2"),
            (PlantSpec { turning_damping_n_m_s_per_rad: -1.0, ..plant.clone() }, "turning_damping_n_m_s_per_rad"),
            (PlantSpec { max_torque_n_m: Some(f64::NAN), ..plant.clone() }, "max_torque_n_m"),
        ] {
            assert_eq!(bad.fault().map(|fault| fault.0), Some(field));
        }
        let hand = HandSpec::default();
        for (bad, field) in [
            (HandSpec { stiffness_n_per_m: f64::NAN, ..hand.clone() }, "stiffness_n_per_m"),
            (HandSpec { inertia_kg_m2: -1.0, ..hand.clone() }, "inertia_kg_m2"),
            (HandSpec { turning_stiffness_n_m_per_rad: f64::NAN, ..hand.clone() }, "turning_stiffness_n_m_per_rad"),
            (HandSpec { release_s: Some(-1.0), ..hand.clone() }, "release_s"),
            (HandSpec { grip: vec![[0.0, -1.0]], ..hand.clone() }, "grip"),
            (HandSpec { grip: vec![[1.0, 1.0], [1.0, 0.5]], ..hand.clone() }, "grip"),
        ] {
            assert_eq!(bad.fault().map(|fault| fault.0), Some(field));
        }
        assert_eq!((plant.fault(), hand.fault()), (None, None));
    }
}
