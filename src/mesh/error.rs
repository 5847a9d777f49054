//! Errors of meshes: one line that says which file, where in it, what is wrong and what to do.

use std::fmt;

/// A mesh file cannot be read, or what it holds cannot be simulated. Correct what it names; a retry does not help.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct MeshError(String);

impl MeshError {
    /// An error with a one-line `message`.
    pub fn new(message: impl Into<String>) -> Self {
        Self(message.into())
    }
}

impl fmt::Display for MeshError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.0)
    }
}

impl std::error::Error for MeshError {}
