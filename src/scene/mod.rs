//! What is simulated: one plain description that the builder and scene files both fill.
//!
//! SI units, the unit in every name. [`Scene::validate`] is the one place that decides whether a scene can work;
//! reading a file adds the file and line to its errors and nothing else.
//!
//! ```
//! use palpate::scene::Scene;
//!
//! let scene = Scene::demo();
//! assert_eq!(scene.global.rate_hz, 30.0);
//! assert!(scene.validate().is_ok());
//! ```

mod body;
mod built_in;
mod contact;
mod description;
mod device;
mod file;
mod haply;
mod link;
mod models;
mod node;
mod nodes;
mod patch;
mod safety;
mod sizes;
mod tool;
mod validate;

pub use body::{
    BlockSpec, BodyKind, BodySpec, MassSpringSpec, MaterialSpec, RegionSpec, TetrahedraSpec, TissueRegionSpec,
    TissueSpec, Volume,
};
pub use built_in::BuiltIn;
pub use contact::{ContactSpec, FrictionSpec};
pub use description::{InitialSpec, LogSpec, ProbeSpec, PullSpec, RunSpec, Scene};
pub use device::{DeviceKind, DeviceProfile, DeviceSpec};
pub(crate) use device::{field as device_field, numbered};
pub use haply::HaplySpec;
pub use link::LinkSpec;
pub use models::{BlendSpec, GlobalSpec, LocalSpec, ModelChoice, StepKind};
pub use node::NodeSpec;
pub(crate) use nodes::Nodes;
pub use safety::{SafetySpec, SafetyStage};
pub(crate) use sizes::Sizes;
pub use tool::ToolSpec;
pub(crate) use validate::MAX_DEVICES;
