//! The timing of a run in detail: who was late, why, and what it did to the force, from one pass over its log.
//!
//! [`TimingAnalysis`] reads entries in the order of the log and keeps what a report needs: memory grows with the number
//! of distinct durations and not with the length of the run. [`TimingReport`] holds the result.

mod against;
mod analysis;
mod bootstrap;
mod condition;
mod figures;
mod html;
mod json;
mod text;

pub(crate) use analysis::{Selection, TimingAnalysis, TimingReport, WorstTick};
pub(crate) use text::timing_to_text;

pub(crate) use against::{Against, ComparedFigure};
pub(crate) use analysis::{
    CoreUse, DeviceTiming, ForceBin, ForcePoint, GroupTiming, ResyncBin, Shape, TickBin, read_cyclictest,
};
pub(crate) use condition::Condition;
pub(crate) use figures::{Figure, FigureValue, Unit, cause_name};
pub(crate) use html::timing_html;
pub(crate) use json::{against_to_json, timing_to_json};
pub(crate) use text::{against_to_text, figure_to_text};
