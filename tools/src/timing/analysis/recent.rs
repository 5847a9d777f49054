//! What happened lately: so that a moment can be looked at from both sides once it turns out to matter.

use std::collections::VecDeque;

use palpate::log::{CommandSample, ForceSample};
use palpate::runtime::Nanos;
use palpate::runtime::{ActorTimes, TickTiming};

/// How far back it remembers. A slow group's release begins long before it ends, and a moment is looked at later still.
const SPAN: Nanos = Nanos(1_000_000_000);
/// What it remembers at least: what was last before a stall of the whole machine is older.
const LEAST: usize = 64;
/// And at most, whatever times a log has: a second of a group at 16 kHz.
const MOST: usize = 1 << 14;
/// A command is in the log close to its force, before it or behind it.
const CLOSE: usize = 64;

/// The force of one haptic tick.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct ForcePoint {
    /// End of the tick.
    pub time: Nanos,
    /// Whose: the number of the device.
    pub device: u16,
    /// Before the safety pipeline (N).
    pub force_n: [f64; 3],
    /// After it, if the log says (N).
    pub commanded_n: Option<[f64; 3]>,
    /// Age of the local model's last resync (s).
    pub model_age_s: f64,
}

/// All groups and forces in a short span of time.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Moment {
    /// Time at which the moment begins.
    pub from: Nanos,
    /// Time at which the moment ends.
    pub to: Nanos,
    /// Releases that were due or at work in it, in the order of their groups and times.
    pub ticks: Vec<TickTiming>,
    /// Times that actors took of the ticks, if the log has them.
    pub actors: Vec<ActorTimes>,
    /// Forces.
    pub forces: Vec<ForcePoint>,
}

/// The last second of a log.
#[derive(Clone, Debug, Default)]
pub(super) struct Recent {
    ticks: VecDeque<TickTiming>,
    actors: VecDeque<ActorTimes>,
    forces: VecDeque<ForcePoint>,
    /// The last ones whose force has not come yet.
    commands: VecDeque<CommandSample>,
}

impl Recent {
    pub(super) fn push_tick(&mut self, timing: &TickTiming) {
        let too_old = |tick: &TickTiming| tick.end.max(tick.scheduled) + SPAN < timing.scheduled;
        forget(&mut self.ticks, too_old);
        self.ticks.push_back(*timing);
    }

    pub(super) fn push_actors(&mut self, times: &ActorTimes) {
        let end = |old: &ActorTimes| old.spent().iter().fold(old.scheduled, |end, spent| end + *spent);
        forget(&mut self.actors, |old| end(old) + SPAN < times.scheduled);
        self.actors.push_back(*times);
    }

    pub(super) fn push_force(&mut self, sample: &ForceSample) {
        forget(&mut self.forces, |old| old.time + SPAN < sample.time);
        let &ForceSample { time, device, force_n, model_age_s, .. } = sample;
        let same = |command: &CommandSample| (command.time, command.device) == (time, device);
        let place = self.commands.iter().position(same);
        let commanded_n = place.and_then(|place| self.commands.remove(place)).map(|command| command.force_n);
        self.forces.push_back(ForcePoint { time, device, force_n, commanded_n, model_age_s });
    }

    pub(super) fn push_command(&mut self, sample: &CommandSample) {
        let latest = self.forces.iter_mut().rev().take(CLOSE);
        let same = |point: &&mut ForcePoint| (point.time, point.device) == (sample.time, sample.device);
        if let Some(point) = latest.into_iter().find(same) {
            point.commanded_n = Some(sample.force_n);
        } else {
            if self.commands.len() >= CLOSE {
                self.commands.pop_front();
            }
            self.commands.push_back(*sample);
        }
    }

    /// All that is remembered between two times.
    pub(super) fn between(&self, from: Nanos, to: Nanos) -> Moment {
        let inside = |time: Nanos| (from..=to).contains(&time);
        let touches = |tick: &&TickTiming| tick.scheduled <= to && tick.end.max(tick.scheduled) >= from;
        let mut ticks: Vec<TickTiming> = self.ticks.iter().filter(touches).copied().collect();
        ticks.sort_by_key(|tick| (tick.group, tick.tick));
        let actors = self.actors.iter().filter(|times| ticks.iter().any(|tick| is_of(times, tick))).copied().collect();
        let forces = self.forces.iter().filter(|point| inside(point.time)).copied().collect();
        Moment { from, to, ticks, actors, forces }
    }
}

/// True if `times` are those of the actors in the release `tick`.
pub(super) fn is_of(times: &ActorTimes, tick: &TickTiming) -> bool {
    (times.group, times.scheduled) == (tick.group, tick.scheduled)
}

/// Drops what is too old from the front, and what is too much.
fn forget<T>(queue: &mut VecDeque<T>, too_old: impl Fn(&T) -> bool) {
    while queue.len() > LEAST && (queue.len() > MOST || queue.front().is_some_and(&too_old)) {
        queue.pop_front();
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    // Check that what was last before a stall is still there after it, and that a clock that stands still fills no memory.
    #[test]
    fn a_stall_is_remembered_from_both_sides_and_memory_is_bounded() {
        let mut recent = Recent::default();
        let force = |ms: u64| ForceSample { time: Nanos(ms * 1_000_000), ..ForceSample::default() };
        (0..2000).chain(9000..9003).for_each(|ms| recent.push_force(&force(ms)));
        let around = recent.between(Nanos(1_998_000_000), Nanos(9_001_000_000));
        let times: Vec<u64> = around.forces.iter().map(|point| point.time.0 / 1_000_000).collect();
        assert_eq!(times, [1998, 1999, 9000, 9001]);
        (0..100_000).for_each(|_| recent.push_tick(&TickTiming::default()));
        assert!(recent.ticks.len() <= MOST + 1, "{}", recent.ticks.len());
    }

    #[test]
    fn a_force_finds_its_command_on_either_side() {
        let mut recent = Recent::default();
        let force = |ms: u64| ForceSample { time: Nanos(ms), ..ForceSample::default() };
        let command =
            |ms: u64| CommandSample { time: Nanos(ms), force_n: [ms as f64, 0.0, 0.0], ..CommandSample::default() };
        recent.push_command(&command(1));
        recent.push_force(&force(1));
        recent.push_force(&force(2));
        recent.push_command(&command(2));
        recent.push_force(&force(3));
        let commanded: Vec<_> =
            recent.between(Nanos(0), Nanos(9)).forces.iter().map(|point| point.commanded_n).collect();
        assert_eq!(commanded, [Some([1.0, 0.0, 0.0]), Some([2.0, 0.0, 0.0]), None]);
    }
}
