//! One device over the time of a run: force, model age and resyncs.

use palpate::log::{CommandSample, ForceSample, Resync, magnitude};
use palpate::runtime::Nanos;

use super::over_time::{Absorb, OverTime};

const BINS: usize = 600;
const LEAST_BIN: Nanos = Nanos(1_000_000);

/// The force in one bin of time.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct ForceBin {
    /// Haptic ticks.
    pub ticks: u64,
    /// Least and largest magnitude before the safety pipeline (N).
    pub force_n: [f64; 2],
    /// The largest magnitude after it (N).
    pub commanded_n: f64,
    /// The largest age of the serving model (s).
    pub model_age_s: f64,
}

impl Absorb for ForceBin {
    fn absorb(&mut self, later: Self) {
        if self.ticks == 0 {
            self.force_n = later.force_n;
        } else if later.ticks > 0 {
            self.force_n = [self.force_n[0].min(later.force_n[0]), self.force_n[1].max(later.force_n[1])];
        }
        self.ticks += later.ticks;
        self.commanded_n = self.commanded_n.max(later.commanded_n);
        self.model_age_s = self.model_age_s.max(later.model_age_s);
    }
}

/// The resyncs in one bin of time.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct ResyncBin {
    /// How many.
    pub count: u64,
    /// The largest jump before blending (N).
    pub jump_before_n: f64,
    /// The largest step that blending leaves (N).
    pub jump_after_n: f64,
    /// The largest age of a new model's state on arrival (ns).
    pub age_ns: u64,
}

impl Absorb for ResyncBin {
    fn absorb(&mut self, later: Self) {
        self.count += later.count;
        self.jump_before_n = self.jump_before_n.max(later.jump_before_n);
        self.jump_after_n = self.jump_after_n.max(later.jump_after_n);
        self.age_ns = self.age_ns.max(later.age_ns);
    }
}

/// One device over the time of the run; the sums are in [`DeviceReport`](palpate::log::DeviceReport).
#[derive(Clone, Debug, PartialEq)]
pub struct DeviceTiming {
    /// Its name; empty for the only one.
    pub name: String,
    /// Force and model age.
    pub force: OverTime<ForceBin>,
    /// Resyncs.
    pub resyncs: OverTime<ResyncBin>,
}

impl Default for DeviceTiming {
    fn default() -> Self {
        let (force, resyncs) = (OverTime::new(BINS, LEAST_BIN), OverTime::new(BINS, LEAST_BIN));
        Self { name: String::new(), force, resyncs }
    }
}

impl DeviceTiming {
    pub(super) fn push_force(&mut self, sample: &ForceSample) {
        let force = finite_magnitude(sample.force_n);
        self.force.at(sample.time).absorb(ForceBin {
            ticks: 1,
            force_n: [force; 2],
            commanded_n: 0.0,
            model_age_s: sample.model_age_s,
        });
    }

    pub(super) fn push_command(&mut self, sample: &CommandSample) {
        let bin = self.force.at(sample.time);
        bin.commanded_n = bin.commanded_n.max(finite_magnitude(sample.force_n));
    }

    pub(super) fn push_resync(&mut self, resync: &Resync) {
        self.resyncs.at(resync.time).absorb(ResyncBin {
            count: 1,
            jump_before_n: resync.jump_before_n.abs(),
            jump_after_n: resync.jump_after_n.abs(),
            age_ns: resync.age.0,
        });
    }
}

/// Of a force (N); zero for one that is not finite, which the report counts by itself.
fn finite_magnitude(force_n: [f64; 3]) -> f64 {
    let magnitude = magnitude(force_n);
    if magnitude.is_finite() { magnitude } else { 0.0 }
}
