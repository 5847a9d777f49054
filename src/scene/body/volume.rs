//! The mesh of a body of tetrahedra, as it was read from a file, filled from a surface or given by a program.

use std::fmt;
use std::path::Path;
use std::sync::Arc;

use palpate_mesh::{Sizes, SurfaceMesh, fill, read_surface, read_volume, write_msh};

use super::TetrahedraSpec;
use crate::error::{Error, ErrorKind};
use crate::files;
use crate::model::mesh::{LeftOut, TetrahedralMesh};

/// Largest mesh file (bytes): ten million elements as text.
const LARGEST_FILE: u64 = 1 << 30;
/// Largest and smallest body (m): what is beyond has another unit.
const LARGEST_M: f64 = 10.0;
const SMALLEST_M: f64 = 1e-3;

/// A mesh that has been checked, and what was left out of it. Copies share it.
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
}

impl Volume {
    /// The volume of a mesh in metres. Nodes that no element uses are left out, and a mesh that is inverted throughout is turned
    /// round.
    ///
    /// # Errors
    /// If an element is inverted or flat, a face belongs to three of them, or it is smaller than 1 mm or larger than 10 m.
    pub fn new(mesh: TetrahedralMesh) -> Result<Self, Error> {
        Self::checked(mesh, Vec::new(), None)
    }

    fn checked(
        mesh: TetrahedralMesh,
        others: Vec<(String, usize)>,
        filled: Option<SurfaceMesh>,
    ) -> Result<Self, Error> {
        let (mesh, left_out) = mesh.cleaned()?;
        let extent_m = mesh.quality().extent().max();
        if !(SMALLEST_M..=LARGEST_M).contains(&extent_m) {
            let message = format!(
                "makes a body of {extent_m} m, which must be {SMALLEST_M} to {LARGEST_M} m: give the metres per unit of the mesh, \
                 such as 0.001 for millimetres"
            );
            return Err(Error::scene("body.unit_m", message));
        }
        Ok(Self(Arc::new(Checked { mesh, left_out, others, filled })))
    }

    /// Reads the file of `spec` at `path`, and fills it if it is a surface; `progress` is told how much of that is done (0 to 1).
    pub(in crate::scene) fn read(
        spec: &TetrahedraSpec,
        path: &Path,
        progress: &mut dyn FnMut(f64),
    ) -> Result<Self, Error> {
        let bytes = files::read(path, LARGEST_FILE)?;
        let name = path.display().to_string();
        if spec.surface.is_none() {
            let file = read_volume(&name, &bytes)?;
            return Self::checked(file.mesh.scaled(spec.unit_m), file.left_out_elements, None)
                .map_err(|error| of_file(error, &name));
        }
        let mut surface = read_surface(&name, &bytes)?;
        surface.points.iter_mut().for_each(|point| *point *= spec.unit_m);
        Self::filling(surface, spec, progress).map_err(|error| of_file(error, &name))
    }

    /// Fills `surface` (m) with elements of the sizes of `spec`.
    fn filling(surface: SurfaceMesh, spec: &TetrahedraSpec, progress: &mut dyn FnMut(f64)) -> Result<Self, Error> {
        let sizes = Sizes { element_m: spec.element_size_m.unwrap_or_default(), surface_m: spec.surface_size_m };
        let mesh = fill(&surface, sizes, progress)?;
        Self::checked(mesh, Vec::new(), Some(surface))
    }

    /// The surface that this fills, filled with elements of the sizes of `spec`; `None` if it fills none.
    pub(in crate::scene) fn refilled(&self, spec: &TetrahedraSpec) -> Option<Result<Self, Error>> {
        self.0.filled.clone().map(|surface| Self::filling(surface, spec, &mut |_| ()))
    }

    /// The volume in a log's attachment, which [`to_msh`](Self::to_msh) wrote; `name` stands for it in errors.
    pub(crate) fn from_msh(bytes: &[u8], name: &str) -> Result<Self, Error> {
        let file = read_volume(name, bytes)?;
        Self::checked(file.mesh, Vec::new(), None).map_err(|error| of_file(error, name))
    }

    /// The mesh as a file of Gmsh's, every number to its last bit.
    pub(crate) fn to_msh(&self) -> Result<Arc<[u8]>, Error> {
        let mut bytes = Vec::new();
        let written = write_msh(self.mesh(), &mut bytes);
        written.map_err(|error| Error::new(ErrorKind::Io, format!("the mesh cannot be written: {error}")))?;
        Ok(bytes.into())
    }

    /// The mesh (m), its nodes and elements in the order of the file.
    pub fn mesh(&self) -> &TetrahedralMesh {
        &self.0.mesh
    }

    /// What was left out or changed of the mesh, in words; empty if it is as it was given.
    pub fn changes(&self) -> String {
        let LeftOut { nodes, turned } = self.0.left_out;
        let others = self.0.others.iter().map(|(kind, count)| format!("{count} {kind}"));
        let unused = (nodes > 0).then(|| format!("{nodes} nodes of no tetrahedron"));
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

/// What is wrong with a mesh is so in its file; a wrong unit is the scene's.
fn of_file(error: Error, name: &str) -> Error {
    if error.place().starts_with("body.") { error } else { error.at(name) }
}

impl fmt::Debug for Volume {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Volume")
            .field("nodes", &self.mesh().points.len())
            .field("elements", &self.mesh().tetrahedra.len())
            .finish_non_exhaustive()
    }
}
