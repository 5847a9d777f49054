//! What a call came to: a code for the program, and a text for people.

use std::borrow::Cow;

use palpate::{Error, ErrorKind};

/// What a call came to. `palpate_last_error` has the text.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum PalpateCode {
    /// Done.
    Ok = 0,
    /// A pointer that must not be null is.
    NullPointer = 1,
    /// The handle is none, or what it stood for is gone: stopped, freed or used up.
    BadHandle = 2,
    /// The call is for another thread: only the one that attached itself to a session's loop may tick it.
    WrongThread = 3,
    /// The `size` of a struct is not that of this library's: it was not set, or program and library are of different versions.
    WrongSize = 4,
    /// An argument is impossible, or the call does not fit what was done before. The text says what would be right.
    BadArgument = 5,
    /// The scene, body or setting is unknown, impossible or inconsistent. The text names it.
    Scene = 6,
    /// A file could not be read or written.
    Io = 7,
    /// The schedule was refused, or the system gave no thread.
    Runtime = 8,
    /// The device was refused.
    Device = 9,
    /// The session ended by a fault of its own.
    Fault = 10,
    /// The session has ended, as was asked for: there is nothing more to tick.
    Ended = 11,
    /// A bug in palpate: it panicked. The text is what to report.
    Internal = 12,
}

/// Why a call failed.
#[derive(Clone, Debug)]
pub(crate) struct Failure {
    pub(crate) code: PalpateCode,
    /// Borrowed on the way of a tick, which must not allocate.
    pub(crate) text: Cow<'static, str>,
}

impl Failure {
    /// Allocates nothing.
    pub(crate) const fn new(code: PalpateCode, text: &'static str) -> Self {
        Self { code, text: Cow::Borrowed(text) }
    }

    pub(crate) fn of(code: PalpateCode, text: String) -> Self {
        Self { code, text: Cow::Owned(text) }
    }

    pub(crate) fn argument(text: impl Into<Cow<'static, str>>) -> Self {
        Self { code: PalpateCode::BadArgument, text: text.into() }
    }
}

impl From<Error> for Failure {
    fn from(error: Error) -> Self {
        let code = match error.kind() {
            ErrorKind::Scene => PalpateCode::Scene,
            ErrorKind::Usage => PalpateCode::BadArgument,
            ErrorKind::Io | ErrorKind::Log => PalpateCode::Io,
            ErrorKind::Device => PalpateCode::Device,
            ErrorKind::Fault => PalpateCode::Fault,
            _ => PalpateCode::Runtime,
        };
        Self::of(code, error.to_string())
    }
}

/// The name of a code in C, ended by a zero byte.
pub(crate) fn name(code: i32) -> &'static std::ffi::CStr {
    match code {
        0 => c"PALPATE_CODE_OK",
        1 => c"PALPATE_CODE_NULL_POINTER",
        2 => c"PALPATE_CODE_BAD_HANDLE",
        3 => c"PALPATE_CODE_WRONG_THREAD",
        4 => c"PALPATE_CODE_WRONG_SIZE",
        5 => c"PALPATE_CODE_BAD_ARGUMENT",
        6 => c"PALPATE_CODE_SCENE",
        7 => c"PALPATE_CODE_IO",
        8 => c"PALPATE_CODE_RUNTIME",
        9 => c"PALPATE_CODE_DEVICE",
        10 => c"PALPATE_CODE_FAULT",
        11 => c"PALPATE_CODE_ENDED",
        12 => c"PALPATE_CODE_INTERNAL",
        _ => c"unknown",
    }
}
