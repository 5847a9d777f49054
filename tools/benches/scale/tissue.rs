//! Livers of tetrahedra at several resolutions: what the global model takes of its period, and threads that show it.

use std::time::{Duration, Instant};

use palpate::Error;
use palpate::devices::ToolPath;
use palpate::mesh::{Sizes, organs};
use palpate::model::Vec3;
use palpate::model::body::{Body, State, Tetrahedra, Tissue, Where};
use palpate::model::contact::{Contact, Law, ToolMotion};
use palpate::model::equilibrium::static_equilibrium;
use palpate::model::integrator::Spectrum;
use palpate::model::local::Kind;
use palpate::model::simulation::{Simulation, Stepping};
use palpate::runtime::{Nanos, RateGroup};
use palpate::session::Session;

use crate::common::{figure, table};

/// Elements of these sizes (mm): 4 mm makes some 40,000.
const SIZES_MM: [f64; 5] = [9.0, 7.0, 6.0, 5.0, 4.0];
const QUICK_MM: [f64; 1] = [14.0];
const TICK_S: f64 = 1e-3;
const PERIOD_MS: f64 = 1e3 / 30.0;
/// A pole of the right lobe, and how deep the tool presses (m).
const OVER: [f64; 3] = [-0.02, 0.0, 0.05];
const DEPTH_M: f64 = 0.006;
const THREADED_S: f64 = 3.0;

fn liver(size_mm: f64, viscosity: f64) -> Result<Tetrahedra, Error> {
    let mesh = organs::liver(Sizes { element_m: 1e-3 * size_mm, surface_m: None })?;
    let tissue = Tissue { viscosity, ..Tissue::LIVER };
    Ok(Tetrahedra::builder(mesh).tissue(tissue).fix(Where::Group("attached".into())).build()?)
}

/// Straight down onto the liver from above, and held there.
fn press(body: &Tetrahedra) -> Result<ToolPath, Error> {
    let beside = |x: &&Vec3| (x.x - OVER[0]).hypot(x.y - OVER[1]) < 0.008;
    let top = body.rest().iter().filter(beside).map(|x| x.z).fold(0.0, f64::max);
    let at = |z: f64| [OVER[0], OVER[1], top + z];
    ToolPath::new(vec![0.0, 0.5, THREADED_S], vec![at(0.003), at(-DEPTH_M), at(-DEPTH_M)])
}

/// The table, a row for each size.
pub fn text(is_quick: bool) -> Result<String, Error> {
    let mut rows = Vec::new();
    for &size_mm in if is_quick { &QUICK_MM[..] } else { &SIZES_MM[..] } {
        let row = row(size_mm, if is_quick { 0.3 } else { THREADED_S })?;
        eprintln!("{}", row.join(" | "));
        rows.push(row);
    }
    let heads = [
        "element mm",
        "elements",
        "nodes",
        "substeps per ms",
        "without viscosity",
        "ns per element and step",
        "follow ms",
        "of the period %",
        "periods skipped, `hold` on threads",
        "haptic lateness p99 us",
        "equilibrium s",
    ];
    Ok(format!(
        "## Tissue\n\nLivers of tetrahedra (E 5 kPa, nu 0.45, 2 Pa s, nodal pressure) from `palpate::mesh::organs::liver`. *Follow* is what \
         the global model does in one period of 33.3 ms: its substeps with contact, the least of 3 rounds, one core. The threaded \
         run presses {} mm into the liver for {THREADED_S} s with the local model `hold` at 1 kHz beside it. What stands in the way \
         of a finer liver is the explicit step: its limit by stiffness falls with the size of the elements and that by viscosity with the \
         square of it, while the elements grow with the cube. \
         *Equilibrium* is `static_equilibrium` with one node of the surface pushed in by 1 mm.\n\n{}",
        1e3 * DEPTH_M,
        table(&heads, 0, &rows)
    ))
}

fn row(size_mm: f64, threaded_s: f64) -> Result<Vec<String>, Error> {
    let elastic = Spectrum::estimate(&mut liver(size_mm, 0.0)?).substeps(TICK_S);
    let mut body = liver(size_mm, Tissue::LIVER.viscosity)?;
    let (elements, nodes) = (body.element_count(), body.rest().len());
    let substeps = Spectrum::estimate(&mut body).substeps(TICK_S);
    let path = press(&body)?;
    let step_s = step(&body, &path, substeps)?;
    let follow_ms = PERIOD_MS * f64::from(substeps) * step_s * 1e3;
    let pushed = (0..nodes as u32).filter(|&node| body.surface().has_node(node));
    let pushed = pushed.max_by(|&a, &b| body.rest()[a as usize].z.total_cmp(&body.rest()[b as usize].z)).unwrap_or(0);
    let target = body.rest()[pushed as usize] - Vec3::z() * 1e-3;
    let begun = Instant::now();
    static_equilibrium(&mut body, &[(pushed, target)])?;
    let equilibrium_s = begun.elapsed().as_secs_f64();
    let (skipped, lateness) = match threaded(body, path, threaded_s) {
        Ok((skipped, lateness)) => (skipped.to_string(), figure(lateness)),
        Err(refusal) => (refusal.to_string(), "-".to_owned()),
    };
    Ok(vec![
        figure(size_mm),
        elements.to_string(),
        nodes.to_string(),
        substeps.to_string(),
        elastic.to_string(),
        figure(1e9 * step_s / elements as f64),
        figure(follow_ms),
        figure(100.0 * follow_ms / PERIOD_MS),
        skipped,
        lateness,
        figure(equilibrium_s),
    ])
}

/// One substep with contact (s), the least of three rounds.
fn step(body: &Tetrahedra, path: &ToolPath, substeps: u32) -> Result<f64, Error> {
    let state = State::at_rest(body.rest());
    let stepping = Stepping { tick: TICK_S, substeps };
    let mut simulation = Simulation::new(Box::new(body.clone()), state, Contact::default(), Law::default(), stepping)?;
    let at = |tick: usize| Vec3::from(path.at(tick as f64 * TICK_S));
    let mut tick = 0;
    let mut round = |ticks: usize| {
        let begun = Instant::now();
        for _ in 0..ticks {
            simulation.tick(ToolMotion::straight(at(tick), at(tick + 1)));
            tick += 1;
        }
        begun.elapsed().as_secs_f64() / (ticks as f64 * f64::from(substeps))
    };
    round(100);
    Ok((0..3).map(|_| round(33)).fold(f64::INFINITY, f64::min))
}

/// Skipped periods of the global group of all, and the lateness of the haptic one (us), on threads.
fn threaded(body: Tetrahedra, path: ToolPath, seconds: f64) -> Result<(u64, f64), Error> {
    let session = Session::builder(body).path(path).model(Kind::Hold).duration_s(seconds);
    // A body that does not fit is refused unless its budget is the program's own word.
    let global = RateGroup::hz(30).budget(Nanos::from_duration(Duration::from_millis(1)));
    let summary = session.global(global).build()?.run()?;
    let group = |name: &str| summary.runtime.groups.iter().find(|group| group.name == name);
    let skipped = group("global").map_or(0, |group| group.skipped);
    let lateness = group("local").map_or(f64::NAN, |group| group.lateness.percentile(0.99).0 as f64 * 1e-3);
    Ok((skipped, lateness))
}
