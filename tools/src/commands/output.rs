//! What the subcommands share: standard output that may be closed early, and the warning on a damaged log.

use std::io::{self, Write};
use std::path::Path;

use palpate::{Error, ErrorKind};

/// Writes `text` to standard output. A reader that has gone away, such as `head`, is not an error.
pub fn print(text: &str) -> Result<(), Error> {
    let mut out = io::stdout().lock();
    let result = out.write_all(text.as_bytes()).and_then(|()| out.flush());
    forgive_closed_pipe(result.map_err(|e| Error::io(Path::new("standard output"), e)))
}

/// Refuses to write `out` over `input`: opening it for writing would destroy what is being read.
pub fn refuse_to_overwrite(input: &Path, out: &Path) -> Result<(), Error> {
    let real = |path: &Path| path.canonicalize().ok();
    if real(input).is_some_and(|input| real(out) == Some(input)) || is_one_file(input, out) {
        let message = "is the input itself, name another file for the output";
        return Err(Error::new(ErrorKind::Usage, message).at(out.display().to_string()));
    }
    Ok(())
}

/// True if the two are names of one file: hard links.
#[cfg(unix)]
fn is_one_file(a: &Path, b: &Path) -> bool {
    use std::os::unix::fs::MetadataExt;
    let of = |path: &Path| std::fs::metadata(path).map(|file| (file.dev(), file.ino())).ok();
    of(a).is_some_and(|a| of(b) == Some(a))
}

#[cfg(not(unix))]
fn is_one_file(_: &Path, _: &Path) -> bool {
    false
}

/// Takes the error of a closed pipe for the end of the output.
pub fn forgive_closed_pipe(result: Result<(), Error>) -> Result<(), Error> {
    let Err(error) = result else { return Ok(()) };
    let io_error = std::error::Error::source(&error).and_then(|source| source.downcast_ref::<io::Error>());
    match io_error.map(io::Error::kind) {
        Some(io::ErrorKind::BrokenPipe) => Ok(()),
        _ => Err(error),
    }
}

/// Says on standard error, in one line, what is wrong with the log.
pub fn warn_of_damage(place: &str, damage: Option<&str>) {
    if let Some(damage) = damage {
        eprintln!("warning: {place}: {damage}");
    }
}
