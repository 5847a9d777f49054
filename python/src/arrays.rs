//! Arrays: numpy arrays over memory that Rust made, which nobody can write to, and numbers out of whatever Python calls an array.

use numpy::{Element, PyArray1, PyArrayMethods, PyReadonlyArray2};
use palpate::model::Vec3;
use pyo3::prelude::*;

use crate::errors::usage;

/// A numpy array of shape (n, `width`) over `values`, row by row. Nothing is copied: the array owns the memory, and writing to it raises.
///
/// # Errors
/// If numpy is not there.
pub(crate) fn frozen<T: Element>(py: Python<'_>, values: Vec<T>, width: usize) -> PyResult<Bound<'_, PyAny>> {
    let rows = values.len() / width;
    let flat = PyArray1::from_vec(py, values);
    flat.call_method1("setflags", (false,))?;
    Ok(flat.reshape([rows, width])?.into_any())
}

/// As [`frozen`], of shape (n, 3).
///
/// # Errors
/// If numpy is not there.
pub(crate) fn frozen_points<'py>(py: Python<'py>, points: &[Vec3]) -> PyResult<Bound<'py, PyAny>> {
    frozen(py, points.iter().flat_map(|point| [point.x, point.y, point.z]).collect(), 3)
}

/// The numbers of what Python can make an array of numbers of, and its shape (rows, columns); one row is one row.
///
/// # Errors
/// `UsageError` that names `argument` if it is none of one or two dimensions.
pub(crate) fn rows(given: &Bound<'_, PyAny>, argument: &str, needed: &str) -> PyResult<(Vec<f64>, [usize; 2])> {
    let py = given.py();
    let wrong = |what: &str| usage(py, argument, &format!("is {what}, must be {needed}"));
    let numpy = py.import("numpy")?;
    let array = numpy.call_method1("asarray", (given, "float64")).map_err(|_| wrong("no array of numbers"))?;
    let array = numpy.call_method1("atleast_2d", (array,))?;
    let shape = array.getattr("shape")?.repr()?.to_string();
    let array: PyReadonlyArray2<'_, f64> =
        array.extract().map_err(|_: PyErr| wrong(&format!("an array of shape {shape}")))?;
    let view = array.as_array();
    Ok((view.iter().copied().collect(), [view.nrows(), view.ncols()]))
}

/// Rows of three numbers, at least one.
///
/// # Errors
/// As [`rows`], and if there are not three columns.
pub(crate) fn points(given: &Bound<'_, PyAny>, argument: &str) -> PyResult<Vec<Vec3>> {
    let needed = "an array of shape (n, 3)";
    let (values, [count, columns]) = rows(given, argument, needed)?;
    if columns != 3 {
        let message = format!("is an array of shape ({count}, {columns}), must be {needed}");
        return Err(usage(given.py(), argument, &message));
    }
    Ok(values.chunks_exact(3).map(|x| Vec3::new(x[0], x[1], x[2])).collect())
}
