//! What commands read and write as files: an output is never an input, and it is there whole or not at all.

use std::fs::{self, File, OpenOptions, TryLockError};
use std::io::{self, Seek, Write};
use std::path::{Path, PathBuf};

use palpate::scene::{BodySpec, Scene};
use palpate::{Error, ErrorKind};

use super::shared::{EXIT_CODE, on_interrupt};

/// The extension of what a scene's `basis_folder` keeps.
const BASIS: &str = "basis";
/// Names that are tried for a file in the making: as many may be left of programs that were killed.
const NAMES: u32 = 1000;
/// Links that are followed to a file that is not there yet.
const MOST_LINKS: u32 = 40;

/// Everything that the scene at `path` reads: itself, the mesh or surface of its body, paths and logs of its devices, and the
/// bases in the folder that it names.
pub fn inputs_of(path: &Path, scene: &Scene) -> Vec<PathBuf> {
    let folder = path.parent().unwrap_or(Path::new(""));
    let mut inputs = vec![path.to_owned()];
    if let Some(spec) = scene.body.as_ref().and_then(BodySpec::tetrahedra) {
        inputs.extend([&spec.mesh, &spec.surface].into_iter().flatten().map(|file| folder.join(file)));
    }
    for device in &scene.devices {
        inputs.extend(device.path_csv.as_ref().map(|path_csv| folder.join(path_csv)));
        // Found relative to the scene when that was read.
        inputs.extend(device.log.clone());
    }
    let kept = scene.local.basis_folder.as_ref().and_then(|bases| fs::read_dir(bases).ok());
    let kept = kept.into_iter().flatten().filter_map(|entry| Some(entry.ok()?.path()));
    inputs.extend(kept.filter(|file| file.extension().is_some_and(|extension| extension == BASIS)));
    inputs
}

/// Refuses to write `out` over one of `inputs`: opening it for writing would destroy what is being read.
///
/// # Errors
/// [`ErrorKind::Usage`] if `out` is a name of one of them, whatever it is called there.
pub fn keep_inputs(inputs: &[impl AsRef<Path>], out: &Path) -> Result<(), Error> {
    let real = |path: &Path| path.canonicalize().ok();
    let real_out = real(out);
    let is_out = |input: &Path| real_out.is_some() && real(input) == real_out || is_one_file(input, out);
    match inputs.iter().find(|input| is_out(input.as_ref())) {
        None => Ok(()),
        Some(input) if input.as_ref() == out => Err(refusal(out, "is the input itself")),
        Some(input) => Err(refusal(out, &format!("is the input itself, {}", input.as_ref().display()))),
    }
}

fn refusal(out: &Path, what: &str) -> Error {
    Error::new(ErrorKind::Usage, format!("{what}: name another file for the output")).at(out.display().to_string())
}

/// True if the two are names of one file: hard links.
#[cfg(unix)]
fn is_one_file(a: &Path, b: &Path) -> bool {
    use std::os::unix::fs::MetadataExt;
    let of = |path: &Path| fs::metadata(path).map(|file| (file.dev(), file.ino())).ok();
    of(a).is_some_and(|a| of(b) == Some(a))
}

#[cfg(not(unix))]
fn is_one_file(_: &Path, _: &Path) -> bool {
    false
}

/// A file in the making beside the one that it becomes: that one appears, or is replaced, once all is written. Dropped
/// before, it leaves nothing behind. Devices and pipes take what comes. A file in a folder that takes no other is written over, from
/// the first byte on that comes.
#[derive(Debug)]
pub struct OutputFile {
    file: File,
    /// As the user calls it.
    path: PathBuf,
    /// The file in the making and the one that it becomes.
    part: Option<[PathBuf; 2]>,
    /// True if it is a file that is written over.
    is_over_another: bool,
}

impl OutputFile {
    /// Begins the file `path`, which is none of `inputs`.
    ///
    /// # Errors
    /// [`ErrorKind::Usage`] if it is one of `inputs`; [`ErrorKind::Io`] if it cannot be written.
    pub fn create(path: &Path, inputs: &[impl AsRef<Path>]) -> Result<Self, Error> {
        keep_inputs(inputs, path)?;
        Self::open(path).map_err(|error| Error::io(path, error))
    }

    fn open(path: &Path) -> io::Result<Self> {
        let named = path.to_owned();
        let (target, permissions) = match fs::metadata(path) {
            Ok(there) => {
                let file = OpenOptions::new().write(true).open(path)?;
                if !there.is_file() {
                    return Ok(Self { file, path: named, part: None, is_over_another: false });
                }
                // A file system without locks protects no file.
                if let Err(TryLockError::WouldBlock) = file.try_lock() {
                    return Err(io::Error::other("a run is writing it, name another file"));
                }
                // A link stays one.
                (path.canonicalize()?, Some(there.permissions()))
            }
            // A link to what is not there yet is followed, too.
            Err(_) => {
                let mut target = named.clone();
                for _ in 0..MOST_LINKS {
                    let Ok(to) = fs::read_link(&target) else { break };
                    target = target.parent().unwrap_or(Path::new("")).join(to);
                }
                (target, None)
            }
        };
        for number in 0..NAMES {
            let part = target.with_file_name(format!(".palpate-{}-{number}.part", std::process::id()));
            match OpenOptions::new().write(true).create_new(true).open(&part) {
                Ok(file) => {
                    let output = Self { file, path: named, part: Some([part, target]), is_over_another: false };
                    permissions.map_or(Ok(()), |permissions| output.file.set_permissions(permissions))?;
                    return Ok(output);
                }
                Err(error) if error.kind() == io::ErrorKind::AlreadyExists => {}
                // The file may be written though its folder may not.
                Err(error) if error.kind() == io::ErrorKind::PermissionDenied && permissions.is_some() => {
                    // What was there stays until something comes in its place.
                    let file = OpenOptions::new().write(true).open(&target)?;
                    return Ok(Self { file, path: named, part: None, is_over_another: true });
                }
                Err(error) => return Err(error),
            }
        }
        Err(io::ErrorKind::AlreadyExists.into())
    }

    /// Puts the file in its place.
    ///
    /// # Errors
    /// [`ErrorKind::Io`] if the system refuses it; nothing is left behind then.
    pub fn finish(mut self) -> Result<(), Error> {
        if let Some([part, target]) = &self.part {
            fs::rename(part, target).map_err(|error| Error::io(&self.path, error))?;
        }
        self.part = None;
        if self.is_over_another {
            self.end_here().map_err(|error| Error::io(&self.path, error))?;
        }
        Ok(())
    }

    /// Cuts off what is left of the file that is written over.
    fn end_here(&self) -> io::Result<()> {
        self.file.set_len((&self.file).stream_position()?)
    }
}

impl Drop for OutputFile {
    fn drop(&mut self) {
        if let Some([part, _]) = &self.part {
            // Nobody is left to tell if that fails, too.
            let _ = fs::remove_file(part);
        }
        // Half of what comes with half of what was there would be neither.
        if self.is_over_another && (&self.file).stream_position().is_ok_and(|written| written > 0) {
            let _ = self.end_here();
        }
    }
}

impl Write for &OutputFile {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        (&self.file).write(bytes)
    }

    fn flush(&mut self) -> io::Result<()> {
        (&self.file).flush()
    }
}

/// Begins what a command writes after its work, if it is asked for: before the work, which would be lost if it could not be written. For
/// commands that handle interrupts in no other way.
///
/// # Errors
/// Those of [`begin_file`].
pub fn begin(path: Option<&Path>, inputs: &[impl AsRef<Path>]) -> Result<Option<OutputFile>, Error> {
    path.map(|path| begin_file(path, inputs)).transpose()
}

/// Begins the file `path`, which is none of `inputs`: a command that is interrupted meanwhile leaves nothing behind. For commands that
/// handle interrupts in no other way.
///
/// # Errors
/// Those of [`OutputFile::create`], and those of [`on_interrupt`].
pub fn begin_file(path: &Path, inputs: &[impl AsRef<Path>]) -> Result<OutputFile, Error> {
    let output = OutputFile::create(path, inputs)?;
    if let Some([part, _]) = output.part.clone() {
        on_interrupt(move || {
            let _ = fs::remove_file(&part);
            std::process::exit(EXIT_CODE.into());
        })?;
    }
    Ok(output)
}

/// Writes a page to where it was asked for, if it was.
///
/// # Errors
/// [`ErrorKind::Io`] if the system refuses it; nothing is left behind then.
pub fn write_page(output: Option<OutputFile>, page: impl FnOnce() -> String) -> Result<(), Error> {
    let Some(output) = output else { return Ok(()) };
    (&output).write_all(page().as_bytes()).map_err(|error| Error::io(&output.path, error))?;
    output.finish()
}
