//! Reads a log for replay and refuses one that does not hold everything.

use std::collections::BTreeMap;
use std::path::Path;

use super::compare::Comparison;
use super::cut::Cut;
use super::report::LoggedFault;
use crate::devices::{DeviceState, ReplayedSample};
use crate::error::{Error, ErrorKind};
use crate::log::{
    Environment, EventSum, GroupStats, Level, LogEntry, LogReader, LogRecord, LoggedExecution, TextEvent, ToolSample,
};
use crate::model::body::Block;
use crate::runtime::{Nanos, Recording, TickTiming};
use crate::scene::{BodySpec, MAX_DEVICES, Scene, Volume};
use crate::session::prepare::{as_run, logged};

/// The rate group that is no part of what is repeated.
const LOGGER: &str = "logger";

/// Everything that a replay needs of a log.
#[derive(Debug)]
pub(super) struct Logged {
    pub(super) scene: Scene,
    pub(super) recording: Recording,
    /// True if it was written on threads.
    pub(super) in_real_time: bool,
    /// Of each device its first state and its samples.
    pub(super) tools: Vec<(DeviceState, Vec<ReplayedSample>)>,
    pub(super) comparison: Comparison,
    /// When the last release was due.
    pub(super) end: Nanos,
    /// At the first fault: nothing from there on is part of the rest.
    pub(super) cut: Option<Cut>,
}

/// What one pass over the file gathers.
#[derive(Default)]
struct Gathered {
    environment: Option<Environment>,
    session: Option<String>,
    mesh: Option<Vec<u8>>,
    recording: Recording,
    /// By device.
    samples: Vec<Vec<ReplayedSample>>,
    comparison: Comparison,
    stats: BTreeMap<u16, GroupStats>,
    timings: BTreeMap<u16, Vec<TickTiming>>,
    events: EventSum,
    fault: Option<LoggedFault>,
    /// The last time that a group was started again.
    restarted: Option<Nanos>,
}

impl Logged {
    /// Reads the log at `path`.
    ///
    /// # Errors
    /// [`ErrorKind::Io`] if it cannot be read, [`ErrorKind::Log`] if it is damaged, lacks a record or was made with
    /// another instruction set.
    pub(super) fn read(path: &Path) -> Result<Self, Error> {
        let mut reader = LogReader::open(path)?;
        let mut gathered = Gathered::default();
        for entry in reader.readable() {
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
        if !reader.is_checksummed() {
            let message = "it has no checksum over its data, so nobody knows whether it is as it was written: replay the \
                           file that palpate wrote";
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
            LogEntry::Attachment { name, data } if name == Environment::MESH => self.mesh = Some(data),
            LogEntry::Attachment { .. } | LogEntry::Scene(_) => {}
            LogEntry::Stats(stats) => {
                self.stats.insert(stats.group, stats);
            }
            LogEntry::Text(event) => self.push_event(event),
            LogEntry::Record(record) => self.push_record(&record),
        }
    }

    fn push_record(&mut self, record: &LogRecord) {
        match record {
            LogRecord::Tick(timing) => {
                self.recording.push_timing(timing);
                self.timings.entry(timing.group).or_default().push(*timing);
            }
            LogRecord::Port(used) => self.recording.push_use(used),
            LogRecord::Input(input) => self.recording.push_input(input),
            LogRecord::Tool(sample) => {
                let device = usize::from(sample.device).min(MAX_DEVICES);
                self.samples.resize_with(self.samples.len().max(device + 1), Vec::new);
                self.samples[device].push(logged(sample));
            }
            LogRecord::Event(event) => self.push_event(TextEvent::describe(event, &format!("group {}", event.group))),
            computed => self.comparison.log(computed),
        }
    }

    /// What the runtime tells as an error ended a release half-way: it cannot be compared.
    fn push_event(&mut self, event: TextEvent) {
        self.events.push(&event);
        if event.tells_restart() {
            self.restarted = self.restarted.max(Some(event.time));
        }
        let is_earlier = self.fault.as_ref().is_none_or(|fault| event.time < fault.time);
        if event.level == Level::Error && is_earlier {
            self.fault = Some(LoggedFault { time: event.time, what: event.message, restarted: false });
        }
    }

    fn check(mut self) -> Result<Logged, Error> {
        let environment = self.environment.take().ok_or_else(|| refusal("it does not say what was run"))?;
        check_instruction_set(&environment.instruction_set)?;
        if environment.global_hz > 0.0 && !environment.groups.iter().any(|group| group.name == "global") {
            return Err(refusal("its global model was in another process, by a link: what that did is in no log"));
        }
        let session = self.session.take().ok_or_else(|| {
            refusal(format!("it has no attachment {}: what was run is not known", Environment::SESSION))
        })?;
        let scene = Scene::from_session_toml(&session, Environment::SESSION)
            .map_err(|error| refusal(format!("what was run cannot be read: {error}")))?;
        // Whatever a log says, it chooses no path and no device here.
        let mut scene = as_run(&scene, None);
        if let Some(BodySpec::Tetrahedra(spec)) = &mut scene.body {
            let mesh = self.mesh.take().ok_or_else(|| {
                refusal(format!("it has no attachment {}: the mesh of its body is not known", Environment::MESH))
            })?;
            let volume = Volume::of_file(mesh, Environment::MESH, spec.unit_m);
            spec.volume = Some(volume.map_err(|error| refusal(format!("its mesh cannot be used: {error}")))?);
        }
        let devices = scene.devices.len();
        if environment.first_tools.len() != devices {
            return Err(refusal("it lacks the device's first state"));
        }
        if self.samples.len() > devices {
            return Err(refusal("it holds samples of a device that the scene does not have"));
        }
        self.samples.resize_with(devices, Vec::new);
        self.check_sums(&environment)?;
        let end = self.recording.end();
        // Ports are counted anew after a restart and releases half done: what is behind a fault is not repeated.
        let cut = self.cut(&environment)?;
        self.recording.check(|group| environment.group_name(group))?;
        for (samples, first) in self.samples.iter().zip(&environment.first_tools) {
            self.check_samples(&environment, samples, first)?;
        }
        let Self { recording, samples, comparison, .. } = self;
        let in_real_time = environment.execution != LoggedExecution::Virtual;
        let tools = environment.first_tools.iter().map(|first| logged(first).state).zip(samples).collect();
        Ok(Logged { scene, recording, in_real_time, tools, comparison, end, cut })
    }

    /// Leaves out what is behind the first fault.
    fn cut(&mut self, environment: &Environment) -> Result<Option<Cut>, Error> {
        let Some(fault) = self.fault.take() else {
            let some = self.comparison.forces_before(Nanos(u64::MAX)) > 0;
            return if some { Ok(None) } else { Err(refusal("it holds no force: there is nothing to compare")) };
        };
        let time = fault.time;
        if self.comparison.forces_before(time) == 0 {
            let (t, what) = (time.as_secs_f64(), &fault.what);
            let message =
                format!("it holds no force before the fault at t = {t} s ({what}): there is nothing to compare");
            return Err(refusal(message));
        }
        self.recording = std::mem::take(&mut self.recording).before(time);
        self.samples.iter_mut().for_each(|samples| samples.retain(|sample| sample.time < time));
        let fault = LoggedFault { restarted: self.restarted.is_some_and(|restarted| restarted >= time), ..fault };
        let is_virtual = environment.execution == LoggedExecution::Virtual;
        // Observers are not repeated.
        let repeated = self.timings.iter().filter(|(group, _)| environment.group_name(**group) != LOGGER);
        let groups = repeated.map(|(group, timings)| (environment.group_name(*group), timings.as_slice()));
        Ok(Some(Cut::new(fault, is_virtual, groups)))
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
        self.check_events()
    }

    /// An event decides how much is compared: none may be missing or changed.
    fn check_events(&self) -> Result<(), Error> {
        let mut told = EventSum::default();
        self.stats.values().for_each(|stats| told.add(stats.events));
        if told.count != self.events.count {
            let message = format!("its rate groups told {} events, but {} are in /log", told.count, self.events.count);
            return Err(refusal(message));
        }
        if told != self.events {
            return Err(refusal("time, level or words of an event in /log are not those that a rate group told"));
        }
        Ok(())
    }

    /// Every release of the local group read the device.
    fn check_samples(
        &self,
        environment: &Environment,
        samples: &[ReplayedSample],
        first: &ToolSample,
    ) -> Result<(), Error> {
        let local = environment.groups.iter().position(|group| group.name == "local");
        let local = local.ok_or_else(|| refusal("it has no rate group `local`, so it is no log of a session"))?;
        let mut samples = samples.iter();
        let mut last = logged(first);
        for (tick, time) in self.recording.releases(local as u16) {
            match samples.next() {
                Some(sample) if sample.time == time && follows(sample, &last) => last = *sample,
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

/// A read counts on, or has failed and the state before is used again.
fn follows(sample: &ReplayedSample, last: &ReplayedSample) -> bool {
    match sample.id.wrapping_sub(last.id) {
        0 => bits(&sample.state) == bits(&last.state),
        1 => true,
        _ => false,
    }
}

fn bits(state: &DeviceState) -> ([u64; 6], [u64; 4], u16) {
    let [a, b, c]: [f64; 3] = state.position.into();
    let [d, e, f]: [f64; 3] = state.velocity.into();
    let turn = std::array::from_fn(|place| state.orientation.coords[place].to_bits());
    ([a, b, c, d, e, f].map(f64::to_bits), turn, state.buttons)
}

fn refusal(message: impl Into<String>) -> Error {
    Error::new(ErrorKind::Log, message)
}
