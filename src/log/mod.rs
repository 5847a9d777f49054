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
mod entry;
mod environment;
mod event;
pub mod group;
mod haptics;
mod percentiles;
mod records;
mod scene_frame;
mod stats;
mod vector;
pub use vector::magnitude;
mod window;

mod backlog;
pub mod chunk;
mod convert;
mod foreign;
mod foxglove;
pub mod framing;
mod proto;
pub mod reader;
mod scene_update;
mod schema;
pub mod topic;
mod viewer;
mod writer;

pub use analysis::{Analysis, RunReport};
pub use entry::LogEntry;
pub use environment::{Environment, Execution, GroupInfo, ModelReason};
pub use event::{Level, TextEvent};
pub use group::{CauseCounts, GroupCounter, GroupReport, TickFigures, TickGauge};
pub use haptics::{ContactReport, DeviceReport, EnergyReport, ForceReport, LimitReport, ResyncReport};
pub use percentiles::{Distribution, Magnitudes, Percentiles};
pub(crate) use records::MAX_DEVICES;
pub use records::{
    CommandSample, ContactMode, ContactSample, ForceSample, GlobalTick, LogRecord, ProbeSample, Resync, ServedBy,
    ToolSample,
};
pub use scene_frame::{SceneFrame, SceneTool};
pub use stats::{EventSum, GroupStats, StatsCounter};
pub use window::Window;

pub use backlog::{Backlog, BacklogProgress};
pub use reader::LogReader;
pub use writer::McapWriter;
