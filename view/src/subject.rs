//! What is shown: a session that a program started, or a scene of which one session after the other is made.

use std::fmt;
use std::path::PathBuf;
use std::sync::Arc;

use palpate::log::Environment;
use palpate::scene::{DeviceKind, DeviceSpec, ModelChoice, Scene};
use palpate::session::{Running, Session, SessionBuilder};
use palpate::{Device, Error, ErrorKind};
use serde_json::{Value, json};

use crate::wish::Change;

/// What opens a device that the engine does not know.
pub(crate) type OpenHaply = fn(&palpate::scene::HaplySpec, f64) -> Result<Box<dyn Device>, Error>;

/// Gives a session the way to a global model elsewhere.
#[derive(Clone)]
struct Connect(Arc<dyn Fn(SessionBuilder) -> Result<SessionBuilder, Error> + Send + Sync>);

impl fmt::Debug for Connect {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("Connect")
    }
}

/// A scene that visitors push, and how its sessions are made.
///
/// ```
/// use palpate::scene::{DeviceKind, Scene};
/// use palpate_view::Pushed;
///
/// let pushed = Pushed::new(Scene::demo());
/// assert_eq!(pushed.scene().devices[0].kind, DeviceKind::Pointer);
/// ```
#[derive(Clone, Debug)]
pub struct Pushed {
    scene: Scene,
    out: Option<PathBuf>,
    open_haply: Option<OpenHaply>,
    connect: Option<Connect>,
    /// Sessions so far.
    count: u32,
}

impl Pushed {
    /// A scene whose first device is replaced by a pointer that begins where the device did; the other devices stay what they are.
    pub fn new(scene: Scene) -> Self {
        Self::by(scene, 0)
    }

    /// Likewise the device of that name, or the first one if there is none.
    pub fn by_device(scene: Scene, name: &str) -> Self {
        let device = scene.devices.iter().position(|device| device.name.as_deref() == Some(name));
        Self::by(scene, device.unwrap_or_default())
    }

    fn by(mut scene: Scene, device: usize) -> Self {
        if let Some(pushed) = scene.devices.get_mut(device) {
            point(pushed);
        }
        Self::as_it_is(scene)
    }

    /// A scene with its own devices, to be watched.
    pub fn as_it_is(scene: Scene) -> Self {
        Self { scene, out: None, open_haply: None, connect: None, count: 0 }
    }

    /// Also writes a log of each session, with pictures: the first to `path`, each after it to a name with its number.
    #[must_use]
    pub fn log(mut self, path: impl Into<PathBuf>) -> Self {
        self.out = Some(path.into());
        self
    }

    /// Opens a device that the engine does not know by this, as
    /// [`SessionBuilder::open_haply_with`](palpate::session::SessionBuilder::open_haply_with) does.
    #[must_use]
    pub fn open_haply_with(mut self, open: OpenHaply) -> Self {
        self.open_haply = Some(open);
        self
    }

    /// Takes the global model of each session from another process: `connect` gives its builder the way there by
    /// [`SessionBuilder::global_over`]. All sessions then have the local model of the scene, as the other process does.
    #[must_use]
    pub fn connect(
        mut self,
        connect: impl Fn(SessionBuilder) -> Result<SessionBuilder, Error> + Send + Sync + 'static,
    ) -> Self {
        self.connect = Some(Connect(Arc::new(connect)));
        self
    }

    /// The scene as it will be run.
    pub fn scene(&self) -> &Scene {
        &self.scene
    }

    /// A session with what a visitor changed, checked and not started.
    ///
    /// # Errors
    /// If it cannot work.
    pub(crate) fn session(&mut self, change: &Change) -> Result<Session, Error> {
        let mut builder = Session::from_scene(changed(self.scene.clone(), change)?).endless().share_records();
        if let Some(Connect(connect)) = &self.connect {
            builder = connect(builder)?;
        } else if std::thread::available_parallelism().is_ok_and(|cores| cores.get() > 1) {
            // With one core there is none for a global model beside `full`.
            builder = builder.switchable();
        }
        if let Some(open) = self.open_haply {
            builder = builder.open_haply_with(open);
        }
        if let Some(out) = &self.out {
            builder = builder.log(numbered(out, self.count + 1)).log_scene();
        }
        let session = builder.build()?;
        self.count += 1;
        Ok(session)
    }

    /// What a visitor may change and what it is now, for the page.
    pub(crate) fn about(&self, change: &Change) -> Value {
        let asked = change.model.as_deref().unwrap_or(self.scene.local.model.name());
        // The other side of a link has the scene's alone.
        let models = if self.connect.is_some() { vec![asked] } else { ModelChoice::NAMES.to_vec() };
        json!({
            "can_restart": true,
            "models": models,
            "session": self.count,
        })
    }
}

/// The name of the log of session number `count`: the first has `path`, each after it a name with its number.
///
/// # Real-time
/// Not for a tick: allocates.
pub fn numbered(path: &std::path::Path, count: u32) -> PathBuf {
    if count < 2 {
        return path.to_owned();
    }
    let stem = path.file_stem().unwrap_or_default().to_string_lossy();
    let ending = path.extension().map_or(String::new(), |ending| format!(".{}", ending.to_string_lossy()));
    path.with_file_name(format!("{stem}-{count}{ending}"))
}

/// Puts a pointer in the place of a device.
fn point(device: &mut DeviceSpec) {
    if device.kind == DeviceKind::Pointer {
        return;
    }
    let begin = device.path.as_ref().map(|path| path.at(0.0));
    let mut pointer = device.pointer.clone();
    pointer.start_m = pointer.start_m.or(device.plant.start_m).or(begin);
    *device = DeviceSpec {
        name: device.name.take(),
        kind: DeviceKind::Pointer,
        attach_node: device.attach_node,
        tool: device.tool,
        profile: device.profile,
        pointer,
        ..DeviceSpec::default()
    };
}

/// `scene` with the model that a visitor wants; friction and stiffness change while it runs.
fn changed(mut scene: Scene, change: &Change) -> Result<Scene, Error> {
    if let Some(model) = &change.model {
        let unknown = || Error::new(ErrorKind::Usage, format!("there is no local model {model:?}"));
        scene = scene.with_model(ModelChoice::from_name(model).ok_or_else(unknown)?);
        // What was chosen for another model need not suit this one.
        (scene.local.patch, scene.local.basis) = (None, None);
    }
    Ok(scene)
}

/// What is known of a session that a program started.
pub(crate) fn known(running: &mut Running) -> (Option<palpate::session::SharedRecords>, Environment) {
    let mut records = running.take_records();
    let environment = records.as_mut().and_then(|records| records.environment()).unwrap_or_default();
    (records, environment)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_first_device_becomes_a_pointer_that_begins_where_it_did() {
        let demo = Scene::demo();
        let begin = demo.devices[0].path.as_ref().unwrap().at(0.0);
        let pushed = Pushed::new(demo.clone());
        let device = &pushed.scene().devices[0];
        assert_eq!((device.kind, device.pointer.start_m), (DeviceKind::Pointer, Some(begin)));
        assert_eq!(device.tool, demo.devices[0].tool);
        assert!(pushed.scene().validate().is_ok());
        assert_eq!(Pushed::as_it_is(demo.clone()).scene(), &demo);
    }

    #[test]
    fn every_model_that_a_page_offers_makes_a_session() {
        for name in ModelChoice::NAMES {
            let change = Change { model: Some((*name).into()), ..Change::default() };
            assert!(Pushed::new(Scene::demo()).session(&change).is_ok(), "{name}");
        }
    }

    #[test]
    fn the_device_of_a_name_is_pushed_and_the_others_stay_what_they_are() {
        let scene = palpate::scene::BuiltIn::named("two_hands").unwrap().load();
        let kinds = |pushed: &Pushed| pushed.scene().devices.iter().map(|device| device.kind).collect::<Vec<_>>();
        let pushed = Pushed::by_device(scene.clone(), "right");
        assert_eq!(kinds(&pushed)[1], DeviceKind::Pointer);
        assert_eq!(kinds(&pushed)[0], scene.devices[0].kind);
        assert_eq!(kinds(&Pushed::new(scene))[0], DeviceKind::Pointer);
    }

    #[test]
    fn each_session_has_a_log_of_its_own() {
        let names = [1, 2, 3].map(|count| numbered("a/run.mcap".as_ref(), count).display().to_string());
        assert_eq!(names, ["a/run.mcap", "a/run-2.mcap", "a/run-3.mcap"]);
    }
}
