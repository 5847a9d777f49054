//! Mesh files: readers that never panic and reserve no more memory than a file can fill, and one writer.
//!
//! | format | read | groups |
//! | --- | --- | --- |
//! | Gmsh MSH 4.1 and 2.2, ASCII and binary | linear tetrahedra | physical groups by name, of any dimension; without a name `volume 3`, `surface 7`, ... |
//! | VTK legacy, ASCII and binary, and VTU: ascii, binary, appended, compressed by zlib | linear tetrahedra | whole numbers at cells: `region=3` for cells whose `region` is 3 |
//! | STL, ASCII and binary, and OBJ | triangles; nodes at one place become one | |
//!
//! Own readers: `vtkio` does not read what VTK 9 writes (legacy 5.1) and brings parsers of 2017, `mshio` knows no MSH 2.2, `stl_io` takes
//! a binary file whose header begins with `solid` for ASCII and ends at the first solid of several, and `tobj` says no line.

mod base64;
mod collected;
mod gmsh;
mod number;
mod obj;
mod source;
mod stl;
mod vtk;

use std::path::Path;

use palpate_model::mesh::TetrahedralMesh;

pub use gmsh::write_msh;

use crate::{MeshError, SurfaceMesh};

/// A volume mesh as a file holds it, in the file's unit of length.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct VolumeFile {
    /// Nodes, linear tetrahedra and groups, unchecked: see [`TetrahedralMesh::cleaned`].
    pub mesh: TetrahedralMesh,
    /// Elements of other kinds, which are left out: what they are and how many.
    pub left_out_elements: Vec<(String, usize)>,
}

/// The volume mesh in `bytes`, the content of the file `name`: Gmsh MSH 4.1 or 2.2, VTK legacy or VTU, told by its first line.
///
/// # Errors
/// If the content is of no such format or damaged, or has no linear tetrahedra. The message begins with `name`.
pub fn read_volume(name: &str, bytes: &[u8]) -> Result<VolumeFile, MeshError> {
    let start = String::from_utf8_lossy(&bytes[..bytes.len().min(1024)]);
    let read = if start.contains("$MeshFormat") {
        gmsh::read(bytes)
    } else if start.starts_with("# vtk DataFile") {
        vtk::read_legacy(bytes)
    } else if start.contains("<VTKFile") {
        vtk::read_xml(bytes)
    } else if is_surface(name) {
        Err(MeshError::new("is a surface, a volume mesh is needed: fill it by `palpate mesh`"))
    } else {
        Err(MeshError::new("is no volume mesh that can be read: Gmsh MSH (4.1 or 2.2), VTK legacy and VTU can"))
    };
    read.map_err(|error| error.of_file(name))
}

/// [`read_volume`] of a file.
///
/// # Errors
/// Those of [`read_volume`], or if the file cannot be read.
pub fn read_volume_file(path: &Path) -> Result<VolumeFile, MeshError> {
    let (name, bytes) = load(path)?;
    read_volume(&name, &bytes)
}

/// The surface in `bytes`, the content of the file `name`: OBJ if it is called so, else STL. Nodes at one place are one, triangles
/// with two corners at one place are left out. In the file's unit of length, unchecked: see [`SurfaceMesh::cleaned`].
///
/// # Errors
/// If the content is of no such format or damaged, or has no triangles. The message begins with `name`.
pub fn read_surface(name: &str, bytes: &[u8]) -> Result<SurfaceMesh, MeshError> {
    let read = if has_extension(name, "obj") {
        obj::read(bytes)
    } else if is_surface(name) || stl::is_stl(bytes) {
        stl::read(bytes)
    } else {
        Err(MeshError::new("is no surface that can be read: STL and OBJ can"))
    };
    let mesh = read.and_then(|mesh| match mesh.triangles.is_empty() {
        true => Err(MeshError::new("has no triangles: a closed surface is needed")),
        false => Ok(mesh),
    });
    mesh.map_err(|error| error.of_file(name))
}

/// [`read_surface`] of a file.
///
/// # Errors
/// Those of [`read_surface`], or if the file cannot be read.
pub fn read_surface_file(path: &Path) -> Result<SurfaceMesh, MeshError> {
    let (name, bytes) = load(path)?;
    read_surface(&name, &bytes)
}

/// True if a file of this name holds a surface.
fn is_surface(name: &str) -> bool {
    has_extension(name, "stl") || has_extension(name, "obj")
}

fn has_extension(name: &str, wanted: &str) -> bool {
    Path::new(name).extension().is_some_and(|extension| extension.eq_ignore_ascii_case(wanted))
}

fn load(path: &Path) -> Result<(String, Vec<u8>), MeshError> {
    let name = path.display().to_string();
    match std::fs::read(path) {
        Ok(bytes) => Ok((name, bytes)),
        Err(error) => Err(MeshError::new(format!("cannot be read: {error}")).of_file(&name)),
    }
}
