//! What can be seen at one moment: the surface of the body, the tools and the forces on them.

use std::sync::Arc;

use super::ContactPointSample;
use crate::model::contact::ToolShape;
use crate::runtime::Nanos;

/// One picture of a run, for the topic `/scene`.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct SceneFrame {
    /// The log time of the message.
    pub time: Nanos,
    /// The time that the surface belongs to: the last tool sample that the global model had taken.
    pub surface_time: Nanos,
    /// Three indices into [`points`](Self::points) for each triangle, counter-clockwise seen from outside.
    pub triangles: Arc<[[u32; 3]]>,
    /// The corners of the surface (m).
    pub points: Vec<[f64; 3]>,
    /// The diameter of a drawn tool that is a point (m), and the measure of all arrows.
    pub tool_size_m: f64,
    /// The tools, one for each device.
    pub tools: Vec<SceneTool>,
}

/// A tool and the force on it.
#[derive(Clone, Debug, PartialEq)]
pub struct SceneTool {
    /// The beginning of the ids of its entities: the device's name and a slash, or nothing if there is one device.
    pub prefix: String,
    /// The time of position and force.
    pub time: Nanos,
    /// The position of the device (m).
    pub position_m: [f64; 3],
    /// The turn from the tool's own axes to those of the world, a unit quaternion w, x, y, z.
    pub orientation: [f64; 4],
    /// The shape of the tool.
    pub shape: ToolShape,
    /// The force on the tool, before the safety pipeline (N).
    pub force_n: [f64; 3],
    /// The places at which a tool with a shape touches.
    pub contacts: Vec<ContactPointSample>,
}

impl Default for SceneTool {
    /// A point at the origin, not turned, that touches nothing.
    fn default() -> Self {
        Self {
            prefix: String::new(),
            time: Nanos::ZERO,
            position_m: [0.0; 3],
            orientation: [1.0, 0.0, 0.0, 0.0],
            shape: ToolShape::Point,
            force_n: [0.0; 3],
            contacts: Vec::new(),
        }
    }
}

impl SceneFrame {
    /// The number of messages per second (Hz).
    pub const RATE_HZ: u32 = 30;
    /// The length of a drawn force (m/N).
    pub const FORCE_SCALE_M_PER_N: f64 = 0.02;
}
