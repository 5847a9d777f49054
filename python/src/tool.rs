//! The shapes of tools.

use pyo3::prelude::*;
use pyo3::types::PyDict;

/// A tool that is a point: one contact, with a single triangle.
#[pyclass(frozen, eq, module = "palpate")]
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Point;

#[pymethods]
impl Point {
    #[new]
    fn new() -> Self {
        Self
    }

    /// What a scene has for it.
    #[getter]
    fn _table(&self) -> &'static str {
        "point"
    }

    fn __repr__(&self) -> &'static str {
        "Point()"
    }
}

/// A sphere: radius_m (m), from 0.1 mm to 1 m.
#[pyclass(frozen, eq, get_all, module = "palpate")]
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Sphere {
    radius_m: f64,
}

#[pymethods]
impl Sphere {
    #[new]
    fn new(radius_m: f64) -> Self {
        Self { radius_m }
    }

    /// What a scene has for it.
    #[getter]
    fn _table<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        let table = PyDict::new(py);
        table.set_item("shape", "sphere")?;
        table.set_item("radius_m", self.radius_m)?;
        Ok(table)
    }

    fn __repr__(&self) -> String {
        format!("Sphere({:?})", self.radius_m)
    }
}

/// A cylinder with a half sphere at both ends: radius_m (m), length_m between the centres of the half spheres (m), axis in the tool's own
/// axes, of any length but 0.
#[pyclass(frozen, eq, get_all, module = "palpate")]
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Capsule {
    radius_m: f64,
    length_m: f64,
    axis: (f64, f64, f64),
}

#[pymethods]
impl Capsule {
    #[new]
    #[pyo3(signature = (radius_m, length_m, axis = (0.0, 0.0, 1.0)))]
    fn new(radius_m: f64, length_m: f64, axis: (f64, f64, f64)) -> Self {
        Self { radius_m, length_m, axis }
    }

    /// What a scene has for it.
    #[getter]
    fn _table<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        let table = PyDict::new(py);
        table.set_item("shape", "capsule")?;
        table.set_item("radius_m", self.radius_m)?;
        table.set_item("length_m", self.length_m)?;
        table.set_item("axis", self.axis)?;
        Ok(table)
    }

    fn __repr__(&self) -> String {
        format!("Capsule({:?}, {:?}, axis={:?})", self.radius_m, self.length_m, self.axis)
    }
}
