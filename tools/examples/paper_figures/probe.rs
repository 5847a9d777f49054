//! Fig. 13: the node under a tool that never touches, in the whole body at 1 kHz, in the local model and in the 30 Hz
//! global model.

use std::error::Error as AnyError;
use std::fmt::Write as _;
use std::path::Path;

use palpate::log::{LogRecord, ProbeSample};
use palpate::model::local::Kind as LocalModelKind;
use palpate::prelude::*;
use palpate_cli::drawing::{Colour, Curve, Panel, Sheet};

use crate::delay::Delay;
use crate::forces::{Difference, peak};
use crate::runs::{resyncs, run};
use crate::table::{Row, Table};

const SCENE: &str = "wave_probe";
/// Where the plot looks closer (s): the wave's first trough with a few resyncs in it.
const CLOSER: std::ops::Range<f64> = 0.15..0.30;

/// Positions (m) of the probed node, one per haptic tick.
pub struct Probe {
    times: Vec<f64>,
    /// `full`: the whole body at 1 kHz.
    full: Vec<Vec3>,
    /// `patch`: in the local model, and in the newest 30 Hz global model that the tick could see.
    local: Vec<Vec3>,
    global: Vec<Vec3>,
    /// In the 30 Hz global model of `hold`, which takes nothing from a local model: exact, but a sample held.
    held: Vec<Vec3>,
    resyncs: Vec<f64>,
}

/// How far each runs behind `full`.
pub struct Delays {
    pub local: Delay,
    pub global: Delay,
    pub held: Delay,
    /// The global model's node behind the local model's.
    pub global_behind_local: Delay,
}

impl Probe {
    /// Runs the scene with every model.
    pub fn run() -> Result<Self, Error> {
        let records = |model| run(SCENE, model).map(|summary| summary.records);
        let full = records(LocalModelKind::Full)?;
        let patch = records(LocalModelKind::Patch)?;
        let hold = records(LocalModelKind::Hold)?;
        let position = |records: &[LogRecord], of: fn(&ProbeSample) -> [f64; 3]| {
            samples(records).map(|sample| Vec3::from(of(sample))).collect::<Vec<_>>()
        };
        Ok(Self {
            times: samples(&full).map(|sample| sample.time.as_secs_f64()).collect(),
            full: position(&full, |sample| sample.local_m),
            local: position(&patch, |sample| sample.local_m),
            global: position(&patch, |sample| sample.global_m),
            held: position(&hold, |sample| sample.global_m),
            resyncs: resyncs(&patch),
        })
    }

    /// By cross-correlation of the heights.
    pub fn delays(&self) -> Delays {
        let heights = |positions: &[Vec3]| positions.iter().map(|x| x.z).collect::<Vec<_>>();
        let (full, local, global) = (heights(&self.full), heights(&self.local), heights(&self.global));
        Delays {
            local: Delay::of(&local, &full),
            global: Delay::of(&global, &full),
            held: Delay::of(&heights(&self.held), &full),
            global_behind_local: Delay::of(&global, &local),
        }
    }

    /// One row per haptic tick.
    pub fn to_csv(&self) -> String {
        let names = ["full", "patch_local", "patch_global", "hold_global"];
        let mut text = String::from("t_s");
        for name in names {
            write!(text, ",{name}_x_m,{name}_y_m,{name}_z_m").expect("a String takes every text");
        }
        for (tick, time) in self.times.iter().enumerate() {
            write!(text, "\n{time}").expect("a String takes every text");
            for position in [&self.full, &self.local, &self.global, &self.held].map(|positions| positions[tick]) {
                write!(text, ",{},{},{}", position.x, position.y, position.z).expect("a String takes every text");
            }
        }
        text + "\n"
    }

    /// Writes the plot: heights against the height at which they end up at rest, in mm.
    pub fn draw(&self, path: &Path, delays: &Delays) -> Result<(), Box<dyn AnyError>> {
        let height = |positions: &[Vec3], colour| {
            Curve::new(&self.times, positions.iter().map(|x| 1e3 * (x.z - REST_HEIGHT_M)), colour)
        };
        let curves = || {
            vec![
                height(&self.global, Colour::ORANGE),
                height(&self.local, Colour::BLUE),
                height(&self.full, Colour::INK).wide(),
            ]
        };
        let whole = 0.0..self.times.last().copied().unwrap_or_default() + 1e-9;
        let panel = |times, caption: &str| Panel {
            caption: caption.to_owned(),
            x_label: "time (s)",
            y_label: "height above rest (mm)",
            shown: times,
            curves: curves(),
            ..Panel::default()
        };
        let undone = |ticks: f64| {
            let shifted: Vec<f64> = self.times.iter().map(|time| time - 1e-3 * ticks).collect();
            let moved = self.local.iter().map(|x| 1e3 * (x.z - REST_HEIGHT_M));
            Panel {
                curves: vec![Curve::new(&shifted, moved, Colour::GREEN), height(&self.full, Colour::INK).wide()],
                ..panel(whole.clone(), &format!("the local model's node {ticks:.1} ms earlier (green)"))
            }
        };
        let closer =
            Panel { marks: self.resyncs.clone(), ..panel(CLOSER, "a closer look; vertical lines: resyncs of patch") };
        let sheet = Sheet {
            title: format!(
                "Fig. 13: the local scheme runs {:.1} ms behind the global one (scene {SCENE})",
                delays.local.ticks
            ),
            subtitle: "Node [8, 5, 11] under a tool that never touches, while a wave passes; virtual time. \
                       Delay: peak of the cross-correlation with full."
                .to_owned(),
            legend: vec![
                ("full: the whole body at 1 kHz".to_owned(), Colour::INK),
                (format!("patch: local model ({:.1} ms late)", delays.local.ticks), Colour::BLUE),
                (format!("patch: its 30 Hz global model ({:.1} ms late)", delays.global.ticks), Colour::ORANGE),
            ],
            rows: vec![
                vec![Panel { zoomed: Some(CLOSER), ..panel(whole.clone(), "") }],
                vec![closer, undone(delays.local.ticks)],
            ],
        };
        Ok(std::fs::write(path, sheet.to_svg())?)
    }

    /// Adds a row per signal, in % of the largest distance that the node of `full` has from its place at rest.
    pub fn add_to(&self, table: &mut Table, delays: &Delays) {
        let rest = Vec3::new(8.0 * REST_HEIGHT_M / 11.0, 5.0 * REST_HEIGHT_M / 11.0, REST_HEIGHT_M);
        let moved = |positions: &[Vec3]| positions.iter().map(|x| x - rest).collect::<Vec<_>>();
        let full = moved(&self.full);
        let peak = peak(&full);
        let signals = [
            ("full", &self.full, None, 0),
            ("patch, local", &self.local, Some(delays.local), self.resyncs.len()),
            ("patch, global", &self.global, Some(delays.global), self.resyncs.len()),
            ("hold, global", &self.held, Some(delays.held), self.resyncs.len()),
        ];
        for (model, positions, delay, resyncs) in signals {
            table.push(Row {
                figure: 13,
                scene: SCENE,
                model,
                peak: 1e3 * peak,
                unit: "mm",
                difference: Difference::of(&moved(positions), &full, peak),
                resyncs,
                delay_ms: delay.map(|delay| delay.ticks),
            });
        }
    }
}

/// The height of the block's top at rest.
const REST_HEIGHT_M: f64 = 0.1;

impl Delays {
    /// The delays and how they were found.
    pub fn to_markdown(&self) -> String {
        let line = |name: &str, delay: Delay| {
            format!("- {name}: {:.1} ms (correlation {:.3})\n", delay.ticks, delay.correlation)
        };
        format!(
            "Fig. 13, delay of the node's height behind `full` (the whole body at 1 kHz):\n\n{}{}{}\n\
             The global model runs {:.1} ms behind its own local one.\n\n\
             How: correlation coefficient of full(t) with signal(t + lag) over all ticks that both have, the mean over \
             these removed, for whole lags of -100 to 150 ms; the delay is the vertex of the parabola through the largest \
             coefficient and its neighbours. The last line is the check of the method: the global model of `hold` is the \
             same body, sampled every 33.3 ms and held, which must come out as half a period, 16.7 ms.\n",
            line("local model of `patch`", self.local),
            line("30 Hz global model of `patch`", self.global),
            line("30 Hz global model of `hold`", self.held),
            self.global_behind_local.ticks,
        )
    }
}

fn samples(records: &[LogRecord]) -> impl Iterator<Item = &ProbeSample> {
    records.iter().filter_map(|record| match record {
        LogRecord::Probe(sample) => Some(sample),
        _ => None,
    })
}
