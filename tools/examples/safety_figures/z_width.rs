//! The sweep over `scenes/z_width.toml`: up to which stiffness a wall of a given damping is held without a limit cycle.
//!
//! The body is a wall of stiffness K and damping B at the contact. Both are those of its springs times one number, which its
//! shape alone determines, since every damper is parallel to a spring: K = c k, B = c b.

use palpate::log::LogRecord;
use palpate::model::equilibrium::static_equilibrium;
use palpate::model::local::Kind as LocalModelKind;
use palpate::prelude::*;
use palpate::scene::{BodySpec, Scene};

use crate::repository::in_repository;

/// The last part of a run, over which the tool has to rest (s).
const WATCHED_S: f64 = 0.5;
/// A tool that moves by more than this from peak to peak is in a limit cycle (m): by more than five steps of the scene's
/// encoder, and half a step for rounding.
pub const LIMIT_CYCLE_M: f64 = 55e-6;
/// The walls that are looked at (N/m).
pub const STIFFNESS: [f64; 2] = [10.0, 10_000.0];
/// Bisections of that range by ratio: what is left is a factor of 1.11, and the border is told as its middle.
const BISECTIONS: u32 = 6;
/// How far the node under the tool is moved to find c (m).
const PROBE_M: f64 = 1e-5;

/// A wall as the tool feels it.
#[derive(Clone, Copy, Debug)]
pub struct Wall {
    /// K (N/m).
    pub stiffness: f64,
    /// B (N s/m).
    pub damping: f64,
}

/// The scene, and what its shape makes of a spring.
pub struct Sweep {
    scene: Scene,
    /// c: stiffness at the contact over that of a spring.
    shape: f64,
}

impl Sweep {
    /// Of the scene in this repository.
    pub fn new() -> Result<Self, Error> {
        let scene = Scene::load(&in_repository("scenes/z_width.toml"))?;
        let spring = 30.0;
        let mut block = Block::builder([6; 3], [0.1; 3]).stiffness(spring).fix(Face::ZMin).build()?;
        let node = block.lattice().id([3, 3, 5]);
        let at = block.rest()[node as usize] - Vec3::z() * PROBE_M;
        let state = static_equilibrium(&mut block, &[(node, at)])?;
        let mut forces = vec![Vec3::zeros(); state.positions.len()];
        block.forces(&state, &mut forces);
        Ok(Self { scene, shape: forces[node as usize].norm() / PROBE_M / spring })
    }

    /// The device's own damping (N s/m).
    pub fn device_damping(&self) -> f64 {
        self.scene.devices[0].plant.damping_n_s_per_m
    }

    /// How far the tool moves from peak to peak in the last part of a run on `wall` (m); infinite if the run fails.
    pub fn swing(&self, model: LocalModelKind, rate_hz: f64, wall: Wall) -> Result<f64, Error> {
        let mut scene = self.scene.clone().with_model(model);
        scene.local.rate_hz = rate_hz;
        if let Some(body) = scene.body.as_mut().and_then(BodySpec::mass_spring_mut) {
            let (k, b) = (wall.stiffness / self.shape, wall.damping / self.shape);
            body.material.stiffness_n_per_m = k;
            body.material.damping_ratio = b / (2.0 * body.material.node_mass_kg * k).sqrt();
        }
        // Not the ramp in which the force goes at the end.
        let watched = scene.run.duration_s - WATCHED_S..scene.run.duration_s;
        let summary = Session::from_scene(scene).virtual_time().keep_records().build()?.run()?;
        if summary.runtime.fault.is_some() {
            return Ok(f64::INFINITY);
        }
        let place = |record: &LogRecord| match record {
            LogRecord::Tool(tool) if watched.contains(&tool.time.as_secs_f64()) => Some(tool.position_m[2]),
            _ => None,
        };
        let places: Vec<f64> = summary.records.iter().filter_map(place).collect();
        let (low, high) = places.iter().fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), &z| (l.min(z), h.max(z)));
        Ok(high - low)
    }

    /// The largest stiffness (N/m) that a wall of `damping` (N s/m) can have without a limit cycle, by bisection: an end of
    /// [`STIFFNESS`] where nothing inside holds, or everything.
    pub fn border(&self, model: LocalModelKind, rate_hz: f64, damping: f64) -> Result<f64, Error> {
        let [mut low, mut high] = STIFFNESS;
        for _ in 0..BISECTIONS {
            let stiffness = (low * high).sqrt();
            let rests = self.swing(model, rate_hz, Wall { stiffness, damping })? <= LIMIT_CYCLE_M;
            *(if rests { &mut low } else { &mut high }) = stiffness;
        }
        Ok(match [low, high] {
            [low, _] if low == STIFFNESS[0] => low,
            [_, high] if high == STIFFNESS[1] => high,
            [low, high] => (low * high).sqrt(),
        })
    }
}

/// The stiffness (N/m) up to which a sampled wall is passive: b > K (T / 2 + t_d) + |B|, b the damping of the device (N s/m) and
/// t_d a delay in ticks.
pub fn theory(device_damping: f64, rate_hz: f64, damping: f64, delay_ticks: f64) -> f64 {
    (rate_hz * (device_damping - damping.abs()) / (0.5 + delay_ticks)).max(0.0)
}
