//! A tick of a host's allocates nothing and makes no system call, with contact and resyncs in it: neither one that computes, nor one
//! that comes early, nor one that fails. In a process of its own, which its guards would end; that they do is checked by the engine's
//! test of the same name.
#![cfg(all(target_os = "linux", any(target_arch = "x86_64", target_arch = "aarch64")))]

#[allow(dead_code)]
#[path = "../../tests/hot_path_support/allocator.rs"]
mod allocator;
#[allow(dead_code)]
#[path = "../../tests/hot_path_support/kernel.rs"]
mod kernel;

use palpate_ffi::exports::{run, setup, tick};
use palpate_ffi::{
    PalpateBlock, PalpateCode, PalpateCommand, PalpateDevice, PalpateSession, PalpateSetup, PalpateState,
};
use std::ffi::CString;
use std::ptr::null;
use std::sync::{Arc, Mutex};
use std::time::Duration;

#[global_allocator]
static ALLOCATOR: allocator::Guarded = allocator::Guarded;

/// Names the local model of the process that is guarded.
const CHILD: &str = "PALPATE_FFI_GUARDED";
/// How a guarded process ends.
const WELL: i32 = 40;
const FELT_NOTHING: i32 = 41;
const NO_FILTER: i32 = 42;

#[track_caller]
fn assert_silent(model: &str) {
    let program = std::env::current_exe().unwrap();
    let ended = std::process::Command::new(program)
        .args(["--exact", "guarded", "--nocapture"])
        .env(CHILD, model)
        .output()
        .unwrap();
    let said = String::from_utf8_lossy(&ended.stderr);
    match ended.status.code() {
        Some(WELL) => {}
        Some(NO_FILTER) if std::env::var_os("PALPATE_REQUIRE_SECCOMP").is_none() => {
            println!("skipped: the kernel refuses the filter");
        }
        _ => panic!("{model}: {:?}: {said}", ended.status),
    }
}

#[test]
fn a_hosted_tick_with_a_patch_allocates_nothing_and_makes_no_system_call() {
    assert_silent("patch");
}

#[test]
fn a_hosted_predictive_tick_allocates_nothing_and_makes_no_system_call() {
    assert_silent("predictive");
}

#[test]
fn a_hosted_tick_with_the_whole_body_allocates_nothing_and_makes_no_system_call() {
    assert_silent("full");
}

/// What the others start: ends the process.
#[test]
fn guarded() {
    let Ok(model) = std::env::var(CHILD) else { return };
    let session = started(&model);
    // Filtered, the thread can neither wake another nor end: it leaves a code behind, which is looked for.
    let code = Arc::new(Mutex::new(None));
    let left = Arc::clone(&code);
    std::thread::spawn(move || {
        let code = ticks(session);
        *left.lock().unwrap() = Some(code);
        loop {
            sleep_a_period();
        }
    });
    loop {
        std::thread::sleep(Duration::from_millis(10));
        if let Some(code) = code.try_lock().ok().and_then(|code| *code) {
            kernel::exit_now(code);
        }
    }
}

#[track_caller]
fn ok(code: PalpateCode) {
    assert_eq!(code, PalpateCode::Ok);
}

fn started(model: &str) -> PalpateSession {
    let block = PalpateBlock {
        size: size_of::<PalpateBlock>() as u32,
        fixed_faces: 1 << 4,
        nodes: [8; 3],
        size_m: [0.1; 3],
        stiffness_n_per_m: 0.0,
        damping_ratio: 0.0,
        node_mass_kg: 0.0,
    };
    let device = PalpateDevice {
        size: size_of::<PalpateDevice>() as u32,
        reserved: 0,
        name: null(),
        max_force_n: 8.0,
        max_torque_n_m: 0.0,
        max_stiffness_n_per_m: 0.0,
        max_damping_n_s_per_m: 0.0,
        workspace_radius_m: 0.0,
        position_m: at(0).position_m,
        orientation: [0.0; 4],
    };
    let model = CString::new(model).unwrap();
    let (mut made, mut session) = (PalpateSetup::default(), PalpateSession::default());
    // SAFETY: every pointer is to a value of our own.
    unsafe {
        ok(setup::palpate_setup_block(&block, &mut made));
        ok(setup::palpate_setup_friction(made, 0.5));
        ok(setup::palpate_setup_model(made, model.as_ptr()));
        ok(run::palpate_start_hosted(made, &device, 1, &mut session));
    }
    session
}

/// The device at a tick: down by 1 cm, then along the surface and back.
fn at(tick: u32) -> PalpateState {
    let time = f64::from(tick) * 1e-3;
    let depth = 0.01 * (time / 0.25).min(1.0);
    PalpateState {
        size: size_of::<PalpateState>() as u32,
        buttons: 0,
        position_m: [0.048 + 0.01 * (3.0 * time).sin(), 0.052, 0.102 - depth],
        velocity_m_s: [0.03 * (3.0 * time).cos(), 0.0, 0.0],
        orientation: [0.0; 4],
    }
}

/// What came of them, as a code for the process to end with.
fn ticks(session: PalpateSession) -> i32 {
    const WARM_UP: u32 = 400;
    ok(tick::palpate_attach(session));
    let size = size_of::<PalpateCommand>() as u32;
    let mut command = PalpateCommand { size, is_new: 0, force_n: [0.0; 3], torque_n_m: [0.0; 3], time_s: 0.0 };
    let (mut felt, mut early) = (0, 0);
    for number in 0..2000 {
        if number == WARM_UP {
            if kernel::forbid_everything_but_sleep().is_err() {
                return NO_FILTER;
            }
            allocator::arm();
        }
        let state = at(number);
        // SAFETY: every pointer is null or to a value of our own.
        let codes = unsafe {
            [
                tick::palpate_tick(session, &state, &mut command),
                // Nothing has slept since: most periods have had their release.
                tick::palpate_tick(session, &state, &mut command),
                tick::palpate_tick(session, null(), &mut command),
            ]
        };
        if codes != [PalpateCode::Ok, PalpateCode::Ok, PalpateCode::NullPointer] {
            return 1;
        }
        felt += u32::from(number > WARM_UP && command.force_n[2] > 0.05);
        early += u32::from(command.is_new == 0);
        sleep_a_period();
    }
    if felt > 1000 && early > 1000 { WELL } else { FELT_NOTHING }
}

fn sleep_a_period() {
    let span = libc::timespec { tv_sec: 0, tv_nsec: 950_000 };
    // SAFETY: the pointer is to a timespec of our own; no remainder is asked for.
    unsafe { libc::clock_nanosleep(libc::CLOCK_MONOTONIC, 0, &span, std::ptr::null_mut()) };
}
