//! Scene files: TOML text to a validated [`Scene`], every error with its line and field.

use std::path::Path;

use toml::de::DeTable;

mod fault;
mod kinds;
mod locate;
mod reader;
mod suggest;

use super::body::Volume;
use super::device::{field as device_field, numbered};
use super::validate::{mesh, tool};
use super::{BodySpec, BuiltIn, Scene, TetrahedraSpec};
use crate::devices::ToolPath;
use crate::error::{Error, ErrorKind};
use crate::files;
use fault::{Fault, plain_key};
use locate::{exact_offset_of, line_of, offset_of, table_at};

/// Largest scene file (bytes): a hundred times what a person writes.
const LARGEST_FILE: usize = 1 << 20;

impl Scene {
    /// Reads, completes and validates a scene file; the tool's path and the body's mesh are found relative to it. A closed
    /// surface is filled with elements, which may take seconds.
    ///
    /// # Errors
    /// [`ErrorKind::Io`] if a file cannot be read or is too large (a scene: 1 MiB), [`ErrorKind::Scene`] with file, line, field and what would be right if
    /// it cannot work.
    pub fn load(path: &Path) -> Result<Self, Error> {
        Self::load_with(path, &mut |_| ())
    }

    /// Does what [`load`](Self::load) does, and tells `progress` how much of filling a surface is done (0 to 1).
    ///
    /// # Errors
    /// As [`load`](Self::load).
    pub fn load_with(path: &Path, progress: &mut dyn FnMut(f64)) -> Result<Self, Error> {
        let name = path.display().to_string();
        let bytes = files::read(path, LARGEST_FILE as u64)?;
        let text = String::from_utf8(bytes).map_err(|error| {
            let line = line_of(error.as_bytes(), error.utf8_error().valid_up_to());
            Error::new(ErrorKind::Scene, "is not UTF-8 text, save the file as UTF-8").at(format!("{name}:{line}"))
        })?;
        Self::from_text(&text, &name, path.parent(), true, progress)
    }

    /// The scene in `text`; `name` stands for the file in errors, and `device.path_csv`, `device.log`, `body.mesh` and
    /// `body.surface` are found in the folder `base`, or in the current one.
    ///
    /// # Errors
    /// As [`load`](Self::load).
    pub fn from_toml(text: &str, name: &str, base: Option<&Path>) -> Result<Self, Error> {
        Self::from_text(text, name, base, true, &mut |_| ())
    }

    /// The scene in `text` as [`from_toml`](Self::from_toml) reads it, for a program that completes it: there need be no body, and nothing that
    /// moves the tool. A session that is built of it refuses what is still missing.
    ///
    /// ```
    /// use palpate::devices::ToolPath;
    /// use palpate::scene::Scene;
    ///
    /// # fn main() -> Result<(), palpate::Error> {
    /// let mut scene = Scene::from_partial_toml("contact.friction = 0.3", "settings", None)?;
    /// scene.devices[0].path = Some(ToolPath::constant([0.02, 0.02, 0.049])?);
    /// let error = Scene::from_partial_toml("contact.friction = -1", "settings", None).unwrap_err();
    /// assert!(error.place().ends_with("contact.friction"));
    /// # Ok(())
    /// # }
    /// ```
    ///
    /// # Errors
    /// As [`load`](Self::load).
    pub fn from_partial_toml(text: &str, name: &str, base: Option<&Path>) -> Result<Self, Error> {
        Self::from_text(text, name, base, false, &mut |_| ())
    }

    fn from_text(
        text: &str,
        name: &str,
        base: Option<&Path>,
        is_whole: bool,
        progress: &mut dyn FnMut(f64),
    ) -> Result<Self, Error> {
        let found = |file: &Path| base.map_or_else(|| file.to_owned(), |base| base.join(file));
        let read_path = |path_csv: &Path| ToolPath::read_csv(&found(path_csv));
        let read_volume = |spec: &TetrahedraSpec, file: &Path| {
            let filled_with = spec.surface.is_some().then(|| spec.sizes());
            Volume::read(&found(file), spec.unit_m, filled_with, progress)
        };
        let mut scene = Self::from_toml_with(text, name, is_whole, read_path, read_volume)?;
        // It is read when a session is built.
        for device in &mut scene.devices {
            device.log = device.log.take().map(|log| found(&log));
        }
        Ok(scene)
    }

    /// The built-in demo: five seconds of pressing, dragging, circling and tapping. Reads no file.
    pub fn demo() -> Self {
        BuiltIn::named("demo").expect("it is built in").load()
    }

    /// The scene in `text`, with the tool's path fetched by `read_path` and the body's mesh by `read_volume`; if it `is_whole`, with a body and
    /// a tool.
    pub(super) fn from_toml_with(
        text: &str,
        name: &str,
        is_whole: bool,
        read_path: impl Fn(&Path) -> Result<ToolPath, Error>,
        read_volume: impl FnMut(&TetrahedraSpec, &Path) -> Result<Volume, Error>,
    ) -> Result<Self, Error> {
        let mut scene = Self::parse(text, name)?;
        let (document, _) = DeTable::parse_recoverable(text);
        let root = document.get_ref();
        let on_line = |error: Error, offset: usize| error.at(format!("{name}:{}", line_of(text, offset)));
        if is_whole && scene.body.is_none() {
            let message = "is missing, a scene needs the tables [body.block] and [body.material], or a [body] of kind = \"tetrahedra\"";
            return Err(on_line(Error::scene("body", message), 0));
        }
        // Before any of their files is read.
        scene.check_counts().map_err(|error| {
            let offset = offset_of(root, error.place());
            on_line(error, offset)
        })?;
        scene.source = Some(text.to_owned());
        let count = scene.devices.len();
        for (index, device) in scene.devices.iter_mut().enumerate() {
            let Some(path_csv) = &device.path_csv else { continue };
            let field = format!("{}.path_csv", device_field(index, count));
            let read = read_path(path_csv).map_err(|error| match error.kind() {
                // A file that is there but wrong has a line of its own to name.
                ErrorKind::Io => on_line(error.at(&field), offset_of(root, &field)),
                _ => error,
            })?;
            device.path = Some(read);
        }
        let tools = || {
            let mut devices = scene.devices.iter().enumerate().filter(|_| is_whole);
            devices.try_for_each(|(index, device)| tool(device).map_err(|error| numbered(error, index, &scene.devices)))
        };
        scene.validate().and_then(|()| tools()).map_err(|error| {
            let offset = offset_of(root, error.place());
            on_line(error, offset)
        })?;
        if let Some(BodySpec::Tetrahedra(spec)) = &mut scene.body {
            complete(spec, read_volume, |field| offset_of(root, field), on_line)?;
        }
        Ok(scene)
    }

    /// The scene in `text` as it stands: nothing is fetched, completed or validated.
    fn parse(text: &str, name: &str) -> Result<Self, Error> {
        if text.len() > LARGEST_FILE {
            let message = format!("is larger than {} MiB, the most that is read", LARGEST_FILE >> 20);
            return Err(Error::new(ErrorKind::Scene, message).at(name));
        }
        let (document, syntax) = DeTable::parse_recoverable(text);
        let root = document.get_ref();
        let refuse = |fault: Fault| {
            let error = Error::new(ErrorKind::Scene, fault.message);
            let error = if fault.field.is_empty() { error } else { error.at(fault.field) };
            error.at(format!("{name}:{}", line_of(text, fault.offset.unwrap_or(0))))
        };
        if let Some(error) = syntax.first() {
            return Err(refuse(syntax_fault(text, root, error)));
        }
        kinds::first_misplaced(root).map_or(Ok(()), |fault| Err(refuse(fault)))?;
        reader::read(root).map_err(refuse)
    }

    /// The scene as the text of a scene file, every number to its last bit. The tool's path itself is not part of it,
    /// only the name of its file.
    ///
    /// # Errors
    /// [`ErrorKind::Scene`] if the name of the path's file is not UTF-8.
    pub fn to_toml(&self) -> Result<String, Error> {
        toml::to_string(self)
            .map_err(|error| Error::new(ErrorKind::Scene, format!("cannot be written as TOML: {error}")))
    }

    /// The scene in the text that a log keeps of what was run: with a body or without, and without a tool, which is in the
    /// log itself. `name` stands for the text in errors.
    ///
    /// # Errors
    /// [`ErrorKind::Scene`] if it is no scene or one that cannot work.
    pub fn from_session_toml(text: &str, name: &str) -> Result<Self, Error> {
        let scene = Self::parse(text, name)?;
        scene.validate().map_err(|error| error.at(name))?;
        Ok(scene)
    }
}

/// Fetches the mesh of `spec`, and makes sure that a body can be made of it; `on_line` tells the line of the offset
/// that `offset` finds for a field.
fn complete(
    spec: &mut TetrahedraSpec,
    mut read: impl FnMut(&TetrahedraSpec, &Path) -> Result<Volume, Error>,
    offset: impl Fn(&str) -> usize,
    on_line: impl Fn(Error, usize) -> Error,
) -> Result<(), Error> {
    let of_field = |error: Error| {
        let offset = offset(error.place());
        on_line(error, offset)
    };
    mesh(spec).map_err(&of_field)?;
    let sources = [("body.mesh", &spec.mesh), ("body.surface", &spec.surface)];
    for (field, file) in sources {
        let Some(file) = file else { continue };
        let volume = read(spec, file).map_err(|error| match error.kind() {
            // The field stands in front of the file that cannot be read.
            ErrorKind::Io => on_line(error.at(field), offset(field)),
            _ if error.place().starts_with("body.") => of_field(error),
            // A mesh that is there but wrong has a place of its own to name.
            _ => error,
        })?;
        spec.volume = Some(volume);
        break;
    }
    spec.build().map(drop).map_err(of_field)
}

/// toml's complaint in the form of ours; a key given twice is named with its table and its first line.
fn syntax_fault(text: &str, root: &DeTable<'_>, error: &toml::de::Error) -> Fault {
    let span = error.span().unwrap_or(0..0);
    let at = |fault: Fault| fault.or_at(span.start);
    if error.message() != "duplicate key" {
        return at(Fault::new(format!("TOML syntax: {}", error.message())));
    }
    let line = line_of(text, span.start);
    let header = text.lines().nth(line - 1).unwrap_or_default().trim_start().strip_prefix('[');
    if let Some(header) = header {
        let table = header.trim_start_matches('[').split(']').next().unwrap_or_default().trim();
        let field = table.split('.').map(|key| plain_key(key.trim())).collect::<Vec<_>>().join(".");
        return at(Fault { field, offset: None, message: "is given twice, keep one".to_owned() });
    }
    let key = plain_key(text.get(span.clone()).unwrap_or_default().trim_matches(['"', '\'']));
    let table = table_at(root, span.start);
    let field = if table.is_empty() { key } else { format!("{table}.{key}") };
    let first = exact_offset_of(root, &field).map(|offset| line_of(text, offset)).filter(|&first| first < line);
    let first = first.map(|first| format!(" first on line {first},")).unwrap_or_default();
    let message = format!("is given twice,{first} keep one");
    at(Fault { field, offset: None, message })
}
