//! Files that are read whole into memory: an ordinary file of a bounded size, or an error at once.

use std::fs::{File, FileType};
use std::io::Read;
use std::path::Path;

use crate::error::{Error, ErrorKind};

/// The bytes of the file at `path`, `most` of them at most.
///
/// # Errors
/// [`ErrorKind::Io`] if it cannot be read, is no file or is larger.
pub(crate) fn read(path: &Path, most: u64) -> Result<Vec<u8>, Error> {
    if ordinary(path)? > most {
        return Err(too_large(path, most));
    }
    let fail = |error| Error::io(path, error);
    let mut bytes = Vec::new();
    // A file may grow while it is read, and some tell no size.
    File::open(path).map_err(fail)?.take(most + 1).read_to_end(&mut bytes).map_err(fail)?;
    if bytes.len() as u64 > most {
        return Err(too_large(path, most));
    }
    Ok(bytes)
}

fn too_large(path: &Path, most: u64) -> Error {
    let message = format!("is larger than {} MiB, the most that is read", most >> 20);
    Error::new(ErrorKind::Io, message).at(path.display().to_string())
}

/// The size (bytes) of the file at `path`. What is no file is refused before it is opened: a pipe would wait for its writer,
/// a device may have no end.
///
/// # Errors
/// [`ErrorKind::Io`] if there is nothing at `path` or it is no file.
pub(crate) fn ordinary(path: &Path) -> Result<u64, Error> {
    let found = std::fs::metadata(path).map_err(|error| Error::io(path, error))?;
    if found.is_file() {
        return Ok(found.len());
    }
    let message = format!("is {}, must be a file", name(found.file_type()));
    Err(Error::new(ErrorKind::Io, message).at(path.display().to_string()))
}

#[cfg(unix)]
fn name(found: FileType) -> &'static str {
    use std::os::unix::fs::FileTypeExt;
    match () {
        () if found.is_dir() => "a directory",
        () if found.is_fifo() => "a pipe",
        () if found.is_socket() => "a socket",
        () => "a device",
    }
}

#[cfg(not(unix))]
fn name(found: FileType) -> &'static str {
    if found.is_dir() { "a directory" } else { "no ordinary file" }
}
