//! The timing of a run in detail: who was late, why, and what it did to the force, from one pass over its log.
//!
//! [`TimingAnalysis`] reads entries in the order of the log and keeps what a report needs: memory grows with the number
//! of distinct durations and not with the length of the run. [`TimingReport`] holds the result.

mod against;
mod analysis;
mod blocks;
mod bootstrap;
mod charts;
mod condition;
mod cores;
mod cyclictest;
mod figures;
mod group;
mod haptics;
mod html;
mod json;
mod over_time;
mod recent;
mod selection;
mod text;
mod worst;

pub use against::{Against, ComparedFigure};
pub use analysis::{TimingAnalysis, TimingReport};
pub use blocks::{Block, Buckets};
pub use charts::{Bin, Shape};
pub use condition::Condition;
pub use cores::CoreUse;
pub use cyclictest::read_cyclictest;
pub(crate) use figures::cause_name;
pub use figures::{Figure, Unit, Value};
pub use group::{ActorTiming, GroupTiming, TickBin};
pub use haptics::{DeviceTiming, ForceBin, ResyncBin};
pub use over_time::OverTime;
pub use recent::{ForcePoint, Moment};
pub use selection::Selection;
pub use worst::WorstTick;
pub use html::timing_html;
pub use json::{against_to_json, timing_to_json, to_json};
pub use text::{against_to_text, figure_to_text, timing_to_text};
