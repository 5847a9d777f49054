//! Any mesh like the paper's.

use std::time::Instant;

use palpate::Error;

use super::figures::{Studied, all_models, in_words};
use super::{MeshStudy, ReduceProgress, Steps};
use crate::reduce::findings::ReductionStudy;
use crate::reduction::PaperMesh;

/// Meshes with more coordinates take minutes and gigabytes.
const MOST_COORDINATES: f64 = 4000.0;

/// Any mesh like the paper's: Hankel singular values, errors by order and responses.
///
/// # Errors
/// If a number is not positive, there are fewer than two cells along an axis, or the mesh is too large.
pub fn reduce_mesh(study: &MeshStudy, mut progress: impl FnMut(&ReduceProgress)) -> Result<ReductionStudy, Error> {
    let started = Instant::now();
    let mesh = PaperMesh {
        cells: study.cells.clone(),
        stiffness: study.stiffness_n_per_m,
        mass: study.node_mass_kg,
        damping_ratio: study.damping_ratio,
    };
    if let Some(&hz) = study.hz.iter().find(|hz| !(hz.is_finite() && **hz >= 0.0)) {
        return Err(Error::scene("hz", format!("{hz}: finite frequencies of at least 0 are needed")));
    }
    let nodes = study.cells.iter().fold(1.0, |nodes, &n| nodes * n as f64);
    if nodes * study.cells.len() as f64 > MOST_COORDINATES {
        let message = format!("{:?}: all modes are computed, of at most {MOST_COORDINATES} coordinates", study.cells);
        return Err(Error::scene("cells", message));
    }
    let mut steps = Steps::new(2, &mut progress);
    steps.begin(format!("balancing {} cells", in_words(&mesh)));
    let studied = Studied::new(&mesh)?;
    steps.begin("frequency responses");
    let title = format!("models of {} cells, zeta {}", in_words(&mesh), mesh.damping_ratio);
    let mut orders: Vec<usize> = [2, 4, 6, 8, 10, 15, 20, 30, 50, study.order].to_vec();
    orders.retain(|&order| order <= studied.balanced.rank().max(study.order));
    orders.sort_unstable();
    orders.dedup();
    Ok(ReductionStudy {
        subject: format!("{} cells", in_words(&mesh)),
        responses: vec![all_models(&studied, title, study.order, &study.hz)?],
        hankel: vec![studied.decay(&orders)],
        seconds: started.elapsed().as_secs_f64(),
        ..ReductionStudy::default()
    })
}
