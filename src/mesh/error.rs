//! Errors of meshes: one line that says which file, where in it, what is wrong and what to do.

use std::fmt;

use palpate_model::ModelError;

/// Longest piece of foreign text that a message repeats, in characters.
const LONGEST: usize = 60;

/// A mesh file cannot be read, or what it holds cannot be simulated. Correct what it names; a retry does not help.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct MeshError(String);

impl MeshError {
    /// An error with a one-line `message`.
    pub fn new(message: impl Into<String>) -> Self {
        Self(message.into())
    }

    /// Puts the name of a file in front of the message.
    #[must_use]
    pub fn of_file(self, name: &str) -> Self {
        // The end of a path tells more than its beginning.
        let all = name.chars().count();
        let name: String = name.chars().skip(all.saturating_sub(4 * LONGEST)).collect();
        Self(format!("{}: {}", escaped(&name), self.0))
    }
}

impl From<ModelError> for MeshError {
    fn from(error: ModelError) -> Self {
        Self(error.to_string())
    }
}

impl fmt::Display for MeshError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.0)
    }
}

impl std::error::Error for MeshError {}

/// Text of a file in quotes, on one line and cut if it is long.
pub(crate) fn quoted(text: &str) -> String {
    let start: String = text.chars().take(LONGEST).collect();
    let more = if start.len() < text.len() { "..." } else { "" };
    format!("\"{}{more}\"", escaped(&start))
}

/// What a terminal would obey in place of showing it is escaped.
fn escaped(text: &str) -> String {
    let escape = |c: char| if c.is_ascii_graphic() { c.to_string() } else { c.escape_debug().to_string() };
    text.chars().map(escape).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn foreign_text_stays_on_one_line() {
        assert_eq!(quoted("Leber ü \"x\"\n\u{1b}[2J"), "\"Leber ü \"x\"\\n\\u{1b}[2J\"");
        assert_eq!(quoted(&"x".repeat(1000)).len(), LONGEST + 5);
        let error = MeshError::new("is empty").of_file(&format!("{}/a\tb.msh", "x".repeat(10_000)));
        assert!(error.to_string().ends_with("xx/a\\tb.msh: is empty") && error.to_string().len() < 300, "{error}");
    }
}
