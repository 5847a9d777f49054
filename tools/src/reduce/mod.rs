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
pub use study::ReduceOptions;
pub(crate) use study::{MeshStudy, reduce_mesh};
pub(crate) use study::{PaperStudy, reduce_paper, reduce_scene};

use palpate::Error;
use palpate::scene::Scene;

/// The locality check of a scene called `name`, and the reduction of its body at one contact, as one JSON document: what `palpate reduce SCENE
/// --json` prints.
///
/// # Errors
/// If the scene cannot be built or its body is not held.
pub fn reduction_json(scene: &Scene, name: &str, options: &ReduceOptions) -> Result<String, Error> {
    let mut study = reduce_scene(scene, options, |_| ())?;
    study.subject = name.to_owned();
    Ok(to_json(&study))
}
