//! Ctrl-C, and the other signals that ask a command to end: the run stops in order, the force ramps out, the log is
//! closed.

use std::sync::OnceLock;

use palpate::session::Running;
use palpate::{Error, ErrorKind};

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
