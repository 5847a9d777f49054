//! A session in two parts, the global model behind a transport: as in two processes, but here both are in one.

mod session_support;

use std::time::Duration;

use palpate::devices::{Capabilities, Scripted};
use palpate::link::{Header, Hello, Message};
use palpate::model::Vec3;
use palpate::model::body::{Block, Body, State};
use palpate::model::local::Kind;
use palpate::runtime::Nanos;
use palpate::scene::{DeviceProfile, Scene};
use palpate::session::{Running, Session, SessionBuilder};
use session_support::line::{Line, has_models};
use session_support::*;

fn session(model: Kind) -> SessionBuilder {
    Session::builder(block()).path(pressing()).model(model).friction(0.5)
}

/// Starts both sides of a session of `model`, which lasts so long.
fn start(line: &Line, model: Kind, seconds: f64) -> (Running, Running) {
    let haptic = session(model).keep_records().duration_s(seconds).global_over(line.end(0)).build().unwrap();
    let haptic = std::thread::spawn(move || haptic.start().unwrap());
    let global = line.serve(session(model).build_global().unwrap());
    (haptic.join().unwrap(), global)
}

#[test]
fn two_sides_make_the_force_of_one() {
    for model in [Kind::Hold, Kind::Patch, Kind::Predictive] {
        let (haptic, global) = start(&Line::default(), model, 1.5);
        haptic.wait();
        let there = haptic.stop();
        let served = global.stop();
        assert_eq!((&there.runtime.fault, &served.runtime.fault), (&None, &None), "{model:?}");
        let here = session(model).keep_records().duration_s(1.5).virtual_time().build().unwrap().run().unwrap();
        assert!(forces(&there).iter().skip(100).any(|force| force.model_version > 20), "{model:?}: no model came");
        // In real time, on a machine that others use too: that the same body is felt, and not how well.
        let Apart { rms, peak } = apart([&there, &here], 0, 0);
        assert!(peak > 0.2);
        println!("{model:?}: {:.2} % apart", 100.0 * rms);
        assert!(rms < if model == Kind::Predictive { 0.1 } else { 0.5 }, "{model:?}: {rms}");
    }
}

/// Check that a haptic side that waits for it begins with models and their bases.
#[test]
fn a_session_is_said_to_be_ready_once_after_its_first_models_and_bases() {
    for (model, has_bases) in [(Kind::Predictive, true), (Kind::Hold, false)] {
        let (line, global) = (Line::default(), session(model).build_global().unwrap());
        let start = pressing().pose_at(0.0);
        let hello = Hello { tools: vec![(String::new(), Some(start))], ..global.hello().clone() };
        let global = global.start(vec![(Box::new(line.end(1)), hello)]).unwrap();
        global.wait_for(Duration::from_millis(200));
        global.stop();
        let sent = line.ways[1].lock().unwrap();
        let sent: Vec<Message> = sent.iter().map(|bytes| Message::read(bytes).unwrap().1).collect();
        let ready = sent.iter().position(|message| matches!(message, Message::Ready)).expect("it is said");
        assert_eq!(sent.iter().filter(|message| matches!(message, Message::Ready)).count(), 1, "{model:?}");
        assert!(sent[..ready].iter().any(|message| matches!(message, Message::Models(_))), "{model:?}");
        let knows_bases = sent[..ready].iter().any(|message| matches!(message, Message::Basis { .. }));
        assert_eq!(knows_bases, has_bases, "{model:?}");
    }
}

/// Check that the force is gone when the global side is, and comes back with another process that begins from the body at rest.
#[test]
fn a_global_side_that_dies_takes_the_force_away_and_another_one_gives_it_back() {
    let line = Line::default();
    let (haptic, global) = start(&line, Kind::Predictive, 60.0);
    haptic.wait_for(Duration::from_millis(700));
    *line.is_cut.lock().unwrap() = true;
    let cut = haptic.elapsed().as_secs_f64();
    global.stop();
    haptic.wait_for(Duration::from_millis(800));
    line.ways.iter().for_each(|way| way.lock().unwrap().clear());
    *line.is_cut.lock().unwrap() = false;
    *line.peers[0].lock().unwrap() += 1;
    let returned = haptic.elapsed().as_secs_f64();
    let global = line.serve(session(Kind::Predictive).build_global().unwrap());
    let back = haptic.elapsed().as_secs_f64();
    haptic.wait_for(Duration::from_millis(1500));
    global.stop();
    let summary = haptic.stop();
    assert_eq!((&summary.runtime.fault, summary.runtime.lost_records), (&None, 0));
    let commands = commands(&summary);
    let felt = |from: f64, until: f64| largest_command(&commands, 0, [from, until]);
    assert!(felt(cut - 0.4, cut) > 0.1, "a force before");
    assert_eq!(felt(cut + 0.4, returned), 0.0, "none without a model");
    assert!(felt(back, back + 1.5) > 0.1, "a force again, after {back} s");
}

/// Check that whoever looks sees the surface as the global model has it, to single precision and pressed where the tool is, and that nothing of it
/// crosses while nobody looks.
#[test]
fn the_surface_crosses_while_somebody_looks_at_it() {
    let line = Line::default();
    let (mut haptic, mut global) = start(&line, Kind::Patch, 60.0);
    let mut viewer = haptic.take_viewer().unwrap();
    assert!(!viewer.knows_stress());
    let first = viewer.surface().clone();
    assert_eq!((first.time, first.positions.as_slice()), (Nanos::ZERO, block().rest()));
    haptic.wait_for(Duration::from_millis(1200));
    let unseen = line.pictures();
    assert!((1..20).contains(&unseen), "the first half second, in which somebody might have looked: {unseen}");
    haptic.wait_for(Duration::from_millis(300));
    assert_eq!(line.pictures(), unseen, "nobody looks");
    let (mut newest, mut shown) = (Nanos::ZERO, 0);
    for _ in 0..60 {
        haptic.wait_for(Duration::from_millis(10));
        let surface = viewer.surface();
        assert!(surface.time >= newest, "none comes back");
        shown += usize::from(surface.time > newest);
        newest = surface.time;
    }
    assert!(shown > 8 && newest > Nanos(1_500_000_000), "{shown} pictures until {newest}");
    // The same picture on both sides, to single precision.
    let (nodes, mut same) = (block().surface().nodes(), 0);
    let mut theirs = global.take_viewer().unwrap();
    for _ in 0..60 {
        haptic.wait_for(Duration::from_millis(10));
        let [here, there] = [viewer.surface(), theirs.surface()];
        if here.time == there.time {
            same += 1;
            let apart = nodes.iter().map(|&n| (here.positions[n as usize] - there.positions[n as usize]).amax());
            assert!(apart.fold(0.0, f64::max) < 1e-8, "at {}", here.time);
        }
    }
    assert!(same > 5, "{same} of 60");
    let tool = viewer.tool().position;
    let surface = viewer.surface();
    let rest = block().rest().to_vec();
    let beneath = (0..rest.len()).min_by(|&a, &b| {
        let away = |node: usize| (surface.positions[node] - tool).norm();
        away(a).total_cmp(&away(b))
    });
    let sunk = rest[beneath.unwrap()].z - surface.positions[beneath.unwrap()].z;
    assert!(sunk > 1e-3, "{sunk} m");
    let stays = |node: &u32| surface.positions[*node as usize] == rest[*node as usize];
    assert!(
        (0..rest.len() as u32).filter(|node| !nodes.contains(node)).all(|node| stays(&node)),
        "what is below does not cross"
    );
    // What the program sets is what the other side has.
    let (here, mut there) = (haptic.take_controls().unwrap(), global);
    here.set_stiffness(1.5).unwrap();
    here.set_friction(0.25.into()).unwrap();
    haptic.wait_for(Duration::from_millis(600));
    let controls = there.take_controls().unwrap();
    assert_eq!((controls.stiffness(), controls.friction().kinetic), (1.5, 0.25));
    assert_eq!(viewer.surface().stiffness.factor(), 1.5);
    // A picture of what has not been, and one of another body.
    *line.is_cut.lock().unwrap() = true;
    haptic.wait_for(Duration::from_millis(50));
    let last = viewer.surface().time;
    for (number, time, count) in [(1, Nanos(u64::MAX), nodes.len()), (2, last + Nanos(1), nodes.len() + 1)] {
        let forged = Message::Surface { time, stiffness: Default::default(), places: vec![[9.0; 3]; count] };
        let mut bytes = Vec::new();
        forged.write(Header { epoch: 1, number: (1 << 40) + number, sent: Nanos::ZERO }, &mut bytes);
        line.ways[1].lock().unwrap().push_back(bytes);
    }
    haptic.wait_for(Duration::from_millis(50));
    assert_eq!(viewer.surface().time, last);
    assert_eq!((haptic.stop().runtime.fault, there.stop().runtime.fault), (None, None));
}

/// A model of a tick that has not been would never be old: nobody believes it.
#[test]
fn a_model_from_the_future_is_not_believed() {
    let line = Line::default();
    let (haptic, global) = start(&line, Kind::Hold, 1.2);
    haptic.wait_for(Duration::from_millis(600));
    // What the global side said last, of a tick that is far ahead.
    let mut forged = {
        let mut wait = None;
        while wait.is_none() {
            wait = line.ways[1].lock().unwrap().iter().find(|message| has_models(message)).cloned();
        }
        wait.unwrap()
    };
    *line.is_cut.lock().unwrap() = true;
    global.stop();
    let (_, header) = Message::glance(&forged).unwrap();
    let Header { number, .. } = header;
    forged[16..24].copy_from_slice(&(number + 1_000).to_le_bytes());
    // After the header the host of the one tool, and its parcel, which begins with the tick.
    let tick = 8 + 3 * 8 + 4 + 2;
    for (n, ahead) in [1_u64 << 20, u64::MAX - 3, u64::MAX].into_iter().enumerate() {
        forged[16..24].copy_from_slice(&(number + 1_000 + n as u64).to_le_bytes());
        forged[tick..tick + 8].copy_from_slice(&ahead.to_le_bytes());
        assert!(Message::read(&forged).is_ok());
        line.ways[1].lock().unwrap().push_back(forged.clone());
    }
    haptic.wait();
    let summary = haptic.stop();
    assert_eq!(summary.runtime.fault, None);
    let last = commands(&summary).into_iter().rev().take(100);
    assert_eq!(last.map(|command| norm(command.force_n)).fold(0.0, f64::max), 0.0, "its age takes the force away");
}

#[test]
fn what_cannot_be_in_two_parts_is_refused_by_name() {
    let refused =
        |builder: SessionBuilder| builder.global_over(Line::default().end(0)).build().map(|_| ()).unwrap_err();
    assert_eq!(refused(session(Kind::Full)).place(), "model()");
    assert!(refused(session(Kind::Hold).virtual_time()).to_string().contains("simulate one"));
    let own = AlteredBlock::new(block(), Body::forces);
    let error = Session::builder(own).path(pressing()).model(Kind::Hold).build_global().map(|_| ()).unwrap_err();
    assert_eq!(error.place(), "link", "{error}");
    let global = Session::from_scene(Scene::demo()).model(Kind::Predictive).build_global().unwrap();
    let far = Hello {
        tools: vec![(String::new(), Some(palpate::model::Pose::at(Vec3::new(9.0, 0.0, 0.0))))],
        ..global.hello().clone()
    };
    let error = global.start(vec![(Box::new(Line::default().end(1)), far)]).map(|_| ()).unwrap_err();
    assert!(error.to_string().contains("m from the body"), "{error}");
    let global = Session::from_scene(Scene::demo()).model(Kind::Predictive).build_global().unwrap();
    let error = global.start(vec![(Box::new(Line::default().end(1)), Hello::default())]).map(|_| ()).unwrap_err();
    assert!(error.to_string().contains("must have some of the scene"), "{error}");
}

#[test]
fn the_log_of_one_side_is_not_replayed() {
    let folder = tempfile::tempdir().unwrap();
    let (line, log) = (Line::default(), folder.path().join("haptic.mcap"));
    let haptic = session(Kind::Hold).log(&log).duration_s(0.3).global_over(line.end(0)).build().unwrap();
    let haptic = std::thread::spawn(move || haptic.run().unwrap());
    let global = line.serve(session(Kind::Hold).build_global().unwrap());
    assert!(haptic.join().unwrap().log_error.is_none());
    global.stop();
    let error = session(Kind::Hold).replay(&log).map(|_| ()).unwrap_err();
    assert!(error.to_string().contains("in another process"), "{error}");
}

/// Check that what is of the devices, the log and the length of a run is each side's own, and nothing else.
#[test]
fn a_scene_that_differs_is_named_and_what_is_of_one_side_alone_is_not() {
    let hello = |change: fn(&mut Scene)| {
        let mut scene = Scene::demo();
        change(&mut scene);
        Session::from_scene(scene).model(Kind::Predictive).build_global().unwrap().hello().clone()
    };
    let here = hello(|_| ());
    assert_eq!(here.difference(&hello(|scene| scene.run.duration_s = 1.0)), None);
    assert_eq!(here.difference(&hello(|scene| scene.safety.max_force_n = Some(0.5))), None);
    let named = here.difference(&hello(|scene| scene.global.rate_hz = 20.0)).unwrap();
    assert!(named.contains("rate_hz = 30") && named.contains("rate_hz = 20"), "{named}");
}

#[test]
fn a_body_that_is_too_slow_for_one_machine_has_its_global_model_on_another() {
    let slow = || {
        let body = AlteredBlock::new(block(), |block: &mut Block, state: &State, forces: &mut [Vec3]| {
            // 200 ms of a global period of 33 ms.
            std::thread::sleep(Duration::from_millis(3));
            block.forces(state, forces);
        });
        Session::builder(body.with_copies()).path(pressing()).model(Kind::Hold).substeps_per_ms(2)
    };
    slow().global_over(Line::default().end(0)).build().expect("what is computed elsewhere need not fit here");
    let error = slow().build_global().map(|_| ()).unwrap_err();
    assert!(error.to_string().contains("a period of the global model takes"), "{error}");
}

/// Check that the limits of a device are held against the scene where it is, and as its scene says on the global side.
#[test]
fn a_device_is_looked_at_by_the_machine_that_has_it() {
    // Too short for the 8.5 N of the device that a scene has by default.
    let short_ramp = |mut scene: Scene| {
        scene.safety.ramp_ms = 10.0;
        scene.safety.max_force_n = None;
        Session::from_scene(scene).model(Kind::Hold)
    };
    let mut touch = Scene::demo();
    touch.devices[0].profile = DeviceProfile::Touch;
    short_ramp(touch.clone()).virtual_time().build().unwrap();
    short_ramp(touch).build_global().unwrap();
    // Its profile is the default, whatever it is at the machine that has it.
    let device = || Scripted::new(pressing()).with_capabilities(Capabilities::TOUCH);
    let pair = short_ramp(Scene::of_program()).body(block());
    let pair = pair.named_device("left", device()).named_device("right", device()).device_here("left");
    pair.global_over(Line::default().end(0)).build().unwrap();
}
