//! A tool on a spring behind a pointer: what a mouse, a finger or a pen moves, where there is no device.
//!
//! Whoever points tells where the tool is wanted ([`PointerHandle::point`]); between that place and the tool there are a spring and a
//! damper, and the tool is a mass that the commanded force pushes away. So the force is felt with the eyes: as the distance
//! between the pointer and the tool, f = k d at rest.
//!
//! The wanted place goes to the haptic tick through an exchange, wait-free on both sides. It comes from outside, as a real device's
//! position does: a log holds what the tool did, and a replay does not ask the pointer.

use super::hand::{Load, Motion, SpecFault, shortened};
use super::{Capabilities, Device, DeviceFault, DeviceState, ForceCommand};
use crate::error::Error;
use crate::model::Vec3;
use crate::runtime::Nanos;
use crate::runtime::exchange::{ExchangeReader, ExchangeWriter, exchange};

/// Longest step of the integration.
const STEP: Nanos = Nanos(250_000);
/// What lies between two reads is moved through in steps up to this; of more, the tool stood still.
const LONGEST_GAP: Nanos = Nanos(100_000_000);
/// A pointer that is farther away than this was never on a screen (m).
const FARTHEST_M: f64 = 1e3;

/// A pointer: the spring and damper between it and the tool, and the tool's mass.
#[derive(Clone, Debug, PartialEq, serde::Deserialize, serde::Serialize)]
#[serde(deny_unknown_fields, default)]
pub struct PointerSpec {
    /// Where the tool starts (m); above the middle of the body if absent.
    pub start_m: Option<[f64; 3]>,
    /// Mass of the tool (kg).
    pub mass_kg: f64,
    /// Stiffness of the spring between pointer and tool (N/m).
    pub stiffness_n_per_m: f64,
    /// Damping of the tool's motion (N s/m); what is just enough for it not to swing, 2 sqrt(k m), if absent.
    pub damping_n_s_per_m: Option<f64>,
    /// Largest speed of the spring's far end (m/s): a pointer jumps, and a tool that is torn along feels nothing.
    pub max_speed_m_s: f64,
}

impl Default for PointerSpec {
    /// A tool of 50 g on 300 N/m: 1 N is 3.3 mm, and it follows within 40 ms.
    fn default() -> Self {
        Self { start_m: None, mass_kg: 0.05, stiffness_n_per_m: 300.0, damping_n_s_per_m: None, max_speed_m_s: 0.5 }
    }
}

impl PointerSpec {
    /// The damping of the tool's motion (N s/m).
    ///
    /// # Real-time
    /// Wait-free, real-time safe.
    pub fn damping(&self) -> f64 {
        self.damping_n_s_per_m.unwrap_or_else(|| 2.0 * (self.stiffness_n_per_m * self.mass_kg).sqrt())
    }

    /// The abilities of such a device: its own damping, of the rest what `profile` says.
    pub(crate) fn capabilities(&self, profile: Capabilities) -> Capabilities {
        Capabilities { damping_n_s_per_m: Some(self.damping()), ..profile }
    }

    pub(crate) fn fault(&self) -> Option<SpecFault> {
        let positive = [
            ("mass_kg", self.mass_kg),
            ("stiffness_n_per_m", self.stiffness_n_per_m),
            ("max_speed_m_s", self.max_speed_m_s),
        ];
        if let Some((field, value)) = positive.into_iter().find(|(_, value)| !(value.is_finite() && *value > 0.0)) {
            return Some((field, format!("is {value}, must be a finite number above 0")));
        }
        if let Some(value) = self.damping_n_s_per_m.filter(|value| !(value.is_finite() && *value >= 0.0)) {
            return Some(("damping_n_s_per_m", format!("is {value}, must be a finite number of at least 0")));
        }
        let start = self.start_m.filter(|start| !start.iter().all(|c| c.is_finite()));
        start.map(|start| ("start_m", format!("is {start:?}, must be three finite numbers")))
    }
}

/// The pointer's end, for the program that has a mouse.
#[derive(Debug)]
pub struct PointerHandle {
    wanted: ExchangeWriter<Vec3>,
    home: Vec3,
}

impl PointerHandle {
    /// Wants the tool at `place` (m). False, and nothing changes, if that is no place: a number that is not finite, or a place
    /// that is a kilometre away.
    ///
    /// # Real-time
    /// Wait-free, for this side and for the tick.
    pub fn point(&mut self, place: [f64; 3]) -> bool {
        let place = Vec3::from(place);
        if !is_place(&place) {
            return false;
        }
        *self.wanted.buffer() = place;
        self.wanted.publish(Nanos::ZERO);
        true
    }

    /// Where the tool started (m).
    ///
    /// # Real-time
    /// Wait-free, real-time safe.
    pub fn home(&self) -> [f64; 3] {
        self.home.into()
    }
}

fn is_place(place: &Vec3) -> bool {
    place.iter().all(|c| c.is_finite() && c.abs() <= FARTHEST_M)
}

/// A tool on a spring and a damper behind a pointer.
///
/// ```
/// use palpate::devices::{Pointer, PointerSpec};
/// use palpate::prelude::*;
///
/// # fn main() -> Result<(), Error> {
/// let (mut tool, mut pointer) = Pointer::new(PointerSpec::default(), [0.0, 0.0, 0.1], Capabilities::TOUCH)?;
/// assert!(pointer.point([0.0, 0.0, 0.09]) && !pointer.point([f64::NAN; 3]));
/// let state = tool.read(Nanos(500_000_000)).unwrap();
/// assert!((state.position.z - 0.09).abs() < 1e-4, "half a second later it is there");
/// # Ok(())
/// # }
/// ```
///
/// # Real-time
/// Real-time safe: allocates nothing, at most 400 steps of three axes in a read.
#[derive(Debug)]
pub struct Pointer {
    spec: PointerSpec,
    capabilities: Capabilities,
    wanted: ExchangeReader<Vec3>,
    /// The spring's far end, on its way to what is wanted.
    pulled_to: Vec3,
    axes: [Motion; 3],
    now: Nanos,
    command: ForceCommand,
}

impl Pointer {
    /// A tool at rest at `home` (m), or where `spec` starts it, of a device with these `capabilities`; and the pointer that it follows.
    ///
    /// # Errors
    /// [`ErrorKind::Scene`](crate::ErrorKind::Scene) with the name of a parameter that cannot be.
    ///
    /// # Real-time
    /// Not real-time safe: allocates.
    pub fn new(spec: PointerSpec, home: [f64; 3], capabilities: Capabilities) -> Result<(Self, PointerHandle), Error> {
        let fault = spec.fault().or_else(|| capabilities.fault().map(|words| ("capabilities", format!(": {words}"))));
        if let Some((field, message)) = fault {
            return Err(Error::scene(field, message));
        }
        let home = Vec3::from(spec.start_m.unwrap_or(home));
        if !is_place(&home) {
            return Err(Error::scene("start_m", format!("is {:?}, must lie within {FARTHEST_M} m", home.as_slice())));
        }
        let (writer, reader) = exchange(|| home);
        let axes = std::array::from_fn(|axis| Motion { place: home[axis], velocity: 0.0 });
        let command = ForceCommand::ZERO;
        let tool = Self { spec, capabilities, wanted: reader, pulled_to: home, axes, now: Nanos::ZERO, command };
        Ok((tool, PointerHandle { wanted: writer, home }))
    }

    fn advance(&mut self, time: Nanos) {
        self.wanted.refresh();
        let wanted = *self.wanted.get();
        if time.saturating_sub(self.now) > LONGEST_GAP {
            self.now = time.saturating_sub(LONGEST_GAP);
        }
        while self.now < time {
            let ends = [self.now + STEP, time, self.command.expires];
            let end = ends.into_iter().filter(|end| *end > self.now).min().unwrap_or(time);
            self.step(wanted, end.saturating_sub(self.now).as_secs_f64());
            self.now = end;
        }
    }

    fn step(&mut self, wanted: Vec3, dt: f64) {
        let (way, most) = (wanted - self.pulled_to, self.spec.max_speed_m_s * dt);
        self.pulled_to = if way.norm() <= most { wanted } else { self.pulled_to + way * (most / way.norm()) };
        let force = self.exerting();
        for (axis, motion) in self.axes.iter_mut().enumerate() {
            *motion = motion.after(
                dt,
                &Load {
                    mass_kg: self.spec.mass_kg,
                    damping_n_s_per_m: self.spec.damping(),
                    stiffness_n_per_m: self.spec.stiffness_n_per_m,
                    intended_m: self.pulled_to[axis],
                    force_n: force[axis],
                    friction_n: 0.0,
                },
            );
        }
    }

    /// The force on the tool now (N), no larger than the device's largest.
    fn exerting(&self) -> Vec3 {
        shortened(self.command.at(self.now), self.capabilities.max_force_n)
    }
}

impl Device for Pointer {
    fn name(&self) -> &str {
        "pointer"
    }

    fn capabilities(&self) -> Capabilities {
        self.spec.capabilities(self.capabilities)
    }

    fn read(&mut self, time: Nanos) -> Result<DeviceState, DeviceFault> {
        self.advance(time);
        let position = Vec3::new(self.axes[0].place, self.axes[1].place, self.axes[2].place);
        let velocity = Vec3::new(self.axes[0].velocity, self.axes[1].velocity, self.axes[2].velocity);
        Ok(DeviceState { position, velocity, ..DeviceState::default() })
    }

    fn write(&mut self, command: ForceCommand) -> Result<(), DeviceFault> {
        let is_good = command.is_finite();
        self.command = if is_good { command } else { ForceCommand::ZERO };
        if is_good { Ok(()) } else { Err(DeviceFault::Refused) }
    }

    fn exerted(&self) -> Option<Vec3> {
        Some(self.exerting())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn pointer() -> (Pointer, PointerHandle) {
        Pointer::new(PointerSpec::default(), [0.0; 3], Capabilities::TOUCH).unwrap()
    }

    fn after_ms(tool: &mut Pointer, ms: std::ops::RangeInclusive<u64>) -> Vec<Vec3> {
        ms.map(|ms| tool.read(Nanos(ms * 1_000_000)).unwrap().position).collect()
    }

    #[test]
    fn the_tool_follows_without_swinging_and_no_faster_than_it_may() {
        let (mut tool, mut pointer) = pointer();
        assert!(pointer.point([0.03, 0.0, -0.04]));
        let places = after_ms(&mut tool, 1..=400);
        assert!((places.last().unwrap() - Vec3::new(0.03, 0.0, -0.04)).norm() < 1e-5);
        let steps = places.windows(2).map(|pair| (pair[1] - pair[0]).norm());
        assert!(steps.fold(0.0, f64::max) <= 0.5e-3 * (1.0 + 1e-9), "0.5 m/s");
        assert!(places.iter().all(|place| place.x <= 0.03 + 1e-9 && place.z >= -0.04 - 1e-9), "never beyond");
    }

    // Check that the force can be read off the picture: at rest it is the spring's stiffness times the distance.
    #[test]
    fn at_rest_the_force_is_the_distance_between_pointer_and_tool() {
        let (mut tool, _pointer) = pointer();
        tool.write(ForceCommand { force: Vec3::new(0.0, 0.0, 1.5), ..ForceCommand::ZERO }).unwrap();
        let place = *after_ms(&mut tool, 1..=500).last().unwrap();
        assert!((place - Vec3::new(0.0, 0.0, 1.5 / 300.0)).norm() < 1e-6, "{place}");
    }

    #[test]
    fn what_is_no_place_moves_nothing() {
        let (mut tool, mut pointer) = pointer();
        for bad in [f64::NAN, f64::INFINITY, f64::NEG_INFINITY, 1e308, -1e4] {
            for axis in 0..3 {
                let mut place = [0.01; 3];
                place[axis] = bad;
                assert!(!pointer.point(place), "{place:?}");
            }
        }
        assert_eq!(after_ms(&mut tool, 1..=50).last(), Some(&Vec3::zeros()));
        assert_eq!(tool.write(ForceCommand::until(Vec3::repeat(f64::NAN), Nanos(u64::MAX))), Err(DeviceFault::Refused));
        assert_eq!(tool.exerted(), Some(Vec3::zeros()));
    }

    #[test]
    fn a_pause_of_hours_costs_a_tenth_of_a_second() {
        let (mut tool, mut pointer) = pointer();
        pointer.point([0.001, 0.0, 0.0]);
        assert!(tool.read(Nanos(u64::MAX / 2)).unwrap().position.x > 0.0009);
    }

    #[test]
    fn what_cannot_be_is_named() {
        let spec = PointerSpec::default();
        for (bad, field) in [
            (PointerSpec { mass_kg: 0.0, ..spec.clone() }, "mass_kg"),
            (PointerSpec { stiffness_n_per_m: f64::NAN, ..spec.clone() }, "stiffness_n_per_m"),
            (PointerSpec { damping_n_s_per_m: Some(-1.0), ..spec.clone() }, "damping_n_s_per_m"),
            (PointerSpec { max_speed_m_s: f64::INFINITY, ..spec.clone() }, "max_speed_m_s"),
            (PointerSpec { start_m: Some([f64::NAN; 3]), ..spec.clone() }, "start_m"),
        ] {
            assert_eq!(bad.fault().map(|fault| fault.0), Some(field));
            assert!(Pointer::new(bad, [0.0; 3], Capabilities::TOUCH).is_err());
        }
        assert_eq!(spec.fault(), None);
        assert!(Pointer::new(spec, [1e4, 0.0, 0.0], Capabilities::TOUCH).is_err());
    }
}
