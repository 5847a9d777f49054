//! The whole of a scene, as plain data.

use super::device::{DeviceSpec, one_or_many};
use super::patch::fitting_patch;
use super::{BodySpec, ContactSpec, GlobalSpec, LinkSpec, LocalSpec, ModelChoice, NodeSpec, SafetySpec, StepKind};
use crate::model::Vec3;
use crate::model::body::Body;
use crate::model::local::Kind;

/// Everything a run needs to know, as plain data that the builder and scene files both fill.
///
/// ```
/// use palpate::prelude::*;
///
/// # fn main() -> Result<(), Error> {
/// let mut scene = Scene::demo();
/// scene.run.duration_s = 0.05;
/// let summary = Session::from_scene(scene).virtual_time().build()?.run()?;
/// assert_eq!(summary.report.devices[0].force.ticks, 50);
/// # Ok(())
/// # }
/// ```
#[derive(Clone, Debug, PartialEq, serde::Deserialize, serde::Serialize)]
#[serde(deny_unknown_fields)]
pub struct Scene {
    /// The soft body; a scene file must have one, `None` stands for a program's own.
    pub body: Option<BodySpec>,
    /// The contact of the tools with the body.
    #[serde(default)]
    pub contact: ContactSpec,
    /// The global model: the slow, detailed simulation.
    #[serde(default)]
    pub global: GlobalSpec,
    /// The local model: the fast, small simulation around each tool.
    #[serde(default)]
    pub local: LocalSpec,
    /// The link between the two, if they are on two computers or as if they were; without, on one.
    #[serde(default)]
    pub link: Option<LinkSpec>,
    /// The devices, which move a tool and feel its force: one, or several with names.
    #[serde(rename = "device", with = "one_or_many", default = "one_device")]
    pub devices: Vec<DeviceSpec>,
    /// Limits on the forces that reach the devices.
    #[serde(default)]
    pub safety: SafetySpec,
    /// A deformed state that the run starts from; at rest if absent.
    #[serde(default)]
    pub initial: Option<InitialSpec>,
    /// Nodes whose position is logged every tick.
    #[serde(default, rename = "probe")]
    pub probes: Vec<ProbeSpec>,
    /// The log's contents beside the records of every tick.
    #[serde(default)]
    pub log: LogSpec,
    /// The length of the run.
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
    pub hold: Vec<NodeSpec>,
}

/// A node that is pulled from its rest position.
#[derive(Clone, Copy, Debug, PartialEq, serde::Deserialize, serde::Serialize)]
#[serde(deny_unknown_fields)]
pub struct PullSpec {
    /// The node.
    pub node: NodeSpec,
    /// Way of the node from its rest position (m).
    pub offset_m: [f64; 3],
}

/// A node whose position is logged every tick.
#[derive(Clone, Copy, Debug, PartialEq, serde::Deserialize, serde::Serialize)]
#[serde(deny_unknown_fields)]
pub struct ProbeSpec {
    /// The node.
    pub node: NodeSpec,
}

/// The contents of a log beside the records of every tick.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, serde::Deserialize, serde::Serialize)]
#[serde(deny_unknown_fields, default)]
pub struct LogSpec {
    /// True for the topic `/scene`: surface, tools and forces for viewers, 30 times a second.
    pub scene: bool,
}

/// The length of a run.
#[derive(Clone, Copy, Debug, PartialEq, serde::Deserialize, serde::Serialize)]
#[serde(deny_unknown_fields, default)]
pub struct RunSpec {
    /// Simulated time (s).
    pub duration_s: f64,
    /// True if the local model can be changed while it runs.
    pub switchable: bool,
}

impl Default for RunSpec {
    fn default() -> Self {
        Self { duration_s: 5.0, switchable: false }
    }
}

/// A scene that names no device has one, for a program to replace.
fn one_device() -> Vec<DeviceSpec> {
    vec![DeviceSpec::default()]
}

impl Scene {
    /// A scene around a program's own body: default rates, frictionless, `auto`, nothing moves the tool yet.
    pub fn of_program() -> Self {
        Self {
            body: None,
            contact: ContactSpec::default(),
            global: GlobalSpec::default(),
            local: LocalSpec::default(),
            link: None,
            devices: one_device(),
            safety: SafetySpec::default(),
            initial: None,
            probes: Vec::new(),
            log: LogSpec::default(),
            run: RunSpec::default(),
            source: None,
        }
    }

    /// Changes the local model, and takes out a feedback and a step that the model, or one that `auto` may choose,
    /// cannot have.
    #[must_use]
    pub fn with_model(mut self, model: impl Into<ModelChoice>) -> Self {
        let model = model.into();
        if !self.local.feedback.is_none_or(|feedback| model.all(|kind| feedback.fits(kind))) {
            self.local.feedback = None;
        }
        if self.local.step == StepKind::Implicit && !model.all(Kind::is_linear) {
            self.local.step = StepKind::Auto;
        }
        self.local.model = model;
        self
    }

    /// The patch window that was asked for, or the usual one: 6 x 6 x 3 for `predictive` and `predicted`, 4 x 4 x 3 if the body is of
    /// tetrahedra, whose nodes have more neighbours, or what does for the error budget of `predictive`, as far as a block has room for
    /// it; 4 x 4 x 2, the paper's, for the other models.
    pub fn patch_size(&self) -> [usize; 3] {
        let kind = self.local.model.named();
        let looks_ahead = matches!(kind, Some(Kind::Predicted | Kind::Predictive));
        let budget = self.local.budget().filter(|_| kind == Some(Kind::Predictive));
        let of_budget = budget.and_then(|(_, sizes)| sizes.patch);
        self.local.patch.unwrap_or_else(|| match &self.body {
            _ if !looks_ahead => [4, 4, 2],
            Some(BodySpec::MassSpring(spec)) => fitting_patch(of_budget.unwrap_or([6, 6, 3]), &spec.block),
            Some(BodySpec::Tetrahedra(_)) => of_budget.unwrap_or([4, 4, 3]),
            None => of_budget.unwrap_or([6, 6, 3]),
        })
    }

    /// The node of the surface of `body` that the first tool's path comes to first, within the body's extents; the middle of the
    /// top if it does not come there. `None` if nothing of the surface can move.
    pub fn first_touched(&self, body: &dyn Body) -> Option<u32> {
        let rest = body.rest();
        let extents = |by: fn(&Vec3, &Vec3) -> Vec3| rest.iter().copied().reduce(|a, b| by(&a, &b));
        let (low, high) = (extents(Vec3::inf)?, extents(Vec3::sup)?);
        let is_inside = |x: &&[f64; 3]| (0..3).all(|axis| (low[axis]..=high[axis]).contains(&x[axis]));
        let path = self.devices.first().and_then(|device| device.path.as_ref());
        let touched = path.and_then(|path| path.positions_m().iter().find(is_inside)).map(|&x| Vec3::from(x));
        let middle = 0.5 * (low + high);
        let point = touched.unwrap_or(Vec3::new(middle.x, middle.y, high.z));
        let is_movable = |node: &u32| body.surface().has_node(*node) && body.inverse_masses()[*node as usize] > 0.0;
        let distance = |node: &u32| (rest[*node as usize] - point).norm_squared();
        (0..rest.len() as u32).filter(is_movable).min_by(|a, b| distance(a).total_cmp(&distance(b)))
    }
}
