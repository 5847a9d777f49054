//! `--from` and `--to`: a part of a log.

use palpate::log::Window;
use palpate::runtime::Nanos;
use palpate::{Error, ErrorKind};

/// Which part of a log is asked for.
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
    /// The part.
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
