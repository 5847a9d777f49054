//! `palpate mesh`: fills a closed surface with tetrahedra, or reports on a volume mesh.

use std::io::{BufWriter, Write};
use std::path::{Path, PathBuf};

use palpate::model::mesh::TetrahedralMesh;
use palpate::{Error, ErrorKind};
use palpate_mesh::{MeshError, Sizes, fill, read_surface_file, read_volume_file, write_msh};

use super::files::{OutputFile, begin_file};
use super::progress::{StepBar, preparing};
use super::shared;
use crate::mesh::{MeshReport, SurfaceReport};

/// The arguments of `palpate mesh`.
#[derive(Debug, clap::Args)]
#[command(group = clap::ArgGroup::new("task").required(true).args(["size_mm", "check"]))]
pub struct MeshArgs {
    /// A closed surface to fill (STL, OBJ), or a volume mesh to check (Gmsh MSH, VTK legacy, VTU)
    pub file: PathBuf,
    /// Fill the surface with elements of this size
    #[arg(long, value_name = "MM", value_parser = positive, allow_negative_numbers = true, requires = "out")]
    pub size_mm: Option<f64>,
    /// Let elements at the surface be of this size, smaller than those inside
    #[arg(long, value_name = "MM", value_parser = positive, allow_negative_numbers = true, conflicts_with = "check")]
    pub surface_size_mm: Option<f64>,
    /// Metres per unit of the file: 0.001 for millimetres
    #[arg(long, value_name = "M", value_parser = positive, allow_negative_numbers = true, default_value = "1")]
    pub unit_m: f64,
    /// Write the filled mesh to this file (Gmsh MSH 4.1, in metres); overwritten if it exists
    #[arg(long, value_name = "FILE", conflicts_with = "check")]
    pub out: Option<PathBuf>,
    /// Report on the volume mesh as it is
    #[arg(long)]
    pub check: bool,
    /// Print one JSON document instead of the report
    #[arg(long)]
    pub json: bool,
}

/// Fills or checks what was named, and reports on it.
///
/// # Errors
/// [`ErrorKind::Scene`] if the mesh or surface cannot be read or used; [`ErrorKind::Io`] if the output cannot be written.
pub fn run(args: &MeshArgs) -> Result<(), Error> {
    let mut report = match (args.size_mm, &args.out) {
        (Some(size_mm), Some(out)) => filled(args, size_mm, out)?,
        _ => checked(args)?,
    };
    report.file = shared::name_of(&args.file);
    shared::print_report(args.json, || report.to_json(), || report.to_text())
}

fn checked(args: &MeshArgs) -> Result<MeshReport, Error> {
    let file = read_volume_file(&args.file).map_err(refusal)?;
    let (mesh, left_out) = file.mesh.scaled(args.unit_m).cleaned().map_err(|error| at(&args.file, error.into()))?;
    let mut report = report(&args.file, mesh);
    report.left_out_elements = file.left_out_elements;
    report.left_out_nodes = left_out.nodes;
    report.turned = left_out.turned;
    Ok(report)
}

fn filled(args: &MeshArgs, size_mm: f64, out: &Path) -> Result<MeshReport, Error> {
    let output = begin_file(out, &[&args.file])?;
    let surface = read_surface_file(&args.file).map_err(refusal)?.scaled(args.unit_m);
    let (surface, findings) = surface.cleaned().map_err(|error| at(&args.file, error))?;
    let sizes = Sizes { element_m: size_mm * 1e-3, surface_m: args.surface_size_mm.map(|size| size * 1e-3) };
    let mut shown = StepBar::default();
    let made = fill(&surface, sizes, &mut |done| shown.show("filling", (100.0 * done) as usize, 100));
    shown.clear();
    let mesh = made.map_err(|error| at(&args.file, error))?;
    let (mesh, left_out) = mesh.cleaned().map_err(|error| at(&args.file, error.into()))?;
    write(&mesh, output, out)?;
    let mut report = report(&args.file, mesh);
    report.left_out_nodes = left_out.nodes;
    report.out = Some(shared::name_of(out));
    report.surface = Some(SurfaceReport { volume_m3: surface.volume(), triangles: surface.triangles.len(), findings });
    Ok(report)
}

/// The report on a mesh; its step takes a while.
fn report(file: &Path, mesh: TetrahedralMesh) -> MeshReport {
    let bar = preparing(&shared::name_of(file));
    let report = MeshReport::of(mesh);
    bar.finish_and_clear();
    report
}

fn write(mesh: &TetrahedralMesh, output: OutputFile, out: &Path) -> Result<(), Error> {
    let mut buffered = BufWriter::new(&output);
    let written = write_msh(mesh, &mut buffered).and_then(|()| buffered.flush());
    drop(buffered);
    written.map_err(|error| Error::io(out, error))?;
    output.finish()
}

/// An error that names its file already.
fn refusal(error: MeshError) -> Error {
    Error::new(ErrorKind::Scene, error.to_string())
}

fn at(file: &Path, error: MeshError) -> Error {
    Error::new(ErrorKind::Scene, error.to_string()).at(shared::name_of(file))
}

fn positive(text: &str) -> Result<f64, String> {
    let value = text.trim().parse().ok().filter(|value: &f64| value.is_finite() && *value > 0.0);
    value.ok_or("a number above 0 is needed".to_owned())
}
