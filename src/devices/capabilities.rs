//! What a device can do: the numbers that limits, gains and simulated devices are derived from.

/// The abilities of a device. A program's own device names what it knows and takes the rest from
/// [`default`](Self::default), which is weaker and softer than any device of the table below.
///
/// The constants hold the limits that CHAI3D ships for these devices. What no source confirms is `None`.
/// Safety limits and coupling gains follow from these numbers.
///
/// | constant | force | stiffness | damping | workspace radius |
/// | --- | ---: | ---: | ---: | ---: |
/// | [`PHANTOM_PREMIUM`](Self::PHANTOM_PREMIUM), the paper's | 8.5 N | 800 N/m | 5 N s/m | 0.12 m |
/// | [`TOUCH`](Self::TOUCH) | 3.3 N | 400 N/m | 4 N s/m | 0.075 m |
/// | [`TOUCH_X`](Self::TOUCH_X) | 7.9 N | 1000 N/m | 5 N s/m | 0.10 m |
/// | [`FALCON`](Self::FALCON) | 8 N | 3000 N/m | 20 N s/m | 0.04 m |
/// | [`OMEGA_3`](Self::OMEGA_3) | 12 N | 5000 N/m | 30 N s/m | 0.075 m |
///
/// ```
/// use palpate::devices::Capabilities;
///
/// let own = Capabilities { max_force_n: 6.0, native_rate_hz: Some(4000.0), ..Capabilities::default() };
/// assert_eq!(own.fault(), None);
/// let no_size = Capabilities { workspace_radius_m: 0.0, ..Capabilities::TOUCH };
/// assert_eq!(no_size.fault(), Some("workspace_radius_m must be a finite number above 0"));
/// ```
///
/// # Real-time
/// A plain value: its methods are wait-free and real-time safe.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Capabilities {
    /// Number of axes along which the device moves and exerts force: 1 to 3.
    pub degrees_of_freedom: u8,
    /// Largest force that the device can or may exert (N).
    pub max_force_n: f64,
    /// Largest force that it exerts for as long as it is asked to (N), if its motors grow hot above.
    pub continuous_force_n: Option<f64>,
    /// Largest torque that the device can or may exert (N m); `None` for one that exerts none, as those of the table.
    pub max_torque_n_m: Option<f64>,
    /// Largest stiffness that it renders without a limit cycle (N/m).
    pub max_stiffness_n_per_m: f64,
    /// Largest damping that it renders without a limit cycle (N s/m).
    pub max_damping_n_s_per_m: f64,
    /// Mechanical damping of the device itself (N s/m), which keeps a rendered spring passive. Where it is unknown it
    /// is taken to be K T / 2 for the stiffness K that it renders, which a sampled wall asks for at least.
    pub damping_n_s_per_m: Option<f64>,
    /// Dry friction of the device itself (N).
    pub friction_n: Option<f64>,
    /// Delay from a command to the force of the motors (s), beyond the hold until the next command.
    pub delay_s: Option<f64>,
    /// Radius of a ball in its workspace (m).
    pub workspace_radius_m: f64,
    /// Smallest change of position that it tells (m).
    pub position_resolution_m: Option<f64>,
    /// Rate at which the device makes new states (Hz), if it has a clock of its own.
    pub native_rate_hz: Option<f64>,
}

impl Capabilities {
    /// Phantom Premium 1.5, the paper's device.
    pub const PHANTOM_PREMIUM: Self = Self::of_table(8.5, 800.0, 5.0, 0.12);
    /// Touch, earlier Omni. CHAI3D's lower numbers where its versions differ.
    pub const TOUCH: Self = Self::of_table(3.3, 400.0, 4.0, 0.075);
    /// Touch X, earlier Desktop.
    pub const TOUCH_X: Self = Self::of_table(7.9, 1000.0, 5.0, 0.10);
    /// Novint Falcon.
    pub const FALCON: Self = Self::of_table(8.0, 3000.0, 20.0, 0.04);
    /// Force Dimension omega.3.
    pub const OMEGA_3: Self = Self::of_table(12.0, 5000.0, 30.0, 0.075);

    /// A device of which only the largest force is known (N): the rest is [`default`](Self::default)'s.
    ///
    /// # Real-time
    /// Wait-free, real-time safe.
    pub fn of_force(max_force_n: f64) -> Self {
        Self { max_force_n, ..Self::default() }
    }

    const fn of_table(max_force_n: f64, stiffness: f64, damping: f64, radius_m: f64) -> Self {
        Self {
            degrees_of_freedom: 3,
            max_force_n,
            continuous_force_n: None,
            max_torque_n_m: None,
            max_stiffness_n_per_m: stiffness,
            max_damping_n_s_per_m: damping,
            damping_n_s_per_m: None,
            friction_n: None,
            delay_s: None,
            workspace_radius_m: radius_m,
            position_resolution_m: None,
            native_rate_hz: None,
        }
    }

    /// Names the first number that is impossible, with what would be right; `None` if none is.
    ///
    /// # Real-time
    /// Wait-free, real-time safe.
    pub fn fault(&self) -> Option<&'static str> {
        let is_size = |value: f64| value.is_finite() && value > 0.0;
        let is_size_if_known = |value: Option<f64>| value.is_none_or(is_size);
        [
            ((1..=3).contains(&self.degrees_of_freedom), "degrees_of_freedom must be 1, 2 or 3"),
            (is_size(self.max_force_n), "max_force_n must be a finite number above 0"),
            (is_size_if_known(self.continuous_force_n), "continuous_force_n must be a finite number above 0"),
            (
                self.continuous_force_n.is_none_or(|continuous_n| continuous_n <= self.max_force_n),
                "continuous_force_n must be at most max_force_n",
            ),
            (is_size_if_known(self.max_torque_n_m), "max_torque_n_m must be a finite number above 0"),
            (is_size(self.max_stiffness_n_per_m), "max_stiffness_n_per_m must be a finite number above 0"),
            (is_size(self.max_damping_n_s_per_m), "max_damping_n_s_per_m must be a finite number above 0"),
            (is_size_if_known(self.damping_n_s_per_m), "damping_n_s_per_m must be a finite number above 0"),
            (is_size_if_known(self.friction_n), "friction_n must be a finite number above 0"),
            (is_size_if_known(self.delay_s), "delay_s must be a finite number above 0"),
            (is_size(self.workspace_radius_m), "workspace_radius_m must be a finite number above 0"),
            (is_size_if_known(self.position_resolution_m), "position_resolution_m must be a finite number above 0"),
            (is_size_if_known(self.native_rate_hz), "native_rate_hz must be a finite number above 0"),
        ]
        .into_iter()
        .find_map(|(holds, words)| (!holds).then_some(words))
    }
}

impl Default for Capabilities {
    /// The weakest and softest numbers of the table, a line each.
    fn default() -> Self {
        Self::of_table(3.3, 400.0, 4.0, 0.04)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const TABLE: [Capabilities; 5] = [
        Capabilities::PHANTOM_PREMIUM,
        Capabilities::TOUCH,
        Capabilities::TOUCH_X,
        Capabilities::FALCON,
        Capabilities::OMEGA_3,
    ];

    #[test]
    fn the_default_promises_less_than_any_device_of_the_table() {
        let least = Capabilities::default();
        for device in TABLE {
            assert_eq!((device.fault(), device.max_torque_n_m), (None, None));
            assert!(least.max_force_n <= device.max_force_n);
            assert!(least.max_stiffness_n_per_m <= device.max_stiffness_n_per_m);
            assert!(least.max_damping_n_s_per_m <= device.max_damping_n_s_per_m);
            assert!(least.workspace_radius_m <= device.workspace_radius_m);
        }
    }

    #[test]
    fn an_impossible_number_is_named() {
        let good = Capabilities::default();
        for (bad, field) in [
            (Capabilities { degrees_of_freedom: 0, ..good }, "degrees_of_freedom"),
            (Capabilities { max_force_n: f64::NAN, ..good }, "max_force_n"),
            (Capabilities { continuous_force_n: Some(4.0), ..good }, "continuous_force_n"),
            (Capabilities { max_torque_n_m: Some(0.0), ..good }, "max_torque_n_m"),
            (Capabilities { max_stiffness_n_per_m: 0.0, ..good }, "max_stiffness_n_per_m"),
            (Capabilities { max_damping_n_s_per_m: -1.0, ..good }, "max_damping_n_s_per_m"),
            (Capabilities { damping_n_s_per_m: Some(f64::NAN), ..good }, "damping_n_s_per_m"),
            (Capabilities { friction_n: Some(-0.1), ..good }, "friction_n"),
            (Capabilities { delay_s: Some(f64::INFINITY), ..good }, "delay_s"),
            (Capabilities { workspace_radius_m: f64::INFINITY, ..good }, "workspace_radius_m"),
            (Capabilities { position_resolution_m: Some(0.0), ..good }, "position_resolution_m"),
            (Capabilities { native_rate_hz: Some(f64::NAN), ..good }, "native_rate_hz"),
        ] {
            assert!(bad.fault().is_some_and(|words| words.starts_with(field)), "{field}");
        }
    }
}
