//! Which device sample became part of which force.
//!
//! A global release takes tool samples and builds a local model from them; a haptic release swaps that model in, and its
//! force is the first that knows of the samples. The records that say so lie some milliseconds apart in a log, so a few
//! recent releases are enough to find them.

use std::collections::{BTreeMap, VecDeque};

use palpate::log::{ForceSample, GlobalTick};
use palpate::runtime::Nanos;
use palpate::runtime::TickTiming;

use super::events::Track;

/// Haptic releases that are remembered: sixteen seconds at 1 kHz.
const RELEASES_KEPT: usize = 1 << 14;
/// Global releases, models and unfinished flows that are remembered.
const MODELS_KEPT: usize = 1 << 8;

/// A release and where it was drawn.
#[derive(Clone, Copy, Debug)]
pub(super) struct Placed {
    pub(super) track: Track,
    pub(super) timing: TickTiming,
}

/// The way from a sample to a force. The times lie within their releases and never go back.
#[derive(Clone, Copy, Debug)]
pub(super) struct Flow {
    /// Each flow has its own.
    pub(super) id: u64,
    /// The last sample that the global release took: its haptic tick.
    pub(super) sample_tick: u64,
    /// The local model that was built.
    pub(super) version: u32,
    /// Whose force it is.
    pub(super) device: u16,
    /// Haptic release that read the sample, global release that took it, haptic release whose force knows it: track and
    /// time of each.
    pub(super) stations: [(Track, Nanos); 3],
}

/// Finds flows in records that are in the order of time, as far as a log keeps it.
#[derive(Debug, Default)]
pub(super) struct Flows {
    haptic: VecDeque<Placed>,
    global: VecDeque<Placed>,
    /// What each version was built from.
    built: BTreeMap<u32, GlobalTick>,
    /// The newest version that served each device.
    serving: BTreeMap<u16, u32>,
    /// First forces of a version, whose other records have not been read yet.
    waiting: VecDeque<ForceSample>,
    next_id: u64,
}

impl Flows {
    pub(super) fn push_haptic(&mut self, release: Placed) {
        keep(&mut self.haptic, release, RELEASES_KEPT);
    }

    pub(super) fn push_global(&mut self, release: Placed) {
        keep(&mut self.global, release, MODELS_KEPT);
    }

    pub(super) fn push_model(&mut self, built: &GlobalTick) {
        self.built.insert(built.version, *built);
        if self.built.len() > MODELS_KEPT {
            self.built.pop_first();
        }
    }

    pub(super) fn push_force(&mut self, force: &ForceSample) {
        let before = self.serving.insert(force.device, force.model_version);
        // The first force of a window may be of a model that served before.
        if before.is_some_and(|before| before != force.model_version) {
            keep(&mut self.waiting, *force, MODELS_KEPT);
        }
    }

    /// The flows whose records have all been read by now.
    pub(super) fn take_complete(&mut self) -> Vec<Flow> {
        let mut complete = Vec::new();
        let mut waiting = std::mem::take(&mut self.waiting);
        waiting.retain(|force| {
            let found = self.stations(force);
            complete.extend(found.map(|(sample_tick, stations)| {
                self.next_id += 1;
                let (version, device) = (force.model_version, force.device);
                Flow { id: self.next_id, sample_tick, version, device, stations }
            }));
            found.is_none()
        });
        self.waiting = waiting;
        complete
    }

    fn stations(&self, force: &ForceSample) -> Option<(u64, [(Track, Nanos); 3])> {
        let built = self.built.get(&force.model_version)?;
        // A release after skipped ones computes what they would have: the first that was due then or later.
        let read = first(&self.haptic, |timing| timing.tick, built.last_tick)?;
        let taken = first(&self.global, |timing| timing.scheduled, built.time)?;
        if taken.timing.scheduled != built.time {
            return None;
        }
        // A local model that has fallen behind computes the force of an earlier release: the first that can know the model.
        let served = first(&self.haptic, |timing| timing.scheduled, force.time)?;
        let served = match served.timing.end < taken.timing.start {
            true => first(&self.haptic, |timing| timing.end, taken.timing.start)?,
            false => served,
        };
        // On two cores a release may begin before the sample that it takes a little later is read.
        let mut time = Nanos::ZERO;
        let stations = [read, taken, served].map(|release| {
            time = time.max(release.timing.start).min(release.timing.end);
            (release.track, time)
        });
        stations.is_sorted_by_key(|(_, time)| *time).then_some((built.last_tick, stations))
    }
}

/// The first release with this key or a larger one, if none between is forgotten.
fn first<K: Ord>(releases: &VecDeque<Placed>, key: impl Fn(&TickTiming) -> K, wanted: K) -> Option<&Placed> {
    let place = releases.partition_point(|release| key(&release.timing) < wanted);
    releases.get(place).filter(|release| place > 0 || key(&release.timing) == wanted)
}

fn keep<T>(queue: &mut VecDeque<T>, item: T, most: usize) {
    if queue.len() == most {
        queue.pop_front();
    }
    queue.push_back(item);
}

#[cfg(test)]
mod tests {
    use super::super::events::Events;
    use super::super::tracks::Tracks;
    use super::*;

    fn release(track: Track, tick: u64, period_ms: u64, took_us: u64) -> Placed {
        let [scheduled, start] = [Nanos(tick * period_ms * 1_000_000); 2];
        let end = start + Nanos(took_us * 1000);
        Placed { track, timing: TickTiming { tick, scheduled, start, end, ..TickTiming::default() } }
    }

    // Check that a force which was due before its model was built, in a local model that has fallen behind, is drawn where the
    // model could be known.
    #[test]
    fn a_force_of_a_local_model_that_is_behind_comes_after_its_model() {
        let mut tracks = Tracks::default();
        let mut events = Events::new(Vec::new()).unwrap();
        let [haptic, global] =
            [0, 1].map(|group| tracks.place(group, "group", (Nanos::ZERO, Nanos::ZERO), &mut events).unwrap());
        let mut flows = Flows::default();
        (0..100).for_each(|tick| flows.push_haptic(release(haptic, tick, 1, 200)));
        flows.push_global(release(global, 1, 40, 20_000));
        flows.push_model(&GlobalTick { time: Nanos(40_000_000), version: 2, first_tick: 1, last_tick: 30 });
        for (time, model_version) in [(34, 1), (35, 2)] {
            flows.push_force(&ForceSample { time: Nanos(time * 1_000_000), model_version, ..ForceSample::default() });
        }
        let complete = flows.take_complete();
        let [Flow { sample_tick: 30, version: 2, stations, .. }] = complete[..] else { panic!("{complete:?}") };
        assert_eq!(stations.map(|(_, time)| time.0 / 1_000_000), [30, 40, 40]);
    }
}
