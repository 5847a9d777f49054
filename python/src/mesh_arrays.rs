//! Meshes that are given as arrays, in place of a file.

use numpy::PyReadonlyArray2;
use palpate::model::mesh::{Group, TetrahedralMesh};
use pyo3::prelude::*;
use pyo3::types::PyDict;

use crate::arrays::points;
use crate::errors::usage;
use crate::scene::is_path;

/// What meshio and pyvista call tetrahedra in `cells_dict`.
const TETRAHEDRA: [&str; 2] = ["tetra", "10"];

/// The mesh that `mesh` is, or holds, with the named nodes of `groups`; `None` if it is the name of a file.
///
/// # Errors
/// `UsageError` if it is neither, or an index is none of a node.
pub(crate) fn given(mesh: &Bound<'_, PyAny>, groups: Option<&Bound<'_, PyDict>>) -> PyResult<Option<TetrahedralMesh>> {
    let py = mesh.py();
    if is_path(mesh)? {
        return match groups {
            None => Ok(None),
            Some(_) => {
                Err(usage(py, "groups", "is for meshes that are given as arrays, a file has its own: leave it out"))
            }
        };
    }
    let (nodes, elements) = parts(mesh)?;
    let nodes = points(&nodes, "mesh")?;
    let elements = ids(&elements, "mesh", 4, nodes.len())?;
    let group = |(name, of): (Bound<'_, PyAny>, Bound<'_, PyAny>)| {
        let name: String = name.extract()?;
        let of = py.import("numpy")?.call_method1("reshape", (of, (-1, 1)))?;
        let mut members: Vec<u32> = ids(&of, &format!("groups[{name:?}]"), 1, nodes.len())?;
        members.sort_unstable();
        members.dedup();
        PyResult::Ok(Group { name, nodes: members, tetrahedra: Vec::new() })
    };
    let groups = groups.map_or(Ok(Vec::new()), |groups| groups.iter().map(group).collect())?;
    let tetrahedra = elements.chunks_exact(4).map(|corners| [corners[0], corners[1], corners[2], corners[3]]).collect();
    Ok(Some(TetrahedralMesh { points: nodes, tetrahedra, groups }))
}

/// Points and elements: of a tuple, or of an object of meshio's or pyvista's.
fn parts<'py>(mesh: &Bound<'py, PyAny>) -> PyResult<(Bound<'py, PyAny>, Bound<'py, PyAny>)> {
    let needed = "must be a file, a tuple (points, tetrahedra), or a mesh of meshio or pyvista that has tetrahedra";
    if let Ok(parts) = mesh.extract::<(Bound<'py, PyAny>, Bound<'py, PyAny>)>() {
        return Ok(parts);
    }
    if mesh.hasattr("points")? && mesh.hasattr("cells_dict")? {
        for (kind, elements) in mesh.getattr("cells_dict")?.cast_into::<PyDict>()? {
            if TETRAHEDRA.contains(&kind.str()?.to_cow()?.as_ref()) {
                return Ok((mesh.getattr("points")?, elements));
            }
        }
    }
    Err(usage(mesh.py(), "mesh", needed))
}

/// Rows of `width` numbers of nodes, one behind the other.
fn ids(given: &Bound<'_, PyAny>, argument: &str, width: usize, nodes: usize) -> PyResult<Vec<u32>> {
    let py = given.py();
    let wrong = || usage(py, argument, &format!("must have whole numbers of nodes below {nodes}, {width} in a row"));
    let array = py.import("numpy")?.call_method1("asarray", (given,))?;
    // Not floats that happen to be whole.
    if !matches!(array.getattr("dtype")?.getattr("kind")?.extract()?, 'i' | 'u') {
        return Err(wrong());
    }
    let array: PyReadonlyArray2<'_, i64> =
        array.call_method1("astype", ("int64",))?.extract().map_err(|_: PyErr| wrong())?;
    let array = array.as_array();
    let is_node = |id: &i64| usize::try_from(*id).is_ok_and(|id| id < nodes);
    if array.ncols() != width || !array.iter().all(is_node) {
        return Err(wrong());
    }
    Ok(array.iter().map(|&id| id as u32).collect())
}
