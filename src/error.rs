//! One error type for the whole crate.
//!
//! Every error is one line that says what, where and what to do. The [`ErrorKind`] decides the exit code of the command
//! and whether a retry can help.

use std::fmt;

use palpate_mesh::MeshError;
use palpate_model::ModelError;
use palpate_runtime::{GraphError, GraphErrorKind};

use crate::printable::{printable, within};

/// The kind of an error: the cause, and whether a retry can help.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
#[non_exhaustive]
pub enum ErrorKind {
    /// A scene or builder value is unknown, impossible or inconsistent. Correct the named field; a retry does not help.
    Scene,
    /// The command line or an argument of a call is unusable. Correct the call; a retry does not help.
    Usage,
    /// A file could not be read or written. Check the path and its permissions; a retry may help.
    Io,
    /// A log is not an MCAP file or does not hold what was asked for. Name another file or topic.
    Log,
    /// The runtime refused a graph or could not start it. Change the rate groups.
    Runtime,
    /// A device refused a call or vanished. Reconnect it; a retry may help.
    Device,
    /// An actor failed while running (a panic, or numbers that are not finite). The run is over; the log up to then is good.
    Fault,
    /// A condition that a log must not fulfil holds (`palpate timing --fail-if`). The message names the figure.
    Condition,
    /// The user ended the run before its time. Nothing is wrong; the log is complete up to there.
    Interrupted,
}

impl ErrorKind {
    /// True where the user's input is at fault: the command then exits with 2, otherwise with 1.
    pub fn is_input(self) -> bool {
        matches!(self, Self::Scene | Self::Usage | Self::Io | Self::Log)
    }
}

/// The error of every fallible operation in palpate: a kind, a place and one line that says what would be right.
///
/// The line is fit for a terminal whatever the files are called and hold: place and message are made
/// [printable](crate::printable), a piece of a place in 200 characters at most, a message in 2000.
///
/// ```
/// use palpate::ErrorKind;
/// use palpate::scene::Scene;
///
/// let mut scene = Scene::demo();
/// scene.local.rate_hz = -1.0;
/// let error = scene.validate().unwrap_err();
/// assert_eq!((error.kind(), error.place()), (ErrorKind::Scene, "local.rate_hz"));
/// assert!(error.to_string().starts_with("local.rate_hz: is -1, must be"));
/// ```
#[derive(Debug)]
pub struct Error {
    kind: ErrorKind,
    /// Where: a file and line, a field, a topic. Empty if the message says it all.
    place: String,
    message: String,
    source: Option<Box<dyn std::error::Error + Send + Sync>>,
}

impl Error {
    /// An error of `kind` with a one-line `message`.
    pub fn new(kind: ErrorKind, message: impl Into<String>) -> Self {
        Self { kind, place: String::new(), message: one_line(&message.into()), source: None }
    }

    /// A scene error at `field` (dotted path, such as `body.material.stiffness_n_per_m`).
    pub fn scene(field: &str, message: impl Into<String>) -> Self {
        Self::new(ErrorKind::Scene, message).at(field)
    }

    /// An I/O error on `path`.
    pub fn io(path: &std::path::Path, source: std::io::Error) -> Self {
        let mut error = Self::new(ErrorKind::Io, source.to_string()).at(path.display().to_string());
        error.source = Some(Box::new(source));
        error
    }

    /// Puts `place` in front of the error's own: `place: earlier place: message`.
    #[must_use]
    pub fn at(mut self, place: impl AsRef<str>) -> Self {
        let place = printable(place.as_ref());
        self.place = if self.place.is_empty() { place.into_owned() } else { format!("{place}: {}", self.place) };
        self
    }

    /// Says place and message as `words` says them.
    #[must_use]
    pub(crate) fn reworded(mut self, words: impl Fn(&str) -> String) -> Self {
        (self.place, self.message) = (words(&self.place), words(&self.message));
        self
    }

    /// Calls the field `from` at the start of the error's place `to`.
    #[must_use]
    pub(crate) fn with_place_of(mut self, from: &str, to: &str) -> Self {
        if let Some(rest) = self.place.strip_prefix(from)
            && (rest.is_empty() || rest.starts_with(['.', '[', ':']))
        {
            self.place = format!("{to}{rest}");
        }
        self
    }

    /// The kind of the error, for programs that decide by it.
    pub fn kind(&self) -> ErrorKind {
        self.kind
    }

    /// The file and line, field or topic at which it happened; may be empty.
    pub fn place(&self) -> &str {
        &self.place
    }
}

impl From<ModelError> for Error {
    fn from(error: ModelError) -> Self {
        let own = Self::new(ErrorKind::Scene, error.message());
        if error.place().is_empty() { own } else { own.at(error.place()) }
    }
}

impl From<MeshError> for Error {
    fn from(error: MeshError) -> Self {
        Self::new(ErrorKind::Scene, error.to_string())
    }
}

impl From<GraphError> for Error {
    /// An error that an actor's start returned stays what it is.
    fn from(error: GraphError) -> Self {
        let place = error.place().to_owned();
        let kind = match error.kind() {
            GraphErrorKind::Refused => ErrorKind::Runtime,
            GraphErrorKind::Recording => ErrorKind::Log,
            _ => ErrorKind::Fault,
        };
        let own = match error.into_actor_error() {
            Ok(source) => match source.downcast::<Self>() {
                Ok(own) => *own,
                Err(other) => Self::new(ErrorKind::Fault, other.to_string()),
            },
            Err(error) => Self::new(kind, error.message()),
        };
        if place.is_empty() { own } else { own.at(place) }
    }
}

impl fmt::Display for Error {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        if self.place.is_empty() { f.write_str(&self.message) } else { write!(f, "{}: {}", self.place, self.message) }
    }
}

impl std::error::Error for Error {
    fn source(&self) -> Option<&(dyn std::error::Error + 'static)> {
        self.source.as_deref().map(|source| source as _)
    }
}

/// Longest message, in characters: each is made to be read.
const LONGEST_MESSAGE: usize = 2000;

fn one_line(text: &str) -> String {
    let line = text.split_whitespace().collect::<Vec<_>>().join(" ");
    within(&line, LONGEST_MESSAGE).into_owned()
}

/// Longest piece of a user's text that a message repeats, in characters.
const LONGEST_QUOTE: usize = 40;

/// `text` in quotes, shortened, control characters escaped: a piece of a user's file for an error message.
pub(crate) fn quoted(text: &str) -> String {
    let mut short: String = text.chars().take(LONGEST_QUOTE).collect();
    if short.len() < text.len() {
        short.push('…');
    }
    format!("{short:?}")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_error_is_one_line_with_its_place_in_front() {
        let error = Error::scene("body.block.nodes", "must be\n at least 2").at("scene.toml:4");
        assert_eq!(error.to_string(), "scene.toml:4: body.block.nodes: must be at least 2");
        assert!(error.kind().is_input());
    }

    #[test]
    fn a_name_that_breaks_lines_and_a_message_without_an_end_stay_one_line() {
        let path = std::path::Path::new("a\n\u{1b}[31mb.toml");
        let error = Error::io(path, std::io::ErrorKind::NotFound.into()).to_string();
        assert!(error.starts_with(r"a\n\u{1b}[31mb.toml: "), "{error}");
        let error = Error::new(ErrorKind::Usage, "\u{202e}x".repeat(5_000_000)).at("y".repeat(5_000_000)).to_string();
        assert!(error.chars().count() < 2300 && !error.contains('\u{202e}'), "{} bytes", error.len());
    }
}
