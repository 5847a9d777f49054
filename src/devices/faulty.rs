//! Any device, with faults put in: what a run does about a device that fails can be tried without one that does.

use std::time::Duration;

use super::{Calibration, Capabilities, Device, DeviceFault, DeviceState, ForceCommand, SafetyStop};
use crate::model::Vec3;
use crate::random::uniform;
use crate::runtime::Nanos;

/// A way in which a device fails.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub enum InjectedFault {
    /// States come so many reads late, at most [`FaultWindow::LATEST`]; commands are in time.
    Late {
        /// Reads that a state is behind.
        reads: usize,
    },
    /// A frame and the command that belongs to it are lost with this probability, and the device says that it has nothing
    /// new.
    Lost {
        /// From 0 to 1.
        probability: f64,
        /// Which frames: the same seed loses the same.
        seed: u64,
    },
    /// The last state is told again as if it were new.
    Frozen,
    /// Position and velocity are no numbers.
    NotFinite,
    /// Nothing reaches the device, and nothing comes from it.
    Disconnected,
    /// The device has stopped itself: it takes no force and exerts none.
    SafetyStop(SafetyStop),
}

/// A fault from one time to another.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FaultWindow {
    /// What fails.
    pub fault: InjectedFault,
    /// The first scheduled time at which it does.
    pub from: Nanos,
    /// The first at which it does not any more.
    pub to: Nanos,
}

/// States that are remembered.
const ROOM: usize = 256;

impl FaultWindow {
    /// The latest that a state can be, in reads.
    pub const LATEST: usize = ROOM - 1;
}

/// A device that fails as told; where two windows overlap, the first of the list counts.
///
/// The device within is read at every release, so that it moves on and its own clock runs. It keeps what it was told last:
/// with the connection gone, only the expiry of the last command ends the force.
///
/// # Real-time
/// As the device within; allocates nothing, and is bounded by the number of windows.
#[derive(Debug)]
pub struct Faulty<D> {
    device: D,
    windows: Vec<FaultWindow>,
    now: Nanos,
    /// What the device within told, by the number of the read.
    told: [DeviceState; ROOM],
    reads: usize,
}

impl<D> Faulty<D> {
    /// `device`, failing in `windows`.
    ///
    /// # Real-time
    /// Not called in a tick.
    pub fn new(device: D, windows: Vec<FaultWindow>) -> Self {
        Self { device, windows, now: Nanos::ZERO, told: [DeviceState::default(); ROOM], reads: 0 }
    }

    /// The device within.
    ///
    /// # Real-time
    /// Wait-free, real-time safe.
    pub fn inner(&self) -> &D {
        &self.device
    }

    fn active(&self) -> Option<InjectedFault> {
        let is_active = |window: &&FaultWindow| (window.from..window.to).contains(&self.now);
        self.windows.iter().find(is_active).map(|window| window.fault)
    }

    /// The newest state but `back`, or the first.
    fn state_before(&self, back: usize) -> DeviceState {
        let newest = self.reads.saturating_sub(1);
        self.told[newest.saturating_sub(back.min(FaultWindow::LATEST)) % ROOM]
    }

    /// Remembers what the device has told.
    fn tell(&mut self, state: DeviceState) {
        self.told[self.reads % ROOM] = state;
        self.reads += 1;
    }

    fn is_lost(&self, probability: f64, seed: u64) -> bool {
        uniform(seed, self.now.0) < probability
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
        if let Some(InjectedFault::SafetyStop(stop)) = fault {
            // Whether or not it can say where it is.
            self.device.write(ForceCommand::ZERO)?;
            if let Ok(state) = state {
                self.tell(state);
            }
            return Err(DeviceFault::SafetyStop(stop));
        }
        let state = state?;
        if fault == Some(InjectedFault::Frozen) {
            // Also where nothing has been told yet: then there is no last state to repeat.
            return if self.reads == 0 { Err(DeviceFault::NotReady) } else { Ok(self.state_before(0)) };
        }
        self.tell(state);
        match fault {
            Some(InjectedFault::Late { reads }) => Ok(self.state_before(reads)),
            Some(InjectedFault::Lost { probability, seed }) if self.is_lost(probability, seed) => {
                Err(DeviceFault::Stale)
            }
            Some(InjectedFault::NotFinite) => {
                let nowhere = Vec3::repeat(f64::NAN);
                Ok(DeviceState { position: nowhere, velocity: nowhere, ..state })
            }
            Some(InjectedFault::Disconnected) => Err(DeviceFault::Disconnected),
            _ => Ok(state),
        }
    }

    fn write(&mut self, command: ForceCommand) -> Result<(), DeviceFault> {
        match self.active() {
            Some(InjectedFault::Lost { probability, seed }) if self.is_lost(probability, seed) => {
                // The sender knows of no loss, but of what it must not send.
                if command.is_finite() { Ok(()) } else { Err(DeviceFault::Refused) }
            }
            Some(InjectedFault::Disconnected) => Err(DeviceFault::Disconnected),
            Some(InjectedFault::SafetyStop(stop)) => Err(DeviceFault::SafetyStop(stop)),
            _ => self.device.write(command),
        }
    }

    fn exerted(&self) -> Option<Vec3> {
        self.device.exerted()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::devices::{Hand, HandSpec, PlantSpec, Scripted, ToolPath};

    const MS: u64 = 1_000_000;

    fn faulty(fault: InjectedFault) -> Faulty<Scripted> {
        let path = ToolPath::new(vec![0.0, 1.0], vec![[0.0; 3], [1.0, 0.0, 0.0]]).unwrap();
        let window = FaultWindow { fault, from: Nanos(10 * MS), to: Nanos(15 * MS) };
        Faulty::new(Scripted::new(path), vec![window])
    }

    /// Millimetres along x, read every ms; a fault's code is negative.
    fn told(fault: InjectedFault) -> Vec<i64> {
        let mut device = faulty(fault);
        let read = |ms: u64| match device.read(Nanos(ms * MS)) {
            Ok(state) => (state.position.x * 1e3).round() as i64,
            Err(fault) => -i64::from(fault.code()),
        };
        (0..18).map(read).collect()
    }

    #[test]
    fn each_fault_shows_in_its_window_only() {
        let late = told(InjectedFault::Late { reads: 3 });
        assert_eq!(late[8..], [8, 9, 7, 8, 9, 10, 11, 15, 16, 17]);
        assert_eq!(told(InjectedFault::Late { reads: usize::MAX })[9..12], [9, 0, 0]);
        assert_eq!(told(InjectedFault::Frozen)[8..], [8, 9, 9, 9, 9, 9, 9, 15, 16, 17]);
        let lost = told(InjectedFault::Lost { probability: 1.0, seed: 0 });
        assert_eq!(lost[8..], [8, 9, -1, -1, -1, -1, -1, 15, 16, 17]);
        assert_eq!(told(InjectedFault::Disconnected)[9..16], [9, -3, -3, -3, -3, -3, 15]);
        assert_eq!(told(InjectedFault::SafetyStop(SafetyStop::Stall))[9..12], [9, -17, -17]);
        let mut device = faulty(InjectedFault::NotFinite);
        assert!(!device.read(Nanos(10 * MS)).unwrap().is_finite());
        assert!(device.read(Nanos(15 * MS)).unwrap().is_finite());
    }

    #[test]
    fn some_frames_are_lost_and_the_same_every_time() {
        let fault = InjectedFault::Lost { probability: 0.3, seed: 5 };
        let window = FaultWindow { fault, from: Nanos::ZERO, to: Nanos(u64::MAX) };
        let lost = || {
            let mut device = Faulty::new(faulty(InjectedFault::Frozen).device, vec![window]);
            (0..1000).map(|ms| device.read(Nanos(ms * MS)).is_err()).collect::<Vec<_>>()
        };
        let first = lost();
        let count = first.iter().filter(|lost| **lost).count();
        // Five standard deviations of a binomial count around 300.
        assert!((228..372).contains(&count), "{count}");
        assert_eq!(first, lost());
    }

    fn pushed(fault: InjectedFault) -> Faulty<Hand> {
        let path = ToolPath::constant([0.0; 3]).unwrap();
        let hand = Hand::new(path, PlantSpec::default(), HandSpec::default(), Capabilities::TOUCH).unwrap();
        let window = FaultWindow { fault, from: Nanos(2 * MS), to: Nanos(500 * MS) };
        let mut device = Faulty::new(hand, vec![window]);
        device.read(Nanos(MS)).unwrap();
        device.write(ForceCommand::until(Vec3::x(), Nanos(100 * MS))).unwrap();
        device
    }

    // Check that the force of a device that cannot be reached any more ends with its last command, and at once where the
    // device stops itself.
    #[test]
    fn a_force_ends_with_its_command_or_with_the_device() {
        let mut gone = pushed(InjectedFault::Disconnected);
        let mut force_at = |ms: u64| {
            assert_eq!(gone.read(Nanos(ms * MS)), Err(DeviceFault::Disconnected));
            let command = ForceCommand::until(Vec3::x(), Nanos((ms + 100) * MS));
            assert_eq!(gone.write(command), Err(DeviceFault::Disconnected));
            gone.exerted().unwrap().x
        };
        assert_eq!([2, 50, 99, 100, 101].map(&mut force_at), [1.0, 1.0, 1.0, 0.0, 0.0]);
        let mut stopped = pushed(InjectedFault::SafetyStop(SafetyStop::EmergencyBrake));
        let fault = DeviceFault::SafetyStop(SafetyStop::EmergencyBrake);
        assert_eq!(stopped.read(Nanos(2 * MS)), Err(fault));
        assert_eq!(stopped.write(ForceCommand::until(Vec3::x(), Nanos(u64::MAX))), Err(fault));
        assert_eq!(stopped.read(Nanos(3 * MS)), Err(fault));
        assert_eq!(stopped.exerted(), Some(Vec3::zeros()));
    }
}
