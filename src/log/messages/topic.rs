//! The topics of a log: what each is called and which message it carries.

use super::foxglove::{Log, PoseInFrame, SceneUpdate};
use super::{ActorTimes, Contact, LogMessage};
use crate::log::records::{
    CommandSample, Environment, ForceSample, GlobalTick, LinkSample, LogRecord, ProbeSample, Resync,
};
use crate::log::stats::GroupStats;
use crate::runtime::TickTiming;
use crate::runtime::{InputUse, PortUse};

/// The kinds of messages that palpate logs, one for each kind of topic.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
#[allow(missing_docs)]
pub enum TopicKind {
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
    Inputs,
    Probe,
    Scene,
    Log,
    Link,
}

/// A topic of a log: its kind, and the number of the rate group or device that it is of, 0 if it is of none.
///
/// ```
/// use palpate::log::{Environment, ForceSample, LogRecord, Topic, TopicKind};
///
/// let topic = Topic::of(&LogRecord::Force(ForceSample::default()));
/// assert_eq!(topic, Topic(TopicKind::Force, 0));
/// assert_eq!(topic.name(&Environment::default()), "/force");
/// ```
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct Topic(pub TopicKind, pub u16);

use TopicKind as Kind;

/// The kinds that each device has a topic of, in the order in which a log declares them.
const OF_DEVICE: [Kind; 6] = [Kind::Force, Kind::ForceCommanded, Kind::Tool, Kind::Contact, Kind::Resync, Kind::Probe];

/// The group whose releases are those of a link.
pub(crate) const LINK_GROUP: &str = "link";

/// The topics that every log declares, `/link` only where there is one; `/scene` only those that have it.
const SHARED: [Kind; 5] = [Kind::Global, Kind::Ports, Kind::Inputs, Kind::Log, Kind::Link];

impl Topic {
    /// The topics that the log of `environment` declares, whether or not anything is written there; `/actors` only where
    /// there are several.
    pub fn declared(environment: &Environment) -> impl Iterator<Item = Self> {
        let number = |count: usize| 0..u16::try_from(count).unwrap_or(u16::MAX);
        let has_actors =
            |group: &u16| environment.groups.get(usize::from(*group)).is_some_and(|g| !g.actors.is_empty());
        let groups = number(environment.groups.len());
        let timed = groups.clone().flat_map(|group| [Self(Kind::Timing, group), Self(Kind::Stats, group)]);
        let actors = groups.filter(has_actors).map(|group| Self(Kind::Actors, group));
        let of_device = |device| OF_DEVICE.map(|kind| Self(kind, device));
        let devices = number(environment.devices.len().max(1)).flat_map(of_device);
        let has_link = environment.groups.iter().any(|group| group.name == LINK_GROUP);
        let shared = SHARED.into_iter().filter(move |&kind| kind != Kind::Link || has_link);
        timed.chain(actors).chain(devices).chain(shared.map(|kind| Self(kind, 0)))
    }

    /// The topic where `record` belongs.
    pub fn of(record: &LogRecord) -> Self {
        match record {
            LogRecord::Tick(r) => Self(Kind::Timing, r.group),
            LogRecord::Actors(r) => Self(Kind::Actors, r.group),
            LogRecord::Event(_) => Self(Kind::Log, 0),
            LogRecord::Force(r) => Self(Kind::Force, r.device),
            LogRecord::Command(r) => Self(Kind::ForceCommanded, r.device),
            LogRecord::Tool(r) => Self(Kind::Tool, r.device),
            LogRecord::ContactPoint(r) => Self(Kind::Contact, r.device),
            LogRecord::Contact(r) => Self(Kind::Contact, r.device),
            LogRecord::Resync(r) => Self(Kind::Resync, r.device),
            LogRecord::Global(_) => Self(Kind::Global, 0),
            LogRecord::Port(_) => Self(Kind::Ports, 0),
            LogRecord::Input(_) => Self(Kind::Inputs, 0),
            LogRecord::Probe(r) => Self(Kind::Probe, r.device),
            LogRecord::Link(_) => Self(Kind::Link, 0),
        }
    }

    /// The name of the topic in the log of `environment`, which has the names of groups and devices.
    pub fn name(self, environment: &Environment) -> String {
        let Self(kind, number) = self;
        let word = kind.word();
        match kind {
            Kind::Timing | Kind::Actors | Kind::Stats => format!("/{word}/{}", environment.group_name(number)),
            Kind::Global | Kind::Ports | Kind::Inputs | Kind::Scene | Kind::Log | Kind::Link => format!("/{word}"),
            _ => format!("{}/{word}", environment.device_prefix(number)),
        }
    }
}

impl TopicKind {
    /// Its word in the names of topics, and the name of its message.
    fn word_and_schema(self) -> (&'static str, &'static str) {
        match self {
            Self::Timing => ("timing", TickTiming::NAME),
            Self::Actors => ("actors", ActorTimes::NAME),
            Self::Stats => ("stats", GroupStats::NAME),
            Self::Force => ("force", ForceSample::NAME),
            Self::ForceCommanded => ("force_commanded", CommandSample::NAME),
            Self::Tool => ("tool", PoseInFrame::NAME),
            Self::Contact => ("contact", Contact::NAME),
            Self::Resync => ("resync", Resync::NAME),
            Self::Global => ("global", GlobalTick::NAME),
            Self::Ports => ("ports", PortUse::NAME),
            Self::Inputs => ("inputs", InputUse::NAME),
            Self::Probe => ("probe", ProbeSample::NAME),
            Self::Scene => ("scene", SceneUpdate::NAME),
            Self::Log => ("log", Log::NAME),
            Self::Link => ("link", LinkSample::NAME),
        }
    }

    fn word(self) -> &'static str {
        self.word_and_schema().0
    }

    /// The name of the message.
    pub(crate) fn schema(self) -> &'static str {
        self.word_and_schema().1
    }

    /// All kinds.
    fn all() -> impl Iterator<Item = Self> {
        let others = [Self::Timing, Self::Actors, Self::Stats, Self::Scene];
        others.into_iter().chain(OF_DEVICE).chain(SHARED)
    }

    /// The kind of messages with this schema, if palpate has written them. Those with well-known names may be another
    /// program's: they lack palpate's own fields, and so does their descriptor.
    pub fn of_schema(name: &str, descriptor: &[u8]) -> Option<Self> {
        const OWN_FIELD: &[u8] = b"time_ns";
        let has_own = || descriptor.windows(OWN_FIELD.len()).any(|window| window == OWN_FIELD);
        Self::all().find(|kind| kind.schema() == name).filter(|_| !name.starts_with("foxglove.") || has_own())
    }

    /// The kind of a topic of this name in any log of palpate's.
    pub fn of_topic(name: &str) -> Option<Self> {
        let name = name.strip_prefix('/')?;
        match name.split_once('/') {
            None => OF_DEVICE.into_iter().chain(SHARED).find(|kind| kind.word() == name),
            Some((first, second)) => [Self::Timing, Self::Actors, Self::Stats]
                .into_iter()
                .find(|kind| kind.word() == first && !second.is_empty())
                // A device's own, where there are several.
                .or_else(|| OF_DEVICE.into_iter().find(|kind| kind.word() == second)),
        }
    }
}
