//! The haptic loop of a host.

use crate::boundary::boundary;
use crate::code::{Failure, PalpateCode};
use crate::haptic_loop::{self, MOST_DEVICES};
use crate::memory::{check_size, read, write};
use crate::types::{PalpateCommand, PalpateSession, PalpateState};

/// Makes the calling thread the one that ticks a session which was started with palpate_start_hosted, and readies it: touches the
/// stack that a tick may need. Policy, priority and core of the thread are the host's affair.
///
/// Not real-time safe: call it before the loop. A thread that ends, ends its sessions.
#[unsafe(no_mangle)]
pub extern "C" fn palpate_attach(session: PalpateSession) -> PalpateCode {
    boundary(|| haptic_loop::attach(session.id))
}

/// One haptic tick of a session with one device: takes what the device tells and gives what it is to exert.
///
/// The local model is computed in this call, on this thread: the force belongs to this state, with no tick of delay. The global model
/// and the log run on threads of palpate's. The first tick is time zero of the run and gives no force. After that, each call runs the
/// release of the period that it falls in, at the haptic rate of the session; a call in a period that has had its release gives the
/// command of before, with `is_new` 0, so a loop may be faster; of a slower one the periods between are made up, eight a tick at most.
///
/// Real-time safe: no allocation, no lock, no system call, no callback, nothing unwinds. Exceptions: in virtual time, and in the tick
/// that ends the session, which is the one that gives PALPATE_CODE_ENDED. Only on the thread that attached itself.
///
/// Whenever it gives anything but PALPATE_CODE_OK, exert nothing.
///
/// # Safety
/// `state` and `command` are null or structs that begin with their size.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn palpate_tick(
    session: PalpateSession,
    state: *const PalpateState,
    command: *mut PalpateCommand,
) -> PalpateCode {
    boundary(|| {
        // SAFETY: the caller's promise.
        unsafe { check_size(command)? };
        // SAFETY: the caller's promise.
        let state = unsafe { read(state) }.map(|state| state.state());
        // SAFETY: the caller's promise; there is one device.
        haptic_loop::tick(session.id, std::iter::once(state), |_, told| unsafe { write(command, told) })
    })
}

/// One haptic tick of a session with several devices, in the order in which they were given: see palpate_tick.
///
/// # Safety
/// `states` and `commands` are null or arrays of `count` structs, each of which begins with its size.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn palpate_tick_all(
    session: PalpateSession,
    states: *const PalpateState,
    commands: *mut PalpateCommand,
    count: usize,
) -> PalpateCode {
    boundary(|| {
        if count > MOST_DEVICES {
            return Err(Failure::new(PalpateCode::BadArgument, "count is more than the devices of any session"));
        }
        if states.is_null() || commands.is_null() {
            return Err(Failure::new(PalpateCode::NullPointer, "states or commands"));
        }
        for place in 0..count {
            // SAFETY: the caller's promise: those before it have the right size, so this one begins here.
            unsafe { check_size(commands.add(place))? };
        }
        // SAFETY: the caller's promise, likewise.
        let states = (0..count).map(|place| unsafe { read(states.add(place)) }.map(|state| state.state()));
        // SAFETY: the caller's promise; a session has no more devices than it is given commands for.
        haptic_loop::tick(session.id, states, |place, told| unsafe { write(commands.add(place), told) })
    })
}
