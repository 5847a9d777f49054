//! The library itself: its version, and what went wrong last.

use std::ffi::c_char;

use crate::{code, last_error};

/// The version of the library, such as `0.1.0`.
#[unsafe(no_mangle)]
pub extern "C" fn palpate_version() -> *const c_char {
    const VERSION: &str = concat!(env!("CARGO_PKG_VERSION"), "\0");
    VERSION.as_ptr().cast()
}

/// The text of the last call of this thread that failed; empty if none has. It is overwritten by the next that fails: copy it.
///
/// Real-time safe.
#[unsafe(no_mangle)]
pub extern "C" fn palpate_last_error() -> *const c_char {
    last_error::text()
}

/// The name of a code, such as `PALPATE_CODE_SCENE`.
///
/// Real-time safe.
#[unsafe(no_mangle)]
pub extern "C" fn palpate_code_name(code: i32) -> *const c_char {
    code::name(code).as_ptr()
}
