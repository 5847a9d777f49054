//! Reduced models of a body, and where a scene's local model may be trusted.

mod findings;
mod report;
mod study;

pub use findings::{Locality, ReductionStudy};
pub(crate) use report::{locality_verdict, to_html, to_json, to_text};
pub(crate) use study::{MeshStudy, reduce_mesh};
pub use study::{PaperStudy, ReduceOptions, reduce_paper, reduce_scene};
