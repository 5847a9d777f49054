//! Runs the hard cases with each local model in virtual time and prints how far they are from `full`.
//!
//! `cargo run --release --example hard_cases` shows the quick ones and `-- NAME...` those whose name begins so; `-- --all` shows
//! all, which takes minutes, and `-- --docs` also writes them to docs/hard_cases.md. `--bounds` prints what bounds are made from.
//! Nothing in it depends on time, so it is the same on every machine up to rounding.

mod arguments;
#[allow(dead_code, reason = "the bounds are for tools/tests/hard_cases.rs")]
mod cases;
#[allow(dead_code, reason = "what tools/tests/hard_cases.rs checks is not in the table")]
mod measure;

use std::fmt::Write as _;
use std::path::Path;

use arguments::Asked;
use cases::{Case, KINDS, Run, Setup};
use measure::{Measured, Traced};
use palpate::Error;
use palpate::model::local::Kind as LocalModelKind;

/// What the table in the docs begins after.
const MARK: &str = "<!-- made by `cargo run --release --example hard_cases -- --docs` -->\n";

/// The models that the docs have, in this order.
const DOCUMENTED: [LocalModelKind; 3] =
    [LocalModelKind::Patch, LocalModelKind::LinearBoundary, LocalModelKind::Predictive];

/// Cases that take a second or two.
const QUICK: [&str; 4] = ["impact", "teleport", "half", "vertex"];

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let known: Vec<&str> = KINDS.into_iter().flatten().map(|case| case.name).collect();
    let Asked { names, all, docs, bounds: only_bounds } = Asked::read(std::env::args().skip(1), &known)?;
    let names: Vec<&str> = if names.is_empty() { QUICK.to_vec() } else { names.iter().map(String::as_str).collect() };
    let bases = tempfile::tempdir()?;
    let all = docs || all;
    let mut document = String::from("| case | what is hard |");
    DOCUMENTED.iter().for_each(|model| document += &format!(" `{}` |", model.name()));
    document += "\n| --- | --- | --- | --- | --- |\n";
    if !only_bounds {
        println!("| case | model | late | rms | max | jump | energy | peak | verdict |");
        println!("| --- | --- | --- | --- | --- | --- | --- | --- | --- |");
    }
    for case in KINDS.into_iter().flatten().filter(|case| all || names.iter().any(|name| case.name.starts_with(name))) {
        if only_bounds {
            print!("{}", bounds(case, bases.path())?);
            continue;
        }
        let runs = cells_of(case, bases.path())?;
        print!("{}", rows(case, &runs));
        document += &documented(case, &runs);
    }
    if docs {
        let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../docs/hard_cases.md");
        let text = std::fs::read_to_string(&path)?;
        let head = text.find(MARK).ok_or("docs/hard_cases.md: no mark to write the table after")? + MARK.len();
        std::fs::write(&path, format!("{}\n{document}", &text[..head]))?;
    }
    Ok(())
}

/// Lateness, errors, peak and verdict of each run of a case.
fn cells_of(case: &Case, bases: &Path) -> Result<Vec<[String; 7]>, Error> {
    let full = measure::full(case)?;
    Ok(case.runs.iter().map(|run| cells(run, measure::run(case, run, bases), &full)).collect())
}

/// The rows of one case: one for each model, whose cells have a figure for each of its runs.
fn rows(case: &Case, cells: &[[String; 7]]) -> String {
    let mut rows = String::new();
    let mut cells = cells.iter();
    // The runs of one model follow each other.
    for runs in case.runs.chunk_by(|one, next| one.model == next.model) {
        let cells: Vec<&[String; 7]> = cells.by_ref().take(runs.len()).collect();
        // A verdict may have a comma of its own.
        let joint = |place| if place == 6 { "; " } else { ", " };
        let column = |place: usize| {
            let figures: Vec<&str> = cells.iter().map(|run| run[place].as_str()).collect();
            figures.join(joint(place))
        };
        let columns: Vec<String> = (0..7).map(column).collect();
        rows += &format!("| {} | `{}` | {} |\n", case.name, runs[0].model.name(), columns.join(" | "));
    }
    rows
}

/// The row of one case in the docs: what is hard about it, and rms and peak of each model, the late ones with their lateness.
fn documented(case: &Case, cells: &[[String; 7]]) -> String {
    let scene = match case.body {
        Setup::Scene(name) => format!(", `{name}`"),
        Setup::UnequalMasses => String::new(),
    };
    let of_model = |model: &LocalModelKind| {
        let runs = case.runs.iter().zip(cells).filter(|(run, _)| run.model == *model);
        let told = runs.map(|(run, [late, rms, _, _, _, peak, verdict])| {
            let late = if run.late > 0.0 { format!("{late} late: ") } else { String::new() };
            if rms.is_empty() { format!("{late}{verdict}") } else { format!("{late}{rms}, {peak}") }
        });
        told.collect::<Vec<_>>().join("; ")
    };
    let columns = DOCUMENTED.map(|model| of_model(&model)).join(" | ");
    format!("| {} | {}{scene} | {columns} |\n", case.name, case.hard)
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
