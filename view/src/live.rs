//! A session that runs, as pictures and samples for browsers. On a thread of its own, 60 times a second.

use std::sync::Arc;
use std::time::{Duration, Instant};

use bytes::Bytes;
use palpate::Error;
use palpate::log::{ContactSample, Environment, LogRecord, SceneFrame, SceneTool};
use palpate::model::contact::ToolShape;
use palpate::model::wxyz;
use palpate::runtime::Nanos;
use palpate::session::{Controls, Running, SharedRecords, ToolView, Viewer};
use serde_json::{Value, json};

use crate::client::Picture;
use crate::frames::{self, Topology, Touch};
use crate::hub::{Begun, Hub, locked};
use crate::samples::Rows;
use crate::subject::known;
use crate::tuning;
use crate::wish::Change;

/// Pictures per second.
pub(crate) const PERIOD: Duration = Duration::from_micros(16_667);
/// How far from the body a pointer may go, in its largest extent.
const ROOM: f64 = 1.0;
/// Stress is computed a tenth of the time at most, however large the body: pictures between have that of one before.
const STRESS_SHARE: u32 = 10;
/// A tool that is a point is drawn so wide, in the largest extent of the body.
const POINT: f64 = 0.04;

/// A session and what is shown of it.
pub(crate) struct Live {
    pub(crate) running: Running,
    viewer: Option<Viewer>,
    records: Option<SharedRecords>,
    controls: Option<Controls>,
    environment: Environment,
    topology: Topology,
    /// Its triangles, for pictures of a log.
    triangles: Arc<[[u32; 3]]>,
    /// The positions at the start (m), of the surface's nodes.
    first: Vec<[f64; 3]>,
    /// The newest positions (m).
    points: Vec<[f64; 3]>,
    /// The time of the newest surface that was sent.
    surface: Option<Nanos>,
    /// The newest stress (Pa) at the surface's nodes, and when it may be computed again.
    stress: Vec<f64>,
    next_stress: Instant,
    rows: Rows,
    touches: Vec<(Nanos, Touch)>,
    told: Instant,
}

impl Live {
    /// Takes over a session that was just started.
    pub(crate) fn new(mut running: Running) -> Self {
        let (records, environment) = known(&mut running);
        let mut viewer = running.take_viewer();
        let topology = Topology::of(&viewer.as_ref().map(Viewer::triangles).unwrap_or_default());
        let first = viewer.as_mut().map_or(Vec::new(), |viewer| topology.points(&viewer.surface().positions).collect());
        let (rows, touches, told) = (Rows::default(), Vec::new(), Instant::now());
        let (points, surface, triangles) = (first.clone(), None, topology.triangles.as_slice().into());
        let (controls, stress, next_stress) = (running.take_controls(), Vec::new(), told);
        Self {
            running,
            viewer,
            records,
            controls,
            environment,
            topology,
            triangles,
            first,
            points,
            surface,
            stress,
            next_stress,
            rows,
            touches,
            told,
        }
    }

    /// True if it can be changed like that while it runs.
    pub(crate) fn reaches(&self, change: &Change) -> bool {
        let can_be = |name: &str| {
            let models = self.controls.as_ref().map_or(&[][..], Controls::models);
            tuning::kind(name).is_some_and(|kind| models.contains(&kind))
        };
        change.model.as_deref().is_none_or(can_be)
    }

    /// Changes it while it runs.
    ///
    /// # Errors
    /// Of the first thing that cannot be.
    pub(crate) fn change(&mut self, change: &Change) -> Result<(), Error> {
        self.controls.as_ref().map_or(Ok(()), |controls| tuning::apply(controls, change))
    }

    /// What can be changed, as it is now.
    pub(crate) fn settings(&self) -> Value {
        self.controls.as_ref().map_or(Value::Null, tuning::settings)
    }

    /// What is told of it to everybody; `about` is what the subject knows.
    pub(crate) fn begin(&mut self, hub: &Hub, about: Value) {
        let extent = |axis: usize| {
            let along = self.first.iter().map(|point| point[axis]);
            along.fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], c| [low.min(c), high.max(c)])
        };
        let extents = [extent(0), extent(1), extent(2)];
        let size = extents.iter().map(|[low, high]| high - low).fold(0.0, f64::max);
        let tools = self.viewer.as_mut().map_or(0, |viewer| viewer.tools().count());
        let pointers: Vec<_> = (0..tools).map(|device| self.running.take_pointer(device)).collect();
        let homes: Vec<_> =
            pointers.iter().map(|pointer| pointer.as_ref().map_or([0.0; 3], |pointer| pointer.home())).collect();
        let corner = |side: usize, room: f64| -> [f64; 3] {
            std::array::from_fn(|axis| {
                let beyond = pointers.iter().flatten().map(|pointer| pointer.home()[axis]);
                let reach = match side {
                    0 => beyond.fold(extents[axis][0], f64::min),
                    _ => beyond.fold(extents[axis][1], f64::max),
                };
                reach + room
            })
        };
        let bounds = [corner(0, -ROOM * size), corner(1, ROOM * size)];
        let mut hello = json!({
            "kind": "hello",
            "mode": "live",
            "model": self.environment.model,
            "body": self.environment.body,
            "warning": self.environment.model_reason.as_ref().and_then(|reason| reason.warning.as_ref()),
            "haptic_hz": self.environment.haptic_hz,
            "global_hz": self.environment.global_hz,
            "stages": self.environment.limit_stages,
            "has_samples": self.records.is_some(),
            "has_stress": self.viewer.as_ref().is_some_and(Viewer::knows_stress),
            "settings": self.settings(),
            "bounds": bounds,
            "tools": (0..tools).map(|device| json!({
                "name": self.environment.devices.get(device),
                "shape": shape(self.environment.shape(device as u16)),
                "pointer": pointers[device].is_some(),
                "home": homes[device],
            })).collect::<Vec<_>>(),
        });
        if let (Some(hello), Value::Object(about)) = (hello.as_object_mut(), about) {
            hello.extend(about);
        }
        let topology = self.topology.bytes(self.first.iter().copied());
        let mut recent = locked(&hub.recent);
        recent.begin();
        recent.set_environment(self.environment.clone());
        drop(recent);
        hub.begin(Begun { hello, topology, pointers, homes, bounds });
    }

    /// Shows what is new.
    pub(crate) fn publish(&mut self, hub: &Hub) {
        self.take_records(hub);
        let Some(viewer) = &mut self.viewer else { return };
        let tools: Vec<ToolView> = viewer.tools().collect();
        let surface = viewer.surface();
        let time = surface.time;
        if self.surface != Some(time) {
            self.surface = Some(time);
            self.points.clear();
            self.points.extend(self.topology.points(&surface.positions));
            if hub.shows_stress() && Instant::now() >= self.next_stress {
                let begun = Instant::now();
                viewer.stress(&self.topology.nodes, &mut self.stress);
                self.next_stress = begun + STRESS_SHARE * begun.elapsed();
            } else if !hub.shows_stress() {
                self.stress.clear();
            }
            let points = self.points.iter().copied();
            hub.show(Picture::Surface, &frames::surface(time.as_secs_f64(), points, &self.stress));
            self.remember(hub, time, &tools);
        }
        let touches: Vec<Touch> = self.touches.iter().map(|(_, touch)| *touch).collect();
        hub.show(Picture::Tools, &frames::tools(time.as_secs_f64(), &tools, &hub.targets(), &touches));
        if self.told.elapsed() >= Duration::from_secs(1) {
            self.told = Instant::now();
            self.tell(hub);
        }
    }

    fn take_records(&mut self, hub: &Hub) {
        let Some(records) = &mut self.records else { return };
        let mut recent = locked(&hub.recent);
        if let Some(environment) = records.environment() {
            recent.set_environment(environment);
        }
        for record in records.newest() {
            self.rows.push(&record);
            touch(&mut self.touches, &record, &self.points, &self.topology);
            recent.push(record);
        }
        drop(recent);
        self.rows.take().iter().for_each(|block: &Bytes| hub.plot(block));
    }

    /// Keeps a picture for the log of what was just felt.
    fn remember(&self, hub: &Hub, time: Nanos, tools: &[ToolView]) {
        if self.records.is_none() {
            return;
        }
        let size = |axis: usize| {
            let along = || self.first.iter().map(|point| point[axis]);
            along().fold(f64::NEG_INFINITY, f64::max) - along().fold(f64::INFINITY, f64::min)
        };
        let frame = SceneFrame {
            time,
            surface_time: time,
            triangles: Arc::clone(&self.triangles),
            points: self.points.clone(),
            tool_size_m: POINT * (0..3).map(size).fold(0.0, f64::max),
            tools: (0..).zip(tools).map(|(number, tool)| self.scene_tool(number, tool)).collect(),
        };
        locked(&hub.recent).push_frame(frame);
    }

    fn scene_tool(&self, number: u16, tool: &ToolView) -> SceneTool {
        SceneTool {
            prefix: match self.environment.devices.get(usize::from(number)) {
                Some(name) => format!("{name}/"),
                None => String::new(),
            },
            time: tool.time,
            position_m: tool.position.into(),
            orientation: wxyz(&tool.orientation),
            shape: self.environment.shape(number),
            force_n: tool.computed_force.into(),
            contacts: Vec::new(),
        }
    }

    /// Counts and percentiles of every group.
    fn tell(&self, hub: &Hub) {
        let us = |time: Nanos| 1e-3 * time.0 as f64;
        let groups: Vec<Value> = self
            .running
            .live()
            .iter()
            .map(|group| {
                let figures = |times: &palpate::runtime::Histogram| {
                    json!({ "p50": us(times.percentile(0.5)), "p99": us(times.percentile(0.99)), "max": us(times.max()) })
                };
                json!({
                    "name": group.name,
                    "released": group.released,
                    "skipped": group.skipped,
                    "missed": group.missed,
                    "lateness_us": figures(&group.lateness),
                    "execution_us": figures(&group.execution),
                })
            })
            .collect();
        let ended = self.running.finished();
        hub.say(&json!({ "kind": "stats", "groups": groups, "ended": ended }));
    }
}

/// The shape of a tool as the page draws it.
pub(crate) fn shape(shape: ToolShape) -> Value {
    match shape {
        ToolShape::Point => json!({ "kind": "point" }),
        ToolShape::Sphere { radius } => json!({ "kind": "sphere", "radius": radius }),
        ToolShape::Capsule { radius, half_axis } => {
            json!({ "kind": "capsule", "radius": radius, "half_axis": <[f64; 3]>::from(half_axis) })
        }
    }
}

/// Notes where tools touch in the newest tick: a point where its contact is, a tool with a shape at each of its places.
fn touch(touches: &mut Vec<(Nanos, Touch)>, record: &LogRecord, points: &[[f64; 3]], topology: &Topology) {
    match record {
        LogRecord::ContactPoint(point) => {
            touches.retain(|(time, touch)| touch.device != point.device || *time == point.time);
            let touch = Touch {
                place_m: point.place_m,
                force_n: point.force_n,
                triangle: point.triangle,
                device: point.device,
            };
            touches.push((point.time, touch));
        }
        LogRecord::Contact(contact) => {
            touches.retain(|(time, touch)| touch.device != contact.device || *time == contact.time);
            let has_places = touches.iter().any(|(_, touch)| touch.device == contact.device);
            let place = |corner: u32| points.get(corner as usize).copied().unwrap_or_default();
            if !has_places && let Some(touch) = of_point(contact, place, topology) {
                touches.push((contact.time, touch));
            }
        }
        _ => {}
    }
}

/// Where a tool that is a point touches a surface whose nodes are at these places (m).
pub(crate) fn of_point(contact: &ContactSample, node: impl Fn(u32) -> [f64; 3], topology: &Topology) -> Option<Touch> {
    let corners = topology.triangles.get(contact.triangle as usize).filter(|_| contact.normal_force_n > 0.0)?;
    let [u, v] = contact.weights;
    let weights = [1.0 - u - v, u, v];
    let place = |axis: usize| -> f64 {
        let parts = corners.iter().zip(weights);
        parts.map(|(&corner, weight)| weight * node(corner)[axis]).sum()
    };
    Some(Touch {
        place_m: std::array::from_fn(|axis| place(axis) as f32),
        force_n: contact.normal.map(|c| c * contact.normal_force_n),
        triangle: contact.triangle,
        device: contact.device,
    })
}
