//! Speed against error: what `palpate compare` does, for the reference scenes, for patch and basis sizes, substeps and
//! haptic rates, and on organs against the finest solution. Writes docs/speed_vs_error.md and its pictures.
//!
//! `cargo bench --bench speed_vs_error`; with `-- --organs` the section of the organs alone, in place of the one that is there; with
//! `-- --quick` a short form that prints and writes nothing.

#[path = "../common/mod.rs"]
mod common;
mod organs;
mod rates;
mod scenes;
mod sizes;

use std::process::ExitCode;

use palpate::Error;

/// A part of the document: its text, and its pictures by name.
struct Part {
    text: String,
    pictures: Vec<(String, String)>,
}

const DOCUMENT: &str = "docs/speed_vs_error.md";
const HEAD: &str = "\
# Speed against error

How far every local model is from `full`, and what it costs. [compare.md](compare.md) defines each figure: errors in % of the
largest force of `full` on that scene, CPU time of one release of the haptic group (*tick*), of building one local model, and of
the global group and both groups per second of simulated time (1000 ms/s is one core). Virtual time, so no result depends on the
machine but the costs. The group that reduces surroundings for `predictive` is in none of these figures: it works once per
place of the patch, and its results are there at once in these runs; [scale.md](scale.md) has what one of them costs.
";

fn document(is_quick: bool) -> Result<(), Error> {
    let date = common::measured_on("cargo bench --bench speed_vs_error");
    let mut text = format!("{HEAD}\n{date}\n");
    // Long: what is there is written after every part.
    for part in [organs::part, scenes::part, sizes::part, rates::part] {
        let part = part(is_quick)?;
        text.push('\n');
        text.push_str(&part.text);
        if is_quick {
            continue;
        }
        for (name, svg) in &part.pictures {
            common::write(&format!("docs/img/{name}.svg"), svg)?;
        }
        common::write(DOCUMENT, &text)?;
    }
    if is_quick {
        print!("{text}");
    }
    Ok(())
}

fn organs_alone(is_quick: bool) -> Result<(), Error> {
    let part = organs::part(is_quick)?;
    if is_quick {
        print!("{}", part.text);
        return Ok(());
    }
    for (name, svg) in &part.pictures {
        common::write(&format!("docs/img/{name}.svg"), svg)?;
    }
    let path = common::in_repository(DOCUMENT);
    let text = std::fs::read_to_string(&path).map_err(|error| Error::io(&path, error))?;
    common::write(DOCUMENT, &organs::replaced(&text, &part.text))
}

fn main() -> ExitCode {
    let Some(arguments) = common::arguments() else { return ExitCode::SUCCESS };
    let only_organs = std::env::args().any(|argument| argument == "--organs");
    match if only_organs { organs_alone(arguments.is_quick) } else { document(arguments.is_quick) } {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("{error}");
            ExitCode::FAILURE
        }
    }
}
