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

use cases::{Case, KINDS, Run, Setup};
use measure::{Measured, Traced};
use palpate::Error;

/// What the tables in the docs begin after.
const MARK: &str = "<!-- made by `cargo run --release --example hard_cases -- --docs` -->\n";

/// Cases that take a second or two.
const QUICK: [&str; 4] = ["impact", "teleport", "half", "vertex"];

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let asked = |option: &str| arguments.iter().any(|argument| argument == option);
    let (only_bounds, docs) = (asked("--bounds"), asked("--docs"));
    let mut names: Vec<&str> = arguments.iter().map(String::as_str).filter(|name| !name.starts_with("--")).collect();
    if names.is_empty() {
        names = QUICK.to_vec();
    }
    let bases = tempfile::tempdir()?;
    let all = docs || asked("--all");
    let mut scenes = String::from("| case | scene | what is hard |\n| --- | --- | --- |\n");
    let mut table = String::from(
        "| case | model | late | rms | max | jump | energy | peak | verdict |\n\
         | --- | --- | --- | --- | --- | --- | --- | --- | --- |\n",
    );
    if !only_bounds {
        print!("{table}");
    }
    for case in KINDS.into_iter().flatten().filter(|case| all || names.iter().any(|name| case.name.starts_with(name))) {
        let rows = if only_bounds { bounds(case, bases.path())? } else { rows(case, bases.path())? };
        print!("{rows}");
        let scene = match case.body {
            Setup::Scene(name) => format!("`{name}`"),
            Setup::UnequalMasses => "(own body)".to_owned(),
        };
        writeln!(scenes, "| {} | {scene} | {} |", case.name, case.hard)?;
        table += &rows;
    }
    if docs {
        let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../docs/hard_cases.md");
        let text = std::fs::read_to_string(&path)?;
        let head = text.find(MARK).ok_or("docs/hard_cases.md: no mark to write the tables after")? + MARK.len();
        std::fs::write(&path, format!("{}\n{scenes}\n{}", &text[..head], for_docs(&table)))?;
    }
    Ok(())
}

/// What the docs have of a table of rows: not the largest error, the jump and the error of energy, which the command prints.
fn for_docs(table: &str) -> String {
    let kept = |line: &str| {
        let cells = line.split('|').enumerate().filter(|(place, _)| !(5..=7).contains(place)).map(|(_, cell)| cell);
        format!("{}\n", cells.collect::<Vec<_>>().join("|"))
    };
    table.lines().map(kept).collect()
}

/// The rows of one case: one for each model, whose cells have a figure for each of its runs.
fn rows(case: &Case, bases: &Path) -> Result<String, Box<dyn std::error::Error>> {
    let full = measure::full(case)?;
    let mut rows = String::new();
    // The runs of one model follow each other.
    for runs in case.runs.chunk_by(|one, next| one.model == next.model) {
        let cells: Vec<[String; 7]> =
            runs.iter().map(|run| cells(run, measure::run(case, run, bases), &full)).collect();
        // A verdict may have a comma of its own.
        let joint = |place| if place == 6 { "; " } else { ", " };
        let column = |place: usize| {
            let figures: Vec<&str> = cells.iter().map(|run| run[place].as_str()).collect();
            figures.join(joint(place))
        };
        let columns: Vec<String> = (0..7).map(column).collect();
        writeln!(rows, "| {} | `{}` | {} |", case.name, runs[0].model.name(), columns.join(" | "))?;
    }
    Ok(rows)
}

/// Lateness, errors, peak and verdict of a run.
fn cells(run: &Run, traced: Result<Traced, Error>, full: &Traced) -> [String; 7] {
    let late = run.late.to_string();
    match traced {
        Err(refusal) => {
            let [rms, max, jump, energy, peak] = [const { String::new() }; 5];
            [late, rms, max, jump, energy, peak, format!("refused: {refusal}")]
        }
        Ok(traced) => {
            let measured = Measured::between(&traced, full);
            let error = measured.error;
            let [rms, max, jump, energy] = [error.rms, error.max, error.jump, error.energy].map(short);
            let peak = format!("{:.2}", measured.peaks_n[0] / measured.peaks_n[1]);
            let verdict = match &traced.fault {
                Some(fault) => format!("stopped: {fault}"),
                None => measured.verdict().to_owned(),
            };
            [late, rms, max, jump, energy, peak, verdict]
        }
    }
}

/// What the bounds of one case are made from: a line for each run that is not refused.
fn bounds(case: &Case, bases: &Path) -> Result<String, Box<dyn std::error::Error>> {
    let full = measure::full(case)?;
    let mut lines = String::new();
    for run in case.runs {
        let Ok(traced) = measure::run(case, run, bases) else { continue };
        let error = Measured::between(&traced, &full).error;
        let figures = [error.rms, error.max, error.jump, error.energy].map(|figure| figure.to_string()).join("|");
        writeln!(lines, "{}|{:?}|{}|{figures}", case.name, run.model, run.late)?;
    }
    Ok(lines)
}

/// Two digits that count.
fn short(percent: f64) -> String {
    match percent.abs() {
        size if size < 0.995 => format!("{percent:.2}"),
        size if size < 9.95 => format!("{percent:.1}"),
        _ => format!("{percent:.0}"),
    }
}
