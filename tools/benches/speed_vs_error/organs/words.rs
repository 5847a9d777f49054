//! The section of the document, and its picture.

use std::fmt::Write;

use palpate_cli::compare::Measured;
use palpate_cli::drawing::{Colour, Picture, Series, Sign};

use super::{Distance, Local, Run, Study};
use crate::common::{colour, figure, joined, table};

pub const PICTURE: &str = "speed_vs_error_organs";
const INTRODUCTION: &str = "\
How far is the force that is felt from that of the elastic organ, and is it the mesh, the material or the local model? Three organs of
`palpate-mesh` are tetrahedra with nodal pressure, and lattices of springs of the same spacing. A point tool presses, drags a short way at
the same depth and lifts, with friction 0.3, 0.8 s in all. Errors are distances from `full` on the finest mesh of tetrahedra, in % of its
largest force. All local models have one basis size (100), window (4 x 4 x 2) and blend (10 ms).

- **A point tool has no converged force on a continuum.** Its force falls towards nothing with the size of the elements below it. So the
  finest mesh is a reference and not the truth: a finer one would move all errors of the mesh. What converges is the force of a tool with a
  size.
- **A lattice of springs is no elastic tissue, however fine.** [tissue.md](tissue.md) says how far it is away. Where it comes near the finest
  force, that is chance: its point force falls with the spacing too, and crosses. Its surface is off by up to half a spacing. A spring's
  stiffness is E h / 4.5, its damping eta h / 1.8, a node's mass rho h^3, and nodes on the attached plane are held.
";
const LEGEND: &str = "\
Discs are tetrahedra and squares lattices, both with `full`. Diamonds are local models on the middle mesh, hollow with results one period
late. The finest mesh has no distance from itself and lies on the lower edge. Right of the line one core is not enough. A model that
*diverged* gave forces beyond all bounds, and is not in the picture. Two figures in a cell are those with results at once and one period late.
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
    let figures = |own: Distance, whole: &Measured| {
        vec![error(own.rms), error(own.max), error(study.whole(whole).rms), figure(ms_per_s(whole))]
    };
    let row = |name: String, figures: Vec<String>| [name].into_iter().chain(figures).collect::<Vec<_>>();
    let full = &middle.measured;
    let mesh = format!("mesh: {} mm in place of {} mm", middle.size_mm, study.finest.size_mm);
    let mesh = row(mesh, figures(study.whole(full), full));
    let steps = study.finer_steps.iter().map(|finer| {
        let own = study.distance(finer, full);
        row("substeps: as chosen in place of twice as many".to_owned(), figures(own, full))
    });
    // The runs of one model follow each other.
    let locals = study.locals.chunk_by(|one, next| one.model == next.model).map(|runs| {
        let own = |run: &Local| figures(study.distance(&run.measured, full), &run.measured);
        let figures: Vec<Vec<String>> = runs.iter().map(own).collect();
        row(format!("`{}`", runs[0].model), joined(&figures))
    });
    let heads = ["part of the error", "its own rms %", "its own max %", "whole rms %", "CPU ms/s"];
    let mut text = format!("Parts of the error with elements of {} mm:\n\n", middle.size_mm);
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
