//! The section of the document, and its picture.

use std::fmt::Write;

use palpate_cli::compare::Measured;
use palpate_cli::drawing::{Colour, Picture, Series, Sign};

use super::{Distance, Run, Study};
use crate::common::{colour, figure, table};

pub const PICTURE: &str = "speed_vs_error_organs";
const INTRODUCTION: &str = "\
All that stands between the force that is felt and that of the elastic organ, together: mesh, material and local model. Three organs of
`palpate-mesh` as tetrahedra with nodal pressure, and as lattices of springs of the same spacing; each with one way of a point tool over the
real surface: press, a short drag at the same depth, lift, with friction 0.3, 0.8 s in all. Errors are distances from `full` on the finest
mesh of tetrahedra, in % of its largest force. One basis size (100), window (4 x 4 x 2) and blend (10 ms) for all local models.

- **A point tool has no converged force on a continuum.** Its force falls with the size of the elements below it (the column of largest
  forces), towards nothing. So the error of the mesh is that of this tool on this way, and the finest mesh is a reference and not the
  truth: a still finer one would move all of it. What converges is the force of a tool with a size.
- **A lattice of springs is no elastic tissue, however fine.** Against linear elasticity, stiffness matched, its tangential to normal
  stiffness is 32 % off, the bulge of the surface around a punch 54 % too wide and the surface's field 45 % off: its Zener ratio is 2.33
  and not 1, and Poisson's ratio is not for choosing. That it comes near to the finest force at some spacing is chance: a point's force
  falls with the spacing here too, and crosses. The lattice's cubes have their centre inside the organ, so that its surface is off by up to half a
  spacing; a spring's stiffness is E h / 4.5 (the mean over all directions is then Young's modulus), its damping eta h / 1.8, a node's
  mass rho h^3, and nodes on the attached plane are held.
";
const LEGEND: &str = "\
Discs: tetrahedra, `full`. Squares: lattices, `full`. Diamonds: local models on the middle mesh, filled with results at once, hollow one
period late. The finest has no distance from itself and lies on the lower edge. Right of the line one core is not enough. What has *diverged*
in place of figures gave forces beyond all bounds, and is not in the picture.
";
/// Forces this far away (% of the peak) are no tissue's: the model was unstable.
const DIVERGED_PCT: f64 = 1e3;
pub const HEADING: &str = "## The whole of it: organs from coarse to fine";

fn ms_per_s(run: &Measured) -> f64 {
    1e3 * run.cost.total_load()
}

/// An error as a table has it (%).
fn error(pct: f64) -> String {
    if pct < DIVERGED_PCT { figure(pct) } else { "diverged".to_owned() }
}

pub fn section(studies: &[Study], date: &str) -> String {
    let mut text = format!(
        "{HEADING}\n\n{INTRODUCTION}\n{date}\n\n![Speed against error on three organs](img/{PICTURE}.svg)\n\n{LEGEND}"
    );
    for study in studies {
        let _ = write!(text, "\n### `{}`\n\n{}\n{}\n{}", study.organ.name, about(study), bodies(study), shares(study));
    }
    text
}

fn about(study: &Study) -> String {
    let (organ, finest) = (&study.organ, &study.finest);
    format!(
        "E {} Pa, nu {}, {} Pa s; the tool {} mm deep. The finest: elements of {} mm, {} of them, {} nodes, largest force {} N, {} ms of CPU \
         per simulated second.\n",
        organ.tissue.young_modulus,
        organ.tissue.poisson_ratio,
        organ.tissue.viscosity,
        1e3 * organ.depth_m,
        finest.size_mm,
        finest.parts,
        finest.nodes,
        figure(finest.measured.peak_n()),
        figure(ms_per_s(&finest.measured)),
    )
}

/// Bodies from coarse to fine.
fn bodies(study: &Study) -> String {
    let row = |kind: &str, run: &Run| {
        let Distance { rms, max } = study.whole(&run.measured);
        let sizes = [run.size_mm.to_string(), run.nodes.to_string(), run.parts.to_string()];
        let figures = [run.measured.peak_n(), rms, max, ms_per_s(&run.measured)].map(figure);
        [kind.to_owned()].into_iter().chain(sizes).chain(figures).collect::<Vec<_>>()
    };
    let tetrahedra = study.tetrahedra.iter().chain([&study.finest]).map(|run| row("tetrahedra", run));
    let lattices = study.lattices.iter().map(|run| row("lattice", run));
    let heads = ["body", "size mm", "nodes", "elements, springs", "largest force N", "rms %", "max %", "CPU ms/s"];
    table(&heads, 1, &tetrahedra.chain(lattices).collect::<Vec<_>>())
}

/// What of the error on the middle mesh is whose.
fn shares(study: &Study) -> String {
    let Some(middle) = study.tetrahedra.get(study.middle) else { return String::new() };
    let row = |name: String, own: Distance, whole: &Measured| {
        let whole_error = study.whole(whole).rms;
        vec![name, error(own.rms), error(own.max), error(whole_error), figure(ms_per_s(whole))]
    };
    let full = &middle.measured;
    let mesh =
        row(format!("mesh: {} mm in place of {} mm", middle.size_mm, study.finest.size_mm), study.whole(full), full);
    let steps = study.finer_steps.iter().map(|finer| {
        let own = study.distance(finer, full);
        row("substeps: as chosen in place of twice as many".to_owned(), own, full)
    });
    let locals = study.locals.iter().map(|local| {
        let late = if local.is_late { ", one period late" } else { "" };
        row(format!("local model: `{}`{late}", local.model), study.distance(&local.measured, full), &local.measured)
    });
    let heads = ["part of the error", "its own rms %", "its own max %", "whole rms %", "CPU ms/s"];
    let mut text = format!("What of the force's error is whose, elements of {} mm:\n\n", middle.size_mm);
    text.push_str(&table(&heads, 1, &[mesh].into_iter().chain(steps).chain(locals).collect::<Vec<_>>()));
    for (model, why) in &study.missing {
        let _ = writeln!(text, "\n`{model}` has no figures: {why}.");
    }
    text
}

/// A panel for each organ.
pub fn picture(studies: &[Study]) -> String {
    let panels: Vec<Picture> = studies.iter().map(panel).collect();
    Picture::stacked("Speed against error on three organs, against the finest solution", &panels)
}

fn panel(study: &Study) -> Picture {
    let at = |run: &Measured, label: String| (ms_per_s(run), study.whole(run).rms, label);
    let bodies = |name: &str, colour, sign, runs: &mut dyn Iterator<Item = &Run>| Series {
        name: name.to_owned(),
        colour,
        sign,
        is_joined: false,
        is_hollow: false,
        points: runs.map(|run| at(&run.measured, format!("{name} {} mm", run.size_mm))).collect(),
    };
    let bounded = study.locals.iter().filter(|local| study.whole(&local.measured).rms < DIVERGED_PCT);
    let locals = bounded.map(|local| Series {
        name: local.model.clone(),
        colour: colour(&local.model),
        sign: Sign::Diamond,
        is_joined: false,
        is_hollow: local.is_late,
        // A late one has the colour of the one in time, which is named.
        points: vec![at(&local.measured, if local.is_late { String::new() } else { local.model.clone() })],
    });
    let whole = [
        bodies("full", Colour::INK, Sign::Disc, &mut study.tetrahedra.iter().chain([&study.finest])),
        bodies("lattice", Colour::GREY, Sign::Square, &mut study.lattices.iter()),
    ];
    let middle = study.tetrahedra.get(study.middle).map_or(0.0, |run| run.size_mm);
    Picture {
        title: format!(
            "{}: distance from elements of {} mm; local models on {middle} mm, hollow: one period late",
            study.organ.name, study.finest.size_mm
        ),
        x: "CPU per simulated second, both groups (ms)".to_owned(),
        y: "rms error (% of peak)".to_owned(),
        marks: vec![(1000.0, "one core".to_owned())],
        levels: Vec::new(),
        series: whole.into_iter().chain(locals).collect(),
    }
}
