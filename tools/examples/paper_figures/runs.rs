//! Runs a scene with every local model and keeps its forces.

use std::fmt::Write as _;

use palpate::log::LogRecord;
use palpate::model::local::Kind as LocalModelKind;
use palpate::prelude::*;
use palpate::scene::Scene;
use palpate::session::Summary;

use crate::forces::{Difference, forces, peak};
use crate::repository::in_repository;

/// Runs a scene of this repository in virtual time and keeps every record.
pub fn run(scene: &str, model: LocalModelKind) -> Result<Summary, Error> {
    let path = in_repository(&format!("scenes/{scene}.toml"));
    Session::from_scene(Scene::load(&path)?).model(model).virtual_time().keep_records().build()?.run()
}

/// The times (s) at which a new local model took over.
pub fn resyncs(records: &[LogRecord]) -> Vec<f64> {
    let of = |record: &LogRecord| match record {
        LogRecord::Resync(resync) => Some(resync.time.as_secs_f64()),
        _ => None,
    };
    records.iter().filter_map(of).collect()
}

/// One model's run of a scene.
pub struct ForceRun {
    pub model: LocalModelKind,
    /// On the tool (N), one per haptic tick.
    pub forces: Vec<Vec3>,
    /// Times (s) of the resyncs.
    pub resyncs: Vec<f64>,
}

/// The same scene with every local model.
pub struct ForceRuns {
    /// Ends of the haptic ticks (s).
    pub times: Vec<f64>,
    pub full: ForceRun,
    pub hold: ForceRun,
    pub patch: ForceRun,
    /// Largest force of `full` (N).
    pub peak: f64,
}

impl ForceRuns {
    pub fn of(scene: &str) -> Result<Self, Error> {
        let one = |model| -> Result<(ForceRun, Vec<f64>), Error> {
            let records = run(scene, model)?.records;
            let time = |record: &LogRecord| matches!(record, LogRecord::Force(_)).then(|| record.time().as_secs_f64());
            let times = records.iter().filter_map(time).collect();
            Ok((ForceRun { model, forces: forces(&records), resyncs: resyncs(&records) }, times))
        };
        let (full, times) = one(LocalModelKind::Full)?;
        let (hold, _) = one(LocalModelKind::Hold)?;
        let (patch, _) = one(LocalModelKind::Patch)?;
        Ok(Self { times, peak: peak(&full.forces), full, hold, patch })
    }

    /// In the order of the legend.
    pub fn all(&self) -> [&ForceRun; 3] {
        [&self.full, &self.hold, &self.patch]
    }

    pub fn difference(&self, run: &ForceRun) -> Difference {
        Difference::of(&run.forces, &self.full.forces, self.peak)
    }

    /// One row per haptic tick, all components of all models.
    pub fn to_csv(&self) -> String {
        let mut text = String::from("t_s");
        for run in self.all() {
            let name = run.model.name();
            write!(text, ",{name}_fx_n,{name}_fy_n,{name}_fz_n").expect("a String takes every text");
        }
        for (tick, time) in self.times.iter().enumerate() {
            write!(text, "\n{time}").expect("a String takes every text");
            for run in self.all() {
                let force = run.forces[tick];
                write!(text, ",{},{},{}", force.x, force.y, force.z).expect("a String takes every text");
            }
        }
        text + "\n"
    }
}
