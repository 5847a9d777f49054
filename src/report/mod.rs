//! Reports about a run: for a terminal, for programs, and its records as tables.

pub mod compare;
mod html;
mod json_string;
mod picture;
pub mod reduce;
mod svg;
mod timing;
mod units;
mod verdict;

mod export;
mod json;
mod text;

pub use export::{Figure, Format, export, export_percentiles, export_table, export_trace};
pub use json::{against_to_json, timing_to_json, to_json};
pub use picture::{COLOURS, Picture, Series};
pub use text::{against_to_text, figure_to_text, timing_to_text, to_text};
pub use timing::timing_html;
pub use verdict::{Verdict, verdict};
