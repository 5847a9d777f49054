//! Scenes from files and dictionaries: one validation, the engine's own.

use std::path::{Path, PathBuf};

use palpate::Error;
use palpate::scene::Scene as EngineScene;
use pyo3::prelude::*;
use pyo3::types::{PyDict, PyString};
use toml::Table;

use crate::errors::{DICTIONARY, OrRaise, usage};
use crate::toml_value::{dictionary, table};

/// A scene: everything that a run needs to know, from a file or a dictionary of the same tables.
///
/// `Scene("scene.toml")` reads a file. `Scene({"body": {...}, "device": {...}}, base="folder")` reads a dictionary with the keys of a scene
/// file; files that it names are found in `base`, or in the current folder. A dictionary may leave out the body and what moves the tool, for
/// a Session that brings them.
///
/// Raises SceneError with the field and what would be right, FileError if a file cannot be read.
#[pyclass(frozen, module = "palpate")]
pub(crate) struct Scene {
    pub(crate) scene: EngineScene,
    /// As it was given: what a session puts its own settings over.
    pub(crate) table: Table,
    pub(crate) base: Option<PathBuf>,
    /// The file, or what stands for it.
    pub(crate) name: String,
    /// Part of the program: there is no file of its path.
    pub(crate) is_built_in: bool,
}

impl Scene {
    /// The scene that `given` is, or that its path or dictionary means.
    pub(crate) fn of<'py>(given: &Bound<'py, PyAny>) -> PyResult<Bound<'py, Self>> {
        match given.cast::<Self>() {
            Ok(scene) => Ok(scene.clone()),
            Err(_) => Ok(given.py().get_type::<Self>().call1((given,))?.cast_into::<Self>()?),
        }
    }
}

/// True if `given` is the path of a file.
pub(crate) fn is_path(given: &Bound<'_, PyAny>) -> PyResult<bool> {
    Ok(given.is_instance_of::<PyString>() || given.hasattr("__fspath__")?)
}

#[pymethods]
impl Scene {
    #[new]
    #[pyo3(signature = (source, base = None))]
    fn new(py: Python<'_>, source: &Bound<'_, PyAny>, base: Option<PathBuf>) -> PyResult<Self> {
        if let Ok(dictionary) = source.cast::<PyDict>() {
            let table = table(dictionary, "")?;
            let scene = py.detach(|| partial(&table, base.as_deref())).or_raise(py)?;
            return Ok(Self { scene, table, base, name: DICTIONARY.to_owned(), is_built_in: false });
        }
        if !is_path(source)? {
            let kind = source.get_type().name()?.to_string();
            return Err(usage(py, "source", &format!("is a {kind}, must be the path of a scene file or a dictionary")));
        }
        if base.is_some() {
            return Err(usage(
                py,
                "base",
                "is for dictionaries, the files of a scene file are found beside it: leave it out",
            ));
        }
        let path: PathBuf = source.extract()?;
        let scene = py.detach(|| EngineScene::load(&path)).or_raise(py)?;
        // It has been read as a scene before.
        let table = scene.source.as_deref().and_then(|text| text.parse().ok()).unwrap_or_default();
        let base = Some(path.parent().unwrap_or(Path::new("")).to_owned());
        Ok(Self { scene, table, base, name: path.display().to_string(), is_built_in: false })
    }

    /// The built-in scene `demo`: five seconds of pressing, dragging, circling and tapping.
    #[staticmethod]
    fn demo() -> Self {
        let scene = EngineScene::demo();
        let table = scene.source.as_deref().and_then(|text| text.parse().ok()).unwrap_or_default();
        Self { scene, table, base: None, name: "demo".to_owned(), is_built_in: true }
    }

    /// The tables of the scene as a new dictionary, as they were given: what is left out has its default.
    fn to_dict<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        dictionary(py, &self.table)
    }

    /// The folder in which the files that it names are found; None for the current one.
    #[getter]
    fn base(&self) -> Option<PathBuf> {
        self.base.clone()
    }

    fn __repr__(&self) -> String {
        format!("<palpate.Scene {}>", self.name)
    }
}

/// The scene that `table` means, with or without a body and a tool.
///
/// # Errors
/// As [`EngineScene::from_partial_toml`].
pub(crate) fn partial(table: &Table, base: Option<&Path>) -> Result<EngineScene, Error> {
    let mut scene = EngineScene::from_partial_toml(&table.to_string(), DICTIONARY, base)?;
    // Nobody wrote it: the log has the scene as it was run.
    scene.source = None;
    Ok(scene)
}
