//! The topics of a log: what each is called and which message it carries.

use super::environment::Environment;
use super::foxglove;
use super::records::LogRecord;
use super::schema::{self, LogMessage};

/// One topic; groups by their number.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Topic {
    Timing(u16),
    Actors(u16),
    Stats(u16),
    Force(u16),
    ForceCommanded(u16),
    Tool(u16),
    Contact(u16),
    Resync(u16),
    Global,
    Ports,
    Probe(u16),
    Scene,
    Log,
}

/// Which message a topic carries.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Kind {
    Timing,
    Actors,
    Stats,
    Force,
    ForceCommanded,
    Tool,
    Contact,
    Resync,
    Global,
    Ports,
    Probe,
    Scene,
    Log,
}

impl Topic {
    /// The topics that the log of `environment` declares, whether or not anything is written there; `/actors` only where
    /// there are several.
    pub fn declared(environment: &Environment) -> impl Iterator<Item = Self> {
        let number = |count: usize| 0..u16::try_from(count).unwrap_or(u16::MAX);
        let has_actors =
            |group: &u16| environment.groups.get(usize::from(*group)).is_some_and(|g| !g.actors.is_empty());
        let of_groups = number(environment.groups.len()).flat_map(|group| [Self::Timing(group), Self::Stats(group)]);
        let of_groups = of_groups.chain(number(environment.groups.len()).filter(has_actors).map(Self::Actors));
        of_groups.chain(number(environment.devices.len().max(1)).flat_map(Self::of_device)).chain(Self::SHARED)
    }

    /// Declared by every log; `/scene` by those that have it.
    const SHARED: [Self; 3] = [Self::Global, Self::Ports, Self::Log];

    fn of_device(device: u16) -> [Self; 6] {
        [Self::Force, Self::ForceCommanded, Self::Tool, Self::Contact, Self::Resync, Self::Probe].map(|of| of(device))
    }

    /// Where `record` belongs.
    pub fn of(record: &LogRecord) -> Self {
        match record {
            LogRecord::Tick(r) => Self::Timing(r.group),
            LogRecord::Actors(r) => Self::Actors(r.group),
            LogRecord::Event(_) => Self::Log,
            LogRecord::Force(r) => Self::Force(r.device),
            LogRecord::Command(r) => Self::ForceCommanded(r.device),
            LogRecord::Tool(r) => Self::Tool(r.device),
            LogRecord::Contact(r) => Self::Contact(r.device),
            LogRecord::Resync(r) => Self::Resync(r.device),
            LogRecord::Global(_) => Self::Global,
            LogRecord::Port(_) => Self::Ports,
            LogRecord::Probe(r) => Self::Probe(r.device),
        }
    }

    pub fn name(self, environment: &Environment) -> String {
        let of_device = |device, what| format!("{}/{what}", environment.device_prefix(device));
        match self {
            Self::Timing(group) => format!("/timing/{}", environment.group_name(group)),
            Self::Actors(group) => format!("/actors/{}", environment.group_name(group)),
            Self::Stats(group) => format!("/stats/{}", environment.group_name(group)),
            Self::Force(device) => of_device(device, "force"),
            Self::ForceCommanded(device) => of_device(device, "force_commanded"),
            Self::Tool(device) => of_device(device, "tool"),
            Self::Contact(device) => of_device(device, "contact"),
            Self::Resync(device) => of_device(device, "resync"),
            Self::Global => "/global".into(),
            Self::Ports => "/ports".into(),
            Self::Probe(device) => of_device(device, "probe"),
            Self::Scene => "/scene".into(),
            Self::Log => "/log".into(),
        }
    }

    pub fn kind(self) -> Kind {
        match self {
            Self::Timing(_) => Kind::Timing,
            Self::Actors(_) => Kind::Actors,
            Self::Stats(_) => Kind::Stats,
            Self::Force(_) => Kind::Force,
            Self::ForceCommanded(_) => Kind::ForceCommanded,
            Self::Tool(_) => Kind::Tool,
            Self::Contact(_) => Kind::Contact,
            Self::Resync(_) => Kind::Resync,
            Self::Global => Kind::Global,
            Self::Ports => Kind::Ports,
            Self::Probe(_) => Kind::Probe,
            Self::Scene => Kind::Scene,
            Self::Log => Kind::Log,
        }
    }
}

impl Kind {
    const ALL: [Self; 13] = [
        Self::Timing,
        Self::Actors,
        Self::Stats,
        Self::Force,
        Self::ForceCommanded,
        Self::Tool,
        Self::Contact,
        Self::Resync,
        Self::Global,
        Self::Ports,
        Self::Probe,
        Self::Scene,
        Self::Log,
    ];

    /// The name of the message.
    pub fn schema(self) -> &'static str {
        match self {
            Self::Timing => schema::TickTiming::NAME,
            Self::Actors => schema::ActorTimes::NAME,
            Self::Stats => schema::Stats::NAME,
            Self::Force => schema::Force::NAME,
            Self::ForceCommanded => schema::CommandedForce::NAME,
            Self::Tool => foxglove::PoseInFrame::NAME,
            Self::Contact => schema::Contact::NAME,
            Self::Resync => schema::Resync::NAME,
            Self::Global => schema::GlobalTick::NAME,
            Self::Ports => schema::PortUse::NAME,
            Self::Probe => schema::Probe::NAME,
            Self::Scene => foxglove::SceneUpdate::NAME,
            Self::Log => foxglove::Log::NAME,
        }
    }

    /// The kind whose message has this name.
    pub fn from_schema(name: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|kind| kind.schema() == name)
    }

    /// What a topic of this name carries in any log of palpate's.
    pub fn of_topic(name: &str) -> Option<Self> {
        let environment = Environment::default();
        let shared = || Topic::declared(&environment).find(|topic| topic.name(&environment) == name).map(Topic::kind);
        let of_one = || {
            let (first, second) = name.strip_prefix('/')?.split_once('/')?;
            match (first, second.is_empty()) {
                ("timing", false) => Some(Self::Timing),
                ("actors", false) => Some(Self::Actors),
                ("stats", false) => Some(Self::Stats),
                // A device's own, where there are several.
                _ => Topic::of_device(0)
                    .into_iter()
                    .find(|topic| topic.name(&environment).strip_prefix('/') == Some(second))
                    .map(Topic::kind),
            }
        };
        shared().or_else(of_one)
    }
}
