//! The paper's tables and figures, computed.

use std::time::Instant;

use super::figures::{balanced_figure, models_figure, shapes_figure};
use super::published::{TABLE1_2D, TABLE1_3D, TABLE2, reduced_order};
use super::{PaperStudy, ReduceProgress, Steps};
use palpate::Error;
use crate::reduce::findings::{ReductionRow, ReductionStudy, ReductionTable};
use crate::reduction::{Balanced, Modal, PaperMesh, Response, gain_error, low_rank};

/// Systems of more states are balanced through a Krylov space.
const DENSE_ORDER: usize = 600;
/// Frequencies that it is made of; a second one of more shows that they were enough.
const SHIFTS: usize = 16;
const MORE_SHIFTS: usize = 24;
/// The two errors may differ by this share.
const AGREEMENT: f64 = 0.01;

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

/// Cells as in `12 x 12`.
pub(super) fn in_words(mesh: &PaperMesh) -> String {
    mesh.cells.iter().map(usize::to_string).collect::<Vec<_>>().join(" x ")
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
