//! Every device of palpate keeps to what a device must keep to, a program's own can be held to the same, and one that does
//! not is caught.

use palpate::devices::conformance::{Conformance, Verdict};
use palpate::devices::{
    Axis, Calibration, Capabilities, Device, DeviceFault, DeviceState, FaultKind, FaultSpec, Faulty, ForceCommand,
    Hand, HandSpec, PlantSpec, Pointer, PointerSpec, Replayed, ReplayedSample, SafetyStop, Scripted, ToolPath,
};
use palpate::model::Vec3;
use palpate::runtime::Nanos;

const MS: u64 = 1_000_000;

fn path() -> ToolPath {
    ToolPath::new(vec![0.0, 0.5], vec![[0.0, 0.0, 0.1], [0.02, 0.01, 0.09]]).unwrap()
}

fn hand(plant: PlantSpec) -> Hand {
    Hand::new(path(), plant, HandSpec { release_s: Some(0.2), ..HandSpec::default() }, Capabilities::TOUCH).unwrap()
}

fn samples() -> Vec<ReplayedSample> {
    let state = DeviceState { position: Vec3::new(0.0, 0.0, 0.1), ..DeviceState::default() };
    // Every seventh read has failed.
    let id = |n: u32| n + 1 - n.div_ceil(7);
    (0..600).map(|n| ReplayedSample { time: Nanos(u64::from(n) * MS), id: id(n), state }).collect()
}

fn assert_passed(report: &Conformance) {
    println!("{report}");
    assert!(report.passed(), "{report}");
}

#[test]
fn a_scripted_tool_conforms() {
    assert_passed(&Conformance::check(|| Scripted::new(path())));
}

#[test]
fn a_simulated_hand_conforms_and_everything_about_it_can_be_seen() {
    let plants = [
        PlantSpec::default(),
        PlantSpec { delay_ms: 80.0, jitter_ms: 20.0, seed: 3, ..PlantSpec::default() },
        PlantSpec { axes: vec![Axis::Z], encoder_step_m: 0.0, velocity_cutoff_hz: None, ..PlantSpec::default() },
    ];
    for plant in plants {
        let report = Conformance::check(|| hand(plant.clone()));
        assert_passed(&report);
        // All but the last, for which the suite needs to disconnect it.
        let seen = report.checks.iter().filter(|check| check.verdict == Verdict::Passed).count();
        assert_eq!(seen, report.checks.len() - 1, "{report}");
    }
}

#[test]
fn a_tool_behind_a_pointer_conforms_wherever_the_pointer_is() {
    assert_passed(&Conformance::check(|| {
        let (tool, mut pointer) = Pointer::new(PointerSpec::default(), [0.0; 3], Capabilities::TOUCH).unwrap();
        assert!(pointer.point([0.02, 0.0, -0.01]));
        tool
    }));
}

#[test]
fn a_replayed_tool_conforms_at_its_own_times_and_at_others() {
    assert_passed(&Conformance::check(|| Replayed::new(samples()[0].state, samples(), Capabilities::FALCON)));
    assert_passed(&Conformance::check(|| {
        Replayed::new(samples()[0].state, samples(), Capabilities::FALCON).at_any_rate()
    }));
}

fn failing(kind: FaultKind) -> Faulty<Box<dyn Device>> {
    let stop = SafetyStop::Stall;
    let fault = FaultSpec { reads: 5, probability: 0.5, seed: 1, stop, ..FaultSpec::new(kind, 0.010, 0.4) };
    Faulty::new(Box::new(hand(PlantSpec::default())), vec![fault])
}

#[test]
fn a_device_that_fails_in_order_conforms() {
    use FaultKind::{Disconnected, Frozen, Late, Lost, SafetyStop};
    for kind in [Late, Lost, Frozen, Disconnected, SafetyStop] {
        println!("{kind:?}");
        assert_passed(&Conformance::check(|| failing(kind)));
    }
    // Its cable comes off after 10 ms, as the suite's own.
    let report = Conformance::check_disconnecting(|| failing(FaultKind::Disconnected), |_| {});
    assert_passed(&report);
    assert_eq!(report.checks.last().map(|check| check.verdict), Some(Verdict::Passed));
}

/// A program's own device, right or with one thing wrong.
#[derive(Debug, Default)]
struct Own {
    wrong: Wrong,
    now: Nanos,
    command: ForceCommand,
    is_gone: bool,
}

#[derive(Clone, Copy, Debug, Default, PartialEq)]
enum Wrong {
    #[default]
    Nothing,
    NoName,
    ImpossibleCapabilities,
    GivesStatesUncalibrated,
    StateNotFinite,
    PanicsAfterGap,
    RefusesItsLimit,
    TakesNotFinite,
    ExertsTooMuch,
    NeverExpires,
    ExertsInSecret,
    WaitsTooLong,
    PanicsWhenGone,
}

impl Device for Own {
    fn name(&self) -> &str {
        if self.wrong == Wrong::NoName { "" } else { "own" }
    }

    fn capabilities(&self) -> Capabilities {
        let max_stiffness_n_per_m = if self.wrong == Wrong::ImpossibleCapabilities { -1.0 } else { 500.0 };
        Capabilities { max_force_n: 4.0, max_stiffness_n_per_m, ..Capabilities::default() }
    }

    fn exerts_force(&self) -> bool {
        self.wrong != Wrong::ExertsInSecret
    }

    fn calibration(&self) -> Calibration {
        if self.wrong == Wrong::GivesStatesUncalibrated { Calibration::Needed } else { Calibration::Done }
    }

    fn wait(&mut self, timeout: std::time::Duration) -> bool {
        if self.wrong == Wrong::WaitsTooLong {
            std::thread::sleep(timeout + std::time::Duration::from_millis(2200));
        }
        false
    }

    fn read(&mut self, time: Nanos) -> Result<DeviceState, DeviceFault> {
        let is_gap = time.saturating_sub(self.now) >= Nanos(1000 * MS);
        assert!(!(is_gap && self.wrong == Wrong::PanicsAfterGap), "it was read too late");
        self.now = time;
        if self.is_gone {
            assert!(self.wrong != Wrong::PanicsWhenGone, "where is it?");
            return Err(DeviceFault::Disconnected);
        }
        let x = if self.wrong == Wrong::StateNotFinite && time > Nanos(100 * MS) { f64::NAN } else { 0.1 };
        Ok(DeviceState { position: Vec3::new(x, 0.0, 0.0), ..DeviceState::default() })
    }

    fn write(&mut self, command: ForceCommand) -> Result<(), DeviceFault> {
        if self.is_gone {
            return Err(DeviceFault::Disconnected);
        }
        let limit_n = if self.wrong == Wrong::RefusesItsLimit { 3.0 } else { 4.0 };
        let is_too_much = command.force.norm() > limit_n && self.wrong != Wrong::ExertsTooMuch;
        if is_too_much || !(command.is_finite() || self.wrong == Wrong::TakesNotFinite) {
            self.command = ForceCommand::ZERO;
            return Err(DeviceFault::Refused);
        }
        self.command = command;
        Ok(())
    }

    fn exerted(&self) -> Option<Vec3> {
        Some(if self.wrong == Wrong::NeverExpires { self.command.force } else { self.command.at(self.now) })
    }
}

fn own(wrong: Wrong) -> Conformance {
    Conformance::check_disconnecting(|| Own { wrong, ..Own::default() }, |device| device.is_gone = true)
}

#[test]
fn a_programs_own_device_conforms() {
    let report = own(Wrong::Nothing);
    assert_passed(&report);
    assert!(report.checks.iter().all(|check| check.verdict == Verdict::Passed), "{report}");
}

// Check that every check can fail: each for the device that does just this wrong.
#[test]
fn each_fault_of_a_device_fails_the_check_that_is_about_it() {
    for (wrong, check) in [
        (Wrong::NoName, "it has a name"),
        (Wrong::ImpossibleCapabilities, "what it can do is possible"),
        (Wrong::GivesStatesUncalibrated, "it says whether it is calibrated, and is not ready before"),
        (Wrong::StateNotFinite, "its states are finite, and what is none is a fault"),
        (Wrong::PanicsAfterGap, "it may be read twice at the start and after a gap"),
        (Wrong::RefusesItsLimit, "it takes forces up to its limit"),
        (Wrong::TakesNotFinite, "it refuses a force that is no number, and exerts none of it"),
        (Wrong::ExertsTooMuch, "it exerts no more than its limit"),
        (Wrong::NeverExpires, "a force ends when it expires"),
        (Wrong::NeverExpires, "a force that has expired does nothing"),
        (Wrong::ExertsInSecret, "one that exerts nothing says so"),
        (Wrong::WaitsTooLong, "it waits no longer than it is told"),
        (Wrong::StateNotFinite, "it goes on after every fault"),
        (Wrong::PanicsWhenGone, "it tells that it is gone, again and again, and never panics"),
    ] {
        let report = own(wrong);
        assert_eq!(report.verdict(check), Some(Verdict::Failed), "{wrong:?}: {report}");
        // Nothing else is blamed, but for a state that is not finite, which many checks meet.
        let others = report.failures().filter(|failure| failure.name != check).count();
        assert!(others == 0 || matches!(wrong, Wrong::StateNotFinite | Wrong::NeverExpires), "{wrong:?}: {report}");
    }
}

#[test]
fn a_device_that_gives_states_that_are_no_numbers_is_caught() {
    let report = Conformance::check(|| failing(FaultKind::NotFinite));
    let verdict = report.verdict("its states are finite, and what is none is a fault");
    assert_eq!(verdict, Some(Verdict::Failed), "{report}");
}
