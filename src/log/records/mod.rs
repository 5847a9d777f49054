//! The records of a run, each fitting the runtime's 64-byte [`Record`], and what is known about the run as a whole.

mod environment;
mod event;
mod packing;
mod samples;
mod scene;

pub use self::environment::{Environment, GroupInfo, LoggedExecution, ModelReason};
pub(super) use self::environment::{MAX_GROUPS, SCHEMA_VERSION_KEY};
pub use self::event::{Level, TextEvent};
pub(crate) use self::packing::MAX_DEVICES;
pub use self::samples::{
    CommandSample, ContactSample, ForceSample, GlobalTick, ProbeSample, Resync, ServedBy, ToolSample,
};
pub use self::scene::{SceneFrame, SceneTool};

use crate::runtime::{ActorTimes, Channel, Event, Record, TickTiming};
use crate::runtime::{Nanos, PortUse};

/// Everything that a log can hold per tick.
///
/// # Real-time
/// Plain values: to make one of these a [`Record`], and to read it back, is wait-free and real-time safe.
///
/// ```
/// use palpate::log::{ForceSample, LogRecord};
/// use palpate::runtime::Record;
///
/// let sent = LogRecord::Force(ForceSample { force_n: [0.1, -0.2, 1e-300], ..ForceSample::default() });
/// let record = Record::from(sent);
/// assert_eq!(LogRecord::from_record(&record), Some(sent));
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
#[allow(missing_docs)]
pub enum LogRecord {
    Tick(TickTiming),
    Actors(ActorTimes),
    Event(Event),
    Port(PortUse),
    Force(ForceSample),
    Command(CommandSample),
    Tool(ToolSample),
    Contact(ContactSample),
    Resync(Resync),
    Global(GlobalTick),
    Probe(ProbeSample),
}

/// Does the same with whichever record it is.
macro_rules! each {
    ($record:expr, $r:ident => $of:expr) => {
        match $record {
            LogRecord::Tick($r) => $of,
            LogRecord::Actors($r) => $of,
            LogRecord::Event($r) => $of,
            LogRecord::Port($r) => $of,
            LogRecord::Force($r) => $of,
            LogRecord::Command($r) => $of,
            LogRecord::Tool($r) => $of,
            LogRecord::Contact($r) => $of,
            LogRecord::Resync($r) => $of,
            LogRecord::Global($r) => $of,
            LogRecord::Probe($r) => $of,
        }
    };
}

impl LogRecord {
    /// The log time: end of the tick, or the scheduled time of the release.
    pub fn time(&self) -> Nanos {
        each!(*self, r => Record::from(r).stamp)
    }

    /// The number of the device that it belongs to; 0 for what belongs to none.
    pub fn device(&self) -> u16 {
        match self {
            Self::Force(r) => r.device,
            Self::Command(r) => r.device,
            Self::Tool(r) => r.device,
            Self::Contact(r) => r.device,
            Self::Resync(r) => r.device,
            Self::Probe(r) => r.device,
            Self::Tick(_) | Self::Actors(_) | Self::Event(_) | Self::Port(_) | Self::Global(_) => 0,
        }
    }

    /// Reads a record back; `None` for channels that are not palpate's.
    pub fn from_record(record: &Record) -> Option<Self> {
        match record.channel {
            Channel::TICK => return Some(Self::Tick(TickTiming::from_record(record)?)),
            Channel::ACTORS => return Some(Self::Actors(ActorTimes::from_record(record)?)),
            Channel::EVENT => return Some(Self::Event(Event::from_record(record)?)),
            Channel::PORT => return Some(Self::Port(PortUse::from_record(record)?)),
            _ => {}
        }
        let (kind, device) = packing::kind_and_device(record.channel)?;
        Some(match kind {
            ForceSample::KIND => Self::Force(ForceSample::unpack(record, device)),
            CommandSample::KIND => Self::Command(CommandSample::unpack(record, device)),
            ToolSample::KIND => Self::Tool(ToolSample::unpack(record, device)),
            ContactSample::KIND => Self::Contact(ContactSample::unpack(record, device)),
            Resync::KIND => Self::Resync(Resync::unpack(record, device)),
            GlobalTick::KIND => Self::Global(GlobalTick::unpack(record, device)),
            ProbeSample::KIND => Self::Probe(ProbeSample::unpack(record, device)),
            _ => return None,
        })
    }
}

impl From<LogRecord> for Record {
    fn from(record: LogRecord) -> Self {
        each!(record, r => r.into())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_kind_survives_the_trip_through_a_record() {
        let time = Nanos(33_000_000);
        let records = [
            LogRecord::Force(ForceSample {
                time,
                force_n: [0.1, -0.2, 1e-300],
                model_version: 7,
                served_by: ServedBy::Predictive,
                model_age_s: 0.033,
                energy_j: 1e-9,
                device: 0,
            }),
            LogRecord::Command(CommandSample {
                time,
                force_n: [1.0, 2.0, 3.0],
                limits: 5,
                energy_j: -1e-3,
                tank_j: 1e-4,
                device: 1,
            }),
            LogRecord::Tool(ToolSample {
                time,
                id: 9,
                position_m: [1.0, 2.0, 3.0],
                velocity_m_s: [4.0, 5.0, 6.0],
                buttons: 1,
                device: 2,
            }),
            LogRecord::Contact(ContactSample {
                time,
                mode: crate::model::contact::ContactMode::Slip,
                triangle: 42,
                weights: [0.25, 0.5],
                normal: [0.0, 0.0, 1.0],
                normal_force_n: 1.5,
                tangential_force_n: 0.5,
                device: 3,
            }),
            LogRecord::Resync(Resync {
                time,
                version: 3,
                age: Nanos(1_000_000),
                jump_before_n: 0.25,
                jump_after_n: 0.125,
                energy_j: -1e-6,
                device: 4,
            }),
            LogRecord::Port(PortUse { time, port: 3, tick: 33, count: 1, ..PortUse::default() }),
            LogRecord::Global(GlobalTick { time, version: 2, first_tick: 1, last_tick: 33 }),
            LogRecord::Probe(ProbeSample {
                time,
                node: 5,
                local_m: [1.0, 2.0, 3.0],
                global_m: [4.0, 5.0, 6.0],
                device: 5,
            }),
        ];
        for record in records {
            assert_eq!(LogRecord::from_record(&record.into()), Some(record));
            assert_eq!(record.time(), time);
        }
    }
}
