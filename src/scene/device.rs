//! The tool's part of a scene: what moves it and what limits its force.

use super::ToolPath;

/// What moves the tool.
#[derive(Clone, Debug, Default, PartialEq)]
#[cfg_attr(feature = "scene", derive(serde::Deserialize, serde::Serialize), serde(deny_unknown_fields, default))]
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
#[cfg_attr(feature = "scene", derive(serde::Deserialize, serde::Serialize), serde(rename_all = "snake_case"))]
pub enum DeviceKind {
    /// A tool that follows a path and ignores the force.
    #[default]
    Scripted,
}
