//! Python's values as those of a scene file, so that one validation serves both.

use pyo3::prelude::*;
use pyo3::types::{PyBool, PyDict, PyFloat, PyInt, PyString};
use toml::{Table, Value};

use crate::errors::usage;

/// The table that a dictionary stands for. `None` is a key that is not there.
///
/// # Errors
/// `UsageError` with the dotted key of what no scene file can hold.
pub(crate) fn table(dictionary: &Bound<'_, PyDict>, at: &str) -> PyResult<Table> {
    let mut table = Table::new();
    for (key, value) in dictionary {
        let Ok(key) = key.cast::<PyString>() else {
            return Err(usage(dictionary.py(), at, &format!("has the key {}, keys are text", key.repr()?)));
        };
        let key = key.to_string();
        let at = if at.is_empty() { key.clone() } else { format!("{at}.{key}") };
        if !value.is_none() {
            table.insert(key, self::value(&value, &at)?);
        }
    }
    Ok(table)
}

/// The value that `given`, which stands at `at`, means in a scene file: numpy's numbers and arrays count as Python's.
///
/// # Errors
/// As [`table`].
pub(crate) fn value(given: &Bound<'_, PyAny>, at: &str) -> PyResult<Value> {
    let py = given.py();
    if let Ok(flag) = given.cast::<PyBool>() {
        return Ok(Value::Boolean(flag.is_true()));
    }
    if given.is_instance_of::<PyInt>() {
        return given
            .extract()
            .map(Value::Integer)
            .map_err(|_| usage(py, at, "is a whole number beyond 64 bits, use a smaller one"));
    }
    if given.is_instance_of::<PyFloat>() {
        return Ok(Value::Float(given.extract()?));
    }
    if given.is_instance_of::<PyString>() {
        return Ok(Value::String(given.extract()?));
    }
    if let Ok(dictionary) = given.cast::<PyDict>() {
        return Ok(Value::Table(table(dictionary, at)?));
    }
    if given.hasattr("__fspath__")? {
        let path: String = given.call_method0("__fspath__")?.extract()?;
        return Ok(Value::String(path));
    }
    // Arrays and numbers of numpy.
    if given.hasattr("tolist")? {
        return value(&given.call_method0("tolist")?, at);
    }
    if let Ok(scene_part) = given.getattr("_table") {
        return value(&scene_part, at);
    }
    let Ok(items) = given.try_iter() else {
        let kind = given.get_type().name()?.to_string();
        return Err(usage(py, at, &format!("is a {kind}, use a number, a text, a list or a dictionary")));
    };
    let items = items.enumerate().map(|(index, item)| value(&item?, &format!("{at}[{index}]")));
    Ok(Value::Array(items.collect::<PyResult<_>>()?))
}

/// Puts `changes` over `table`: tables are merged, all else is replaced.
pub(crate) fn merge(table: &mut Table, changes: Table) {
    for (key, change) in changes {
        match (table.get_mut(&key), change) {
            (Some(Value::Table(inner)), Value::Table(change)) => merge(inner, change),
            (_, change) => {
                table.insert(key, change);
            }
        }
    }
}

/// A table as a dictionary of Python's.
///
/// # Errors
/// If Python has no memory.
pub(crate) fn dictionary<'py>(py: Python<'py>, table: &Table) -> PyResult<Bound<'py, PyDict>> {
    let dictionary = PyDict::new(py);
    for (key, value) in table {
        dictionary.set_item(key, object(py, value)?)?;
    }
    Ok(dictionary)
}

fn object<'py>(py: Python<'py>, value: &Value) -> PyResult<Bound<'py, PyAny>> {
    Ok(match value {
        Value::String(text) => text.into_pyobject(py)?.into_any(),
        Value::Integer(number) => number.into_pyobject(py)?.into_any(),
        Value::Float(number) => number.into_pyobject(py)?.into_any(),
        Value::Boolean(flag) => flag.into_pyobject(py)?.to_owned().into_any(),
        Value::Datetime(date) => date.to_string().into_pyobject(py)?.into_any(),
        Value::Table(table) => dictionary(py, table)?.into_any(),
        Value::Array(items) => {
            let items: Vec<_> = items.iter().map(|item| object(py, item)).collect::<PyResult<_>>()?;
            items.into_pyobject(py)?.into_any()
        }
    })
}
