//! The paper's tables and figures, computed.

use std::time::Instant;

use palpate::Error;

use super::figures::{balanced_figure, in_words, models_figure, shapes_figure};
use super::{PaperStudy, ReduceProgress, Steps};
use crate::reduce::findings::{ReductionRow, ReductionStudy, ReductionTable};
use crate::reduction::{Balanced, Modal, PaperMesh, Response, gain_error, low_rank};

/// Systems of more states are balanced through a Krylov space.
const DENSE_ORDER: usize = 600;
/// Frequencies that it is made of; a second one of more shows that they were enough.
const SHIFTS: usize = 16;
const MORE_SHIFTS: usize = 24;
/// The two errors may differ by this share.
const AGREEMENT: f64 = 0.01;

/// Cells along each axis, order, time (s) and "% error" of Table 1, 2D: 20 states kept, zeta = 1.
const TABLE1_2D: [(usize, usize, f64, f64); 5] = [
    (5, 76, 0.07, 3.89e-6),
    (10, 356, 2.93, 0.00396),
    (15, 836, 47.14, 0.0383),
    (20, 1516, 293.15, 0.201),
    (25, 2396, 1172.1, 0.307),
];

/// The same in 3D: 102 states kept.
const TABLE1_3D: [(usize, usize, f64, f64); 4] =
    [(4, 210, 0.36, 1.08e-13), (5, 474, 7.85, 4.84e-13), (6, 894, 57.21, 1.51e-12), (7, 1506, 274.98, 2.84e-12)];

/// zeta and "% error" of Table 2: 12 x 12 cells, 20 states kept.
const TABLE2: [(f64, f64); 9] = [
    (0.001, 51.1),
    (0.01, 38.4),
    (0.1, 13.7),
    (0.2, 4.24),
    (0.6, 0.146),
    (0.7, 0.0641),
    (1.0, 0.0195),
    (1.5, 0.00291),
    (2.0, 0.00097),
];

/// The paper's tables and figures, computed.
///
/// # Errors
/// None of the paper's meshes is refused.
pub fn reduce_paper(
    studies: &[PaperStudy],
    mut progress: impl FnMut(&ReduceProgress),
) -> Result<ReductionStudy, Error> {
    let started = Instant::now();
    let subject = studies.iter().map(|study| study.name()).collect::<Vec<_>>().join(", ");
    let mut out = ReductionStudy { subject, ..ReductionStudy::default() };
    let count = |study: &PaperStudy| match study {
        PaperStudy::Table1 => TABLE1_2D.len() + TABLE1_3D.len(),
        PaperStudy::Table2 => TABLE2.len(),
        _ => 1,
    };
    let mut steps = Steps::new(studies.iter().map(count).sum(), &mut progress);
    for study in studies {
        let mut figure = || steps.begin(study.name());
        match study {
            PaperStudy::Table1 => out.tables.extend(table1(&mut steps)?),
            PaperStudy::Table2 => out.tables.push(table2(&mut steps)?),
            PaperStudy::Fig4 => {
                figure();
                let (response, hankel) = balanced_figure(&PaperMesh::square(12))?;
                out.responses.push(response);
                out.hankel.push(hankel);
            }
            PaperStudy::Fig5 => {
                figure();
                out.shapes.push(shapes_figure(&PaperMesh::square(12))?);
                out.shapes.push(shapes_figure(&PaperMesh::cube(6))?);
            }
            PaperStudy::Fig8 => {
                figure();
                out.responses.push(models_figure(&PaperMesh::square(12), reduced_order(2), &[])?);
            }
        }
    }
    out.seconds = started.elapsed().as_secs_f64();
    Ok(out)
}

fn table1(steps: &mut Steps<'_>) -> Result<[ReductionTable; 2], Error> {
    let mut of = |title: &str, meshes: &[(usize, usize, f64, f64)], mesh: fn(usize) -> PaperMesh| {
        let mut rows = Vec::new();
        for &(n, _, seconds, error_pct) in meshes {
            let mesh = mesh(n);
            steps.begin(format!("{title}: {}", in_words(&mesh)));
            rows.push(row(&mesh, error_pct, Some(seconds))?);
        }
        Ok::<_, Error>(ReductionTable { title: title.to_owned(), rows })
    };
    Ok([of("Table 1, 2D", &TABLE1_2D, PaperMesh::square)?, of("Table 1, 3D", &TABLE1_3D, PaperMesh::cube)?])
}

fn table2(steps: &mut Steps<'_>) -> Result<ReductionTable, Error> {
    let mut rows = Vec::new();
    for (zeta, error_pct) in TABLE2 {
        steps.begin(format!("Table 2: zeta {zeta}"));
        rows.push(row(&PaperMesh::square(12).damping_ratio(zeta), error_pct, None)?);
    }
    Ok(ReductionTable { title: "Table 2".to_owned(), rows })
}

/// States of the paper's local models, and of its reduced ones: 4 x 2 and 4 x 4 x 2 cells.
fn reduced_order(dimensions: usize) -> usize {
    if dimensions == 2 { 20 } else { 102 }
}

fn row(mesh: &PaperMesh, published_error_pct: f64, published_s: Option<f64>) -> Result<ReductionRow, Error> {
    let started = Instant::now();
    let order = reduced_order(mesh.dimensions());
    let system = mesh.system()?;
    let mut method = "modal";
    let mut reduced = None;
    if system.order() > DENSE_ORDER {
        let (few, more) = (low_rank(&system, SHIFTS)?, low_rank(&system, MORE_SHIFTS)?);
        let [a, b] = [&few, &more].map(|low_rank| low_rank.balanced.tail_pct(order));
        if (a - b).abs() <= AGREEMENT * b.max(NEGLIGIBLE_PCT) {
            method = "rational Krylov";
            reduced = Modal::of(&more.projection.model).map(|modal| (modal, more.balanced));
        }
    }
    let (modal, balanced) = match reduced {
        Some(reduced) => reduced,
        None => {
            let modal = Modal::new(&system).ok_or_else(super::no_modes)?;
            let balanced = Balanced::modal(&modal)?;
            (modal, balanced)
        }
    };
    let truncated = balanced.truncated(order);
    Ok(ReductionRow {
        cells: mesh.cells.clone(),
        damping_ratio: mesh.damping_ratio,
        order: system.order(),
        reduced_order: order,
        states: truncated.order(),
        method: method.to_owned(),
        error_pct: balanced.tail_pct(order),
        hinf_pct: gain_error(&modal, &truncated as &dyn Response),
        published_error_pct,
        published_s,
        is_stable: truncated.is_stable(),
        seconds: started.elapsed().as_secs_f64(),
    })
}

/// Errors below this are rounding (%).
const NEGLIGIBLE_PCT: f64 = 1e-10;
