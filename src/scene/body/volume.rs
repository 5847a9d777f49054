//! The mesh of a body of tetrahedra, as it was read from a file, filled from a surface or given by a program.

use std::fmt;
use std::path::Path;
use std::sync::Arc;

use palpate_mesh::{Sizes, SurfaceMesh, VolumeFile, fill, read_surface, read_volume, write_msh};

use crate::error::{Error, ErrorKind};
use crate::files;
use crate::model::body::TetrahedraBuilder;
use crate::model::mesh::{LeftOut, TetrahedralMesh};

/// Largest mesh file (bytes): a log holds it in one record of 64 MiB.
const LARGEST_FILE: u64 = 63 << 20;

/// A mesh that has been checked, what was left out of it, and the file that it can be made from again. Copies share it.
#[derive(Clone, PartialEq)]
pub struct Volume(Arc<Checked>);

#[derive(PartialEq)]
struct Checked {
    mesh: TetrahedralMesh,
    left_out: LeftOut,
    /// Elements of other kinds beside the tetrahedra, by their names.
    others: Vec<(String, usize)>,
    /// The surface that was filled (m), if one was.
    filled: Option<SurfaceMesh>,
    /// The file as it was read, or as it would have been written.
    file: Vec<u8>,
    /// Metres per unit of that file.
    unit_m: f64,
}

impl Volume {
    /// The volume of a mesh in metres. Nodes that no element uses are left out, and a mesh that is inverted throughout is turned
    /// round. Elements are put in the order in which a file has them: group by group.
    ///
    /// # Errors
    /// If an element is inverted or flat, or a face belongs to three of them.
    pub fn new(mesh: TetrahedralMesh) -> Result<Self, Error> {
        // Before it is written: what is wrong is told in the program's own numbering.
        let (mesh, left_out) = mesh.cleaned()?;
        let file = written(&mesh)?;
        let VolumeFile { mesh, .. } = read_volume("the mesh", &file)?;
        Ok(Self(Arc::new(Checked { mesh, left_out, others: Vec::new(), filled: None, file, unit_m: 1.0 })))
    }

    /// Reads the file at `path`, of which a unit is `unit_m` metres; with sizes it is a surface and is filled, and `progress` is
    /// told how much of that is done (0 to 1).
    pub(in crate::scene) fn read(
        path: &Path,
        unit_m: f64,
        filled_with: Option<Sizes>,
        progress: &mut dyn FnMut(f64),
    ) -> Result<Self, Error> {
        let bytes = files::read(path, LARGEST_FILE)?;
        let name = path.display().to_string();
        let Some(sizes) = filled_with else { return Self::of_file(bytes, &name, unit_m) };
        let mut surface = read_surface(&name, &bytes)?;
        surface.points.iter_mut().for_each(|point| *point *= unit_m);
        check_unit(&surface)?;
        let (surface, _) = surface.cleaned().map_err(|error| Error::from(error).at(&name))?;
        Self::filling(surface, sizes, progress).map_err(|error| error.at(&name))
    }

    /// Fills `surface` (m) with elements of `sizes`.
    fn filling(surface: SurfaceMesh, sizes: Sizes, progress: &mut dyn FnMut(f64)) -> Result<Self, Error> {
        let mesh = fill(&surface, sizes, progress)?;
        let file = written(&mesh)?;
        let (mesh, left_out) = mesh.cleaned()?;
        let (others, filled) = (Vec::new(), Some(surface));
        Ok(Self(Arc::new(Checked { mesh, left_out, others, filled, file, unit_m: 1.0 })))
    }

    /// The surface that this fills, filled with elements of `sizes`; `None` if it fills none.
    pub(in crate::scene) fn refilled(&self, sizes: Sizes) -> Option<Result<Self, Error>> {
        self.0.filled.clone().map(|surface| Self::filling(surface, sizes, &mut |_| ()))
    }

    /// The volume in the bytes of a file of which a unit is `unit_m` metres; `name` stands for it in errors.
    pub(crate) fn of_file(file: Vec<u8>, name: &str, unit_m: f64) -> Result<Self, Error> {
        let VolumeFile { mesh, left_out_elements: others } = read_volume(name, &file)?;
        let cleaned = mesh.scaled(unit_m).cleaned();
        let (mesh, left_out) = cleaned.map_err(|error| Error::from(error).at(name))?;
        Ok(Self(Arc::new(Checked { mesh, left_out, others, filled: None, file, unit_m })))
    }

    /// The file that it can be made from again: bit for bit the same, with this [unit](Self::unit_m).
    pub fn file(&self) -> &[u8] {
        &self.0.file
    }

    /// Metres per unit of the [file](Self::file).
    pub fn unit_m(&self) -> f64 {
        self.0.unit_m
    }

    /// The mesh (m), its nodes and elements in the order of the file.
    pub fn mesh(&self) -> &TetrahedralMesh {
        &self.0.mesh
    }

    /// What was left out or changed of the mesh, in words; empty if it is as it was given.
    pub fn changes(&self) -> String {
        let LeftOut { nodes, turned } = self.0.left_out;
        let others = self.0.others.iter().map(|(kind, count)| format!("{count} {kind}"));
        let unused =
            (nodes > 0).then(|| format!("{nodes} {} of no tetrahedron", if nodes == 1 { "node" } else { "nodes" }));
        let left_out: Vec<String> = others.chain(unused).collect();
        let left_out = (!left_out.is_empty()).then(|| format!("left out: {}", left_out.join(", ")));
        let turned = turned.then(|| "turned round, it was inverted throughout".to_owned());
        left_out.into_iter().chain(turned).collect::<Vec<_>>().join("; ")
    }

    /// True if it was made by filling a surface.
    pub fn is_filled(&self) -> bool {
        self.0.filled.is_some()
    }
}

/// The mesh as a file of Gmsh's, every number to its last bit.
fn written(mesh: &TetrahedralMesh) -> Result<Vec<u8>, Error> {
    let mut bytes = Vec::new();
    let written = write_msh(mesh, &mut bytes);
    written.map_err(|error| Error::new(ErrorKind::Io, format!("the mesh cannot be written: {error}")))?;
    Ok(bytes)
}

/// A surface in a wrong unit is refused before it is filled with nothing or with more elements than there is memory for.
fn check_unit(surface: &SurfaceMesh) -> Result<(), Error> {
    let along = |axis: usize| {
        let places = || surface.points.iter().map(|point| point[axis]);
        places().fold(f64::NEG_INFINITY, f64::max) - places().fold(f64::INFINITY, f64::min)
    };
    let extent_m = (0..3).map(along).fold(0.0, f64::max);
    let [least, most] = TetrahedraBuilder::EXTENT_M;
    if (least..=most).contains(&extent_m) {
        return Ok(());
    }
    let message = format!(
        "the surface is {extent_m:.3e} m large, {least} to {most} m are possible: give the metres per unit of its file, \
         0.001 for millimetres"
    );
    Err(Error::scene("body.unit_m", message))
}

impl fmt::Debug for Volume {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Volume")
            .field("nodes", &self.mesh().points.len())
            .field("elements", &self.mesh().tetrahedra.len())
            .finish_non_exhaustive()
    }
}
