//! Reduced models of a body, and where a scene's local model may be trusted.

pub mod findings;
mod report;
mod study;

pub use report::{locality_verdict, to_html, to_json, to_text};
pub use study::{MeshStudy, PaperStudy, ReduceOptions, ReduceProgress, reduce_mesh, reduce_paper, reduce_scene};
