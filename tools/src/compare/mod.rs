//! A comparison of local models: for a terminal, for programs, and as a page with plots.

mod charts;
mod conclusions;
mod figures;
mod html;
mod json;
mod study;
mod table;

pub use conclusions::{NEAR, conclusions};
pub use figures::{ComparedRun, Comparison, ForceTrace, Measured, ModelCost, ModelError, RunOutcome};
pub use html::to_html;
pub use json::to_json;
pub use study::{CompareOptions, CompareProgress, compare, one_period};
pub use table::to_text;

use palpate::runtime::Nanos;

/// A latency in milliseconds, as short as it can be written: `0`, `33.34`.
fn milliseconds(latency: Nanos) -> String {
    format!("{}", latency.0 as f64 / 1e6)
}

/// A run in words: the model, and its latency if it has one.
fn name(run: &ComparedRun) -> String {
    match run.latency {
        Nanos::ZERO => run.model.clone(),
        late => format!("{} {} ms late", run.model, milliseconds(late)),
    }
}
