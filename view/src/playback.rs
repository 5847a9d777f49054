//! A log, shown as a session is: each browser asks for the times that it wants to see.

use std::collections::BTreeMap;
use std::path::Path;
use std::sync::Arc;
use std::sync::mpsc::{Receiver, RecvTimeoutError};
use std::time::Duration;

use bytes::Bytes;
use palpate::log::{ContactSample, Environment, LogEntry, LogReader, LogRecord, ToolSample};
use palpate::model::Vec3;
use palpate::runtime::Nanos;
use palpate::session::ToolView;
use palpate::{Error, ErrorKind};
use serde_json::json;

use crate::client::Picture;
use crate::frames::{self, Topology, Touch};
use crate::hub::{Begun, Hub};
use crate::live::{of_point, shape};
use crate::samples::{Row, Rows, block};
use crate::wish::Wish;

/// Pictures that are held in memory; of a longer log the beginning is shown.
const MOST_BYTES: usize = 512 << 20;
/// What a strip shows (s); so much before a time is sent with it.
const STRIP: Nanos = Nanos(4_000_000_000);
/// How often it is looked whether the server has ended.
const LOOK: Duration = Duration::from_millis(100);

/// The surface at a time.
struct Frame {
    time: Nanos,
    surface: Bytes,
}

/// What one device did.
#[derive(Default)]
struct Track {
    tools: Vec<ToolSample>,
    rows: Vec<(Nanos, Row)>,
    contacts: Vec<ContactSample>,
    touches: Vec<(Nanos, Touch)>,
}

/// A log in memory.
pub(crate) struct Playback {
    environment: Environment,
    topology: Topology,
    rest: Vec<[f64; 3]>,
    frames: Vec<Frame>,
    tracks: BTreeMap<u16, Track>,
    deadline: Nanos,
    /// What is wrong with the log, or left out of it, for the page.
    warning: Option<String>,
}

/// What a browser has been sent.
#[derive(Clone, Copy, Default)]
struct Shown {
    frame: Option<usize>,
    /// The span of the samples that it has.
    samples: Option<[Nanos; 2]>,
}

impl Playback {
    /// Reads the log at `path`.
    ///
    /// # Errors
    /// If it cannot be read, or if it has no pictures.
    pub(crate) fn open(path: &Path) -> Result<Self, Error> {
        let mut reader = LogReader::open(path)?.with_scene();
        let mut playback = Self {
            environment: Environment::default(),
            topology: Topology::default(),
            rest: Vec::new(),
            frames: Vec::new(),
            tracks: BTreeMap::new(),
            deadline: Nanos::ZERO,
            warning: None,
        };
        let (mut rows, mut bytes) = (Rows::default(), 0);
        for entry in reader.readable() {
            match entry {
                LogEntry::Environment(environment) => playback.environment = environment,
                LogEntry::Scene(frame) => {
                    if playback.frames.is_empty() {
                        playback.topology = Topology::of(&frame.triangles);
                        playback.rest.clone_from(&frame.points);
                    }
                    // A picture of another body, in a log that was put together, is not shown.
                    if frame.points.len() != playback.rest.len() {
                        continue;
                    }
                    let surface = frames::surface(frame.time.as_secs_f64(), frame.points.iter().copied(), &[]);
                    bytes += surface.len();
                    if bytes > MOST_BYTES {
                        let end = frame.time.as_secs_f64();
                        playback.warning =
                            Some(format!("Only the first {end:.0} s are shown: the pictures are more than 512 MB."));
                        break;
                    }
                    playback.frames.push(Frame { time: frame.time, surface });
                }
                LogEntry::Record(record) => {
                    rows.push(&record);
                    playback.push(&record);
                }
                _ => {}
            }
        }
        if playback.frames.is_empty() {
            let message = "it has no pictures (topic /scene): record it with `palpate run SCENE --log-scene` or `palpate view --out`";
            return Err(Error::new(ErrorKind::Log, message).at(reader.place()));
        }
        if let Some(damage) = reader.damage() {
            playback.warning = Some(format!("The log is damaged: {damage}"));
        }
        playback.deadline = rows.deadline();
        for (device, time, row) in rows.all() {
            playback.tracks.entry(device).or_default().rows.push((time, row));
        }
        Ok(playback)
    }

    fn push(&mut self, record: &LogRecord) {
        let (device, time) = (record.device(), record.time());
        let mut add = |push: &dyn Fn(&mut Track)| push(self.tracks.entry(device).or_default());
        match record {
            LogRecord::Tool(sample) => add(&|track| track.tools.push(*sample)),
            LogRecord::Contact(contact) => add(&|track| track.contacts.push(*contact)),
            LogRecord::ContactPoint(point) => {
                let touch = Touch { place_m: point.place_m, force_n: point.force_n, triangle: point.triangle, device };
                add(&|track| track.touches.push((time, touch)));
            }
            _ => {}
        }
    }

    /// From the first picture to the last.
    fn span(&self) -> [Nanos; 2] {
        [self.frames.first(), self.frames.last()].map(|frame| frame.map_or(Nanos::ZERO, |frame| frame.time))
    }

    fn begun(&self) -> Begun {
        let [from, to] = self.span();
        let named = |device: u16| self.environment.devices.get(usize::from(device));
        let hello = json!({
            "kind": "hello",
            "mode": "log",
            "model": self.environment.model,
            "body": self.environment.body,
            "warning": self.warning,
            "haptic_hz": self.environment.haptic_hz,
            "global_hz": self.environment.global_hz,
            "stages": self.environment.limit_stages,
            "has_samples": true,
            "can_restart": false,
            "from": from.as_secs_f64(),
            "to": to.as_secs_f64(),
            "times": self.frames.iter().map(|frame| frame.time.as_secs_f64()).collect::<Vec<_>>(),
            "tools": self.tracks.keys().map(|&device| json!({
                "name": named(device),
                "shape": shape(self.environment.shape(device)),
                "pointer": false,
            })).collect::<Vec<_>>(),
        });
        let topology = self.topology.bytes(self.rest.iter().copied());
        Begun { hello, topology, pointers: Vec::new(), homes: Vec::new(), bounds: [[0.0; 3]; 2] }
    }

    /// Shows browsers what they ask for, until the server ends.
    pub(crate) fn run(self, hub: &Arc<Hub>, wishes: &Receiver<(u64, Wish)>) {
        hub.begin(self.begun());
        let mut shown: BTreeMap<u64, Shown> = BTreeMap::new();
        while !hub.is_over() {
            match wishes.recv_timeout(LOOK) {
                Ok((browser, Wish::Seek { time })) => {
                    let shown = shown.entry(browser).or_default();
                    self.show(hub, browser, shown, Nanos::from_secs_f64(time.min(self.span()[1].as_secs_f64())));
                }
                Ok(_) | Err(RecvTimeoutError::Timeout) => {}
                Err(RecvTimeoutError::Disconnected) => return,
            }
        }
    }

    fn show(&self, hub: &Hub, browser: u64, shown: &mut Shown, time: Nanos) {
        let number = self.frames.partition_point(|frame| frame.time <= time).saturating_sub(1);
        let frame = &self.frames[number];
        let (samples, is_jump) = missing(shown.samples, time);
        let tools = self.tools(time, frame);
        hub.to_one(browser, |outbox| {
            if shown.frame != Some(number) {
                outbox.show(Picture::Surface, frame.surface.clone());
            }
            outbox.show(Picture::Tools, tools);
            if is_jump {
                outbox.forget_samples();
                outbox.say(json!({ "kind": "clear" }));
            }
            for (&device, track) in &self.tracks {
                let rows = within(&track.rows, samples, |row| row.0);
                if !rows.is_empty() {
                    outbox.plot(block(device, self.deadline, rows));
                }
            }
        });
        let from = if is_jump { samples[0] } else { shown.samples.map_or(samples[0], |span| span[0]) };
        *shown = Shown { frame: Some(number), samples: Some([from, time]) };
    }

    /// The tools at `time` beside the surface of another.
    fn tools(&self, time: Nanos, frame: &Frame) -> Bytes {
        let mut touches = Vec::new();
        // Between two ticks the contact of the first goes on.
        let recent = Nanos((2e9 / self.environment.haptic_hz).clamp(2e6, 1e8) as u64);
        let tools: Vec<ToolView> = self
            .tracks
            .values()
            .map(|track| {
                let before = |count: usize| count.checked_sub(1);
                let tool = before(track.tools.partition_point(|tool| tool.time <= time)).map(|at| track.tools[at]);
                let row = before(track.rows.partition_point(|row| row.0 <= time)).map(|at| track.rows[at]);
                let contact = before(track.contacts.partition_point(|contact| contact.time <= time));
                let contact = contact.map(|at| track.contacts[at]);
                let (tool, (_, row)) = (tool.unwrap_or_default(), row.unwrap_or_default());
                let is_now = |then: Nanos| time.saturating_sub(then) < recent;
                if let Some(tick) = before(track.touches.partition_point(|touch| touch.0 <= time)) {
                    let then = track.touches[tick].0;
                    let own = track.touches[..=tick].iter().rev().take_while(|touch| is_now(then) && touch.0 == then);
                    touches.extend(own.map(|touch| touch.1));
                } else if let Some(contact) = contact.filter(|contact| is_now(contact.time)) {
                    // A tool that is a point has no places of its own, in all of the log.
                    let node = |corner| frames::place(&frame.surface, corner).unwrap_or_default();
                    touches.extend(of_point(&contact, node, &self.topology));
                }
                ToolView {
                    time,
                    position: Vec3::from(tool.position_m),
                    orientation: tool.orientation,
                    computed_force: Vec3::from(row.force_n),
                    commanded_force: Vec3::from(row.command_n),
                    mode: contact.unwrap_or_default().mode,
                    ..ToolView::default()
                }
            })
            .collect();
        frames::tools(frame.time.as_secs_f64(), &tools, &[], &touches)
    }
}

/// The span of samples that a browser lacks at `time`, which has some already; and whether those are of no use.
fn missing(has: Option<[Nanos; 2]>, time: Nanos) -> ([Nanos; 2], bool) {
    match has {
        Some([_, to]) if (to..=to + STRIP).contains(&time) => ([to, time], false),
        _ => ([time.saturating_sub(STRIP), time], true),
    }
}

/// What of `items`, in the order of time, is after the first and not after the second of a span.
fn within<T>(items: &[T], [after, to]: [Nanos; 2], time: impl Fn(&T) -> Nanos) -> &[T] {
    let first = items.partition_point(|item| time(item) <= after);
    let end = items.partition_point(|item| time(item) <= to);
    &items[first..end.max(first)]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_browser_is_sent_each_sample_once_and_all_of_a_strip_after_a_jump() {
        let s = |seconds: f64| Nanos::from_secs_f64(seconds);
        assert_eq!(missing(None, s(6.0)), ([s(2.0), s(6.0)], true));
        assert_eq!(missing(Some([s(2.0), s(6.0)]), s(6.5)), ([s(6.0), s(6.5)], false));
        assert_eq!(missing(Some([s(2.0), s(6.0)]), s(5.9)), ([s(1.9), s(5.9)], true), "backwards");
        assert_eq!(missing(Some([s(2.0), s(6.0)]), s(11.0)), ([s(7.0), s(11.0)], true), "far on");
        let items: Vec<Nanos> = (0..10).map(Nanos).collect();
        assert_eq!(within(&items, [Nanos(3), Nanos(5)], |item| *item), &[Nanos(4), Nanos(5)]);
        assert!(within(&items, [Nanos(5), Nanos(3)], |item| *item).is_empty());
    }
}
