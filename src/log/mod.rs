//! What a run leaves behind: typed records, and MCAP files with protobuf messages.
//!
//! [`LogRecord`] is what actors record and analysis reads; it is there without the `log` feature too, for programs
//! that keep records in memory.

mod records;

pub use records::{
    CommandSample, ContactMode, ContactSample, ForceSample, GlobalTick, LogRecord, ProbeSample, Resync, ToolSample,
};
