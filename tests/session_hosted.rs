//! A session whose haptic group the program releases on a thread of its own.

use palpate::devices::{HostSide, Hosted};
use palpate::log::LogRecord;
use palpate::model::local::Kind;
use palpate::prelude::*;
use palpate::runtime::{HostRelease, HostedGroup};
use std::time::{Duration, Instant};

/// The hand at a time (s): down by a centimetre and along the surface.
fn state(time: f64) -> DeviceState {
    let depth = 0.01 * (time / 0.2).min(1.0);
    DeviceState { position: Vec3::new(0.022 + 0.01 * time, 0.026, 0.052 - depth), ..DeviceState::default() }
}

fn builder() -> (SessionBuilder, HostSide) {
    let body = Block::builder([6, 6, 6], [0.05; 3]).fix(Face::ZMin).build().unwrap();
    let (device, host) = Hosted::new(Capabilities::OMEGA_3, state(0.0)).unwrap();
    let builder = Session::builder(body).device(device).model(Kind::Patch).friction(0.5);
    (builder.local(RateGroup::hz(1000).hosted()), host)
}

/// Ticks for so long; the forces that were new, with the time of each.
fn tick(group: &mut HostedGroup, host: &mut HostSide, span: Duration) -> Vec<(Nanos, Vec3)> {
    let (start, mut forces) = (Instant::now(), Vec::new());
    while start.elapsed() < span {
        host.put(state(group.elapsed().as_secs_f64()));
        if group.release() == HostRelease::Ran {
            forces.push((group.elapsed(), host.command().force));
        }
        std::thread::sleep(Duration::from_micros(200));
    }
    forces
}

#[test]
fn the_force_of_a_release_is_that_of_the_state_put_before_it_and_the_run_is_repeated_from_its_log() {
    let folder = tempfile::tempdir().unwrap();
    let log = folder.path().join("hosted.mcap");
    let (builder, mut host) = builder();
    let mut running = builder.log(&log).keep_records().build().unwrap().start().unwrap();
    let mut group = running.take_haptic_group().unwrap();
    // What a thread of palpate's would have run by now.
    std::thread::sleep(Duration::from_millis(50));
    let forces = tick(&mut group, &mut host, Duration::from_millis(600));
    running.stop_handle().request();
    let start = Instant::now();
    while group.release() != HostRelease::Ended {
        assert!(start.elapsed() < Duration::from_secs(5));
        std::thread::sleep(Duration::from_micros(200));
    }
    assert!(host.command().force.norm() < 1e-9, "the force went to rest");
    drop(group);
    let summary = running.stop();
    assert!(summary.runtime.fault.is_none() && summary.log_error.is_none(), "{summary}");
    let books = &summary.runtime.groups[0];
    assert_eq!((books.name.as_str(), books.released + books.skipped), ("local", books.elapsed_periods));
    assert!(forces.iter().map(|(_, force)| force.z).fold(0.0, f64::max) > 0.1);
    // Every command that the host took is in the log, in the same order.
    let logged = summary.records.iter().filter_map(|record| match record {
        LogRecord::Command(sample) => Some(Vec3::from(sample.force_n)),
        _ => None,
    });
    let taken: Vec<Vec3> = forces.iter().skip(1).map(|(_, force)| *force).collect();
    assert!(taken.len() > 100);
    assert_eq!(logged.take(taken.len()).collect::<Vec<_>>(), taken);

    let (again, _host) = self::builder();
    let report = again.replay(&log).unwrap().run().unwrap();
    assert!(report.is_identical() && report.force.identical > 100, "{report:?}");
}

#[test]
fn a_host_that_puts_nothing_is_a_device_without_a_new_state() {
    let (builder, mut host) = builder();
    let mut running = builder.build().unwrap().start().unwrap();
    let mut group = running.take_haptic_group().unwrap();
    tick(&mut group, &mut host, Duration::from_millis(300));
    let felt = host.command().force;
    let start = Instant::now();
    while start.elapsed() < Duration::from_millis(600) {
        group.release();
        std::thread::sleep(Duration::from_micros(500));
    }
    assert!(felt.norm() > 0.1 && host.command().force.norm() < 1e-9, "{felt} and {}", host.command().force);
    drop(group);
    assert!(running.stop().runtime.groups[0].degraded > 100);
}

// Check that a pause gives no force, as the hand may have gone anywhere, and that the force comes back from there.
#[test]
fn after_a_pause_the_force_begins_at_nothing_and_comes_back() {
    let (builder, mut host) = builder();
    let mut running = builder.build().unwrap().start().unwrap();
    let mut group = running.take_haptic_group().unwrap();
    tick(&mut group, &mut host, Duration::from_millis(300));
    let felt = host.command().force;
    std::thread::sleep(Duration::from_millis(400));
    let after = tick(&mut group, &mut host, Duration::from_millis(800));
    assert!(felt.norm() > 0.1 && after[0].1.norm() < 1e-9, "{felt} and {}", after[0].1);
    assert!(after.last().unwrap().1.norm() > 0.1, "{:?}", after.last());
    drop(group);
    assert!(running.stop().runtime.groups[0].skipped > 300);
}

#[test]
fn virtual_time_takes_what_was_put_before_each_step_and_is_the_same_every_time() {
    let forces = || {
        let (builder, mut host) = builder();
        let mut running = builder.virtual_time().build().unwrap().start().unwrap();
        assert!(running.take_haptic_group().is_none());
        let step = |tick: u32| {
            host.put(state(f64::from(tick) * 1e-3));
            running.wait_for(Duration::from_millis(u64::from(tick > 0)));
            host.command().force
        };
        let forces: Vec<Vec3> = (0..300).map(step).collect();
        assert_eq!(running.stop().report.devices[0].force.ticks, 299);
        forces
    };
    let first = forces();
    assert!(first[0] == Vec3::zeros() && first[299].z > 0.1);
    assert_eq!(first, forces());
}
