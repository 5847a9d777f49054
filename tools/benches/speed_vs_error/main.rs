//! Speed against error: what `palpate compare` does, for the reference scenes, for patch and basis sizes, substeps and
//! haptic rates, and on organs against the finest solution. Writes all tables to target/speed_vs_error.md, of
//! which docs/speed_vs_error.md has what a reader needs, and draws its pictures.
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

const DOCUMENT: &str = "target/speed_vs_error.md";
const HEAD: &str = "\
# Speed against error

Which local model is near enough to the truth, and what does it cost? For a scene of your own, ask the command:

```text
cargo run --release -- compare scenes/drag_friction.toml --html compare.html
```

This page has the answers for three organs, for the reference scenes of the paper, for sizes of the patch and the basis, and for haptic rates.
[compare.md](compare.md#the-columns) defines each figure. Errors are in % of the largest force of `full`, the whole body at the haptic rate, on
that scene. Costs are CPU time: of one release of the haptic group (*tick*), of *building* one local model, and of *both* groups per second of
simulated time, where 1000 ms/s is one core. All runs are in virtual time, so only the costs depend on the machine.
The group that reduces surroundings for `predictive` works once per place of the patch and is in none of these figures:
[scale.md](scale.md) has its cost.
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
    let text = std::fs::read_to_string(&path).unwrap_or_default();
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
