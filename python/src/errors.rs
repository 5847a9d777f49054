//! The engine's errors as exceptions of the package, which `palpate/errors.py` declares.

use palpate::{Error, ErrorKind};
use pyo3::prelude::*;

/// A result whose error becomes an exception.
pub(crate) trait OrRaise<T> {
    /// The value, or the exception for its error.
    fn or_raise(self, py: Python<'_>) -> PyResult<T>;
}

impl<T> OrRaise<T> for Result<T, Error> {
    fn or_raise(self, py: Python<'_>) -> PyResult<T> {
        self.map_err(|error| raised(py, &error))
    }
}

/// What stands for the file in errors of what was given as Python's values: its lines are nobody's.
pub(crate) const DICTIONARY: &str = "scene";

/// The exception for `error`.
pub(crate) fn raised(py: Python<'_>, error: &Error) -> PyErr {
    let place = error.place();
    let message = error.to_string();
    let remedy = message.strip_prefix(place).and_then(|rest| rest.strip_prefix(": ")).unwrap_or(&message);
    let field = of_dictionary(place);
    exception(py, class(error.kind()), field.unwrap_or(place), remedy, field)
}

/// An exception of `class` in `palpate.errors`, about `place`, which is a `field` if that is given.
pub(crate) fn exception(py: Python<'_>, class: &str, place: &str, remedy: &str, field: Option<&str>) -> PyErr {
    let made = || py.import("palpate.errors")?.getattr(class)?.call1((place, remedy, field));
    made().map_or_else(|error| error, PyErr::from_value)
}

/// Whoever called asked for what cannot be.
pub(crate) fn usage(py: Python<'_>, argument: &str, remedy: &str) -> PyErr {
    exception(py, "UsageError", argument, remedy, Some(argument))
}

/// The field in `scene:12: body.block`: file and line are none that anybody wrote.
fn of_dictionary(place: &str) -> Option<&str> {
    let rest = place.strip_prefix(DICTIONARY)?.strip_prefix(':')?;
    rest.trim_start_matches(|c: char| c.is_ascii_digit()).strip_prefix(": ")
}

fn class(kind: ErrorKind) -> &'static str {
    match kind {
        ErrorKind::Scene => "SceneError",
        ErrorKind::Usage => "UsageError",
        ErrorKind::Io => "FileError",
        ErrorKind::Log => "LogError",
        ErrorKind::Device => "DeviceError",
        ErrorKind::Fault => "FaultError",
        _ => "RefusedError",
    }
}
