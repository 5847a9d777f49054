//! The global model behind a link: error and jump of `hold`, `patch` and `predictive` against one-way delay and loss, in virtual time.
//! Writes the table of docs/link_measured.md, between its marks, and a picture.
//!
//! `cargo bench --bench link`; with `-- --quick` a short form that prints and writes nothing; `-- --print` prints all of it and writes
//! nothing.

#[path = "../common/mod.rs"]
mod common;

use std::process::ExitCode;

use palpate::Error;
use palpate::model::local::Kind;
use palpate::runtime::Nanos;
use palpate::scene::LinkSpec;
use palpate_cli::compare::{CompareOptions, Comparison};
use palpate_cli::drawing::{Picture, Series, Sign};

use common::{colour, figure, table};

/// A scripted drag, a hand that gives way, presses and taps of a pointed tool, an organ.
const SCENES: [&str; 4] = ["drag_friction", "hand", "demo", "liver"];
const DELAYS_MS: [f64; 6] = [0.0, 1.0, 5.0, 14.0, 33.0, 100.0];
const LOSSES: [f64; 3] = [0.0, 0.01, 0.05];
const MODELS: [Kind; 3] = [Kind::Predictive, Kind::Patch, Kind::Hold];
/// Simulated time: the drags up to their middle (s).
const DURATION_S: f64 = 1.5;
const DOCUMENT: &str = "docs/link_measured.md";
const BEGIN: &str = "<!-- what `cargo bench --bench link` writes -->\n";
const END: &str = "<!-- end -->\n";

/// Of one model on one scene.
#[derive(Clone, Copy)]
struct Found {
    rms: f64,
    /// Largest change of the force in a tick beyond that of `full`.
    jump: f64,
}

/// At one delay and loss, the models in order; `None` for what did not run.
type Row = (f64, f64, [Option<Found>; MODELS.len()]);
/// For each delay all losses.
type Grid = Vec<Row>;

fn measure(name: &str, delays: &[f64], losses: &[f64], duration_s: f64) -> Result<Grid, Error> {
    let mut grid = Vec::new();
    for &delay_ms in delays {
        for &loss in losses {
            eprintln!("{name}: {delay_ms} ms, {loss}");
            let mut scene = common::scene(name)?;
            // What the scene feeds back without a link.
            scene.local.feedback = None;
            scene.link = Some(LinkSpec { delay_ms, loss, seed: 1, ..LinkSpec::default() });
            let duration_s = Some(scene.run.duration_s.min(duration_s));
            let options =
                CompareOptions { models: MODELS.into(), latencies: vec![Nanos::ZERO], duration_s, finer: false };
            let comparison = Comparison::measure(&scene, &options, |_| ())?;
            let of = |kind: Kind| {
                let run = comparison.runs.iter().find(|run| run.model == kind.name())?.measured()?;
                let jump = (run.error.jump - comparison.full.error.jump).max(0.0);
                Some(Found { rms: run.error.rms, jump })
            };
            grid.push((delay_ms, loss, MODELS.map(of)));
        }
    }
    Ok(grid)
}

/// One row for each delay, with all losses in a cell.
fn rows(name: &str, grid: &Grid) -> Vec<Vec<String>> {
    let row = |(number, group): (usize, &[Row])| {
        let cell = |model: usize, of: fn(Found) -> f64| {
            let figures =
                group.iter().map(|(_, _, found)| found[model].map_or_else(|| "-".to_owned(), |it| figure(of(it))));
            figures.collect::<Vec<_>>().join(" / ")
        };
        let scene = if number == 0 { format!("`{name}`") } else { String::new() };
        let first = [scene, group[0].0.to_string()].into_iter();
        first.chain((0..MODELS.len()).map(|model| cell(model, |it| it.rms))).chain([cell(0, |it| it.jump)]).collect()
    };
    grid.chunk_by(|(a, ..), (b, ..)| a == b).enumerate().map(row).collect()
}

fn heads() -> Vec<String> {
    let models = MODELS.iter().map(|kind| format!("`{}` rms", kind.name()));
    let jump = format!("`{}` jump", MODELS[0].name());
    ["scene", "delay ms"].map(str::to_owned).into_iter().chain(models).chain([jump]).collect()
}

fn picture(found: &[(&str, Grid)], loss: f64) -> Picture {
    let mut series = Vec::new();
    for (place, kind) in MODELS.into_iter().enumerate() {
        for (name, grid) in found {
            let at = grid.iter().filter(|(_, of, _)| *of == loss);
            let points: Vec<_> = at.filter_map(|(delay, _, models)| Some((*delay, models[place]?.rms))).collect();
            let last = points.len().saturating_sub(1);
            let label = |at: usize| if at == last { format!("{} {name}", kind.name()) } else { String::new() };
            let points = points.into_iter().enumerate().map(|(at, (x, y))| (x.max(0.5), y, label(at))).collect();
            let (colour, sign) = (colour(kind.name()), Sign::Disc);
            series.push(Series {
                name: kind.name().to_owned(),
                colour,
                is_joined: true,
                sign,
                is_hollow: false,
                points,
            });
        }
    }
    Picture {
        title: format!("The global model behind a link, {} % of packets lost", figure(100.0 * loss)),
        x: "one-way delay (ms); 0 is drawn at 0.5".to_owned(),
        y: "error of the force, rms (% of the peak)".to_owned(),
        marks: Vec::new(),
        levels: Vec::new(),
        series,
    }
}

fn document(is_quick: bool, only_prints: bool) -> Result<(), Error> {
    let (names, delays, losses, duration_s) = match is_quick {
        true => (&SCENES[..1], &DELAYS_MS[3..4], &LOSSES[1..2], 0.2),
        false => (&SCENES[..], &DELAYS_MS[..], &LOSSES[..], DURATION_S),
    };
    let mut table_rows = Vec::new();
    let mut all = Vec::new();
    let grids: Vec<Result<Grid, Error>> = std::thread::scope(|scope| {
        let start = |name: &&'static str| {
            let name = *name;
            scope.spawn(move || measure(name, delays, losses, duration_s))
        };
        let running: Vec<_> = names.iter().map(start).collect();
        running.into_iter().map(|running| running.join().expect("a scene is measured")).collect()
    });
    for (name, grid) in names.iter().zip(grids) {
        let grid = grid?;
        table_rows.extend(rows(name, &grid));
        all.push((*name, grid));
    }
    let heads = heads();
    let text = table(&heads.iter().map(String::as_str).collect::<Vec<_>>(), 1, &table_rows);
    if is_quick || only_prints {
        print!("{text}");
        return Ok(());
    }
    common::write("docs/img/link_delay.svg", &picture(&all, LOSSES[1]).to_svg())?;
    let path = common::in_repository(DOCUMENT);
    let whole = std::fs::read_to_string(&path).map_err(|error| Error::io(&path, error))?;
    let parts = whole.split_once(BEGIN).and_then(|(before, rest)| Some((before, rest.split_once(END)?.1)));
    let Some((before, after)) = parts else {
        return Err(Error::io(&path, std::io::Error::other("has lost its marks")));
    };
    common::write(DOCUMENT, &format!("{before}{BEGIN}\n{text}\n{END}{after}"))
}

fn main() -> ExitCode {
    let Some(arguments) = common::arguments() else { return ExitCode::SUCCESS };
    let only_prints = std::env::args().any(|argument| argument == "--print");
    match document(arguments.is_quick, only_prints) {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("{error}");
            ExitCode::FAILURE
        }
    }
}
