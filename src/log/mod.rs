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

#[cfg(feature = "log")]
mod backlog;
#[cfg(feature = "log")]
mod check;
#[cfg(feature = "log")]
mod chunk;
#[cfg(feature = "log")]
mod convert;
#[cfg(feature = "log")]
mod foreign;
#[cfg(feature = "log")]
mod foxglove;
#[cfg(feature = "log")]
mod framing;
#[cfg(feature = "log")]
mod info;
#[cfg(feature = "log")]
mod message;
#[cfg(feature = "log")]
mod proto;
#[cfg(feature = "log")]
mod reader;
#[cfg(feature = "log")]
mod recover;
#[cfg(feature = "log")]
mod salvage;
#[cfg(feature = "log")]
mod scene_update;
#[cfg(feature = "log")]
mod schema;
#[cfg(feature = "log")]
mod summary;
#[cfg(feature = "log")]
pub(crate) mod topic;
#[cfg(feature = "log")]
mod viewer;
#[cfg(feature = "log")]
mod writer;

pub use analysis::{Analysis, RunReport};
pub use comparison::{ComparedRun, Comparison, ForceTrace, Measured, ModelCost, ModelError, RunOutcome};
pub use entry::LogEntry;
pub use environment::{Environment, Execution, GroupInfo, ModelReason};
pub use event::{Level, TextEvent};
#[cfg(feature = "log")]
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

#[cfg(feature = "log")]
pub use backlog::{Backlog, BacklogProgress};
#[cfg(feature = "log")]
pub use check::{CheckReport, check};
#[cfg(feature = "log")]
pub use info::{AttachmentInfo, ChunkInfo, LogInfo, TopicInfo};
#[cfg(feature = "log")]
pub use reader::LogReader;
#[cfg(feature = "log")]
pub use recover::{Lost, Recovered, recover};
#[cfg(feature = "log")]
pub use salvage::Damage;
#[cfg(feature = "log")]
pub use writer::McapWriter;
