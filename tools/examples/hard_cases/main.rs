//! Runs the hard cases with each local model in virtual time and prints how far they are from `full`.
//!
//! `cargo run --release --example hard_cases` shows the quick ones and `-- NAME...` those whose name begins so; `-- --all` shows
//! all, which takes minutes, and `-- --docs` also writes them to docs/hard_cases.md. `--bounds` prints what bounds are made from.
//! Nothing in it depends on time, so it is the same on every machine up to rounding.

#[allow(dead_code, reason = "the bounds are for tools/tests/hard_cases.rs")]
mod cases;
#[allow(dead_code, reason = "what tools/tests/hard_cases.rs checks is not in the table")]
mod measure;

use std::fmt::Write as _;
use std::path::Path;

use cases::{Case, KINDS, Setup};
use measure::Measured;

/// What the table in the docs begins after.
const MARK: &str = "<!-- made by `cargo run --release --example hard_cases -- --docs` -->\n";

/// Cases that take a second or two.
const QUICK: [&str; 4] = ["impact", "teleport", "half", "vertex"];

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let asked = |option: &str| arguments.iter().any(|argument| argument == option);
    let (bounds, docs) = (asked("--bounds"), asked("--docs"));
    let mut names: Vec<&str> = arguments.iter().map(String::as_str).filter(|name| !name.starts_with("--")).collect();
    if names.is_empty() {
        names = QUICK.to_vec();
    }
    let bases = tempfile::tempdir()?;
    let all = docs || asked("--all");
    let mut table = String::from(
        "| case | scene | what is hard | model | late | rms | max | jump | energy | peak | verdict |\n\
         | --- | --- | --- | --- | --- | --- | --- | --- | --- | --- | --- |\n",
    );
    if !bounds {
        print!("{table}");
    }
    for case in KINDS.into_iter().flatten().filter(|case| all || names.iter().any(|name| case.name.starts_with(name))) {
        let rows = rows(case, bounds, bases.path())?;
        print!("{rows}");
        table += &rows;
    }
    if docs {
        let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../docs/hard_cases.md");
        let text = std::fs::read_to_string(&path)?;
        let head = text.find(MARK).ok_or("docs/hard_cases.md: no mark to write the table after")? + MARK.len();
        std::fs::write(&path, format!("{}\n{table}", &text[..head]))?;
    }
    Ok(())
}

/// The rows of one case: a run each.
fn rows(case: &Case, bounds: bool, bases: &Path) -> Result<String, Box<dyn std::error::Error>> {
    let full = measure::full(case)?;
    let scene = match case.body {
        Setup::Scene(name) => format!("`{name}`"),
        Setup::UnequalMasses => "(own body)".to_owned(),
    };
    let mut rows = String::new();
    for run in case.runs {
        let traced = measure::run(case, run, bases);
        let (name, late) = (run.model.name(), run.late);
        if bounds {
            let Ok(traced) = traced else { continue };
            let error = Measured::between(&traced, &full).error;
            let figures = [error.rms, error.max, error.jump, error.energy];
            let figures = figures.map(|figure| figure.to_string()).join("|");
            writeln!(rows, "{}|{:?}|{late}|{figures}", case.name, run.model)?;
            continue;
        }
        write!(rows, "| {} | {scene} | {} | `{name}` | {late} | ", case.name, case.hard)?;
        match traced {
            Err(refusal) => writeln!(rows, "| | | | | refused: {refusal} |")?,
            Ok(traced) => {
                let measured = Measured::between(&traced, &full);
                let error = measured.error;
                let peak = measured.peaks_n[0] / measured.peaks_n[1];
                let figures = [error.rms, error.max, error.jump, error.energy].map(short).join(" | ");
                let verdict = match &traced.fault {
                    Some(fault) => format!("stopped: {fault}"),
                    None => measured.verdict().to_owned(),
                };
                writeln!(rows, "{figures} | {peak:.2} | {verdict} |")?;
            }
        }
    }
    Ok(rows)
}

/// Two digits that count.
fn short(percent: f64) -> String {
    match percent.abs() {
        size if size < 0.995 => format!("{percent:.2}"),
        size if size < 9.95 => format!("{percent:.1}"),
        _ => format!("{percent:.0}"),
    }
}
