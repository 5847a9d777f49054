//! What a run leaves behind: typed records, and MCAP files with protobuf messages.
//!
//! | to | there is |
//! | --- | --- |
//! | hold what a tick did | [`LogRecord`] and the samples in it; [`JoinedRecords`] reads them from the runtime's records |
//! | write a log | [`McapWriter`], after an [`Environment`] that says what was run |
//! | read one | [`LogReader`], which gives a [`LogEntry`] after the other |
//! | sum a run up | [`Analysis`], which gives a [`RunReport`] |
//!
//! Any MCAP viewer opens the files: they carry the descriptors of their messages.
//!
//! # Real-time
//! The records are plain values: to make them and to convert them is wait-free and real-time safe. All else here
//! allocates: it is for the logger, and for the time after a run.

mod analysis;
mod entry;
mod messages;
mod percentiles;
mod reader;
mod records;
mod stats;
mod writer;

pub use self::analysis::{
    Analysis, ContactReport, DeviceReport, EnergyReport, ForceReport, GroupCounter, GroupSummary, LimitReport,
    ResyncReport, RunReport, TickFigures, TickGauge, TouchReport, magnitude,
};
pub use self::entry::{LogEntry, Window};
pub(crate) use self::messages::topic::LINK_GROUP;
pub use self::percentiles::{Distribution, Magnitudes, Percentiles};
pub use self::reader::{LogReader, Topic, TopicKind};
pub use self::records::{
    CommandSample, ContactPointSample, ContactSample, Environment, ForceSample, GlobalTick, GroupInfo, JoinedRecords,
    Level, LinkSample, LogRecord, LoggedExecution, ModelReason, ProbeSample, Resync, SceneFrame, SceneTool, ServedBy,
    TextEvent, ToolSample,
};
pub(crate) use self::records::{MAX_DEVICES, WaitingPoints};
pub(crate) use self::stats::StatsCounter;
pub use self::stats::{EventSum, GroupStats};
pub use self::writer::McapWriter;
pub(crate) use self::writer::{Backlog, BacklogProgress};

/// A log as a file: its records as they are, for programs that check or recover one.
pub mod file {
    pub use super::reader::{ChunkHead, ChunkRecords, RecordStream, Section, parse_record};
}
