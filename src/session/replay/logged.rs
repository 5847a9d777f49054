//! Reads a log for replay and refuses one that does not hold everything.

use std::collections::BTreeMap;
use std::path::Path;

use super::compare::Comparison;
use crate::devices::{DeviceState, ReplayedSample};
use crate::error::{Error, ErrorKind};
use crate::log::{Environment, GroupStats, Level, LogEntry, LogReader, LogRecord, TextEvent, ToolSample};
use crate::model::body::Block;
use crate::runtime::Recording;
use crate::scene::Scene;
use crate::time::Nanos;

/// Everything that a replay needs of a log.
#[derive(Debug)]
pub(super) struct Logged {
    pub(super) scene: Scene,
    pub(super) recording: Recording,
    pub(super) first: DeviceState,
    pub(super) samples: Vec<ReplayedSample>,
    pub(super) comparison: Comparison,
    /// The first fault, and the time of its release: nothing from there on is part of the rest.
    pub(super) fault: Option<(Nanos, String)>,
}

/// What one pass over the file gathers.
struct Gathered {
    environment: Option<Environment>,
    session: Option<String>,
    recording: Recording,
    samples: Vec<ReplayedSample>,
    comparison: Comparison,
    stats: BTreeMap<u16, GroupStats>,
    fault: Option<(Nanos, String)>,
}

impl Logged {
    /// Reads the log at `path`.
    ///
    /// # Errors
    /// [`ErrorKind::Io`] if it cannot be read, [`ErrorKind::Log`] if it is damaged, lacks a record or was made with
    /// another instruction set.
    pub(super) fn read(path: &Path) -> Result<Self, Error> {
        let mut reader = LogReader::open(path)?;
        let mut gathered = Gathered {
            environment: None,
            session: None,
            recording: Recording::default(),
            samples: Vec::new(),
            comparison: Comparison::new(),
            stats: BTreeMap::new(),
            fault: None,
        };
        for entry in reader.by_ref() {
            gathered.push(entry);
        }
        let place = reader.place();
        if let Some(damage) = reader.damage() {
            return Err(refusal(format!("a damaged log cannot be replayed: {damage}")).at(place));
        }
        if !reader.topics().contains_key("/ports") {
            let message = "it has no topic /ports: what the ticks saw of each other was not recorded, record it again";
            return Err(refusal(message).at(place));
        }
        gathered.check().map_err(|error| error.at(place))
    }
}

impl Gathered {
    fn push(&mut self, entry: LogEntry) {
        match entry {
            LogEntry::Environment(environment) => self.environment = Some(environment),
            LogEntry::Attachment { name, data } if name == Environment::SESSION => {
                self.session = Some(String::from_utf8_lossy(&data).into_owned());
            }
            LogEntry::Attachment { .. } => {}
            LogEntry::Stats(stats) => {
                self.stats.insert(stats.group, stats);
            }
            LogEntry::Text(event) => self.note_fault(event),
            LogEntry::Record(record) => self.push_record(&record),
        }
    }

    fn push_record(&mut self, record: &LogRecord) {
        match record {
            LogRecord::Tick(timing) => self.recording.push_timing(timing),
            LogRecord::Port(used) => self.recording.push_use(used),
            LogRecord::Tool(sample) => {
                self.samples.push(ReplayedSample { time: sample.time, id: sample.id, state: state(sample) });
            }
            LogRecord::Force(sample) => self.comparison.log_force(sample),
            LogRecord::Command(sample) => self.comparison.log_command(sample),
            LogRecord::Event(event) => self.note_fault(TextEvent::describe(event, &format!("group {}", event.group))),
            LogRecord::Contact(_) | LogRecord::Resync(_) | LogRecord::Global(_) | LogRecord::Probe(_) => {}
        }
    }

    /// What the runtime tells as an error ended a release half-way: it cannot be compared.
    fn note_fault(&mut self, event: TextEvent) {
        let is_earlier = self.fault.as_ref().is_none_or(|(time, _)| event.time < *time);
        if event.level == Level::Error && is_earlier {
            self.fault = Some((event.time, event.message));
        }
    }

    fn check(mut self) -> Result<Logged, Error> {
        let environment = self.environment.take().ok_or_else(|| refusal("it does not say what was run"))?;
        check_instruction_set(&environment.instruction_set)?;
        let session = self.session.take().ok_or_else(|| {
            refusal(format!("it has no attachment {}: what was run is not known", Environment::SESSION))
        })?;
        let scene = Scene::from_session_toml(&session, Environment::SESSION)
            .map_err(|error| refusal(format!("what was run cannot be read: {error}")))?;
        let first = environment.first_tool.ok_or_else(|| refusal("it lacks the device's first state"))?;
        self.check_sums(&environment)?;
        self.recording.check(|group| environment.group_name(group))?;
        if let Some((time, _)) = self.fault {
            self.recording = self.recording.before(time);
            self.samples.retain(|sample| sample.time < time);
        }
        self.check_samples(&environment)?;
        let Self { recording, samples, comparison, fault, .. } = self;
        Ok(Logged { scene, recording, first: state(&first), samples, comparison, fault })
    }

    /// The statistics at the end of a log say how many records it must hold.
    fn check_sums(&self, environment: &Environment) -> Result<(), Error> {
        let lost: u64 = self.stats.values().map(|stats| stats.lost_records).sum();
        if lost > 0 {
            return Err(refusal(format!("{lost} records were lost when it was written, so it is not all there")));
        }
        for group in 0..environment.groups.len() as u16 {
            let name = environment.group_name(group);
            let Some(stats) = self.stats.get(&group) else {
                return Err(refusal(format!("it has no statistics of rate group `{name}`, so it is not all there")));
            };
            for (what, counted, found) in [
                ("releases", stats.released, self.recording.released(group)),
                ("uses of ports", stats.port_uses, self.recording.port_uses(group)),
            ] {
                if counted != found {
                    let message = format!("rate group `{name}` made {counted} {what}, but {found} are in the log");
                    return Err(refusal(message));
                }
            }
        }
        Ok(())
    }

    /// Every release of the local group read the device.
    fn check_samples(&self, environment: &Environment) -> Result<(), Error> {
        let local = environment.groups.iter().position(|group| group.name == "local");
        let local = local.ok_or_else(|| refusal("it has no rate group `local`, so it is no log of a session"))?;
        let mut samples = self.samples.iter();
        let mut last_id = 0;
        for (tick, time) in self.recording.releases(local as u16) {
            match samples.next() {
                Some(sample) if sample.time == time && sample.id.wrapping_sub(last_id) <= 1 => last_id = sample.id,
                _ => {
                    let message =
                        format!("release {tick} of rate group `local` has no sample of the tool, or a wrong one");
                    return Err(refusal(message));
                }
            }
        }
        match samples.next() {
            None => Ok(()),
            Some(sample) => {
                let time = sample.time.as_secs_f64();
                Err(refusal(format!("the sample of the tool at t = {time} s belongs to no release")))
            }
        }
    }
}

fn check_instruction_set(logged: &str) -> Result<(), Error> {
    let here = Block::instruction_set();
    if logged == here {
        return Ok(());
    }
    let message =
        format!("it was made with the instruction set {logged}, this machine uses {here}: bit-identity holds for one");
    Err(refusal(message))
}

fn state(sample: &ToolSample) -> DeviceState {
    DeviceState { position: sample.position_m.into(), velocity: sample.velocity_m_s.into(), buttons: sample.buttons }
}

fn refusal(message: impl Into<String>) -> Error {
    Error::new(ErrorKind::Log, message)
}
