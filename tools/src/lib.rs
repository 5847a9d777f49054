//! What studies a run, a log or a body with palpate: the command `palpate`, and the parts it is made of.
//!
//! | module | what it does |
//! | --- | --- |
//! | `timing` | says who was late in a log, why, and what it did to the force: text, JSON, a page |
//! | [`compare`] | runs every local model on a scene and measures error and cost against `full` |
//! | `reduce` | reduces a body's model and says where a local model may be trusted |
//! | `reduction` | the numerics of that: balanced truncation, Krylov spaces, condensation |
//! | `mesh` | says what a mesh consists of, how good it is and which step it allows |
//! | `export` | writes topics of a log as CSV, percentile files and Chrome traces; its rows for other formats |
//! | `log_file` | looks into a log file, checks it, and saves what is readable of a damaged one |
//! | [`drawing`] | charts as SVG, pages as HTML |
//!
//! It is no library for programs: public is what the repository's own benches and pictures, the program `palpate-parquet` and the Python
//! package need.

mod commands;
pub mod compare;
pub mod drawing;
mod export;
mod log_file;
mod mesh;
mod reduce;
mod reduction;
#[cfg(test)]
mod tests;
mod timing;
mod units;

pub use commands::{OutputFile, WindowArgs, main};
pub use export::{TableWriter, columns, export_rows, is_turned};
#[cfg(feature = "link")]
pub use palpate_link::TLS_RUNTIME;
pub use reduce::{ReduceOptions, reduction_costs, reduction_json};
