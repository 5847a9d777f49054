//! A progress bar for a run, on a terminal only.

use std::time::Duration;

use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};
use palpate::session::Running;
use palpate::time::Nanos;

/// How much of the run passes between two drawings.
const STEP: Duration = Duration::from_millis(50);

/// Shows that a scene is being prepared until the returned bar is cleared: a large body's equilibrium takes a while.
pub fn preparing(what: &str) -> ProgressBar {
    let spinner = ProgressBar::with_draw_target(None, ProgressDrawTarget::stderr_with_hz(10));
    spinner.set_style(
        ProgressStyle::with_template("{msg} {elapsed}").unwrap_or_else(|_| ProgressStyle::default_spinner()),
    );
    spinner.set_message(format!("preparing {what}"));
    spinner.enable_steady_tick(STEP);
    spinner
}

/// Waits for the end of `running` and shows how far it is.
pub fn wait(running: &Running, what: &str) {
    let Some(until) = running.until() else { return running.wait() };
    let bar = RunBar::new(what, until);
    while !running.finished() {
        running.wait_for(STEP);
        bar.show(running.elapsed());
    }
    bar.clear();
}

/// How much of a run has passed.
pub struct RunBar {
    bar: ProgressBar,
    until: Nanos,
}

impl RunBar {
    /// A bar for a run of `what` that ends at `until`.
    pub fn new(what: &str, until: Nanos) -> Self {
        let bar = ProgressBar::with_draw_target(Some(until.0 / 1_000_000), ProgressDrawTarget::stderr_with_hz(15));
        let style = ProgressStyle::with_template("{msg} [{bar:40}] {prefix}");
        bar.set_style(style.unwrap_or_else(|_| ProgressStyle::default_bar()).progress_chars("=> "));
        bar.set_message(what.to_owned());
        Self { bar, until }
    }

    /// Shows that the run has come to `elapsed`.
    pub fn show(&self, elapsed: Nanos) {
        let elapsed = elapsed.min(self.until);
        self.bar.set_position(elapsed.0 / 1_000_000);
        self.bar.set_prefix(format!("{:.1} of {:.1} s", elapsed.as_secs_f64(), self.until.as_secs_f64()));
    }

    /// Takes the bar from the screen.
    pub fn clear(self) {
        self.bar.finish_and_clear();
    }
}
