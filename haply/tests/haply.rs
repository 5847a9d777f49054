//! The Haply client against the mock service over loopback: pace, faults, safety events, and what it costs.

use std::fmt::Write as _;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};

use palpate::ErrorKind;
use palpate::devices::conformance::{Conformance, Verdict};
use palpate::devices::{Calibration, Capabilities, ForceCommand, SafetyStop};
use palpate::model::wxyz;
use palpate::prelude::*;
use palpate::runtime::{Actor, Execution, Outcome, RateGroup, Runtime, TickContext};
use palpate_haply::mock::{MockFault, MockFaultKind, MockOptions, MockService};
use palpate_haply::{Haply, HaplyCounts, HaplyOptions};
use tracing::field::{Field, Visit};
use tracing::{Event, Metadata, Subscriber, span};

#[path = "../../tests/hot_path_support/allocator.rs"]
mod allocator;

#[global_allocator]
static GUARDED: allocator::Guarded = allocator::Guarded;

const MS: Duration = Duration::from_millis(1);

/// Longer than anything here takes on a machine that does other things too.
const PATIENCE: Duration = Duration::from_secs(30);

fn service() -> MockService {
    MockService::start(MockOptions { port: 0, events_port: 0, ..MockOptions::default() }).unwrap()
}

fn options(service: &MockService) -> HaplyOptions {
    let (address, events_address) = (service.address(), Some(service.events_address()));
    HaplyOptions { address, events_address, ..HaplyOptions::new(3.0) }
}

/// A force for 0.1 s from the last read, all of which have been for time zero.
fn force(x: f64, y: f64, z: f64) -> ForceCommand {
    ForceCommand::until(Vec3::new(x, y, z), Nanos(100_000_000))
}

/// One tick, at least a millisecond long: reads, commands 1 N upwards. Gives what was sent, and why it was less.
fn tick(device: &mut Haply) -> (f64, Option<DeviceFault>) {
    std::thread::sleep(MS);
    let _ = device.read(Nanos::ZERO);
    let fault = device.write(force(0.0, 0.0, 1.0)).err();
    (device.commanded_n()[2], fault)
}

/// Ticks until `device` exerts the whole force.
fn engage(device: &mut Haply) {
    let begun = Instant::now();
    while tick(device).0 < 0.999 {
        assert!(begun.elapsed() < PATIENCE, "the force does not come: {:?}", device.counts());
    }
}

/// What the crate has said to the program's log, a line per event.
static SAID: Mutex<String> = Mutex::new(String::new());

fn said() -> MutexGuard<'static, String> {
    // A test that fails while it holds the text has not harmed it.
    SAID.lock().unwrap_or_else(PoisonError::into_inner)
}

struct Listener;

impl Subscriber for Listener {
    fn enabled(&self, metadata: &Metadata<'_>) -> bool {
        metadata.target().starts_with("palpate_haply")
    }
    fn new_span(&self, _: &span::Attributes<'_>) -> span::Id {
        span::Id::from_u64(1)
    }
    fn record(&self, _: &span::Id, _: &span::Record<'_>) {}
    fn record_follows_from(&self, _: &span::Id, _: &span::Id) {}
    fn event(&self, event: &Event<'_>) {
        struct Text<'a>(&'a mut String);
        impl Visit for Text<'_> {
            fn record_debug(&mut self, _: &Field, value: &dyn std::fmt::Debug) {
                let _ = writeln!(self.0, "{value:?}");
            }
        }
        event.record(&mut Text(&mut said()));
    }
    fn enter(&self, _: &span::Id) {}
    fn exit(&self, _: &span::Id) {}
}

/// Waits until the log says `text` about the service at `address`.
fn hears(address: &str, text: &str) {
    let begun = Instant::now();
    let is_said = || said().lines().any(|line| line.contains(address) && line.contains(text));
    while !is_said() {
        assert!(begun.elapsed() < PATIENCE, "nobody says {text:?} of {address}: {}", said());
        std::thread::sleep(MS);
    }
}

/// A fault of the service: the force is zero within 3 ticks, the log says why, and the force comes back over a new connection.
fn ends_in_zero_force_and_comes_back(kind: MockFaultKind, message: &str) {
    let _ = tracing::subscriber::set_global_default(Listener);
    let service = service();
    let mut device = Haply::connect(options(&service)).unwrap();
    engage(&mut device);
    service.fail(kind);
    // It begins with the next command that the service reads: at the latest with that of the first of these ticks.
    let after: Vec<f64> = (0..20).map(|_| tick(&mut device).0).collect();
    let zero_from = after.iter().rposition(|force| *force != 0.0).map_or(0, |last| last + 1);
    assert!(zero_from <= 3, "{kind:?}: {after:?}");
    // Check the same at the other end: after the command with which it began, the third is zero at the latest
    let received = service.forces_since_fault_n();
    assert!(received.iter().skip(2).all(|force| force[2] == 0.0), "{kind:?}: {received:?}");
    if kind != MockFaultKind::Vanish {
        assert!(!received.is_empty(), "{kind:?}");
    }

    engage(&mut device);
    hears(&service.address(), message);
    hears(&service.address(), "connected to the service at");
    let counts = device.counts();
    assert!(counts.reconnects >= 1, "{kind:?}: {counts:?}");
    assert!(kind != MockFaultKind::Silent || counts.lost >= 1, "{kind:?}: {counts:?}");
    let seen = service.counts();
    assert_eq!((seen.conflicts, seen.malformed), (0, 0));
    assert!(seen.connections >= 2 && seen.sessions >= 2, "each connection begins with its session: {seen:?}");
}

// Check that the tool is turned as the grip of the service, and not turned without a grip.
#[test]
fn a_grip_turns_the_tool() {
    for grip in [None, Some([0.6, 0.0, -0.8, 0.0])] {
        let service =
            MockService::start(MockOptions { port: 0, events_port: 0, grip, ..MockOptions::default() }).unwrap();
        let mut device = Haply::connect(options(&service)).unwrap();
        let begun = Instant::now();
        let state = loop {
            if let Ok(state) = device.read(Nanos::ZERO) {
                break state;
            }
            assert!(begun.elapsed() < PATIENCE, "no state comes");
            tick(&mut device);
        };
        assert_eq!(wxyz(&state.orientation), grip.unwrap_or([1.0, 0.0, 0.0, 0.0]));
        assert_eq!((state.upright(), device.capabilities().max_torque_n_m), (Some(state), None));
    }
}

#[test]
fn a_silent_service_ends_in_zero_force_within_three_ticks_and_is_connected_again() {
    ends_in_zero_force_and_comes_back(MockFaultKind::Silent, "is too late with its replies, or silent");
}

#[test]
fn a_slow_service_ends_in_zero_force_within_three_ticks_and_is_connected_again() {
    ends_in_zero_force_and_comes_back(MockFaultKind::Slow, "is too late with its replies, or silent");
}

#[test]
fn a_service_that_sends_garbage_ends_in_zero_force_within_three_ticks_and_is_connected_again() {
    ends_in_zero_force_and_comes_back(MockFaultKind::Garbage, "sent something that is no state");
}

#[test]
fn a_service_that_vanishes_ends_in_zero_force_within_three_ticks_and_is_connected_again() {
    ends_in_zero_force_and_comes_back(MockFaultKind::Vanish, "closed the connection");
}

#[test]
fn every_safety_event_and_every_status_stops_the_force_and_its_end_lets_it_back() {
    let service = service();
    let mut device = Haply::connect(options(&service)).unwrap();
    for (kind, expected) in [
        (MockFaultKind::Ebrake, DeviceFault::SafetyStop(SafetyStop::EmergencyBrake)),
        (MockFaultKind::Fod, DeviceFault::SafetyStop(SafetyStop::Other)),
        (MockFaultKind::Stall, DeviceFault::SafetyStop(SafetyStop::Stall)),
        (MockFaultKind::Ceiling, DeviceFault::SafetyStop(SafetyStop::Unstable)),
        (MockFaultKind::Unknown, DeviceFault::SafetyStop(SafetyStop::Other)),
        (MockFaultKind::Unplug, DeviceFault::Disconnected),
        (MockFaultKind::Busy, DeviceFault::Busy),
        (MockFaultKind::Uncalibrated, DeviceFault::NotReady),
        (MockFaultKind::Unready, DeviceFault::NotReady),
    ] {
        engage(&mut device);
        service.fail(kind);
        let begun = Instant::now();
        loop {
            let (force, fault) = tick(&mut device);
            if fault == Some(expected) {
                // Check that the tick that knows of it commands nothing
                assert_eq!(force, 0.0, "{kind:?}");
                break;
            }
            assert!(begun.elapsed() < PATIENCE, "{kind:?} is not heard of, {fault:?}");
        }
    }
    engage(&mut device);
    assert_eq!(service.counts().connections, device.counts().reconnects + 1);
}

#[test]
fn no_force_that_is_not_finite_or_above_the_limit_reaches_the_service() {
    let service = service();
    let mut device = Haply::connect(options(&service)).unwrap();
    engage(&mut device);
    service.fail(MockFaultKind::Stall);
    for bad in [f64::NAN, f64::INFINITY, 1e300, -4.0] {
        std::thread::sleep(MS);
        let _ = device.read(Nanos::ZERO);
        let taken = device.write(force(bad, 0.0, 0.0));
        assert!(bad.is_finite() || taken == Err(DeviceFault::Refused), "{bad}: {taken:?}");
        assert!(bad.is_finite() || device.commanded_n() == [0.0; 3], "{bad}: {:?}", device.commanded_n());
        assert!(device.commanded_n()[0].abs() <= 3.0, "{bad}: {:?}", device.commanded_n());
    }
    std::thread::sleep(50 * MS);
    assert_eq!(service.counts().malformed, 0);
    assert!(service.forces_since_fault_n().iter().flatten().all(|c| c.abs() <= 3.0));
}

/// The device as an actor that counts.
struct Counting {
    device: Haply,
    counts: Arc<Mutex<HaplyCounts>>,
}

impl Actor for Counting {
    fn name(&self) -> &str {
        "counting"
    }
    fn wait(&mut self, timeout: Nanos) -> bool {
        self.device.wait(timeout.to_duration())
    }
    fn tick(&mut self, ctx: &TickContext) -> Outcome {
        let _ = self.device.read(ctx.scheduled);
        let expires = ctx.scheduled + Nanos(100_000_000);
        match self.device.write(ForceCommand::until(Vec3::new(0.0, 0.0, 1.0), expires)) {
            Ok(()) => Outcome::Continue,
            Err(fault) => Outcome::Degraded(fault.code()),
        }
    }
    fn stop(&mut self, _: &TickContext) {
        *self.counts.lock().unwrap() = self.device.counts();
    }
}

#[test]
fn five_seconds_at_1_khz_lose_no_command() {
    let service = service();
    let counts: Arc<Mutex<HaplyCounts>> = Arc::default();
    let actor = Counting { device: Haply::connect(options(&service)).unwrap(), counts: Arc::clone(&counts) };
    let group = RateGroup::hz(1000).name("haptic").realtime(80).device_paced(Nanos(3_000_000));
    let graph =
        Runtime::builder(Execution::Threaded).group(group, vec![Box::new(actor)]).until(Nanos(5_000_000_000)).build();
    let running = graph.unwrap().start().unwrap();
    running.wait_for(PATIENCE);
    let report = running.stop();
    let (counts, group) = (*counts.lock().unwrap(), &report.groups[0]);
    println!("{report}\n{counts:?}\n{:?}", service.counts());
    assert_eq!((&report.fault, group.elapsed_periods), (&None, 5001));
    // Check that every command was answered but those under way at the end
    assert_eq!(counts.lost, 0);
    assert!(counts.commands - counts.replies <= 4, "{counts:?}");
    // Check that there is one command per release; only where a reply was missing there is a zero more, or none
    assert!(counts.stale > 0 || counts.commands >= group.released, "{counts:?}");
    assert!(
        counts.commands <= group.released + counts.stale + counts.reconnects + group.skipped + 2,
        "{counts:?} {report}"
    );
    let seen = service.counts();
    assert_eq!((seen.conflicts, seen.malformed, seen.replies), (0, 0, seen.messages));
}

#[test]
fn a_tick_allocates_nothing() {
    let service = service();
    let mut device = Haply::connect(options(&service)).unwrap();
    engage(&mut device);
    let replies = device.counts().replies;
    allocator::arm();
    for _ in 0..500 {
        let _ = device.wait(20 * MS);
        let _ = device.read(Nanos::ZERO);
        let _ = device.write(force(0.1, 0.0, 0.5));
    }
    allocator::disarm();
    assert!(device.counts().replies > replies + 100, "{:?}", device.counts());
}

#[test]
fn a_device_that_is_not_calibrated_is_not_read_and_no_session_starts_on_it() {
    let fault = Some(MockFault { kind: MockFaultKind::Uncalibrated, after: 0 });
    let service = MockService::start(MockOptions { port: 0, events_port: 0, fault, ..MockOptions::default() }).unwrap();
    let body = Block::builder([8; 3], [0.1; 3]).build().unwrap();
    let device = Haply::connect(options(&service)).unwrap();
    let started = Session::builder(body).device(device).duration_s(0.1).build().and_then(Session::run);
    let text = started.unwrap_err().to_string();
    assert!(text.contains("it is not calibrated: calibrate it"), "{text}");

    let mut device = Haply::connect(options(&service)).unwrap();
    assert_eq!(device.calibration(), Calibration::Needed);
    assert_eq!(device.read(Nanos::ZERO), Err(DeviceFault::NotReady));
    // Calibrated meanwhile
    engage(&mut device);
    assert_eq!(device.calibration(), Calibration::Done);
}

/// The tick goes on, and nobody writes: the force is held, then gone by the client's own clock.
#[test]
fn a_force_is_held_until_it_expires_and_no_longer() {
    let service = service();
    let mut device = Haply::connect(options(&service)).unwrap();
    engage(&mut device);
    device.read(Nanos::ZERO).ok();
    let expires = Instant::now() + 50 * MS;
    device.write(ForceCommand::until(Vec3::z(), Nanos(50_000_000))).ok();
    loop {
        std::thread::sleep(MS);
        let asked = Instant::now();
        // The reads' clock stands still.
        let _ = device.read(Nanos::ZERO);
        if device.commanded_n() == [0.0; 3] {
            break;
        }
        assert!(asked < expires, "a read {:?} after the expiry", asked - expires);
    }
    // And by the clock of the reads, which is ahead here
    engage(&mut device);
    let _ = device.write(ForceCommand::until(Vec3::z(), Nanos(50_000_000)));
    std::thread::sleep(MS);
    let _ = device.read(Nanos(50_000_000));
    assert_eq!((device.commanded_n(), device.exerted()), ([0.0; 3], Some(Vec3::zeros())));
}

/// The tick itself is caught somewhere: the watch says zero.
#[test]
fn a_force_ends_at_its_expiry_though_nobody_calls_the_device_any_more() {
    let service = service();
    let mut device = Haply::connect(options(&service)).unwrap();
    engage(&mut device);
    // From here on the service keeps what it receives.
    service.fail(MockFaultKind::Unready);
    let begun = Instant::now();
    while tick(&mut device).1 != Some(DeviceFault::NotReady) {
        assert!(begun.elapsed() < PATIENCE, "{:?}", device.counts());
    }
    engage(&mut device);
    let begun = Instant::now();
    while service.forces_since_fault_n().last() != Some(&[0.0; 3]) {
        assert!(begun.elapsed() < PATIENCE, "{:?}", service.forces_since_fault_n().last());
        std::thread::sleep(MS);
    }
    // Check that the zero is known of, and that its reply is not taken for one to another command
    let begun = Instant::now();
    loop {
        std::thread::sleep(20 * MS);
        let _ = device.read(Nanos::ZERO);
        assert_eq!(device.commanded_n(), [0.0; 3]);
        let (counts, messages) = (device.counts(), service.counts().messages);
        // That of the read itself is under way.
        let unanswered = counts.commands - counts.replies - counts.lost;
        if unanswered <= 1 && counts.commands.saturating_sub(messages) <= 1 {
            break;
        }
        assert!(begun.elapsed() < PATIENCE, "{counts:?}, {messages} messages");
    }
    engage(&mut device);
}

/// A device whose reads come when their time has come, as those of a run do: it has a clock of its own.
#[derive(Debug)]
struct InItsTime {
    device: Haply,
    service: Option<MockService>,
    begun: Option<Instant>,
}

impl Device for InItsTime {
    fn name(&self) -> &str {
        self.device.name()
    }
    fn capabilities(&self) -> Capabilities {
        self.device.capabilities()
    }
    fn calibration(&self) -> Calibration {
        self.device.calibration()
    }
    fn wait(&mut self, timeout: Duration) -> bool {
        self.device.wait(timeout)
    }
    fn read(&mut self, time: Nanos) -> Result<DeviceState, DeviceFault> {
        let due = *self.begun.get_or_insert_with(Instant::now) + time.to_duration();
        std::thread::sleep(due.saturating_duration_since(Instant::now()));
        self.device.read(time)
    }
    fn write(&mut self, command: ForceCommand) -> Result<(), DeviceFault> {
        self.device.write(command)
    }
    fn exerted(&self) -> Option<Vec3> {
        self.device.exerted()
    }
}

#[test]
fn it_conforms_and_everything_about_it_can_be_seen() {
    let make = || {
        let service = service();
        let mut device = Haply::connect(options(&service)).unwrap();
        // So that forces act from the first on.
        engage(&mut device);
        InItsTime { device, service: Some(service), begun: None }
    };
    let report = Conformance::check_disconnecting(make, |device| device.service = None);
    println!("{report}");
    assert!(report.checks.iter().all(|check| check.verdict == Verdict::Passed), "{report}");
}

#[test]
fn it_says_no_more_of_itself_than_is_known() {
    let service = service();
    let device = Haply::connect(options(&service)).unwrap();
    assert_eq!(device.capabilities(), Capabilities { max_force_n: 3.0, ..Capabilities::default() });
    assert!(device.exerts_force());
}

#[test]
fn what_cannot_be_connected_to_is_said_in_one_line() {
    let error = |options: HaplyOptions| {
        let error = Haply::connect(options).unwrap_err();
        assert_eq!(error.kind(), ErrorKind::Device);
        let text = error.to_string();
        assert!(text.starts_with("haply: ") && !text.contains('\n'), "{text}");
        text
    };
    let service = service();
    let nobody = HaplyOptions { address: "127.0.0.1:1".to_owned(), ..options(&service) };
    assert!(error(nobody).contains("the service at 127.0.0.1:1 does not answer"));
    let no_events = HaplyOptions { events_address: Some("127.0.0.1:1".to_owned()), ..options(&service) };
    assert!(error(no_events).contains("the events channel at 127.0.0.1:1 does not answer"));
    let other = HaplyOptions { device_id: Some("FFFF".to_owned()), ..options(&service) };
    assert!(error(other).contains("has no device \"FFFF\", it has [\"049D\"]"));
    let escape = HaplyOptions { profile: "a\"b".to_owned(), ..options(&service) };
    assert!(error(escape).contains("profile is"));
    assert!(error(HaplyOptions { max_force_n: f64::NAN, ..options(&service) }).contains("max_force_n is NaN"));
}

#[test]
fn a_session_is_released_by_the_service_and_feels_the_block() {
    let service = service();
    let origin_m = Vec3::new(0.05, 0.15, -0.045);
    let device = Haply::connect(HaplyOptions { origin_m, ..options(&service) }).unwrap();
    let body = Block::builder([8; 3], [0.1; 3]).build().unwrap();
    let session = Session::builder(body)
        .device(device)
        .model(palpate::model::local::Kind::Patch)
        .local(RateGroup::hz(1000).realtime(80).device_paced(Nanos(3_000_000)))
        .duration_s(3.0)
        .keep_records()
        .build()
        .unwrap();
    let summary = session.run().unwrap();
    let forces: Vec<f64> = summary
        .records
        .iter()
        .filter_map(|record| match record {
            palpate::log::LogRecord::Command(sample) => Some(sample.force_n[2]),
            _ => None,
        })
        .collect();
    // The mock's hand is down to 1.5 cm below the top after 2 s: the block pushes it up.
    assert!(forces.iter().copied().fold(0.0, f64::max) > 0.05, "{summary}");
    let seen = service.counts();
    assert!(seen.commands > 500 && seen.conflicts == 0 && seen.malformed == 0, "{seen:?}");
    // Check that the session's last word was zero
    assert_eq!(service.applied_n(), [0.0; 3]);
}

fn scene(address: &str, events_address: &str, more: &str) -> Result<palpate::scene::Scene, Error> {
    let addresses = format!("max_force_n = 3.0\naddress = \"{address}\"\nevents_address = \"{events_address}\"");
    let text = include_str!("../../scenes/haply.toml")
        .replace("max_force_n = 3.0", &addresses)
        .replace("kind = \"haply\"", &format!("kind = \"haply\"\n{more}"))
        .replace("duration_s = 10.0", "duration_s = 1.0");
    palpate::scene::Scene::from_toml(&text, "haply.toml", None)
}

#[test]
fn a_scene_names_the_service_and_its_device_releases_the_haptic_group() {
    let service = service();
    let scene = scene(&service.address(), &service.events_address(), "").unwrap();
    let summary = Session::from_scene(scene).open_haply_with(palpate_haply::open).build().unwrap().run().unwrap();
    let local = &summary.runtime.groups[0];
    // One second, and the time in which the force goes to rest
    assert!(summary.runtime.fault.is_none() && local.elapsed_periods >= 1001, "{summary}");
    let seen = service.counts();
    assert_eq!((seen.conflicts, seen.malformed), (0, 0));
    assert!(seen.sessions >= 1 && seen.sessions <= seen.connections, "{seen:?}");
    // Check that the service's replies released it: late replies are the only reason for less than one command each
    assert!(seen.commands > local.released / 2, "{seen:?} {summary}");
}

#[test]
fn a_scene_that_cannot_reach_or_cannot_have_the_device_is_refused_in_one_line() {
    let reached = Session::from_scene(scene("127.0.0.1:1", "", "").unwrap())
        .open_haply_with(palpate_haply::open)
        .build()
        .unwrap_err()
        .to_string();
    assert!(reached.starts_with("haply: the service at 127.0.0.1:1 does not answer"), "{reached}");
    let simulated = Session::from_scene(scene("127.0.0.1:1", "", "").unwrap())
        .open_haply_with(palpate_haply::open)
        .virtual_time()
        .build()
        .unwrap_err();
    assert!(simulated.to_string().contains("device.kind: is \"haply\", a device that is really there"), "{simulated}");
    let glued = scene("127.0.0.1:1", "", "attach_node = [5, 5, 11]").unwrap_err().to_string();
    assert!(glued.contains("device.attach_node: glues a tool"), "{glued}");
}
