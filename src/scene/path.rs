//! The path of a scripted tool.

/// Tool positions over time, linear in between, held after the last and before the first.
#[derive(Clone, Debug, PartialEq)]
pub struct ToolPath {
    /// Strictly increasing times [s].
    times_s: Vec<f64>,
    /// Positions [m], one per time.
    positions_m: Vec<[f64; 3]>,
}
