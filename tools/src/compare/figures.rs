//! What local models cost and how far their forces are from `full`'s: plain data, and the error of one run against another.

use palpate::log::{LogRecord, Magnitudes, Resync, ServedBy, magnitude};
use palpate::runtime::Nanos;
use palpate::scene::LinkSpec;

/// The part of a run that a comparison needs: force and energy of every haptic tick, and the resyncs.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct ForceTrace {
    /// Force on the tool, tick by tick: mean over the tick, after blending, before safety (N).
    pub forces_n: Vec<[f64; 3]>,
    /// Energy that the tool has given to the simulation since the start, tick by tick (J).
    pub energy_j: Vec<f64>,
    /// The resyncs in the order in which they ended.
    pub resyncs: Vec<Resync>,
}

impl ForceTrace {
    /// The trace of the first device of a run, from its records.
    pub fn of(records: &[LogRecord]) -> Self {
        Self::of_device(records, 0)
    }

    /// The trace of one of several devices of a run, from its records.
    pub fn of_device(records: &[LogRecord], device: u16) -> Self {
        let mut trace = Self::default();
        for record in records.iter().filter(|record| record.device() == device) {
            match record {
                LogRecord::Force(sample) => {
                    trace.forces_n.push(sample.force_n);
                    trace.energy_j.push(sample.energy_j);
                }
                LogRecord::Resync(resync) => trace.resyncs.push(*resync),
                _ => {}
            }
        }
        trace
    }

    /// The largest force (N).
    pub fn peak_n(&self) -> f64 {
        self.forces_n.iter().map(|force| magnitude(*force)).fold(0.0, f64::max)
    }

    /// The largest energy by magnitude (J).
    pub fn largest_energy_j(&self) -> f64 {
        self.energy_j.iter().fold(0.0, |largest, energy| energy.abs().max(largest))
    }

    /// How far each tick's force is from that of `full`, in percent of the largest force of `full`.
    pub fn errors(&self, full: &Self) -> impl Iterator<Item = f64> {
        let scale = 100.0 / full.peak_n();
        self.differences_n(full).map(move |error| scale * error)
    }

    /// How far each tick's force is from that of `full` (N).
    pub fn differences_n(&self, full: &Self) -> impl Iterator<Item = f64> {
        self.forces_n.iter().zip(&full.forces_n).map(|(force, exact)| magnitude(minus(*force, *exact)))
    }
}

/// How far a run is from that of `full` on the same scene.
///
/// All but `energy` in percent of the largest force of `full`. Not a number where `full` has no force, or no energy.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct ForceDeviation {
    /// Root of the mean square of the force's error over all ticks.
    pub rms: f64,
    /// Its largest error in one tick.
    pub max: f64,
    /// The largest change of the model's own force from one tick to the next; `full` has one too.
    pub jump: f64,
    /// 99 % of the resyncs change the force by less before blending.
    pub resync_before_p99: f64,
    /// 99 % of the resyncs change the force in one tick by less after blending.
    pub resync_after_p99: f64,
    /// Energy at the end of the run against that of `full`, in percent of the largest energy of `full`.
    pub energy: f64,
}

impl ForceDeviation {
    /// Of each figure the larger one; the other where one is not there.
    fn worst(a: Self, b: Self) -> Self {
        Self {
            rms: a.rms.max(b.rms),
            max: a.max.max(b.max),
            jump: a.jump.max(b.jump),
            resync_before_p99: a.resync_before_p99.max(b.resync_before_p99),
            resync_after_p99: a.resync_after_p99.max(b.resync_after_p99),
            energy: a.energy.max(b.energy),
        }
    }

    /// The error of `run` against `full`; both have the same ticks.
    pub fn between(run: &ForceTrace, full: &ForceTrace) -> Self {
        let percent_of = |whole: f64| if whole > 0.0 { 100.0 / whole } else { f64::NAN };
        let scale = percent_of(full.peak_n());
        let ticks = run.forces_n.len().max(1) as f64;
        let squares: f64 = run.differences_n(full).map(|error| error * error).sum();
        let jump = run.forces_n.windows(2).map(|pair| magnitude(minus(pair[1], pair[0]))).fold(0.0, f64::max);
        let p99 = |jump: fn(&Resync) -> f64| {
            let mut jumps = Magnitudes::default();
            run.resyncs.iter().for_each(|resync| jumps.push(jump(resync)));
            jumps.percentiles().p99
        };
        let last = |trace: &ForceTrace| trace.energy_j.last().copied().unwrap_or_default();
        Self {
            rms: scale * (squares / ticks).sqrt(),
            max: scale * run.differences_n(full).fold(0.0, f64::max),
            jump: scale * jump,
            resync_before_p99: scale * p99(|resync| resync.jump_before_n),
            resync_after_p99: scale * p99(|resync| resync.jump_after_n),
            energy: percent_of(full.largest_energy_j()) * (last(run) - last(full)).abs(),
        }
    }
}

/// The cost of a run: CPU time of the thread, everything else on the machine left out.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct ModelCost {
    /// CPU time that half of the haptic ticks stay within.
    pub tick_p50: Nanos,
    /// CPU time that 99 % of the haptic ticks stay within.
    pub tick_p99: Nanos,
    /// CPU time of the longest haptic tick.
    pub tick_max: Nanos,
    /// CPU time of the haptic group per second of simulated time (s/s).
    pub haptic_load: f64,
    /// CPU time of the global group per second of simulated time (s/s); zero for `full`, which has none.
    pub global_load: f64,
    /// Number of local models that were built.
    pub builds: u64,
    /// CPU time that half of the builds of a resync's local models stay within.
    pub build_p50: Nanos,
    /// CPU time that 99 % of these stay within.
    pub build_p99: Nanos,
}

impl ModelCost {
    /// Of each cost of two runs that did the same the least.
    fn least(a: &Self, b: &Self) -> Self {
        Self {
            tick_p50: a.tick_p50.min(b.tick_p50),
            tick_p99: a.tick_p99.min(b.tick_p99),
            tick_max: a.tick_max.min(b.tick_max),
            haptic_load: a.haptic_load.min(b.haptic_load),
            global_load: a.global_load.min(b.global_load),
            builds: a.builds,
            build_p50: a.build_p50.min(b.build_p50),
            build_p99: a.build_p99.min(b.build_p99),
        }
    }

    /// CPU time of haptic and global group together per second of simulated time (s/s).
    pub fn total_load(&self) -> f64 {
        self.haptic_load + self.global_load
    }
}

/// One device in a run that came to its end.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct MeasuredDevice {
    /// Its name; empty for the only one.
    pub name: String,
    /// Distance of the forces on its tool from those of `full`, in percent of what `full` has on this tool.
    pub error: ForceDeviation,
    /// The models that made the force, its own or those that it fell back to, with the share of ticks that each did (0 to 1).
    pub served: Vec<(ServedBy, f64)>,
    /// Forces and energies of the run.
    pub trace: ForceTrace,
}

/// The measurement of a run that came to its end.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Measured {
    /// CPU time that the run took.
    pub cost: ModelCost,
    /// Haptic and global releases that reported a degraded result, such as a force that was not finite.
    pub degraded: u64,
    /// The devices in the order of the scene.
    pub devices: Vec<MeasuredDevice>,
    /// The error of the only device; of several, figure by figure, that of the one that is farthest off.
    pub error: ForceDeviation,
}

impl Measured {
    /// A run with these devices.
    pub(super) fn new(cost: ModelCost, degraded: u64, devices: Vec<MeasuredDevice>) -> Self {
        let error = devices.iter().map(|device| device.error).reduce(ForceDeviation::worst).unwrap_or_default();
        Self { cost, degraded, devices, error }
    }

    /// The devices, if there are several.
    pub(super) fn several(&self) -> &[MeasuredDevice] {
        if self.devices.len() > 1 { &self.devices } else { &[] }
    }

    /// The largest force on a tool (N).
    pub fn peak_n(&self) -> f64 {
        self.devices.iter().map(|device| device.trace.peak_n()).fold(0.0, f64::max)
    }

    /// The number of resyncs of all devices.
    pub fn resyncs(&self) -> usize {
        self.devices.iter().map(|device| device.trace.resyncs.len()).sum()
    }
}

/// How the run of one model went.
#[derive(Clone, Debug, PartialEq)]
pub enum RunOutcome {
    /// The run came to its end.
    Measured(Box<Measured>),
    /// The model cannot run on this scene: why.
    Refused(String),
    /// The run stopped before its end: the fault.
    Failed(String),
}

/// One model with one compute latency.
#[derive(Clone, Debug, PartialEq)]
pub struct ComparedRun {
    /// The model's name.
    pub model: String,
    /// How long after its release a result of the global model becomes visible.
    pub latency: Nanos,
    /// Whether the run came to its end, and its measurement.
    pub outcome: RunOutcome,
}

impl ComparedRun {
    /// The measurement, if the run came to its end.
    pub fn measured(&self) -> Option<&Measured> {
        match &self.outcome {
            RunOutcome::Measured(measured) => Some(measured),
            RunOutcome::Refused(_) | RunOutcome::Failed(_) => None,
        }
    }

    /// The reason for which nothing was measured.
    pub fn missing(&self) -> Option<&str> {
        match &self.outcome {
            RunOutcome::Measured(_) => None,
            RunOutcome::Refused(why) | RunOutcome::Failed(why) => Some(why),
        }
    }
}

/// Local models against `full` on one scene, in virtual time.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Comparison {
    /// Name of the scene, for titles.
    pub scene: String,
    /// Nodes of the body.
    pub nodes: usize,
    /// Time from one haptic tick to the next.
    pub haptic_period: Nanos,
    /// Time from one release of the global model to the next.
    pub global_period: Nanos,
    /// The link of the scene, over which the global model of every run but `full`'s works: results are late without a compute latency.
    pub link: Option<LinkSpec>,
    /// Simulated time of each run.
    pub duration: Nanos,
    /// Time that reading the clock adds to each tick and each build.
    pub clock: Nanos,
    /// True if the program was built without optimisation or with debug assertions: costs are then several times those
    /// of a release build.
    pub is_debug_build: bool,
    /// Version of palpate.
    pub palpate_version: String,
    /// Instructions that the force kernel used.
    pub instruction_set: String,
    /// The reference.
    pub full: Measured,
    /// The other models, each with its latencies.
    pub runs: Vec<ComparedRun>,
    /// `full` with smaller steps, and with smaller elements where a surface was filled: how far the reference itself is
    /// from what it stands for. Errors are distances from `full` as those of the models are.
    pub finer: Vec<ComparedRun>,
}

impl Comparison {
    /// The latencies that were compared, least first.
    pub fn latencies(&self) -> Vec<Nanos> {
        let mut latencies: Vec<Nanos> = self.runs.iter().map(|run| run.latency).collect();
        latencies.sort_unstable();
        latencies.dedup();
        latencies
    }

    /// Keeps of each cost the least of this comparison and of `again`, which is the same once more: forces are the same every time.
    pub fn keep_least(&mut self, again: &Self) {
        self.full.cost = ModelCost::least(&self.full.cost, &again.full.cost);
        for (run, other) in self.runs.iter_mut().zip(&again.runs) {
            if let (RunOutcome::Measured(run), Some(other)) = (&mut run.outcome, other.measured()) {
                run.cost = ModelCost::least(&run.cost, &other.cost);
            }
        }
    }

    /// The runs that stopped before their end, those of [`finer`](Self::finer) last: the model and the fault.
    pub fn faults(&self) -> impl Iterator<Item = (&str, &str)> {
        self.runs.iter().chain(&self.finer).filter_map(|run| match &run.outcome {
            RunOutcome::Failed(fault) => Some((&*run.model, &**fault)),
            RunOutcome::Measured(_) | RunOutcome::Refused(_) => None,
        })
    }
}

fn minus(a: [f64; 3], b: [f64; 3]) -> [f64; 3] {
    [a[0] - b[0], a[1] - b[1], a[2] - b[2]]
}

#[cfg(test)]
mod tests {
    use super::*;
    use palpate::log::ForceSample;

    fn trace(forces: &[f64], energy: &[f64]) -> ForceTrace {
        let forces_n = forces.iter().map(|&force| [0.0, 0.0, force]).collect();
        ForceTrace { forces_n, energy_j: energy.to_vec(), resyncs: Vec::new() }
    }

    #[test]
    fn a_run_against_itself_has_its_own_jumps_and_no_error() {
        let full = trace(&[0.0, 1.0, -4.0], &[0.0, 2.0, 1.0]);
        let error = ForceDeviation::between(&full, &full);
        assert_eq!(error, ForceDeviation { jump: 125.0, ..ForceDeviation::default() });
    }

    #[test]
    fn errors_are_in_percent_of_the_peak_and_of_the_largest_energy_of_full() {
        let full = trace(&[0.0, 0.0, 5.0, -10.0], &[0.0, -8.0, -4.0, -2.0]);
        let mut run = trace(&[0.0, 2.0, 5.0, -10.0], &[0.0, 0.0, 0.0, 2.0]);
        run.forces_n[1] = [1.2, 0.0, 1.6];
        let error = ForceDeviation::between(&run, &full);
        // One tick of four is wrong by 2 N of 10 N; the last change is 15 N.
        assert_eq!((error.rms, error.max, error.jump), (10.0, 20.0, 150.0));
        assert_eq!(error.energy, 50.0);
        assert_eq!((error.resync_before_p99, error.resync_after_p99), (0.0, 0.0));
    }

    #[test]
    fn the_jump_of_resyncs_is_that_of_the_hundredth_part() {
        let full = trace(&[10.0], &[1.0]);
        let mut run = full.clone();
        let resync = |n: u32| Resync { jump_before_n: n.into(), jump_after_n: 0.1 * f64::from(n), ..Resync::default() };
        run.resyncs = (1..=200).map(resync).collect();
        let error = ForceDeviation::between(&run, &full);
        assert!((error.resync_before_p99 - 1980.0).abs() < 1e-9 && (error.resync_after_p99 - 198.0).abs() < 1e-9);
    }

    #[test]
    fn without_a_force_of_full_there_is_no_percentage() {
        let error = ForceDeviation::between(&trace(&[1.0], &[1.0]), &trace(&[0.0], &[0.0]));
        assert!(error.rms.is_nan() && error.max.is_nan() && error.jump.is_nan() && error.energy.is_nan());
    }

    #[test]
    fn of_several_devices_the_worst_counts_figure_by_figure_and_one_without_a_force_does_not() {
        let device = |rms, max| MeasuredDevice {
            error: ForceDeviation { rms, max, ..ForceDeviation::default() },
            ..MeasuredDevice::default()
        };
        let of = |devices: &[MeasuredDevice]| Measured::new(ModelCost::default(), 0, devices.to_vec()).error;
        let error = of(&[device(1.0, 9.0), device(f64::NAN, f64::NAN), device(2.0, 3.0)]);
        assert_eq!((error.rms, error.max), (2.0, 9.0));
        assert!(of(&[device(f64::NAN, 1.0)]).rms.is_nan());
    }

    #[test]
    fn a_fault_of_any_run_is_told_of_also_of_a_finer_one() {
        let run = |model: &str, outcome| ComparedRun { model: model.to_owned(), latency: Nanos::ZERO, outcome };
        let fault = || RunOutcome::Failed("it diverged".to_owned());
        let comparison = Comparison {
            runs: vec![run("hold", fault()), run("patch", RunOutcome::Refused("it is too small".to_owned()))],
            finer: vec![run("half the step", fault())],
            ..Comparison::default()
        };
        let faults: Vec<_> = comparison.faults().collect();
        assert_eq!(faults, [("hold", "it diverged"), ("half the step", "it diverged")]);
    }

    #[test]
    fn a_trace_is_taken_from_the_records_of_its_kind() {
        let force =
            |z| LogRecord::Force(ForceSample { force_n: [0.0, 0.0, z], energy_j: -z, ..ForceSample::default() });
        let resync = Resync { version: 3, ..Resync::default() };
        let trace = ForceTrace::of(&[force(1.0), LogRecord::Resync(resync), force(-3.0)]);
        assert_eq!((trace.forces_n.len(), trace.resyncs.len()), (2, 1));
        assert_eq!((trace.peak_n(), trace.largest_energy_j()), (3.0, 3.0));
    }
}
