//! The topic `/scene`: pictures at 30 Hz, in the order of time, that agree with the records beside them; and a log that is
//! never far behind its run.

use std::path::{Path, PathBuf};

use palpate::log::{LogEntry, LogReader, LogRecord};
use palpate::model::Vec3;
use palpate::model::contact::ToolShape;
use palpate::model::local::Kind as LocalModelKind;
use palpate::runtime::{Nanos, Rate};
use palpate::scene::Scene;
use palpate::session::{Session, SessionBuilder};
use prost::Message;

/// `foxglove.Vector3` and `foxglove.Point3`.
#[derive(Clone, PartialEq, Message)]
struct Vector {
    #[prost(double, tag = 1)]
    x: f64,
    #[prost(double, tag = 2)]
    y: f64,
    #[prost(double, tag = 3)]
    z: f64,
}

#[derive(Clone, PartialEq, Message)]
struct Pose {
    #[prost(message, optional, tag = 1)]
    position: Option<Vector>,
}

#[derive(Clone, PartialEq, Message)]
struct Arrow {
    #[prost(message, optional, tag = 1)]
    pose: Option<Pose>,
    #[prost(double, tag = 2)]
    shaft_length: f64,
    #[prost(double, tag = 4)]
    head_length: f64,
}

#[derive(Clone, PartialEq, Message)]
struct Sphere {
    #[prost(message, optional, tag = 1)]
    pose: Option<Pose>,
    #[prost(message, optional, tag = 2)]
    size: Option<Vector>,
}

#[derive(Clone, PartialEq, Message)]
struct Cylinder {
    #[prost(message, optional, tag = 2)]
    size: Option<Vector>,
}

#[derive(Clone, PartialEq, Message)]
struct Triangles {
    #[prost(message, repeated, tag = 2)]
    points: Vec<Vector>,
    #[prost(fixed32, repeated, tag = 5)]
    indices: Vec<u32>,
}

/// The part of `foxglove.SceneEntity` that is looked at, by its well-known numbers.
#[derive(Clone, PartialEq, Message)]
struct Entity {
    #[prost(string, tag = 3)]
    id: String,
    #[prost(message, repeated, tag = 7)]
    arrows: Vec<Arrow>,
    #[prost(message, repeated, tag = 9)]
    spheres: Vec<Sphere>,
    #[prost(message, repeated, tag = 10)]
    cylinders: Vec<Cylinder>,
    #[prost(message, repeated, tag = 12)]
    triangles: Vec<Triangles>,
}

#[derive(Clone, PartialEq, Message)]
struct Update {
    #[prost(message, repeated, tag = 2)]
    entities: Vec<Entity>,
}

impl Update {
    fn entity(&self, id: &str) -> &Entity {
        self.entities.iter().find(|entity| entity.id == id).unwrap()
    }
}

/// The pictures of a log with their times.
fn pictures(log: &Path) -> Vec<(u64, Update)> {
    let bytes = std::fs::read(log).unwrap();
    let messages = mcap::MessageStream::new(&bytes).unwrap().map(Result::unwrap);
    let of_scene = messages.filter(|message| message.channel.topic == "/scene");
    of_scene.map(|message| (message.log_time, Update::decode(&*message.data).unwrap())).collect()
}

/// Of every message, as they lie in the file.
fn log_times(log: &Path) -> Vec<u64> {
    let bytes = std::fs::read(log).unwrap();
    mcap::MessageStream::new(&bytes).unwrap().map(|message| message.unwrap().log_time).collect()
}

fn record(entry: LogEntry) -> Option<LogRecord> {
    if let LogEntry::Record(record) = entry { Some(record) } else { None }
}

fn records(log: &Path) -> Vec<LogRecord> {
    LogReader::open(log).unwrap().map(Result::unwrap).filter_map(record).collect()
}

fn recorded(builder: SessionBuilder, folder: &tempfile::TempDir) -> PathBuf {
    let log = folder.path().join("run.mcap");
    let summary = builder.virtual_time().log(&log).build().unwrap().run().unwrap();
    assert!(summary.log_error.is_none(), "{summary}");
    log
}

fn demo(seconds: f64) -> SessionBuilder {
    Session::from_scene(Scene::demo()).duration_s(seconds)
}

#[test]
fn a_log_has_no_scene_unless_it_is_asked_for() {
    let folder = tempfile::tempdir().unwrap();
    let log = recorded(demo(0.2), &folder);
    let mut reader = LogReader::open(&log).unwrap();
    assert!(reader.by_ref().all(|entry| entry.is_ok()));
    assert!(reader.topics().contains_key("/tool") && !reader.topics().contains_key("/scene"));
}

#[test]
fn pictures_come_thirty_times_a_second_and_agree_with_the_records() {
    for model in [LocalModelKind::Patch, LocalModelKind::Full] {
        let folder = tempfile::tempdir().unwrap();
        let log = recorded(demo(1.5).model(model).log_scene(), &folder);
        assert!(log_times(&log).is_sorted(), "records, pictures and statistics, chunk after chunk");
        let pictures = pictures(&log);
        let release = |k: usize| Rate::hz(30).release(k as u64).0;
        let times: Vec<u64> = pictures.iter().map(|(time, _)| *time).collect();
        assert_eq!(times, (0..=45).map(release).collect::<Vec<_>>());

        let records = records(&log);
        let mut pressed = 0;
        for (time, update) in &pictures {
            let until = |record: &&LogRecord| record.time().0 <= *time;
            let mut tool = records.iter().filter(until).filter_map(|record| match record {
                LogRecord::Tool(sample) => Some(sample.position_m),
                _ => None,
            });
            let mut force = records.iter().filter(until).filter_map(|record| match record {
                LogRecord::Force(sample) => Some(sample.force_n),
                _ => None,
            });
            let (tool, force) = (tool.next_back().unwrap(), force.next_back().unwrap_or_default());
            let length = 0.02 * force.iter().map(|f| f * f).sum::<f64>().sqrt();
            let arrow = &update.entity("force").arrows[0];
            let sphere = &update.entity("tool").spheres[0];
            for pose in [&arrow.pose, &sphere.pose] {
                let at = pose.as_ref().unwrap().position.as_ref().unwrap();
                assert_eq!([at.x, at.y, at.z], tool, "at {time}");
            }
            assert!((arrow.shaft_length + arrow.head_length - length).abs() < 1e-12, "at {time}");
            pressed += usize::from(length > 1e-4);
        }
        assert!(pressed > 10, "the tool presses: {pressed}");

        // All corners of a block of 12 nodes an edge, shared: its surface has no nodes inside.
        let first = &pictures[0].1.entity("surface").triangles[0];
        assert_eq!((first.points.len(), first.indices.len()), (12 * 12 * 12 - 10 * 10 * 10, 3 * 2 * 6 * 11 * 11));
        for (_, update) in &pictures {
            let mesh = &update.entity("surface").triangles[0];
            assert_eq!(mesh.indices, first.indices);
            assert!(mesh.indices.iter().all(|&index| (index as usize) < mesh.points.len()));
        }
        let last = &pictures[45].1.entity("surface").triangles[0];
        let moved = |(a, b): (&Vector, &Vector)| (a.x - b.x).hypot(a.y - b.y).hypot(a.z - b.z);
        let dent = first.points.iter().zip(&last.points).map(moved).fold(0.0, f64::max);
        assert!(dent > 1e-3, "the surface follows: {dent} m");
    }
}

#[test]
fn every_device_has_a_tool_and_a_force_of_its_own() {
    let folder = tempfile::tempdir().unwrap();
    let scene = Scene::load(&Path::new(env!("CARGO_MANIFEST_DIR")).join("scenes/two_hands.toml")).unwrap();
    let names: Vec<_> = scene.devices.iter().map(|device| device.name.clone().unwrap()).collect();
    let builder = Session::from_scene(scene).model(LocalModelKind::Patch).duration_s(0.3).log_scene();
    let pictures = pictures(&recorded(builder, &folder));
    let mut expected = vec!["surface".to_owned()];
    expected.extend(names.iter().flat_map(|name| [format!("{name}/tool"), format!("{name}/force")]));
    for (_, update) in &pictures {
        let ids: Vec<_> = update.entities.iter().map(|entity| entity.id.clone()).collect();
        assert_eq!(ids, expected);
    }
}

#[test]
fn a_tool_with_a_shape_is_drawn_in_its_size_and_the_log_says_which_it_is() {
    let sphere = ToolShape::Sphere { radius: 0.004 };
    let capsule = ToolShape::Capsule { radius: 0.003, half_axis: Vec3::new(0.0, 0.01, 0.0) };
    for (shape, sizes) in [(sphere, &[0.008][..]), (capsule, &[0.006, 0.006][..])] {
        let folder = tempfile::tempdir().unwrap();
        let log = recorded(demo(0.2).model(LocalModelKind::Patch).tool(shape).log_scene(), &folder);
        for (time, update) in &pictures(&log) {
            let drawn = update.entity("tool");
            let diameters: Vec<f64> = drawn.spheres.iter().map(|ball| ball.size.as_ref().unwrap().x).collect();
            assert_eq!(diameters, sizes, "at {time}");
            let lengths: Vec<f64> = drawn.cylinders.iter().map(|cylinder| cylinder.size.as_ref().unwrap().z).collect();
            assert_eq!(lengths, if shape == capsule { vec![0.02] } else { vec![] }, "at {time}");
            let contacts = update.entity("contacts");
            assert_eq!(contacts.spheres.len(), contacts.arrows.len());
        }
        let mut shapes = LogReader::open(&log).unwrap().map(Result::unwrap).filter_map(|entry| match entry {
            LogEntry::Environment(environment) => Some(environment.shape(0)),
            _ => None,
        });
        assert_eq!(shapes.next(), Some(shape));
        assert!(Session::replay(&log).unwrap().run().unwrap().is_identical());
    }
}

#[test]
fn a_log_with_pictures_replays() {
    let folder = tempfile::tempdir().unwrap();
    let log = folder.path().join("run.mcap");
    let summary = demo(1.2).log_scene().log(&log).build().unwrap().run().unwrap();
    assert!(summary.log_error.is_none() && summary.runtime.fault.is_none(), "{summary}");
    assert!(!pictures(&log).is_empty());
    let report = Session::replay(&log).unwrap().run().unwrap();
    assert!(report.is_identical() && report.force.logged > 50, "{report}");
}

/// The time of the last record of the haptic group in a log that is still written; everything before it is in order.
fn reached(log: &Path) -> Nanos {
    if std::fs::metadata(log).unwrap().len() == 0 {
        return Nanos::ZERO;
    }
    // It is still being written.
    let all: Vec<LogRecord> = LogReader::open(log).unwrap().readable().filter_map(record).collect();
    assert!(all.iter().map(LogRecord::time).is_sorted());
    let of_haptic = |record: &&LogRecord| matches!(record, LogRecord::Tick(tick) if tick.group == 0);
    all.iter().rev().find(of_haptic).map_or(Nanos::ZERO, LogRecord::time)
}

// Check that a chunk comes at least every 500 ms though a group says nothing for seconds. A record is held back for 100 ms
// and waits for the next release of the logger.
#[test]
fn a_group_that_is_quiet_delays_no_chunk() {
    let folder = tempfile::tempdir().unwrap();
    let log = folder.path().join("run.mcap");
    let global = palpate::runtime::RateGroup::hz(1);
    let builder = demo(4.0).model(LocalModelKind::Hold).global(global).virtual_time();
    let running = builder.log(&log).build().unwrap().start().unwrap();
    for _ in 0..30 {
        running.wait_for(std::time::Duration::from_millis(130));
        let now = running.elapsed();
        let oldest = now.saturating_sub(Nanos(500_000_000 + 100_000_000 + 50_000_000));
        // The file has a thread of its own, and the clock of the run stands still here: what is due comes.
        let mut looks = 0;
        while reached(&log) < oldest {
            looks += 1;
            assert!(looks < 500, "{} in the file at {now}", reached(&log));
            std::thread::sleep(std::time::Duration::from_millis(10));
        }
    }
    running.stop();
}
