//! The topics of a log: what each is called and which message it carries.

use super::environment::Environment;
use super::records::LogRecord;
use super::schema::{self, LogMessage};

/// One topic; groups by their number.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub(crate) enum Topic {
    Timing(u16),
    Stats(u16),
    Force,
    ForceCommanded,
    Tool,
    Contact,
    Resync,
    Global,
    Ports,
    Probe,
    Log,
}

/// Which message a topic carries.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Kind {
    Timing,
    Stats,
    Force,
    ForceCommanded,
    Tool,
    Contact,
    Resync,
    Global,
    Ports,
    Probe,
    Log,
}

impl Topic {
    /// The topics that every log declares, beside those of its groups.
    pub(crate) const FIXED: [Self; 9] = [
        Self::Force,
        Self::ForceCommanded,
        Self::Tool,
        Self::Contact,
        Self::Resync,
        Self::Global,
        Self::Ports,
        Self::Probe,
        Self::Log,
    ];

    /// Where `record` belongs.
    pub(crate) fn of(record: &LogRecord) -> Self {
        match record {
            LogRecord::Tick(r) => Self::Timing(r.group),
            LogRecord::Event(_) => Self::Log,
            LogRecord::Force(_) => Self::Force,
            LogRecord::Command(_) => Self::ForceCommanded,
            LogRecord::Tool(_) => Self::Tool,
            LogRecord::Contact(_) => Self::Contact,
            LogRecord::Resync(_) => Self::Resync,
            LogRecord::Global(_) => Self::Global,
            LogRecord::Port(_) => Self::Ports,
            LogRecord::Probe(_) => Self::Probe,
        }
    }

    pub(crate) fn name(self, environment: &Environment) -> String {
        match self {
            Self::Timing(group) => format!("/timing/{}", environment.group_name(group)),
            Self::Stats(group) => format!("/stats/{}", environment.group_name(group)),
            Self::Force => "/force".into(),
            Self::ForceCommanded => "/force_commanded".into(),
            Self::Tool => "/tool".into(),
            Self::Contact => "/contact".into(),
            Self::Resync => "/resync".into(),
            Self::Global => "/global".into(),
            Self::Ports => "/ports".into(),
            Self::Probe => "/probe".into(),
            Self::Log => "/log".into(),
        }
    }

    pub(crate) fn kind(self) -> Kind {
        match self {
            Self::Timing(_) => Kind::Timing,
            Self::Stats(_) => Kind::Stats,
            Self::Force => Kind::Force,
            Self::ForceCommanded => Kind::ForceCommanded,
            Self::Tool => Kind::Tool,
            Self::Contact => Kind::Contact,
            Self::Resync => Kind::Resync,
            Self::Global => Kind::Global,
            Self::Ports => Kind::Ports,
            Self::Probe => Kind::Probe,
            Self::Log => Kind::Log,
        }
    }
}

impl Kind {
    const ALL: [Self; 11] = [
        Self::Timing,
        Self::Stats,
        Self::Force,
        Self::ForceCommanded,
        Self::Tool,
        Self::Contact,
        Self::Resync,
        Self::Global,
        Self::Ports,
        Self::Probe,
        Self::Log,
    ];

    /// The name of the message.
    pub(crate) fn schema(self) -> &'static str {
        match self {
            Self::Timing => schema::TickTiming::NAME,
            Self::Stats => schema::Stats::NAME,
            Self::Force => schema::Force::NAME,
            Self::ForceCommanded => schema::CommandedForce::NAME,
            Self::Tool => schema::Tool::NAME,
            Self::Contact => schema::Contact::NAME,
            Self::Resync => schema::Resync::NAME,
            Self::Global => schema::GlobalTick::NAME,
            Self::Ports => schema::PortUse::NAME,
            Self::Probe => schema::Probe::NAME,
            Self::Log => schema::Log::NAME,
        }
    }

    /// The kind whose message has this name.
    pub(crate) fn from_schema(name: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|kind| kind.schema() == name)
    }

    /// What a topic of this name carries in any log of palpate's.
    pub(crate) fn of_topic(name: &str) -> Option<Self> {
        let environment = Environment::default();
        let fixed = Topic::FIXED.into_iter().find(|topic| topic.name(&environment) == name).map(Topic::kind);
        let of_group = || {
            let (kind, group) = name.strip_prefix('/')?.split_once('/')?;
            match (kind, group.is_empty()) {
                ("timing", false) => Some(Self::Timing),
                ("stats", false) => Some(Self::Stats),
                _ => None,
            }
        };
        fixed.or_else(of_group)
    }
}
