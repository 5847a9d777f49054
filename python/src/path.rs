//! The path of a tool: a file, or rows of time and place.

use std::path::PathBuf;

use palpate::devices::ToolPath;
use pyo3::prelude::*;

use crate::arrays::rows;
use crate::errors::{OrRaise, usage};
use crate::scene::is_path;

const NEEDED: &str = "a file (t_s,x_m,y_m,z_m), one place (x, y, z), or rows of (t_s, x_m, y_m, z_m), with (qw, qx, qy, qz) behind \
                      them for a tool that turns";

/// The path that `given` means.
///
/// # Errors
/// `UsageError` if it is none, and what the engine says of its numbers or its file.
pub(crate) fn tool_path(given: &Bound<'_, PyAny>) -> PyResult<ToolPath> {
    let py = given.py();
    if is_path(given)? {
        return ToolPath::read_csv(&given.extract::<PathBuf>()?).or_raise(py);
    }
    let (values, [count, columns]) = rows(given, "path", NEEDED)?;
    let of_path = |error: palpate::Error| error.at("path");
    let place = |row: &[f64]| [row[0], row[1], row[2]];
    match (count, columns) {
        (1, 3) => ToolPath::constant(place(&values)).map_err(of_path).or_raise(py),
        (_, 4 | 8) => {
            let rows = || values.chunks_exact(columns);
            let path = ToolPath::new(rows().map(|row| row[0]).collect(), rows().map(|row| place(&row[1..])).collect());
            let turned = |path: ToolPath| {
                let turns: Vec<[f64; 4]> = rows().map(|row| [row[4], row[5], row[6], row[7]]).collect();
                path.turned(&turns)
            };
            let path = if columns == 8 { path.and_then(turned) } else { path };
            path.map_err(of_path).or_raise(py)
        }
        _ => Err(usage(py, "path", &format!("is an array of shape ({count}, {columns}), must be {NEEDED}"))),
    }
}
