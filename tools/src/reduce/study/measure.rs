//! The error of a patch, measured: the non-linear body and the local model `patch`, both moved at the contact, in the time domain.

use std::f64::consts::PI;

use palpate::devices::ToolPath;
use palpate::log::LogRecord;
use palpate::model::body::Body;
use palpate::model::local::BlendKind;
use palpate::model::local::Feedback;
use palpate::model::local::Kind as LocalModelKind;
use palpate::scene::{BlendSpec, Scene};
use palpate::session::Session;
use palpate::{Error, ErrorKind};

use crate::reduce::findings::MeasuredLocality;
use crate::reduction::{ContactStiffness, Response, StiffnessError};

/// Haptic rate (Hz): four samples of the fastest oscillation.
const RATE_HZ: f64 = 4000.0;
/// Oscillations that the tool makes at once (Hz), with whole periods in a tenth of a second.
const TONES_HZ: [f64; 12] = [10.0, 20.0, 30.0, 50.0, 80.0, 120.0, 170.0, 260.0, 390.0, 560.0, 780.0, 1000.0];
/// How far each moves the tool, at 10 Hz; less above (m).
const AMPLITUDE_M: f64 = 2e-5;
/// How far the tool is moved for the error at rest (m).
const PUSH_M: f64 = 1e-4;
/// How long it settles first, and what is measured (s).
const SETTLE_S: f64 = 0.6;
const MEASURED_S: f64 = 0.2;
/// No resync in the whole run (Hz).
const NO_RESYNC_HZ: f64 = 0.25;

/// Moves a tool that is glued to `node` along each axis and compares the forces of `patch`, built once at rest, with those of `full`; `models`
/// are the linear predictions of `full` and of `patch`.
pub(super) fn measure(
    scene: &Scene,
    body: &dyn Body,
    node: u32,
    patch: [usize; 3],
    models: (&ContactStiffness, &ContactStiffness),
) -> Result<MeasuredLocality, Error> {
    let (mut band, mut rest) = (Mean::default(), Mean::default());
    for axis in 0..3 {
        for (tones, mean) in [(true, &mut band), (false, &mut rest)] {
            let run = |kind| forces(scene, body, (node, axis), (kind, patch), tones);
            let (full, of_patch) = (run(LocalModelKind::Full)?, run(LocalModelKind::Patch)?);
            if tones {
                for hz in TONES_HZ {
                    mean.add(&spectrum(&full, hz), &spectrum(&of_patch, hz), hz);
                }
            } else {
                mean.add(&average(&full), &average(&of_patch), 0.0);
            }
        }
    }
    let hz = [vec![0.0], TONES_HZ.to_vec()].concat();
    let predicted = StiffnessError::between(models.1 as &dyn Response, models.0, &hz);
    Ok(MeasuredLocality {
        predicted_pct: 100.0 * predicted.band,
        measured_pct: 100.0 * band.error(),
        predicted_at_rest_pct: 100.0 * predicted.at_rest,
        measured_at_rest_pct: 100.0 * rest.error(),
    })
}

/// Squares of differences and of references, by frequency, summed over the axes: what the norm of a 3 x 3 stiffness is made of.
#[derive(Default)]
struct Mean {
    sums: Vec<(f64, f64, f64)>,
}

impl Mean {
    fn add(&mut self, full: &[f64; 6], patch: &[f64; 6], hz: f64) {
        let difference: f64 = full.iter().zip(patch).map(|(a, b)| (a - b) * (a - b)).sum();
        let size: f64 = full.iter().map(|a| a * a).sum();
        match self.sums.iter_mut().find(|(of, ..)| *of == hz) {
            Some(sums) => (sums.1, sums.2) = (sums.1 + difference, sums.2 + size),
            None => self.sums.push((hz, difference, size)),
        }
    }

    fn error(&self) -> f64 {
        let shares = self.sums.iter().map(|(_, difference, size)| difference / size);
        (shares.sum::<f64>() / self.sums.len().max(1) as f64).sqrt()
    }
}

/// The forces on the tool in the measured part of a run, one per tick.
fn forces(
    scene: &Scene,
    body: &dyn Body,
    (node, axis): (u32, usize),
    (kind, patch): (LocalModelKind, [usize; 3]),
    tones: bool,
) -> Result<Vec<[f64; 3]>, Error> {
    let start = body.rest()[node as usize];
    let ticks = ((SETTLE_S + MEASURED_S) * RATE_HZ) as usize;
    let place = |tick: usize| {
        let t = tick as f64 / RATE_HZ;
        let mut x: [f64; 3] = start.into();
        x[axis] += if tones {
            let tone =
                |(n, hz): (usize, &f64)| AMPLITUDE_M * 10.0 / hz * (2.0 * PI * (hz * t + 0.37 * (n * n) as f64)).sin();
            let ramp = (t / 0.05).min(1.0);
            ramp * TONES_HZ.iter().enumerate().map(tone).sum::<f64>()
        } else {
            let u = (t / 0.1).min(1.0);
            -PUSH_M * u * u * u * (10.0 - 15.0 * u + 6.0 * u * u)
        };
        x
    };
    let times: Vec<f64> = (0..=ticks).map(|tick| tick as f64 / RATE_HZ).collect();
    let path = ToolPath::new(times, (0..=ticks).map(place).collect())?;
    let mut moved = scene.clone().with_model(kind);
    moved.devices.truncate(1);
    let Some(device) = moved.devices.first_mut() else { return Err(Error::scene("device", "is missing")) };
    *device = palpate::scene::DeviceSpec { path: Some(path), ..palpate::scene::DeviceSpec::default() };
    device.attach_node = Some(node.into());
    moved.local.rate_hz = RATE_HZ;
    moved.local.patch = Some(patch);
    moved.local.blend = BlendSpec { kind: BlendKind::None, ms: 0.0 };
    moved.local.coupling = false;
    if kind == LocalModelKind::Patch {
        moved.local.feedback = Some(Feedback::Trajectory);
    }
    moved.global.rate_hz = NO_RESYNC_HZ;
    moved.global.compute_latency_ms = 0.0;
    (moved.initial, moved.probes) = (None, Vec::new());
    moved.run.duration_s = SETTLE_S + MEASURED_S;
    let summary = Session::from_scene(moved).virtual_time().keep_records().build()?.run()?;
    if let Some(fault) = summary.runtime.fault {
        return Err(Error::new(ErrorKind::Fault, format!("the run of `{}`: {fault}", kind.name())));
    }
    let forces = summary.records.iter().filter_map(|record| match record {
        LogRecord::Force(sample) => Some(sample.force_n),
        _ => None,
    });
    let forces: Vec<[f64; 3]> = forces.collect();
    let measured = (MEASURED_S * RATE_HZ) as usize;
    Ok(forces[forces.len().saturating_sub(measured)..].to_vec())
}

/// Real and imaginary parts of the three forces at a frequency.
fn spectrum(forces: &[[f64; 3]], hz: f64) -> [f64; 6] {
    let mut out = [0.0; 6];
    for (tick, force) in forces.iter().enumerate() {
        let (sin, cos) = (2.0 * PI * hz * tick as f64 / RATE_HZ).sin_cos();
        for axis in 0..3 {
            out[2 * axis] += force[axis] * cos;
            out[2 * axis + 1] += force[axis] * sin;
        }
    }
    out
}

fn average(forces: &[[f64; 3]]) -> [f64; 6] {
    let mut out = [0.0; 6];
    for force in forces {
        (0..3).for_each(|axis| out[2 * axis] += force[axis]);
    }
    out
}
