//! Runs the `palpate` command in a folder of its own.
#![allow(dead_code)]

mod rewritten;
mod scene;

use std::ffi::OsStr;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

#[allow(unused_imports)]
pub use rewritten::rewrite_log;
pub use scene::{PATH, SCENE};

/// What a call left behind.
#[derive(Debug)]
pub struct Called {
    pub code: Option<i32>,
    pub out: String,
    pub err: String,
}

/// A folder with a small good scene and its path; gone when dropped.
#[derive(Debug)]
pub struct Folder(tempfile::TempDir);

impl Folder {
    pub fn new() -> Self {
        let folder = Self(tempfile::tempdir().expect("a temporary folder"));
        folder.write("scene.toml", SCENE);
        folder.write("path.csv", PATH);
        folder
    }

    pub fn path(&self, name: &str) -> PathBuf {
        self.0.path().join(name)
    }

    pub fn write(&self, name: &str, contents: impl AsRef<[u8]>) {
        std::fs::write(self.path(name), contents).expect("a file in a temporary folder");
    }

    /// The scene with one piece of its text replaced.
    pub fn spoil(&self, good: &str, bad: &str) {
        assert!(SCENE.contains(good), "no {good:?} to spoil");
        self.write("scene.toml", SCENE.replacen(good, bad, 1));
    }

    /// The names of the files in it.
    pub fn files(&self) -> Vec<String> {
        let entries = std::fs::read_dir(self.0.path()).expect("it exists");
        let mut names: Vec<_> =
            entries.map(|entry| entry.expect("readable").file_name().into_string().expect("UTF-8")).collect();
        names.sort();
        names
    }

    /// Runs `palpate` with `args` in this folder.
    pub fn call(&self, args: &[&str]) -> Called {
        self.call_with(args)
    }

    /// The same with arguments that need not be text.
    pub fn call_with(&self, args: &[impl AsRef<OsStr>]) -> Called {
        palpate(self.0.path(), args)
    }

    /// Runs it, expects success without a word on standard error, and gives standard output.
    pub fn succeed(&self, args: &[&str]) -> String {
        let called = self.call(args);
        assert_eq!((called.code, &*called.err), (Some(0), ""), "{args:?}");
        called.out
    }
}

fn palpate(folder: &Path, args: &[impl AsRef<OsStr>]) -> Called {
    let output = Command::new(env!("CARGO_BIN_EXE_palpate"))
        .args(args)
        .current_dir(folder)
        .env("RUST_BACKTRACE", "1")
        // Bases that are kept are not the user's own.
        .env("XDG_CACHE_HOME", env!("CARGO_TARGET_TMPDIR"))
        .stdin(Stdio::null())
        .output()
        .expect("the command starts");
    let text = |bytes| String::from_utf8(bytes).expect("UTF-8");
    Called { code: output.status.code(), out: text(output.stdout), err: text(output.stderr) }
}

/// The rows of a CSV text below its header.
pub fn rows(csv: &str) -> Vec<Vec<f64>> {
    csv.lines().skip(1).map(|line| line.split(',').map(|cell| cell.parse().expect("a number")).collect()).collect()
}
