//! Faults of every part of a session, on real threads: the force that reaches the device through each of them.

#[path = "../examples/fault_traces/scenarios.rs"]
mod scenarios;

use palpate::log::{CommandSample, LogRecord};
use palpate::model::Vec3;
use palpate::safety::Actions;
use palpate::session::Summary;
use scenarios::{FAULT_S, Fault, RAMP_S, Trace};

/// The slew limit of a scene without one (N/s).
const SLEW_N_PER_S: f64 = 500.0;

/// Runs the scenario and checks what holds through every fault.
fn run(fault: Fault) -> Trace {
    let trace = scenarios::run(fault).unwrap();
    assert!(trace.written.iter().all(|(_, force)| force.iter().all(|c| c.is_finite())), "{fault:?}");
    // Check that no command is farther from the one before than the slew limit allows, however many periods were skipped
    for pair in trace.written.windows(2) {
        let change = (Vec3::from(pair[1].1) - Vec3::from(pair[0].1)).norm();
        let dt = (pair[1].0 - pair[0].0).max(1e-3);
        // After a gap of 0.1 s the force starts from zero.
        assert!(change <= SLEW_N_PER_S * dt * (1.0 + 1e-9) || dt >= 0.1, "{fault:?}: {pair:?}");
    }
    if let Some(summary) = &trace.summary {
        for group in &summary.runtime.groups {
            assert_eq!(group.released + group.skipped, group.elapsed_periods, "{fault:?}: {}", group.name);
        }
        // What was computed is in the log; no device is told of it.
        let not_finite = u64::from(fault == Fault::LocalNotFinite);
        assert_eq!(summary.report.devices[0].force.not_finite, not_finite, "{fault:?}");
        assert_eq!(summary.runtime.lost_records, 0);
    }
    assert_eq!(trace.written.last().unwrap().1, [0.0; 3], "{fault:?}: the last command is zero");
    trace
}

/// The force fades evenly and is gone within the declared time.
fn assert_ramps_out(trace: &Trace, fault: Fault) {
    let (before, rest) = trace.before_and_rest();
    assert!(before > 0.2, "{fault:?}: the tool must feel something before, {before} N");
    let rest = rest.unwrap();
    // The fault is noticed in one release and answered in the next; a skipped period is made up for by a larger step.
    let begun = trace.magnitudes().filter(|sample| sample.0 <= FAULT_S + 0.05).last().unwrap().0;
    assert!(rest <= begun + RAMP_S + 0.005, "{fault:?}: still a force at {rest} s");
    let fading: Vec<_> = trace.magnitudes().filter(|sample| sample.0 > begun).collect();
    assert!(!fading.is_empty());
    for pair in fading.windows(2) {
        let (dt, drop) = (pair[1].0 - pair[0].0, pair[0].1 - pair[1].1);
        // Check that it fades and does not drop, however many periods the host took. A device that nobody reads cannot
        // tell how many that were.
        let slow = drop <= before * dt / RAMP_S * 1.01 + 1e-9 || fault == Fault::DeviceReadPanics;
        assert!(drop >= 0.0 && (slow || dt >= 0.1), "{fault:?}: {pair:?} of {before} N");
    }
}

fn commands(summary: &Summary) -> impl Iterator<Item = CommandSample> + '_ {
    summary.records.iter().filter_map(|record| match record {
        LogRecord::Command(sample) => Some(*sample),
        _ => None,
    })
}

fn words(summary: &Summary) -> String {
    summary.report.events.iter().map(|event| event.message.clone() + "\n").collect()
}

#[test]
fn faults_of_the_haptic_side_ramp_the_force_out_and_are_reported() {
    for (fault, actor, what) in [
        (Fault::LocalPanics, "local", "the body gave way"),
        (Fault::LocalNotFinite, "local", "fault"),
        (Fault::DeviceReadPanics, "tool", "the driver gave way"),
        (Fault::DeviceWritePanics, "tool", "the driver gave way"),
    ] {
        let trace = run(fault);
        assert_ramps_out(&trace, fault);
        let summary = trace.summary.unwrap();
        let told = summary.runtime.fault.as_ref().expect("a fault");
        assert_eq!((told.group.as_str(), told.actor.as_str()), ("local", actor), "{fault:?}");
        assert!(told.what.contains(what), "{fault:?}: {told}");
        assert!(words(&summary).contains("winding down"), "{fault:?}: {}", words(&summary));
    }
}

#[test]
fn a_stop_and_a_drop_ramp_the_force_out() {
    for fault in [Fault::StopRequested, Fault::Dropped] {
        let trace = run(fault);
        assert_ramps_out(&trace, fault);
        assert!(trace.summary.is_none_or(|summary| summary.runtime.fault.is_none()));
    }
}

#[test]
fn faults_of_the_global_model_leave_the_haptic_side_alone() {
    // The log has a test of its own; that the whole process is stopped would disturb the other tests: `cli_faults`.
    let is_elsewhere = |fault| matches!(fault, Fault::DiskFull | Fault::LoggerStuck | Fault::ProcessStopped);
    for fault in Fault::ALL.into_iter().filter(|&fault| fault.leaves_the_force() && !is_elsewhere(fault)) {
        let trace = run(fault);
        let summary = trace.summary.as_ref().unwrap();
        assert_eq!(summary.runtime.fault, None, "{fault:?}");
        let restarts =
            usize::from(matches!(fault, Fault::GlobalPanics | Fault::GlobalNotFinite | Fault::GlobalNeverReturns));
        assert_eq!(summary.runtime.restarts.len(), restarts, "{fault:?}");
        assert_eq!(words(summary).contains("restarted"), restarts == 1, "{fault:?}: {}", words(summary));
        // Check that the tool is felt all the while that device and model are fresh, that the force is gone where the model
        // is old and the device silent, and that newer models come again
        let end = summary.report.duration.as_secs_f64() - RAMP_S - 0.02;
        let commands: Vec<_> = commands(summary).filter(|command| command.time.as_secs_f64() < end).collect();
        let after = || commands.iter().filter(|command| command.time.as_secs_f64() > FAULT_S);
        let has = |command: &CommandSample, stage| Actions(command.limits).contains(stage);
        let is_faded = |command: &CommandSample| {
            [Actions::MODEL_AGE, Actions::WATCHDOG, Actions::RAMP].iter().any(|&stage| has(command, stage))
        };
        let felt = |command: &CommandSample| Vec3::from(command.force_n).norm() > 0.05;
        assert!(after().filter(|command| !is_faded(command)).all(felt), "{fault:?}");
        assert!(after().filter(|command| felt(command)).count() > 100, "{fault:?}");
        let answer = match fault {
            Fault::DeviceNotFinite => Some(Actions::WATCHDOG),
            Fault::GlobalStalls | Fault::GlobalNeverReturns => Some(Actions::MODEL_AGE),
            _ => None,
        };
        if let Some(stage) = answer {
            let gone = after().filter(|command| has(command, stage) && command.force_n == [0.0; 3]).count();
            assert!(gone > 20, "{fault:?}: {gone}");
        }
        let newest = summary.records.iter().rev().find_map(|record| match record {
            LogRecord::Force(force) => Some(*force),
            _ => None,
        });
        assert!(newest.unwrap().model_age_s < 0.5, "{fault:?}: {newest:?}");
    }
}

#[test]
fn faults_of_the_log_leave_the_force_alone() {
    for fault in [Fault::DiskFull, Fault::LoggerStuck] {
        let trace = run(fault);
        let summary = trace.summary.as_ref().unwrap();
        let until = summary.runtime.groups[0].elapsed_periods as f64 * 1e-3 - RAMP_S - 0.02;
        let felt = trace.magnitudes().filter(|sample| (0.2..until).contains(&sample.0));
        assert!(felt.map(|sample| sample.1).fold(f64::MAX, f64::min) > 0.05, "{fault:?}");
        // Check that the report says what is missing, that nothing else is, and that no group had to be given up
        assert_eq!(summary.runtime.fault, None, "{fault:?}");
        assert!(summary.log_error.is_some() && summary.report.lost_records() > 0, "{fault:?}");
        assert!(words(summary).contains("records lost between"), "{fault:?}: {}", words(summary));
    }
}

#[test]
fn a_thread_left_behind_is_named_in_the_log() {
    let summary = run(Fault::GlobalNeverReturns).summary.unwrap();
    assert!(words(&summary).contains("global: a release did not return within 2 s, its thread was left behind"));
    assert!(summary.runtime.restarts[0].what.contains("left behind"));
}
