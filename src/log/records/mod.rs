//! The records of a run, each fitting one or two of the runtime's 64-byte [`Record`]s, and what is known about the run as a whole.

mod contact;
mod environment;
mod event;
mod joined;
mod packing;
mod samples;
mod scene;

pub(crate) use self::contact::WaitingPoints;
pub use self::contact::{ContactPointSample, ContactSample};
pub use self::environment::{Environment, GroupInfo, LoggedExecution, ModelReason};
pub(super) use self::environment::{MAX_GROUPS, SCHEMA_VERSION_KEY};
pub use self::event::{Level, TextEvent};
pub use self::joined::JoinedRecords;
pub(crate) use self::packing::MAX_DEVICES;
pub use self::samples::{
    CommandSample, ForceSample, GlobalTick, LinkSample, ProbeSample, Resync, ServedBy, ToolSample,
};
pub use self::scene::{SceneFrame, SceneTool};

use self::packing::Recorded;
use crate::runtime::{ActorTimes, Channel, Event, Record, Recorder, TickTiming};
use crate::runtime::{InputUse, Nanos, PortUse};

/// Everything that a log can hold per tick.
///
/// # Real-time
/// Plain values: to make one of these [`Record`]s, and to read it back, is wait-free and real-time safe.
///
/// ```
/// use palpate::log::{ForceSample, JoinedRecords, LogRecord};
///
/// let sent = LogRecord::Force(ForceSample { force_n: [0.1, -0.2, 1e-300], ..ForceSample::default() });
/// let [part, record] = sent.to_records();
/// assert!(part.is_none(), "a torque would be one");
/// assert_eq!(JoinedRecords::default().read(&record.unwrap()), Some(sent));
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
#[allow(missing_docs)]
pub enum LogRecord {
    Tick(TickTiming),
    Actors(ActorTimes),
    Event(Event),
    Port(PortUse),
    Input(InputUse),
    Force(ForceSample),
    Command(CommandSample),
    Tool(ToolSample),
    ContactPoint(ContactPointSample),
    Contact(ContactSample),
    Resync(Resync),
    Global(GlobalTick),
    Probe(ProbeSample),
    Link(LinkSample),
}

/// Does the same with whichever record it is.
macro_rules! each {
    ($record:expr, $r:ident => $of:expr) => {
        match $record {
            LogRecord::Tick($r) => $of,
            LogRecord::Actors($r) => $of,
            LogRecord::Event($r) => $of,
            LogRecord::Port($r) => $of,
            LogRecord::Input($r) => $of,
            LogRecord::Force($r) => $of,
            LogRecord::Command($r) => $of,
            LogRecord::Tool($r) => $of,
            LogRecord::ContactPoint($r) => $of,
            LogRecord::Contact($r) => $of,
            LogRecord::Resync($r) => $of,
            LogRecord::Global($r) => $of,
            LogRecord::Probe($r) => $of,
            LogRecord::Link($r) => $of,
        }
    };
}

impl LogRecord {
    /// The log time: end of the tick, or the scheduled time of the release.
    pub fn time(&self) -> Nanos {
        each!(self, r => Recorded::time(r))
    }

    /// The number of the device that it belongs to; 0 for what belongs to none.
    pub fn device(&self) -> u16 {
        match self {
            Self::Force(r) => r.device,
            Self::Command(r) => r.device,
            Self::Tool(r) => r.device,
            Self::ContactPoint(r) => r.device,
            Self::Contact(r) => r.device,
            Self::Resync(r) => r.device,
            Self::Probe(r) => r.device,
            Self::Tick(_)
            | Self::Actors(_)
            | Self::Event(_)
            | Self::Port(_)
            | Self::Input(_)
            | Self::Global(_)
            | Self::Link(_) => 0,
        }
    }

    /// Its records in the order in which they are recorded: the part that holds what the second has no room for, if that is
    /// not what it usually is, and the record itself.
    pub fn to_records(&self) -> [Option<Record>; 2] {
        each!(self, r => r.records())
    }

    /// Records it: [`JoinedRecords`] reads it back.
    pub fn push_to(&self, recorder: &mut Recorder) {
        self.to_records().into_iter().flatten().for_each(|record| recorder.push(record));
    }

    /// Reads a record back that is a whole sample; `None` for channels that are not palpate's and for samples of two records.
    fn from_record(record: &Record) -> Option<Self> {
        match record.channel {
            Channel::TICK => return Some(Self::Tick(TickTiming::from_record(record)?)),
            Channel::ACTORS => return Some(Self::Actors(ActorTimes::from_record(record)?)),
            Channel::EVENT => return Some(Self::Event(Event::from_record(record)?)),
            Channel::PORT => return Some(Self::Port(PortUse::from_record(record)?)),
            Channel::INPUT => return Some(Self::Input(InputUse::from_record(record)?)),
            _ => {}
        }
        let (kind, device) = packing::kind_and_device(record.channel)?;
        Self::of_kind(kind, record, device)
    }

    /// Reads a record of palpate's own, as far as it goes.
    fn of_kind(kind: u16, record: &Record, device: u16) -> Option<Self> {
        Some(match kind {
            ForceSample::KIND => Self::Force(ForceSample::unpack(record, device)),
            CommandSample::KIND => Self::Command(CommandSample::unpack(record, device)),
            ToolSample::KIND => Self::Tool(ToolSample::unpack(record, device)),
            ContactPointSample::KIND => Self::ContactPoint(ContactPointSample::unpack(record, device)),
            ContactSample::KIND => Self::Contact(ContactSample::unpack(record, device)),
            Resync::KIND => Self::Resync(Resync::unpack(record, device)),
            GlobalTick::KIND => Self::Global(GlobalTick::unpack(record, device)),
            ProbeSample::KIND => Self::Probe(ProbeSample::unpack(record, device)),
            LinkSample::KIND => Self::Link(LinkSample::unpack(record, device)),
            _ => return None,
        })
    }
}

/// Records that have no part.
macro_rules! whole {
    ($($record:ty)*) => { $(
        impl Recorded for $record {
            fn time(&self) -> Nanos {
                Record::from(*self).stamp
            }

            fn records(&self) -> [Option<Record>; 2] {
                [None, Some((*self).into())]
            }
        }
    )* };
}

whole! { TickTiming ActorTimes Event PortUse InputUse }

#[cfg(test)]
mod tests {
    use super::*;
    use crate::model::Turn;

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
                torque_n_m: [1e-3, -0.0, 1e-300],
                device: 0,
            }),
            LogRecord::Command(CommandSample {
                time,
                force_n: [1.0, 2.0, 3.0],
                limits: 5,
                energy_j: -1e-3,
                tank_j: 1e-4,
                torque_n_m: [-0.0, 0.0, 0.0],
                device: 1,
            }),
            LogRecord::Tool(ToolSample {
                time,
                id: 9,
                position_m: [1.0, 2.0, 3.0],
                velocity_m_s: [4.0, 5.0, 6.0],
                buttons: 1,
                orientation: Turn::from_euler_angles(0.1, 0.2, 0.3),
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
                area_m2: 1e-6,
                count: 300,
                device: 3,
            }),
            LogRecord::ContactPoint(ContactPointSample {
                time,
                place_m: [0.1, -0.2, 1e-30],
                normal: [0.0, -0.0, 1.0],
                force_n: [1.0, 2.0, 3.0],
                triangle: u32::MAX - 1,
                mode: crate::model::contact::ContactMode::Slip,
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
            LogRecord::Input(InputUse { time, group: 1, port: 7, sequence: 2, value: [1, 2, 3, 4, u64::MAX] }),
            LogRecord::Global(GlobalTick { time, version: 2, first_tick: 1, last_tick: 33 }),
            LogRecord::Probe(ProbeSample {
                time,
                node: 5,
                local_m: [1.0, 2.0, 3.0],
                global_m: [4.0, 5.0, 6.0],
                device: 5,
            }),
            LogRecord::Link(LinkSample {
                time,
                epoch: 2,
                round_trip: Nanos(28_000_000),
                clock_ahead_s: -0.25,
                clock_drift_ppm: 12.0,
                sent: 1 << 40,
                received: 3,
                lost: 4,
            }),
        ];
        for record in records {
            let mut joined = JoinedRecords::default();
            let read: Vec<_> = record.to_records().iter().flatten().filter_map(|one| joined.read(one)).collect();
            assert_eq!(read, [record]);
            assert_eq!(record.time(), time);
        }
    }
}
