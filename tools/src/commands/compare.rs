//! `palpate compare SCENE`: what each local model computes and costs, against `full`.

use std::path::PathBuf;

use palpate::model::local::Kind as LocalModelKind;
use palpate::{Error, ErrorKind};

use super::{files, progress, run, shared};
use crate::compare::{CompareOptions, CompareProgress, Comparison, to_html, to_json, to_text};

/// The arguments of `palpate compare`.
#[derive(Debug, clap::Args)]
pub struct CompareArgs {
    /// A scene file (TOML), or the name of a built-in scene (`palpate list`)
    pub scene: PathBuf,
    /// Compare only these models with `full`, by name and separated by commas
    #[arg(long, value_name = "A,B", value_delimiter = ',', value_parser = run::model)]
    pub models: Vec<LocalModelKind>,
    /// Leave out the runs of `full` with smaller steps and on a finer mesh
    #[arg(long)]
    pub models_only: bool,
    /// Run for this many seconds instead of the scene's own duration
    #[arg(long, value_name = "S", allow_negative_numbers = true)]
    pub duration: Option<f64>,
    /// Print one JSON document instead of the table
    #[arg(long)]
    pub json: bool,
    /// Also write a page with plots, in one file; overwritten if it exists
    #[arg(long, value_name = "FILE")]
    pub html: Option<PathBuf>,
}

/// Runs a scene with every model in virtual time and prints errors and costs.
///
/// # Errors
/// Input errors of the scene; [`ErrorKind::Io`] if the page cannot be written; [`ErrorKind::Fault`] if a run ended in a
/// fault, after the others were printed.
pub fn run(args: &CompareArgs) -> Result<(), Error> {
    let scene = progress::load(&args.scene)?;
    let inputs = files::inputs_of(&args.scene, &scene);
    let page = files::begin(args.html.as_deref(), &inputs)?;
    let name = shared::name_of(&args.scene);
    let options = CompareOptions {
        models: args.models.clone(),
        duration_s: args.duration,
        finer: !args.models_only,
        ..CompareOptions::default()
    };
    let mut shown = Shown::default();
    let compared = Comparison::measure(&scene, &options, |at| shown.show(at));
    shown.clear();
    let mut comparison = compared.map_err(|error| error.at(&name))?;
    comparison.scene = name;
    files::write_page(page, || to_html(&comparison))?;
    shared::print_report(args.json, || to_json(&comparison), || to_text(&comparison))?;
    match comparison.faults().next() {
        Some((model, fault)) => Err(Error::new(ErrorKind::Fault, format!("the run of `{model}`: {fault}"))),
        None => Ok(()),
    }
}

/// What is on the terminal while it works.
#[derive(Default)]
struct Shown {
    run: Option<usize>,
    preparing: Option<indicatif::ProgressBar>,
    running: Option<progress::RunBar>,
}

impl Shown {
    fn show(&mut self, at: CompareProgress) {
        let late = at.latency.0 as f64 / 1e6;
        let what = || format!("{}/{} {}, {late} ms late", at.run + 1, at.runs, at.model);
        if self.run != Some(at.run) {
            self.clear();
            self.run = Some(at.run);
            self.preparing = Some(progress::preparing(&what()));
        }
        if let Some(until) = at.until {
            if let Some(preparing) = self.preparing.take() {
                preparing.finish_and_clear();
            }
            self.running.get_or_insert_with(|| progress::RunBar::new(&what(), until)).show(at.elapsed);
        }
    }

    fn clear(&mut self) {
        if let Some(preparing) = self.preparing.take() {
            preparing.finish_and_clear();
        }
        if let Some(running) = self.running.take() {
            running.clear();
        }
    }
}
