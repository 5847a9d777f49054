//! Speed against error: what `palpate compare` does, for the reference scenes, for patch and basis sizes, substeps and
//! haptic rates. Writes docs/speed_vs_error.md and its pictures.
//!
//! `cargo bench --bench speed_vs_error`; with `-- --quick` a short form that prints and writes nothing.

#[path = "../common/mod.rs"]
mod common;
mod rates;
mod scenes;
mod sizes;

use std::process::ExitCode;

use palpate::error::Error;

/// A part of the document: its text, and its pictures by name.
struct Part {
    text: String,
    pictures: Vec<(String, String)>,
}

const HEAD: &str = "\
# Speed against error

How far every local model is from `full`, and what it costs. [compare.md](compare.md) defines each figure: errors in % of the
largest force of `full` on that scene, CPU time of one release of the haptic group (*tick*), of building one local model, and of
the global group and both groups per second of simulated time (1000 ms/s is one core). Virtual time, so no result depends on the
machine but the costs. The group that reduces surroundings for `predictive` is in none of these figures: it works once per
place of the patch, and its results are there at once in these runs; [scale.md](scale.md) has what one of them costs.
";

fn document(is_quick: bool) -> Result<(), Error> {
    let parts = [scenes::part(is_quick)?, sizes::part(is_quick)?, rates::part(is_quick)?];
    let texts: Vec<&str> = parts.iter().map(|part| part.text.as_str()).collect();
    let text = format!("{HEAD}\n{}\n\n{}", common::measured_on("cargo bench --bench speed_vs_error"), texts.join("\n"));
    if is_quick {
        print!("{text}");
        return Ok(());
    }
    for (name, svg) in parts.iter().flat_map(|part| &part.pictures) {
        common::write(&format!("docs/img/{name}.svg"), svg)?;
    }
    common::write("docs/speed_vs_error.md", &text)
}

fn main() -> ExitCode {
    let Some(arguments) = common::arguments() else { return ExitCode::SUCCESS };
    match document(arguments.is_quick) {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("{error}");
            ExitCode::FAILURE
        }
    }
}
