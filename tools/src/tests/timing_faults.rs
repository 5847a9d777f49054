//! Known faults, put into a run: the report on its log names each of them, with its cause, its time and its size.

use std::path::Path;

use crate::timing::{Selection, TimingAnalysis, TimingReport, WorstTick, timing_to_text};
use palpate::log::LogReader;
use palpate::runtime::SlipCause;
use palpate::runtime::{Disturbance, Nanos, RateGroup};
use palpate::scene::Scene;
use palpate::session::{Session, SessionBuilder};

use super::repository::in_repository;

const MS: u64 = 1_000_000;

/// What happens, at which release of which group, and what must be found: cause, periods skipped, overdue time in ms.
struct Injected {
    group: &'static str,
    release: u64,
    disturbance: Disturbance,
    found_at: u64,
    cause: SlipCause,
    skipped: u32,
    overdue_ms: u64,
}

fn late_wake(ms: u64) -> Disturbance {
    Disturbance { late_wake: Nanos(ms * MS), ..Disturbance::default() }
}

fn long_work(ms: u64) -> Disturbance {
    Disturbance { work: Nanos(ms * MS), ..Disturbance::default() }
}

fn injected() -> Vec<Injected> {
    vec![
        // Woken 12.0 ms late: releases 500 to 511 are given up and 512 runs at once.
        Injected {
            group: "local",
            release: 500,
            disturbance: late_wake(12),
            found_at: 512,
            cause: SlipCause::LateWake,
            skipped: 12,
            overdue_ms: 12,
        },
        // At work for 5.0 ms in a period of 1 ms: it misses its own deadline, and four periods are given up behind it.
        Injected {
            group: "local",
            release: 900,
            disturbance: long_work(5),
            found_at: 900,
            cause: SlipCause::LongTick,
            skipped: 0,
            overdue_ms: 5,
        },
        // The global model takes 110 ms in a period of 33.3 ms.
        Injected {
            group: "global",
            release: 40,
            disturbance: long_work(110),
            found_at: 40,
            cause: SlipCause::LongTick,
            skipped: 0,
            overdue_ms: 110,
        },
    ]
}

fn read(path: &Path) -> TimingReport {
    let mut reader = LogReader::open(path).unwrap();
    let mut analysis = TimingAnalysis::new(Selection::default());
    reader.readable().for_each(|entry| analysis.push_entry(&entry));
    assert_eq!(reader.damage(), None);
    analysis.report()
}

fn finish(session: SessionBuilder) {
    let running = session.build().unwrap().start().unwrap();
    running.wait();
    assert_eq!(running.stop().log_error.map(|error| error.to_string()), None);
}

fn run(log: &Path) -> TimingReport {
    let scene = Scene::load(&in_repository("scenes/drag_friction.toml")).unwrap();
    let mut session = Session::from_scene(scene).virtual_time().duration_s(2.0).log(log);
    for group in ["local", "global"] {
        session = session.disturb(group, move |release| {
            let hit = injected().into_iter().find(|fault| (fault.group, fault.release) == (group, release));
            hit.map_or_else(Disturbance::default, |fault| fault.disturbance)
        });
    }
    finish(session);
    read(log)
}

#[test]
fn every_injected_fault_is_named_with_its_cause_its_time_and_its_size() {
    let folder = tempfile::tempdir().unwrap();
    let report = run(&folder.path().join("faults.mcap"));
    let trouble: Vec<&WorstTick> = report.worst.iter().filter(|worst| worst.is_trouble()).collect();
    assert_eq!(trouble.len(), injected().len(), "{}", timing_to_text(&report));
    for fault in injected() {
        let found =
            trouble.iter().find(|worst| (worst.group.as_str(), worst.timing.tick) == (fault.group, fault.found_at));
        let found = found.unwrap_or_else(|| panic!("{} {} is not named", fault.group, fault.release));
        assert_eq!(
            (found.cause, found.timing.slips),
            (fault.cause, fault.skipped),
            "{} {}",
            fault.group,
            fault.release
        );
        assert_eq!(found.overdue, Nanos(fault.overdue_ms * MS));
        assert!(found.moment.ticks.len() > 8 && !found.moment.forces.is_empty());
        // Check that the line in the report says so too
        let line = format!("{:>9}", fault.found_at);
        let text = timing_to_text(&report);
        let shown = text.lines().find(|text| text.starts_with(fault.group) && text.contains(&line));
        assert!(shown.is_some_and(|shown| shown.contains(fault.cause.name())), "{text}");
    }
    let local = report.run.groups.iter().find(|group| group.name == "local").unwrap();
    assert_eq!(local.released + local.skipped.total(), local.elapsed_periods);
    assert_eq!((local.skipped.of(SlipCause::LateWake), local.skipped.of(SlipCause::LongTick)), (12, 4));
}

// A device that paces the haptic group and falls silent for 6 ms.
#[test]
fn a_silent_device_is_named_as_the_peer_that_stalled() {
    let folder = tempfile::tempdir().unwrap();
    let log = folder.path().join("silent.mcap");
    let scene = Scene::load(&in_repository("scenes/drag_friction.toml")).unwrap();
    let paced = RateGroup::hz(1000).device_paced(Nanos(20 * MS));
    let session = Session::from_scene(scene).virtual_time().duration_s(0.5).log(&log).local(paced);
    finish(session.disturb("local", |release| Disturbance {
        stall: Nanos(if release == 300 { 6 * MS } else { 0 }),
        ..Disturbance::default()
    }));
    let report = read(&log);
    let worst = &report.worst[0];
    assert_eq!((worst.group.as_str(), worst.cause), ("local", SlipCause::StalledPeer), "{}", timing_to_text(&report));
    assert!((300..=306).contains(&worst.timing.tick), "{}", worst.timing.tick);
}

#[test]
fn a_run_without_faults_names_none() {
    let folder = tempfile::tempdir().unwrap();
    let log = folder.path().join("calm.mcap");
    let scene = Scene::load(&in_repository("scenes/drag_friction.toml")).unwrap();
    let session = Session::from_scene(scene).virtual_time().duration_s(0.3).log(&log).local(RateGroup::hz(1000));
    finish(session);
    assert_eq!(read(&log).worst, []);
}
