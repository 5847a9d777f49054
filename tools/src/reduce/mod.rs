//! Reduced models of a body, and where a scene's local model may be trusted.

mod costs;
mod findings;
mod report;
mod study;
#[cfg(test)]
mod tests;

pub use costs::reduction_costs;
pub(crate) use findings::ReductionStudy;
pub(crate) use report::{locality_verdict, to_html, to_json, to_text};
pub(crate) use study::{MeshStudy, reduce_mesh};
pub(crate) use study::{PaperStudy, ReduceOptions, reduce_paper, reduce_scene};
