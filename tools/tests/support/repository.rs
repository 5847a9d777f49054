//! Where the repository's scenes, documents and references are: a folder above this crate.

use std::path::{Path, PathBuf};

/// A file of the repository by its path from the repository's root.
pub fn in_repository(path: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).parent().unwrap_or(Path::new(".")).join(path)
}
