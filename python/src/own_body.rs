//! Bodies that are written in Python, for simulated time.

use numpy::{PyReadonlyArray1, PyReadonlyArray2, PyReadonlyArray3};
use palpate::model::body::{Body, State, TangentBlock};
use palpate::model::mesh::Surface;
use palpate::model::{Mat3, Vec3};
use pyo3::exceptions::{PyTypeError, PyValueError};
use pyo3::prelude::*;

use crate::arrays::{frozen, frozen_points, points};
use crate::own_device::Failure;

/// An object of Python's with nodes, masses, triangles, and forces.
#[derive(Debug)]
pub(crate) struct OwnBody {
    object: Py<PyAny>,
    failure: Failure,
    rest: Vec<Vec3>,
    inverse_masses: Vec<f64>,
    surface: Surface,
    has_node_forces: bool,
}

/// True if `object` looks like a body.
pub(crate) fn is_body(object: &Bound<'_, PyAny>) -> PyResult<bool> {
    object.hasattr("forces")
}

/// True if the body can be linearised.
pub(crate) fn has_tangent(object: &Bound<'_, PyAny>) -> PyResult<bool> {
    object.hasattr("tangent")
}

impl OwnBody {
    /// A body of what `object` has: `nodes` (n, 3), `inverse_masses` (n,), `triangles` (m, 3), `forces(positions, velocities)`; its exceptions
    /// go to `failure`.
    ///
    /// # Errors
    /// If one is missing, of another shape, or no surface.
    pub(crate) fn new(object: &Bound<'_, PyAny>, failure: Failure) -> PyResult<Self> {
        let rest = points(&object.getattr("nodes")?, "nodes")?;
        let numpy = object.py().import("numpy")?;
        let array = |name: &str, kind: &str| numpy.call_method1("ascontiguousarray", (object.getattr(name)?, kind));
        let masses: PyReadonlyArray1<'_, f64> = array("inverse_masses", "float64")?.extract()?;
        let corners: PyReadonlyArray2<'_, u32> = array("triangles", "uint32")?.extract()?;
        let corners = corners.as_array();
        if corners.ncols() != 3 {
            return Err(PyValueError::new_err("triangles: must be an array of shape (m, 3)"));
        }
        let triangles = corners.rows().into_iter().map(|row| [row[0], row[1], row[2]]).collect();
        let surface = Surface::new(rest.len(), triangles);
        let surface = surface.map_err(|error| PyValueError::new_err(format!("triangles: {error}")))?;
        Ok(Self {
            inverse_masses: masses.as_array().to_vec(),
            has_node_forces: object.hasattr("node_forces")?,
            object: object.clone().unbind(),
            failure,
            rest,
            surface,
        })
    }

    /// Calls `method` with the state as frozen arrays, and `more`.
    fn call<'py>(
        &self,
        py: Python<'py>,
        method: &str,
        state: &State,
        more: Option<(Bound<'py, PyAny>, Option<bool>)>,
    ) -> PyResult<Bound<'py, PyAny>> {
        let (x, v) = (frozen_points(py, &state.positions)?, frozen_points(py, &state.velocities)?);
        let object = self.object.bind(py);
        match more {
            None => object.call_method1(method, (x, v)),
            Some((nodes, None)) => object.call_method1(method, (x, v, nodes)),
            Some((nodes, Some(clamp))) => object.call_method1(method, (x, v, nodes, clamp)),
        }
    }

    /// Puts the vectors that `method` gives into `forces`, which says how many there must be.
    fn vectors(
        &self,
        py: Python<'_>,
        method: &str,
        state: &State,
        nodes: Option<&[u32]>,
        forces: &mut [Vec3],
    ) -> PyResult<()> {
        let more = nodes.map(|nodes| PyResult::Ok((frozen(py, nodes.to_vec(), 1)?.call_method0("ravel")?, None)));
        let given = points(&self.call(py, method, state, more.transpose()?)?, method)?;
        if given.len() != forces.len() {
            let message =
                format!("{method}: gave {} forces, must be an array of shape ({}, 3)", given.len(), forces.len());
            return Err(PyValueError::new_err(message));
        }
        forces.copy_from_slice(&given);
        Ok(())
    }

    /// What `work` does, unless something failed before; numbers that are not finite, which no run survives, if it fails.
    fn attempt(&self, forces: &mut [Vec3], work: impl FnOnce(Python<'_>, &mut [Vec3]) -> PyResult<()>) {
        if !self.failure.is_there() {
            match Python::attach(|py| work(py, forces)) {
                Ok(()) => return,
                Err(error) => self.failure.note(error),
            }
        }
        forces.fill(Vec3::repeat(f64::NAN));
    }

    fn blocks(&self, py: Python<'_>, state: &State, nodes: &[u32], clamp: bool) -> PyResult<Vec<TangentBlock>> {
        let nodes = frozen(py, nodes.to_vec(), 1)?.call_method0("ravel")?;
        let given = self.call(py, "tangent", state, Some((nodes, Some(clamp))))?;
        let (rows, columns, stiffness, damping) = given
            .extract::<(Bound<'_, PyAny>, Bound<'_, PyAny>, Bound<'_, PyAny>, Bound<'_, PyAny>)>()
            .map_err(|_| PyTypeError::new_err("tangent: must give a tuple (rows, columns, stiffness, damping)"))?;
        let numpy = py.import("numpy")?;
        let ids = |array: Bound<'_, PyAny>| -> PyResult<Vec<u32>> {
            let array: PyReadonlyArray1<'_, u32> =
                numpy.call_method1("ascontiguousarray", (array, "uint32"))?.extract()?;
            Ok(array.as_array().to_vec())
        };
        let matrices = |array: Bound<'_, PyAny>| -> PyResult<Vec<Mat3>> {
            let array =
                numpy.call_method1("ascontiguousarray", (array, "float64"))?.call_method1("reshape", (-1, 3, 3))?;
            let array: PyReadonlyArray3<'_, f64> = array.extract()?;
            Ok(array.as_array().outer_iter().map(|m| Mat3::from_fn(|i, j| m[[i, j]])).collect())
        };
        let (rows, columns) = (ids(rows)?, ids(columns)?);
        let (stiffness, damping) = (matrices(stiffness)?, matrices(damping)?);
        let counts = [rows.len(), columns.len(), stiffness.len(), damping.len()];
        if counts.iter().any(|&count| count != counts[0]) {
            return Err(PyValueError::new_err(format!(
                "tangent: has {counts:?} rows, columns and matrices, must be as many of each"
            )));
        }
        if rows.iter().chain(&columns).any(|&node| node as usize >= self.rest.len()) {
            return Err(PyValueError::new_err(format!("tangent: names a node beyond {}", self.rest.len() - 1)));
        }
        let block = |at: usize| TangentBlock {
            row: rows[at],
            column: columns[at],
            position: stiffness[at],
            velocity: damping[at],
        };
        Ok((0..rows.len()).map(block).collect())
    }
}

impl Body for OwnBody {
    fn rest(&self) -> &[Vec3] {
        &self.rest
    }

    fn inverse_masses(&self) -> &[f64] {
        &self.inverse_masses
    }

    fn surface(&self) -> &Surface {
        &self.surface
    }

    fn forces(&mut self, state: &State, forces: &mut [Vec3]) {
        self.attempt(forces, |py, forces| self.vectors(py, "forces", state, None, forces));
    }

    fn node_forces(&self, state: &State, nodes: &[u32], forces: &mut [Vec3]) {
        if self.has_node_forces {
            return self.attempt(forces, |py, forces| self.vectors(py, "node_forces", state, Some(nodes), forces));
        }
        let mut all = vec![Vec3::zeros(); self.rest.len()];
        self.attempt(&mut all, |py, all| self.vectors(py, "forces", state, None, all));
        for (force, &node) in forces.iter_mut().zip(nodes) {
            *force = all[node as usize];
        }
    }

    fn tangent(&self, state: &State, nodes: &[u32], clamp: bool, emit: &mut dyn FnMut(TangentBlock)) {
        if self.failure.is_there() {
            return;
        }
        match Python::attach(|py| self.blocks(py, state, nodes, clamp)) {
            Ok(blocks) => blocks.into_iter().for_each(emit),
            Err(error) => self.failure.note(error),
        }
    }
}
