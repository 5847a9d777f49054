//! Reports about a run: for a terminal, for programs, and its records as tables.

pub mod compare;
mod html;
mod picture;
mod svg;
mod units;
mod verdict;

#[cfg(feature = "log")]
mod export;
#[cfg(feature = "cli")]
mod json;
mod text;

#[cfg(feature = "log")]
pub use export::{Figure, Format, Window, export, export_percentiles, export_table, export_trace};
#[cfg(feature = "cli")]
pub use json::to_json;
pub use picture::{COLOURS, Picture, Series};
pub use text::to_text;
pub use verdict::{Verdict, verdict};
