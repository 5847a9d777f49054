//! Sessions on real threads: identities and limits that hold however busy the machine is, and whatever devices and
//! bodies do. No test here asserts an absolute time.

mod device_clock;
mod session_support;

use device_clock::DeviceClock;
use palpate::devices::{Capabilities, Device, DeviceFault, DeviceState, ForceCommand, ToolPath};
use palpate::model::Vec3;
use palpate::model::body::{Block, Body, State};
use palpate::model::local::Kind as LocalModelKind;
use palpate::runtime::{GroupReport, Nanos, OverrunPolicy, Rate, RateGroup, SlipCause};
use palpate::session::{Session, SessionBuilder, Summary};
use session_support::*;
use std::sync::{Arc, Mutex};
use std::time::{Duration, Instant};

const MAX_FORCE_N: f64 = 2.0;
/// The default of the builder (N per tick of 1 ms).
const MAX_SLEW_N: f64 = 0.5;

type Written = Arc<Mutex<Vec<Vec3>>>;
type Read = dyn FnMut(u64, DeviceState) -> Result<DeviceState, DeviceFault> + Send;

/// Follows a path, remembers what it was commanded, and lets a test spoil what it reads.
struct Probing {
    path: ToolPath,
    reads: u64,
    written: Written,
    spoil: Box<Read>,
    refuse_writes: bool,
}

impl std::fmt::Debug for Probing {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str("Probing")
    }
}

impl Probing {
    /// A device and the list of the forces that it was told to exert.
    fn new(
        path: ToolPath,
        spoil: impl FnMut(u64, DeviceState) -> Result<DeviceState, DeviceFault> + Send + 'static,
    ) -> (Self, Written) {
        let written = Written::default();
        let device =
            Self { path, reads: 0, written: Arc::clone(&written), spoil: Box::new(spoil), refuse_writes: false };
        (device, written)
    }
}

impl Device for Probing {
    fn name(&self) -> &str {
        "probing"
    }

    fn capabilities(&self) -> Capabilities {
        Capabilities { max_force_n: MAX_FORCE_N, ..Capabilities::default() }
    }

    fn read(&mut self, time: Nanos) -> Result<DeviceState, DeviceFault> {
        self.reads += 1;
        let position = Vec3::from(self.path.at(time.as_secs_f64()));
        (self.spoil)(self.reads, DeviceState { position, ..DeviceState::default() })
    }

    fn write(&mut self, command: ForceCommand) -> Result<(), DeviceFault> {
        self.written.lock().unwrap().push(command.force);
        if self.refuse_writes { Err(DeviceFault::NotReady) } else { Ok(()) }
    }
}

/// Periods in which the force comes to rest at the end: the ramp's 100 ms and the margin.
const WIND_DOWN: u64 = 105;

/// Check that a group had all its periods, and on top of these only such as were overdue when its wind-down began, and so were skipped.
#[track_caller]
fn assert_all_periods(group: &GroupReport, periods: u64) {
    let overdue = group.elapsed_periods.checked_sub(periods);
    assert!(overdue.is_some_and(|overdue| overdue <= group.skipped), "{periods} periods: {group:?}");
}

fn session(device: impl Device + 'static) -> SessionBuilder {
    Session::builder(block()).device(device).model(LocalModelKind::Patch).friction(0.5).keep_records()
}

fn run(builder: SessionBuilder, seconds: f64) -> Summary {
    builder.duration_s(seconds).build().unwrap().run().unwrap()
}

/// Check what holds for every run with a disk that takes its log: nothing is lost, and the run is sound.
fn assert_sound(summary: &Summary, written: &Written) {
    assert_eq!(summary.report.lost_records(), 0);
    assert_sound_without_log(summary, written);
}

/// Check what holds for every run: the books balance, and no command breaks a limit.
fn assert_sound_without_log(summary: &Summary, written: &Written) {
    for group in &summary.runtime.groups {
        assert_eq!(group.released + group.skipped, group.elapsed_periods, "{}", group.name);
        assert_eq!(group.slips.total(), group.skipped, "{}", group.name);
    }
    assert_eq!(summary.runtime.lost_records, 0);
    let times: Vec<Nanos> = forces(summary).iter().map(|r| r.time).collect();
    assert!(times.windows(2).all(|pair| pair[0] < pair[1]), "a force row per simulated time");

    let commands = commands(summary);
    // The first release writes no force; the group of device and local model is the first.
    let releases: Vec<_> = timings(summary).into_iter().filter(|t| t.group == 0).collect();
    assert_eq!((commands.len() + 1, releases.len() as u64), (releases.len(), summary.runtime.groups[0].released));
    let mut last = [0.0; 3];
    for (command, release) in commands.iter().zip(&releases[1..]) {
        let force = command.force_n;
        assert!(force.iter().all(|c| c.is_finite()), "{command:?}");
        assert!(norm(force) <= MAX_FORCE_N * (1.0 + 1e-12), "{command:?}");
        let change = norm(std::array::from_fn(|i| force[i] - last[i]));
        assert!(change <= MAX_SLEW_N * f64::from(release.slips + 1) * (1.0 + 1e-9), "{command:?} after {last:?}");
        last = force;
    }
    // What was logged is what the device got; then it is told zero.
    let written = written.lock().unwrap();
    let logged: Vec<Vec3> = commands.iter().map(|command| command.force_n.into()).collect();
    assert_eq!(written[..written.len() - 1], logged);
    assert_eq!(written.last(), Some(&Vec3::zeros()), "the last command is zero");
}

fn stages(summary: &Summary) -> Vec<&str> {
    summary.report.devices[0].limits.stages.iter().map(|(name, _)| &**name).collect()
}

fn events(summary: &Summary) -> String {
    summary.report.events.iter().map(|event| format!("{}: {}\n", event.level.name(), event.message)).collect()
}

/// A device that owns the clock.
#[derive(Debug)]
struct Pacing {
    inner: Probing,
    clock: DeviceClock,
}

impl Device for Pacing {
    fn name(&self) -> &str {
        "pacing"
    }

    fn capabilities(&self) -> Capabilities {
        self.inner.capabilities()
    }

    fn wait(&mut self, timeout: Duration) -> bool {
        self.clock.wait(timeout)
    }

    fn read(&mut self, time: Nanos) -> Result<DeviceState, DeviceFault> {
        self.inner.read(time)
    }

    fn write(&mut self, command: ForceCommand) -> Result<(), DeviceFault> {
        self.inner.write(command)
    }
}

#[test]
fn a_device_that_owns_the_clock_paces_the_local_group_and_time_does_not_stretch() {
    let (inner, written) = Probing::new(pressing(), |_, state| Ok(state));
    let clock = DeviceClock::new(Duration::from_secs(1) / 998, [Duration::MAX; 2]);
    let device = Pacing { inner, clock };
    let local = RateGroup::hz(1000).device_paced(Nanos(100_000_000));
    let summary = run(session(device).local(local), 1.0);
    assert_sound(&summary, &written);
    let group = &summary.runtime.groups[0];
    assert_eq!(summary.runtime.fault, None);
    assert_all_periods(group, 1001 + WIND_DOWN);
    // Check that what the slower clock lacks is the device's, and that the model has kept up with the nominal time
    assert!(group.slips.of(SlipCause::StalledPeer) >= 1, "{:?}", group.slips);
    let last = forces(&summary).last().unwrap().time;
    assert!(last >= Nanos(900_000_000), "{last}");
}

#[test]
fn a_degraded_group_advances_two_ticks_per_release_at_most() {
    let longest = |policy| {
        let (device, written) = Probing::new(pressing(), |read, state| {
            if read % 100 == 0 {
                std::thread::sleep(Duration::from_millis(12));
            }
            Ok(state)
        });
        let summary = run(session(device).local(RateGroup::hz(1000).overrun(policy)), 0.5);
        assert_sound(&summary, &written);
        let times: Vec<u64> = forces(&summary).iter().map(|r| r.time.0).collect();
        let steps = times.windows(2).map(|pair| (pair[1] - pair[0]) / 1_000_000).max().unwrap();
        (steps, summary.runtime.groups[0].in_degraded_mode)
    };
    // Twelve periods are owed: the usual release makes up eight of them, one in degraded mode two.
    assert_eq!(longest(OverrunPolicy::Skip), (8, 0));
    let (steps, degraded) = longest(OverrunPolicy::Degrade { recover_after: 1000 });
    assert!(steps == 2 && degraded > 100, "{steps} ticks, {degraded} releases");
}

#[test]
fn a_run_balances_its_books_and_resyncs() {
    for model in LocalModelKind::ALL {
        let (device, written) = Probing::new(pressing(), |_, state| Ok(state));
        let summary = run(session(device).model(model), 1.0);
        assert_sound(&summary, &written);
        assert_eq!(summary.runtime.fault, None);
        // The last is the logger: it ends with the others, whether or not its last period has passed.
        let [local, slow @ .., _] = &summary.runtime.groups[..] else {
            panic!("a group of the model's and the logger")
        };
        assert_all_periods(local, 1001 + WIND_DOWN);
        let slow: Vec<u64> = slow.iter().map(|group| group.elapsed_periods).collect();
        match model {
            LocalModelKind::Full => assert!(slow.is_empty()),
            _ => {
                // Bases are made by a group of its own, at the global model's rate.
                assert_eq!(slow, [31; 2][..if model == LocalModelKind::Predictive { 2 } else { 1 }]);
                assert!(summary.report.devices[0].resyncs.age_ns.count > 0, "{model:?} never resynced");
                assert!(!global_ticks(&summary).is_empty());
            }
        }
        assert_eq!(summary.report.devices[0].force.ticks, forces(&summary).len() as u64);
        assert!(summary.report.devices[0].force.peak_n > 0.05, "{model:?} felt nothing");
    }
}

/// Every 100 ticks the device takes 12 ms: the periods are skipped, simulated time is made up and never stretches.
#[test]
fn a_device_that_stalls_costs_periods_and_no_simulated_time() {
    let (device, written) = Probing::new(pressing(), |reads, state| {
        if reads % 100 == 50 {
            let start = Instant::now();
            while start.elapsed() < Duration::from_millis(12) {
                std::hint::spin_loop();
            }
        }
        Ok(state)
    });
    let summary = run(session(device), 1.0);
    assert_sound(&summary, &written);
    let haptic = &summary.runtime.groups[0];
    assert!(haptic.skipped >= 8 * 10, "{}", summary.runtime);
    let rate = Rate::hz(1000);
    let ticks: Vec<u64> = forces(&summary).iter().map(|r| rate.last_release(r.time)).collect();
    let released: Vec<u64> = timings(&summary).iter().filter(|t| t.group == 0).map(|t| t.tick).skip(1).collect();
    // Every release makes up all that is owed, eight ticks at most.
    let mut simulated = 0;
    for (tick, release) in ticks.iter().zip(&released) {
        simulated = (*release).min(simulated + 8);
        assert_eq!(*tick, simulated, "release {release}");
    }
    assert!(ticks.iter().zip(&released).any(|(simulated, release)| simulated < release), "nothing was ever owed");
    // The global model saw every tick of the tool, none twice.
    let taken = global_ticks(&summary);
    assert!(taken.windows(2).all(|pair| pair[1].first_tick == pair[0].last_tick + 1), "{taken:?}");
}

#[test]
fn a_device_that_lies_or_faults_never_gets_a_command_beyond_the_limits() {
    let (device, written) = Probing::new(pressing(), |reads, mut state| match reads % 50 {
        7 => {
            state.position.x = f64::NAN;
            Ok(state)
        }
        8 => {
            state.velocity.z = f64::INFINITY;
            Ok(state)
        }
        17 => Err(DeviceFault::Stale),
        27 => Err(DeviceFault::Disconnected),
        // A teleport of 20 mm into the body and back.
        37..=39 if reads > 100 => {
            state.position.z -= 0.02;
            Ok(state)
        }
        _ => Ok(state),
    });
    let summary = run(session(device).model(LocalModelKind::Full), 1.0);
    assert_sound(&summary, &written);
    assert_eq!(summary.runtime.fault, None);
    for stage in ["clamp", "slew", "ramp", "tool_speed", "start_up"] {
        assert!(stages(&summary).contains(&stage), "no {stage} in {:?}", stages(&summary));
    }
    assert!(summary.report.devices[0].force.peak_n > MAX_FORCE_N, "nothing was there to be clamped");
    assert!(summary.report.devices[0].force.not_finite == 0);
    let degraded = summary.runtime.groups[0].degraded;
    assert!(degraded > 20, "{degraded}");
    let events = events(&summary);
    for words in ["not finite", "no new state", "disconnected", "back to normal"] {
        assert!(events.contains(words), "no {words:?} in\n{events}");
    }
}

#[test]
fn a_device_that_refuses_every_command_is_reported() {
    let (mut device, written) = Probing::new(pressing(), |_, state| Ok(state));
    device.refuse_writes = true;
    let summary = run(session(device), 0.2);
    assert_sound(&summary, &written);
    assert!(summary.runtime.groups[0].degraded >= summary.runtime.groups[0].released - 1);
    assert!(events(&summary).contains("the device is not ready"));
}

#[test]
fn a_device_without_a_first_state_is_refused_at_the_start_and_leaves_no_log() {
    let folder = tempfile::tempdir().unwrap();
    let log = folder.path().join("run.mcap");
    let (gone, _) = Probing::new(pressing(), |_, _| Err(DeviceFault::Disconnected));
    let (wild, _) = Probing::new(pressing(), |_, mut state| {
        state.position.y = f64::NAN;
        Ok(state)
    });
    for (device, words) in [(gone, "disconnected"), (wild, "not finite")] {
        let session = session(device);
        let session = session.log(&log);
        let error = session.build().unwrap().start().unwrap_err();
        assert_eq!(error.kind(), palpate::ErrorKind::Device);
        assert!(error.to_string().contains("probing") && error.to_string().contains(words), "{error}");
        assert!(!log.exists());
    }
}

/// A block that fails after so many evaluations of its forces, once it is armed.
fn failing(left: Arc<Mutex<Option<u64>>>, panics: bool) -> impl Body {
    AlteredBlock::new(block(), move |block: &mut Block, state: &State, forces: &mut [Vec3]| {
        block.forces(state, forces);
        let mut left = left.lock().unwrap();
        *left = left.map(|left| left.saturating_sub(1));
        if *left == Some(0) {
            // A poisoned lock would be a second failure.
            drop(left);
            assert!(!panics, "the body gave way");
            forces.fill(Vec3::repeat(f64::NAN));
        }
    })
}

/// Runs a body that fails 350 ticks of two steps after the start.
fn run_failing(panics: bool, model: LocalModelKind, seconds: f64) -> (Summary, Written) {
    let (device, written) = Probing::new(pressing(), |_, state| Ok(state));
    let left = Arc::new(Mutex::new(None));
    let body = failing(Arc::clone(&left), panics);
    let session = Session::builder(body).device(device).substeps_per_ms(2).model(model).keep_records();
    let session = session.duration_s(seconds).build().unwrap();
    *left.lock().unwrap() = Some(700);
    (session.run().unwrap(), written)
}

#[test]
fn a_global_model_that_turns_nan_is_reported_and_its_patch_goes_on() {
    let (summary, written) = run_failing(false, LocalModelKind::Patch, 0.8);
    assert_sound(&summary, &written);
    assert_eq!(summary.runtime.fault, None);
    assert!(events(&summary).contains("global: the global model's state is not finite"), "{}", events(&summary));
    assert!(summary.runtime.groups[1].degraded > 0);
    assert_eq!(summary.report.devices[0].force.not_finite, 0);
    let last = *forces(&summary).last().unwrap();
    assert!(last.model_age_s > 0.1, "no newer model can have come: {last:?}");
}

#[test]
fn a_body_that_turns_nan_under_the_tool_ends_the_run_with_zero_force() {
    let (summary, written) = run_failing(false, LocalModelKind::Full, 5.0);
    assert!(written.lock().unwrap().iter().all(|force| force.iter().all(|c| c.is_finite())));
    assert_eq!(written.lock().unwrap().last(), Some(&Vec3::zeros()));
    // The log has what was computed, not what was commanded in its place.
    assert_eq!(summary.report.devices[0].force.not_finite, 1);
    let fault = summary.runtime.fault.as_ref().expect("a fault");
    assert_eq!((&*fault.group, &*fault.actor), ("local", "local"));
    assert!(events(&summary).contains("error: local: the local model's force is not finite"), "{}", events(&summary));
    assert!(summary.to_string().contains("fault"), "{summary}");
    for group in &summary.runtime.groups {
        assert_eq!(group.released + group.skipped, group.elapsed_periods, "{}", group.name);
    }
}

#[test]
fn a_body_with_forces_that_are_not_finite_is_refused_when_the_session_is_built() {
    for substeps in [None, Some(2)] {
        let (device, _) = Probing::new(pressing(), |_, state| Ok(state));
        let body = failing(Arc::new(Mutex::new(Some(0))), false);
        let session = Session::builder(body).device(device);
        let session = substeps.into_iter().fold(session, SessionBuilder::substeps_per_ms);
        let error = session.build().unwrap_err();
        assert_eq!(error.to_string(), "body: gives forces near its rest positions that are not finite");
    }
}

#[test]
fn a_panic_of_a_programs_body_ends_the_run_names_the_actor_and_zeroes_the_device() {
    for (model, group) in [(LocalModelKind::Patch, "global"), (LocalModelKind::Full, "local")] {
        let (summary, written) = run_failing(true, model, 5.0);
        let fault = summary.runtime.fault.as_ref().expect("a fault");
        assert_eq!((&*fault.group, &*fault.actor), (group, group));
        assert!(fault.what.contains("the body gave way"), "{fault}");
        assert!(summary.to_string().contains("the body gave way"), "{summary}");
        assert_eq!(written.lock().unwrap().last(), Some(&Vec3::zeros()));
    }
}

#[test]
fn a_panic_of_a_programs_device_ends_the_run_names_it_and_zeroes_it() {
    let (device, written) = Probing::new(pressing(), |reads, state| {
        assert!(reads < 150, "the driver crashed");
        Ok(state)
    });
    let summary = run(session(device), 5.0);
    let fault = summary.runtime.fault.as_ref().expect("a fault");
    assert_eq!((&*fault.group, &*fault.actor), ("local", "probing"));
    assert!(fault.what.contains("the driver crashed"), "{fault}");
    assert_eq!(written.lock().unwrap().last(), Some(&Vec3::zeros()));
}

#[test]
fn dropping_a_running_session_zeroes_the_device() {
    let (device, written) = Probing::new(pressing(), |_, state| Ok(state));
    let running = session(device).build().unwrap().start().unwrap();
    running.wait_for(Duration::from_millis(150));
    drop(running);
    let count = written.lock().unwrap().len();
    assert!(count > 0);
    assert_eq!(written.lock().unwrap().last(), Some(&Vec3::zeros()));
    std::thread::sleep(Duration::from_millis(20));
    assert_eq!(written.lock().unwrap().len(), count, "nothing is written after the drop");
}

#[test]
fn a_run_without_an_end_stops_from_another_thread() {
    let (device, written) = Probing::new(pressing(), |_, state| Ok(state));
    let running = session(device).build().unwrap().start().unwrap();
    let stop = running.stop_handle();
    let stopper = std::thread::spawn(move || {
        std::thread::sleep(Duration::from_millis(120));
        stop.request();
    });
    while !running.finished() {
        running.wait_for(Duration::from_millis(10));
    }
    stopper.join().unwrap();
    assert_sound(&running.stop(), &written);
}

#[test]
#[cfg(target_os = "linux")]
fn a_log_that_cannot_be_written_does_not_end_the_run() {
    let (device, written) = Probing::new(pressing(), |_, state| Ok(state));
    let summary = run(session(device).log("/dev/full"), 0.8);
    assert_sound_without_log(&summary, &written);
    // Each haptic tick has at least its timing, force, command, sample and contact, and the disk took none of them.
    assert!(summary.report.lost_records() > 5 * 800, "{} records lost", summary.report.lost_records());
    assert_eq!(summary.runtime.fault, None);
    assert_all_periods(&summary.runtime.groups[0], 801 + WIND_DOWN);
    assert_eq!(summary.report.devices[0].force.ticks, forces(&summary).len() as u64, "the report is complete");
    let error = summary.log_error.as_ref().expect("an error");
    assert!(error.to_string().contains("/dev/full"), "{error}");
    assert!(summary.to_string().contains("/dev/full"), "{summary}");
}

#[test]
fn the_log_holds_what_the_run_reported() {
    use palpate::log::{Analysis, LogReader};
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("run.mcap");
    let (device, written) = Probing::new(pressing(), |_, state| Ok(state));
    let summary = run(session(device).log(&path), 0.6);
    assert_sound(&summary, &written);
    let mut analysis = Analysis::default();
    let mut records = Vec::new();
    for entry in LogReader::open(&path).unwrap().map(Result::unwrap) {
        analysis.push_entry(&entry);
        if let palpate::log::LogEntry::Record(record) = entry {
            records.push(record);
        }
    }
    let mut told = summary.report.clone();
    // In the log, what was run is an attachment of its own.
    if let Some(environment) = &mut told.environment {
        environment.session = None;
    }
    assert_eq!(analysis.report(), told);
    assert_eq!(records.len(), summary.records.len());
}
