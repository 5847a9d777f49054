//! The host's haptic loop: the sessions that the calling thread ticks.
//!
//! A thread attaches itself to a session once; what it needs for a tick is then in storage of its own. So a tick looks nothing up
//! that another thread could hold, and a call from any other thread is recognised by not finding it there.

use std::cell::RefCell;
use std::sync::{Arc, Mutex};

use palpate::devices::{DeviceState, ForceCommand, HostSide};
use palpate::runtime::{HostRelease, HostedGroup, Nanos, Rate};

use crate::code::{Failure, PalpateCode};
use crate::handles::lock;
use crate::session::{Host, Live, SESSIONS, Seat, Shared, with_running};
use crate::types::PalpateCommand;

/// More than a session may have: how many that is, it says itself.
pub(crate) const MOST_DEVICES: usize = 64;

thread_local! {
    static LOOPS: RefCell<Vec<HapticLoop>> = const { RefCell::new(Vec::new()) };
}

/// What ticks one session on this thread.
struct HapticLoop {
    session: u64,
    pace: Pace,
    devices: Vec<HostSide>,
}

/// What a tick lets run.
enum Pace {
    /// The haptic group, on this thread, by the clock.
    Clock(Box<HostedGroup>),
    /// All groups, on this thread, to the next release of virtual time.
    Virtual { running: Arc<Shared>, haptic: Rate, next: u64 },
    /// Nothing any more.
    Over,
}

/// Makes the calling thread the one that ticks `session`.
///
/// # Real-time
/// Not real-time safe: takes locks, allocates, touches the stack that a tick may need.
pub(crate) fn attach(session: u64) -> Result<(), Failure> {
    if LOOPS.with_borrow(|loops| loops.iter().any(|own| own.session == session)) {
        return Ok(());
    }
    let own = SESSIONS.with(session, |live| {
        let Seat { group, devices, haptic } = match std::mem::replace(&mut live.host, Host::Attached) {
            Host::Awaited(seat) => *seat,
            Host::Attached => {
                return Err(Failure::new(PalpateCode::WrongThread, "another thread is attached to this session"));
            }
            Host::Palpate => {
                live.host = Host::Palpate;
                let text = "palpate owns the loop of this session: start it with palpate_start_hosted to tick it";
                return Err(Failure::new(PalpateCode::BadArgument, text));
            }
        };
        let pace = match group {
            Some(group) => {
                group.prepare_thread();
                Pace::Clock(group)
            }
            None => Pace::Virtual { running: Arc::clone(&live.running), haptic, next: 0 },
        };
        Ok(HapticLoop { session, pace, devices })
    })?;
    LOOPS.with_borrow_mut(|loops| {
        // Those that ended here and were stopped elsewhere.
        loops.retain(|own| !matches!(own.pace, Pace::Over));
        loops.push(own);
    });
    Ok(())
}

/// Takes the session out of the calling thread, if it ticks it: its actors stop here.
pub(crate) fn detach(session: u64) {
    let own = LOOPS.with_borrow_mut(|loops| {
        let place = loops.iter().position(|own| own.session == session)?;
        Some(loops.swap_remove(place))
    });
    drop(own);
}

/// One tick: `state` gives each device's state, `command` takes what each is to exert. Commands are zero once it has ended.
///
/// # Real-time
/// Bounded and real-time safe, but in virtual time, and but for the tick that ends the session.
pub(crate) fn tick(
    session: u64,
    states: impl ExactSizeIterator<Item = Result<DeviceState, Failure>>,
    mut command: impl FnMut(usize, PalpateCommand) -> Result<(), Failure>,
) -> Result<(), Failure> {
    let found = LOOPS.with_borrow_mut(|loops| {
        let own = loops.iter_mut().find(|own| own.session == session)?;
        Some(own.tick(states, &mut command))
    });
    match found {
        Some(Ok(true)) => Ok(()),
        Some(Ok(false)) => Err(Failure::new(PalpateCode::Ended, "the session has ended: stop it")),
        Some(Err(failure)) => Err(failure),
        None => Err(not_here(session)),
    }
}

/// Why `session` cannot be ticked on this thread. Takes a lock: the call is a mistake.
fn not_here(session: u64) -> Failure {
    let why = SESSIONS.with(session, |live| {
        Ok(match live.host {
            Host::Palpate => Failure::new(PalpateCode::BadArgument, "palpate owns the loop of this session"),
            _ => Failure::new(
                PalpateCode::WrongThread,
                "this thread is not attached to the session: the thread of the loop calls palpate_attach, once",
            ),
        })
    });
    why.unwrap_or_else(|failure| failure)
}

impl HapticLoop {
    /// False once the session has ended.
    #[inline]
    fn tick(
        &mut self,
        states: impl ExactSizeIterator<Item = Result<DeviceState, Failure>>,
        command: &mut impl FnMut(usize, PalpateCommand) -> Result<(), Failure>,
    ) -> Result<bool, Failure> {
        if states.len() != self.devices.len() {
            return Err(Failure::new(PalpateCode::BadArgument, "the session has another number of devices"));
        }
        for (device, state) in self.devices.iter_mut().zip(states) {
            device.put(state?);
        }
        let (done, now) = self.pace.go()?;
        let ended = done == HostRelease::Ended;
        for (index, device) in self.devices.iter_mut().enumerate() {
            let exerted = if ended { ForceCommand::ZERO } else { device.command() };
            let told = PalpateCommand {
                size: size_of::<PalpateCommand>() as u32,
                is_new: (done == HostRelease::Ran).into(),
                force_n: exerted.at(now).into(),
                torque_n_m: exerted.torque_at(now).into(),
                time_s: now.as_secs_f64(),
            };
            command(index, told)?;
        }
        if ended {
            // The actors stop, and the run's own stop does not wait for this thread any more.
            self.pace = Pace::Over;
        }
        Ok(!ended)
    }
}

impl Pace {
    /// What the time asks for, and what time it is.
    fn go(&mut self) -> Result<(HostRelease, Nanos), Failure> {
        match self {
            Self::Clock(group) => {
                let done = group.release();
                Ok((done, group.elapsed()))
            }
            Self::Virtual { running, haptic, next } => {
                let until = haptic.release(*next);
                *next += 1;
                with_running(running, |running| {
                    running.wait_for(until.saturating_sub(running.elapsed()).to_duration());
                    let done = if running.finished() { HostRelease::Ended } else { HostRelease::Ran };
                    (done, until)
                })
            }
            Self::Over => Ok((HostRelease::Ended, Nanos::ZERO)),
        }
    }
}

/// Puts a seat that nobody took out of the way of a stop.
pub(crate) fn vacate(live: &Mutex<Live>) {
    let host = std::mem::replace(&mut lock(live).host, Host::Attached);
    drop(host);
}
