//! The tool's part of a scene: what moves it and what limits its force.

use std::path::PathBuf;

use super::{FaultSpec, HaplySpec, ToolPath};
use crate::devices::{Capabilities, HandSpec, PlantSpec};

/// What moves the tool.
#[derive(Clone, Debug, Default, PartialEq, serde::Deserialize, serde::Serialize)]
#[serde(deny_unknown_fields, default)]
pub struct DeviceSpec {
    /// Its name: each of several devices has one.
    pub name: Option<String>,
    /// The kind of device.
    pub kind: DeviceKind,
    /// A CSV file `t_s,x_m,y_m,z_m`, relative to the scene file: where the tool goes, or where the hand wants to be.
    pub path_csv: Option<PathBuf>,
    /// The log whose device is replayed; in a scene file relative to that.
    pub log: Option<PathBuf>,
    /// The tool is glued to this node.
    pub attach_node: Option<[usize; 3]>,
    /// Whose limits it has.
    #[serde(skip_serializing_if = "is_default")]
    pub profile: DeviceProfile,
    /// The simulated device (`hand`).
    #[serde(skip_serializing_if = "is_default")]
    pub plant: PlantSpec,
    /// The simulated hand (`hand`).
    #[serde(skip_serializing_if = "is_default")]
    pub hand: HandSpec,
    /// How it fails, and when.
    #[serde(rename = "fault", skip_serializing_if = "is_default")]
    pub faults: Vec<FaultSpec>,
    /// The service of a `haply` device.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub haply: Option<HaplySpec>,
    /// The path itself: read from `path_csv`, or given by a program.
    #[serde(skip)]
    pub path: Option<ToolPath>,
}

/// What a scene leaves as it is need not be in its log.
fn is_default<T: Default + PartialEq>(value: &T) -> bool {
    *value == T::default()
}

/// The devices that a scene file can name.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, serde::Deserialize, serde::Serialize)]
#[serde(rename_all = "snake_case")]
pub enum DeviceKind {
    /// A tool that follows a path and ignores the force.
    #[default]
    Scripted,
    /// A simulated device in a simulated hand, which feels the force and gives way to it.
    Hand,
    /// A tool that moves as in a log and ignores the force.
    Replay,
    /// An Inverse3 behind the Haply Inverse service; needs feature `haply`.
    Haply,
}

/// The devices whose limits are known; see [`Capabilities`].
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, serde::Deserialize, serde::Serialize)]
#[serde(rename_all = "snake_case")]
pub enum DeviceProfile {
    /// The paper's.
    #[default]
    PhantomPremium,
    /// Touch, earlier Omni.
    Touch,
    /// Touch X, earlier Desktop.
    TouchX,
    /// Novint Falcon.
    Falcon,
    /// Force Dimension omega.3.
    #[serde(rename = "omega_3")]
    Omega3,
}

impl DeviceProfile {
    /// What such a device can do.
    pub fn capabilities(self) -> Capabilities {
        match self {
            Self::PhantomPremium => Capabilities::PHANTOM_PREMIUM,
            Self::Touch => Capabilities::TOUCH,
            Self::TouchX => Capabilities::TOUCH_X,
            Self::Falcon => Capabilities::FALCON,
            Self::Omega3 => Capabilities::OMEGA_3,
        }
    }
}
