//! What the subcommands share: standard output and standard error that may be closed or full, `--from` and `--to`, and Ctrl-C.

use std::borrow::Cow;
use std::fmt::Display;
use std::io::{self, Write};
use std::path::Path;
use std::sync::OnceLock;

use palpate::log::Window;
use palpate::runtime::Nanos;
use palpate::scene::ModelChoice;
use palpate::session::Running;
use palpate::{Error, ErrorKind, printable};

/// Writes `text` to standard output. A reader that has gone away, such as `head`, is not an error.
pub fn print(text: &str) -> Result<(), Error> {
    let mut out = io::stdout().lock();
    let result = out.write_all(for_terminal(text).as_bytes()).and_then(|()| out.flush());
    forgive_closed_pipe(result.map_err(|e| Error::io(Path::new("standard output"), e)))
}

/// `text` without what a terminal would obey, but for the ends of lines. Reports have escaped the names in them before; this
/// is for JSON, in which serde leaves some of it, and for what was forgotten. What it writes in place means the same in JSON.
fn for_terminal(text: &str) -> Cow<'_, str> {
    let is_obeyed = |c: char| c.is_control() && c != '\n';
    if !text.contains(is_obeyed) {
        return text.into();
    }
    let mut shown = String::with_capacity(text.len());
    for c in text.chars() {
        if is_obeyed(c) { shown += &format!("\\u{:04x}", u32::from(c)) } else { shown.push(c) }
    }
    shown.into()
}

/// Says one line on standard error. One that is full or gone takes nothing, and nobody is left to tell.
pub fn complain(line: impl Display) {
    let _ = writeln!(io::stderr().lock(), "{line}");
}

/// Standard error for warnings of the engine: a line each, whatever is in them.
#[derive(Debug)]
pub struct Complaints;

impl Write for Complaints {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        complain(printable(String::from_utf8_lossy(bytes).trim_end()));
        Ok(bytes.len())
    }

    fn flush(&mut self) -> io::Result<()> {
        Ok(())
    }
}

/// A local model or `auto` by name, or which there are.
pub fn choice(name: &str) -> Result<ModelChoice, String> {
    ModelChoice::from_name(name).ok_or_else(|| format!("the local models are {}", ModelChoice::NAMES.join(", ")))
}

/// The name of a file in a report: on one line, whatever it is called.
pub fn name_of(path: &Path) -> String {
    printable(&path.display().to_string()).into_owned()
}

/// Prints one JSON document, or else the report for people.
pub fn print_report<J: Display>(
    is_json: bool,
    json: impl FnOnce() -> J,
    text: impl FnOnce() -> String,
) -> Result<(), Error> {
    print(&if is_json { format!("{}\n", json()) } else { text() })
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
        complain(format_args!("warning: {}: {damage}", printable(place)));
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

/// Lets Ctrl-C do this once; a second one ends the command at once.
///
/// # Errors
/// If the system refuses the handler.
pub fn on_interrupt(act: impl Fn() + Send + 'static) -> Result<Interrupt, Error> {
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
