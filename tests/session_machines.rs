//! Two haptic machines on one body, as in three processes, but here all are in one: each has one of the scene's two devices.

mod session_support;

use std::thread::JoinHandle;
use std::time::Duration;

use palpate::devices::{Scripted, ToolPath};
use palpate::link::HapticMachine;
use palpate::model::Vec3;
use palpate::model::local::Kind;
use palpate::session::{Running, Session, SessionBuilder};
use session_support::line::Line;
use session_support::*;

/// A scene of two tools that press within two cells of each other.
fn session() -> SessionBuilder {
    session_of([pressing(), meeting()])
}

/// Ticks for which the tools rest above the body first: of what begins late, none is pressed into it already, which would hold the force at zero.
const REST_MS: f64 = 300.0;

/// Likewise, with other paths.
fn session_of(paths: [ToolPath; 2]) -> SessionBuilder {
    let [left, right] = paths.map(|path| late(&path, REST_MS));
    let with = |builder: SessionBuilder, name: &str, path: ToolPath| builder.named_device(name, Scripted::new(path));
    let session = Session::builder(block()).model(Kind::Predictive).friction(0.5).keep_records();
    with(with(session, "left", left), "right", right)
}

/// The path so many milliseconds later.
fn late(path: &ToolPath, ms: f64) -> ToolPath {
    let at = |n: u16| path.at((f64::from(n) - ms).max(0.0) * 1e-3);
    let (times, places) = (0..4000).map(|n| (f64::from(n) * 1e-3, at(n))).unzip();
    ToolPath::new(times, places).unwrap()
}

/// The machine of one of the devices of `session`, for so many seconds, once its side of `line` is served.
fn machine(session: SessionBuilder, line: &Line, device: &str, seconds: f64) -> JoinHandle<Running> {
    let session = session.device_here(device).duration_s(seconds).global_over(line.end(0)).build().unwrap();
    std::thread::spawn(move || session.start().unwrap())
}

/// Both machines at work for so many seconds, with the global side.
fn start(lines: &[Line; 2], seconds: f64) -> ([Running; 2], Running) {
    start_with(session, lines, seconds)
}

/// Likewise with other sessions.
fn start_with(session: fn() -> SessionBuilder, lines: &[Line; 2], seconds: f64) -> ([Running; 2], Running) {
    let [left, right] =
        [(&lines[0], "left"), (&lines[1], "right")].map(|(line, device)| machine(session(), line, device, seconds));
    let global = session().build_global().unwrap();
    let beyond = lines.iter().map(|line| -> HapticMachine { (Box::new(line.end(1)), line.hello()) });
    let global = global.start(beyond.collect()).unwrap();
    ([left, right].map(|running| running.join().unwrap()), global)
}

#[test]
fn two_machines_feel_what_two_devices_at_one_do() {
    let ([left, right], global) = start(&Default::default(), 2.0);
    let later_ms = 1e3 * (left.elapsed().as_secs_f64() - right.elapsed().as_secs_f64());
    left.wait();
    right.wait();
    let there = [left.stop(), right.stop()];
    assert_eq!(global.stop().runtime.fault, None);
    assert!(there.iter().all(|summary| summary.runtime.fault.is_none() && summary.runtime.lost_records == 0));
    // One of them began later, and rested where it begins until then.
    let [left_ms, right_ms] = [-later_ms, later_ms].map(|ms| ms.max(0.0).round());
    let here = session_of([late(&pressing(), left_ms), late(&meeting(), right_ms)]);
    let here = here.duration_s(2.0).virtual_time().build().unwrap().run().unwrap();
    for (device, (summary, ms)) in (0..).zip(there.iter().zip([left_ms, right_ms])) {
        let Apart { rms, peak } = apart([summary, &here], device, ms as usize);
        println!("device {device}, {ms} ms later: {:.2} % of {peak:.2} N apart", 100.0 * rms);
        // In real time, on a machine that others use too: that the same body and the same other tool are felt, and not how well.
        assert!(peak > 0.2 && rms < 0.1, "device {device}: {rms}");
    }
}

/// What left and right felt while the machine of the right one was there, while it was not, and after another one had come whose tool goes
/// `again`: of left all three, of right the last (N).
fn felt_when_one_dies(again: ToolPath) -> ([f64; 3], f64) {
    let lines: [Line; 2] = Default::default();
    let ([left, right], global) = start(&lines, 60.0);
    left.wait_for(Duration::from_millis(800));
    *lines[1].is_cut.lock().unwrap() = true;
    right.stop();
    let dead = left.elapsed().as_secs_f64();
    left.wait_for(Duration::from_millis(900));
    // Another process in its place.
    lines[1].ways.iter().for_each(|way| way.lock().unwrap().clear());
    *lines[1].is_cut.lock().unwrap() = false;
    *lines[1].peers[1].lock().unwrap() += 1;
    let right = machine(session_of([pressing(), again]), &lines[1], "right", 60.0).join().unwrap();
    let back = left.elapsed().as_secs_f64();
    left.wait_for(Duration::from_millis(1500));
    let (left, right, served) = (left.stop(), right.stop(), global.stop());
    assert_eq!([&left, &right, &served].map(|summary| &summary.runtime.fault), [&None; 3]);
    let [left, right] = [commands(&left), commands(&right)];
    let spans = [[dead - 0.4, dead], [dead, back], [back, back + 1.5]];
    let felt = (spans.map(|span| largest_command(&left, 0, span)), largest_command(&right, 1, [0.0, 1.5]));
    println!("left {:.3?} N, right {:.3} N", felt.0, felt.1);
    felt
}

#[test]
fn a_machine_that_dies_harms_no_other_and_another_one_takes_its_place() {
    let (left, right) = felt_when_one_dies(meeting());
    assert!(left.iter().chain([&right]).all(|&force| force > 0.1), "both feel the body");
}

/// Check that a machine of which nothing came for a while goes on, and that its tool is not torn to where it is meanwhile: the other one feels
/// no more than before.
#[test]
fn a_machine_that_was_silent_comes_back_without_a_blow() {
    // The right one strokes to and fro past the left one, 6 cm in a quarter of a second.
    let session = || {
        let at = |t: f64| [0.05 + 0.03 * (12.6 * t).cos(), 0.03, 0.101 - 0.008 * (t / 0.2).min(1.0)];
        let (times, places) = (0..4000).map(|n| f64::from(n) * 1e-3).map(|t| (t, at(t))).unzip();
        session_of([pressing(), ToolPath::new(times, places).unwrap()])
    };
    let lines: [Line; 2] = Default::default();
    let ([left, right], global) = start_with(session, &lines, 60.0);
    left.wait_for(Duration::from_millis(900));
    let mut spans = Vec::new();
    for _ in 0..4 {
        *lines[1].is_cut.lock().unwrap() = true;
        left.wait_for(Duration::from_millis(250));
        *lines[1].is_cut.lock().unwrap() = false;
        let back = left.elapsed().as_secs_f64();
        spans.push([back, back + 0.4]);
        left.wait_for(Duration::from_millis(400));
    }
    let (left, right, served) = (left.stop(), right.stop(), global.stop());
    assert_eq!([&left, &right, &served].map(|summary| &summary.runtime.fault), [&None; 3]);
    let (felt, other) = (commands(&left), commands(&right));
    let after = spans.iter().map(|&span| largest_command(&felt, 0, span)).fold(0.0, f64::max);
    let alone = session().duration_s(4.0).virtual_time().build().unwrap().run().unwrap();
    let most = largest_command(&commands(&alone), 0, [0.0, 4.0]);
    println!(
        "{after:.3} N after a silence, {most:.3} N without one, the other {:.3} N",
        largest_command(&other, 1, [1.0, 4.0])
    );
    assert!((0.1..1.15 * most).contains(&after), "{after} N after a silence, {most} N without one");
}

/// Check that the tool of a machine that takes another's place is put where it is: on a straight way from where the one before pressed, it
/// would have torn the body along to the side of it.
#[test]
fn the_tool_of_another_machine_is_not_dragged_from_where_that_of_the_one_before_was() {
    let (left, right) = felt_when_one_dies(ToolPath::constant([-0.03, 0.05, 0.05]).unwrap());
    assert_eq!(right, 0.0, "it is clear of the body");
    let alone = Session::builder(block()).path(pressing()).model(Kind::Full).friction(0.5).keep_records();
    let alone = alone.duration_s(4.0).virtual_time().build().unwrap().run().unwrap();
    let most = largest_command(&commands(&alone), 0, [0.0, 4.0]);
    assert!((0.1..1.1 * most).contains(&left[2]), "{left:?}, alone {most}");
}

/// Each machine sees and logs both tools where they are.
#[test]
fn each_machine_knows_where_the_tool_of_the_other_is() {
    let ([mut left, right], global) = start(&Default::default(), 60.0);
    let later_s = left.elapsed().as_secs_f64() - right.elapsed().as_secs_f64();
    let (mut viewer, path) = (left.take_viewer().unwrap(), late(&meeting(), REST_MS));
    left.wait_for(Duration::from_millis(600));
    let look = |_| {
        left.wait_for(Duration::from_millis(20));
        let ms = || 1e3 * left.elapsed().as_secs_f64();
        let (before, place, after) = (ms(), viewer.tools().nth(1).unwrap().position, ms());
        // On a machine that others use too, each of the threads on the way may be some milliseconds late.
        let times = (before as i32 - 40..after as i32 + 15).map(f64::from);
        times.map(|ms| (Vec3::from(path.at(1e-3 * ms - later_s)) - place).norm()).fold(f64::INFINITY, f64::min)
    };
    let mut away: Vec<f64> = (0..20).map(look).collect();
    away.sort_by(f64::total_cmp);
    // Where a thread was kept waiting, it is seen as far as it would have gone straight on.
    assert!(away[15] < 5e-4 && away[19] < 3e-3, "{away:?} m from its path");
    for running in [left, right, global] {
        assert_eq!(running.stop().runtime.fault, None);
    }
}

#[test]
fn a_device_that_nobody_has_or_two_have_is_refused_by_name() {
    let refused = |builder: SessionBuilder| builder.build().map(|_| ()).unwrap_err().to_string();
    let unknown = refused(session().device_here("middle").global_over(Line::default().end(0)));
    assert!(unknown.contains("\"middle\"") && unknown.contains("left, right"), "{unknown}");
    let alone = refused(session().device_here("left"));
    assert!(alone.contains("over a link"), "{alone}");
    let global = session().build_global().unwrap();
    let one = |own: usize| {
        let mut hello = global.hello().clone();
        hello.tools.iter_mut().enumerate().filter(|(tool, _)| *tool != own).for_each(|(_, tool)| tool.1 = None);
        hello
    };
    for (hellos, name) in
        [(vec![one(0)], "right"), (vec![one(0), one(0)], "left"), (vec![one(0), one(1), one(1)], "right")]
    {
        let machines = hellos.into_iter().map(|hello| -> HapticMachine { (Box::new(Line::default().end(1)), hello) });
        let error = session().build_global().unwrap().start(machines.collect()).map(|_| ()).unwrap_err().to_string();
        assert!(error.contains(&format!("{name:?} must be at one haptic machine")), "{error}");
    }
}
