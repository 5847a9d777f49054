//! The records of a haptic run, each fitting the runtime's 64-byte [`Record`].

use crate::runtime::PortUse;
use crate::runtime::{ActorTimes, Channel, Event, Record, TickTiming};
use crate::runtime::Nanos;

/// What served a haptic tick: a local model, or what it fell back to.
///
/// # Real-time
/// A plain value: its methods are wait-free and real-time safe.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, PartialOrd, Ord)]
#[repr(u16)]
#[allow(missing_docs)]
pub enum ServedBy {
    #[default]
    Unknown = 0,
    Full = 1,
    Hold = 2,
    Patch = 3,
    LinearBoundary = 4,
    ScaledBoundary = 5,
    Condensed = 6,
    /// `predictive` without its basis: the ring moves as predicted, whatever happens.
    Predicted = 7,
    Predictive = 8,
}

impl ServedBy {
    /// All, by number.
    pub const ALL: [Self; 9] = [
        Self::Unknown,
        Self::Full,
        Self::Hold,
        Self::Patch,
        Self::LinearBoundary,
        Self::ScaledBoundary,
        Self::Condensed,
        Self::Predicted,
        Self::Predictive,
    ];

    /// The one with this number; unknown numbers read as unknown.
    ///
    /// # Real-time
    /// Wait-free, real-time safe.
    pub fn from_code(code: u16) -> Self {
        Self::ALL.get(usize::from(code)).copied().unwrap_or_default()
    }

    /// Its name in reports.
    ///
    /// # Real-time
    /// Wait-free, real-time safe.
    pub fn name(self) -> &'static str {
        match self {
            Self::Unknown => "unknown",
            Self::Full => "full",
            Self::Hold => "hold",
            Self::Patch => "patch",
            Self::LinearBoundary => "linear_boundary",
            Self::ScaledBoundary => "scaled_boundary",
            Self::Condensed => "condensed",
            Self::Predicted => "predicted",
            Self::Predictive => "predictive",
        }
    }
}

/// The force of one haptic tick.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct ForceSample {
    /// End of the tick.
    pub time: Nanos,
    /// On the tool, mean over the tick, after blending, before safety (N).
    pub force_n: [f64; 3],
    /// Version of the local model that served the tick.
    pub model_version: u32,
    /// What that model was in this tick.
    pub served_by: ServedBy,
    /// Age of that model's last resync (s).
    pub model_age_s: f64,
    /// Energy that the tool has given to the simulation since the start, negative if it got some (J).
    pub energy_j: f64,
    /// Whose: the number of the device in the scene, from 0.
    pub device: u16,
}

/// What the device was commanded.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct CommandSample {
    /// End of the tick whose force it is.
    pub time: Nanos,
    /// The force after the safety pipeline (N).
    pub force_n: [f64; 3],
    /// Safety stages that acted: a bit each, see `safety::Actions`.
    pub limits: u16,
    /// The passivity ledger: what the virtual environment has taken in less what it gave out, and what it stored at the
    /// start (J).
    pub energy_j: f64,
    /// What is in the energy tank of model swaps (J).
    pub tank_j: f64,
    /// Whose: the number of the device in the scene, from 0.
    pub device: u16,
}

/// The tool as the device reported it.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct ToolSample {
    /// Scheduled time of the release that read it.
    pub time: Nanos,
    /// The device's sample number.
    pub id: u32,
    /// Position (m).
    pub position_m: [f64; 3],
    /// Velocity (m/s).
    pub velocity_m_s: [f64; 3],
    /// Pressed buttons, a bit each.
    pub buttons: u16,
    /// Whose: the number of the device in the scene, from 0.
    pub device: u16,
}

/// The state of a contact.
///
/// # Real-time
/// A plain value: its methods are wait-free and real-time safe.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
#[repr(u16)]
pub enum ContactMode {
    /// Not touching.
    #[default]
    Free = 0,
    /// Touching, inside the friction cone.
    Stick = 1,
    /// Touching, sliding.
    Slip = 2,
    /// Touching nodes that cannot move: no force can be computed.
    Lost = 3,
}

impl ContactMode {
    /// The mode with this number; unknown numbers read as free.
    pub fn from_code(code: u16) -> Self {
        match code {
            1 => Self::Stick,
            2 => Self::Slip,
            3 => Self::Lost,
            _ => Self::Free,
        }
    }
}

/// The contact at the end of one haptic tick.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct ContactSample {
    /// End of the tick.
    pub time: Nanos,
    /// The mode.
    pub mode: ContactMode,
    /// The global triangle id; `u32::MAX` without one.
    pub triangle: u32,
    /// Barycentric weights of the triangle's second and third node; the first is one minus both.
    pub weights: [f64; 2],
    /// Outward unit normal used.
    pub normal: [f64; 3],
    /// Force along the normal, mean over the tick (N).
    pub normal_force_n: f32,
    /// Magnitude of the force across it (N).
    pub tangential_force_n: f32,
    /// Whose: the number of the device in the scene, from 0.
    pub device: u16,
}

/// A resync: the local model was replaced by a newer one.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Resync {
    /// The tick in which its blend ended and it served alone.
    pub time: Nanos,
    /// Its version.
    pub version: u32,
    /// How old its state was when it arrived.
    pub age: Nanos,
    /// Difference of the new and the old model's force at the swap (N).
    pub jump_before_n: f64,
    /// Largest one-tick change of the force that the blend leaves of it (N).
    pub jump_after_n: f64,
    /// Energy that the tool has given to the simulation since the start, negative if it got some (J).
    pub energy_j: f64,
    /// Whose: the number of the device in the scene, from 0.
    pub device: u16,
}

/// One release of the global model.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct GlobalTick {
    /// Its scheduled time.
    pub time: Nanos,
    /// The version that it published; 0 if it published none.
    pub version: u32,
    /// Haptic tick of the first tool sample taken.
    pub first_tick: u64,
    /// Haptic tick of the last tool sample taken: the model's state belongs to it.
    pub last_tick: u64,
}

/// A probed node.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct ProbeSample {
    /// End of the tick.
    pub time: Nanos,
    /// Node id.
    pub node: u32,
    /// Position in the local model, or in the newest global one if the node is outside the patch (m).
    pub local_m: [f64; 3],
    /// Position in the newest global model that the tick could see (m).
    pub global_m: [f64; 3],
    /// Whose: the number of the device in the scene, from 0.
    pub device: u16,
}

/// Everything that a log can hold per tick.
///
/// # Real-time
/// Plain values: to make one of these a [`Record`], and to read it back, is wait-free and real-time safe.
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

/// What a record is about, beside whose it is.
const FORCE: u16 = 0;
const TOOL: u16 = 1;
const CONTACT: u16 = 2;
const RESYNC: u16 = 3;
const GLOBAL: u16 = 4;
const PROBE: u16 = 5;
const COMMAND: u16 = 6;

/// Channels of a device: each has its own of every kind.
const CHANNELS: u16 = 16;

/// As many devices as a scene can have; channels beyond theirs are a program's own.
pub(crate) const MAX_DEVICES: u16 = 8;

/// The channel of `kind` for `device`.
fn channel(kind: u16, device: u16) -> Channel {
    Channel(Channel::FIRST_USER.0.saturating_add(device.saturating_mul(CHANNELS)).saturating_add(kind))
}

impl LogRecord {
    /// The log time: end of the tick, or the scheduled time of the release.
    pub fn time(&self) -> Nanos {
        match self {
            Self::Tick(r) => r.scheduled,
            Self::Actors(r) => r.scheduled,
            Self::Event(r) => r.stamp,
            Self::Port(r) => r.time,
            Self::Force(r) => r.time,
            Self::Command(r) => r.time,
            Self::Tool(r) => r.time,
            Self::Contact(r) => r.time,
            Self::Resync(r) => r.time,
            Self::Global(r) => r.time,
            Self::Probe(r) => r.time,
        }
    }

    /// Whose it is: the number of the device; 0 for what belongs to none.
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
        let time = record.stamp;
        let [a, b, c, d, e, f] = record.floats();
        match record.channel {
            Channel::TICK => return Some(Self::Tick(TickTiming::from_record(record)?)),
            Channel::ACTORS => return Some(Self::Actors(ActorTimes::from_record(record)?)),
            Channel::EVENT => return Some(Self::Event(Event::from_record(record)?)),
            Channel::PORT => return Some(Self::Port(PortUse::from_record(record)?)),
            _ => {}
        }
        let number = record.channel.0.checked_sub(Channel::FIRST_USER.0)?;
        let device = number / CHANNELS;
        if device >= MAX_DEVICES {
            return None;
        }
        Some(match number % CHANNELS {
            FORCE => Self::Force(ForceSample {
                time,
                force_n: [a, b, c],
                model_version: record.index,
                served_by: ServedBy::from_code(record.code),
                model_age_s: d,
                energy_j: e,
                device,
            }),
            COMMAND => {
                let limits = record.code;
                Self::Command(CommandSample { time, force_n: [a, b, c], limits, energy_j: d, tank_j: e, device })
            }
            TOOL => Self::Tool(ToolSample {
                time,
                id: record.index,
                position_m: [a, b, c],
                velocity_m_s: [d, e, f],
                buttons: record.code,
                device,
            }),
            CONTACT => Self::Contact(ContactSample {
                time,
                mode: ContactMode::from_code(record.code),
                triangle: record.index,
                weights: [a, b],
                normal: [c, d, e],
                normal_force_n: f32::from_bits((record.words[5] >> 32) as u32),
                tangential_force_n: f32::from_bits(record.words[5] as u32),
                device,
            }),
            RESYNC => Self::Resync(Resync {
                time,
                version: record.index,
                age: Nanos(record.words[0]),
                jump_before_n: b,
                jump_after_n: c,
                energy_j: d,
                device,
            }),
            GLOBAL => Self::Global(GlobalTick {
                time,
                version: record.index,
                first_tick: record.words[0],
                last_tick: record.words[1],
            }),
            PROBE => {
                Self::Probe(ProbeSample { time, node: record.index, local_m: [a, b, c], global_m: [d, e, f], device })
            }
            _ => return None,
        })
    }
}

fn join(a: [f64; 3], b: [f64; 3]) -> [f64; 6] {
    [a[0], a[1], a[2], b[0], b[1], b[2]]
}

impl From<ForceSample> for Record {
    fn from(r: ForceSample) -> Self {
        let [x, y, z] = r.force_n;
        Self::with_floats(
            r.time,
            channel(FORCE, r.device),
            r.served_by as u16,
            r.model_version,
            [x, y, z, r.model_age_s, r.energy_j, 0.0],
        )
    }
}

impl From<CommandSample> for Record {
    fn from(r: CommandSample) -> Self {
        Self::with_floats(r.time, channel(COMMAND, r.device), r.limits, 0, join(r.force_n, [r.energy_j, r.tank_j, 0.0]))
    }
}

impl From<ToolSample> for Record {
    fn from(r: ToolSample) -> Self {
        Self::with_floats(r.time, channel(TOOL, r.device), r.buttons, r.id, join(r.position_m, r.velocity_m_s))
    }
}

impl From<ContactSample> for Record {
    fn from(r: ContactSample) -> Self {
        let mut record = Self::with_floats(
            r.time,
            channel(CONTACT, r.device),
            r.mode as u16,
            r.triangle,
            [r.weights[0], r.weights[1], r.normal[0], r.normal[1], r.normal[2], 0.0],
        );
        record.words[5] = u64::from(r.normal_force_n.to_bits()) << 32 | u64::from(r.tangential_force_n.to_bits());
        record
    }
}

impl From<Resync> for Record {
    fn from(r: Resync) -> Self {
        let mut record = Self::with_floats(
            r.time,
            channel(RESYNC, r.device),
            0,
            r.version,
            [0.0, r.jump_before_n, r.jump_after_n, r.energy_j, 0.0, 0.0],
        );
        record.words[0] = r.age.0;
        record
    }
}

impl From<GlobalTick> for Record {
    fn from(r: GlobalTick) -> Self {
        let words = [r.first_tick, r.last_tick, 0, 0, 0, 0];
        Self { stamp: r.time, channel: channel(GLOBAL, 0), code: 0, index: r.version, words }
    }
}

impl From<ProbeSample> for Record {
    fn from(r: ProbeSample) -> Self {
        Self::with_floats(r.time, channel(PROBE, r.device), 0, r.node, join(r.local_m, r.global_m))
    }
}

impl From<LogRecord> for Record {
    fn from(record: LogRecord) -> Self {
        match record {
            LogRecord::Tick(r) => r.into(),
            LogRecord::Actors(r) => r.into(),
            LogRecord::Event(r) => r.into(),
            LogRecord::Port(r) => r.into(),
            LogRecord::Force(r) => r.into(),
            LogRecord::Command(r) => r.into(),
            LogRecord::Tool(r) => r.into(),
            LogRecord::Contact(r) => r.into(),
            LogRecord::Resync(r) => r.into(),
            LogRecord::Global(r) => r.into(),
            LogRecord::Probe(r) => r.into(),
        }
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
                mode: ContactMode::Slip,
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
