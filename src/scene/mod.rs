//! What is simulated: one plain description that the builder and scene files both fill.
//!
//! SI units, the unit in every name. [`Scene::validate`] is the one place that decides whether a scene can work;
//! reading a file adds the file and line to its errors and nothing else.

use crate::error::Error;

mod path;
mod validate;

#[cfg(feature = "scene")]
mod demo;
#[cfg(feature = "scene")]
mod file;
#[cfg(feature = "scene")]
mod locate;

pub use path::ToolPath;

/// Everything a run needs to know.
#[derive(Clone, Debug, PartialEq)]
#[cfg_attr(feature = "scene", derive(serde::Deserialize), serde(deny_unknown_fields))]
pub struct Scene {
    /// The soft body.
    pub body: BodySpec,
    /// How the tool touches it.
    #[cfg_attr(feature = "scene", serde(default))]
    pub contact: ContactSpec,
    /// The slow, detailed simulation.
    #[cfg_attr(feature = "scene", serde(default))]
    pub global: GlobalSpec,
    /// The fast, small one.
    #[cfg_attr(feature = "scene", serde(default))]
    pub local: LocalSpec,
    /// What moves the tool and feels the force.
    #[cfg_attr(feature = "scene", serde(default))]
    pub device: DeviceSpec,
    /// Limits on what reaches the device.
    #[cfg_attr(feature = "scene", serde(default))]
    pub safety: SafetySpec,
    /// A deformed state to start from; at rest if absent.
    #[cfg_attr(feature = "scene", serde(default))]
    pub initial: Option<InitialSpec>,
    /// Nodes whose position is logged every tick.
    #[cfg_attr(feature = "scene", serde(default, rename = "probe"))]
    pub probes: Vec<ProbeSpec>,
    /// How long.
    #[cfg_attr(feature = "scene", serde(default))]
    pub run: RunSpec,
    /// The file that the scene was read from, as text; it is attached to the log.
    #[cfg_attr(feature = "scene", serde(skip))]
    pub source: Option<String>,
}

/// A block of nodes joined by springs to all 26 neighbours.
#[derive(Clone, Debug, PartialEq)]
#[cfg_attr(feature = "scene", derive(serde::Deserialize), serde(deny_unknown_fields))]
pub struct BodySpec {
    /// The kind of body; `mass_spring` is the only one in scene files.
    #[cfg_attr(feature = "scene", serde(default))]
    pub kind: BodyKind,
    /// Its shape.
    pub block: BlockSpec,
    /// What it is made of.
    pub material: MaterialSpec,
}

/// The kinds of body that a scene file can name.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[cfg_attr(feature = "scene", derive(serde::Deserialize), serde(rename_all = "snake_case"))]
pub enum BodyKind {
    /// Point masses and springs.
    #[default]
    MassSpring,
}

/// A block's lattice.
#[derive(Clone, Debug, PartialEq)]
#[cfg_attr(feature = "scene", derive(serde::Deserialize), serde(deny_unknown_fields))]
pub struct BlockSpec {
    /// Nodes per axis, at least 2 each; node id = i + nx (j + ny k).
    pub nodes: [usize; 3],
    /// Edge lengths [m].
    pub size_m: [f64; 3],
    /// Faces held stationary.
    #[cfg_attr(feature = "scene", serde(default = "default_fixed"))]
    pub fixed: Vec<Face>,
}

/// A face of the block.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "scene", derive(serde::Deserialize), serde(rename_all = "snake_case"))]
#[allow(missing_docs)]
pub enum Face {
    XMin,
    XMax,
    YMin,
    YMax,
    ZMin,
    ZMax,
}

#[cfg(feature = "scene")]
fn default_fixed() -> Vec<Face> {
    vec![Face::ZMin]
}

/// One material for all springs and nodes.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "scene", derive(serde::Deserialize), serde(deny_unknown_fields))]
pub struct MaterialSpec {
    /// Mass of every node [kg].
    pub node_mass_kg: f64,
    /// Stiffness k of every spring [N/m].
    pub stiffness_n_per_m: f64,
    /// zeta in b = zeta sqrt(2 m k), the paper's definition.
    pub damping_ratio: f64,
}

/// How the tool touches the body.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[cfg_attr(feature = "scene", derive(serde::Deserialize), serde(deny_unknown_fields, default))]
pub struct ContactSpec {
    /// Coulomb friction.
    pub friction: Friction,
    /// Which normal a contact uses.
    pub normals: NormalKind,
    /// Which equations resolve it.
    pub equations: ContactEquations,
}

/// Coulomb friction.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Friction {
    /// The coefficient mu >= 0.
    Coefficient(f64),
    /// Unbounded: a touching tool sticks until it is pulled off.
    Stick,
}

impl Default for Friction {
    fn default() -> Self {
        Self::Coefficient(0.0)
    }
}

impl Friction {
    /// The coefficient; infinite for [`Friction::Stick`].
    pub fn coefficient(self) -> f64 {
        match self {
            Self::Coefficient(mu) => mu,
            Self::Stick => f64::INFINITY,
        }
    }
}

/// Which normal a contact uses.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[cfg_attr(feature = "scene", derive(serde::Deserialize), serde(rename_all = "snake_case"))]
pub enum NormalKind {
    /// Unit vertex normals interpolated over the triangle: continuous along the surface.
    #[default]
    Interpolated,
    /// The triangle's own normal, as printed in the paper.
    Face,
}

/// Which equations resolve the contact.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[cfg_attr(feature = "scene", derive(serde::Deserialize), serde(rename_all = "snake_case"))]
pub enum ContactEquations {
    /// Velocity level, mass-weighted.
    #[default]
    Corrected,
    /// The paper's printed equations (10) to (31), to show the difference.
    Paper,
}

/// The slow, detailed simulation.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "scene", derive(serde::Deserialize), serde(deny_unknown_fields, default))]
pub struct GlobalSpec {
    /// Releases per second.
    pub rate_hz: f64,
    /// Explicit steps per millisecond; chosen from the stability limit if absent.
    pub substeps_per_ms: Option<u32>,
    /// Virtual time: how long after its release a result becomes visible [ms].
    pub compute_latency_ms: f64,
}

impl Default for GlobalSpec {
    fn default() -> Self {
        Self { rate_hz: 30.0, substeps_per_ms: None, compute_latency_ms: 0.0 }
    }
}

/// The fast, small simulation.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "scene", derive(serde::Deserialize), serde(deny_unknown_fields, default))]
pub struct LocalSpec {
    /// Releases per second.
    pub rate_hz: f64,
    /// Which local model.
    pub model: LocalModelKind,
    /// Patch window: nodes along the surface, along it, into depth.
    pub patch: [usize; 3],
    /// What the global model learns from the local one.
    pub feedback: Option<Feedback>,
    /// How a resync's discontinuity is spread.
    pub blend: BlendSpec,
}

impl Default for LocalSpec {
    fn default() -> Self {
        Self {
            rate_hz: 1000.0,
            model: LocalModelKind::default(),
            patch: [4, 4, 2],
            feedback: None,
            blend: BlendSpec::default(),
        }
    }
}

/// The local models.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "scene", derive(serde::Deserialize), serde(rename_all = "snake_case"))]
pub enum LocalModelKind {
    /// The whole body at the haptic rate: the reference that the others are measured against.
    Full,
    /// The last force of the global model.
    Hold,
    /// The paper's: a linear patch in fixed surroundings.
    #[default]
    Patch,
}

impl LocalModelKind {
    /// Every model, in order of cost.
    pub const ALL: [Self; 3] = [Self::Hold, Self::Patch, Self::Full];

    /// Its name in scene files and tables.
    pub fn name(self) -> &'static str {
        match self {
            Self::Full => "full",
            Self::Hold => "hold",
            Self::Patch => "patch",
        }
    }
}

/// What the global model learns from the local one, besides the tool's trajectory.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "scene", derive(serde::Deserialize), serde(rename_all = "snake_case"))]
pub enum Feedback {
    /// Nothing: it resolves the contact along the tool's trajectory itself.
    Trajectory,
    /// The patch's positions, velocities and contact replace its own: the paper's.
    Geometry,
}

/// How a resync's discontinuity is spread over time.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[cfg_attr(feature = "scene", derive(serde::Deserialize), serde(deny_unknown_fields))]
pub struct BlendSpec {
    /// The way.
    pub kind: BlendKind,
    /// How long [ms]; not used by `none`.
    #[cfg_attr(feature = "scene", serde(default))]
    pub ms: f64,
}

/// The ways of blending.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[cfg_attr(feature = "scene", derive(serde::Deserialize), serde(rename_all = "snake_case"))]
pub enum BlendKind {
    /// The new model's force at once.
    #[default]
    None,
    /// Old and new model both run; the force moves linearly from one to the other.
    Crossfade,
}

/// What moves the tool.
#[derive(Clone, Debug, Default, PartialEq)]
#[cfg_attr(feature = "scene", derive(serde::Deserialize), serde(deny_unknown_fields, default))]
pub struct DeviceSpec {
    /// The kind of device.
    pub kind: DeviceKind,
    /// A CSV file `t_s,x_m,y_m,z_m`, relative to the scene file.
    pub path_csv: Option<std::path::PathBuf>,
    /// The tool is glued to this node.
    pub attach_node: Option<[usize; 3]>,
    /// The path itself: read from `path_csv`, or given by a program.
    #[cfg_attr(feature = "scene", serde(skip))]
    pub path: Option<ToolPath>,
}

/// The devices that a scene file can name.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[cfg_attr(feature = "scene", derive(serde::Deserialize), serde(rename_all = "snake_case"))]
pub enum DeviceKind {
    /// A tool that follows a path and ignores the force.
    #[default]
    Scripted,
}

/// Limits on what reaches the device.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "scene", derive(serde::Deserialize), serde(deny_unknown_fields, default))]
pub struct SafetySpec {
    /// Largest force [N]; the device's own limit if absent.
    pub max_force_n: Option<f64>,
    /// Largest change of the force [N/ms].
    pub max_slew_n_per_ms: f64,
}

impl Default for SafetySpec {
    fn default() -> Self {
        Self { max_force_n: None, max_slew_n_per_ms: 0.5 }
    }
}

/// A static equilibrium to start from, at rest, released at t = 0.
#[derive(Clone, Debug, PartialEq)]
#[cfg_attr(feature = "scene", derive(serde::Deserialize), serde(deny_unknown_fields))]
pub struct InitialSpec {
    /// The node that is pulled.
    pub pull: PullSpec,
    /// Nodes held at their rest position while the equilibrium is found.
    #[cfg_attr(feature = "scene", serde(default))]
    pub hold: Vec<[usize; 3]>,
}

/// One pulled node.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "scene", derive(serde::Deserialize), serde(deny_unknown_fields))]
pub struct PullSpec {
    /// Which.
    pub node: [usize; 3],
    /// From its rest position [m].
    pub offset_m: [f64; 3],
}

/// One probed node.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "scene", derive(serde::Deserialize), serde(deny_unknown_fields))]
pub struct ProbeSpec {
    /// Which.
    pub node: [usize; 3],
}

/// How long a run lasts.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "scene", derive(serde::Deserialize), serde(deny_unknown_fields, default))]
pub struct RunSpec {
    /// Simulated time [s].
    pub duration_s: f64,
}

impl Default for RunSpec {
    fn default() -> Self {
        Self { duration_s: 5.0 }
    }
}

impl Scene {
    /// Refuses what cannot work, naming the field and what would be right.
    ///
    /// # Errors
    /// [`ErrorKind::Scene`](crate::error::ErrorKind::Scene), with the field's dotted path as its place.
    pub fn validate(&self) -> Result<(), Error> {
        validate::validate(self)
    }
}
