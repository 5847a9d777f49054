//! A tool that moves as it was logged and ignores the force.

use super::device::take_nothing;
use super::{Capabilities, Device, DeviceFault, DeviceState, ForceCommand};
use crate::model::Pose;
use crate::runtime::Nanos;

/// A state that was read from a device once, with the number of the read.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ReplayedSample {
    /// Scheduled time of the release that read it.
    pub time: Nanos,
    /// Counts the successful reads; unchanged if this one failed and the state before was used again.
    pub id: u32,
    /// The state that was read.
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
    capabilities: Capabilities,
    is_exact: bool,
}

impl Replayed {
    /// The device that gave `first` before the start and then `samples`, in the order of time: for the very releases of
    /// the run that they are of.
    pub fn new(first: DeviceState, samples: Vec<ReplayedSample>, capabilities: Capabilities) -> Self {
        Self { first: Some(first), samples, next: 0, last_id: 0, capabilities, is_exact: true }
    }

    /// Answers other releases too: between two samples the tool moves in a straight line and turns the shorter way, after the last it stays.
    #[must_use]
    pub fn at_any_rate(self) -> Self {
        Self { is_exact: false, ..self }
    }

    /// The last sample at or before `time`, and the one behind it.
    fn around(&mut self, time: Nanos) -> (Option<ReplayedSample>, Option<ReplayedSample>) {
        let passed = self.samples[self.next..].iter().take_while(|sample| sample.time < time).count();
        self.next += passed;
        let at = self.samples.get(self.next).copied();
        match at.filter(|sample| sample.time == time) {
            Some(exact) => (Some(exact), None),
            None => (self.next.checked_sub(1).map(|before| self.samples[before]), at),
        }
    }
}

impl Device for Replayed {
    fn name(&self) -> &str {
        "replayed"
    }

    fn capabilities(&self) -> Capabilities {
        self.capabilities
    }

    fn exerts_force(&self) -> bool {
        // A run that is executed again has the force of the device that it is of; a new one moves nothing.
        self.is_exact
    }

    /// The logged state of the release at exactly this time.
    ///
    /// # Errors
    /// [`DeviceFault::Stale`] where the logged read had failed, [`DeviceFault::Disconnected`] where none was logged and
    /// only the very releases of the log are asked for.
    fn read(&mut self, time: Nanos) -> Result<DeviceState, DeviceFault> {
        if let Some(first) = self.first.take() {
            return Ok(first);
        }
        let (sample, next) = match self.around(time) {
            (Some(sample), next) => (sample, next),
            (None, Some(next)) if !self.is_exact => (next, None),
            (None, _) => return Err(DeviceFault::Disconnected),
        };
        if sample.time == time {
            if sample.id == self.last_id {
                return Err(DeviceFault::Stale);
            }
            self.last_id = sample.id;
            return Ok(sample.state);
        }
        if self.is_exact {
            return Err(DeviceFault::Disconnected);
        }
        self.last_id = sample.id;
        Ok(next.map_or(sample.state, |next| between(&sample, &next, time)))
    }

    fn write(&mut self, command: ForceCommand) -> Result<(), DeviceFault> {
        take_nothing(command)
    }
}

fn between(from: &ReplayedSample, to: &ReplayedSample, time: Nanos) -> DeviceState {
    let seconds = |time: Nanos| time.saturating_sub(from.time).as_secs_f64();
    let share = seconds(time) / seconds(to.time);
    let Pose { position, orientation } = from.state.pose().towards(&to.state.pose(), share);
    DeviceState {
        position,
        orientation,
        velocity: from.state.velocity + (to.state.velocity - from.state.velocity) * share,
        buttons: from.state.buttons,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::model::{Turn, Vec3};

    const LIMITS: Capabilities = Capabilities::TOUCH;

    fn state(x: f64) -> DeviceState {
        DeviceState { position: Vec3::new(x, 0.0, 0.0), ..DeviceState::default() }
    }

    // Check that a read that failed then fails now, a time without a read fails too, and skipped releases are passed.
    #[test]
    fn it_gives_what_was_logged_at_each_time_and_fails_where_the_device_failed() {
        let sample = |ms: u64, id| ReplayedSample { time: Nanos(ms), id, state: state(f64::from(id)) };
        let mut device =
            Replayed::new(state(9.0), vec![sample(0, 1), sample(1, 1), sample(2, 2), sample(7, 3)], LIMITS);
        let reads = [0, 0, 1, 3, 7].map(|time| device.read(Nanos(time)));
        let expected =
            [Ok(state(9.0)), Ok(state(1.0)), Err(DeviceFault::Stale), Err(DeviceFault::Disconnected), Ok(state(3.0))];
        assert_eq!(reads, expected);
        assert_eq!(device.capabilities(), LIMITS);
    }

    // Check that a run with other releases finds the tool on its way, and that failed reads stay failed.
    #[test]
    fn at_another_rate_the_tool_is_between_two_samples_and_stays_after_the_last() {
        let sample = |ms: u64, id| ReplayedSample { time: Nanos(ms), id, state: state(ms as f64) };
        let samples = vec![sample(0, 1), sample(4, 2), sample(8, 2), sample(10, 3)];
        let mut device = Replayed::new(state(9.0), samples, LIMITS).at_any_rate();
        let reads = [0, 0, 1, 4, 6, 8, 10, 11, 99].map(|time| device.read(Nanos(time)).map(|state| state.position.x));
        let expected =
            [Ok(9.0), Ok(0.0), Ok(1.0), Ok(4.0), Ok(6.0), Err(DeviceFault::Stale), Ok(10.0), Ok(10.0), Ok(10.0)];
        assert_eq!(reads, expected);
    }

    // Check that orientations are those of the log at its times, and half a turn between them otherwise.
    #[test]
    fn it_is_turned_as_it_was_logged() {
        let turn = |angle: f64| Turn::from_axis_angle(&Vec3::y_axis(), angle);
        let sample = |ms: u64, id, angle| ReplayedSample {
            time: Nanos(ms),
            id,
            state: DeviceState { orientation: turn(angle), ..state(0.0) },
        };
        let samples = vec![sample(0, 1, 0.3), sample(4, 2, 0.7)];
        let mut device = Replayed::new(state(9.0), samples.clone(), LIMITS);
        let reads = [0, 0, 4].map(|time| device.read(Nanos(time)).unwrap().orientation);
        assert_eq!(reads, [Turn::identity(), turn(0.3), turn(0.7)]);
        let mut device = Replayed::new(state(9.0), samples, LIMITS).at_any_rate();
        let reads = [0, 0, 2].map(|time| device.read(Nanos(time)).unwrap().orientation);
        assert!(reads[2].angle_to(&turn(0.5)) < 1e-7, "{reads:?}");
    }
}
