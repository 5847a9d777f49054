//! Setting a session up: from a scene or a body, and what is to be different.

use std::ffi::c_char;
use std::path::Path;

use palpate::devices::ToolPath;
use palpate::model::contact::ToolShape;
use palpate::scene::{ModelChoice, Scene};

use crate::boundary::boundary;
use crate::code::{Failure, PalpateCode};
use crate::memory::{numbers, put_made, read, text};
use crate::setup::{Mesh, SETUPS, Setup};
use crate::types::{PalpateBlock, PalpateSetup, PalpateTetrahedra};

/// Puts the handle of what `make` gives at `setup`.
///
/// # Safety
/// `setup` is null or can be written.
unsafe fn give(setup: *mut PalpateSetup, make: impl FnOnce() -> Result<Setup, Failure>) -> PalpateCode {
    // SAFETY: the caller's promise.
    boundary(|| unsafe { put_made(setup, "setup", || Ok(PalpateSetup { id: SETUPS.add(make()?) })) })
}

/// Sets a session up from a scene file, with the paths in it relative to the file.
///
/// # Safety
/// `path` is null or a text that a zero byte ends; `setup` is null or can be written.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn palpate_setup_from_file(path: *const c_char, setup: *mut PalpateSetup) -> PalpateCode {
    // SAFETY: the caller's promise.
    unsafe { give(setup, || Setup::of_file(Path::new(&text(path, "path")?))) }
}

/// Sets a session up from the text of a scene file. Paths in it are relative to `folder`, or to the current folder if that is null.
///
/// # Safety
/// `toml` and `folder` are null or texts that a zero byte ends; `setup` is null or can be written.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn palpate_setup_from_toml(
    toml: *const c_char,
    folder: *const c_char,
    setup: *mut PalpateSetup,
) -> PalpateCode {
    // SAFETY: the caller's promise.
    unsafe {
        give(setup, || {
            let folder = if folder.is_null() { ".".to_owned() } else { text(folder, "folder")? };
            Ok(Setup::of_scene(Scene::from_toml(&text(toml, "toml")?, "toml", Some(Path::new(&folder)))?))
        })
    }
}

/// Sets a session up with the built-in scene `demo`: a tool that presses a block and drags over it.
///
/// # Safety
/// `setup` is null or can be written.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn palpate_setup_demo(setup: *mut PalpateSetup) -> PalpateCode {
    // SAFETY: the caller's promise.
    unsafe { give(setup, || Ok(Setup::of_scene(Scene::demo()))) }
}

/// Sets a session up with a block of springs.
///
/// # Safety
/// `block` is null or a struct that begins with its size; `setup` is null or can be written.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn palpate_setup_block(block: *const PalpateBlock, setup: *mut PalpateSetup) -> PalpateCode {
    // SAFETY: the caller's promise.
    unsafe { give(setup, || Setup::of_block(&read(block)?)) }
}

/// Sets a session up with a body of tetrahedra from arrays, which are copied.
///
/// # Safety
/// `body` is null or a struct that begins with its size, whose pointers are null or have as many values as it says; `setup` is null
/// or can be written.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn palpate_setup_tetrahedra(
    body: *const PalpateTetrahedra,
    setup: *mut PalpateSetup,
) -> PalpateCode {
    // SAFETY: the caller's promise.
    unsafe {
        give(setup, || {
            let body = read(body)?;
            Setup::of_tetrahedra(Mesh {
                points: numbers(body.points_m, body.point_count.saturating_mul(3), "points_m")?,
                elements: numbers(body.elements, body.element_count.saturating_mul(4), "elements")?,
                fixed: numbers(body.fixed_nodes, body.fixed_count, "fixed_nodes")?,
                tissue: body.tissue(),
            })
        })
    }
}

/// Frees a setup that is not started.
#[unsafe(no_mangle)]
pub extern "C" fn palpate_setup_free(setup: PalpateSetup) -> PalpateCode {
    boundary(|| SETUPS.take(setup.id).map(drop))
}

/// Sets the Coulomb coefficient; infinity for a tool that sticks until it is pulled off.
#[unsafe(no_mangle)]
pub extern "C" fn palpate_setup_friction(setup: PalpateSetup, coefficient: f64) -> PalpateCode {
    boundary(|| SETUPS.with(setup.id, |own| own.change(|builder| builder.friction(coefficient))))
}

/// Names the local model: `auto`, `full`, `hold`, `patch`, `linear_boundary`, `scaled_boundary`, `condensed`, `predicted` or
/// `predictive`.
///
/// # Safety
/// `model` is null or a text that a zero byte ends.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn palpate_setup_model(setup: PalpateSetup, model: *const c_char) -> PalpateCode {
    boundary(|| {
        // SAFETY: the caller's promise.
        let name = unsafe { text(model, "model")? };
        let model = ModelChoice::from_name(&name).ok_or_else(|| {
            Failure::argument(format!("model is {name:?}, must be {}", ModelChoice::NAMES.join(", ")))
        })?;
        SETUPS.with(setup.id, |own| own.change(|builder| builder.model(model)))
    })
}

/// Gives the tool the shape of a sphere of this radius (m); without, it is a point.
#[unsafe(no_mangle)]
pub extern "C" fn palpate_setup_sphere(setup: PalpateSetup, radius_m: f64) -> PalpateCode {
    boundary(|| SETUPS.with(setup.id, |own| own.change(|builder| builder.tool(ToolShape::Sphere { radius: radius_m }))))
}

/// Sets the rates of the two models (Hz), 1000 and 30 without.
#[unsafe(no_mangle)]
pub extern "C" fn palpate_setup_rates(setup: PalpateSetup, haptic_hz: f64, global_hz: f64) -> PalpateCode {
    boundary(|| SETUPS.with(setup.id, |own| own.set_rates(haptic_hz, global_hz)))
}

/// Lets the session end by itself after so many seconds. Without, a session of a scene that palpate loops runs as long as the scene
/// says, and all others until they are stopped.
#[unsafe(no_mangle)]
pub extern "C" fn palpate_setup_duration(setup: PalpateSetup, seconds: f64) -> PalpateCode {
    boundary(|| SETUPS.with(setup.id, |own| own.set_duration(seconds)))
}

/// Writes a log to `path`, overwriting what is there.
///
/// # Safety
/// `path` is null or a text that a zero byte ends.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn palpate_setup_log(setup: PalpateSetup, path: *const c_char) -> PalpateCode {
    boundary(|| {
        // SAFETY: the caller's promise.
        let path = unsafe { text(path, "path")? };
        SETUPS.with(setup.id, |own| own.change(|builder| builder.log(path)))
    })
}

/// Moves the tool of a session that palpate loops along a path: at `times_s` (s, increasing) it is at `positions_m` (m, three numbers
/// each), in between on straight lines.
///
/// # Safety
/// The pointers are null or have `count` times and three times as many positions.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn palpate_setup_path(
    setup: PalpateSetup,
    times_s: *const f64,
    positions_m: *const f64,
    count: usize,
) -> PalpateCode {
    boundary(|| {
        // SAFETY: the caller's promise.
        let (times, positions) = unsafe {
            let three = count.saturating_mul(3);
            (numbers(times_s, count, "times_s")?, numbers(positions_m, three, "positions_m")?)
        };
        let positions = positions.chunks_exact(3).map(|at| [at[0], at[1], at[2]]).collect();
        let path = ToolPath::new(times, positions)?;
        SETUPS.with(setup.id, |own| own.change(|builder| builder.path(path)))
    })
}

/// Runs in virtual time: bit-identical every time, as fast as the machine allows, on the thread that waits or ticks. A tick is then
/// one haptic period, and not real-time safe.
#[unsafe(no_mangle)]
pub extern "C" fn palpate_setup_virtual_time(setup: PalpateSetup) -> PalpateCode {
    boundary(|| SETUPS.with(setup.id, Setup::set_virtual))
}

/// Lets the local model be changed while the session runs, by palpate_set_model.
#[unsafe(no_mangle)]
pub extern "C" fn palpate_setup_switchable(setup: PalpateSetup) -> PalpateCode {
    boundary(|| SETUPS.with(setup.id, |own| own.change(|builder| builder.switchable())))
}

/// Lets palpate_contacts tell where the tools touch.
#[unsafe(no_mangle)]
pub extern "C" fn palpate_setup_share_contacts(setup: PalpateSetup) -> PalpateCode {
    boundary(|| SETUPS.with(setup.id, |own| own.change(|builder| builder.share_records())))
}
