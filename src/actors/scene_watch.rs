//! Takes the pictures of a run for the topic `/scene`.
//!
//! The surface comes through an outlet, as it does for a program that draws. Tools and forces come from the records that
//! are logged anyway: the haptic tick does nothing for a picture.

use std::collections::{BTreeMap, VecDeque};
use std::sync::Arc;

use super::messages::SurfaceView;
use crate::log::{Environment, LogRecord, SceneFrame, SceneTool, WaitingPoints};
use crate::model::mesh::Surface;
use crate::model::{Vec3, wxyz};
use crate::runtime::Nanos;
use crate::runtime::{OutletReader, TickContext};

/// Diameter of a drawn tool that is a point, in the largest extent of the body.
const TOOL_SIZE: f64 = 0.04;

/// Takes a picture per release of the logger.
///
/// # Real-time
/// Not real-time safe: allocates. It is the logger's; the surface's writer is never disturbed.
#[derive(Debug)]
pub struct SceneWatch {
    surface: OutletReader<SurfaceView>,
    /// The nodes that triangles name: the points of a picture, in this order.
    nodes: Vec<u32>,
    triangles: Arc<[[u32; 3]]>,
    tool_size_m: f64,
    /// By device, once there was a sample.
    tools: BTreeMap<u16, SceneTool>,
    points: WaitingPoints,
    /// With their surface, waiting for the tools' records of their time.
    taken: VecDeque<SceneFrame>,
}

impl SceneWatch {
    /// Watches the newest `surface` of a body that has this one.
    pub(crate) fn new(surface: OutletReader<SurfaceView>, of: &Surface) -> Self {
        let nodes = of.nodes();
        let point = |node: u32| nodes.binary_search(&node).map_or(0, |point| point as u32);
        let triangles = of.triangles.iter().map(|triangle| triangle.map(point)).collect();
        let tool_size_m = TOOL_SIZE * largest_extent(&surface.get().positions);
        Self {
            surface,
            nodes,
            triangles,
            tool_size_m,
            tools: BTreeMap::new(),
            points: WaitingPoints::default(),
            taken: VecDeque::new(),
        }
    }

    /// Takes the newest surface.
    pub(super) fn take(&mut self, ctx: &TickContext) {
        self.surface.refresh();
        let view = self.surface.get();
        let position = |&node: &u32| view.positions.get(node as usize).copied().unwrap_or_default().into();
        self.taken.push_back(SceneFrame {
            time: ctx.scheduled,
            surface_time: view.time,
            triangles: Arc::clone(&self.triangles),
            points: self.nodes.iter().map(position).collect(),
            tool_size_m: self.tool_size_m,
            tools: Vec::new(),
        });
    }

    /// Notes where a tool is and what it feels. Records come in the order of time.
    pub(super) fn see(&mut self, record: &LogRecord, environment: &Environment) {
        match record {
            LogRecord::Tool(sample) => {
                let tool = self.tools.entry(sample.device).or_insert_with(|| SceneTool {
                    prefix: match environment.device_prefix(sample.device).trim_start_matches('/') {
                        "" => String::new(),
                        name => format!("{name}/"),
                    },
                    shape: environment.shape(sample.device),
                    ..SceneTool::default()
                });
                (tool.time, tool.position_m) = (sample.time, sample.position_m);
                tool.orientation = wxyz(&sample.orientation);
            }
            LogRecord::Force(sample) => {
                self.tools.get_mut(&sample.device).into_iter().for_each(|tool| tool.force_n = sample.force_n);
            }
            LogRecord::ContactPoint(point) => self.points.add(*point),
            LogRecord::Contact(sample) => {
                let contacts = self.points.take(sample);
                if let Some(tool) = self.tools.get_mut(&sample.device) {
                    tool.contacts = contacts;
                }
            }
            _ => {}
        }
    }

    /// The next picture from before `time`, with the tools as they were: for when every record up to it has been seen.
    pub(super) fn due(&mut self, time: Nanos) -> Option<SceneFrame> {
        let mut frame = self.taken.pop_front_if(|frame| frame.time < time)?;
        frame.tools = self.tools.values().cloned().collect();
        Some(frame)
    }
}

fn largest_extent(positions: &[Vec3]) -> f64 {
    let extent = |axis: usize| {
        let along = || positions.iter().map(|position| position[axis]);
        along().fold(f64::NEG_INFINITY, f64::max) - along().fold(f64::INFINITY, f64::min)
    };
    (0..3).map(extent).fold(0.0, f64::max)
}
