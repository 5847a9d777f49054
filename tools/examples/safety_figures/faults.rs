//! The force through each fault of `scenes/device_faults.toml`.

use palpate::log::LogRecord;
use palpate::prelude::*;
use palpate::scene::Scene;
use palpate::session::Summary;
use palpate_cli::drawing::{Colour, Curve, Panel, Sheet};

use crate::repository::in_repository;

/// What fails, from when to when (s).
const FAULTS: [(&str, f64, f64); 6] = [
    ("states that are 5 reads late", 0.6, 0.7),
    ("every other frame lost", 0.8, 0.9),
    ("a frozen state", 1.0, 1.05),
    ("states that are no numbers", 1.2, 1.22),
    ("the cable comes off", 1.4, 1.6),
    ("a safety stop", 1.8, 1.9),
];

/// Magnitude of a force (N) over time (s), as `pick` finds it.
fn magnitude(summary: &Summary, pick: impl Fn(&LogRecord) -> Option<(Nanos, [f64; 3])>) -> Vec<(f64, f64)> {
    let picked = summary.records.iter().filter_map(pick);
    picked.map(|(time, force)| (time.as_secs_f64(), Vec3::from(force).norm())).collect()
}

/// Runs the scene and draws it.
pub fn sheet() -> Result<Sheet, Error> {
    eprintln!("device_faults");
    let mut scene = Scene::load(&in_repository("scenes/device_faults.toml"))?;
    // In full from the start: the faults come before the start-up ramp is over.
    scene.safety.start_up_ms = 100.0;
    let summary = Session::from_scene(scene).virtual_time().keep_records().build()?.run()?;
    let computed = magnitude(&summary, |record| match record {
        LogRecord::Force(force) => Some((force.time, force.force_n)),
        _ => None,
    });
    let commanded = magnitude(&summary, |record| match record {
        LogRecord::Command(command) => Some((command.time, command.force_n)),
        _ => None,
    });
    let curve =
        |points: &[(f64, f64)], colour| Curve { points: points.to_vec(), colour, is_wide: colour == Colour::ORANGE };
    let panel = |caption: &str, times, marks| Panel {
        caption: caption.to_owned(),
        x_label: "time (s)",
        y_label: "force (N)",
        shown: times,
        curves: vec![curve(&computed, Colour::ORANGE), curve(&commanded, Colour::BLUE)],
        marks,
        ..Panel::default()
    };
    let bounds = FAULTS.iter().flat_map(|&(_, from, to)| [from, to]).collect();
    let mut rows = vec![vec![panel("all of them", 0.0..2.5, bounds)]];
    for pair in FAULTS.chunks(2) {
        let of = |&(words, from, to): &(&str, f64, f64)| panel(words, from - 0.05..to + 0.15, vec![from, to]);
        rows.push(pair.iter().map(of).collect());
    }
    Ok(Sheet {
        title: "device_faults: the force through each fault of the device".to_owned(),
        subtitle: "vertical lines: where a fault begins and ends; start-up ramp shortened to 0.1 s".to_owned(),
        legend: vec![("computed".to_owned(), Colour::ORANGE), ("commanded".to_owned(), Colour::BLUE)],
        rows,
    })
}
