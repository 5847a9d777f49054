//! A progress bar for a run and a line for each of its rate groups, on a terminal only.

use std::fs::File;
use std::io::BufReader;
use std::path::Path;
use std::time::Duration;

use indicatif::{MultiProgress, ProgressBar, ProgressBarIter, ProgressDrawTarget, ProgressStyle};
use palpate::log::LogReader;
use palpate::runtime::{GroupLive, Nanos};
use palpate::scene::{BuiltIn, Scene};
use palpate::session::Running;
use palpate::{Error, ErrorKind};

use super::shared::name_of;

/// How much of the run passes between two drawings.
const STEP: Duration = Duration::from_millis(50);

/// Loads the scene at `path`, or the built-in one of that name; a bar shows how far the filling of a surface is.
///
/// # Errors
/// Those of [`Scene::load`].
pub fn load(path: &Path) -> Result<Scene, Error> {
    const ALL: f64 = 1000.0;
    // A file comes first: whoever has one of that name means it. A folder is no scene.
    if !path.is_file() && path.extension().is_none() && path.components().count() == 1 {
        if let Some(built_in) = path.to_str().and_then(BuiltIn::named) {
            return Ok(built_in.load());
        }
        if !path.exists() {
            let message = "no such file, and no scene is built in by that name: see `palpate list`";
            return Err(Error::new(ErrorKind::Usage, message).at(name_of(path)));
        }
    }
    let mut filling = None;
    let scene = Scene::load_with(path, &mut |done| {
        let bar = filling.get_or_insert_with(|| {
            let bar = ProgressBar::with_draw_target(Some(ALL as u64), ProgressDrawTarget::stderr_with_hz(15));
            let style = ProgressStyle::with_template("{msg} {bar:30} {percent} %");
            bar.set_style(style.unwrap_or_else(|_| ProgressStyle::default_bar()));
            bar.with_message(format!("filling the surface of {}", name_of(path)))
        });
        bar.set_position((ALL * done) as u64);
    });
    filling.iter().for_each(ProgressBar::finish_and_clear);
    scene
}

/// Shows that a scene is being prepared until the returned bar is cleared: a large body's equilibrium takes a while.
pub fn preparing(what: &str) -> ProgressBar {
    let spinner = ProgressBar::with_draw_target(None, ProgressDrawTarget::stderr_with_hz(10));
    spinner.set_style(
        ProgressStyle::with_template("{msg} {elapsed}").unwrap_or_else(|_| ProgressStyle::default_spinner()),
    );
    spinner.set_message(format!("preparing {what}"));
    tick(&spinner);
    spinner
}

/// Lets time pass on a bar that nobody moves. Where the system gives no thread for it, it stands still.
fn tick(bar: &ProgressBar) {
    if bar.is_hidden() {
        return;
    }
    let weak = bar.downgrade();
    let ticks = move || {
        while let Some(bar) = weak.upgrade().filter(|bar| !bar.is_finished()) {
            bar.tick();
            drop(bar);
            std::thread::sleep(STEP);
        }
    };
    let _ = std::thread::Builder::new().name("progress".to_owned()).spawn(ticks);
}

/// Waits for the end of `running`; shows how far it is and how its groups keep their time.
pub fn wait(running: &Running, what: &str) {
    let Some(until) = running.until() else { return running.wait() };
    let shown = MultiProgress::with_draw_target(ProgressDrawTarget::stderr_with_hz(15));
    if shown.is_hidden() {
        return running.wait();
    }
    let bar = RunBar::of(shown.add(ProgressBar::no_length()), what, until);
    let style = ProgressStyle::with_template("{msg}").unwrap_or_else(|_| ProgressStyle::default_spinner());
    let lines: Vec<ProgressBar> =
        running.live().iter().map(|_| shown.add(ProgressBar::no_length().with_style(style.clone()))).collect();
    while !running.finished() {
        running.wait_for(STEP);
        let elapsed = running.elapsed().min(until);
        bar.show(elapsed);
        for (line, group) in lines.iter().zip(running.live()) {
            line.set_message(in_words(&group, elapsed));
        }
    }
    lines.iter().for_each(ProgressBar::finish_and_clear);
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
        Self::of(ProgressBar::with_draw_target(None, ProgressDrawTarget::stderr_with_hz(15)), what, until)
    }

    fn of(bar: ProgressBar, what: &str, until: Nanos) -> Self {
        bar.set_length(until.0 / 1_000_000);
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

/// How far work of several steps is.
#[derive(Default)]
pub struct StepBar(Option<ProgressBar>);

impl StepBar {
    /// Shows that `done` of `of` steps of `what` are done.
    pub fn show(&mut self, what: &str, done: usize, of: usize) {
        let bar = self.0.get_or_insert_with(|| {
            let bar = ProgressBar::with_draw_target(None, ProgressDrawTarget::stderr_with_hz(10));
            let style = ProgressStyle::with_template("{msg} [{bar:40}] {pos} of {len}, {elapsed}");
            bar.set_style(style.unwrap_or_else(|_| ProgressStyle::default_bar()).progress_chars("=> "));
            tick(&bar);
            bar
        });
        bar.set_length(of as u64);
        bar.set_position(done as u64);
        bar.set_message(what.to_owned());
    }

    /// Takes the bar from the screen.
    pub fn clear(self) {
        if let Some(bar) = self.0 {
            bar.finish_and_clear();
        }
    }
}

/// Bytes that are read at once.
const READ_BUFFER_BYTES: usize = 1 << 18;

/// How much of a log has been read.
pub struct ReadBar(ProgressBar);

/// A log whose reading is shown.
pub type ShownLog = LogReader<BufReader<ProgressBarIter<File>>>;

impl ReadBar {
    /// A bar for reading `what`.
    pub fn new(what: &str) -> Self {
        Self(bar(what, 0, false))
    }

    /// Shows that `read` of `length` bytes were read.
    pub fn show(&self, read: u64, length: u64) {
        self.0.set_length(length);
        self.0.set_position(read);
    }

    /// Opens the log at `path`, to do `what` with it; a bar that is hidden shows nothing.
    ///
    /// # Errors
    /// As [`LogReader::open`].
    pub fn open(what: &str, path: &Path, is_hidden: bool) -> Result<(Self, ShownLog), Error> {
        let file = File::open(path).map_err(|error| Error::io(path, error))?;
        let bytes = file.metadata().map_or(0, |metadata| metadata.len());
        let bar = bar(&format!("{what} {}", name_of(path)), bytes, is_hidden);
        let source = BufReader::with_capacity(READ_BUFFER_BYTES, bar.wrap_read(file));
        let reader = LogReader::new(source, &path.display().to_string());
        if reader.is_err() {
            bar.finish_and_clear();
        }
        Ok((Self(bar), reader?))
    }

    /// Takes the bar from the screen.
    pub fn clear(self) {
        self.0.finish_and_clear();
    }
}

fn bar(what: &str, bytes: u64, is_hidden: bool) -> ProgressBar {
    let target = if is_hidden { ProgressDrawTarget::hidden() } else { ProgressDrawTarget::stderr_with_hz(10) };
    let bar = ProgressBar::with_draw_target(Some(bytes), target);
    let style = ProgressStyle::with_template("{msg} [{bar:40}] {bytes} of {total_bytes}, {eta} left");
    bar.set_style(style.unwrap_or_else(|_| ProgressStyle::default_bar()).progress_chars("=> "));
    bar.set_message(what.to_owned());
    bar
}

/// A group in one line.
fn in_words(group: &GroupLive, elapsed: Nanos) -> String {
    let late = |q| short(group.lateness.percentile(q));
    format!(
        "{:8} {:>8}  {:>7} released  {} skipped  late p50 {} p99 {} max {}  busy {:.0} %",
        group.name,
        group.rate.to_string(),
        group.released,
        group.skipped,
        late(0.5),
        late(0.99),
        short(group.lateness.max()),
        100.0 * group.busy(elapsed)
    )
}

/// A time with two or three digits.
fn short(time: Nanos) -> String {
    match time.0 {
        ..10_000 => format!("{:.1} us", time.0 as f64 / 1e3),
        10_000..1_000_000 => format!("{} us", time.0 / 1_000),
        _ => format!("{:.1} ms", time.0 as f64 / 1e6),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use palpate::runtime::{Execution, RateGroup, Runtime};

    #[test]
    fn a_group_is_shown_in_one_line() {
        let mut graph = Runtime::builder(Execution::Virtual);
        let group = RateGroup::hz(1000).name("local").latency(Nanos(20_000));
        let running = graph.group(group, vec![]).until(Nanos(99_000_000)).build().unwrap().start().unwrap();
        running.wait_for(Duration::MAX);
        assert_eq!(
            in_words(&running.live()[0], Nanos(100_000_000)),
            "local     1000 Hz      100 released  0 skipped  late p50 0.0 us p99 0.0 us max 0.0 us  busy 2 %"
        );
    }

    #[test]
    fn times_are_short() {
        assert_eq!(
            [80, 9_960, 12_345, 123_456, 1_234_567].map(|ns| short(Nanos(ns))),
            ["0.1 us", "10.0 us", "12 us", "123 us", "1.2 ms"]
        );
    }
}
