//! The figures that show forces: what each plots, and where it looks closer.

use std::error::Error;
use std::ops::Range;
use std::path::Path;

use palpate::model::Vec3;
use palpate::model::local::Kind as LocalModelKind;
use palpate_cli::drawing::{Colour, Curve, Panel, Sheet};

use crate::runs::{ForceRun, ForceRuns};

/// A component of the force on the tool.
#[derive(Clone, Copy)]
pub enum Component {
    /// Along the drag.
    X,
    /// Up.
    Z,
}

impl Component {
    fn of(self, force: &Vec3) -> f64 {
        match self {
            Self::X => force.x,
            Self::Z => force.z,
        }
    }

    fn label(self) -> &'static str {
        match self {
            Self::X => "Fx on the tool (N)",
            Self::Z => "Fz on the tool (N)",
        }
    }
}

/// A figure of the paper that shows forces.
pub struct ForceFigure {
    pub number: u32,
    pub scene: &'static str,
    title: &'static str,
    /// What to see, in a few words.
    note: &'static str,
    /// A panel each.
    components: &'static [Component],
    /// What the panel with the closer look shows, and when (s): a stretch with a few resyncs in the thick of it.
    closer: (Component, Range<f64>),
}

/// In the paper's order.
pub const FORCE_FIGURES: [ForceFigure; 5] = [
    ForceFigure {
        number: 12,
        scene: "pull_release",
        title: "a node is pulled up 2 cm, held, and let back down",
        note: "patch is too stiff while the tool moves: its surroundings stand still",
        components: &[Component::Z],
        closer: (Component::Z, 0.15..0.25),
    },
    ForceFigure {
        number: 12,
        scene: "wave",
        title: "a wave through the body reaches a tool that stands still",
        note: "patch hears of the wave at resyncs only",
        components: &[Component::Z],
        closer: (Component::Z, 0.05..0.15),
    },
    ForceFigure {
        number: 14,
        scene: "drag_slip",
        title: "drag without friction",
        note: "the force follows the normal across triangles",
        components: &[Component::X, Component::Z],
        closer: (Component::Z, 1.10..1.20),
    },
    ForceFigure {
        number: 15,
        scene: "drag_stick",
        title: "drag with unbounded friction",
        note: "the snap at the end is real: it lets go only when pulled",
        components: &[Component::X, Component::Z],
        closer: (Component::X, 1.10..1.20),
    },
    ForceFigure {
        number: 16,
        scene: "drag_friction",
        title: "drag with a friction coefficient of 1",
        note: "sticks at first, then slips and sticks in turns",
        components: &[Component::X, Component::Z],
        closer: (Component::X, 1.10..1.20),
    },
];

impl ForceFigure {
    /// Writes the plot.
    pub fn draw(&self, runs: &ForceRuns, path: &Path) -> Result<(), Box<dyn Error>> {
        let whole = 0.0..runs.times.last().copied().unwrap_or_default() + 1e-9;
        let (closer, zoomed) = (self.closer.0, self.closer.1.clone());
        let component = |component: Component, times: Range<f64>| Panel {
            caption: String::new(),
            x_label: "time (s)",
            y_label: component.label(),
            shown: times,
            curves: drawing_order(runs).map(|run| curve(runs, run, |f, _| component.of(f))).into(),
            ..Panel::default()
        };
        let overview = self.components.iter().map(|&which| {
            let zoomed = std::mem::discriminant(&which) == std::mem::discriminant(&closer);
            let zoomed = zoomed.then(|| self.closer.1.clone());
            vec![Panel { zoomed, ..component(which, whole.clone()) }]
        });
        let detail = Panel {
            caption: "a closer look; vertical lines: resyncs of patch".to_owned(),
            marks: runs.patch.resyncs.clone(),
            ..component(closer, zoomed)
        };
        let error = Panel {
            caption: "off the reference: |F - F of full|".to_owned(),
            x_label: "time (s)",
            y_label: "difference (N)",
            curves: [&runs.hold, &runs.patch].map(|run| curve(runs, run, |f, full| (f - full).norm())).into(),
            ..component(closer, whole.clone())
        };
        let sheet = Sheet {
            title: format!("Fig. {}: {} (scene {})", self.number, self.title, self.scene),
            subtitle: format!("12 x 12 x 12 nodes, virtual time; peak of full {:.3} N; {}", runs.peak, self.note),
            legend: runs.all().map(|run| (legend(runs, run), colour(run.model))).into(),
            rows: overview.chain([vec![detail, error]]).collect(),
        };
        Ok(std::fs::write(path, sheet.to_svg())?)
    }
}

/// Steps at the back, the reference over them, the model that the figure is about on top.
fn drawing_order(runs: &ForceRuns) -> [&ForceRun; 3] {
    [&runs.hold, &runs.full, &runs.patch]
}

fn legend(runs: &ForceRuns, run: &ForceRun) -> String {
    let rms = runs.difference(run).rms;
    match run.model {
        LocalModelKind::Full => "full: the whole body at 1 kHz".to_owned(),
        LocalModelKind::Hold => format!("hold: the last 30 Hz force (rms {rms:.1} %)"),
        LocalModelKind::Patch => format!("patch: the paper's local model (rms {rms:.1} %)"),
        other => format!("{}: rms {rms:.1} %", other.name()),
    }
}

fn colour(model: LocalModelKind) -> Colour {
    match model {
        LocalModelKind::Full => Colour::INK,
        LocalModelKind::Hold => Colour::ORANGE,
        _ => Colour::BLUE,
    }
}

/// `value` of each force of `run` and the reference's force at the same tick.
fn curve(runs: &ForceRuns, run: &ForceRun, value: impl Fn(&Vec3, &Vec3) -> f64) -> Curve {
    let values = run.forces.iter().zip(&runs.full.forces).map(|(force, full)| value(force, full));
    let curve = Curve::new(&runs.times, values, colour(run.model));
    if run.model == LocalModelKind::Full { curve.wide() } else { curve }
}
