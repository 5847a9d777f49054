//! A log as a Chrome trace, which Perfetto and chrome://tracing open: a track for each rate group, a slice for each
//! release, and arrows from device sample to force.

mod events;
mod flows;
mod tracks;

use std::collections::BTreeMap;
use std::io::{self, Read, Write};

use palpate::Error;
use palpate::log::{Environment, ForceSample, LogEntry, LogReader, LogRecord, Resync, TextEvent, Window, magnitude};
use palpate::runtime::{ActorTimes, TickTiming};

use self::events::{Events, Phase, Scope, Track};
use self::flows::{Flow, Flows, Placed};
use self::tracks::Tracks;
use super::{Micros, output_error};
use crate::drawing::html::JsonString;

/// Writes what `window` holds of a log as one JSON document in the Trace Event Format.
///
/// Memory is bounded: by one chunk of the log and some seconds of releases. On a damaged log it writes what is readable; ask
/// [`LogReader::damage`] afterwards.
///
/// # Errors
/// [`ErrorKind::Io`](palpate::ErrorKind::Io) if `out` cannot be written.
pub fn export_trace<R: Read, W: Write>(reader: &mut LogReader<R>, window: &Window, out: &mut W) -> Result<(), Error> {
    let mut trace = Trace::new(out).map_err(output_error)?;
    while let Some(Ok(entry)) = reader.next() {
        match &entry {
            LogEntry::Environment(environment) => trace.set_environment(environment),
            entry if window.contains_entry(entry) => trace.entry(entry, reader.topic()).map_err(output_error)?,
            _ => {}
        }
    }
    trace.finish(reader.place(), reader.damage()).map_err(output_error)
}

struct Trace<W> {
    events: Events<W>,
    environment: Environment,
    tracks: Tracks,
    flows: Flows,
    /// The last release of each group.
    latest: BTreeMap<u16, Placed>,
    haptic: u16,
    global: u16,
}

impl<W: Write> Trace<W> {
    fn new(out: W) -> io::Result<Self> {
        let (tracks, flows, environment) = (Tracks::default(), Flows::default(), Environment::default());
        let latest = BTreeMap::new();
        Ok(Self { events: Events::new(out)?, environment, tracks, flows, latest, haptic: 0, global: 1 })
    }

    fn set_environment(&mut self, environment: &Environment) {
        self.tracks.set_environment(environment);
        // By the names that a session gives them, else by rate.
        let find = |name: &str, rate_hz: f64| {
            let groups = &environment.groups;
            let named = groups.iter().position(|group| group.name == name);
            let place = named.or_else(|| groups.iter().position(|group| group.rate_hz == rate_hz));
            place.and_then(|place| u16::try_from(place).ok())
        };
        self.haptic = find("local", environment.haptic_hz).unwrap_or(self.haptic);
        self.global = find("global", environment.global_hz).unwrap_or(self.global);
        self.environment = environment.clone();
    }

    fn entry(&mut self, entry: &LogEntry, topic: &str) -> io::Result<()> {
        match entry {
            LogEntry::Record(LogRecord::Tick(timing)) => self.release(timing, topic),
            LogEntry::Record(LogRecord::Actors(times)) => self.actors(times),
            LogEntry::Record(LogRecord::Force(force)) => self.force(force),
            LogEntry::Record(LogRecord::Resync(resync)) => self.resync(resync),
            LogEntry::Record(LogRecord::Global(built)) => {
                self.flows.push_model(built);
                Ok(())
            }
            LogEntry::Record(LogRecord::Event(event)) => {
                let text = TextEvent::describe(event, &self.environment.group_name(event.group));
                self.text(&text, self.tracks.of_group(event.group))
            }
            LogEntry::Text(event) => self.text(event, None),
            _ => Ok(()),
        }
    }

    /// One release: its slice, with what slipped before it and whether it missed its deadline.
    fn release(&mut self, timing: &TickTiming, topic: &str) -> io::Result<()> {
        // An end before its start is a damaged record; drawn as an instant it does not cover its neighbours.
        let timing = TickTiming { end: timing.end.max(timing.start), ..*timing };
        let name = topic.strip_prefix("/timing/").unwrap_or(topic);
        let span = (timing.start, timing.end);
        let track = self.tracks.place(timing.group, name, span, &mut self.events)?;
        let (cause, missed) = (timing.cause.name(), timing.missed());
        let name = if missed { "release (missed its deadline)" } else { "release" };
        let lateness = Micros(timing.woke.saturating_sub(timing.scheduled).0);
        let args = format_args!(
            "\"tick\":{},\"scheduled_us\":{},\"lateness_us\":{lateness},\"slips\":{},\"cause\":\"{cause}\",\
             \"missed\":{missed},\"mode\":\"{}\"",
            timing.tick,
            Micros(timing.scheduled.0),
            timing.slips,
            timing.mode.name()
        );
        self.events.slice(track, name, timing.start, timing.end, args)?;
        let scope = Scope::Track(track);
        for (cause, slips) in timing.slips_by_cause().into_iter().filter(|(_, slips)| *slips > 0) {
            let args = format_args!("\"slips\":{slips},\"tick\":{}", timing.tick);
            self.events.instant(scope, "slip", &format!("slip: {}", cause.name()), timing.start, args)?;
        }
        if missed {
            let args = format_args!("\"tick\":{},\"cause\":\"{cause}\"", timing.tick);
            let time = timing.deadline.max(timing.start);
            self.events.instant(scope, "miss", &format!("missed deadline: {cause}"), time, args)?;
        }
        let placed = Placed { track, timing };
        self.latest.insert(timing.group, placed);
        if timing.group == self.haptic {
            self.flows.push_haptic(placed);
        } else if timing.group == self.global {
            self.flows.push_global(placed);
        } else {
            return Ok(());
        }
        self.draw_flows()
    }

    /// What each actor took of a release, as slices inside it, one behind the other: how long each was at work is known, not
    /// when it was called again.
    fn actors(&mut self, times: &ActorTimes) -> io::Result<()> {
        let latest = self.latest.get(&times.group).filter(|placed| placed.timing.scheduled == times.scheduled);
        let Some(&Placed { track, timing }) = latest else { return Ok(()) };
        let info = self.environment.groups.get(usize::from(times.group));
        let mut from = timing.start;
        for (number, spent) in times.spent().iter().enumerate() {
            let name = info.map_or_else(|| format!("actor {number}"), |info| info.actor_name(number));
            let to = (from + *spent).min(timing.end);
            self.events.slice(track, &name, from, to, format_args!("\"tick\":{}", timing.tick))?;
            from = to;
        }
        Ok(())
    }

    fn draw_flows(&mut self) -> io::Result<()> {
        for Flow { id, sample_tick, version, device, stations } in self.flows.take_complete() {
            let [(read_on, read_at), (_, _), (served_on, served_at)] = stations;
            let args = format_args!("\"tick\":{sample_tick}");
            self.events.instant(Scope::Track(read_on), "sample", "sample", read_at, args)?;
            let args = format_args!("\"model_version\":{version},\"device\":{device}");
            self.events.instant(Scope::Track(served_on), "force", "force", served_at, args)?;
            for (phase, (track, time)) in [Phase::Start, Phase::Step, Phase::Finish].into_iter().zip(stations) {
                self.events.flow(phase, id, track, time)?;
            }
        }
        Ok(())
    }

    /// The counters of a device.
    fn force(&mut self, force: &ForceSample) -> io::Result<()> {
        let magnitude = magnitude(force.force_n);
        let named = |what: &str| match self.environment.device_prefix(force.device).strip_prefix('/') {
            Some(device) => format!("{device}: {what}"),
            None => what.to_owned(),
        };
        if magnitude.is_finite() {
            self.events.counter(&named("|force| (N)"), "N", force.time, magnitude)?;
        } else {
            let args = format_args!("\"device\":{}", force.device);
            self.events.instant(Scope::Process, "force", "the force is not finite", force.time, args)?;
        }
        if force.model_age_s.is_finite() {
            self.events.counter(&named("model age (s)"), "s", force.time, force.model_age_s)?;
        }
        self.flows.push_force(force);
        self.draw_flows()
    }

    /// The release in which a new model served alone for the first time.
    fn resync(&mut self, resync: &Resync) -> io::Result<()> {
        let Some(track) = self.tracks.of_group(self.haptic) else { return Ok(()) };
        let jump = |force_n: f64| if force_n.is_finite() { force_n.to_string() } else { "null".to_owned() };
        let args = format_args!(
            "\"model_version\":{},\"age_us\":{},\"jump_before_n\":{},\"jump_after_n\":{},\"device\":{}",
            resync.version,
            Micros(resync.age.0),
            jump(resync.jump_before_n),
            jump(resync.jump_after_n),
            resync.device
        );
        self.events.instant(Scope::Track(track), "resync", "blend ended", resync.time, args)
    }

    fn text(&mut self, event: &TextEvent, track: Option<Track>) -> io::Result<()> {
        let args = format_args!("\"level\":\"{}\"", event.level.name());
        self.events.instant(track.map_or(Scope::Process, Scope::Track), "log", &event.message, event.time, args)
    }

    fn finish(self, place: &str, damage: Option<&str>) -> io::Result<()> {
        let mut about = format!(
            "\"log\":{},\"palpate_version\":{},\"model\":{}",
            JsonString(place),
            JsonString(&self.environment.palpate_version),
            JsonString(&self.environment.model)
        );
        for (key, value) in &self.environment.granted {
            about += &format!(",{}:{}", JsonString(&format!("granted.{key}")), JsonString(value));
        }
        about.extend(damage.map(|damage| format!(",\"damage\":{}", JsonString(damage))));
        self.events.finish(about)
    }
}
