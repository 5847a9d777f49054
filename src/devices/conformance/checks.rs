//! The checks, a function each.

use std::time::{Duration, Instant};

use crate::devices::{Calibration, Device, DeviceFault, ForceCommand};
use crate::model::Vec3;
use crate::runtime::Nanos;

/// Why a check did not pass.
#[derive(Clone, Debug)]
pub(super) enum Fail {
    Wrong(String),
    Unseen(String),
}

pub(super) type Seen = Result<(), Fail>;

type CheckFn = fn(&mut dyn Device) -> Seen;

/// Every check by its name, but that of a device that is cut off.
pub(super) const ALL: [(&str, CheckFn); 14] = [
    ("it has a name", has_a_name),
    ("what it can do is possible", capabilities),
    ("it says whether it is calibrated, and is not ready before", calibration),
    ("its states are finite, and what is none is a fault", states),
    ("it may be read twice at the start and after a gap", gaps),
    ("it takes forces up to its limit", forces),
    ("it refuses a force that is no number, and exerts none of it", not_finite),
    ("it exerts no more than its limit", limit),
    ("a force ends when it expires", expiry),
    ("a force that has expired does nothing", expired),
    ("its torque is a number, within its limit, and ends when it expires", torque),
    ("one that exerts nothing says so", exerts_nothing),
    ("it waits no longer than it is told", waits),
    ("it goes on after every fault", after_faults),
];

const TICK: Nanos = Nanos(1_000_000);
/// Longer than any transport that a simulated device may have, in ticks.
const SETTLED: u64 = 250;
/// Rounding of a norm.
const ROUNDING: f64 = 1.0 + 1e-9;

fn at(tick: u64) -> Nanos {
    Nanos(tick * TICK.0)
}

fn wrong<T>(message: impl Into<String>) -> Result<T, Fail> {
    Err(Fail::Wrong(message.into()))
}

/// Reads at `tick`; a state must be finite, and its orientation a turn.
fn read(device: &mut dyn Device, tick: u64) -> Result<bool, Fail> {
    match device.read(at(tick)) {
        Ok(state) if state.is_finite() && state.upright().is_some() => Ok(true),
        Ok(state) => wrong(format!("its state at {} is {state:?}", at(tick))),
        Err(_) => Ok(false),
    }
}

fn exerted(device: &dyn Device) -> Result<Vec3, Fail> {
    device.exerted().ok_or_else(|| Fail::Unseen("it does not tell what force it exerts".to_owned()))
}

fn has_a_name(device: &mut dyn Device) -> Seen {
    if device.name().trim().is_empty() { wrong("its name is empty") } else { Ok(()) }
}

fn capabilities(device: &mut dyn Device) -> Seen {
    device.capabilities().fault().map_or(Ok(()), wrong)
}

fn calibration(device: &mut dyn Device) -> Seen {
    let calibration = device.calibration();
    match (calibration, device.read(at(0))) {
        (Calibration::Done, _) | (_, Err(DeviceFault::NotReady)) => Ok(()),
        (_, told) => wrong(format!("its calibration is {calibration:?}, and a read gives {told:?}")),
    }
}

fn states(device: &mut dyn Device) -> Seen {
    let mut given = 0;
    for tick in 0..500 {
        given += u32::from(read(device, tick)?);
        // What a write says is checked by others.
        let _ = device.write(ForceCommand::until(Vec3::zeros(), at(tick + 5)));
    }
    match (given, device.calibration()) {
        (0, Calibration::Done) => wrong("it gave no state in 500 reads"),
        (0, _) => Err(Fail::Unseen("it is not calibrated".to_owned())),
        _ => Ok(()),
    }
}

fn gaps(device: &mut dyn Device) -> Seen {
    for tick in [0, 0, 1, 2, 30, 31, 1031, 1032] {
        read(device, tick)?;
    }
    Ok(())
}

fn forces(device: &mut dyn Device) -> Seen {
    let limit = device.capabilities().max_force_n;
    let mut tick = 0;
    for axis in [Vec3::x(), Vec3::y(), Vec3::z()] {
        for share in [0.0, 0.1, 1.0, -1.0, -0.1, 0.0] {
            read(device, tick)?;
            let command = ForceCommand::until(axis * (share * limit), at(tick + 5));
            match device.write(command) {
                Err(DeviceFault::Refused) => {
                    return wrong(format!("it refused {:?} N, its limit is {limit} N", command.force));
                }
                // Of other faults the run is told: the device may be busy, or stopped.
                Ok(()) | Err(_) => tick += 1,
            }
        }
    }
    Ok(())
}

fn not_finite(device: &mut dyn Device) -> Seen {
    for (n, bad) in [f64::NAN, f64::INFINITY, f64::NEG_INFINITY].into_iter().enumerate() {
        let start = n as u64 * 2 * SETTLED;
        read(device, start)?;
        for axis in [Vec3::x(), Vec3::y(), Vec3::z()] {
            let force = axis.map(|c| if c > 0.0 { bad } else { 0.0 });
            if device.write(ForceCommand::until(force, Nanos(u64::MAX))).is_ok() {
                return wrong(format!("it took {force:?} N"));
            }
        }
        for tick in 1..SETTLED {
            read(device, start + tick)?;
            match device.exerted() {
                Some(force) if !force.iter().all(|c| c.is_finite()) => return wrong(format!("it exerts {force:?} N")),
                Some(force) if tick + 1 == SETTLED && force != Vec3::zeros() => {
                    return wrong(format!("it still exerts {force:?} N"));
                }
                _ => {}
            }
        }
    }
    Ok(())
}

fn limit(device: &mut dyn Device) -> Seen {
    let limit = device.capabilities().max_force_n;
    exerted(device)?;
    for tick in 0..SETTLED {
        read(device, tick)?;
        let force = exerted(device)?;
        if force.norm() > limit * ROUNDING {
            return wrong(format!("it exerts {} N, its limit is {limit} N", force.norm()));
        }
        // Refused or shortened, both are right.
        let _ = device.write(ForceCommand::until(Vec3::new(10.0 * limit, -limit, limit), at(tick + 5)));
    }
    Ok(())
}

fn expiry(device: &mut dyn Device) -> Seen {
    exerted(device)?;
    let force = Vec3::repeat(0.1 * device.capabilities().max_force_n);
    read(device, 0)?;
    let expires = at(SETTLED);
    // A device that takes no force now has nothing to end.
    if let Err(fault) = device.write(ForceCommand::until(force, expires)) {
        return Err(Fail::Unseen(format!("it took no force: {fault}")));
    }
    let mut acted = false;
    for tick in 1..SETTLED {
        read(device, tick)?;
        acted |= exerted(device)? != Vec3::zeros();
    }
    if device.exerts_force() && !acted {
        return wrong(format!("it exerts nothing of {force:?} N before the expiry"));
    }
    read(device, SETTLED)?;
    match exerted(device)? {
        left if left == Vec3::zeros() => Ok(()),
        left => wrong(format!("it exerts {left:?} N at {expires}, when the command has expired")),
    }
}

fn expired(device: &mut dyn Device) -> Seen {
    exerted(device)?;
    read(device, 10)?;
    let force = Vec3::repeat(0.1 * device.capabilities().max_force_n);
    // Taken or not, it must not act.
    let _ = device.write(ForceCommand::until(force, at(10)));
    for tick in 10..10 + SETTLED {
        read(device, tick)?;
        let left = exerted(device)?;
        if left != Vec3::zeros() {
            return wrong(format!("it exerts {left:?} N of a command that expired before it was given"));
        }
    }
    Ok(())
}

/// One that has no torque is given none.
fn torque(device: &mut dyn Device) -> Seen {
    let Some(limit) = device.capabilities().max_torque_n_m else { return Ok(()) };
    read(device, 0)?;
    let command = |torque: Vec3, expires: Nanos| ForceCommand::until(Vec3::zeros(), expires).with_torque(torque);
    for bad in [f64::NAN, f64::INFINITY] {
        if device.write(command(Vec3::new(0.0, bad, 0.0), Nanos(u64::MAX))).is_ok() {
            return wrong(format!("it took a torque of {bad} N m"));
        }
    }
    if device.write(command(Vec3::x() * limit, at(1))) == Err(DeviceFault::Refused) {
        return wrong(format!("it refused {limit} N m, which is its limit"));
    }
    let exerted = |device: &dyn Device| {
        device.exerted_torque().ok_or_else(|| Fail::Unseen("it does not tell what torque it exerts".to_owned()))
    };
    exerted(device)?;
    let mut acted = false;
    for tick in 1..SETTLED {
        read(device, tick)?;
        let torque = exerted(device)?;
        if !torque.norm().is_finite() || torque.norm() > limit * ROUNDING {
            return wrong(format!("it exerts {} N m, its limit is {limit} N m", torque.norm()));
        }
        acted |= torque != Vec3::zeros();
        // Refused or shortened, both are right.
        let _ = device.write(command(Vec3::new(10.0 * limit, -limit, limit), at(tick + 5)));
    }
    let expires = at(2 * SETTLED);
    if let Err(fault) = device.write(command(Vec3::z() * (0.5 * limit), expires)) {
        return Err(Fail::Unseen(format!("it took no torque: {fault}")));
    }
    for tick in SETTLED..2 * SETTLED {
        read(device, tick)?;
        acted |= exerted(device)? != Vec3::zeros();
    }
    if device.exerts_force() && !acted {
        return wrong("it exerts nothing of the torque that it takes");
    }
    read(device, 2 * SETTLED)?;
    match exerted(device)? {
        left if left == Vec3::zeros() => Ok(()),
        left => wrong(format!("it exerts {left:?} N m at {expires}, when the command has expired")),
    }
}

fn exerts_nothing(device: &mut dyn Device) -> Seen {
    if device.exerts_force() {
        return Ok(());
    }
    for tick in 0..10 {
        read(device, tick)?;
        // What counts is what follows.
        let _ = device.write(ForceCommand::until(Vec3::x(), at(tick + 5)));
        if let Some(force) = device.exerted().filter(|force| *force != Vec3::zeros()) {
            return wrong(format!("it says that it exerts nothing, and exerts {force:?} N"));
        }
    }
    Ok(())
}

/// A wait that is longer than its timeout by so much hangs; a scheduler that is busy does not take as long.
const HANGS: Duration = Duration::from_secs(2);

fn waits(device: &mut dyn Device) -> Seen {
    read(device, 0)?;
    for timeout in [Duration::ZERO, Duration::from_millis(1), Duration::from_millis(20), Duration::ZERO] {
        let begun = Instant::now();
        device.wait(timeout);
        let took = begun.elapsed();
        if took > timeout + HANGS {
            return wrong(format!("it waited {took:?} of at most {timeout:?}"));
        }
    }
    Ok(())
}

fn after_faults(device: &mut dyn Device) -> Seen {
    // Two seconds in steps of 10 ms: a device that fails now and then does so in the middle of it.
    for step in 0..200 {
        let tick = 10 * step;
        for _ in 0..2 {
            read(device, tick)?;
            // Whatever it says, the next call is allowed.
            let _ = device.write(ForceCommand::until(Vec3::zeros(), at(tick + 5)));
        }
    }
    // The last command of a run.
    let _ = device.write(ForceCommand::ZERO);
    Ok(())
}

/// What a run has done when the cable comes off.
pub(super) fn before_disconnect(device: &mut dyn Device) {
    for tick in 0..10 {
        // The check is about what comes after.
        let _ = device.read(at(tick));
        let _ = device.write(ForceCommand::until(Vec3::zeros(), at(tick + 5)));
    }
}

pub(super) fn after_disconnect(device: &mut dyn Device) -> Seen {
    // It may take a moment to notice: there was a state on its way.
    let noticed = (10..10 + SETTLED).find(|&tick| {
        std::thread::sleep(Duration::from_millis(1));
        device.read(at(tick)) == Err(DeviceFault::Disconnected)
    });
    let Some(noticed) = noticed else {
        return wrong(format!("{SETTLED} reads after it was disconnected none has said so"));
    };
    for tick in noticed + 1..noticed + 100 {
        if let Ok(state) = device.read(at(tick)) {
            return wrong(format!("it gives the state {state:?} without being connected"));
        }
        if device.write(ForceCommand::until(Vec3::zeros(), at(tick + 5))).is_ok() {
            return wrong("it takes a force without being connected");
        }
    }
    device.wait(Duration::ZERO);
    Ok(())
}
