//! Where bases come from: a folder that keeps them from run to run, or the computation.

use std::path::PathBuf;

use crate::error::Error;
use crate::files;
use crate::model::surroundings::{Basis, RestingBody, Size};

/// The largest file that may be a basis (bytes).
const MOST_BYTES: u64 = 1 << 28;

/// Makes the bases of one body, or reads those that it has made before.
#[derive(Clone, Debug)]
pub struct BasisStore {
    /// How large a basis is to be.
    pub size: Size,
    /// Bases are kept in this folder, if there is one.
    pub folder: Option<PathBuf>,
}

impl BasisStore {
    /// The basis of `patch` (node ids in increasing order); `None` if nothing around the patch can move. A file that is
    /// damaged or cannot be written is as good as none: the basis is computed.
    ///
    /// # Errors
    /// If nothing holds the surroundings together.
    pub(crate) fn get(&self, resting: &RestingBody, patch: &[u32]) -> Result<Option<Basis>, Error> {
        if let Some(basis) = self.read(resting, patch) {
            return Ok(Some(basis));
        }
        let basis = Basis::compute(resting, patch, self.size)?;
        if let Some(basis) = &basis {
            self.keep(resting, basis);
        }
        Ok(basis)
    }

    /// The basis of `patch`, if it was kept.
    pub(crate) fn read(&self, resting: &RestingBody, patch: &[u32]) -> Option<Basis> {
        let key = self.key(resting, patch);
        let stored = Basis::from_bytes(&files::read(&self.file(key)?, MOST_BYTES).ok()?, key);
        stored.filter(|basis| basis.patch() == patch)
    }

    /// Keeps `basis`, if there is a folder for it.
    pub(crate) fn keep(&self, resting: &RestingBody, basis: &Basis) {
        let key = self.key(resting, basis.patch());
        let (Some(folder), Some(file)) = (&self.folder, self.file(key)) else { return };
        // Another run may read it meanwhile: it appears whole or not at all.
        let part = folder.join(format!("{key:016x}.{}", std::process::id()));
        let written = std::fs::create_dir_all(folder)
            .and_then(|()| std::fs::write(&part, basis.to_bytes(key)))
            .and_then(|()| std::fs::rename(&part, &file));
        if let Err(error) = written {
            // What there is of it would take the place that is missing.
            let _ = std::fs::remove_file(&part);
            tracing::warn!("the basis could not be kept in {}: {error}", folder.display());
        }
    }

    fn file(&self, key: u64) -> Option<PathBuf> {
        self.folder.as_ref().map(|folder| folder.join(format!("{key:016x}.basis")))
    }

    /// Of body, patch and size.
    fn key(&self, resting: &RestingBody, patch: &[u32]) -> u64 {
        let mix = |hash: u64, word: u64| (hash ^ word).wrapping_mul(0x9e37_79b9_7f4a_7c15).rotate_left(31);
        let (kind, size) = match self.size {
            Size::States(states) => (0, states as u64),
            Size::ErrorPct(error_pct) => (1, error_pct.to_bits()),
        };
        let of_size = mix(mix(resting.digest(), size), kind);
        patch.iter().fold(of_size, |hash, &node| mix(hash, node.into()))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::model::body::{Block, Body};
    use crate::model::mesh::Face;

    #[test]
    fn what_was_computed_is_read_again_and_damage_is_computed_again() {
        let block = Block::builder([5; 3], [0.05; 3]).fix(Face::ZMin).build().unwrap();
        let resting = RestingBody::new(&block).unwrap();
        let mut patch = Vec::new();
        block.patch(&[block.surface().triangles.len() as u32 - 5], [2, 2, 1], &mut patch);
        let folder = tempfile::tempdir().unwrap();
        let store = BasisStore { size: Size::States(10), folder: Some(folder.path().join("bases")) };
        let first = store.get(&resting, &patch).unwrap();
        let files = || std::fs::read_dir(folder.path().join("bases")).unwrap().map(|file| file.unwrap().path());
        assert_eq!(files().count(), 1);
        assert_eq!(store.get(&resting, &patch).unwrap(), first);
        for file in files() {
            std::fs::write(file, b"no basis").unwrap();
        }
        assert_eq!(store.get(&resting, &patch).unwrap(), first);
        // Check that what has no end is as good as damaged.
        for file in files() {
            std::fs::remove_file(&file).unwrap();
            std::os::unix::fs::symlink("/dev/zero", &file).unwrap();
        }
        assert_eq!(store.get(&resting, &patch).unwrap(), first);
        for (count, size) in [Size::States(11), Size::ErrorPct(1.0), Size::ErrorPct(2.0)].into_iter().enumerate() {
            let other = BasisStore { size, ..store.clone() };
            assert_ne!(other.get(&resting, &patch).unwrap(), first);
            assert_eq!(files().count(), count + 2, "another size, another file");
        }
    }
}
