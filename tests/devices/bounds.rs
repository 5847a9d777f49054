//! A device that tells what cannot be: no model sees it, the force goes to rest, and the log says what was told.

use crate::session_support::*;
use palpate::actors::Cause;
use palpate::devices::{Capabilities, Device, DeviceFault, DeviceState, ForceCommand, ToolPath};
use palpate::log::LogReader;
use palpate::model::local::Kind;
use palpate::model::{Vec3, turn_of};
use palpate::runtime::Nanos;
use palpate::scene::SafetyStage;
use palpate::session::Session;
use palpate::{Error, ErrorKind};

/// Follows a path, but for some milliseconds in which it tells another place.
#[derive(Debug)]
struct Liar {
    path: ToolPath,
    lie: Vec3,
    ms: std::ops::Range<u64>,
}

impl Device for Liar {
    fn name(&self) -> &str {
        "liar"
    }

    fn capabilities(&self) -> Capabilities {
        Capabilities::TOUCH
    }

    fn read(&mut self, time: Nanos) -> Result<DeviceState, DeviceFault> {
        let truth = Vec3::from(self.path.at(time.as_secs_f64()));
        let position = if self.ms.contains(&(time.0 / 1_000_000)) { self.lie } else { truth };
        Ok(DeviceState { position, ..DeviceState::default() })
    }

    fn write(&mut self, _: ForceCommand) -> Result<(), DeviceFault> {
        Ok(())
    }
}

// Check both bounds: 1000 m is nowhere in a workspace, 5 cm within a millisecond are.
#[test]
fn a_device_that_tells_a_place_where_it_cannot_be_makes_no_force() {
    for lie in [Vec3::new(0.05, 0.05, 1000.0), Vec3::new(0.05, 0.05, -1000.0), Vec3::new(0.05, 0.05, 0.02)] {
        let folder = tempfile::tempdir().unwrap();
        let log = folder.path().join("run.mcap");
        let ms = 300..325;
        let device = Liar { path: pressing(), lie, ms: ms.clone() };
        let session = Session::builder(block()).device(device).model(Kind::Full).friction(0.5).virtual_time();
        let session = session.safety_off([SafetyStage::StartUp]).duration_s(0.6).keep_records().log(&log);
        let summary = session.build().unwrap().run().unwrap();
        assert_eq!(summary.runtime.fault, None);
        let forces = forces(&summary);
        let largest = |part: &[palpate::log::ForceSample]| part.iter().map(|row| norm(row.force_n)).fold(0.0, f64::max);
        let (usual_n, then_n) = (largest(&forces[..299]), largest(&forces[299..350]));
        assert!(usual_n > 0.3 && then_n < 3.0 * usual_n, "{then_n} N, {usual_n} N before");
        let commands = commands(&summary);
        assert!(commands[312..324].iter().all(|row| row.force_n == [0.0; 3]), "the watchdog lets it go");
        assert!(norm(commands[590].force_n) > 0.3, "and takes it up");
        // The log says what was told, and what could have been.
        let words: Vec<String> = LogReader::open(&log).unwrap().map(Result::unwrap).filter_map(told).collect();
        let told = words.iter().find(|words| words.contains("where it cannot be")).expect("an event");
        let [x, y, z]: [f64; 3] = lie.into();
        assert!(told.contains(&format!("it told [{x}, {y}, {z}] m")) && told.contains("at most"), "{told}");
        let describes = |code: u32| Cause::describe(code).is_some_and(|words| words.contains("where it cannot be"));
        assert!(describes(Cause::DeviceImpossible.code()));
    }
}

/// Tells an orientation of `length` from some time on, and exerts torque.
#[derive(Debug)]
struct Crooked {
    length: f64,
    from: Nanos,
}

impl Device for Crooked {
    fn name(&self) -> &str {
        "crooked"
    }

    fn capabilities(&self) -> Capabilities {
        Capabilities { max_torque_n_m: Some(0.1), ..Capabilities::TOUCH }
    }

    fn read(&mut self, time: Nanos) -> Result<DeviceState, DeviceFault> {
        let length = if time >= self.from { self.length } else { 1.0 };
        let orientation = turn_of([0.6 * length, 0.0, 0.8 * length, 0.0]);
        Ok(DeviceState { position: Vec3::new(0.05, 0.05, 0.2), orientation, ..DeviceState::default() })
    }

    fn write(&mut self, command: ForceCommand) -> Result<(), DeviceFault> {
        if command.is_finite() { Ok(()) } else { Err(DeviceFault::Refused) }
    }
}

// Check that few digits of an orientation are made of length one, and that four numbers that are no turn are a fault.
#[test]
fn an_orientation_is_a_turn_or_no_state() {
    let turned = turn_of([0.6, 0.0, 0.8, 0.0]);
    for (length, is_turn) in [(1.0005, true), (1.01, false)] {
        let device = Crooked { length, from: Nanos(50_500_000) };
        let session = Session::builder(block()).device(device).model(Kind::Full).virtual_time();
        let summary = session.duration_s(0.1).keep_records().build().unwrap().run().unwrap();
        let told: Vec<_> = summary
            .records
            .iter()
            .filter_map(|record| match record {
                palpate::log::LogRecord::Tool(row) => Some(row.orientation),
                _ => None,
            })
            .collect();
        assert!(told.iter().all(|turn| turn.angle_to(&turned) < 1e-7 && (turn.norm() - 1.0).abs() < 1e-12));
        assert!(told.len() > 100);
        assert_eq!(summary.runtime.groups[0].degraded == 0, is_turn, "{length}");
        assert!(commands(&summary).iter().all(|row| row.torque_n_m == [0.0; 3]));
    }
    let error = refused(Session::builder(block()).device(Crooked { length: 0.5, from: Nanos::ZERO }));
    assert_eq!(error.kind(), ErrorKind::Device);
    assert!(error.to_string().contains("orientation") && error.to_string().contains("length 1"), "{error}");
}

fn told(entry: palpate::log::LogEntry) -> Option<String> {
    match entry {
        palpate::log::LogEntry::Text(text) => Some(text.message),
        _ => None,
    }
}

fn refused(session: palpate::session::SessionBuilder) -> Error {
    match session.virtual_time().duration_s(0.01).build() {
        Err(error) => error,
        Ok(session) => session.run().expect_err("it is refused"),
    }
}

#[test]
fn a_path_in_millimetres_is_refused_with_its_place_and_the_reach() {
    let path = pressing();
    let positions = path.positions_m().iter().map(|place| place.map(|c| 1e3 * c)).collect();
    let large = ToolPath::new(path.times_s().to_vec(), positions).unwrap();
    let error = refused(Session::builder(block()).path(large));
    assert_eq!((error.kind(), error.place()), (ErrorKind::Scene, "path()"));
    assert!(error.to_string().contains("the device reaches 0.960 m: is the path in metres?"), "{error}");
}

#[test]
fn a_device_that_begins_a_kilometre_away_is_not_started() {
    for (far_m, words) in [(1e4, "must lie within 1000 m"), (1e3, "and it reaches 0.600 m"), (1.1, "1.00")] {
        let far = Vec3::new(0.0, 0.0, far_m);
        let device = Liar { path: ToolPath::constant(far.into()).unwrap(), lie: far, ms: 0..0 };
        let error = refused(Session::builder(block()).device(device));
        assert_eq!(error.kind(), ErrorKind::Device);
        assert!(error.to_string().contains(words), "{error}");
    }
}

#[test]
fn a_view_tells_the_computed_force_from_the_one_that_the_hand_feels() {
    let session = Session::builder(block()).path(pressing()).virtual_time().duration_s(0.2).keep_records();
    let mut running = session.build().unwrap().start().unwrap();
    let mut viewer = running.take_viewer().unwrap();
    running.wait_for(std::time::Duration::from_millis(150));
    let tool = viewer.tool();
    let summary = running.stop();
    let computed = forces(&summary).into_iter().find(|row| row.time == tool.time).unwrap();
    let commanded = commands(&summary).into_iter().find(|row| row.time == tool.time).unwrap();
    assert_eq!(<[f64; 3]>::from(tool.computed_force), computed.force_n);
    assert_eq!(<[f64; 3]>::from(tool.commanded_force), commanded.force_n);
    assert_eq!((tool.computed_torque, tool.commanded_torque), (Vec3::zeros(), Vec3::zeros()), "a point has none");
    // The force comes in over two seconds.
    assert!(norm(commanded.force_n) < 0.1 * norm(computed.force_n), "{commanded:?} of {computed:?}");
}
