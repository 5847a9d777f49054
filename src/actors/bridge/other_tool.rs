//! A tool whose device is at another haptic machine, as this one knows it.

use crate::devices::{ElsewhereHandle, FASTEST_M_S};
use crate::model::Pose;
use crate::model::local::ToolHistory;
use crate::runtime::Rate;

/// Nobody looks farther ahead than this (s): a tool of which nothing has come for longer rests.
const LOOKS_AHEAD_S: f64 = 0.05;
/// More samples than this that are missing are no way that it went: it was put there, or came back from a rest.
const MOST_MISSING: u64 = 64;

/// Follows the samples of a tool that come late, and shows where it is by now.
#[derive(Debug)]
pub(super) struct OtherTool {
    handle: ElsewhereHandle,
    history: ToolHistory,
    /// The newest sample.
    newest: Option<(u64, Pose)>,
    period_s: f64,
}

impl OtherTool {
    /// Of a tool that is moved by `handle` and sampled at that rate.
    pub(super) fn new(handle: ElsewhereHandle, haptic: Rate) -> Self {
        let period_s = haptic.period_s();
        let history = ToolHistory::new(Pose::default(), period_s, period_s);
        Self { handle, history, newest: None, period_s }
    }

    /// What comes is of another connection: nothing is known of how it went on from the one before.
    pub(super) fn begin_anew(&mut self) {
        self.newest = None;
    }

    /// True if no sample has come.
    pub(super) fn is_new(&self) -> bool {
        self.newest.is_none()
    }

    /// Puts it at `pose` before any sample has come.
    pub(super) fn put(&mut self, pose: Pose) {
        self.handle.put(pose);
    }

    /// Takes its samples, oldest first: most of them came before.
    pub(super) fn hear(&mut self, ticks: &[(u64, Pose)]) {
        for &(tick, pose) in ticks {
            match self.newest {
                Some((newest, _)) if tick <= newest => continue,
                Some((newest, before)) if self.went(tick - newest, &before, &pose) => {
                    let passed = tick - newest;
                    (1..=passed).for_each(|n| self.history.push(before.towards(&pose, n as f64 / passed as f64)));
                }
                _ => self.history.restart(pose),
            }
            self.newest = Some((tick, pose));
        }
    }

    /// True if it can have gone from one place to another in so many ticks, and was not put there.
    fn went(&self, ticks: u64, before: &Pose, pose: &Pose) -> bool {
        let way = (pose.position - before.position).norm();
        ticks <= MOST_MISSING && way <= FASTEST_M_S * ticks as f64 * self.period_s
    }

    /// Shows it where it is expected at `tick`.
    pub(super) fn show(&mut self, tick: u64) {
        if let Some((newest, pose)) = self.newest {
            let late_s = tick.saturating_sub(newest) as f64 * self.period_s;
            let position = self.history.forecast().at(late_s.min(LOOKS_AHEAD_S));
            self.handle.put(Pose { position, ..pose });
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::devices::{Capabilities, Device, Elsewhere};
    use crate::model::Vec3;
    use crate::runtime::Nanos;

    fn at(tick: u64) -> Pose {
        Pose::at(Vec3::new(0.05 * (tick as f64 * 4e-3).sin(), 0.0, 0.0))
    }

    #[test]
    fn it_is_shown_where_it_is_by_now_and_rests_when_nothing_comes() {
        let (mut device, handle) = Elsewhere::new(Capabilities::TOUCH, Pose::default());
        let mut tool = OtherTool::new(handle, Rate::hz(1000));
        let mut place = || device.read(Nanos::ZERO).unwrap().position;
        tool.put(at(9));
        assert_eq!(place(), at(9).position);
        // Samples that are 20 ms late; of every ten messages one comes.
        for tick in (0..2_000).step_by(10) {
            let ticks: Vec<_> = (tick..tick + 8).map(|tick| (tick, at(tick))).collect();
            tool.hear(&ticks);
            tool.show(tick + 27);
            let [off, late] = [tick + 27, tick + 7].map(|then| (place() - at(then).position).norm());
            assert!(tick < 30 || off < 0.35 * late + 1e-4, "{off} m off at {tick}, {late} if it rested");
        }
        tool.show(2_100);
        let rests = place();
        tool.show(9_000);
        assert_eq!(place(), rests);
        // Old samples change nothing, and one after a long time is where it is.
        tool.hear(&[(5, at(500))]);
        tool.show(9_000);
        assert_eq!(place(), rests);
        // So is one that another machine's tool has taken the place of.
        let other = Pose::at(Vec3::new(0.1, 0.2, 0.3));
        for (tick, pose) in [(9_000, at(9_000)), (9_003, other)] {
            tool.hear(&[(tick, pose)]);
            tool.show(tick + 4);
            assert_eq!(place(), pose.position);
        }
    }
}
