//! Where the tool is expected to go, from where it was: a prediction runs along it.

use std::collections::VecDeque;

use crate::contact::ToolMotion;
use crate::{Pose, Turn, Vec3};

/// The velocity dies away in about this time (s): a hand does not go on as it went for longer.
const DECAY: f64 = 60e-3;
/// A fast motion ends sooner: with its present velocity alone the tool comes this far (m). At an impact a forecast that goes on into
/// the body for longer is worse than none, because what it gets wrong is only put right linearly.
const REACH: f64 = 10e-3;
/// What changes the velocity dies away in about this time (s).
const CHANGE_DECAY: f64 = 30e-3;
/// The velocity is the mean over this time (s).
const SPAN: f64 = 3e-3;
/// The acceleration is the mean over this time (s); shorter, the steps of an encoder would be all of it.
const CHANGE_SPAN: f64 = 16e-3;

/// Places on the way of a tool that a window is to hold, ahead and behind, besides the present one.
pub(super) const LOOKS: usize = 3;

/// A tool that runs on with its present velocity and acceleration and comes to rest:
/// q + v tau (1 - exp(-t / tau)) + a tau_a^2 (1 - (1 + t / tau_a) exp(-t / tau_a)).
///
/// # Real-time
/// A plain value: its methods are wait-free and real-time safe.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct ToolForecast {
    /// Present position (m).
    pub position: Vec3,
    /// Present velocity (m/s).
    pub velocity: Vec3,
    /// Present acceleration (m/s^2).
    pub acceleration: Vec3,
    /// Present orientation: a tool is expected to keep it.
    pub orientation: Turn,
    /// Ways back to where it was (m), evenly over the time for which a window is to hold it.
    pub back: [Vec3; LOOKS],
}

impl ToolForecast {
    /// The forecast for a tool that rests at `pose`.
    pub fn at_rest(pose: impl Into<Pose>) -> Self {
        let Pose { position, orientation } = pose.into();
        Self { position, orientation, ..Self::default() }
    }

    /// The forecast for a tool that stays where this one is now.
    pub(super) fn staying(&self) -> Self {
        Self::at_rest(self.pose(0.0))
    }

    /// The tool that is expected `t` seconds from now.
    pub(super) fn pose(&self, t: f64) -> Pose {
        Pose { position: self.at(t), orientation: self.orientation }
    }

    /// The position expected `t` seconds from now.
    pub fn at(&self, t: f64) -> Vec3 {
        let decay = DECAY.min(REACH / self.velocity.norm().max(f64::MIN_POSITIVE));
        let change = CHANGE_DECAY * CHANGE_DECAY * (1.0 - (1.0 + t / CHANGE_DECAY) * (-t / CHANGE_DECAY).exp());
        self.position + self.velocity * (decay * -(-t / decay).exp_m1()) + self.acceleration * change
    }

    /// The position `t` seconds from now if it kept its velocity: what a window has to be ready for.
    pub(crate) fn unbraked(&self, t: f64) -> Vec3 {
        self.position + self.velocity * t
    }

    /// Where a window has to be ready for the tool that is made in `after` seconds and serves for `lead`: there, on the way ahead,
    /// on the same way back, as a hand that turns round goes, and where it was.
    pub(super) fn ways(&self, after: f64, lead: f64) -> impl Iterator<Item = Vec3> + Clone {
        let then = self.unbraked(after);
        let way = self.velocity * (lead / LOOKS as f64);
        let along = move |sign: f64| (1..=LOOKS).map(move |look| way * (sign * look as f64));
        std::iter::once(Vec3::zeros()).chain(along(1.0)).chain(along(-1.0)).chain(self.back).map(move |way| then + way)
    }

    /// The motion expected in the n-th tick of `tick` seconds from now.
    pub fn motion(&self, n: u32, tick: f64) -> ToolMotion {
        let t = f64::from(n) * tick;
        ToolMotion { from: self.pose(t), to: self.pose(t + tick) }
    }
}

/// The last positions of the tool, for its mean velocity and acceleration, and for the way back.
#[derive(Clone, Debug)]
pub struct ToolHistory {
    /// Newest first.
    positions: VecDeque<Vec3>,
    orientation: Turn,
    /// Ticks that are known, at most those that velocity and acceleration need.
    known: usize,
    tick: f64,
    /// The ticks of the way back.
    lead: usize,
}

impl ToolHistory {
    /// A tool that has rested at `pose`; further ones will come every `tick` seconds. The way back is that of `lead` seconds.
    ///
    /// # Real-time
    /// Not real-time safe: allocates.
    pub fn new(pose: Pose, tick: f64, lead: f64) -> Self {
        let lead = ticks(lead, tick);
        let positions = VecDeque::from(vec![pose.position; lead.max(ticks(CHANGE_SPAN, tick)) + 1]);
        Self { positions, orientation: pose.orientation, known: 0, tick, lead }
    }

    /// True as long as nobody knows where the tool is going.
    ///
    /// # Real-time
    /// Wait-free, real-time safe.
    pub fn is_new(&self) -> bool {
        self.known == 0
    }

    /// Forgets the way so far: the tool has rested at `pose`.
    ///
    /// # Real-time
    /// Bounded, real-time safe.
    pub fn restart(&mut self, pose: Pose) {
        self.positions.iter_mut().for_each(|position| *position = pose.position);
        self.orientation = pose.orientation;
        self.known = 0;
    }

    /// Adds the tool one tick after the last.
    ///
    /// # Real-time
    /// Bounded, real-time safe.
    pub fn push(&mut self, Pose { position, orientation }: Pose) {
        self.orientation = orientation;
        self.positions.pop_back();
        self.positions.push_front(position);
        self.known = (self.known + 1).min(ticks(CHANGE_SPAN, self.tick));
    }

    /// The forecast from the positions that are known.
    ///
    /// # Real-time
    /// Wait-free, real-time safe.
    pub fn forecast(&self) -> ToolForecast {
        let now = self.positions[0];
        let back = std::array::from_fn(|look| self.positions[self.lead * (look + 1) / LOOKS] - now);
        let pose = Pose { position: now, orientation: self.orientation };
        let forecast = ToolForecast { back, ..ToolForecast::at_rest(pose) };
        let recent = self.known.min(ticks(SPAN, self.tick));
        if recent == 0 {
            return forecast;
        }
        // From the first and the last quarter of what is known.
        let quarter = (self.known / 4).max(1);
        let between = self.known - quarter;
        let acceleration = match between {
            0 => Vec3::zeros(),
            _ => (self.mean_velocity(0, quarter) - self.mean_velocity(between, quarter)) / (between as f64 * self.tick),
        };
        ToolForecast { velocity: self.mean_velocity(0, recent), acceleration, ..forecast }
    }

    /// Over `ticks` ticks that end `ago` ticks ago.
    fn mean_velocity(&self, ago: usize, ticks: usize) -> Vec3 {
        (self.positions[ago] - self.positions[ago + ticks]) / (ticks as f64 * self.tick)
    }
}

/// Whole ticks in `span` seconds, at least one.
fn ticks(span: f64, tick: f64) -> usize {
    (span / tick).round().max(1.0) as usize
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn velocity_and_acceleration_are_means_of_what_is_known_and_the_motion_dies_away() {
        let mut history = ToolHistory::new(Pose::default(), 1e-3, 30e-3);
        assert_eq!(history.forecast(), ToolForecast::at_rest(Vec3::zeros()));
        history.push((Vec3::x() * 1e-3).into());
        assert!((history.forecast().velocity.x - 1.0).abs() < 1e-12, "one tick is known");
        // x = t^2 with t in ms: 2000 m/s^2.
        let at = |n: i32| Vec3::x() * f64::from(n * n) * 1e-3;
        (2..40).for_each(|n| history.push(at(n).into()));
        let forecast = history.forecast();
        for (back, n) in forecast.back.iter().zip([29, 19, 9]) {
            assert!((back - (at(n) - at(39))).norm() < 1e-12, "{back:?}");
        }
        assert!((forecast.velocity.x - (2.0 * 39.0 - 3.0)).abs() < 1e-9);
        assert!((forecast.acceleration.x - 2000.0).abs() < 1e-6);
        assert_eq!(forecast.at(0.0), forecast.position);
        let first = forecast.motion(0, 1e-3);
        assert!((first.way().x - REACH).abs() < 2e-3, "{first:?}");
        // 75 m/s: the velocity takes it as far as a fast one may.
        let rest = REACH + forecast.acceleration.x * CHANGE_DECAY * CHANGE_DECAY;
        assert!((forecast.at(3.0).x - forecast.position.x - rest).abs() < 1e-9);
        let slow = ToolForecast { velocity: Vec3::x() * 0.1, ..ToolForecast::default() };
        assert!((slow.at(3.0).x - 0.1 * DECAY).abs() < 1e-9);
    }
}
