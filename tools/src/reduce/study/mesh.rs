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
    Ok(ReductionStudy {
        subject: format!("{} cells", in_words(&mesh)),
        responses: vec![all_models(&studied, title, study.order, &study.hz)?],
        hankel: vec![studied.decay(&[2, 4, 6, 8, 10, 15, 20, 30, 50, study.order])],
        seconds: started.elapsed().as_secs_f64(),
        ..ReductionStudy::default()
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn reduced(order: usize, hz: &[f64]) -> ReductionStudy {
        let study = MeshStudy { cells: vec![5, 5], order, hz: hz.to_vec(), ..MeshStudy::default() };
        reduce_mesh(&study, |_| {}).unwrap()
    }

    #[test]
    fn errors_at_frequencies_that_were_not_asked_for_are_not_there() {
        for (hz, at_rest, above) in
            [(&[10.0, 100.0][..], false, true), (&[0.0], true, false), (&[0.0, 10.0], true, true)]
        {
            for model in &reduced(4, hz).responses[0].models {
                let found = [model.at_rest_pct, model.worst_pct, model.worst_hz].map(f64::is_finite);
                assert_eq!(found, [at_rest, above, above], "{hz:?}: {}", model.name);
            }
        }
    }

    // Check an order above the states of the whole, and one that no loop reaches the end of.
    #[test]
    fn no_truncation_keeps_more_states_than_there_are() {
        for order in [200, usize::MAX] {
            let study = reduced(order, &[10.0]);
            let decay = &study.hankel[0];
            let kept: Vec<usize> = decay.truncations.iter().map(|cut| cut.order).collect();
            assert!(kept.is_sorted_by(|a, b| a < b) && kept.last() == Some(&decay.values.len()), "{order}: {kept:?}");
            assert!(study.responses[0].models.iter().all(|model| model.order <= decay.order), "{order}");
        }
    }
}
