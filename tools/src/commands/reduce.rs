//! `palpate reduce`: model reduction of the paper's meshes, of any like them, and the locality check of a scene.

use std::path::PathBuf;

use palpate::scene::{NodeSpec, Scene};
use palpate::{Error, ErrorKind};

use super::progress::{self, StepBar};
use super::{files, shared};
use crate::reduce::ReductionStudy;
use crate::reduce::{
    MeshStudy, PaperStudy, ReduceOptions, locality_verdict, reduce_mesh, reduce_paper, reduce_scene, to_html, to_json,
    to_text,
};

/// The arguments of `palpate reduce`.
#[derive(Debug, clap::Args)]
#[command(group = clap::ArgGroup::new("subject").required(true).args(["scene", "paper", "cells"]))]
pub struct ReduceArgs {
    /// Check for this scene, a file (TOML) or the name of a built-in one (`palpate list`), how much of the force the patch of its local model captures
    pub scene: Option<PathBuf>,
    /// Compute a table or figure of the paper: table1, table2, fig4, fig5, fig8 or all; several by commas
    #[arg(long, value_name = "NAME", value_delimiter = ',', value_parser = studies)]
    pub paper: Vec<Studies>,
    /// Reduce a mesh like the paper's with so many cells along each axis, such as 12,12 or 5,5,5
    #[arg(long, value_name = "N,N[,N]", value_parser = cells)]
    pub cells: Option<Cells>,
    /// A patch of so many nodes along the surface, along it and into depth, in place of the scene's
    #[arg(long, value_name = "N,N,N", value_parser = patch, conflicts_with_all = ["paper", "cells"])]
    pub patch: Option<[usize; 3]>,
    /// Look closely at this surface node, by its place in a block or its number; left out: where the scene's tool touches first
    #[arg(long, value_name = "I,J,K|N", value_parser = node, conflicts_with_all = ["paper", "cells"])]
    pub node: Option<NodeSpec>,
    /// Look at every so many nodes of the surface along each axis; left out: all of a small surface, fewer of a large one
    #[arg(long, value_name = "N", value_parser = count, conflicts_with_all = ["paper", "cells"])]
    pub every: Option<usize>,
    /// Find the patch and the number of states that keep the error below this (%)
    #[arg(long, value_name = "PERCENT", value_parser = positive, allow_negative_numbers = true, conflicts_with_all = ["paper", "cells"])]
    pub error_pct: Option<f64>,
    /// Also measure the error at the contact, in the time domain and with the non-linear models
    #[arg(long, conflicts_with_all = ["paper", "cells"])]
    pub measure: bool,
    /// Exit with 1 if the scene's patch does not capture the force
    #[arg(long, conflicts_with_all = ["paper", "cells"])]
    pub fail_if_not_local: bool,
    /// States of the reduced models; left out: 20
    #[arg(long, value_name = "R", value_parser = count, conflicts_with = "paper")]
    pub order: Option<usize>,
    /// Damping ratio of the mesh; left out: 1
    #[arg(long, value_name = "RATIO", value_parser = positive, allow_negative_numbers = true, conflicts_with_all = ["scene", "paper"])]
    pub zeta: Option<f64>,
    /// Stiffness of every spring of the mesh (N/m); left out: 100
    #[arg(long, value_name = "N_PER_M", value_parser = positive, allow_negative_numbers = true, conflicts_with_all = ["scene", "paper"])]
    pub stiffness: Option<f64>,
    /// Mass of every node of the mesh (kg); left out: 0.001
    #[arg(long, value_name = "KG", value_parser = positive, allow_negative_numbers = true, conflicts_with_all = ["scene", "paper"])]
    pub mass: Option<f64>,
    /// Responses of the mesh at these frequencies, separated by commas; left out: a choice of them
    #[arg(long, value_name = "HZ,HZ", value_delimiter = ',', value_parser = frequency, allow_negative_numbers = true, conflicts_with_all = ["scene", "paper"])]
    pub hz: Vec<f64>,
    /// Print one JSON document instead of the report
    #[arg(long)]
    pub json: bool,
    /// Also write a page with plots, in one file; overwritten if it exists
    #[arg(long, value_name = "FILE")]
    pub html: Option<PathBuf>,
}

/// Studies of the paper that one word names.
#[derive(Clone, Debug)]
pub struct Studies(Vec<PaperStudy>);

/// Cells along each axis.
#[derive(Clone, Debug)]
pub struct Cells(Vec<usize>);

/// Reduces what was named and prints what that says.
///
/// # Errors
/// Input errors of the scene and of the arguments; [`ErrorKind::Io`] if the page cannot be written; [`ErrorKind::Condition`]
/// with `--fail-if-not-local` if the patch does not capture the force, after the report was printed.
pub fn run(args: &ReduceArgs) -> Result<(), Error> {
    let scene = args.scene.as_ref().map(|path| progress::load(path).map(|scene| (path, scene))).transpose()?;
    let inputs = scene.as_ref().map_or(Vec::new(), |(path, scene)| files::inputs_of(path, scene));
    let page = files::begin(args.html.as_deref(), &inputs)?;
    let mut shown = StepBar::default();
    let made = study(args, scene, &mut shown);
    shown.clear();
    let study = made?;
    files::write_page(page, || to_html(&study))?;
    shared::print_report(args.json, || to_json(&study), || to_text(&study))?;
    match &study.locality {
        Some(locality) if args.fail_if_not_local && !locality.is_local => {
            Err(Error::new(ErrorKind::Condition, locality_verdict(locality)).at(&study.subject))
        }
        _ => Ok(()),
    }
}

fn study(args: &ReduceArgs, scene: Option<(&PathBuf, Scene)>, shown: &mut StepBar) -> Result<ReductionStudy, Error> {
    if let Some((path, scene)) = scene {
        let name = shared::name_of(path);
        let study = reduce_scene(&scene, &options(args), |at| shown.show(&at.what, at.done, at.of));
        let mut study = study.map_err(|error| error.at(&name))?;
        study.subject = name;
        return Ok(study);
    }
    if let Some(Cells(cells)) = &args.cells {
        return reduce_mesh(&mesh(args, cells), |at| shown.show(&at.what, at.done, at.of));
    }
    let mut studies: Vec<PaperStudy> = Vec::new();
    for study in args.paper.iter().flat_map(|named| &named.0) {
        if !studies.contains(study) {
            studies.push(*study);
        }
    }
    reduce_paper(&studies, |at| shown.show(&at.what, at.done, at.of))
}

fn options(args: &ReduceArgs) -> ReduceOptions {
    ReduceOptions {
        patch: args.patch,
        node: args.node,
        every: args.every,
        error_pct: args.error_pct,
        order: args.order,
        measure: args.measure,
    }
}

fn mesh(args: &ReduceArgs, cells: &[usize]) -> MeshStudy {
    let default = MeshStudy::default();
    let mut hz = args.hz.clone();
    hz.sort_unstable_by(f64::total_cmp);
    hz.dedup();
    MeshStudy {
        cells: cells.to_vec(),
        damping_ratio: args.zeta.unwrap_or(default.damping_ratio),
        stiffness_n_per_m: args.stiffness.unwrap_or(default.stiffness_n_per_m),
        node_mass_kg: args.mass.unwrap_or(default.node_mass_kg),
        order: args.order.unwrap_or(default.order),
        hz,
    }
}

/// A table or figure by its name.
fn studies(word: &str) -> Result<Studies, String> {
    if word == "all" {
        return Ok(Studies(PaperStudy::ALL.to_vec()));
    }
    let found = PaperStudy::ALL.into_iter().find(|study| study.name() == word);
    let known = PaperStudy::ALL.map(PaperStudy::name).join(", ");
    found.map(|study| Studies(vec![study])).ok_or(format!("the paper's studies are {known} and all"))
}

fn integers(text: &str) -> Option<Vec<usize>> {
    text.split(',').map(|number| number.trim().parse().ok()).collect()
}

fn cells(text: &str) -> Result<Cells, String> {
    match integers(text) {
        Some(cells) if matches!(cells.len(), 2 | 3) && cells.iter().all(|cells| *cells >= 2) => Ok(Cells(cells)),
        _ => Err("two or three numbers of at least 2 are needed, such as 12,12 or 5,5,5".to_owned()),
    }
}

fn three(text: &str) -> Option<[usize; 3]> {
    integers(text)?.try_into().ok()
}

fn patch(text: &str) -> Result<[usize; 3], String> {
    let patch = three(text).filter(|patch| patch.iter().all(|nodes| *nodes > 0));
    patch.ok_or("three numbers of nodes are needed, such as 4,4,2".to_owned())
}

fn node(text: &str) -> Result<NodeSpec, String> {
    let number = || text.trim().parse().ok().map(NodeSpec::Number);
    let message = "the three indices of a node are needed, such as 5,5,11, or its number";
    three(text).map(NodeSpec::Lattice).or_else(number).ok_or(message.to_owned())
}

fn count(text: &str) -> Result<usize, String> {
    text.parse().ok().filter(|count| *count > 0).ok_or("a whole number of at least 1 is needed".to_owned())
}

fn positive(text: &str) -> Result<f64, String> {
    number(text).filter(|value| *value > 0.0).ok_or("a number above 0 is needed".to_owned())
}

fn frequency(text: &str) -> Result<f64, String> {
    number(text).filter(|hz| *hz >= 0.0).ok_or("frequencies in Hz are needed, such as 0,10,100".to_owned())
}

fn number(text: &str) -> Option<f64> {
    // 0 and -0 are one frequency.
    text.trim().parse().ok().filter(|value: &f64| value.is_finite()).map(|value| value + 0.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn values_are_read_or_refused_with_what_is_needed() {
        assert_eq!(cells("12, 12").unwrap().0, [12, 12]);
        assert!(["12", "1,5", "5,5,5,5", "5,x", "", "-5,5"].iter().all(|text| cells(text).is_err()));
        assert_eq!((patch("4,4,2"), node("0,5,11")), (Ok([4, 4, 2]), Ok([0, 5, 11].into())));
        assert!(patch("4,0,2").is_err() && node("1,2").is_err() && node("17") == Ok(17.into()) && count("0").is_err());
        assert!(["nan", "inf", "0", "-1", "x"].iter().all(|text| positive(text).is_err()));
        assert_eq!((frequency("0"), positive("1e-3")), (Ok(0.0), Ok(1e-3)));
        assert_eq!(studies("all").unwrap().0.len(), 5);
        assert_eq!(studies("fig5").unwrap().0, [PaperStudy::Fig5]);
        assert!(studies("fig6").unwrap_err().contains("table1, table2, fig4, fig5, fig8 and all"));
    }
}
