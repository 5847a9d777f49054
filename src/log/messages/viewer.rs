//! Tool samples, events and scenes as the messages that viewers know, and back bit for bit.

use super::foxglove::{self, Log, Pose, PoseInFrame, Quaternion, Timestamp, Vector3};
use crate::log::records::{Level, TextEvent, ToolSample};
use crate::model::{Turn, turn_of};
use crate::runtime::Event;
use crate::runtime::Nanos;

/// The one frame of reference, world coordinates.
pub(super) const FRAME: &str = "world";

/// No rotation.
pub(super) const UPRIGHT: Quaternion = Quaternion { x: 0.0, y: 0.0, z: 0.0, w: 1.0 };

const NANOS_PER_SECOND: u64 = 1_000_000_000;

/// Log time as viewers read it: `time` since the start of the run, which was at `epoch_ns`.
pub(super) fn timestamp(epoch_ns: u64, time: Nanos) -> Timestamp {
    let ns = epoch_ns.saturating_add(time.0);
    Timestamp { seconds: (ns / NANOS_PER_SECOND).cast_signed(), nanos: (ns % NANOS_PER_SECOND) as i32 }
}

pub(super) fn vector([x, y, z]: [f64; 3]) -> Vector3 {
    Vector3 { x, y, z }
}

fn array(v: Vector3) -> [f64; 3] {
    [v.x, v.y, v.z]
}

pub(super) fn quaternion(turn: &Turn) -> Quaternion {
    Quaternion { x: turn.i, y: turn.j, z: turn.k, w: turn.w }
}

/// The turn, bit for bit; none where a log says nothing.
fn turn(q: &Quaternion) -> Turn {
    let Quaternion { x, y, z, w } = *q;
    if [x, y, z, w] == [0.0; 4] { Turn::identity() } else { turn_of([w, x, y, z]) }
}

impl PoseInFrame {
    /// The sample of a run that started at `epoch_ns`.
    pub(crate) fn of(r: &ToolSample, epoch_ns: u64) -> Self {
        Self {
            timestamp: timestamp(epoch_ns, r.time),
            frame_id: FRAME.into(),
            pose: Pose { position: vector(r.position_m), orientation: quaternion(&r.orientation) },
            time_ns: r.time,
            id: r.id,
            velocity_m_s: vector(r.velocity_m_s),
            buttons: r.buttons,
            device: r.device,
        }
    }
}

impl From<PoseInFrame> for ToolSample {
    fn from(m: PoseInFrame) -> Self {
        Self {
            time: m.time_ns,
            id: m.id,
            position_m: array(m.pose.position),
            velocity_m_s: array(m.velocity_m_s),
            buttons: m.buttons,
            orientation: turn(&m.pose.orientation),
            device: m.device,
        }
    }
}

impl From<Level> for foxglove::Level {
    fn from(level: Level) -> Self {
        match level {
            Level::Info => Self::Info,
            Level::Warning => Self::Warning,
            Level::Error => Self::Error,
        }
    }
}

/// Who says what no rate group says.
const SESSION: &str = "session";

impl Log {
    /// An event in words, of a run that started at `epoch_ns`.
    pub(crate) fn text(event: &TextEvent, epoch_ns: u64) -> Self {
        Self {
            timestamp: timestamp(epoch_ns, event.time),
            level: event.level.into(),
            message: event.message.clone(),
            name: SESSION.into(),
            time_ns: event.time,
            ..Self::default()
        }
    }

    /// An event record of the rate group named `group`, in words and as numbers.
    pub(crate) fn coded(event: &Event, group: &str, epoch_ns: u64) -> Self {
        Self {
            name: group.into(),
            coded: true,
            group: event.group,
            code: event.code.code(),
            detail: event.detail,
            ..Self::text(&TextEvent::describe(event, group), epoch_ns)
        }
    }

    /// The event record it came from; `None` if it never was one.
    pub(crate) fn event(&self) -> Option<Event> {
        self.coded.then_some(Event {
            stamp: self.time_ns,
            group: self.group,
            code: self.code.into(),
            detail: self.detail,
        })
    }
}

impl From<Log> for TextEvent {
    fn from(m: Log) -> Self {
        let level = match m.level {
            foxglove::Level::Debug | foxglove::Level::Info => Level::Info,
            foxglove::Level::Warning => Level::Warning,
            // An unknown level reads as an error, so that nothing grave goes unseen.
            foxglove::Level::Unknown | foxglove::Level::Error | foxglove::Level::Fatal => Level::Error,
        };
        Self { time: m.time_ns, level, message: m.message }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const EPOCH: u64 = 1_700_000_000_123_456_789;

    #[test]
    fn a_message_says_the_time_twice_as_viewers_and_as_replays_want_it() {
        let sample = ToolSample { time: Nanos(1_900_000_000), ..ToolSample::default() };
        let message = PoseInFrame::of(&sample, EPOCH);
        assert_eq!((message.timestamp.seconds, message.timestamp.nanos), (1_700_000_002, 23_456_789));
        assert_eq!(message.time_ns, sample.time);
    }

    #[test]
    fn every_level_keeps_its_meaning_and_its_well_known_number() {
        for (level, number) in [(Level::Info, 2), (Level::Warning, 3), (Level::Error, 4)] {
            let event = TextEvent { time: Nanos(7), level, message: "something".into() };
            let message = Log::text(&event, EPOCH);
            assert_eq!((message.level as i32, message.name.as_str()), (number, "session"));
            assert_eq!(TextEvent::from(message), event);
        }
    }

    #[test]
    fn a_coded_event_names_its_group_and_comes_back() {
        let event = Event { stamp: Nanos(5), group: 1, code: Event::FAULT, detail: u64::MAX };
        let message = Log::coded(&event, "global", EPOCH);
        assert_eq!((message.name.as_str(), message.event()), ("global", Some(event)));
    }
}
