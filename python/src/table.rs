//! A table of a run or a log: arrays by their names.

use palpate_cli::columns::Column;
use pyo3::exceptions::PyKeyError;
use pyo3::prelude::*;
use pyo3::sync::PyOnceLock;
use pyo3::types::PySlice;

use crate::arrays::frozen;
use crate::recording::{Block, Columns};

/// A topic of a run: columns with the names and units of `palpate export`, each a read-only array of shape (rows,).
///
/// `table["t_s"]` is a column, `table.columns` are their names, `len(table)` is the number of rows, `dict(table)` has all of it. A number
/// that may be missing, such as the triangle of a contact, is -1 where it is.
#[pyclass(frozen, module = "palpate")]
pub(crate) struct Table {
    columns: &'static [Column],
    /// For each column its block and its place in it.
    places: Vec<(usize, usize)>,
    blocks: Vec<Stored>,
    rows: usize,
}

enum Stored {
    /// Of shape (rows, width).
    Numbers(Py<PyAny>),
    Words {
        numbers: Py<PyAny>,
        words: Vec<String>,
        array: PyOnceLock<Py<PyAny>>,
    },
}

impl Table {
    /// The finished table; its arrays take over the memory.
    ///
    /// # Errors
    /// If numpy is not there.
    pub(crate) fn new(py: Python<'_>, made: Columns) -> PyResult<Self> {
        let (columns, rows) = (made.columns(), made.rows);
        let widths: Vec<usize> = made.blocks.iter().map(Block::width).collect();
        let places =
            widths.iter().enumerate().flat_map(|(block, &width)| (0..width).map(move |at| (block, at))).collect();
        let stored = |block| {
            Ok(Stored::Numbers(
                match block {
                    Block::F64(values, width) => frozen(py, values, width),
                    Block::F32(values, width) => frozen(py, values, width),
                    Block::U64(values, width) => frozen(py, values, width),
                    Block::U32(values, width) => frozen(py, values, width),
                    Block::I64(values, width) => frozen(py, values, width),
                    Block::Words(numbers, words) => {
                        let numbers = frozen(py, numbers, 1)?.unbind();
                        return Ok(Stored::Words { numbers, words: words.words, array: PyOnceLock::new() });
                    }
                }?
                .unbind(),
            ))
        };
        let blocks = made.blocks.into_iter().map(stored).collect::<PyResult<_>>()?;
        Ok(Self { columns, places, blocks, rows })
    }

    pub(crate) fn rows(&self) -> usize {
        self.rows
    }

    /// `count` columns from the one called `first` on as one array of shape (rows, count), or (rows,) if it is one. They must be numbers of
    /// one type.
    ///
    /// # Errors
    /// `KeyError` if there is no such column.
    pub(crate) fn side_by_side<'py>(&self, py: Python<'py>, first: &str, count: usize) -> PyResult<Bound<'py, PyAny>> {
        let at = self.index(first)?;
        let (block, from) = self.places[at];
        match &self.blocks[block] {
            Stored::Numbers(array) if count == 1 => array.bind(py).get_item((PySlice::full(py), from)),
            Stored::Numbers(array) => {
                let columns = PySlice::new(py, from as isize, (from + count) as isize, 1);
                array.bind(py).get_item((PySlice::full(py), columns))
            }
            Stored::Words { numbers, words, array } => {
                let spelt = || {
                    let all = py.import("numpy")?.call_method1("array", (words.clone(), "str"))?;
                    let of_rows = all.call_method1("take", (numbers.bind(py).call_method0("ravel")?,))?;
                    of_rows.call_method1("setflags", (false,))?;
                    PyResult::Ok(of_rows.unbind())
                };
                Ok(array.get_or_try_init(py, spelt)?.bind(py).clone())
            }
        }
    }

    pub(crate) fn has(&self, column: &str) -> bool {
        self.index(column).is_ok()
    }

    fn index(&self, name: &str) -> PyResult<usize> {
        self.columns.iter().position(|(column, _)| *column == name).ok_or_else(|| {
            PyKeyError::new_err(format!("there is no column {name:?}, the columns are {}", self.columns().join(", ")))
        })
    }
}

#[pymethods]
impl Table {
    /// The names of the columns, with their units.
    #[getter]
    fn columns(&self) -> Vec<&'static str> {
        self.columns.iter().map(|(name, _)| *name).collect()
    }

    /// The names of the columns, as a mapping calls them.
    fn keys(&self) -> Vec<&'static str> {
        self.columns()
    }

    /// The column called `name`, of shape (rows,).
    fn __getitem__<'py>(&self, py: Python<'py>, name: &str) -> PyResult<Bound<'py, PyAny>> {
        self.side_by_side(py, name, 1)
    }

    fn __contains__(&self, name: &str) -> bool {
        self.has(name)
    }

    fn __len__(&self) -> usize {
        self.rows
    }

    /// The table as a pandas.DataFrame.
    #[pyo3(name = "to_pandas")]
    pub(crate) fn to_pandas<'py>(slf: &Bound<'py, Self>) -> PyResult<Bound<'py, PyAny>> {
        slf.py().import("palpate._frames")?.call_method1("of_table", (slf,))
    }

    fn __repr__(&self) -> String {
        format!("<palpate.Table of {} rows: {}>", self.rows, self.columns().join(", "))
    }
}
