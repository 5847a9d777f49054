//! Where the tool is expected to go, from where it was: a prediction runs along it.

use super::Vec3;
use super::contact::ToolMotion;

/// The motion dies away in about this time (s): a hand does not go on as it went for longer.
const DECAY: f64 = 15e-3;
/// The velocity is the mean over this time (s).
const SPAN: f64 = 3e-3;

/// A tool that runs on with its present velocity and comes to rest: q + v tau (1 - exp(-t / tau)).
///
/// # Real-time
/// A plain value: its methods are wait-free and real-time safe.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct ToolForecast {
    /// Present position (m).
    pub position: Vec3,
    /// Present velocity (m/s).
    pub velocity: Vec3,
}

impl ToolForecast {
    /// The position expected `t` seconds from now.
    pub fn at(&self, t: f64) -> Vec3 {
        self.position + self.velocity * (DECAY * -(-t / DECAY).exp_m1())
    }

    /// The position `t` seconds from now if it kept its velocity: what a window has to be ready for.
    pub fn unbraked(&self, t: f64) -> Vec3 {
        self.position + self.velocity * t
    }

    /// The motion expected in the n-th tick of `tick` seconds from now.
    pub fn motion(&self, n: u32, tick: f64) -> ToolMotion {
        let t = f64::from(n) * tick;
        ToolMotion { from: self.at(t), to: self.at(t + tick) }
    }
}

/// The last positions of the tool, for its mean velocity.
#[derive(Clone, Debug)]
pub struct ToolHistory {
    /// Newest first.
    positions: Vec<Vec3>,
    /// Ticks that are known, at most the length of `positions` less one.
    known: usize,
    tick: f64,
}

impl ToolHistory {
    /// A tool that has rested at `position` (m); positions will come every `tick` seconds.
    ///
    /// # Real-time
    /// Not real-time safe: allocates.
    pub fn new(position: Vec3, tick: f64) -> Self {
        let ticks = (SPAN / tick).round().max(1.0) as usize;
        Self { positions: vec![position; ticks + 1], known: 0, tick }
    }

    /// The tool's position one tick later (m).
    ///
    /// # Real-time
    /// Bounded, real-time safe.
    pub fn push(&mut self, position: Vec3) {
        self.positions.rotate_right(1);
        self.positions[0] = position;
        self.known = (self.known + 1).min(self.positions.len() - 1);
    }

    /// What is expected of it.
    ///
    /// # Real-time
    /// Wait-free, real-time safe.
    pub fn forecast(&self) -> ToolForecast {
        let position = self.positions[0];
        let velocity = match self.known {
            0 => Vec3::zeros(),
            ticks => (position - self.positions[ticks]) / (ticks as f64 * self.tick),
        };
        ToolForecast { position, velocity }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_velocity_is_the_mean_of_what_is_known_and_the_motion_dies_away() {
        let mut history = ToolHistory::new(Vec3::zeros(), 1e-3);
        assert_eq!(history.forecast().velocity, Vec3::zeros());
        history.push(Vec3::x() * 1e-3);
        assert!((history.forecast().velocity.x - 1.0).abs() < 1e-12, "one tick is known");
        (2..10).for_each(|n| history.push(Vec3::x() * 2e-3 * f64::from(n)));
        let forecast = history.forecast();
        assert!((forecast.velocity.x - 2.0).abs() < 1e-12);
        assert_eq!(forecast.at(0.0), forecast.position);
        let (first, far) = (forecast.motion(0, 1e-3), forecast.at(1.0));
        assert!((first.to.x - first.from.x - 2e-3).abs() < 1e-4);
        assert!((far.x - forecast.position.x - 2.0 * DECAY).abs() < 1e-12);
    }
}
