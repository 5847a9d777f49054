//! The simulated device as a whole: expiry, saturation, encoder, velocity, release, and that time is all it depends on.

use super::*;
use crate::model::Turn;
use proptest::prelude::*;

const MS: u64 = 1_000_000;
const FOR_GOOD: Nanos = Nanos(u64::MAX);

fn plant() -> PlantSpec {
    PlantSpec { friction_n: 0.0, encoder_step_m: 0.0, ..PlantSpec::default() }
}

fn device(plant: PlantSpec, hand: HandSpec) -> Hand {
    Hand::new(ToolPath::constant([0.0; 3]).unwrap(), plant, hand, Capabilities::TOUCH).unwrap()
}

fn no_hand() -> HandSpec {
    HandSpec { release_s: Some(0.0), ..HandSpec::default() }
}

fn push(n: f64) -> Vec3 {
    Vec3::new(n, 0.0, 0.0)
}

// Check that a command acts until its expiry and not a nanosecond longer, however seldom the device is read.
#[test]
fn an_expired_force_is_gone_without_anybody_telling() {
    for reads_ms in [1, 7, 100] {
        let mut device = device(plant(), no_hand());
        device.read(Nanos::ZERO).unwrap();
        device.write(ForceCommand::until(push(1.0), Nanos(20 * MS + 1))).unwrap();
        (0..=100 / reads_ms).for_each(|n| assert!(device.read(Nanos(n * reads_ms * MS)).is_ok()));
        assert_eq!(device.exerted(), Some(Vec3::zeros()));
        // 1 N on 0.1 kg for 20.000001 ms, less a little friction of 0.1 N s/m.
        let velocity = device.axes[0].velocity;
        assert!((0.17..0.2).contains(&velocity), "{velocity}");
    }
}

#[test]
fn a_force_above_the_limit_is_shortened_and_one_that_is_no_number_leaves_none() {
    let mut device = device(plant(), no_hand());
    device.write(ForceCommand::until(push(100.0), FOR_GOOD)).unwrap();
    device.read(Nanos(MS)).unwrap();
    assert!((device.exerted().unwrap().norm() - 3.3).abs() < 1e-12);
    for force in [f64::NAN, f64::INFINITY] {
        assert_eq!(device.write(ForceCommand::until(push(force), FOR_GOOD)), Err(DeviceFault::Refused));
        device.read(Nanos(2 * MS)).unwrap();
        assert_eq!(device.exerted(), Some(Vec3::zeros()));
    }
}

#[test]
fn a_delay_holds_a_command_back_for_so_long() {
    let mut device = device(PlantSpec { delay_ms: 3.0, ..plant() }, no_hand());
    device.read(Nanos(MS)).unwrap();
    device.write(ForceCommand::until(push(1.0), FOR_GOOD)).unwrap();
    let forces = [2, 3, 4, 5].map(|ms| {
        device.read(Nanos(ms * MS)).unwrap();
        device.exerted().unwrap().x
    });
    assert_eq!(forces, [0.0, 0.0, 1.0, 1.0]);
}

#[test]
fn a_tool_that_is_let_go_flies_and_one_that_is_held_comes_back() {
    let plant = || PlantSpec { bias_n: [0.0, 0.0, -0.5], ..plant() };
    let held = HandSpec { release_s: Some(0.5), ..HandSpec::default() };
    let mut device = device(plant(), held);
    let rest = device.read(Nanos(499 * MS)).unwrap().position.z;
    // The spring of 300 N/m carries 0.5 N.
    assert!((rest + 0.5 / 300.0).abs() < 1e-5, "{rest}");
    let fallen = device.read(Nanos(600 * MS)).unwrap().position.z - rest;
    // 0.5 N on 0.1 kg for 100 ms.
    assert!((fallen + 0.025).abs() < 0.002, "{fallen}");
}

#[test]
fn the_encoder_tells_multiples_of_its_step_and_a_still_tool_has_no_velocity() {
    let step = 60e-6;
    let path = ToolPath::new(vec![0.0, 1.0], vec![[0.0; 3], [0.05, 0.0, 0.0]]).unwrap();
    let spec = PlantSpec { encoder_step_m: step, ..plant() };
    let mut moving = Hand::new(path, spec, HandSpec::default(), Capabilities::TOUCH).unwrap();
    let mut velocity = 0.0;
    for ms in 0..900 {
        let state = moving.read(Nanos(ms * MS)).unwrap();
        let steps = state.position.x / step;
        assert!((steps - steps.round()).abs() < 1e-9 && (state.position.x - moving.place().x).abs() <= 0.501 * step);
        velocity = state.velocity.x;
    }
    // One encoder step in 1 ms is 60 mm/s; the filter of 100 Hz leaves less than half of it on top of 50 mm/s.
    assert!((velocity - 0.05).abs() < 0.03, "{velocity}");
    let mut still = device(PlantSpec { encoder_step_m: step, ..plant() }, HandSpec::default());
    assert_eq!(still.read(Nanos(900 * MS)).unwrap(), DeviceState::default());
}

#[test]
fn a_tool_moves_along_its_free_axes_only() {
    let mut device = device(PlantSpec { axes: vec![Axis::Z], bias_n: [1.0; 3], ..plant() }, no_hand());
    let position = device.read(Nanos(100 * MS)).unwrap().position;
    assert!((position.x, position.y) == (0.0, 0.0) && position.z > 0.01, "{position}");
    assert_eq!(device.capabilities().degrees_of_freedom, 1);
}

#[test]
fn a_parameter_that_cannot_be_is_refused_by_name() {
    let path = ToolPath::constant([0.0; 3]).unwrap();
    let bad = PlantSpec { mass_kg: -1.0, ..plant() };
    let error = Hand::new(path, bad, HandSpec::default(), Capabilities::TOUCH).unwrap_err();
    assert!(error.to_string().starts_with("mass_kg: is -1"), "{error}");
}

// Check that the hand turns the device to where its path is turned, that a torque turns it against the hand's spring, and that
// neither moves it.
#[test]
fn a_hand_turns_the_device_and_a_torque_turns_it_against_the_hand() {
    let quaternion = |angle: f64| [(0.5 * angle).cos(), 0.0, 0.0, (0.5 * angle).sin()];
    let path = ToolPath::new(vec![0.0, 0.2], vec![[0.0; 3]; 2]).unwrap();
    let path = path.turned(&[quaternion(0.0), quaternion(0.3)]).unwrap();
    let spec = PlantSpec { max_torque_n_m: Some(0.05), ..plant() };
    let mut device = Hand::new(path, spec, HandSpec::default(), Capabilities::TOUCH).unwrap();
    assert_eq!(device.capabilities().max_torque_n_m, Some(0.05));
    let state = device.read(Nanos(800 * MS)).unwrap();
    assert!((state.orientation.angle() - 0.3).abs() < 1e-6, "{}", state.orientation.angle());
    // Ten times as much as it can: 0.05 N m on 1 N m/rad are 0.05 rad.
    let torque = Vec3::new(0.0, 0.0, 0.5);
    device.write(ForceCommand::until(Vec3::zeros(), Nanos(1600 * MS)).with_torque(torque)).unwrap();
    let state = device.read(Nanos(1599 * MS)).unwrap();
    assert!((state.orientation.angle() - 0.35).abs() < 1e-6, "{}", state.orientation.angle());
    assert_eq!(device.exerted_torque(), Some(Vec3::new(0.0, 0.0, 0.05)));
    assert_eq!(state.position, Vec3::zeros());
    device.read(Nanos(1600 * MS)).unwrap();
    assert_eq!(device.exerted_torque(), Some(Vec3::zeros()), "it has expired");
}

// Check that a device without motors that turn it is turned by no command, whatever it says.
#[test]
fn a_device_that_exerts_no_torque_exerts_none() {
    let mut device = device(plant(), no_hand());
    device.read(Nanos::ZERO).unwrap();
    device.write(ForceCommand::until(Vec3::zeros(), FOR_GOOD).with_torque(Vec3::x())).unwrap();
    let state = device.read(Nanos(50 * MS)).unwrap();
    assert_eq!((device.exerted_torque(), state.orientation), (Some(Vec3::zeros()), Turn::identity()));
}

proptest! {
    // Check that reads on the grid of the integration do not change the motion: the state is a function of time and of
    // commands alone.
    #[test]
    fn a_device_that_is_read_seldom_is_where_one_that_is_read_often_is(
        seed: u64, jitter_ms in 0.0..3.0_f64, forces in prop::collection::vec(-3.0..3.0_f64, 1..30),
    ) {
        let spec = PlantSpec { friction_n: 0.1, delay_ms: 0.4, jitter_ms, seed, ..PlantSpec::default() };
        let [mut often, mut seldom] = [0, 1].map(|_| device(spec.clone(), HandSpec::default()));
        for (n, force) in forces.iter().enumerate() {
            let time = Nanos(n as u64 * 10 * MS);
            for ms in 0..10 {
                often.read(time.saturating_sub(Nanos((9 - ms) * MS))).unwrap();
            }
            seldom.read(time).unwrap();
            let command = ForceCommand::until(push(*force), time + Nanos(25 * MS));
            prop_assert_eq!(often.write(command), seldom.write(command));
            prop_assert_eq!(often.axes, seldom.axes);
        }
    }

    #[test]
    fn whatever_is_written_the_state_is_finite_and_the_force_within_its_limit(
        forces in prop::collection::vec(prop::array::uniform3(prop_oneof![any::<f64>(), -5.0..5.0]), 1..50),
    ) {
        let mut device = device(PlantSpec::default(), HandSpec::default());
        for (ms, force) in forces.into_iter().enumerate() {
            let time = Nanos(ms as u64 * MS);
            prop_assert!(device.read(time).unwrap().is_finite());
            // Refused or not, it must not show.
            let _ = device.write(ForceCommand::until(Vec3::from(force), time + Nanos(5 * MS)));
            prop_assert!(device.exerted().unwrap().norm() <= 3.3 * (1.0 + 1e-12));
        }
    }
}
