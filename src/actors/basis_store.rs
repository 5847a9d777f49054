//! Where bases come from: a folder that keeps them from run to run, or the computation.

use std::fs::{self, OpenOptions};
use std::io::{self, Write};
use std::path::{Path, PathBuf};
use std::time::{Duration, SystemTime};

use crate::error::Error;
use crate::files;
use crate::model::body::InstructionSet;
use crate::model::surroundings::{Basis, Reduction, RestingBody};

/// The largest file that may be a basis (bytes).
const MOST_BYTES: u64 = 1 << 28;
/// What a folder keeps in all (bytes), some 500 bases of the usual size: then the oldest go.
const MOST_KEPT: u64 = 1 << 29;
/// The extension of a basis, and of one in the making.
const BASIS: &str = "basis";
const PART: &str = "part";
/// Whoever began to write a file so much earlier than others were written is gone.
const ABANDONED: Duration = Duration::from_secs(3600);
/// Names that are tried for a file in the making.
const NAMES: u32 = 100;

/// Makes the bases of one body, or reads those that it has made before.
#[derive(Clone, Debug)]
pub struct BasisStore {
    /// Of a basis.
    states: usize,
    /// Bases are kept in this folder, if there is one.
    folder: Option<PathBuf>,
    most_kept: u64,
    /// It has said that something is wrong with the folder.
    has_complained: bool,
}

impl BasisStore {
    /// A store of bases of so many states, kept in `folder` if there is one.
    pub(crate) fn new(states: usize, folder: Option<PathBuf>) -> Self {
        Self { states, folder, most_kept: MOST_KEPT, has_complained: false }
    }

    /// Of a basis.
    pub(crate) fn states(&self) -> usize {
        self.states
    }

    /// The basis that `reduction` begins. A file that is damaged or cannot be written is as good as none: the basis is computed.
    ///
    /// # Errors
    /// If nothing holds the surroundings together.
    pub(crate) fn get(&mut self, resting: &RestingBody, mut reduction: Reduction) -> Result<Basis, Error> {
        if let Some(kept) = self.kept(resting, &reduction) {
            return Ok(kept);
        }
        loop {
            if let Some(basis) = self.advance(resting, &mut reduction)? {
                return Ok(basis);
            }
        }
    }

    /// The basis that `reduction` would make, if it was kept. One that is known already is not looked for: it would be that of its own
    /// surroundings to the last bit, and not that of others like them, and what is on the disk is to change nothing.
    pub(crate) fn kept(&mut self, resting: &RestingBody, reduction: &Reduction) -> Option<Basis> {
        let basis = if reduction.is_known() { None } else { self.read(resting, reduction.patch()) };
        basis.inspect(|basis| reduction.learn(resting, basis))
    }

    /// Does the next part of `reduction`; keeps the basis after the last, if there is a folder for it.
    ///
    /// # Errors
    /// If nothing holds the surroundings together.
    pub(crate) fn advance(&mut self, resting: &RestingBody, reduction: &mut Reduction) -> Result<Option<Basis>, Error> {
        let is_known = reduction.is_known();
        let basis = reduction.advance(resting)?;
        basis.iter().filter(|_| !is_known).for_each(|basis| self.keep(resting, basis));
        Ok(basis)
    }

    fn read(&mut self, resting: &RestingBody, patch: &[u32]) -> Option<Basis> {
        let key = self.key(resting, patch);
        let file = self.file(key)?;
        if fs::symlink_metadata(&file).is_err_and(|error| error.kind() == io::ErrorKind::NotFound) {
            return None;
        }
        let bytes = files::read(&file, MOST_BYTES);
        let basis = bytes.ok().and_then(|bytes| Basis::from_bytes(&bytes, key)).filter(|basis| basis.patch() == patch);
        if basis.is_none() {
            self.complain("is damaged, or another version's: such bases are computed again", &file);
        }
        basis
    }

    /// The oldest make room.
    fn keep(&mut self, resting: &RestingBody, basis: &Basis) {
        let key = self.key(resting, basis.patch());
        let (Some(folder), Some(file)) = (&self.folder, self.file(key)) else { return };
        let written = fs::create_dir_all(folder).and_then(|()| write_whole(&file, &basis.to_bytes(key)));
        match written.and_then(|()| make_room(folder, self.most_kept)) {
            Ok(()) => {}
            Err(error) => self.complain(&format!("could not be kept: {error}"), &file),
        }
    }

    /// Says once what is wrong with the folder: it may be the same with every basis.
    fn complain(&mut self, what: &str, file: &Path) {
        if !std::mem::replace(&mut self.has_complained, true) {
            tracing::warn!("basis {} {what}", file.display());
        }
    }

    fn file(&self, key: u64) -> Option<PathBuf> {
        self.folder.as_ref().map(|folder| folder.join(format!("{key:016x}")).with_extension(BASIS))
    }

    /// Of body, patch and number of states, and of what the same numbers come from: another version, or instruction set, rounds otherwise, and a
    /// run would not be repeated bit for bit.
    fn key(&self, resting: &RestingBody, patch: &[u32]) -> u64 {
        let mix = |hash: u64, word: u64| (hash ^ word).wrapping_mul(0x9e37_79b9_7f4a_7c15).rotate_left(31);
        let by = [env!("CARGO_PKG_VERSION"), InstructionSet::detect().name()];
        let made_by = by.into_iter().flat_map(str::bytes).map(u64::from).chain([u64::from(cfg!(debug_assertions))]);
        let of_size = mix(made_by.fold(resting.digest(), mix), self.states as u64);
        patch.iter().fold(of_size, |hash, &node| mix(hash, node.into()))
    }
}

/// Writes `file` so that it appears whole or not at all: other runs may read it, or write the same, meanwhile.
fn write_whole(file: &Path, bytes: &[u8]) -> io::Result<()> {
    for number in 0..NAMES {
        let part = file.with_extension(format!("{}-{number}.{PART}", std::process::id()));
        let mut open = match OpenOptions::new().write(true).create_new(true).open(&part) {
            Ok(open) => open,
            Err(error) if error.kind() == io::ErrorKind::AlreadyExists => continue,
            Err(error) => return Err(error),
        };
        let written = open.write_all(bytes).and_then(|()| fs::rename(&part, file));
        if written.is_err() {
            // What there is of it would take the place that is missing.
            let _ = fs::remove_file(&part);
        }
        return written;
    }
    Err(io::ErrorKind::AlreadyExists.into())
}

/// Removes the oldest bases of `folder` until the others are `most` bytes at most, and what writers left that are gone. Nothing else
/// that may lie there is touched.
fn make_room(folder: &Path, most: u64) -> io::Result<()> {
    let mut kept = Vec::new();
    for entry in fs::read_dir(folder)? {
        let path = entry?.path();
        let extension = path.extension().and_then(|extension| extension.to_str());
        let (true, Ok(about)) = (matches!(extension, Some(BASIS | PART)), fs::symlink_metadata(&path)) else {
            continue;
        };
        let written = about.modified().unwrap_or(SystemTime::UNIX_EPOCH);
        kept.push((written, extension == Some(PART), about.len(), path));
    }
    let newest = kept.iter().map(|&(written, ..)| written).max().unwrap_or(SystemTime::UNIX_EPOCH);
    kept.sort();
    let mut total: u64 = kept.iter().map(|(_, _, bytes, _)| bytes).sum();
    for (written, is_part, bytes, path) in kept {
        let is_abandoned = is_part && newest.duration_since(written).is_ok_and(|age| age > ABANDONED);
        if is_abandoned || total > most && !is_part {
            // Another run may have done it.
            let _ = fs::remove_file(&path);
            total -= bytes;
        }
    }
    Ok(())
}

#[cfg(test)]
#[path = "tests/basis_store.rs"]
mod tests;
