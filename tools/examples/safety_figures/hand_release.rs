//! The paper's Fig. 17: a hand that presses and lets go, with each model and without any safety stage; and `hold` with all.

use palpate::log::LogRecord;
use palpate::model::local::Kind as LocalModelKind;
use palpate::prelude::*;
use palpate::scene::{SafetySpec, Scene};
use palpate::session::Summary;
use palpate_cli::drawing::{Colour, Curve, Panel, Sheet};

use crate::repository::in_repository;

/// The models shown, in the order of the legend.
const MODELS: [(LocalModelKind, Colour); 4] = [
    (LocalModelKind::Full, Colour::BLUE),
    (LocalModelKind::Predictive, Colour::GREEN),
    (LocalModelKind::Patch, Colour::ORANGE),
    (LocalModelKind::Hold, Colour::RED),
];
/// The hand lets go (s).
const RELEASE_S: f64 = 1.0;
/// Top of the block at rest (m).
const TOP_M: f64 = 0.1;

/// A run of the scene: with every stage that it switches off, or with the defaults.
fn run(model: LocalModelKind, defaults: bool) -> Result<Summary, Error> {
    let path = in_repository("scenes/hand_release.toml");
    let mut scene = Scene::load(&path)?.with_model(model);
    if defaults {
        scene.safety = SafetySpec::default();
    }
    Session::from_scene(scene).virtual_time().keep_records().build()?.run()
}

/// Height of the tool over the top of the block (mm) at each time (s).
fn height(summary: &Summary) -> Vec<(f64, f64)> {
    let of = |record: &LogRecord| match record {
        LogRecord::Tool(tool) => Some((tool.time.as_secs_f64(), 1e3 * (tool.position_m[2] - TOP_M))),
        _ => None,
    };
    summary.records.iter().filter_map(of).collect()
}

/// The reference's, if it is there: a clone has it, a package does not.
fn reference() -> Vec<(f64, f64)> {
    let path = in_repository("tests/reference/hand_release.csv");
    let text = std::fs::read_to_string(path).unwrap_or_default();
    let point = |line: &str| {
        let mut cells = line.split(',').map_while(|cell| cell.parse::<f64>().ok());
        Some((cells.next()?, 1e3 * (cells.next()? - TOP_M)))
    };
    text.lines().filter_map(point).collect()
}

fn curve(points: Vec<(f64, f64)>, colour: Colour) -> Curve {
    Curve { points, colour, ..Curve::default() }
}

/// Runs everything and draws it.
pub fn sheet() -> Result<Sheet, Error> {
    let mut bare = Vec::new();
    for (model, colour) in MODELS {
        eprintln!("hand_release: {}", model.name());
        bare.push((model, colour, height(&run(model, false)?)));
    }
    eprintln!("hand_release: hold with the defaults");
    let guarded = run(LocalModelKind::Hold, true)?;
    let acted: Vec<String> =
        guarded.report.devices[0].limits.stages.iter().map(|(name, n)| format!("{name} {n}")).collect();
    println!("hand_release, hold with the safety defaults, ticks in which a stage acted: {}\n", acted.join(", "));
    // Before it leaves the picture.
    let shown = |points: &[(f64, f64)]| points.iter().copied().take_while(|point| point.1.abs() < 30.0).collect();
    let reference = || curve(reference(), Colour::INK).wide();
    let mut whole = vec![reference()];
    whole.extend(bare.iter().rev().map(|(_, colour, points)| curve(shown(points), *colour)));
    let mut closer = vec![reference()];
    let quiet = bare.iter().rev().filter(|(model, ..)| *model != LocalModelKind::Hold);
    closer.extend(quiet.map(|(_, colour, points)| curve(points.clone(), *colour)));
    let panel = |caption: &str, times, curves| Panel {
        caption: caption.to_owned(),
        x_label: "time (s)",
        y_label: "tool over the surface (mm)",
        shown: times,
        curves,
        marks: vec![RELEASE_S],
        ..Panel::default()
    };
    let mut legend = vec![("reference".to_owned(), Colour::INK)];
    legend.extend(MODELS.map(|(model, colour)| (model.name().to_owned(), colour)));
    Ok(Sheet {
        title: "hand_release: a hand presses 9 mm deep and lets go at 1 s".to_owned(),
        subtitle: "a device of 75 g that gives way to the force; the height of the tool; hold with a force of 30 Hz"
            .to_owned(),
        legend,
        rows: vec![
            vec![panel("every safety stage off that can be", 0.0..2.4, whole)],
            vec![panel("the same without hold, after the release", 0.95..2.4, closer)],
            vec![panel(
                "hold with the safety defaults: the passivity controller bounds it",
                0.0..2.4,
                vec![curve(height(&guarded), Colour::RED)],
            )],
        ],
    })
}
