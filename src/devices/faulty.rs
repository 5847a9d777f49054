//! Any device, with faults put in: what a run does about a device that fails can be tried without one that does.

use std::time::Duration;

use super::device::take_nothing;
use super::hand::SpecFault;
use super::{Calibration, Capabilities, Device, DeviceFault, DeviceState, ForceCommand, SafetyStop};
use crate::model::Vec3;
use crate::random::uniform;
use crate::runtime::Nanos;

/// A way in which a device fails, from one time to another.
#[derive(Clone, Copy, Debug, PartialEq, serde::Deserialize, serde::Serialize)]
#[serde(deny_unknown_fields)]
pub struct FaultSpec {
    /// The kind of the fault.
    pub kind: FaultKind,
    /// The first scheduled time at which the device fails (s).
    pub from_s: f64,
    /// The first scheduled time at which it does not fail any more (s).
    pub to_s: f64,
    /// Number of reads that a state is behind (`late`).
    #[serde(default = "one_read")]
    pub reads: u32,
    /// Probability of the loss of a frame, 0 to 1 (`lost`).
    #[serde(default = "certain")]
    pub probability: f64,
    /// Seed that decides which frames are lost: equal seeds lose equal frames (`lost`).
    #[serde(default)]
    pub seed: u64,
    /// Reason for which the device stopped itself (`safety_stop`).
    #[serde(default = "unknown")]
    pub stop: SafetyStop,
}

fn one_read() -> u32 {
    1
}

fn certain() -> f64 {
    1.0
}

fn unknown() -> SafetyStop {
    SafetyStop::Other
}

/// The faults that a scene file can name.
#[derive(Clone, Copy, Debug, PartialEq, Eq, serde::Deserialize, serde::Serialize)]
#[serde(rename_all = "snake_case")]
pub enum FaultKind {
    /// States come some reads late; commands are in time.
    Late,
    /// Frames are lost, with the commands that belong to them; the device says that it has nothing new.
    Lost,
    /// The last state is told again as if it were new.
    Frozen,
    /// Positions and velocities are no numbers.
    NotFinite,
    /// Nothing reaches the device, and nothing comes from it.
    Disconnected,
    /// The device has stopped itself: it takes no force and exerts none.
    SafetyStop,
}

impl FaultSpec {
    /// A fault of `kind` from `from_s` to `to_s` (s), with the defaults of a scene file.
    ///
    /// # Real-time
    /// Wait-free and real-time safe.
    pub fn new(kind: FaultKind, from_s: f64, to_s: f64) -> Self {
        Self { kind, from_s, to_s, reads: 1, probability: 1.0, seed: 0, stop: SafetyStop::Other }
    }

    /// Names the first key that cannot be, or does nothing, with what would be right.
    pub(crate) fn fault(&self) -> Option<SpecFault> {
        let Self { from_s, to_s, reads, probability, .. } = *self;
        if !(from_s.is_finite() && from_s >= 0.0) {
            return Some(("from_s", format!("is {from_s}, must be a finite number of at least 0")));
        }
        if !(to_s.is_finite() && to_s > from_s) {
            return Some(("to_s", format!("is {to_s}, must be a finite number above from_s, {from_s}")));
        }
        if !(1..=LATEST).contains(&(reads as usize)) {
            return Some(("reads", format!("is {reads}, must be 1 to {LATEST}")));
        }
        if !(0.0..=1.0).contains(&probability) {
            return Some(("probability", format!("is {probability}, must be 0 to 1")));
        }
        self.of_another_kind()
    }

    /// Names the first key that is given and that only another kind of fault has.
    fn of_another_kind(&self) -> Option<SpecFault> {
        let usual = Self::new(self.kind, self.from_s, self.to_s);
        let of_kind = [
            ("reads", self.reads != usual.reads, FaultKind::Late, "late"),
            ("probability", self.probability != usual.probability, FaultKind::Lost, "lost"),
            ("seed", self.seed != usual.seed, FaultKind::Lost, "lost"),
            ("stop", self.stop != usual.stop, FaultKind::SafetyStop, "safety_stop"),
        ];
        let (field, .., name) = of_kind.into_iter().find(|(_, is_set, kind, _)| *is_set && self.kind != *kind)?;
        Some((field, format!("belongs to kind = {name:?}, set that or leave it out")))
    }

    /// True if the device fails at `time`.
    fn acts_at(&self, time: Nanos) -> bool {
        (Nanos::from_secs_f64(self.from_s)..Nanos::from_secs_f64(self.to_s)).contains(&time)
    }
}

/// States that are remembered.
const ROOM: usize = 256;
/// The latest that a state can be, in reads.
const LATEST: usize = ROOM - 1;

/// A device that fails as told; where two faults overlap, the first of the list counts.
///
/// The device within is read at every release, so that it moves on and its own clock runs. It keeps what it was told last:
/// with the connection gone, only the expiry of the last command ends the force.
///
/// # Real-time
/// As the device within; allocates nothing, and is bounded by the number of faults.
#[derive(Debug)]
pub struct Faulty<D> {
    device: D,
    faults: Vec<FaultSpec>,
    now: Nanos,
    /// What the device within told, by the number of the read.
    told: [DeviceState; ROOM],
    reads: usize,
}

impl<D> Faulty<D> {
    /// `device`, failing by `faults`.
    ///
    /// # Real-time
    /// Not called in a tick.
    pub fn new(device: D, faults: Vec<FaultSpec>) -> Self {
        Self { device, faults, now: Nanos::ZERO, told: [DeviceState::default(); ROOM], reads: 0 }
    }

    /// The device within.
    ///
    /// # Real-time
    /// Wait-free, real-time safe.
    pub fn inner(&self) -> &D {
        &self.device
    }

    fn active(&self) -> Option<FaultSpec> {
        self.faults.iter().find(|fault| fault.acts_at(self.now)).copied()
    }

    /// The newest state but `back`, or the first.
    fn state_before(&self, back: usize) -> DeviceState {
        let newest = self.reads.saturating_sub(1);
        self.told[newest.saturating_sub(back.min(LATEST)) % ROOM]
    }

    /// Remembers what the device has told.
    fn tell(&mut self, state: DeviceState) {
        self.told[self.reads % ROOM] = state;
        self.reads += 1;
    }

    fn is_lost(&self, fault: &FaultSpec) -> bool {
        uniform(fault.seed, self.now.0) < fault.probability
    }
}

impl<D: Device> Device for Faulty<D> {
    fn name(&self) -> &str {
        self.device.name()
    }

    fn capabilities(&self) -> Capabilities {
        self.device.capabilities()
    }

    fn exerts_force(&self) -> bool {
        self.device.exerts_force()
    }

    fn calibration(&self) -> Calibration {
        self.device.calibration()
    }

    fn wait(&mut self, timeout: Duration) -> bool {
        self.device.wait(timeout)
    }

    fn read(&mut self, time: Nanos) -> Result<DeviceState, DeviceFault> {
        self.now = time;
        let (state, fault) = (self.device.read(time), self.active());
        if let Some(FaultSpec { kind: FaultKind::SafetyStop, stop, .. }) = fault {
            // Whether or not it can say where it is.
            self.device.write(ForceCommand::ZERO)?;
            if let Ok(state) = state {
                self.tell(state);
            }
            return Err(DeviceFault::SafetyStop(stop));
        }
        let state = state?;
        if fault.is_some_and(|fault| fault.kind == FaultKind::Frozen) {
            // Also where nothing has been told yet: then there is no last state to repeat.
            return if self.reads == 0 { Err(DeviceFault::NotReady) } else { Ok(self.state_before(0)) };
        }
        self.tell(state);
        let Some(fault) = fault else { return Ok(state) };
        match fault.kind {
            FaultKind::Late => Ok(self.state_before(fault.reads as usize)),
            FaultKind::Lost if self.is_lost(&fault) => Err(DeviceFault::Stale),
            FaultKind::NotFinite => {
                let nowhere = Vec3::repeat(f64::NAN);
                Ok(DeviceState { position: nowhere, velocity: nowhere, ..state })
            }
            FaultKind::Disconnected => Err(DeviceFault::Disconnected),
            _ => Ok(state),
        }
    }

    fn write(&mut self, command: ForceCommand) -> Result<(), DeviceFault> {
        let Some(fault) = self.active() else { return self.device.write(command) };
        match fault.kind {
            // The sender knows of no loss, but of what it must not send.
            FaultKind::Lost if self.is_lost(&fault) => take_nothing(command),
            FaultKind::Disconnected => Err(DeviceFault::Disconnected),
            FaultKind::SafetyStop => Err(DeviceFault::SafetyStop(fault.stop)),
            _ => self.device.write(command),
        }
    }

    fn exerted(&self) -> Option<Vec3> {
        self.device.exerted()
    }

    fn exerted_torque(&self) -> Option<Vec3> {
        self.device.exerted_torque()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::devices::{Hand, HandSpec, PlantSpec, Scripted, ToolPath};

    const MS: u64 = 1_000_000;

    fn fault(kind: FaultKind) -> FaultSpec {
        FaultSpec::new(kind, 0.010, 0.015)
    }

    fn faulty(fault: FaultSpec) -> Faulty<Scripted> {
        let path = ToolPath::new(vec![0.0, 1.0], vec![[0.0; 3], [1.0, 0.0, 0.0]]).unwrap();
        Faulty::new(Scripted::new(path), vec![fault])
    }

    /// Millimetres along x, read every ms; a fault's code is negative.
    fn told(fault: FaultSpec) -> Vec<i64> {
        let mut device = faulty(fault);
        let read = |ms: u64| match device.read(Nanos(ms * MS)) {
            Ok(state) => (state.position.x * 1e3).round() as i64,
            Err(fault) => -i64::from(fault.code()),
        };
        (0..18).map(read).collect()
    }

    #[test]
    fn each_fault_shows_in_its_window_only() {
        let late = told(FaultSpec { reads: 3, ..fault(FaultKind::Late) });
        assert_eq!(late[8..], [8, 9, 7, 8, 9, 10, 11, 15, 16, 17]);
        assert_eq!(told(FaultSpec { reads: u32::MAX, ..fault(FaultKind::Late) })[9..12], [9, 0, 0]);
        assert_eq!(told(fault(FaultKind::Frozen))[8..], [8, 9, 9, 9, 9, 9, 9, 15, 16, 17]);
        let lost = told(fault(FaultKind::Lost));
        assert_eq!(lost[8..], [8, 9, -1, -1, -1, -1, -1, 15, 16, 17]);
        assert_eq!(told(fault(FaultKind::Disconnected))[9..16], [9, -3, -3, -3, -3, -3, 15]);
        assert_eq!(told(FaultSpec { stop: SafetyStop::Stall, ..fault(FaultKind::SafetyStop) })[9..12], [9, -17, -17]);
        let mut device = faulty(fault(FaultKind::NotFinite));
        assert!(!device.read(Nanos(10 * MS)).unwrap().is_finite());
        assert!(device.read(Nanos(15 * MS)).unwrap().is_finite());
    }

    #[test]
    fn some_frames_are_lost_and_the_same_every_time() {
        let lossy = FaultSpec { probability: 0.3, seed: 5, ..FaultSpec::new(FaultKind::Lost, 0.0, 1e9) };
        let lost = || {
            let mut device = faulty(lossy);
            (0..1000).map(|ms| device.read(Nanos(ms * MS)).is_err()).collect::<Vec<_>>()
        };
        let first = lost();
        let count = first.iter().filter(|lost| **lost).count();
        // Five standard deviations of a binomial count around 300.
        assert!((228..372).contains(&count), "{count}");
        assert_eq!(first, lost());
    }

    fn pushed(kind: FaultKind) -> Faulty<Hand> {
        let path = ToolPath::constant([0.0; 3]).unwrap();
        let hand = Hand::new(path, PlantSpec::default(), HandSpec::default(), Capabilities::TOUCH).unwrap();
        let fault = FaultSpec { stop: SafetyStop::EmergencyBrake, ..FaultSpec::new(kind, 0.002, 0.5) };
        let mut device = Faulty::new(hand, vec![fault]);
        device.read(Nanos(MS)).unwrap();
        device.write(ForceCommand::until(Vec3::x(), Nanos(100 * MS))).unwrap();
        device
    }

    // Check that the force of a device that cannot be reached any more ends with its last command, and at once where the
    // device stops itself.
    #[test]
    fn a_force_ends_with_its_command_or_with_the_device() {
        let mut gone = pushed(FaultKind::Disconnected);
        let mut force_at = |ms: u64| {
            assert_eq!(gone.read(Nanos(ms * MS)), Err(DeviceFault::Disconnected));
            let command = ForceCommand::until(Vec3::x(), Nanos((ms + 100) * MS));
            assert_eq!(gone.write(command), Err(DeviceFault::Disconnected));
            gone.exerted().unwrap().x
        };
        assert_eq!([2, 50, 99, 100, 101].map(&mut force_at), [1.0, 1.0, 1.0, 0.0, 0.0]);
        let mut stopped = pushed(FaultKind::SafetyStop);
        let fault = DeviceFault::SafetyStop(SafetyStop::EmergencyBrake);
        assert_eq!(stopped.read(Nanos(2 * MS)), Err(fault));
        assert_eq!(stopped.write(ForceCommand::until(Vec3::x(), Nanos(u64::MAX))), Err(fault));
        assert_eq!(stopped.read(Nanos(3 * MS)), Err(fault));
        assert_eq!(stopped.exerted(), Some(Vec3::zeros()));
    }
}
