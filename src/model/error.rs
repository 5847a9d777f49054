//! Errors of the model: one line that says what, where and what to do.

use std::fmt;

/// A value of a body, a mesh or a local model is impossible or inconsistent. Correct what it names; a retry does not help.
///
/// # Real-time
/// Allocates: no tick makes one.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct ModelError {
    /// The field, such as `body.size_m`. Empty if the message says it all.
    place: String,
    message: String,
}

impl ModelError {
    /// An error with a one-line `message`.
    pub fn new(message: impl Into<String>) -> Self {
        Self { place: String::new(), message: message.into() }
    }

    /// An error of `field`, such as `body.size_m`, with a one-line `message`.
    pub fn of(field: &str, message: impl Into<String>) -> Self {
        Self::new(message).at(field)
    }

    /// Puts `place` in front of the error's own: `place: earlier place: message`.
    #[must_use]
    pub fn at(mut self, place: &str) -> Self {
        self.place = if self.place.is_empty() { place.to_owned() } else { format!("{place}: {}", self.place) };
        self
    }

    /// The field that the error names; may be empty.
    pub fn place(&self) -> &str {
        &self.place
    }

    /// The message: what is wrong with the field, and what would be right.
    pub fn message(&self) -> &str {
        &self.message
    }
}

impl fmt::Display for ModelError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        if self.place.is_empty() { f.write_str(&self.message) } else { write!(f, "{}: {}", self.place, self.message) }
    }
}

impl std::error::Error for ModelError {}
