//! The tool's part of a scene: what moves it and what limits its force.

use std::path::PathBuf;

use super::{HaplySpec, NodeSpec, ToolSpec};
use crate::devices::{Capabilities, FaultSpec, HandSpec, PlantSpec, PointerSpec, ToolPath};
use crate::error::Error;

/// A device of a scene: what moves the tool, and what limits its force.
#[derive(Clone, Debug, Default, PartialEq, serde::Deserialize, serde::Serialize)]
#[serde(deny_unknown_fields, default)]
pub struct DeviceSpec {
    /// Name of the device: each of several has one.
    pub name: Option<String>,
    /// The kind of device.
    pub kind: DeviceKind,
    /// A CSV file `t_s,x_m,y_m,z_m`, with `,qw,qx,qy,qz` for a tool that turns, relative to the scene file: where the tool goes, or
    /// where the hand wants to be.
    pub path_csv: Option<PathBuf>,
    /// The log whose device is replayed; in a scene file relative to that.
    pub log: Option<PathBuf>,
    /// The node of the surface that the tool is glued to.
    pub attach_node: Option<NodeSpec>,
    /// The shape of the tool. One that is glued to a node is glued by its centre, and nothing else of it touches.
    #[serde(skip_serializing_if = "is_default")]
    pub tool: ToolSpec,
    /// The product whose limits the device has.
    #[serde(skip_serializing_if = "is_default")]
    pub profile: DeviceProfile,
    /// The simulated device (`hand`).
    #[serde(skip_serializing_if = "is_default")]
    pub plant: PlantSpec,
    /// The simulated hand (`hand`).
    #[serde(skip_serializing_if = "is_default")]
    pub hand: HandSpec,
    /// The tool behind a pointer (`pointer`).
    #[serde(skip_serializing_if = "is_default")]
    pub pointer: PointerSpec,
    /// Faults of the device, with their times.
    #[serde(rename = "fault", skip_serializing_if = "is_default")]
    pub faults: Vec<FaultSpec>,
    /// The service of a `haply` device.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub haply: Option<HaplySpec>,
    /// The path itself: read from `path_csv`, or given by a program.
    #[serde(skip)]
    pub path: Option<ToolPath>,
}

impl DeviceSpec {
    /// What the device says that it can do; of a program's own, what its profile says.
    pub(crate) fn capabilities(&self) -> Capabilities {
        let of_profile = self.profile.capabilities();
        match (self.kind, &self.haply) {
            (DeviceKind::Hand, _) => self.plant.capabilities(of_profile),
            (DeviceKind::Pointer, _) => self.pointer.capabilities(of_profile),
            (DeviceKind::Haply, Some(haply)) => Capabilities::of_force(haply.max_force_n),
            _ => of_profile,
        }
    }
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
    /// A tool on a spring behind a pointer, which a program moves: a mouse, a finger, a pen.
    Pointer,
    /// An Inverse3 behind the Haply Inverse service; the crate `palpate-haply` opens it.
    Haply,
}

/// The devices whose limits are known; see [`Capabilities`].
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, serde::Deserialize, serde::Serialize)]
#[serde(rename_all = "snake_case")]
pub enum DeviceProfile {
    /// Phantom Premium 1.5, the paper's device.
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
    /// The capabilities of such a device.
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

/// `error` about `device`, which is the `index`-th of `devices`: with its number if there are several.
pub(crate) fn numbered(error: Error, index: usize, devices: &[DeviceSpec]) -> Error {
    error.with_place_of("device", &field(index, devices.len()))
}

/// Where the `index`-th of `count` devices stands in a scene: its number is given if there are several.
pub(crate) fn field(index: usize, count: usize) -> String {
    if count < 2 { "device".to_owned() } else { format!("device[{index}]") }
}

/// One table `[device]`, or several `[[device]]`.
pub(super) mod one_or_many {
    use serde::de::value::MapAccessDeserializer;
    use serde::de::{Deserialize, Deserializer, MapAccess, SeqAccess, Visitor};
    use serde::ser::{Serialize, Serializer};

    use super::DeviceSpec;

    pub(crate) fn serialize<S: Serializer>(devices: &[DeviceSpec], to: S) -> Result<S::Ok, S::Error> {
        match devices {
            [one] => one.serialize(to),
            many => many.serialize(to),
        }
    }

    pub(crate) fn deserialize<'de, D: Deserializer<'de>>(from: D) -> Result<Vec<DeviceSpec>, D::Error> {
        struct OneOrMany;

        impl<'de> Visitor<'de> for OneOrMany {
            type Value = Vec<DeviceSpec>;

            fn expecting(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
                f.write_str("a table [device], or several [[device]]")
            }

            fn visit_map<A: MapAccess<'de>>(self, map: A) -> Result<Self::Value, A::Error> {
                Ok(vec![DeviceSpec::deserialize(MapAccessDeserializer::new(map))?])
            }

            fn visit_seq<A: SeqAccess<'de>>(self, mut items: A) -> Result<Self::Value, A::Error> {
                let mut devices = Vec::new();
                while let Some(device) = items.next_element()? {
                    devices.push(device);
                }
                Ok(devices)
            }
        }

        from.deserialize_any(OneOrMany)
    }
}
