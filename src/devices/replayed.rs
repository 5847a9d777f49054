//! A tool that moves as it was logged and ignores the force.

use super::{Capabilities, Device, DeviceFault, DeviceState};
use crate::model::Vec3;
use crate::time::Nanos;

/// A state that was read from a device once, with the number of the read.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ReplayedSample {
    /// Scheduled time of the release that read it.
    pub time: Nanos,
    /// Counts the successful reads; unchanged if this one failed and the state before was used again.
    pub id: u32,
    /// What was read.
    pub state: DeviceState,
}

/// Gives the states of an earlier run, bit for bit, and fails where the device of that run failed.
///
/// # Real-time
/// Real-time safe; bounded by the number of samples between two reads.
#[derive(Clone, Debug)]
pub struct Replayed {
    /// The state before the start, until it has been read.
    first: Option<DeviceState>,
    samples: Vec<ReplayedSample>,
    next: usize,
    last_id: u32,
    max_force_n: f64,
}

impl Replayed {
    /// The device that gave `first` before the start and then `samples`, in the order of time.
    pub fn new(first: DeviceState, samples: Vec<ReplayedSample>, max_force_n: f64) -> Self {
        Self { first: Some(first), samples, next: 0, last_id: 0, max_force_n }
    }
}

impl Device for Replayed {
    fn name(&self) -> &str {
        "replayed"
    }

    fn capabilities(&self) -> Capabilities {
        Capabilities { max_force_n: self.max_force_n }
    }

    /// The logged state of the release at exactly this time.
    ///
    /// # Errors
    /// [`DeviceFault::Stale`] where the logged read had failed, [`DeviceFault::Disconnected`] where none was logged.
    fn read(&mut self, time: Nanos) -> Result<DeviceState, DeviceFault> {
        if let Some(first) = self.first.take() {
            return Ok(first);
        }
        let passed = self.samples[self.next..].iter().take_while(|sample| sample.time < time).count();
        self.next += passed;
        let sample = self.samples.get(self.next).filter(|sample| sample.time == time);
        let sample = sample.ok_or(DeviceFault::Disconnected)?;
        if sample.id == self.last_id {
            return Err(DeviceFault::Stale);
        }
        self.last_id = sample.id;
        Ok(sample.state)
    }

    fn write(&mut self, _: Vec3) -> Result<(), DeviceFault> {
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn state(x: f64) -> DeviceState {
        DeviceState { position: Vec3::new(x, 0.0, 0.0), ..DeviceState::default() }
    }

    // Check that a read that failed then fails now, a time without a read fails too, and skipped releases are passed.
    #[test]
    fn it_gives_what_was_logged_at_each_time_and_fails_where_the_device_failed() {
        let sample = |ms: u64, id| ReplayedSample { time: Nanos(ms), id, state: state(f64::from(id)) };
        let mut device = Replayed::new(state(9.0), vec![sample(0, 1), sample(1, 1), sample(2, 2), sample(7, 3)], 4.0);
        let reads = [0, 0, 1, 3, 7].map(|time| device.read(Nanos(time)));
        let expected =
            [Ok(state(9.0)), Ok(state(1.0)), Err(DeviceFault::Stale), Err(DeviceFault::Disconnected), Ok(state(3.0))];
        assert_eq!(reads, expected);
        assert_eq!(device.capabilities().max_force_n, 4.0);
    }
}
