//! Log files as files: what is in one, whether all of it is sound, and what of a damaged one can be saved.

mod check;
mod info;
mod message;
mod recover;
mod salvage;
mod summary;

pub use check::{CheckReport, check};
pub use info::{AttachmentInfo, ChunkInfo, LogInfo, TopicInfo};
pub use recover::{Lost, Recovered, recover};
pub use salvage::Damage;
