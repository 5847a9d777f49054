//! How far the force of `predictive` on threads is from the force that the whole body gives for the same tool samples.
//!
//! Each scene runs in real time; then `full` follows the positions that the device reported, in virtual time. Ticks within
//! 100 ms after a skipped period of the haptic group are counted apart: what the host takes away is no error of the model.
//!
//! ```text
//! cargo run --release --example real_time_error                          drag_friction
//! cargo run --release --example real_time_error -- hand wave drag_slip   scenes by name
//! cargo run --release --example real_time_error -- drag_slip:20:4000 --bases target/bases
//!     with 20^3 nodes at 4 kHz; bases that take seconds are made beforehand, by a run in virtual time
//! ```

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use palpate::devices::ToolPath;
use palpate::log::LogRecord;
use palpate::model::Vec3;
use palpate::model::local::Kind as LocalModelKind;
use palpate::prelude::*;
use palpate::scene::{BodySpec, Scene};
use palpate::session::Summary;

/// Ticks this long after a skipped period are counted apart (s).
const AFTER_A_SLIP_S: f64 = 0.1;

fn main() -> Result<(), Error> {
    let mut arguments = std::env::args().skip(1);
    let (mut names, mut bases) = (Vec::new(), None);
    while let Some(argument) = arguments.next() {
        match argument.as_str() {
            "--bases" => bases = arguments.next().map(PathBuf::from),
            _ => names.push(argument),
        }
    }
    if names.is_empty() {
        names.push("drag_friction".to_owned());
    }
    for name in names {
        let mut scene = scene(&name)?;
        if bases.is_some() {
            scene.local.basis_folder = bases.clone();
            let mut beforehand = scene.clone();
            beforehand.global.basis_latency_ms = Some(0.0);
            Session::from_scene(beforehand.with_model(LocalModelKind::Predictive)).virtual_time().build()?.run()?;
        }
        compare(&name, scene)?;
    }
    Ok(())
}

/// The scene `NAME`, or `NAME:NODES:HZ` with so many nodes along each edge of its block, at this haptic rate.
fn scene(name: &str) -> Result<Scene, Error> {
    let mut parts = name.split(':');
    let file = parts.next().unwrap_or_default();
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("scenes").join(file).with_extension("toml");
    let mut scene = Scene::load(&path)?;
    let numbers = (parts.next().and_then(|n| n.parse().ok()), parts.next().and_then(|hz| hz.parse().ok()));
    if let ((Some(nodes), Some(hz)), Some(body)) = (numbers, scene.body.as_mut().and_then(BodySpec::mass_spring_mut)) {
        body.block.nodes = [nodes; 3];
        scene.local.rate_hz = hz;
        // As the stability limit asks for.
        scene.global.substeps_per_ms = None;
    }
    Ok(scene)
}

fn compare(name: &str, scene: Scene) -> Result<(), Error> {
    let real =
        Session::from_scene(scene.clone().with_model(LocalModelKind::Predictive)).keep_records().build()?.run()?;
    let mut reference = scene.with_model(LocalModelKind::Full);
    reference.devices[0].path = Some(reported(&real)?);
    let full = Session::from_scene(reference).virtual_time().keep_records().build()?.run()?;

    let (forces, expected) = (forces(&real), forces(&full));
    let peak = expected.values().map(|force| force.norm()).fold(0.0, f64::max);
    let slips = slips(&real);
    let is_clear = |time: f64| !slips.iter().any(|slip| (0.0..AFTER_A_SLIP_S).contains(&(time - slip)));
    let (mut all, mut clear) = (Vec::new(), Vec::new());
    for (&time, force) in &forces {
        let Some(expected) = expected.get(&time) else { continue };
        let error = 100.0 * (force - expected).norm() / peak;
        all.push(error);
        if is_clear(time as f64 * 1e-9) {
            clear.push(error);
        }
    }
    let left_out = 100.0 * (1.0 - clear.len() as f64 / all.len() as f64);
    let shares: Vec<String> = real.report.devices[0]
        .force
        .shares()
        .map(|(model, share)| format!("{} {:.2} %", model.name(), 100.0 * share))
        .collect();
    println!(
        "{name}: rms {:.3} %, max {:.2} % of the peak; over all ticks rms {:.3} % ({left_out:.1} % left out, {} slips); \
         served by {}",
        rms(&clear),
        clear.iter().copied().fold(0.0, f64::max),
        rms(&all),
        slips.len(),
        shares.join(", ")
    );
    Ok(())
}

fn rms(errors: &[f64]) -> f64 {
    (errors.iter().map(|e| e * e).sum::<f64>() / errors.len().max(1) as f64).sqrt()
}

/// The tool as the device reported it.
fn reported(summary: &Summary) -> Result<ToolPath, Error> {
    let samples = summary.records.iter().filter_map(|record| match record {
        LogRecord::Tool(sample) => Some((sample.time.as_secs_f64(), sample.position_m)),
        _ => None,
    });
    let (times, positions) = samples.unzip();
    ToolPath::new(times, positions)
}

/// By the end of their tick (ns).
fn forces(summary: &Summary) -> BTreeMap<u64, Vec3> {
    let force = |record: &LogRecord| match record {
        LogRecord::Force(sample) => Some((sample.time.0, Vec3::from(sample.force_n))),
        _ => None,
    };
    summary.records.iter().filter_map(force).collect()
}

/// When the haptic group, the first, came back from skipped periods (s).
fn slips(summary: &Summary) -> Vec<f64> {
    let slip = |record: &LogRecord| match record {
        LogRecord::Tick(timing) if timing.group == 0 && timing.slips > 0 => Some(timing.scheduled.as_secs_f64()),
        _ => None,
    };
    summary.records.iter().filter_map(slip).collect()
}
