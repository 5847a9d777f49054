//! What the benches that write a document share: arguments, the head of a document, tables, costs of several rounds.

// Each bench uses its part.
#![allow(dead_code)]

#[path = "../../tests/support/repository.rs"]
mod repository;
pub mod tissue;

use std::time::{SystemTime, UNIX_EPOCH};

use palpate::Error;
use palpate::model::body::InstructionSet;
use palpate::model::local::Kind as LocalModelKind;
use palpate::runtime::Nanos;
use palpate::scene::Scene;
use palpate_cli::compare::{CompareOptions, Comparison};
use palpate_cli::drawing::Colour;
pub use repository::in_repository;

/// What the command line asks for.
pub struct Arguments {
    /// A short form whose figures say nothing: does it run? Writes no file.
    pub is_quick: bool,
    /// Errors alone, printed; no costs, no file.
    pub only_errors: bool,
}

/// The arguments; `None` if this is not a `cargo bench`, such as a test of all targets, which must not write documents.
pub fn arguments() -> Option<Arguments> {
    let asked = |flag: &str| std::env::args().any(|argument| argument == flag);
    asked("--bench").then(|| Arguments { is_quick: asked("--quick"), only_errors: asked("--only-errors") })
}

/// A scene of the repository by name.
pub fn scene(name: &str) -> Result<Scene, Error> {
    Scene::load(&in_repository(&format!("scenes/{name}.toml")))
}

/// When and where it was measured, in one paragraph.
pub fn measured_on(command: &str) -> String {
    let kernel = std::fs::read_to_string("/proc/sys/kernel/osrelease").unwrap_or_default();
    let version: Vec<&str> = kernel.trim().split('.').take(2).collect();
    let system =
        if version.is_empty() { std::env::consts::OS.to_owned() } else { format!("Linux {}", version.join(".")) };
    let cores = std::thread::available_parallelism().map_or(1, usize::from);
    format!(
        "Written by `{command}` on {}; palpate {}, {cores} cores, {system}, {}.\n\
         Costs are CPU time of the thread. The caches that other programs empty make up to a quarter of them; errors are the same\n\
         every time.",
        today(),
        env!("CARGO_PKG_VERSION"),
        InstructionSet::detect().name(),
    )
}

/// The date in UTC as 2026-11-21.
fn today() -> String {
    let days = SystemTime::now().duration_since(UNIX_EPOCH).map_or(0, |since| since.as_secs() / 86_400) as i64;
    // Days of the proleptic Gregorian calendar, counted from 1 March of the year 0 (Howard Hinnant's algorithm).
    let shifted = days + 719_468;
    let (era, day_of_era) = (shifted.div_euclid(146_097), shifted.rem_euclid(146_097));
    let year_of_era = (day_of_era - day_of_era / 1460 + day_of_era / 36_524 - day_of_era / 146_096) / 365;
    let day_of_year = day_of_era - (365 * year_of_era + year_of_era / 4 - year_of_era / 100);
    let month_from_march = (5 * day_of_year + 2) / 153;
    let day = day_of_year - (153 * month_from_march + 2) / 5 + 1;
    let month = if month_from_march < 10 { month_from_march + 3 } else { month_from_march - 9 };
    let year = year_of_era + 400 * era + i64::from(month <= 2);
    format!("{year}-{month:02}-{day:02}")
}

/// `compare`, several times: forces are the same, of each cost the least counts.
pub fn compared(scene: &Scene, options: &CompareOptions, rounds: usize) -> Result<Comparison, Error> {
    let mut least = Comparison::measure(scene, options, |_| ())?;
    for _ in 1..rounds {
        least.keep_least(&Comparison::measure(scene, options, |_| ())?);
    }
    Ok(least)
}

/// The colour of a model in every picture; 0 is that of `full`.
pub fn colour(model: &str) -> Colour {
    let place = LocalModelKind::ALL.iter().position(|kind| kind.name() == model && *kind != LocalModelKind::Full);
    Colour::numbered(place.map_or(0, |place| place + 1))
}

/// Microseconds.
pub fn us(time: Nanos) -> f64 {
    time.0 as f64 * 1e-3
}

/// A number with three digits that mean something.
pub fn figure(value: f64) -> String {
    if value > 0.0 && value < 0.0005 {
        return "< 0.001".to_owned();
    }
    let decimals = match value.abs() {
        size if size >= 99.95 => 0,
        size if size >= 9.995 => 1,
        size if size >= 0.9995 => 2,
        0.0 => 0,
        _ => 3,
    };
    format!("{value:.decimals$}")
}

/// A table in Markdown: columns after the first `words` are numbers.
pub fn table(head: &[&str], words: usize, rows: &[Vec<String>]) -> String {
    let line = |cells: &[String]| format!("| {} |\n", cells.join(" | "));
    let rule = (0..head.len()).map(|column| if column < words { "---".to_owned() } else { "---:".to_owned() });
    let head: Vec<String> = head.iter().map(|word| (*word).to_owned()).collect();
    let rule: Vec<String> = rule.collect();
    [line(&head), line(&rule)].into_iter().chain(rows.iter().map(|row| line(row))).collect()
}

/// Rows in one: column by column what each of them has, separated by commas.
pub fn joined(rows: &[Vec<String>]) -> Vec<String> {
    let columns = rows.iter().map(Vec::len).max().unwrap_or(0);
    let column = |place: usize| rows.iter().filter_map(|row| row.get(place).cloned()).collect::<Vec<_>>().join(", ");
    (0..columns).map(column).collect()
}

/// Writes a file of the repository and says so.
pub fn write(path: &str, text: &str) -> Result<(), Error> {
    let path = in_repository(path);
    std::fs::write(&path, text).map_err(|error| Error::io(&path, error))?;
    println!("wrote {}", path.display());
    Ok(())
}
