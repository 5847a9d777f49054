//! Runs a hard case in virtual time, and says how far a model is from `full`.

use std::path::Path;

use palpate::Error;
use palpate::devices::ToolPath;
use palpate::log::LogRecord;
use palpate::model::body::{Block, Body, Spring, SpringNetwork};
use palpate::model::local::Kind as LocalModelKind;
use palpate::model::mesh::Face;
use palpate::runtime::Nanos;
use palpate::runtime::{Disturbance, RateGroup};
use palpate::scene::Scene;
use palpate::session::{Session, SessionBuilder};
use palpate_cli::compare::{ForceDeviation, ForceTrace};

use super::cases::{Case, Run, Setup, Upset};

/// The global model's rate in every hard case (Hz), and its period, rounded up.
const GLOBAL_HZ: f64 = 30.0;
const PERIOD: Nanos = Nanos(33_340_000);
/// The largest force that may reach the device, in every case (N).
pub const MAX_FORCE_N: f64 = 3.3;

/// What a run left behind.
#[derive(Debug)]
pub struct Traced {
    pub trace: ForceTrace,
    /// The largest force that reached the device (N).
    pub commanded_n: f64,
    /// Every computed and every commanded force was finite.
    pub is_finite: bool,
    /// The fault that ended it.
    pub fault: Option<String>,
}

/// A model against `full`.
#[derive(Debug)]
pub struct Measured {
    pub error: ForceDeviation,
    /// Its largest force, and that of `full` (N).
    pub peaks_n: [f64; 2],
}

impl Measured {
    pub fn between(run: &Traced, full: &Traced) -> Self {
        let error = ForceDeviation::between(&run.trace, &full.trace);
        Self { peaks_n: [run.trace.peak_n(), full.trace.peak_n()], error }
    }

    /// In a word; docs/hard_cases.md explains them.
    pub fn verdict(&self) -> &'static str {
        let too_strong = self.peaks_n[0] > 1.3 * self.peaks_n[1];
        match self.error.rms {
            _ if too_strong => "too strong",
            rms if rms <= 1.0 => "as full",
            rms if rms <= 3.0 => "close",
            rms if rms <= 10.0 => "coarse",
            _ => "wrong, bounded",
        }
    }
}

/// Runs `full` on the case; nothing can upset it, it has no global model.
///
/// # Errors
/// If it cannot be run.
pub fn full(case: &Case) -> Result<Traced, Error> {
    traced(session(case, LocalModelKind::Full, 0.0, None)?)
}

/// Runs a model on the case; `bases` is a folder that keeps reduced surroundings from run to run.
///
/// # Errors
/// If it is refused.
pub fn run(case: &Case, run: &Run, bases: &Path) -> Result<Traced, Error> {
    let session = session(case, run.model, run.late, Some(bases))?;
    traced(match case.upset {
        Upset::Nothing => session,
        Upset::Stall(at_s) => {
            let stalled = (at_s * GLOBAL_HZ).round() as u64;
            let work = move |release| if release == stalled { Nanos::from_secs_f64(1.0) } else { Nanos::ZERO };
            session.disturb("global", move |release| Disturbance { work: work(release), ..Disturbance::default() })
        }
        // It sleeps through one release and wakes for the next.
        Upset::EverySecondLost => session.disturb("global", |release| {
            let late_wake = if release % 2 == 1 { PERIOD } else { Nanos::ZERO };
            Disturbance { late_wake, ..Disturbance::default() }
        }),
    })
}

fn session(case: &Case, model: LocalModelKind, late: f64, bases: Option<&Path>) -> Result<SessionBuilder, Error> {
    let late_ms = late * PERIOD.as_secs_f64() * 1e3;
    match case.body {
        Setup::Scene(name) => {
            let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../scenes");
            let mut scene = Scene::load(&folder.join(name).with_extension("toml"))?.with_model(model);
            scene.global.compute_latency_ms = late_ms;
            scene.safety.max_force_n = Some(MAX_FORCE_N);
            scene.local.basis_folder = bases.map(Path::to_owned);
            Ok(Session::from_scene(scene).crossfade_ms(10.0))
        }
        Setup::UnequalMasses => {
            let body = unequal_masses()?;
            let path = ToolPath::new(
                vec![0.0, 0.15, 0.4],
                vec![[0.0225, 0.0238, 0.051], [0.0225, 0.0238, 0.046], [0.0285, 0.0238, 0.046]],
            )?;
            let session = Session::builder(body).path(path).duration_s(0.4).friction(0.3).model(model);
            Ok(session
                .global(RateGroup::hz(GLOBAL_HZ as u32).latency(Nanos::from_secs_f64(late_ms * 1e-3)))
                .crossfade_ms(10.0))
        }
    }
}

/// A block of 6 x 6 x 6 nodes whose odd nodes have a thousandth of the others' mass.
fn unequal_masses() -> Result<SpringNetwork, Error> {
    let block = Block::builder([6; 3], [0.05; 3]).fix(Face::ZMin).build()?;
    let lattice = block.lattice();
    let mass = |node: u32| -> f64 {
        let odd = lattice.coordinates(node).iter().sum::<usize>() % 2 == 1;
        if odd { 0.5e-6 } else { 0.5e-3 }
    };
    let rest = block.rest().to_vec();
    let nodes = rest.len() as u32;
    let reach = 0.01 * 3.0_f64.sqrt() * 1.01;
    let pairs = (0..nodes).flat_map(|i| (i + 1..nodes).map(move |j| (i, j)));
    let springs = pairs.filter_map(|(i, j)| {
        let rest_length = (block.rest()[i as usize] - block.rest()[j as usize]).norm();
        let lightest = mass(i).min(mass(j));
        let damping = 0.3 * (2.0 * lightest * 30.0).sqrt();
        (rest_length < reach).then_some((i, j, Spring { stiffness: 30.0, damping, rest_length }))
    });
    let network = SpringNetwork::builder(rest)
        .masses((0..nodes).map(mass).collect())
        .springs(springs.collect::<Vec<_>>())
        .surface(block.surface().triangles.clone());
    let held = (0..nodes).filter(|&node| block.inverse_masses()[node as usize] == 0.0);
    Ok(held.fold(network, |network, node| network.fix(node)).build()?)
}

fn traced(session: SessionBuilder) -> Result<Traced, Error> {
    let summary = session.virtual_time().keep_records().build()?.run()?;
    let commanded = || {
        summary.records.iter().filter_map(|record| match record {
            LogRecord::Command(sample) => Some(sample.force_n),
            _ => None,
        })
    };
    let trace = ForceTrace::of(&summary.records);
    let is_finite = trace.forces_n.iter().copied().chain(commanded()).flatten().all(f64::is_finite);
    let norm = |[x, y, z]: [f64; 3]| (x * x + y * y + z * z).sqrt();
    Ok(Traced {
        is_finite,
        commanded_n: commanded().map(norm).fold(0.0, f64::max),
        fault: summary.runtime.fault.as_ref().map(ToString::to_string),
        trace,
    })
}
