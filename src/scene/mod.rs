//! What is simulated: one plain description that the builder and scene files both fill.
//!
//! SI units, the unit in every name. [`Scene::validate`] is the one place that decides whether a scene can work;
//! reading a file adds the file and line to its errors and nothing else.

use crate::error::Error;

mod body;
mod check;
mod choice;
mod contact;
mod device;
mod device_fault;
mod devices;
mod haply;
mod models;
mod region;
mod safety;
mod touched;
mod validate;
mod validate_device;

mod demo;
mod fault;
mod file;
mod friction;
mod locate;
mod reader;
mod suggest;

pub use body::{BlockSpec, BodyKind, BodySpec, MaterialSpec};
pub use choice::ModelChoice;
pub use contact::{ContactSpec, Friction};

pub use crate::devices::{Axis, HandSpec, PlantSpec, SafetyStop, ToolPath};
pub use crate::model::body::Shape;
pub use crate::model::contact::{Equations, Normals};
pub use crate::model::mesh::Face;
pub use device::{DeviceKind, DeviceProfile, DeviceSpec};
pub use device_fault::{FaultKind, FaultSpec};
pub(crate) use devices::{MAX_DEVICES, field as device_field, numbered};
pub use haply::HaplySpec;
pub use models::{
    BasisSize, BlendKind, BlendSpec, Feedback, GlobalSpec, LocalModelKind, LocalSpec, Prediction, StepKind,
};
pub use region::RegionSpec;
pub use safety::{SafetySpec, SafetyStage};
pub(crate) use validate::patch_fits;

/// Everything a run needs to know.
#[derive(Clone, Debug, PartialEq, serde::Deserialize, serde::Serialize)]
#[serde(deny_unknown_fields)]
pub struct Scene {
    /// The soft body; a scene file must have one, `None` stands for a program's own.
    pub body: Option<BodySpec>,
    /// How the tool touches it.
    #[serde(default)]
    pub contact: ContactSpec,
    /// The slow, detailed simulation.
    #[serde(default)]
    pub global: GlobalSpec,
    /// The fast, small one.
    #[serde(default)]
    pub local: LocalSpec,
    /// What moves a tool and feels its force: one device, or several with names.
    #[serde(rename = "device", with = "devices::one_or_many", default = "one_device")]
    pub devices: Vec<DeviceSpec>,
    /// Limits on what reaches the device.
    #[serde(default)]
    pub safety: SafetySpec,
    /// A deformed state to start from; at rest if absent.
    #[serde(default)]
    pub initial: Option<InitialSpec>,
    /// Nodes whose position is logged every tick.
    #[serde(default, rename = "probe")]
    pub probes: Vec<ProbeSpec>,
    /// What the log has beside the records.
    #[serde(default)]
    pub log: LogSpec,
    /// How long.
    #[serde(default)]
    pub run: RunSpec,
    /// The file that the scene was read from, as text; it is attached to the log.
    #[serde(skip)]
    pub source: Option<String>,
}

/// A static equilibrium to start from, at rest, released at t = 0.
#[derive(Clone, Debug, PartialEq, serde::Deserialize, serde::Serialize)]
#[serde(deny_unknown_fields)]
pub struct InitialSpec {
    /// The node that is pulled.
    pub pull: PullSpec,
    /// Nodes held at their rest position while the equilibrium is found.
    #[serde(default)]
    pub hold: Vec<[usize; 3]>,
}

/// One pulled node.
#[derive(Clone, Copy, Debug, PartialEq, serde::Deserialize, serde::Serialize)]
#[serde(deny_unknown_fields)]
pub struct PullSpec {
    /// Which.
    pub node: [usize; 3],
    /// From its rest position (m).
    pub offset_m: [f64; 3],
}

/// One probed node.
#[derive(Clone, Copy, Debug, PartialEq, Eq, serde::Deserialize, serde::Serialize)]
#[serde(deny_unknown_fields)]
pub struct ProbeSpec {
    /// Which.
    pub node: [usize; 3],
}

/// What a log has beside the records of every tick.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, serde::Deserialize, serde::Serialize)]
#[serde(deny_unknown_fields, default)]
pub struct LogSpec {
    /// The topic `/scene`: surface, tools and forces for viewers, 30 times a second.
    pub scene: bool,
}

/// How long a run lasts.
#[derive(Clone, Copy, Debug, PartialEq, serde::Deserialize, serde::Serialize)]
#[serde(deny_unknown_fields, default)]
pub struct RunSpec {
    /// Simulated time (s).
    pub duration_s: f64,
}

impl Default for RunSpec {
    fn default() -> Self {
        Self { duration_s: 5.0 }
    }
}

/// A scene that names no device has one, for a program to replace.
fn one_device() -> Vec<DeviceSpec> {
    vec![DeviceSpec::default()]
}

impl Scene {
    /// The defaults around a program's own body: default rates, frictionless, `auto`, nothing moves the tool yet.
    pub fn of_program() -> Self {
        Self {
            body: None,
            contact: ContactSpec::default(),
            global: GlobalSpec::default(),
            local: LocalSpec::default(),
            devices: one_device(),
            safety: SafetySpec::default(),
            initial: None,
            probes: Vec::new(),
            log: LogSpec::default(),
            run: RunSpec::default(),
            source: None,
        }
    }

    /// Refuses what cannot work, naming the field and what would be right.
    ///
    /// # Errors
    /// [`ErrorKind::Scene`](crate::error::ErrorKind::Scene), with the field's dotted path as its place.
    pub fn validate(&self) -> Result<(), Error> {
        validate::validate(self)
    }

    /// The same scene with another local model, without a feedback and a step that the model, or one that `auto` may choose,
    /// cannot have.
    #[must_use]
    pub fn with_model(mut self, model: impl Into<ModelChoice>) -> Self {
        let model = model.into();
        if !self.local.feedback.is_none_or(|feedback| model.all(|kind| feedback.fits(kind))) {
            self.local.feedback = None;
        }
        if self.local.step == StepKind::Implicit && !model.all(LocalModelKind::is_linear) {
            self.local.step = StepKind::Auto;
        }
        self.local.model = model;
        self
    }
}
