//! What a log says about the run as a whole: who wrote it, on what, and what the system granted.

use std::collections::BTreeMap;
use std::sync::Arc;

use super::{MAX_DEVICES, ToolSample};
use crate::model::contact::ToolShape;
use crate::model::{Turn, Vec3, turn_of, wxyz};
use crate::runtime::GroupGrant;
use crate::runtime::Nanos;

/// The kind of time that a logged run was executed in.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum LoggedExecution {
    /// In simulated time, as fast as the machine allows: lateness is zero by construction.
    #[default]
    Virtual,
    /// On real threads.
    Threaded {
        /// The start of the run, in nanoseconds since the Unix epoch.
        start_unix_ns: u64,
    },
}

impl LoggedExecution {
    /// On real threads, which have run since this time by now.
    pub(crate) fn began(ago: Nanos) -> Self {
        let since_epoch = std::time::SystemTime::now().duration_since(std::time::UNIX_EPOCH).unwrap_or_default();
        let now = u64::try_from(since_epoch.as_nanos()).unwrap_or(u64::MAX);
        Self::Threaded { start_unix_ns: now.saturating_sub(ago.0) }
    }
}

/// A rate group, in the order that [`TickTiming::group`](crate::runtime::TickTiming::group) counts.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct GroupInfo {
    /// The name of the group; its topics are `/timing/NAME` and `/stats/NAME`.
    pub name: String,
    /// The number of releases per second (Hz).
    pub rate_hz: f64,
    /// True if its releases take as long as they take: no run is late for its sake.
    pub background: bool,
    /// The computing time that was declared for a release.
    pub budget: Option<Nanos>,
    /// The core that its thread is pinned to, once the system has granted it.
    pub cpu: Option<usize>,
    /// The names of its actors in the order of [`ActorTimes`](crate::runtime::ActorTimes); empty if there is one.
    pub actors: Vec<String>,
}

impl GroupInfo {
    /// A group with this name and rate (Hz); the rest is not known.
    pub fn new(name: impl Into<String>, rate_hz: f64) -> Self {
        Self { name: name.into(), rate_hz, ..Self::default() }
    }

    /// The name of actor `number`.
    pub fn actor_name(&self, number: usize) -> String {
        self.actors.get(number).cloned().unwrap_or_else(|| format!("actor {number}"))
    }
}

/// The reason for the local model of a run, if nobody named one.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct ModelReason {
    /// The costs and the error that decided, in one line.
    pub why: String,
    /// The shortcoming of the choice, if it has one.
    pub warning: Option<String>,
}

/// Everything about a run that is not a record.
///
/// ```
/// use palpate::log::{Environment, GroupInfo};
///
/// let environment = Environment { groups: vec![GroupInfo::new("haptic", 1000.0)], ..Environment::default() };
/// assert_eq!(environment.group_name(0), "haptic");
/// ```
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Environment {
    /// The version of palpate that wrote the log.
    pub palpate_version: String,
    /// The instruction set that the vector kernels used.
    pub instruction_set: String,
    /// The kind of time that the run was executed in.
    pub execution: LoggedExecution,
    /// The name of the local model.
    pub model: String,
    /// The reason for the local model if it was chosen, and for the size of its patch and basis if a budget said so; `None`
    /// otherwise.
    pub model_reason: Option<ModelReason>,
    /// The body in words: its size, what it is made of, and what was left out of its mesh; `None` in logs that do not say it.
    pub body: Option<String>,
    /// The tools in words: their shapes, and how coarse the body is against each; `None` if all are points.
    pub tools: Option<String>,
    /// The haptic rate (Hz).
    pub haptic_hz: f64,
    /// The rate of the global model (Hz).
    pub global_hz: f64,
    /// The rate groups.
    pub groups: Vec<GroupInfo>,
    /// The names of the devices, if there are several: the topics of each are `/NAME/force` and so on.
    pub devices: Vec<String>,
    /// The shapes of the tools, by device; empty if all are points.
    pub shapes: Vec<ToolShape>,
    /// The names of the bits in [`CommandSample::limits`](crate::log::CommandSample::limits), lowest first.
    pub limit_stages: Vec<String>,
    /// The names of the safety stages that the scene switched off.
    pub safety_off: Vec<String>,
    /// The energy that the scene stores at the start (J): where the ledger in
    /// [`CommandSample::energy_j`](crate::log::CommandSample::energy_j) begins.
    pub stored_j: f64,
    /// The gains of the virtual coupling and the margin that they leave; `None` without one.
    pub coupling: Option<String>,
    /// The grants of the system by name: policy, priority, cpu, mlock, ...
    pub granted: BTreeMap<String, String>,
    /// The first state that each device gave, before the start.
    pub first_tools: Vec<ToolSample>,
    /// The scene file as text. It travels as the attachment [`SCENE`](Self::SCENE); a reader leaves it empty.
    pub scene: Option<String>,
    /// The run as a scene file: the scene with everything that a program or the command line changed. It travels as
    /// the attachment [`SESSION`](Self::SESSION); a reader leaves it empty.
    pub session: Option<String>,
    /// The mesh of a body of tetrahedra: the file that it was read from, or one of Gmsh's. It travels as the attachment [`MESH`](Self::MESH); a
    /// reader leaves it empty.
    pub mesh: Option<Arc<[u8]>>,
}

impl Environment {
    /// The attachment that is the user's scene file.
    pub const SCENE: &str = "scene.toml";
    /// The attachment that says what was run.
    pub const SESSION: &str = "session.toml";

    /// The attachment that is the body's mesh.
    pub const MESH: &str = "mesh";

    /// The contents of an attachment, if they are known.
    pub fn attachment(&self, name: &str) -> Option<&[u8]> {
        match name {
            Self::SCENE => self.scene.as_deref().map(str::as_bytes),
            Self::SESSION => self.session.as_deref().map(str::as_bytes),
            Self::MESH => self.mesh.as_deref(),
            _ => None,
        }
    }

    /// The name of rate group `group`: its own, or `group-N` if the environment does not know it.
    pub fn group_name(&self, group: u16) -> String {
        match self.groups.get(usize::from(group)) {
            Some(info) => info.name.clone(),
            None => format!("group-{group}"),
        }
    }

    /// Notes which cores the groups were given.
    pub fn pin_groups(&mut self, granted: &[GroupGrant]) {
        for info in &mut self.groups {
            info.cpu = granted.iter().find(|grant| grant.name == info.name).and_then(|grant| grant.cpu);
        }
    }

    /// The beginning of the topics of device `device`: a slash and its name, or nothing if it is the only one.
    pub fn device_prefix(&self, device: u16) -> String {
        match self.devices.get(usize::from(device)) {
            Some(name) => format!("/{name}"),
            None if device == 0 => String::new(),
            None => format!("/device-{device}"),
        }
    }

    /// The shape of the tool of device `device`.
    pub fn shape(&self, device: u16) -> ToolShape {
        self.shapes.get(usize::from(device)).copied().unwrap_or_default()
    }

    /// The Unix time of the start (ns), which is added to the time of a record to give its log time.
    pub fn epoch_ns(&self) -> u64 {
        match self.execution {
            LoggedExecution::Virtual => 0,
            LoggedExecution::Threaded { start_unix_ns } => start_unix_ns,
        }
    }

    /// The environment as keys and values: the metadata record `environment` of a log.
    pub fn to_map(&self, schema_version: u32) -> BTreeMap<String, String> {
        let execution = match self.execution {
            LoggedExecution::Virtual => "virtual",
            LoggedExecution::Threaded { .. } => "threaded",
        };
        let mut map: BTreeMap<String, String> = [
            (SCHEMA_VERSION_KEY, schema_version.to_string()),
            ("palpate_version", self.palpate_version.clone()),
            ("instruction_set", self.instruction_set.clone()),
            ("execution", execution.to_owned()),
            ("start_unix_ns", self.epoch_ns().to_string()),
            ("model", self.model.clone()),
            ("haptic_hz", self.haptic_hz.to_string()),
            ("global_hz", self.global_hz.to_string()),
        ]
        .map(|(key, value)| (key.to_owned(), value))
        .into();
        map.extend(self.body.iter().map(|body| ("body".to_owned(), body.clone())));
        map.extend(self.tools.iter().map(|tools| ("tools".to_owned(), tools.clone())));
        if let Some(reason) = &self.model_reason {
            map.insert(MODEL_REASON.to_owned(), reason.why.clone());
            map.extend(reason.warning.iter().map(|warning| (MODEL_WARNING.to_owned(), warning.clone())));
        }
        for (i, group) in self.groups.iter().enumerate() {
            map.insert(format!("group.{i}.name"), group.name.clone());
            map.insert(format!("group.{i}.rate_hz"), group.rate_hz.to_string());
            map.insert(format!("group.{i}.background"), group.background.to_string());
            map.extend(group.budget.map(|budget| (format!("group.{i}.budget_ns"), budget.0.to_string())));
            map.extend(group.cpu.map(|cpu| (format!("group.{i}.cpu"), cpu.to_string())));
            map.extend(numbered(&format!("group.{i}.actor"), &group.actors));
        }
        map.extend(numbered("device", &self.devices));
        for (device, shape) in self.shapes.iter().enumerate() {
            map.extend(shape_entries(device, shape));
        }
        map.extend(numbered("limit_stage", &self.limit_stages));
        map.extend(numbered("safety_off", &self.safety_off));
        map.insert("stored_j".to_owned(), self.stored_j.to_string());
        map.extend(self.coupling.iter().map(|design| ("coupling".to_owned(), design.clone())));
        for (device, first) in self.first_tools.iter().enumerate() {
            let of = first_tool_key(device);
            map.insert(format!("{of}.position_m"), spaced(first.position_m));
            map.insert(format!("{of}.velocity_m_s"), spaced(first.velocity_m_s));
            map.insert(format!("{of}.buttons"), first.buttons.to_string());
            map.insert(format!("{of}.orientation"), spaced(wxyz(&first.orientation)));
        }
        map.extend(self.granted.iter().map(|(key, value)| (format!("granted.{key}"), value.clone())));
        map
    }

    /// Reads [`to_map`](Self::to_map) back. What is missing stays empty and what is unknown is left out, so that logs of
    /// older and newer versions can be read.
    pub fn from_map(map: &BTreeMap<String, String>) -> Self {
        let text = |key: &str| map.get(key).cloned().unwrap_or_default();
        let number = |key: &str| map.get(key).and_then(|value| value.parse::<f64>().ok()).unwrap_or(0.0);
        let listed =
            |key: &str| -> Vec<String> { (0..).map_while(|i| map.get(&format!("{key}.{i}")).cloned()).collect() };
        let execution = match text("execution").as_str() {
            "threaded" => LoggedExecution::Threaded { start_unix_ns: text("start_unix_ns").parse().unwrap_or(0) },
            _ => LoggedExecution::Virtual,
        };
        let groups = (0..)
            .map_while(|i| map.get(&format!("group.{i}.name")).map(|name| (i, name)))
            .take(MAX_GROUPS)
            .map(|(i, name)| GroupInfo {
                name: name.clone(),
                rate_hz: number(&format!("group.{i}.rate_hz")),
                background: text(&format!("group.{i}.background")) == "true",
                budget: text(&format!("group.{i}.budget_ns")).parse().ok().map(Nanos),
                cpu: text(&format!("group.{i}.cpu")).parse().ok(),
                actors: listed(&format!("group.{i}.actor")),
            })
            .collect();
        let granted = map
            .iter()
            .filter_map(|(key, value)| Some((key.strip_prefix("granted.")?.to_owned(), value.clone())))
            .collect();
        Self {
            palpate_version: text("palpate_version"),
            instruction_set: text("instruction_set"),
            execution,
            model: text("model"),
            model_reason: map
                .get(MODEL_REASON)
                .map(|why| ModelReason { why: why.clone(), warning: map.get(MODEL_WARNING).cloned() }),
            body: map.get("body").cloned(),
            tools: map.get("tools").cloned(),
            haptic_hz: number("haptic_hz"),
            global_hz: number("global_hz"),
            groups,
            devices: listed("device").into_iter().take(MAX_DEVICES.into()).collect(),
            shapes: (0..MAX_DEVICES.into()).map_while(|device| shape(map, device)).collect(),
            limit_stages: listed("limit_stage"),
            safety_off: listed("safety_off"),
            stored_j: number("stored_j"),
            coupling: map.get("coupling").cloned(),
            granted,
            first_tools: (0..).map_while(|device| first_tool(map, device)).collect(),
            scene: None,
            session: None,
            mesh: None,
        }
    }
}

/// Rate groups that are read of a log; no run has as many. A log of another program could name any number, and each has a
/// report.
pub(in crate::log) const MAX_GROUPS: usize = 1024;

/// The key of the schema's version.
pub(in crate::log) const SCHEMA_VERSION_KEY: &str = "schema_version";
/// A list as keys and values.
fn numbered(key: &str, list: &[String]) -> impl Iterator<Item = (String, String)> {
    list.iter().enumerate().map(move |(i, item)| (format!("{key}.{i}"), item.clone()))
}

/// The keys of a choice.
const MODEL_REASON: &str = "model_reason";
const MODEL_WARNING: &str = "model_warning";

/// Where the keys of a device's first state begin.
fn first_tool_key(device: usize) -> String {
    if device == 0 { "first_tool".to_owned() } else { format!("first_tool.{device}") }
}

/// A tool's shape as keys and values; the numbers are those of [`ToolShape`].
fn shape_entries(device: usize, shape: &ToolShape) -> Vec<(String, String)> {
    let name = match shape {
        ToolShape::Point => "point",
        ToolShape::Sphere { .. } => "sphere",
        ToolShape::Capsule { .. } => "capsule",
    };
    let mut entries = vec![("shape", name.to_owned())];
    if *shape != ToolShape::Point {
        entries.push(("radius_m", shape.radius().to_string()));
    }
    if let ToolShape::Capsule { half_axis, .. } = shape {
        entries.push(("half_axis_m", spaced((*half_axis).into())));
    }
    entries.into_iter().map(|(key, value)| (format!("tool.{device}.{key}"), value)).collect()
}

/// Reads [`shape_entries`] back; what cannot be read is a point.
fn shape(map: &BTreeMap<String, String>, device: usize) -> Option<ToolShape> {
    let text = |key: &str| map.get(&format!("tool.{device}.{key}"));
    let radius = || text("radius_m")?.parse().ok();
    let half_axis = || vector(text("half_axis_m")?).map(Vec3::from);
    let known = match text("shape")?.as_str() {
        "sphere" => radius().map(|radius| ToolShape::Sphere { radius }),
        "capsule" => radius().zip(half_axis()).map(|(radius, half_axis)| ToolShape::Capsule { radius, half_axis }),
        _ => None,
    };
    Some(known.unwrap_or_default())
}

/// Reads [`spaced`] back.
fn vector(text: &str) -> Option<[f64; 3]> {
    let numbers: Option<Vec<f64>> = text.split(' ').map(|number| number.parse().ok()).collect();
    numbers?.try_into().ok()
}

/// Numbers as text that reads back exactly.
fn spaced<const N: usize>(vector: [f64; N]) -> String {
    vector.map(|component| component.to_string()).join(" ")
}

fn first_tool(map: &BTreeMap<String, String>, device: usize) -> Option<ToolSample> {
    let of = first_tool_key(device);
    let text = |key: &str| map.get(&format!("{of}.{key}"));
    let vector = |key: &str| vector(text(key)?);
    let numbers = |key: &str| -> Option<Vec<f64>> { text(key)?.split(' ').map(|number| number.parse().ok()).collect() };
    // Logs before the third schema know no orientation.
    let turn = || -> Option<Turn> { Some(turn_of(numbers("orientation")?.try_into().ok()?)) };
    Some(ToolSample {
        position_m: vector("position_m")?,
        velocity_m_s: vector("velocity_m_s")?,
        buttons: text("buttons")?.parse().ok()?,
        orientation: turn().unwrap_or_default(),
        device: u16::try_from(device).ok()?,
        ..ToolSample::default()
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_environment_survives_the_trip_through_keys_and_values() {
        let environment = Environment {
            palpate_version: "0.1.0".into(),
            instruction_set: "avx2".into(),
            execution: LoggedExecution::Threaded { start_unix_ns: 1_700_000_000_123_456_789 },
            model: "patch".into(),
            model_reason: Some(ModelReason { why: "it is cheap".into(), warning: Some("it is wrong".into()) }),
            body: Some("1125 nodes".into()),
            tools: Some("sphere of 4.0 mm".into()),
            haptic_hz: 1000.0,
            global_hz: 29.97,
            groups: vec![
                GroupInfo { cpu: Some(1), actors: vec!["device".into()], ..GroupInfo::new("haptic", 1000.0) },
                GroupInfo { background: true, budget: Some(Nanos(7)), ..GroupInfo::new("global", 29.97) },
            ],
            devices: vec!["left".into(), "right".into()],
            shapes: vec![
                ToolShape::Point,
                ToolShape::Sphere { radius: 0.1 + 0.2 },
                ToolShape::Capsule { radius: 3e-3, half_axis: Vec3::new(-0.0, 1.0 / 3.0, 1e-300) },
            ],
            limit_stages: vec!["clamp".into(), "slew".into()],
            safety_off: vec!["tank".into()],
            stored_j: 0.125,
            coupling: Some("K_c 400 N/m".into()),
            granted: [("policy".to_owned(), "other".to_owned())].into(),
            first_tools: [0, 1]
                .map(|device| ToolSample {
                    position_m: [0.1, -0.0, 1.0 / 3.0],
                    velocity_m_s: [1e-300, 5.0, -1e12],
                    buttons: 3,
                    orientation: Turn::from_euler_angles(0.1, -0.2, f64::from(device)),
                    device,
                    ..ToolSample::default()
                })
                .into(),
            scene: None,
            session: None,
            mesh: None,
        };
        assert_eq!(Environment::from_map(&environment.to_map(1)), environment);
        let named = Environment { model_reason: None, ..environment.clone() };
        assert_eq!(Environment::from_map(&named.to_map(1)), named);
        assert_eq!(environment.group_name(1), "global");
        assert_eq!(environment.group_name(7), "group-7");
    }
}
