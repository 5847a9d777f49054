//! The safety stages in whole sessions, in virtual time: what is switched off and what acted is in the log and the report.

use crate::session_support::*;
use palpate::devices::{Capabilities, Device, DeviceFault, DeviceState, ForceCommand, ToolPath};
use palpate::log::{ForceSample, LogRecord, ToolSample};
use palpate::model::Vec3;
use palpate::model::local::Kind as LocalModelKind;
use palpate::runtime::Disturbance;
use palpate::runtime::Nanos;
use palpate::safety::Actions;
use palpate::scene::SafetyStage;
use palpate::session::{Session, SessionBuilder, Summary};

fn session() -> SessionBuilder {
    Session::builder(block()).path(pressing()).model(LocalModelKind::Patch).virtual_time().keep_records()
}

fn tools(summary: &Summary) -> Vec<ToolSample> {
    let tool = |record: &LogRecord| match record {
        LogRecord::Tool(sample) => Some(*sample),
        _ => None,
    };
    summary.records.iter().filter_map(tool).collect()
}

fn run(builder: SessionBuilder, seconds: f64) -> Summary {
    let summary = builder.duration_s(seconds).build().unwrap().run().unwrap();
    assert_eq!(summary.runtime.fault, None);
    summary
}

/// How many commands a stage acted on, as the report counts them and as the records show.
fn count(summary: &Summary, name: &str, stage: Actions) -> u64 {
    let told =
        summary.report.devices[0].limits.stages.iter().find(|(stage, _)| stage == name).map_or(0, |stage| stage.1);
    let recorded = commands(summary).iter().filter(|command| Actions(command.limits).contains(stage)).count();
    assert_eq!(told, recorded as u64, "{name}");
    told
}

#[test]
fn the_force_comes_in_over_two_seconds_and_the_computed_one_is_not_touched() {
    let session = || session().safety_off([SafetyStage::Tank, SafetyStage::Passivity]);
    let with = run(session(), 2.5);
    let without = run(session().safety_off([SafetyStage::StartUp]), 2.5);
    let computed = |summary: &Summary| forces(summary).iter().map(|force| bits(force.force_n)).collect::<Vec<_>>();
    assert_eq!(computed(&with), computed(&without));
    let gain = |n: usize| norm(commands(&with)[n].force_n) / norm(commands(&without)[n].force_n);
    // The tool touches after 6 ms: it was calm before.
    for (n, least, most) in [(500, 0.2, 0.27), (1000, 0.45, 0.52), (2100, 1.0, 1.0)] {
        assert!((least..=most).contains(&gain(n)), "{} at {n}", gain(n));
    }
    let acted = count(&with, "start_up", Actions::START_UP);
    assert!((2000..=2010).contains(&acted), "{acted}");
    assert_eq!(count(&without, "start_up", Actions::START_UP), 0);
}

#[test]
fn a_tool_that_starts_in_contact_is_not_pushed_until_it_was_let_go() {
    // Down within the first two ticks, faster than the start can be calm; up again after half a second, then down.
    let path = ToolPath::new(
        vec![0.0, 0.002, 0.5, 0.52, 0.6, 0.7, 3.0],
        [0.101, 0.09, 0.09, 0.11, 0.11, 0.092, 0.092].map(|z| [0.05, 0.052, z]).into(),
    );
    let summary = run(session().path(path.unwrap()), 3.0);
    let (forces, commands) = (forces(&summary), commands(&summary));
    let pushed = forces.iter().position(|force| norm(force.force_n) >= 0.2).unwrap();
    assert!(pushed < 4, "it was calm for {pushed} ticks");
    assert!(commands[..500].iter().all(|command| command.force_n == [0.0; 3]));
    assert!(norm(commands[2900].force_n) > 0.3, "engaged by then: {:?}", commands[2900]);
}

#[test]
fn what_is_off_is_in_environment_and_report_and_two_stages_cannot_be() {
    let off = [SafetyStage::Slew, SafetyStage::ToolSpeed, SafetyStage::Tank, SafetyStage::Passivity]
        .into_iter()
        .chain([SafetyStage::ModelAge, SafetyStage::StartUp, SafetyStage::Watchdog]);
    let summary = run(session().safety_off(off), 0.3);
    let told = &summary.report.environment.as_ref().unwrap().safety_off;
    assert_eq!(told.join(" "), "slew tool_speed tank passivity model_age start_up watchdog");
    assert!(summary.report.to_string().contains("SAFETY OFF slew, tool_speed, tank, passivity"), "{}", summary.report);
    // Nothing acted, so the device gets what was computed, bit for bit.
    assert_eq!(summary.report.devices[0].limits.limited, 0);
    assert!(commands(&summary).iter().zip(forces(&summary)).all(|(command, force)| command.force_n == force.force_n));
    for stage in SafetyStage::ALL {
        let built = session().safety_off([stage]).build();
        match built {
            Ok(_) => assert!(stage.can_be_off()),
            Err(error) => {
                assert!(!stage.can_be_off());
                assert!(error.to_string().contains("safety_off(): names"), "{error}");
            }
        }
    }
}

#[test]
fn a_model_that_nobody_renews_fades_within_300_ms_and_comes_back_with_the_next() {
    let stall = |release: u64| Disturbance {
        late_wake: if release == 30 { Nanos(1_000_000_000) } else { Nanos::ZERO },
        ..Disturbance::default()
    };
    let builder = session().safety_off([SafetyStage::StartUp]).disturb("global", stall);
    let summary = run(builder, 3.0);
    let (forces, commands) = (forces(&summary), commands(&summary));
    let acted = count(&summary, "model_age", Actions::MODEL_AGE);
    assert!(acted > 800, "{acted}");
    for (force, command) in forces.iter().zip(&commands) {
        let is_old = force.model_age_s > 0.1 + 1e-9;
        assert!(!is_old || Actions(command.limits).contains(Actions::MODEL_AGE), "{force:?}");
        assert!(force.model_age_s < 0.3 || norm(command.force_n) <= 0.01, "{force:?} {command:?}");
    }
    let oldest = forces.iter().map(|force| force.model_age_s).fold(0.0, f64::max);
    assert!(oldest > 0.9, "the case is no case: {oldest} s");
    let last = commands.last().unwrap();
    assert!(last.limits & Actions::MODEL_AGE.0 == 0 && norm(last.force_n) > 0.1, "{last:?}");
}

/// Presses and then says nothing for 50 ms.
#[derive(Debug)]
struct Silent(ToolPath);

impl Device for Silent {
    fn name(&self) -> &str {
        "silent"
    }

    fn capabilities(&self) -> Capabilities {
        Capabilities::default()
    }

    fn read(&mut self, time: Nanos) -> Result<DeviceState, DeviceFault> {
        let t = time.as_secs_f64();
        if (0.3..0.35).contains(&t) {
            return Err(DeviceFault::Stale);
        }
        Ok(DeviceState { position: Vec3::from(self.0.at(t)), ..DeviceState::default() })
    }

    fn write(&mut self, _: ForceCommand) -> Result<(), DeviceFault> {
        Ok(())
    }
}

#[test]
fn a_silent_device_is_let_go_after_two_ticks_and_taken_up_again_by_the_ramp() {
    let builder = session().device(Silent(pressing())).safety_off([SafetyStage::StartUp]);
    let summary = run(builder, 0.6);
    assert_eq!(count(&summary, "watchdog", Actions::WATCHDOG), 48);
    let commands = commands(&summary);
    let at = |ms: usize| norm(commands[ms - 1].force_n);
    let before = at(301);
    assert!(before > 0.3, "{before}");
    // The slew limit takes it out.
    assert!(at(302) < before - 0.3 && at(302 + (before / 0.5).ceil() as usize) == 0.0, "{} {}", at(302), at(303));
    assert!(at(349) == 0.0 && at(400) < 0.8 * before && at(455) > 0.5 * before);
}

#[test]
fn the_ledger_is_in_the_log_and_begins_with_what_the_scene_stores() {
    let summary = run(session().safety_off([SafetyStage::StartUp]), 1.0);
    let commands = commands(&summary);
    let mut booked = 0.0;
    for (pair, held) in tools(&summary).windows(2).skip(1).zip(&commands) {
        let moved = Vec3::from(pair[1].position_m) - Vec3::from(pair[0].position_m);
        booked -= Vec3::from(held.force_n).dot(&moved);
    }
    let told = commands.last().unwrap().energy_j;
    assert!(told > 1e-4 && (told - booked).abs() < 1e-12, "{told} J told, {booked} J done");
    let booked = told;
    assert_eq!(summary.report.devices[0].limits.energy.last_j, booked);
    assert!(summary.report.environment.unwrap().stored_j == 0.0);
}

#[test]
fn a_coupling_names_its_gains_and_margin_and_none_leaves_the_forces_alone() {
    let coupled = run(session().coupling().model(LocalModelKind::Full), 0.6);
    let told = coupled.report.environment.as_ref().unwrap().coupling.clone().unwrap();
    assert!(told.contains("K_c") && told.contains("margin"), "{told}");
    assert!(coupled.report.to_string().contains("coupling   K_c"), "{}", coupled.report);
    let direct = run(session().model(LocalModelKind::Full), 0.6);
    let peak = |summary: &Summary| summary.report.devices[0].force.peak_n;
    // In series with the body it is softer.
    assert!(peak(&coupled) < peak(&direct) && peak(&coupled) > 0.4 * peak(&direct), "{told}: {}", peak(&coupled));
}

#[test]
fn a_coupled_tool_does_not_swing() {
    let coupled = run(session().coupling().model(LocalModelKind::Full), 0.6);
    let direct = run(session().model(LocalModelKind::Full), 0.6);
    // Pressed, it changes no faster from tick to tick than without.
    let change = |pair: &[ForceSample]| norm(std::array::from_fn(|i| pair[1].force_n[i] - pair[0].force_n[i]));
    let largest = |summary: &Summary| forces(summary)[200..].windows(2).map(change).fold(0.0, f64::max);
    assert!(largest(&coupled) <= largest(&direct), "{} N, {} N", largest(&coupled), largest(&direct));
}
