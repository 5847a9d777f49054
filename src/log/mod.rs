//! What a run leaves behind: typed records, and MCAP files with protobuf messages.
//!
//! [`LogRecord`] is what actors record and [`Analysis`] reads; both are there without the `log` feature too, for
//! programs that keep records in memory. With it, [`McapWriter`] and [`LogReader`] keep them in files that any MCAP
//! viewer opens.
//!
//! # Real-time
//! The records are plain values: to make them and to convert them is wait-free and real-time safe. All else here
//! allocates: it is for the logger, and for the time after a run.

mod analysis;
mod comparison;
mod entry;
mod environment;
mod event;
mod group;
mod haptics;
mod percentiles;
mod records;
pub mod reduction;
mod scene_frame;
mod stats;
pub mod timing;
mod vector;
mod window;

mod backlog;
mod check;
mod chunk;
mod convert;
mod foreign;
mod foxglove;
mod framing;
mod info;
mod message;
mod proto;
mod reader;
mod recover;
mod salvage;
mod scene_update;
mod schema;
mod summary;
pub(crate) mod topic;
mod viewer;
mod writer;

pub use analysis::{Analysis, RunReport};
pub use comparison::{ComparedRun, Comparison, ForceTrace, Measured, ModelCost, ModelError, RunOutcome};
pub use entry::LogEntry;
pub use environment::{Environment, Execution, GroupInfo, ModelReason};
pub use event::{Level, TextEvent};
pub(crate) use group::TickGauge;
pub use group::{CauseCounts, GroupReport};
pub use haptics::{ContactReport, DeviceReport, EnergyReport, ForceReport, LimitReport, ResyncReport};
pub use percentiles::{Distribution, Magnitudes, Percentiles};
pub(crate) use records::MAX_DEVICES;
pub use records::{
    CommandSample, ContactMode, ContactSample, ForceSample, GlobalTick, LogRecord, ProbeSample, Resync, ServedBy,
    ToolSample,
};
pub use scene_frame::{SceneFrame, SceneTool};
pub use stats::{EventSum, GroupStats, StatsCounter};
pub(crate) use vector::magnitude;
pub use window::Window;

pub use backlog::{Backlog, BacklogProgress};
pub use check::{CheckReport, check};
pub use info::{AttachmentInfo, ChunkInfo, LogInfo, TopicInfo};
pub use reader::LogReader;
pub use recover::{Lost, Recovered, recover};
pub use salvage::Damage;
pub use writer::McapWriter;
