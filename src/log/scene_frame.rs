//! What can be seen at one moment: the surface of the body, the tools and the forces on them.

use std::sync::Arc;

use crate::runtime::Nanos;

/// One picture of a run, for the topic `/scene`.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct SceneFrame {
    /// When: the log time of the message.
    pub time: Nanos,
    /// The time that the surface belongs to: the last tool sample that the global model had taken.
    pub surface_time: Nanos,
    /// Three indices into [`points`](Self::points) for each triangle, counter-clockwise seen from outside.
    pub triangles: Arc<[[u32; 3]]>,
    /// The surface (m).
    pub points: Vec<[f64; 3]>,
    /// Diameter of a drawn tool (m). The tool itself is a point.
    pub tool_size_m: f64,
    /// Every tool.
    pub tools: Vec<SceneTool>,
}

/// A tool and the force on it.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct SceneTool {
    /// What the ids of its entities begin with: the device's name and a slash, or nothing if there is one device.
    pub prefix: String,
    /// The time of position and force.
    pub time: Nanos,
    /// Where the device is (m).
    pub position_m: [f64; 3],
    /// On the tool, before the safety pipeline (N).
    pub force_n: [f64; 3],
}

impl SceneFrame {
    /// Messages per second.
    pub const RATE_HZ: u32 = 30;
    /// Length of a drawn force (m/N).
    pub const FORCE_SCALE_M_PER_N: f64 = 0.02;
}
