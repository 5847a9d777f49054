//! A logged run is executed again to the same forces, bit for bit, whatever happened to its threads; a log that does not
//! hold everything is refused, and a force or a tool sample that was changed is found.

mod session_support;

use palpate::devices::{Capabilities, Device, DeviceFault, DeviceState, ForceCommand, Scripted, ToolPath};
use palpate::log::{Environment, Level, LogEntry, LogReader, LogRecord, McapWriter, TextEvent};
use palpate::model::Vec3;
use palpate::model::body::{Block, Body, State};
use palpate::model::contact::ContactMode;
use palpate::model::local::{Feedback, Kind as LocalModelKind};
use palpate::runtime::Nanos;
use palpate::runtime::{PortUseKind, RateGroup};
use palpate::scene::Scene;
use palpate::session::{Compared, ReplayReport, Session, SessionBuilder, Summary};
use palpate::{Error, ErrorKind};
use session_support::{AlteredBlock, block, meeting, pressing, top, wide_block, wiggling};
use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex};
use std::time::Duration;

/// Runs it with a log in `folder`.
fn record(builder: SessionBuilder, folder: &tempfile::TempDir) -> (Summary, PathBuf) {
    let log = folder.path().join("run.mcap");
    let summary = builder.log(&log).build().unwrap().run().unwrap();
    assert!(summary.log_error.is_none());
    (summary, log)
}

fn folder() -> tempfile::TempDir {
    tempfile::tempdir().unwrap()
}

/// Check that every force of the log was computed again, and that there were as many as the run reported.
fn assert_identical(report: &ReplayReport, summary: &Summary) {
    assert!(report.is_identical(), "{report}");
    assert!(report.topics().all(Compared::is_identical), "{report}");
    assert!(report.topics().all(|topic| topic.left_out == 0));
    assert_eq!((&report.logged_fault, &report.unrepeated), (&None, &None));
    assert_eq!(
        (report.force.logged, report.commanded.logged),
        (summary.report.devices[0].force.ticks, summary.report.devices[0].limits.ticks)
    );
    assert!(report.force.logged > 50, "{report}");
}

fn demo(seconds: f64) -> SessionBuilder {
    Session::from_scene(Scene::demo()).duration_s(seconds)
}

#[test]
fn the_demo_in_real_time_is_replayed_bit_for_bit() {
    let folder = folder();
    let (summary, log) = record(demo(2.0), &folder);
    assert!(summary.report.devices[0].resyncs.age_ns.count > 0 && summary.report.devices[0].contact.slip > 0);
    assert_identical(&Session::replay(&log).unwrap().run().unwrap(), &summary);
}

#[test]
fn every_local_model_and_feedback_is_replayed_bit_for_bit() {
    for model in LocalModelKind::ALL {
        let folder = folder();
        let (summary, log) = record(demo(0.7).model(model), &folder);
        assert_identical(&Session::replay(&log).unwrap().run().unwrap(), &summary);
    }
    let folder = folder();
    let (summary, log) = record(demo(0.7).feedback(Feedback::Trajectory), &folder);
    assert_identical(&Session::replay(&log).unwrap().run().unwrap(), &summary);
}

#[test]
fn a_virtual_log_is_replayed_whatever_its_latency() {
    for latency_ms in [0, 20, 70] {
        let folder = folder();
        let global = RateGroup::hz(30).latency(Nanos(latency_ms * 1_000_000));
        let (summary, log) = record(demo(1.0).global(global).virtual_time(), &folder);
        assert!(summary.report.devices[0].force.peak_n > 0.1, "{summary}");
        assert_identical(&Session::replay(&log).unwrap().run().unwrap(), &summary);
    }
}

/// Follows a path, stalls now and then and fails to read now and then.
#[derive(Debug)]
struct Moody {
    path: ToolPath,
    reads: u64,
    panics_at: u64,
}

impl Device for Moody {
    fn name(&self) -> &str {
        "moody"
    }

    fn capabilities(&self) -> Capabilities {
        Capabilities { max_force_n: 1.25, ..Capabilities::default() }
    }

    fn read(&mut self, time: Nanos) -> Result<DeviceState, DeviceFault> {
        self.reads += 1;
        assert!(self.reads < self.panics_at, "the device gave way");
        if self.reads.is_multiple_of(97) {
            std::thread::sleep(Duration::from_micros(700 * (self.reads / 97 % 20)));
        }
        // The state before the start is not the one of release 0, but near it: a tool may be glued there.
        let offset = if self.reads == 1 { 5e-4 } else { 0.0 };
        let position = Vec3::from(self.path.at(time.as_secs_f64())) + Vec3::repeat(offset);
        match self.reads % 13 {
            5 => Err(DeviceFault::Stale),
            7 => Err(DeviceFault::NotReady),
            9 => Ok(DeviceState { position: Vec3::repeat(f64::NAN), ..DeviceState::default() }),
            _ => Ok(DeviceState { position, velocity: position, buttons: self.reads as u16, ..DeviceState::default() }),
        }
    }

    fn write(&mut self, _: ForceCommand) -> Result<(), DeviceFault> {
        if self.reads.is_multiple_of(11) { Err(DeviceFault::NotReady) } else { Ok(()) }
    }
}

fn moody(path: ToolPath) -> Moody {
    Moody { path, reads: 0, panics_at: u64::MAX }
}

/// A block whose forces take their time now and then, so that local models come late; call number 2000 takes `longest`.
fn slow(longest: Duration) -> impl Body {
    let mut calls = 0_u64;
    AlteredBlock::new(block(), move |block: &mut Block, state: &State, forces: &mut [Vec3]| {
        calls += 1;
        match calls {
            2000 => std::thread::sleep(longest),
            calls if calls % 331 == 0 => std::thread::sleep(Duration::from_millis(calls % 60)),
            _ => {}
        }
        block.forces(state, forces);
    })
}

/// A session around a program's own body; the program fills it in the same way for the run and for the replay.
fn own(body: impl Body + 'static) -> SessionBuilder {
    Session::builder(body).model(LocalModelKind::Patch).substeps_per_ms(2).friction(0.5).crossfade_ms(10.0).probe(top())
}

#[test]
fn stalls_late_models_and_failed_reads_are_replayed_bit_for_bit() {
    let folder = folder();
    let slow = slow(Duration::from_millis(300));
    let (summary, log) = record(own(slow).device(moody(pressing())).duration_s(2.0), &folder);
    // Check that it was such a run: releases skipped on both sides, models that came late, reads that failed
    assert!(summary.runtime.groups.iter().take(2).all(|group| group.skipped > 0), "{summary}");
    assert!(summary.runtime.groups[0].degraded > 0 && summary.report.devices[0].force.peak_n > 0.05, "{summary}");
    let report = own(block()).duration_s(2.0).replay(&log).unwrap().run().unwrap();
    assert_identical(&report, &summary);
}

#[test]
fn a_queue_that_overflowed_is_replayed_bit_for_bit() {
    let folder = folder();
    let slow = slow(Duration::from_millis(4600));
    let (summary, log) = record(own(slow).path(pressing()).duration_s(6.0), &folder);
    let dropped = |entry: &LogEntry| matches!(entry, LogEntry::Record(LogRecord::Port(used)) if used.kind == PortUseKind::Dropped);
    assert!(entries(&log).iter().any(dropped), "the queue of four seconds never overflowed");
    assert_identical(&own(block()).duration_s(6.0).replay(&log).unwrap().run().unwrap(), &summary);
}

#[test]
fn a_glued_tool_and_a_changed_scene_are_replayed_from_the_log_alone() {
    let folder = folder();
    let mut scene = Scene::demo();
    scene.body.as_mut().unwrap().mass_spring_mut().unwrap().block.nodes = [6; 3];
    scene.local.patch = Some([3, 3, 2]);
    scene.probes.clear();
    scene.safety.max_force_n = None;
    let builder = Session::from_scene(scene).attach_node(top()).probe(top()).friction(f64::INFINITY).patch([4, 3, 2]);
    let builder = builder.device(moody(wiggling())).crossfade_ms(7.0).duration_s(0.8);
    let (summary, log) = record(builder, &folder);
    assert!(summary.report.devices[0].force.peak_n > 0.05, "{summary}");
    assert_identical(&Session::replay(&log).unwrap().run().unwrap(), &summary);
}

#[test]
fn a_run_that_a_panic_ended_is_compared_up_to_there() {
    let folder = folder();
    let device = Moody { panics_at: 300, ..moody(pressing()) };
    let (summary, log) = record(own(block()).device(device).duration_s(1.0), &folder);
    let fault = summary.runtime.fault.unwrap();
    let report = own(block()).duration_s(1.0).replay(&log).unwrap().run().unwrap();
    assert!(report.is_identical() && report.force.is_identical(), "{report}");
    let logged = report.logged_fault.as_ref().unwrap();
    assert!(logged.time == fault.at && logged.what.contains("panicked") && !logged.restarted, "{report}");
    assert!(report.force.logged > 50 && report.topics().all(Compared::is_identical), "{report}");
    let says = format!("COMPARED ONLY up to t = {} s of {} s", fault.at.as_secs_f64(), report.end.as_secs_f64());
    assert!(report.to_string().contains(&says) && report.to_string().contains("the run ended with it"), "{report}");
}

/// A block that fails once, which copies of it share, when `calls` has counted to about half a second of a session of
/// [`own`]: for `hangs` it does not return; without, it panics. A session looks at its body before it starts, so the count
/// begins far beyond.
fn failing(calls: &Arc<Mutex<u64>>, hangs: Option<Duration>) -> impl Body + use<> {
    const AT: u64 = 1000;
    *calls.lock().unwrap() = u64::MAX / 2;
    let calls = Arc::clone(calls);
    let body = AlteredBlock::new(block(), move |block: &mut Block, state: &State, forces: &mut [Vec3]| {
        let call = {
            let mut calls = calls.lock().unwrap();
            *calls += 1;
            *calls - 1
        };
        if call == AT {
            std::thread::sleep(hangs.expect("the body gave way"));
        }
        block.forces(state, forces);
    });
    body.with_copies()
}

// Check that a log goes on behind a restart, that this is no reason to refuse it, and that the report tells how much of
// it was compared.
#[test]
fn a_run_whose_global_model_was_started_again_is_compared_up_to_the_fault() {
    let hung = Duration::from_millis(2500);
    for (hangs, is_virtual, seconds) in [(None, false, 1.2), (None, true, 1.2), (Some(hung), false, 3.2)] {
        let folder = folder();
        let (calls, log) = (Arc::default(), folder.path().join("run.mcap"));
        let session = own(failing(&calls, hangs)).path(pressing()).duration_s(seconds).log(&log);
        let session = if is_virtual { session.virtual_time() } else { session }.build().unwrap();
        *calls.lock().unwrap() = 0;
        let summary = session.run().unwrap();
        assert_eq!((summary.runtime.restarts.len(), &summary.runtime.fault), (1, &None), "{summary}");
        let fault = &summary.runtime.restarts[0];
        let report = own(block()).duration_s(seconds).replay(&log).unwrap().run().unwrap();
        assert!(report.is_identical() && report.topics().all(Compared::is_identical), "{report}");
        let logged = report.logged_fault.as_ref().unwrap();
        assert!(logged.time == fault.at && logged.restarted, "{report}");
        assert_eq!(report.force.logged + report.force.left_out, summary.report.devices[0].force.ticks);
        assert!(report.force.logged > 50 && report.force.left_out > 50 && report.end > fault.at, "{report}");
        assert!(report.to_string().contains("a new global model served after it"), "{report}");
    }
}

#[test]
fn a_fault_before_the_first_force_leaves_nothing_to_compare() {
    let folder = folder();
    let device = Moody { panics_at: 3, ..moody(pressing()) };
    let (summary, log) = record(own(block()).device(device).duration_s(0.3), &folder);
    // Periods that a stalled host let pass are skipped before it.
    let at = summary.runtime.fault.unwrap().at;
    let error = own(block()).duration_s(0.3).replay(&log).unwrap_err();
    assert_eq!(error.kind(), ErrorKind::Log);
    let words = format!("no force before the fault at t = {} s", at.as_secs_f64());
    assert!(at >= Nanos(1_000_000) && error.to_string().contains(&words), "{error}");
}

/// A virtual run that a panic of the device ended at 298 ms.
fn ended_by_a_fault(folder: &tempfile::TempDir) -> (Nanos, PathBuf) {
    let device = Moody { panics_at: 300, ..moody(pressing()) };
    let (summary, log) = record(own(block()).device(device).duration_s(1.0).virtual_time(), folder);
    (summary.runtime.fault.unwrap().at, log)
}

fn replayed_own(log: &Path) -> Result<ReplayReport, Error> {
    own(block()).duration_s(1.0).replay(log)?.run()
}

// Check that a fault in a log excuses nothing before it: what cannot be repeated and what is not there is told.
#[test]
fn what_is_missing_or_changed_before_a_fault_is_found() {
    let folder = folder();
    let (fault, log) = ended_by_a_fault(&folder);
    let whole = entries(&log);
    assert!(replayed_own(&rewritten(&log, whole.clone())).unwrap().is_identical());

    // A version that was never published, in the last release before the fault that took one.
    let took = |entry: &LogEntry| matches!(entry, LogEntry::Record(LogRecord::Port(r)) if r.kind == PortUseKind::Took && r.group == 0 && r.time < fault);
    let mut changed = whole.clone();
    let place = changed.iter().rposition(took).unwrap();
    let LogEntry::Record(LogRecord::Port(used)) = &mut changed[place] else { unreachable!() };
    used.count += 5;
    let release = used.tick;
    let report = replayed_own(&rewritten(&log, changed)).unwrap();
    assert!(!report.is_identical() && report.unrepeated.is_none(), "{report}");
    assert!(report.fault.as_ref().unwrap().what.contains(&format!("release {release} waits for number")), "{report}");
    assert!(report.first_difference.as_ref().is_some_and(|found| found.what == "count"), "{report}");

    // The last force before the fault, and all of the second half.
    for gone in [Nanos(fault.0 - 1_000_000), Nanos(fault.0 / 2)] {
        let is_kept = |entry: &&LogEntry| !matches!(entry, LogEntry::Record(LogRecord::Force(r)) if (gone..fault).contains(&r.time));
        let report = replayed_own(&rewritten(&log, whole.iter().filter(is_kept).cloned().collect())).unwrap();
        assert!(!report.is_identical() && report.force.computed > report.force.identical, "{report}");
        assert_eq!(report.first_difference.as_ref().unwrap().topic, "/force");
    }

    // One more than was computed.
    let mut changed = whole.clone();
    let last = |entry: &LogEntry| matches!(entry, LogEntry::Record(LogRecord::Force(r)) if r.time < fault);
    let place = changed.iter().rposition(last).unwrap();
    changed.insert(place, changed[place].clone());
    let report = replayed_own(&rewritten(&log, changed)).unwrap();
    assert!(!report.is_identical() && report.first_difference.as_ref().unwrap().what == "count", "{report}");
}

// Check that an event that would cut the log short, or hide a fault, is not believed if no group told it.
#[test]
fn an_event_that_nobody_told_is_refused() {
    let folder = folder();
    let (fault, log) = ended_by_a_fault(&folder);
    let whole = entries(&log);
    let places: Vec<usize> = (0..whole.len()).filter(|i| matches!(whole[*i], LogEntry::Text(_))).collect();
    assert!(places.len() > 10, "degraded releases and a fault");
    let text = |entry: &mut LogEntry, change: &dyn Fn(&mut TextEvent)| {
        let LogEntry::Text(event) = entry else { unreachable!() };
        change(event);
    };
    let changes: [&dyn Fn(&mut TextEvent); 3] = [
        &|event| event.level = if event.level == Level::Error { Level::Info } else { Level::Error },
        &|event| event.time = Nanos(event.time.0 ^ 1 << 20),
        &|event| event.message.push('!'),
    ];
    for change in changes {
        for place in [places[3], places[places.len() - 2], places[places.len() - 1]] {
            let mut changed = whole.clone();
            text(&mut changed[place], change);
            let error = replayed_own(&rewritten(&log, changed)).unwrap_err();
            assert!(error.kind() == ErrorKind::Log && error.to_string().contains("an event in /log"), "{error}");
        }
    }
    let mut more = whole.clone();
    let message = "global: actor 0 panicked".to_owned();
    more.insert(places[3], LogEntry::Text(TextEvent { time: Nanos(fault.0 / 2), level: Level::Error, message }));
    let error = replayed_own(&rewritten(&log, more)).unwrap_err();
    assert!(error.to_string().contains("events, but"), "{error}");
}

#[test]
fn a_sample_used_again_after_a_failed_read_is_the_one_before() {
    let folder = folder();
    let (fault, log) = ended_by_a_fault(&folder);
    let mut changed = entries(&log);
    let mut last_id = u32::MAX;
    let again = changed.iter_mut().rev().find_map(|entry| match entry {
        LogEntry::Record(LogRecord::Tool(r)) if r.time < fault => {
            (std::mem::replace(&mut last_id, r.id) == r.id).then_some(r)
        }
        _ => None,
    });
    again.unwrap().buttons ^= 1;
    let error = replayed_own(&rewritten(&log, changed)).unwrap_err();
    assert!(error.to_string().contains("no sample of the tool, or a wrong one"), "{error}");
}

#[test]
fn one_wrong_bit_in_what_a_log_says_about_the_run_is_damage() {
    let folder = folder();
    let log = short(&folder);
    let bytes = std::fs::read(&log).unwrap();
    for word in ["first_tool", "instruction_set", "duration_s"] {
        let mut wrong = bytes.clone();
        let place = wrong.windows(word.len()).position(|window| window == word.as_bytes()).unwrap();
        wrong[place + word.len() + 6] ^= 1;
        std::fs::write(&log, wrong).unwrap();
        let error = replayed(&log).unwrap_err();
        assert!(error.kind() == ErrorKind::Log && error.to_string().contains("a damaged log"), "{error}");
    }
}

fn entries(log: &Path) -> Vec<LogEntry> {
    LogReader::open(log).unwrap().collect::<Result<_, _>>().unwrap()
}

/// The log at `log` written once more, to a file beside it.
fn rewritten(log: &Path, entries: Vec<LogEntry>) -> PathBuf {
    let path = log.with_file_name("rewritten.mcap");
    let mut environment = Environment::default();
    let mut attachments = [None, None];
    for entry in &entries {
        match entry {
            LogEntry::Environment(found) => environment = found.clone(),
            LogEntry::Attachment { name, data } => {
                attachments[usize::from(name == Environment::SESSION)] = Some(String::from_utf8(data.clone()).unwrap());
            }
            _ => {}
        }
    }
    [environment.scene, environment.session] = attachments;
    let mut writer = McapWriter::create(&path, &environment).unwrap();
    for entry in &entries {
        match entry {
            LogEntry::Record(record) => writer.write(record).unwrap(),
            LogEntry::Text(event) => writer.write_text(event).unwrap(),
            LogEntry::Scene(frame) => writer.write_scene(frame).unwrap(),
            LogEntry::Stats(stats) => writer.write_stats(stats).unwrap(),
            LogEntry::Environment(_) | LogEntry::Attachment { .. } => {}
        }
    }
    writer.finish().unwrap();
    path
}

/// A short virtual run of the demo, in contact at its end, with a model that has two rate groups and no third for its basis.
fn short(folder: &tempfile::TempDir) -> PathBuf {
    record(demo(0.5).model(LocalModelKind::Patch).virtual_time(), folder).1
}

fn replayed(log: &Path) -> Result<ReplayReport, Error> {
    Session::replay(log)?.run()
}

fn flip(value: &mut f64, bit: u32) {
    *value = f64::from_bits(value.to_bits() ^ 1 << bit);
}

#[test]
fn a_log_written_once_more_is_as_good() {
    let folder = folder();
    let log = short(&folder);
    let again = rewritten(&log, entries(&log));
    assert_eq!(replayed(&again).unwrap(), replayed(&log).unwrap());
    assert!(replayed(&again).unwrap().is_identical());
}

/// A computed field of a log: topic, name, and the flip of its last bit; false where the record is another one.
type Field = (&'static str, &'static str, fn(&mut LogRecord) -> bool);

macro_rules! field {
    ($topic:literal, $name:literal, $variant:ident, |$r:ident| $change:expr) => {
        ($topic, $name, |record| match record {
            LogRecord::$variant($r) => {
                $change;
                true
            }
            _ => false,
        })
    };
}

const FIELDS: [Field; 29] = [
    field!("/force", "force_n", Force, |r| flip(&mut r.force_n[1], 0)),
    field!("/force", "model_version", Force, |r| r.model_version ^= 1),
    field!("/force", "model_age_s", Force, |r| flip(&mut r.model_age_s, 0)),
    field!("/force", "energy_j", Force, |r| flip(&mut r.energy_j, 0)),
    field!("/force", "time", Force, |r| r.time.0 ^= 1),
    field!("/force_commanded", "force_n", Command, |r| flip(&mut r.force_n[1], 0)),
    field!("/force_commanded", "limits", Command, |r| r.limits ^= 1),
    field!("/force_commanded", "energy_j", Command, |r| flip(&mut r.energy_j, 0)),
    field!("/force_commanded", "tank_j", Command, |r| flip(&mut r.tank_j, 0)),
    field!("/contact", "mode", Contact, |r| r.mode =
        if r.mode == ContactMode::Free { ContactMode::Lost } else { ContactMode::Free }),
    field!("/contact", "triangle", Contact, |r| r.triangle ^= 1),
    field!("/contact", "weights", Contact, |r| flip(&mut r.weights[1], 0)),
    field!("/contact", "normal", Contact, |r| r.normal[2] = -r.normal[2]),
    field!("/contact", "normal_force_n", Contact, |r| r.normal_force_n =
        f32::from_bits(r.normal_force_n.to_bits() ^ 1)),
    field!("/contact", "tangential_force_n", Contact, |r| r.tangential_force_n =
        f32::from_bits(r.tangential_force_n.to_bits() ^ 1)),
    field!("/contact", "area_m2", Contact, |r| r.area_m2 = f32::from_bits(r.area_m2.to_bits() ^ 1)),
    field!("/contact", "count", Contact, |r| r.count ^= 1),
    field!("/resync", "version", Resync, |r| r.version ^= 1),
    field!("/resync", "age", Resync, |r| r.age.0 ^= 1),
    field!("/resync", "jump_before_n", Resync, |r| flip(&mut r.jump_before_n, 0)),
    field!("/resync", "jump_after_n", Resync, |r| flip(&mut r.jump_after_n, 0)),
    field!("/resync", "energy_j", Resync, |r| flip(&mut r.energy_j, 0)),
    field!("/global", "version", Global, |r| r.version ^= 1),
    field!("/global", "first_tick", Global, |r| r.first_tick ^= 1),
    field!("/global", "last_tick", Global, |r| r.last_tick ^= 1),
    field!("/global", "time", Global, |r| r.time.0 ^= 1),
    field!("/probe", "node", Probe, |r| r.node ^= 1),
    field!("/probe", "local_m", Probe, |r| flip(&mut r.local_m[0], 0)),
    field!("/probe", "global_m", Probe, |r| flip(&mut r.global_m[2], 0)),
];

#[test]
fn one_bit_of_any_field_of_one_logged_sample_is_found_at_its_time() {
    let folder = folder();
    let log = short(&folder);
    let whole = entries(&log);
    for (topic, name, change) in FIELDS {
        let mut changed = whole.clone();
        let mut records = changed.iter_mut().filter_map(|entry| match entry {
            LogEntry::Record(record) if record.time() >= Nanos(400_000_000) => Some(record),
            _ => None,
        });
        let time = records.find_map(|record| change(record).then(|| record.time())).unwrap();
        let report = replayed(&rewritten(&log, changed)).unwrap();
        let found = report.first_difference.as_ref().unwrap();
        assert_eq!((found.time, found.topic, found.what), (time, topic, name));
        assert!(!report.is_identical());
        for compared in report.topics() {
            let differing = u64::from(compared.topic == topic);
            assert!(compared.logged > 5, "{report}");
            assert_eq!((compared.computed, compared.identical + differing), (compared.logged, compared.logged));
        }
    }
}

#[test]
fn one_bit_of_one_logged_tool_sample_is_found() {
    let folder = folder();
    let log = short(&folder);
    let time = Nanos(490_000_000);
    let mut changed = entries(&log);
    for entry in &mut changed {
        if let LogEntry::Record(LogRecord::Tool(r)) = entry
            && r.time == time
        {
            flip(&mut r.position_m[2], 30);
        }
    }
    let report = replayed(&rewritten(&log, changed)).unwrap();
    let found = report.first_difference.as_ref().unwrap();
    assert_eq!((found.time, found.topic, found.what), (time, "/force", "force_n"), "{report}");
    assert!(report.force.identical >= 489 && report.force.computed == 500, "{report}");
}

#[test]
fn a_missing_force_is_found() {
    let folder = folder();
    let log = short(&folder);
    for gone in [Nanos(200_000_000), Nanos(500_000_000)] {
        let is_kept = |entry: &LogEntry| !matches!(entry, LogEntry::Record(LogRecord::Force(r)) if r.time == gone);
        let report = replayed(&rewritten(&log, entries(&log).into_iter().filter(is_kept).collect())).unwrap();
        assert_eq!((report.force.logged, report.force.computed), (499, 500));
        assert!(!report.is_identical());
        assert_eq!(report.first_difference.unwrap().time, gone.max(Nanos(gone.0 + 1_000_000).min(Nanos(500_000_000))));
    }
}

/// A change that makes a log incomplete: its name, what the refusal must say, and the change.
type Loss = (&'static str, &'static str, fn(&mut Vec<LogEntry>));

/// Takes away the first or last entry for which it holds.
fn take(entries: &mut Vec<LogEntry>, last: bool, is_it: impl Fn(&LogEntry) -> bool) {
    let place = if last { entries.iter().rposition(is_it) } else { entries.iter().position(is_it) };
    entries.remove(place.expect("there is one"));
}

fn is_timing(entry: &LogEntry, group: u16, tick: u64) -> bool {
    matches!(entry, LogEntry::Record(LogRecord::Tick(r)) if r.group == group && r.tick == tick)
}

fn is_use(entry: &LogEntry, kind: PortUseKind) -> bool {
    matches!(entry, LogEntry::Record(LogRecord::Port(r)) if r.kind == kind)
}

fn is_tool(entry: &LogEntry) -> bool {
    matches!(entry, LogEntry::Record(LogRecord::Tool(_)))
}

fn environment(entries: &mut [LogEntry]) -> &mut Environment {
    let found = entries.iter_mut().rev().find_map(|entry| match entry {
        LogEntry::Environment(environment) => Some(environment),
        _ => None,
    });
    found.unwrap()
}

const LOSSES: [Loss; 14] = [
    ("a local release", "`local` made 501 releases, but 500", |all| take(all, false, |e| is_timing(e, 0, 77))),
    ("the last local release", "`local` made 501 releases", |all| take(all, false, |e| is_timing(e, 0, 500))),
    ("a global release", "`global` made 16 releases", |all| take(all, false, |e| is_timing(e, 1, 7))),
    ("the first use", "uses of ports", |all| take(all, false, |e| is_use(e, PortUseKind::Took))),
    ("the last value taken", "uses of ports", |all| take(all, true, |e| is_use(e, PortUseKind::Took))),
    ("the last samples seen", "uses of ports", |all| take(all, true, |e| is_use(e, PortUseKind::Saw))),
    ("a tool sample", "no sample of the tool", |all| take(all, false, is_tool)),
    ("the last tool sample", "no sample of the tool", |all| take(all, true, is_tool)),
    ("statistics", "statistics of rate group `local`", |all| all.retain(|e| !matches!(e, LogEntry::Stats(_)))),
    ("the session", "no attachment session.toml", |all| {
        all.retain(|e| !matches!(e, LogEntry::Attachment { name, .. } if name == Environment::SESSION));
    }),
    ("the first state", "first state", |all| environment(all).first_tools.clear()),
    ("lost records", "9 records were lost", |all| {
        for entry in all {
            if let LogEntry::Stats(stats) = entry {
                stats.lost_records = 3;
            }
        }
    }),
    ("another instruction set", "instruction set sparc", |all| {
        environment(all).instruction_set = "sparc".into();
    }),
    ("a use twice", "uses of ports", |all| {
        let used = all.iter().find(|e| is_use(e, PortUseKind::Saw)).unwrap().clone();
        all.push(used);
    }),
];

#[test]
fn a_log_that_lacks_anything_is_refused_with_what_it_lacks() {
    let folder = folder();
    let log = short(&folder);
    let whole = entries(&log);
    for (name, says, change) in LOSSES {
        let mut changed = whole.clone();
        change(&mut changed);
        let error = replayed(&rewritten(&log, changed)).unwrap_err();
        let text = error.to_string();
        assert_eq!(error.kind(), ErrorKind::Log, "{name}: {text}");
        assert!(text.contains("rewritten.mcap: ") && text.contains(says) && !text.contains('\n'), "{name}: {text}");
    }
}

// Check that gaps are found by the records' own numbers too, where the sums were made to fit.
#[test]
fn a_gap_is_refused_even_if_the_sums_fit() {
    let folder = folder();
    let log = short(&folder);
    let whole = entries(&log);
    type IsIt = fn(&LogEntry) -> bool;
    let gaps: [(&str, IsIt); 2] =
        [("release 78 of rate group `local`", |e| is_timing(e, 0, 77)), ("`took`", |e| is_use(e, PortUseKind::Took))];
    for (says, is_it) in gaps {
        let mut changed = whole.clone();
        take(&mut changed, false, is_it);
        let count = |group: u16, what: fn(&LogRecord) -> Option<u16>| {
            let records = changed.iter().filter_map(|e| if let LogEntry::Record(r) = e { what(r) } else { None });
            records.filter(|of| *of == group).count() as u64
        };
        let sums: Vec<(u64, u64)> = (0..3)
            .map(|group| {
                let released = count(group, |r| if let LogRecord::Tick(r) = r { Some(r.group) } else { None });
                (released, count(group, |r| if let LogRecord::Port(r) = r { Some(r.group) } else { None }))
            })
            .collect();
        for entry in &mut changed {
            if let LogEntry::Stats(stats) = entry {
                (stats.released, stats.port_uses) = sums[usize::from(stats.group)];
            }
        }
        let text = replayed(&rewritten(&log, changed)).unwrap_err().to_string();
        assert!(text.contains("the recording is not complete") && text.contains(says), "{text}");
    }
}

#[test]
fn a_cut_log_and_a_log_without_ports_are_refused() {
    let folder = folder();
    let log = short(&folder);
    let bytes = std::fs::read(&log).unwrap();
    std::fs::write(&log, &bytes[..bytes.len() * 3 / 4]).unwrap();
    let error = replayed(&log).unwrap_err();
    assert_eq!(error.kind(), ErrorKind::Log);
    assert!(error.to_string().contains("a damaged log cannot be replayed"), "{error}");
    // A file of somebody else's, or of a version before ports were recorded.
    let mut foreign = mcap::Writer::new(std::fs::File::create(&log).unwrap()).unwrap();
    foreign.finish().unwrap();
    let error = replayed(&log).unwrap_err();
    assert!(error.kind() == ErrorKind::Log && error.to_string().contains("no topic /ports"), "{error}");
}

#[test]
fn a_programs_own_body_needs_the_program_and_the_same_session() {
    let folder = folder();
    let (summary, log) = record(own(block()).path(pressing()).duration_s(0.3).virtual_time(), &folder);
    let error = replayed(&log).unwrap_err();
    assert!(error.kind() == ErrorKind::Log && error.to_string().contains("`SessionBuilder::replay`"), "{error}");
    let error = own(block()).friction(0.25).duration_s(0.3).replay(&log).unwrap_err();
    assert_eq!(error.kind(), ErrorKind::Log);
    assert!(error.to_string().contains("`friction = 0.5` was run, this one has `friction = 0.25`"), "{error}");
    assert_identical(&own(block()).duration_s(0.3).replay(&log).unwrap().run().unwrap(), &summary);
}

#[test]
fn devices_that_differ_have_their_own_limits_in_a_replay() {
    let folder = folder();
    let session = || {
        let device = |path, max_force_n| {
            Scripted::new(path).with_capabilities(Capabilities { max_force_n, ..Capabilities::TOUCH })
        };
        let session = own(wide_block()).named_device("left", device(pressing(), 0.1));
        session.named_device("right", device(meeting(), 0.2)).duration_s(0.4)
    };
    let (summary, log) = record(session().virtual_time(), &folder);
    assert!(summary.report.devices.iter().all(|device| device.force.peak_n > 0.2), "{summary}");
    let report = session().replay(&log).unwrap().run().unwrap();
    assert!(report.is_identical() && report.topics().all(Compared::is_identical), "{report}");
}
