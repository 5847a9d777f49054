//! What the runs say, as distributions.

use std::fmt::Write;

use palpate::model::local::Kind;

use super::cases::{Class, is_unseen};
use super::common::{figure, measured_on, table};
use super::paths::Motion;
use super::runs::{CaseResult, Run};

/// A document and its pictures by name.
pub struct Document {
    pub text: String,
    pub pictures: Vec<(String, String)>,
}

pub fn document(results: &[CaseResult]) -> Document {
    let unseen: Vec<&CaseResult> = results.iter().filter(|result| is_unseen(result.seed)).collect();
    let mut text = format!("# Population\n\n{}\n\n", measured_on("cargo bench --bench population"));
    let _ = writeln!(text, "{} cases, {} of them unseen.\n", results.len(), unseen.len());
    text.push_str(&distributions(results));
    Document { text, pictures: Vec::new() }
}

/// The value below which that share of `values` lies.
fn quantile(values: &mut [f64], share: f64) -> f64 {
    values.sort_by(f64::total_cmp);
    let place = share * values.len().saturating_sub(1) as f64;
    values.get(place.round() as usize).copied().unwrap_or(f64::NAN)
}

/// Of `predictive`, in time and late: for all, by class and by motion.
pub fn distributions(results: &[CaseResult]) -> String {
    let mut rows = Vec::new();
    let mut add = |name: String, of: &dyn Fn(&CaseResult) -> bool| {
        let those: Vec<&CaseResult> = results.iter().filter(|result| of(result)).collect();
        for (late, word) in ["in time", "late"].into_iter().enumerate() {
            let runs: Vec<&Run> =
                those.iter().filter_map(|result| result.of(Kind::Predictive)?[late].as_ref().ok()).collect();
            if runs.is_empty() {
                continue;
            }
            let q = |of: fn(&Run) -> f64, share: f64| {
                figure(quantile(&mut runs.iter().map(|run| of(run)).collect::<Vec<_>>(), share))
            };
            rows.push(vec![
                name.clone(),
                word.to_owned(),
                format!("{}/{}", runs.len(), those.len()),
                q(|run| run.rms, 0.5),
                q(|run| run.rms, 0.9),
                q(|run| run.rms, 1.0),
                q(|run| run.jump, 0.9),
                q(|run| run.jump, 1.0),
                q(|run| run.peak, 1.0),
                q(|run| run.tick_us[0], 0.5),
                q(|run| run.tick_us[1], 0.5),
                q(|run| run.periods, 0.5),
            ]);
        }
    };
    add("all".to_owned(), &|_| true);
    for class in Class::ALL {
        add(class.name().to_owned(), &|result| result.class == class);
    }
    for motion in Motion::ALL {
        add(motion.name().to_owned(), &|result| result.motion == motion);
    }
    let head = [
        "cases",
        "",
        "ran",
        "rms % p50",
        "p90",
        "worst",
        "jump % p90",
        "worst",
        "peak worst",
        "tick us",
        "p99",
        "periods",
    ];
    table(&head, 2, &rows)
}
