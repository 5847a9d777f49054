//! What the subcommands share: standard output that may be closed early, the warning on a damaged log, `--from` and `--to`, and
//! Ctrl-C.

use std::fmt::Display;
use std::io::{self, Write};
use std::path::Path;
use std::sync::OnceLock;

use palpate::log::Window;
use palpate::runtime::Nanos;
use palpate::scene::Scene;
use palpate::session::Running;
use palpate::{Error, ErrorKind};

/// Writes `text` to standard output. A reader that has gone away, such as `head`, is not an error.
pub fn print(text: &str) -> Result<(), Error> {
    let mut out = io::stdout().lock();
    let result = out.write_all(text.as_bytes()).and_then(|()| out.flush());
    forgive_closed_pipe(result.map_err(|e| Error::io(Path::new("standard output"), e)))
}

/// Prints one JSON document, or else the report for people.
pub fn print_report<J: Display>(
    is_json: bool,
    json: impl FnOnce() -> J,
    text: impl FnOnce() -> String,
) -> Result<(), Error> {
    print(&if is_json { format!("{}\n", json()) } else { text() })
}

/// Refuses to write `out` over `input`: opening it for writing would destroy what is being read.
///
/// # Errors
/// [`ErrorKind::Usage`] if both are names of one file.
pub fn refuse_to_overwrite(input: &Path, out: &Path) -> Result<(), Error> {
    let real = |path: &Path| path.canonicalize().ok();
    if real(input).is_some_and(|input| real(out) == Some(input)) || is_one_file(input, out) {
        let message = "is the input itself, name another file for the output";
        return Err(Error::new(ErrorKind::Usage, message).at(out.display().to_string()));
    }
    Ok(())
}

/// Refuses to write `out` over the scene at `path` or over what the scene reads.
pub fn keep_inputs(path: &Path, scene: &Scene, out: &Path) -> Result<(), Error> {
    refuse_to_overwrite(path, out)?;
    let folder = path.parent().unwrap_or(Path::new(""));
    let mut paths = scene.devices.iter().filter_map(|device| device.path_csv.as_ref());
    paths.try_for_each(|path_csv| refuse_to_overwrite(&folder.join(path_csv), out))
}

/// Writes a page to where it was asked for, if it was.
pub fn write_page(path: Option<&Path>, page: impl FnOnce() -> String) -> Result<(), Error> {
    path.map_or(Ok(()), |path| std::fs::write(path, page()).map_err(|error| Error::io(path, error)))
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

/// The options `--from` and `--to`: which part of a log is asked for.
#[derive(Clone, Copy, Debug, clap::Args)]
pub struct WindowArgs {
    /// Leave out what was before this time of the log (s)
    #[arg(long, value_name = "S", allow_negative_numbers = true)]
    pub from: Option<f64>,
    /// Leave out what was at this time of the log or later (s)
    #[arg(long, value_name = "S", allow_negative_numbers = true)]
    pub to: Option<f64>,
}

impl WindowArgs {
    /// The part of the log that is asked for.
    ///
    /// # Errors
    /// [`ErrorKind::Usage`] if a time is none, or if nothing is left.
    pub fn window(&self) -> Result<Window, Error> {
        let usage = |message: String| Err(Error::new(ErrorKind::Usage, message));
        for (option, value) in [("--from", self.from), ("--to", self.to)] {
            if let Some(value) = value.filter(|value| !(value.is_finite() && *value >= 0.0)) {
                return usage(format!("{option} is {value}, it must be seconds since the start of the run, 0 or more"));
            }
        }
        let window = Window {
            from: Nanos::from_secs_f64(self.from.unwrap_or(0.0)),
            to: self.to.map_or(Window::default().to, Nanos::from_secs_f64),
        };
        if window.from >= window.to {
            let (from, to) = (window.from.as_secs_f64(), window.to.as_secs_f64());
            return usage(format!("--from {from} --to {to} leaves nothing: let --from be the smaller"));
        }
        Ok(window)
    }
}

/// What a shell expects of a command that Ctrl-C ended.
pub const EXIT_CODE: u8 = 130;

/// Whether the user interrupted the run.
#[derive(Debug)]
pub struct Interrupt(&'static OnceLock<()>);

impl Interrupt {
    /// True once it happened.
    pub fn came(&self) -> bool {
        self.0.get().is_some()
    }
}

/// Lets Ctrl-C stop `running` in order; a second one ends the command at once.
///
/// # Errors
/// If the system refuses the handler.
pub fn stops(running: &Running) -> Result<Interrupt, Error> {
    let stop = running.stop_handle();
    on_interrupt(move || stop.request())
}

/// Notes Ctrl-C for a command that looks whether it came; a second one ends the command at once.
///
/// # Errors
/// If the system refuses the handler.
pub fn waits() -> Result<Interrupt, Error> {
    on_interrupt(|| {})
}

fn on_interrupt(act: impl Fn() + Send + 'static) -> Result<Interrupt, Error> {
    static CAME: OnceLock<()> = OnceLock::new();
    let handler = move || {
        if CAME.set(()).is_err() {
            std::process::exit(EXIT_CODE.into());
        }
        act();
    };
    ctrlc::set_handler(handler)
        .map_err(|error| Error::new(ErrorKind::Runtime, format!("no handler for Ctrl-C: {error}")))?;
    Ok(Interrupt(&CAME))
}
