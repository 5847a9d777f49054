//! Remakes the plots of the paper's Figs. 12 to 16: each as SVG next to its numbers as CSV, and one table of all.
//!
//! Every scene runs in virtual time with `full` (the whole body at 1 kHz, the reference), `hold` (the last force of a
//! 30 Hz global model) and `patch` (the paper's local model, 4 x 4 x 2 nodes, linear, no blending); results are the same
//! every time. The bodies are ours and not the paper's, so curves are to be compared in shape, not in numbers.
//!
//! Look for: `hold` stepping at 30 Hz, `patch` following the tool between resyncs and jumping back at them, and in Fig. 13
//! the delay of the local scheme against the global one.
//!
//! `cargo run --release --example paper_figures [-- [--readme] [FOLDER]]`; FOLDER is `out/paper_figures` if not given.
//! `--readme` also renews the two plots in `docs/img/`.

#[path = "../../../examples/common/forces.rs"]
mod forces;
#[path = "../../tests/support/repository.rs"]
mod repository;

mod delay;
mod figures;
mod probe;
mod runs;
mod table;

use std::error::Error;
use std::fs;
use std::path::{Path, PathBuf};

use figures::{FORCE_FIGURES, ForceFigure};
use runs::ForceRuns;
use table::Table;

/// The plots that docs/local_models.md shows.
const IN_DOCS: [&str; 2] = ["fig13_wave_probe.svg", "fig16_drag_friction.svg"];

fn main() -> Result<(), Box<dyn Error>> {
    let (mut readme, mut folder) = (false, PathBuf::from("out/paper_figures"));
    for argument in std::env::args_os().skip(1) {
        match argument.to_str() {
            Some("--readme") => readme = true,
            Some(option) if option.starts_with('-') => {
                return Err(format!("{option} is no option; usage: paper_figures [--readme] [FOLDER]").into());
            }
            _ => folder = argument.into(),
        }
    }
    fs::create_dir_all(&folder).map_err(|error| format!("{}: {error}", folder.display()))?;

    let mut table = Table::default();
    for figure in &FORCE_FIGURES {
        eprintln!("Fig. {}: {}", figure.number, figure.scene);
        draw_force(figure, &folder, &mut table)?;
    }
    eprintln!("Fig. 13: wave_probe");
    let probe = probe::Probe::run()?;
    let delays = probe.delays();
    fs::write(folder.join("fig13_wave_probe.csv"), probe.to_csv())?;
    probe.draw(&folder.join("fig13_wave_probe.svg"), &delays)?;
    probe.add_to(&mut table, &delays);

    table.sort();
    fs::write(folder.join("summary.csv"), table.to_csv())?;
    let page = format!("{}\n{}", table.to_markdown(), delays.to_markdown());
    fs::write(folder.join("summary.md"), &page)?;
    print!("{page}");
    if readme {
        let images = repository::in_repository("docs/img");
        fs::create_dir_all(&images)?;
        for name in IN_DOCS {
            fs::copy(folder.join(name), images.join(name))?;
        }
        println!("\nRenewed in docs/img: {}.", IN_DOCS.join(", "));
    }
    println!("\nPlots (SVG), numbers (CSV) and this page (summary.md): {}", folder.display());
    Ok(())
}

fn draw_force(figure: &ForceFigure, folder: &Path, table: &mut Table) -> Result<(), Box<dyn Error>> {
    let runs = ForceRuns::of(figure.scene)?;
    let name = format!("fig{}_{}", figure.number, figure.scene);
    fs::write(folder.join(format!("{name}.csv")), runs.to_csv())?;
    figure.draw(&runs, &folder.join(format!("{name}.svg")))?;
    table.add_forces(figure, &runs);
    Ok(())
}
