//! What a session is of: a scene that is made around a body, or one that is given, with the session's own settings put over it.

use palpate::devices::ToolPath;
use palpate::scene::Scene as EngineScene;
use pyo3::prelude::*;
use toml::{Table, Value};

use crate::body::{Block, Described, Tetrahedra};
use crate::errors::{OrRaise, usage};
use crate::scene::{Scene, partial};
use crate::toml_value::merge;

/// A scene of `changes` around a body: the one that is `described`, or a program's own.
pub(crate) fn of_body(
    py: Python<'_>,
    described: Option<&Described>,
    mut changes: Table,
    path: Option<ToolPath>,
) -> PyResult<EngineScene> {
    let has_duration = has_duration(&changes);
    if changes.remove("body").is_some() {
        return Err(usage(py, "settings", "has a body, and so has the session: leave one out"));
    }
    let spec = described.map(|described| &described.spec);
    if let Some(described) = described.filter(|described| described.spec.mass_spring().is_some()) {
        changes.insert("body".to_owned(), Value::Table(described.table.clone()));
    }
    let mut scene = py.detach(|| partial(&changes, None)).or_raise(py)?;
    // A mesh has been read, and is not read again.
    scene.body = spec.cloned();
    if let Some(path) = path {
        put_path(py, &mut scene, path, has_duration)?;
    }
    Ok(scene)
}

/// The scene that `subject` means with `changes` put over it, and its name.
pub(crate) fn described(
    subject: &Bound<'_, PyAny>,
    changes: Table,
    path: Option<ToolPath>,
) -> PyResult<(EngineScene, String)> {
    let py = subject.py();
    let body = if let Ok(block) = subject.cast::<Block>() {
        Some(("block", &block.get().described))
    } else if let Ok(tetrahedra) = subject.cast::<Tetrahedra>() {
        Some(("tetrahedra", &tetrahedra.get().described))
    } else {
        None
    };
    if let Some((name, described)) = body {
        return Ok((of_body(py, Some(described), changes, path)?, name.to_owned()));
    }
    let scene = Scene::of(subject)?;
    let Scene { scene, table, base, name, is_built_in } = scene.get();
    if changes.is_empty() && path.is_none() {
        return Ok((scene.clone(), name.clone()));
    }
    let mut table = table.clone();
    if matches!(table.get("device"), Some(Value::Array(_))) && changes.contains_key("device") {
        return Err(usage(
            py,
            "tool, attach_node",
            "are for a scene with one device, and this has several: say it in the scene",
        ));
    }
    let is_block = scene.body.as_ref().is_some_and(|body| body.mass_spring().is_some());
    if !is_block && changes.contains_key("body") {
        return Err(usage(py, "settings", "has a body, and so has the scene: make another Scene of its to_dict()"));
    }
    merge(&mut table, changes);
    let has_duration = has_duration(&table);
    if !is_block {
        // Its mesh has been read, and is not read again.
        table.remove("body");
    }
    if *is_built_in {
        // Its path is part of the program.
        table.get_mut("device").and_then(Value::as_table_mut).map(|device| device.remove("path_csv"));
    }
    let mut changed = py.detach(|| partial(&table, base.as_deref())).or_raise(py)?;
    if !is_block {
        changed.body.clone_from(&scene.body);
    }
    if *is_built_in {
        changed.devices[0].path.clone_from(&scene.devices[0].path);
    }
    if let Some(path) = path {
        put_path(py, &mut changed, path, has_duration)?;
    }
    Ok((changed, name.clone()))
}

fn has_duration(table: &Table) -> bool {
    table.get("run").is_some_and(|run| run.get("duration_s").is_some())
}

/// Lets the first device follow `path`, to the end of which the session lasts if nothing says how long.
fn put_path(py: Python<'_>, scene: &mut EngineScene, path: ToolPath, has_duration: bool) -> PyResult<()> {
    if !has_duration && path.duration_s() > 0.0 {
        scene.run.duration_s = path.duration_s();
    }
    let first = scene.devices.first_mut();
    let first = first.ok_or_else(|| usage(py, "path", "is for a scene with a device, and this has none"))?;
    (first.path, first.path_csv) = (Some(path), None);
    Ok(())
}
