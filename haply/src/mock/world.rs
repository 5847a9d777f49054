//! The mock's state, shared by its threads under one lock.

use super::fault::{MockFault, MockFaultKind};
use super::options::{MockCounts, MockOptions};
use super::plant::Plant;
use crate::protocol::Vector;
use crossbeam_channel::Sender;
use serde::Deserialize;
use serde_json::{Map, Value, json};
use std::time::{Duration, Instant};

/// How long a service that has vanished stays away.
const AWAY: Duration = Duration::from_millis(300);

/// How late a slow service is.
const SLOW: Duration = Duration::from_millis(5);

/// The largest force of a command (N), twice that of the strongest desktop device whose limits are known.
const MOST_N: f64 = 24.0;

/// Forces that are kept from the beginning of the fault on.
const MOST_KEPT: usize = 10_000;

/// A client's message, as far as the mock follows it.
#[derive(Debug, Default, Deserialize)]
#[serde(default)]
struct Request {
    session: Map<String, Value>,
    inverse3: Vec<Asked>,
}

#[derive(Debug, Default, Deserialize)]
#[serde(default)]
struct Asked {
    device_id: String,
    commands: Map<String, Value>,
}

#[derive(Debug, Default, Deserialize)]
#[serde(default)]
struct SetForce {
    vector: Option<Vector>,
    execute: Option<bool>,
}

#[derive(Debug)]
pub(super) struct World {
    pub(super) options: MockOptions,
    pub(super) counts: MockCounts,
    /// Forces received since the fault began (N).
    pub(super) forces_n: Vec<[f64; 3]>,
    pub(super) listeners: Vec<Sender<String>>,
    plant: Plant,
    now: Instant,
    /// The connection on which the fault shows.
    faulty: Option<u64>,
    away_until: Option<Instant>,
    /// When the fault ends by itself.
    ends: Option<(Instant, Option<Value>)>,
    /// The fault that the device has now.
    active: Option<MockFaultKind>,
    pub(super) is_over: bool,
}

impl World {
    pub(super) fn new(options: MockOptions) -> Self {
        let at_first = options.fault.filter(|fault| fault.after == 0 && is_status(fault.kind));
        Self {
            active: at_first.map(|fault| fault.kind),
            options,
            counts: MockCounts::default(),
            forces_n: Vec::new(),
            listeners: Vec::new(),
            plant: Plant::new(),
            now: Instant::now(),
            faulty: None,
            away_until: None,
            ends: None,
            is_over: false,
        }
    }

    /// Connections are closed, and none are taken.
    pub(super) fn is_away(&self) -> bool {
        self.is_over || self.away_until.is_some_and(|until| Instant::now() < until)
    }

    /// The force on the plant now (N).
    pub(super) fn applied_n(&mut self) -> [f64; 3] {
        self.go_on();
        self.plant.force_n()
    }

    /// Fails with the next command.
    pub(super) fn fail(&mut self, kind: MockFaultKind) {
        self.options.fault = Some(MockFault { kind, after: self.counts.commands });
        (self.faulty, self.away_until, self.ends, self.active) = (None, None, None, None);
        self.forces_n.clear();
    }

    /// Time goes on, and with it the plant and a fault that ends by itself.
    pub(super) fn go_on(&mut self) {
        let now = Instant::now();
        self.plant.advance(now - self.now);
        self.now = now;
        if let Some((_, event)) = self.ends.take_if(|(end, _)| now >= *end) {
            self.active = None;
            if let Some(event) = event {
                self.tell(&event);
            }
        }
    }

    /// Follows one message of connection `session`. Gives the answer, if there is one, and how late it is.
    pub(super) fn answer(&mut self, message: &[u8], session: u64) -> (Option<String>, Duration) {
        self.go_on();
        self.counts.messages += 1;
        let wants_inventory = self.follow(message).unwrap_or_else(|_| {
            self.counts.malformed += 1;
            self.warn("invalid-io-channel", json!({"received_data": ""}), "not a message");
            false
        });
        if self.faulty.is_none()
            && let Some(fault) = self.options.fault
            && self.counts.commands > fault.after
        {
            self.faulty = Some(session);
            self.begin(fault.kind);
        }
        let mut state = self.state(wants_inventory, session);
        let mut delay = Duration::ZERO;
        match self.options.fault.filter(|_| self.faulty == Some(session)).map(|fault| fault.kind) {
            Some(MockFaultKind::Silent | MockFaultKind::Vanish) => return (None, delay),
            Some(MockFaultKind::Slow) => delay = SLOW,
            Some(MockFaultKind::Garbage) => state.truncate(40),
            _ => {}
        }
        self.counts.replies += 1;
        (Some(state), delay)
    }

    /// Gives whether the message asks for the configuration of every device once more.
    fn follow(&mut self, message: &[u8]) -> serde_json::Result<bool> {
        let Request { session, inverse3 } = serde_json::from_slice(message)?;
        let (mut is_probe, mut set_commands, mut force_n) = (false, 0, None);
        for asked in inverse3.iter().filter(|asked| asked.device_id == self.options.device_id) {
            is_probe |= asked.commands.contains_key("probe_position");
            set_commands += asked.commands.keys().filter(|name| name.starts_with("set_")).count();
            if let Some(set) = asked.commands.get("set_cursor_force") {
                let SetForce { vector, execute } = SetForce::deserialize(set)?;
                force_n = vector.filter(|_| execute != Some(false)).or(force_n);
            }
        }
        self.counts.sessions += u64::from(session.contains_key("configure"));
        self.counts.probes += u64::from(is_probe);
        self.counts.commands += u64::from(set_commands > 0);
        if set_commands > 1 {
            self.counts.conflicts += 1;
            let data = json!({"field": "commands", "reason": "conflict", "context": "inverse3"});
            self.warn("invalid-value", data, "two commands in one frame");
        } else if let Some(force_n) = force_n {
            let force_n: [f64; 3] = force_n.into();
            if force_n.iter().map(|c| c * c).sum::<f64>() <= MOST_N * MOST_N {
                self.command(force_n);
            } else {
                self.counts.refused += 1;
                let data = json!({"field": "set_cursor_force", "reason": "out of range", "context": "inverse3"});
                self.warn("invalid-value", data, "a force that no device has");
            }
        }
        Ok(session.contains_key("force_render_full_state"))
    }

    fn command(&mut self, force_n: [f64; 3]) {
        if self.faulty.is_some() && self.forces_n.len() < MOST_KEPT {
            self.forces_n.push(force_n);
        }
        use MockFaultKind::{Ebrake, Uncalibrated, Unplug, Unready};
        if !matches!(self.active, Some(Ebrake | Unplug | Uncalibrated | Unready)) {
            self.plant.command(force_n);
        }
    }

    fn begin(&mut self, kind: MockFaultKind) {
        let now = Instant::now();
        self.away_until = (kind == MockFaultKind::Vanish).then(|| now + AWAY);
        self.active = Some(kind);
        let [event, end] = kind.events(&self.options.device_id);
        if end.is_some() || is_status(kind) {
            self.ends = Some((now + MockFaultKind::LASTS, end));
        }
        if let Some(event) = event {
            self.tell(&event);
        }
    }

    /// Says that a client's message was wrong.
    fn warn(&mut self, name: &str, data: Value, message: &str) {
        self.tell(&json!({"name": name, "category": "input", "level": "warning", "data": data, "message": message}));
    }

    fn tell(&mut self, event: &Value) {
        self.counts.events += 1;
        self.listeners.retain(|listener| listener.send(event.to_string()).is_ok());
    }

    /// A state frame; with the configuration if it is the inventory.
    pub(super) fn state(&self, with_config: bool, session: u64) -> String {
        let mut devices = Vec::new();
        if self.active != Some(MockFaultKind::Unplug) {
            let mut device = self.device();
            if with_config {
                device["config"] = config(&self.options.device_id);
            }
            devices.push(device);
        }
        let grips: Vec<Value> = self.options.grip.iter().map(grip).collect();
        json!({"session_id": session, "inverse3": devices, "verse_grip": grips, "wireless_verse_grip": [], "custom_verse_grip": []})
            .to_string()
    }

    fn device(&self) -> Value {
        // To the nanometre, as a service says no more either.
        let vector = |v: [f64; 3]| {
            let [x, y, z] = v.map(|c| (1e9 * c).round() / 1e9);
            json!({"x": x, "y": y, "z": z})
        };
        let is_idle = self.plant.is_idle();
        let (mode, domain, control) =
            if is_idle { ("idle", "undefined", "idle") } else { ("position", "cartesian", "force") };
        json!({
            "device_id": self.options.device_id,
            "state": {
                "angular_position": {"a0": -88.81024, "a1": 118.23612, "a2": 3.7508194},
                "angular_velocity": {"a0": 0, "a1": 0, "a2": 0},
                "body_orientation": {"x": 0.035461426, "y": 0.6989746, "z": 0.0025634766, "w": 0.71429443},
                "cursor_position": vector(self.plant.position_m),
                "cursor_velocity": vector(self.plant.velocity_m_s),
                "current_cursor_force": vector(self.plant.force_n()),
                "mode": mode,
                "control_domain": domain,
                "control_mode": control,
                "transform": {},
                "transform_velocity": {},
            },
            "status": {
                "calibrated": self.active != Some(MockFaultKind::Uncalibrated),
                "in_use": !is_idle,
                "power_supply": true,
                "ready": self.active != Some(MockFaultKind::Unready),
                "started": true,
            },
        })
    }
}

/// A grip that is turned like this (w, x, y, z), with no button pressed.
fn grip([w, x, y, z]: &[f64; 4]) -> Value {
    let orientation = json!({"x": x, "y": y, "z": z, "w": w});
    json!({"device_id": "61548", "state": {"orientation": orientation, "button": false, "hall": 0}})
}

/// True for a fault that the status alone tells of.
fn is_status(kind: MockFaultKind) -> bool {
    matches!(kind, MockFaultKind::Uncalibrated | MockFaultKind::Unready)
}

fn config(id: &str) -> Value {
    let uuid = format!("ED78730C8173560784AB4167961D{id}");
    json!({
        "type": "inverse3",
        "device_info": {"major_version": 7, "minor_version": 1, "id": id, "device_type": "inverse3", "uuid": uuid},
        "port": "mock",
        "extended_device_id": uuid,
        "extended_firmware_version": "8C20FDC8010AA1E15AA133CDA2534874",
        "gravity_compensation": {"enabled": true, "scaling_factor": 0.75},
        "handedness": "right",
        "streaming_mode": "USB",
        "torque_scaling": {"enabled": true},
        "cursor_offset": {"x": 0, "y": 0, "z": 0},
        "coordinate_origin": "device_base",
        "basis": {"permutation": "XYZ"},
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn forces_probes_and_conflicts_are_told_apart() {
        let mut world = World::new(MockOptions::default());
        let mut follow = |text: &str| {
            world.counts = MockCounts::default();
            world.plant.command([0.0; 3]);
            let wants_inventory = world.follow(text.as_bytes()).ok();
            let MockCounts { sessions, commands, probes, conflicts, .. } = world.counts;
            (wants_inventory, [sessions, commands, probes, conflicts], world.plant.force_n())
        };
        let first = r#"{"session":{"configure":{"profile":{"name":"p"}}},"inverse3":[{"device_id":"049D","commands":
            {"set_cursor_force":{"vector":{"x":1,"y":-2,"z":0.5}}}}]}"#;
        assert_eq!(follow(first), (Some(false), [1, 1, 0, 0], [1.0, -2.0, 0.5]));
        assert_eq!(follow(&first.replace("049D", "FFFF")), (Some(false), [1, 0, 0, 0], [0.0; 3]));
        let unexecuted = first.replace("0.5}", "0.5},\"execute\":false");
        assert_eq!(follow(&unexecuted), (Some(false), [1, 1, 0, 0], [0.0; 3]));
        let probe = r#"{"session":{"force_render_full_state":{}},"inverse3":[{"device_id":"049D","commands":{"probe_position":{}}}]}"#;
        assert_eq!(follow(probe), (Some(true), [0, 0, 1, 0], [0.0; 3]));
        for huge in ["1e308", "-25"] {
            let huge = first.replace("\"x\":1", &format!("\"x\":{huge}"));
            assert_eq!(follow(&huge), (Some(false), [1, 1, 0, 0], [0.0; 3]));
        }
        let both = first.replace("{\"set_c", "{\"set_cursor_position\":{\"position\":{}},\"set_c");
        assert_eq!(follow(&both), (Some(false), [1, 1, 0, 1], [0.0; 3]));
        assert_eq!(follow("{\"inverse3\":[{]}").0, None);
    }
}
