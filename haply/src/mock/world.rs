//! The mock's state, shared by its threads under one lock.

use super::fault::{Event, MockFaultKind};
use super::plant::Plant;
use super::request::{Request, request};
use super::{MockCounts, MockFault, MockOptions};
use crossbeam_channel::Sender;
use std::time::{Duration, Instant};

/// How long a service that has vanished stays away.
const AWAY: Duration = Duration::from_millis(300);

/// Forces that are kept from the beginning of the fault on.
const MOST_KEPT: usize = 10_000;

/// What a session is to do about a message.
#[derive(Debug, PartialEq, Eq)]
pub(super) enum Answer {
    Now(String),
    Late(String),
    Nothing,
    Leave,
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
    ends: Option<(Instant, Option<Event>)>,
    is_braked: bool,
    is_unplugged: bool,
    is_calibrated: bool,
    is_ready: bool,
    pub(super) is_over: bool,
}

impl World {
    pub(super) fn new(options: MockOptions) -> Self {
        let is_at_first = |kind| options.fault == Some(MockFault { kind, after: 0 });
        Self {
            is_calibrated: !is_at_first(MockFaultKind::Uncalibrated),
            is_ready: !is_at_first(MockFaultKind::Unready),
            options,
            counts: MockCounts::default(),
            forces_n: Vec::new(),
            listeners: Vec::new(),
            plant: Plant::new(),
            now: Instant::now(),
            faulty: None,
            away_until: None,
            ends: None,
            is_braked: false,
            is_unplugged: false,
            is_over: false,
        }
    }

    pub(super) fn is_away(&self) -> bool {
        self.away_until.is_some_and(|until| Instant::now() < until)
    }

    /// The force on the plant now (N).
    pub(super) fn applied_n(&mut self) -> [f64; 3] {
        self.go_on();
        self.plant.force_n()
    }

    /// Fails with the next command.
    pub(super) fn fail(&mut self, kind: MockFaultKind) {
        self.options.fault = Some(MockFault { kind, after: self.counts.commands });
        (self.faulty, self.away_until, self.ends) = (None, None, None);
        self.recover();
        self.forces_n.clear();
    }

    fn recover(&mut self) {
        (self.is_braked, self.is_unplugged) = (false, false);
        (self.is_calibrated, self.is_ready) = (true, true);
    }

    /// Time goes on, and with it the plant and a fault that ends by itself.
    pub(super) fn go_on(&mut self) {
        let now = Instant::now();
        self.plant.advance(now - self.now);
        self.now = now;
        if let Some((_, event)) = self.ends.take_if(|(end, _)| now >= *end) {
            self.recover();
            if let Some(event) = event {
                self.tell(&event.text(&self.options.device_id));
            }
        }
    }

    /// Answers one message of connection `session`.
    pub(super) fn answer(&mut self, message: &[u8], session: u64) -> Answer {
        self.go_on();
        self.counts.messages += 1;
        let wants_inventory = match request(message, &self.options.device_id) {
            Ok(request) => {
                self.follow(&request);
                request.wants_inventory
            }
            Err(_) => {
                self.counts.malformed += 1;
                self.tell(r#"{"name":"invalid-io-channel","category":"input","level":"warning","data":{"received_data":""},"message":"not a message"}"#);
                false
            }
        };
        let fault = self.options.fault;
        if self.faulty.is_none()
            && let Some(fault) = fault
            && self.counts.commands > fault.after
        {
            self.faulty = Some(session);
            self.begin(fault.kind);
        }
        let state = self.state(wants_inventory, session);
        match fault.filter(|_| self.faulty == Some(session)).map(|fault| fault.kind) {
            Some(MockFaultKind::Silent) => Answer::Nothing,
            Some(MockFaultKind::Slow) => Answer::Late(state),
            Some(MockFaultKind::Garbage) => Answer::Now("{\"inverse3\":[{\"device_id\":".to_owned() + &state[..40]),
            Some(MockFaultKind::Vanish) => Answer::Leave,
            _ => Answer::Now(state),
        }
    }

    fn follow(&mut self, request: &Request) {
        self.counts.sessions += u64::from(request.configures_session);
        self.counts.probes += u64::from(request.is_probe);
        self.counts.commands += u64::from(request.set_commands > 0);
        if request.set_commands > 1 {
            self.counts.conflicts += 1;
            self.tell(r#"{"name":"invalid-value","category":"input","level":"warning","data":{"field":"commands","reason":"conflict","context":"inverse3"},"message":"two commands in one frame"}"#);
            return;
        }
        let Some(force_n) = request.force_n else {
            return;
        };
        if self.faulty.is_some() && self.forces_n.len() < MOST_KEPT {
            self.forces_n.push(force_n);
        }
        let is_driven = !self.is_braked && !self.is_unplugged && self.is_calibrated && self.is_ready;
        if is_driven {
            self.plant.command(force_n);
        }
    }

    fn begin(&mut self, kind: MockFaultKind) {
        let now = Instant::now();
        self.away_until = (kind == MockFaultKind::Vanish).then(|| now + AWAY);
        self.is_braked = kind == MockFaultKind::Ebrake;
        self.is_unplugged = kind == MockFaultKind::Unplug;
        self.is_calibrated = kind != MockFaultKind::Uncalibrated;
        self.is_ready = kind != MockFaultKind::Unready;
        if !(self.is_calibrated && self.is_ready) {
            self.ends = Some((now + MockFaultKind::LASTS, None));
        }
        if let Some((event, end)) = kind.events() {
            self.tell(&event.text(&self.options.device_id));
            self.ends = end.map(|end| (now + MockFaultKind::LASTS, Some(end)));
        }
    }

    fn tell(&mut self, text: &str) {
        self.counts.events += 1;
        self.listeners.retain(|listener| listener.send(text.to_owned()).is_ok());
    }

    /// A state frame; with the configuration if it is the inventory.
    pub(super) fn state(&self, with_config: bool, session: u64) -> String {
        let device = if self.is_unplugged { String::new() } else { self.device(with_config) };
        format!(
            r#"{{"session_id":{session},"inverse3":[{device}],"verse_grip":[],"wireless_verse_grip":[],"custom_verse_grip":[]}}"#
        )
    }

    fn device(&self, with_config: bool) -> String {
        let id = &self.options.device_id;
        let config = if with_config {
            format!(
                r#""config":{{"type":"inverse3","device_info":{{"major_version":7,"minor_version":1,"id":"{id}","device_type":"inverse3","uuid":"ED78730C8173560784AB4167961D{id}"}},"port":"mock","extended_device_id":"ED78730C8173560784AB4167961D{id}","extended_firmware_version":"8C20FDC8010AA1E15AA133CDA2534874","gravity_compensation":{{"enabled":true,"scaling_factor":0.75}},"handedness":"right","streaming_mode":"USB","torque_scaling":{{"enabled":true}},"cursor_offset":{{"x":0,"y":0,"z":0}},"coordinate_origin":"device_base","basis":{{"permutation":"XYZ"}}}},"#
            )
        } else {
            String::new()
        };
        let vector = |[x, y, z]: [f64; 3]| format!(r#"{{"x":{x:.9},"y":{y:.9},"z":{z:.9}}}"#);
        let is_idle = self.plant.is_idle();
        let (mode, domain, control) =
            if is_idle { ("idle", "undefined", "idle") } else { ("position", "cartesian", "force") };
        let (position, velocity) = (vector(self.plant.position_m), vector(self.plant.velocity_m_s));
        let force = vector(self.plant.force_n());
        format!(
            r#"{{"device_id":"{id}",{config}"state":{{"angular_position":{{"a0":-88.81024,"a1":118.23612,"a2":3.7508194}},"angular_velocity":{{"a0":0,"a1":0,"a2":0}},"body_orientation":{{"x":0.035461426,"y":0.6989746,"z":0.0025634766,"w":0.71429443}},"cursor_position":{position},"cursor_velocity":{velocity},"current_cursor_force":{force},"mode":"{mode}","control_domain":"{domain}","control_mode":"{control}","transform":{{}},"transform_velocity":{{}}}},"status":{{"calibrated":{},"in_use":{},"power_supply":true,"ready":{},"started":true}}}}"#,
            self.is_calibrated, !is_idle, self.is_ready
        )
    }
}
