//! The bodies that palpate brings: a block of springs, and tetrahedra of a mesh.

use std::path::PathBuf;

use palpate::Error;
use palpate::model::body::Body;
use palpate::model::mesh::TetrahedralMesh;
use palpate::scene::{BodySpec, Scene, Volume};
use pyo3::prelude::*;
use pyo3::types::PyDict;
use toml::{Table, Value};

use crate::arrays::{frozen, frozen_points};
use crate::errors::{OrRaise, usage};
use crate::mesh_arrays;
use crate::scene::partial;
use crate::toml_value::{table, value};

/// A body as a scene describes it, with its nodes and its surface at rest.
pub(crate) struct Described {
    pub(crate) spec: BodySpec,
    /// The same as the table of a scene.
    pub(crate) table: Table,
    built: Box<dyn Body>,
}

impl Described {
    /// Reads what `body` says, and makes sure that a body can be made of it.
    fn new(py: Python<'_>, body: &Bound<'_, PyDict>) -> PyResult<Self> {
        let table = table(body, "body")?;
        let scene = Table::from_iter([("body".to_owned(), Value::Table(table.clone()))]);
        let built = py.detach(|| {
            let spec = partial(&scene, None)?.body.expect("it was given");
            let built = spec.build()?;
            Ok(Self { spec, table, built })
        });
        built.or_raise(py)
    }

    /// Takes `mesh` for the body of tetrahedra that `body` says all else of.
    fn of_mesh(py: Python<'_>, body: &Bound<'_, PyDict>, mesh: TetrahedralMesh) -> PyResult<Self> {
        let table = table(body, "body")?;
        let scene = Table::from_iter([("body".to_owned(), Value::Table(table.clone()))]);
        let read = || scene.try_into::<Scene>().map_err(|error| Error::scene("body", error.message()));
        let built = py.detach(|| {
            let mut scene = read()?;
            if let Some(spec) = scene.body.as_mut().and_then(BodySpec::tetrahedra_mut) {
                spec.volume = Some(Volume::new(mesh)?);
            }
            scene.validate()?;
            let spec = scene.body.expect("it was given");
            let built = spec.build()?;
            Ok(Self { spec, table, built })
        });
        built.or_raise(py)
    }

    fn nodes<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        frozen_points(py, self.built.rest())
    }

    fn triangles<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        frozen(py, self.built.surface().triangles.concat(), 3)
    }

    fn held<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        let held: Vec<bool> = self.built.inverse_masses().iter().map(|&inverse| inverse == 0.0).collect();
        frozen(py, held, 1)?.call_method0("ravel")
    }
}

/// What is given under its key, and left out where it is `None`.
fn put<'py, T: IntoPyObject<'py>>(table: &Bound<'py, PyDict>, key: &str, given: Option<T>) -> PyResult<()> {
    given.map_or(Ok(()), |given| table.set_item(key, given))
}

/// A block of point masses, each joined by springs to its 26 neighbours.
///
/// nodes: (nx, ny, nz), at least 2 along each axis; node id = i + nx (j + ny k). size_m: edge lengths (m). fixed: faces that are held, of
/// "x_min" .. "z_max". regions: dictionaries as [[body.region]] of a scene file has them, later ones win.
///
/// Raises SceneError with the field of a scene file and what would be right.
#[pyclass(frozen, module = "palpate")]
pub(crate) struct Block {
    pub(crate) described: Described,
}

#[pymethods]
impl Block {
    #[new]
    #[pyo3(signature = (nodes, size_m, *, stiffness_n_per_m = 30.0, damping_ratio = 0.3, node_mass_kg = 0.5e-3, fixed = None, regions = None))]
    #[expect(clippy::too_many_arguments, reason = "they have names where they are given")]
    fn new(
        py: Python<'_>,
        nodes: &Bound<'_, PyAny>,
        size_m: &Bound<'_, PyAny>,
        stiffness_n_per_m: f64,
        damping_ratio: f64,
        node_mass_kg: f64,
        fixed: Option<&Bound<'_, PyAny>>,
        regions: Option<&Bound<'_, PyAny>>,
    ) -> PyResult<Self> {
        let (block, material, body) = (PyDict::new(py), PyDict::new(py), PyDict::new(py));
        block.set_item("nodes", nodes)?;
        block.set_item("size_m", size_m)?;
        put(&block, "fixed", fixed)?;
        material.set_item("node_mass_kg", node_mass_kg)?;
        material.set_item("stiffness_n_per_m", stiffness_n_per_m)?;
        material.set_item("damping_ratio", damping_ratio)?;
        body.set_item("kind", "mass_spring")?;
        body.set_item("block", block)?;
        body.set_item("material", material)?;
        put(&body, "region", regions)?;
        Ok(Self { described: Described::new(py, &body)? })
    }

    /// Rest positions of all nodes (m), shape (n, 3).
    #[getter]
    fn nodes<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        self.described.nodes(py)
    }

    /// Nodes of each surface triangle, counter-clockwise seen from outside, shape (m, 3).
    #[getter]
    fn triangles<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        self.described.triangles(py)
    }

    /// Whether each node is held stationary, shape (n,).
    #[getter]
    fn held<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        self.described.held(py)
    }

    fn __repr__(&self) -> String {
        format!("<palpate.Block of {} nodes>", self.described.spec.node_count())
    }
}

/// Linear tetrahedra with tissue's own parameters.
///
/// mesh: a volume mesh (.msh, .vtk, .vtu), or a closed surface (.stl, .obj), which is filled with elements of element_size_m and, at the
/// surface, surface_size_m; or arrays: a tuple of points (n, 3) (m) and tetrahedra (k, 4), or a mesh of meshio or pyvista, with groups, numbers
/// of nodes by a name for what they are. young_modulus_pa: E (Pa). poisson_ratio: from 0 to below 0.5. density_kg_m3 (kg/m^3). viscosity_pa_s: shear
/// viscosity (Pa s). fixed: what is held, names of groups of the mesh or shapes such as {"sphere": {"centre_m": [0, 0, 0], "radius_m":
/// 0.01}}. regions: dictionaries as [[body.region]] of a scene file has them. unit_m: metres per unit of length of the file.
///
/// Raises SceneError with the field of a scene file and what would be right, FileError if the mesh cannot be read.
#[pyclass(frozen, module = "palpate")]
pub(crate) struct Tetrahedra {
    pub(crate) described: Described,
}

#[pymethods]
impl Tetrahedra {
    #[new]
    #[pyo3(signature = (mesh, *, young_modulus_pa, poisson_ratio, density_kg_m3 = 1060.0, viscosity_pa_s = 0.0, nodal_pressure = true,
                        fixed = None, regions = None, groups = None, element_size_m = None, surface_size_m = None, unit_m = None))]
    #[expect(clippy::too_many_arguments, reason = "they have names where they are given")]
    fn new(
        py: Python<'_>,
        mesh: &Bound<'_, PyAny>,
        young_modulus_pa: f64,
        poisson_ratio: f64,
        density_kg_m3: f64,
        viscosity_pa_s: f64,
        nodal_pressure: bool,
        fixed: Option<&Bound<'_, PyAny>>,
        regions: Option<&Bound<'_, PyAny>>,
        groups: Option<&Bound<'_, PyDict>>,
        element_size_m: Option<f64>,
        surface_size_m: Option<f64>,
        unit_m: Option<f64>,
    ) -> PyResult<Self> {
        let (tissue, body) = (PyDict::new(py), PyDict::new(py));
        tissue.set_item("young_modulus_pa", young_modulus_pa)?;
        tissue.set_item("poisson_ratio", poisson_ratio)?;
        tissue.set_item("density_kg_m3", density_kg_m3)?;
        tissue.set_item("viscosity_pa_s", viscosity_pa_s)?;
        tissue.set_item("nodal_pressure", nodal_pressure)?;
        let arrays = mesh_arrays::given(mesh, groups)?;
        body.set_item("kind", "tetrahedra")?;
        if arrays.is_none() {
            let file: PathBuf = mesh.extract()?;
            let ending = file.extension().map(|ending| ending.to_ascii_lowercase());
            let is_surface = ending.is_some_and(|ending| ending == "stl" || ending == "obj");
            body.set_item(if is_surface { "surface" } else { "mesh" }, file)?;
        } else if element_size_m.is_some() || surface_size_m.is_some() || unit_m.is_some() {
            return Err(usage(
                py,
                "element_size_m, surface_size_m, unit_m",
                "are for files: leave them out, arrays are in metres",
            ));
        }
        put(&body, "element_size_m", element_size_m)?;
        put(&body, "surface_size_m", surface_size_m)?;
        put(&body, "unit_m", unit_m)?;
        put(&body, "fixed", fixed)?;
        body.set_item("tissue", tissue)?;
        put(&body, "region", regions)?;
        let described = match arrays {
            None => Described::new(py, &body)?,
            Some(mesh) => Described::of_mesh(py, &body, mesh)?,
        };
        Ok(Self { described })
    }

    /// Rest positions of all nodes (m), shape (n, 3).
    #[getter]
    fn nodes<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        self.described.nodes(py)
    }

    /// Nodes of each surface triangle, counter-clockwise seen from outside, shape (m, 3).
    #[getter]
    fn triangles<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        self.described.triangles(py)
    }

    /// Nodes of each element, shape (k, 4).
    #[getter]
    fn tetrahedra<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        let volume = self.described.spec.tetrahedra().and_then(|spec| spec.volume.as_ref());
        frozen(py, volume.map_or(Vec::new(), |volume| volume.mesh().tetrahedra.concat()), 4)
    }

    /// The nodes of each named group of the mesh, by its name, each of shape (nodes,).
    #[getter]
    fn groups<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        let groups = PyDict::new(py);
        let volume = self.described.spec.tetrahedra().and_then(|spec| spec.volume.as_ref());
        for group in volume.iter().flat_map(|volume| &volume.mesh().groups) {
            groups.set_item(&group.name, frozen(py, group.nodes.clone(), 1)?.call_method0("ravel")?)?;
        }
        Ok(groups)
    }

    /// Whether each node is held stationary, shape (n,).
    #[getter]
    fn held<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        self.described.held(py)
    }

    fn __repr__(&self) -> String {
        format!("<palpate.Tetrahedra of {} nodes>", self.described.spec.node_count())
    }
}

/// The value of a keyword for a scene's table, `None` if it was not given.
pub(crate) fn keyword(given: Option<&Bound<'_, PyAny>>, at: &str) -> PyResult<Option<Value>> {
    given.filter(|given| !given.is_none()).map(|given| value(given, at)).transpose()
}
