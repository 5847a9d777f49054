//! Sessions: started, waited for, changed while they run, stopped.

use std::ffi::c_char;

use palpate::model::local::Kind;
use palpate::scene::ModelChoice;

use crate::boundary::boundary;
use crate::code::{Failure, PalpateCode};
use crate::handles;
use crate::haptic_loop::{self, MOST_DEVICES};
use crate::memory::{check_size, put, put_made, read, text, write};
use crate::session::{self, Live, SESSIONS};
use crate::setup::SETUPS;
use crate::types::{PalpateDevice, PalpateSession, PalpateSetup, PalpateSummary};

/// Starts a session whose haptic loop palpate owns: a thread of its own at the haptic rate, and the tool moved by the device of the
/// scene or the path of the setup. The setup is used up, also if this fails.
///
/// # Safety
/// `session` is null or can be written.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn palpate_start(setup: PalpateSetup, session: *mut PalpateSession) -> PalpateCode {
    boundary(|| {
        // Before anything can fail.
        let own = taken(setup);
        let start = || {
            let own = own?;
            let is_virtual = own.is_virtual();
            Ok(PalpateSession { id: SESSIONS.add(Live::new(own.session()?.start()?, is_virtual, None)) })
        };
        // SAFETY: the caller's promise.
        unsafe { put_made(session, "session", start) }
    })
}

/// Starts a session whose haptic loop the host owns, for its `count` devices: the thread of that loop calls palpate_attach once and
/// then palpate_tick. Time begins with the first tick. The setup is used up, also if this fails.
///
/// # Safety
/// `devices` is null or an array of `count` structs, each of which begins with its size and whose name is null or a text that a zero
/// byte ends; `session` is null or can be written.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn palpate_start_hosted(
    setup: PalpateSetup,
    devices: *const PalpateDevice,
    count: usize,
    session: *mut PalpateSession,
) -> PalpateCode {
    boundary(|| {
        // Before anything can fail.
        let own = taken(setup);
        let start = || {
            let own = own?;
            // SAFETY: the caller's promise.
            let told = unsafe { named_devices(devices, count)? };
            let is_virtual = own.is_virtual();
            let (made, hosts, haptic) = own.hosted(&told)?;
            Ok(PalpateSession { id: SESSIONS.add(Live::new(made.start()?, is_virtual, Some((hosts, haptic)))) })
        };
        // SAFETY: the caller's promise.
        unsafe { put_made(session, "session", start) }
    })
}

/// The devices of a host, each with its name if it has one.
///
/// # Safety
/// `devices` is null or an array of `count` structs, each of which begins with its size and whose name is null or a text that a zero
/// byte ends.
unsafe fn named_devices(
    devices: *const PalpateDevice,
    count: usize,
) -> Result<Vec<(Option<String>, PalpateDevice)>, Failure> {
    if count == 0 || count > MOST_DEVICES {
        return Err(Failure::argument(format!("count is {count}, must be 1 to {MOST_DEVICES} devices")));
    }
    let named = |place: usize| {
        let device = if devices.is_null() { devices } else { devices.wrapping_add(place) };
        // SAFETY: the caller's promise: those before it have the right size, so this one begins here.
        let device = unsafe { read(device)? };
        // SAFETY: the caller's promise.
        let name = (!device.name.is_null()).then(|| unsafe { text(device.name, "name") }).transpose()?;
        Ok((name, device))
    };
    (0..count).map(named).collect()
}

fn taken(setup: PalpateSetup) -> Result<crate::setup::Setup, Failure> {
    let setup = SETUPS.take(setup.id)?;
    std::sync::Arc::into_inner(setup)
        .map(|setup| setup.into_inner().unwrap_or_else(std::sync::PoisonError::into_inner))
        .ok_or_else(|| Failure::argument("another thread is changing this setup"))
}

/// Waits for so many seconds, or until the session has ended, by itself or because another thread stops it; in virtual time, runs that
/// much of it. It keeps no other thread from the session.
#[unsafe(no_mangle)]
pub extern "C" fn palpate_wait(session: PalpateSession, seconds: f64) -> PalpateCode {
    boundary(|| {
        let (running, is_virtual) =
            SESSIONS.with(session.id, |live| Ok((std::sync::Arc::clone(&live.running), live.is_virtual)))?;
        session::wait(&running, is_virtual, seconds)
    })
}

/// The time since the start (s), simulated in virtual time, and whether the session has ended (1) or runs (0). Either pointer may be
/// null.
///
/// # Safety
/// Each pointer is null or can be written.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn palpate_progress(session: PalpateSession, time_s: *mut f64, ended: *mut i32) -> PalpateCode {
    boundary(|| {
        let running = SESSIONS.with(session.id, |live| Ok(std::sync::Arc::clone(&live.running)))?;
        let (time, over) =
            session::with_running(&running, |running| (running.elapsed().as_secs_f64(), running.finished()))?;
        if !time_s.is_null() {
            // SAFETY: the caller's promise.
            unsafe { put(time_s, time, "time_s")? };
        }
        if !ended.is_null() {
            // SAFETY: the caller's promise.
            unsafe { put(ended, over.into(), "ended")? };
        }
        Ok(())
    })
}

/// Wants the tool at a place (m), of a session that palpate loops and whose scene has a device of the kind `pointer`.
#[unsafe(no_mangle)]
pub extern "C" fn palpate_point(session: PalpateSession, x: f64, y: f64, z: f64) -> PalpateCode {
    boundary(|| {
        SESSIONS.with(session.id, |live| {
            let pointer = live.pointer.as_mut();
            let pointer = pointer.ok_or_else(|| Failure::argument("the session's device is no pointer"))?;
            match pointer.point([x, y, z]) {
                true => Ok(()),
                false => Err(Failure::argument(format!("({x}, {y}, {z}) is no place"))),
            }
        })
    })
}

/// Sets the Coulomb coefficient while the session runs.
#[unsafe(no_mangle)]
pub extern "C" fn palpate_set_friction(session: PalpateSession, coefficient: f64) -> PalpateCode {
    boundary(|| SESSIONS.with(session.id, |live| Ok(live.controls()?.set_friction(coefficient.into())?)))
}

/// Sets the stiffness of the body while the session runs, in that which it was made with.
#[unsafe(no_mangle)]
pub extern "C" fn palpate_set_stiffness(session: PalpateSession, factor: f64) -> PalpateCode {
    boundary(|| SESSIONS.with(session.id, |live| Ok(live.controls()?.set_stiffness(factor)?)))
}

/// Sets the local model while a switchable session runs.
///
/// # Safety
/// `model` is null or a text that a zero byte ends.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn palpate_set_model(session: PalpateSession, model: *const c_char) -> PalpateCode {
    boundary(|| {
        // SAFETY: the caller's promise.
        let name = unsafe { text(model, "model")? };
        let kind: Option<Kind> = ModelChoice::from_name(&name).and_then(ModelChoice::named);
        let kind = kind.ok_or_else(|| Failure::argument(format!("model is {name:?}, which is no local model")))?;
        SESSIONS.with(session.id, |live| Ok(live.controls()?.set_model(kind)?))
    })
}

/// Asks a session to end: force goes to zero within the ramp of its limits. Of one that the host loops the ticks that follow do that,
/// until one gives PALPATE_CODE_ENDED. Then stop it.
#[unsafe(no_mangle)]
pub extern "C" fn palpate_request_stop(session: PalpateSession) -> PalpateCode {
    boundary(|| {
        SESSIONS.with(session.id, |live| {
            live.stop.request();
            Ok(())
        })
    })
}

/// Stops a session, frees it, and tells what it came to, if `summary` is not null. Gives PALPATE_CODE_FAULT, with the text, if the
/// session ended by a fault; it is stopped then too.
///
/// On the thread that ticks it, it ends at once; from another thread it waits for the ticks that bring the force to rest. A loop that
/// does not tick any more is given up after 5 s, which is a fault.
///
/// # Safety
/// `summary` is null or a struct that begins with its size.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn palpate_stop(session: PalpateSession, summary: *mut PalpateSummary) -> PalpateCode {
    boundary(|| {
        if !summary.is_null() {
            // SAFETY: the caller's promise.
            unsafe { check_size(summary)? };
        }
        let live = SESSIONS.take(session.id)?;
        haptic_loop::detach(session.id);
        haptic_loop::vacate(&live);
        let (running, stop) = {
            let live = handles::lock(&live);
            (std::sync::Arc::clone(&live.running), live.stop.clone())
        };
        // Before its turn: so whoever waits, in virtual time, ends as soon. If this thread ticked it, it ticks no more.
        stop.request();
        let running = running.lock().take();
        let Some(running) = running else {
            return Err(Failure::new(PalpateCode::BadHandle, "the session has been stopped"));
        };
        let done = running.stop();
        if !summary.is_null() {
            // SAFETY: the caller's promise.
            unsafe { write(summary, session::figures(&done))? };
        }
        session::keep_text(done.to_string());
        match (&done.runtime.fault, &done.log_error) {
            (Some(fault), _) => Err(Failure::of(PalpateCode::Fault, fault.to_string())),
            (None, Some(error)) => Err(Failure::of(PalpateCode::Io, format!("log: {error}"))),
            (None, None) => Ok(()),
        }
    })
}

/// The report of the session that this thread stopped last, several lines; empty if it has stopped none. It is overwritten by the
/// next stop: copy it.
#[unsafe(no_mangle)]
pub extern "C" fn palpate_report() -> *const c_char {
    session::kept_text()
}
