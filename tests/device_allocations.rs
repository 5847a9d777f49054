//! The devices of palpate neither allocate nor free in `read` and `write`: the process would be ended. That the guard ends it
//! is checked by `hot_path`.
#![cfg(target_os = "linux")]

#[path = "hot_path_support/allocator.rs"]
mod allocator;

use palpate::devices::{
    Capabilities, Device, DeviceState, FaultKind, FaultSpec, Faulty, ForceCommand, Hand, HandSpec, PlantSpec, Replayed,
    ReplayedSample, Scripted, ToolPath,
};
use palpate::model::Vec3;
use palpate::runtime::Nanos;

#[global_allocator]
static ALLOCATOR: allocator::Guarded = allocator::Guarded;

const MS: u64 = 1_000_000;

/// Three seconds of ticks, with forces that are fine, too large and no numbers.
fn drive(device: &mut dyn Device) -> u64 {
    let mut answered = 0;
    allocator::arm();
    for tick in 0..3000 {
        let time = Nanos(tick * MS);
        answered += u64::from(device.read(time).is_ok());
        let force = if tick % 100 == 99 { f64::NAN } else { (tick % 40) as f64 - 20.0 };
        let taken = device.write(ForceCommand::until(Vec3::repeat(force), time + Nanos(5 * MS)));
        answered += u64::from(taken.is_ok());
    }
    allocator::disarm();
    answered
}

fn hand() -> Hand {
    let path = ToolPath::new(vec![0.0, 2.0], vec![[0.0; 3], [0.1; 3]]).unwrap();
    // Eighty commands or more are on their way at once.
    let plant = PlantSpec { delay_ms: 80.0, jitter_ms: 20.0, ..PlantSpec::default() };
    let grip = HandSpec { grip: vec![[0.0, 1.0], [1.0, 0.2]], release_s: Some(2.0), ..HandSpec::default() };
    Hand::new(path, plant, grip, Capabilities::TOUCH).unwrap()
}

#[test]
fn no_device_touches_the_heap_in_a_tick() {
    let sample =
        |tick: u64| ReplayedSample { time: Nanos(tick * MS), id: tick as u32 + 1, state: DeviceState::default() };
    let samples: Vec<_> = (0..2000).map(sample).collect();
    let mut scripted = Scripted::new(ToolPath::constant([0.0; 3]).unwrap());
    let mut replayed = Replayed::new(DeviceState::default(), samples, Capabilities::TOUCH).at_any_rate();
    let kinds = [
        FaultKind::Late,
        FaultKind::Lost,
        FaultKind::Frozen,
        FaultKind::NotFinite,
        FaultKind::Disconnected,
        FaultKind::SafetyStop,
    ];
    let faults = kinds.into_iter().zip(1..).map(|(kind, n)| {
        let from_s = 0.4 * f64::from(n);
        FaultSpec { reads: 200, probability: 0.5, ..FaultSpec::new(kind, from_s, from_s + 0.3) }
    });
    let mut faulty = Faulty::new(hand(), faults.collect());
    let devices: [&mut dyn Device; 4] = [&mut scripted, &mut replayed, &mut hand(), &mut faulty];
    for device in devices {
        // Check that they were at work.
        assert!(drive(device) > 4000, "{device:?}");
    }
}
