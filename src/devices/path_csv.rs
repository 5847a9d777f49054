//! The text form of a tool path: `t_s,x_m,y_m,z_m`, one sample a line.

use super::tool_path::check_sample;
use crate::error::{Error, ErrorKind, quoted};

/// The first line of every path file; the units in it are the reason that it must be exactly this.
const HEADER: &str = "t_s,x_m,y_m,z_m";

/// The times (s) and positions (m) in `text`, checked row by row so that every error names its line.
pub(super) fn parse(text: &str, name: &str) -> Result<(Vec<f64>, Vec<[f64; 3]>), Error> {
    let at = |line: usize, message: String| Error::new(ErrorKind::Scene, message).at(format!("{name}:{line}"));
    let (mut times_s, mut positions_m) = (Vec::new(), Vec::new());
    // Spreadsheets put a byte order mark in front and empty lines behind.
    let text = text.strip_prefix('\u{feff}').unwrap_or(text).trim_end();
    let mut lines = text.lines();
    let header = lines.next().unwrap_or_default().trim_end();
    if header != HEADER {
        let found = if header.is_empty() { "no header".to_owned() } else { format!("the header {}", quoted(header)) };
        return Err(at(1, format!("found {found}, must be exactly {HEADER} (seconds and metres)")));
    }
    for (index, row) in lines.enumerate() {
        let line = index + 2;
        let [time_s, position_m @ ..] = numbers(row).map_err(|message| at(line, message))?;
        check_sample(times_s.last().copied(), time_s, &position_m).map_err(|message| at(line, message))?;
        times_s.push(time_s);
        positions_m.push(position_m);
    }
    if times_s.is_empty() {
        return Err(at(1, "the header has no row below it, a path needs at least one sample".to_owned()));
    }
    Ok((times_s, positions_m))
}

fn numbers(row: &str) -> Result<[f64; 4], String> {
    if row.trim().is_empty() {
        return Err("the line is empty, must be a row t_s,x_m,y_m,z_m".to_owned());
    }
    let columns = row.split(',').count();
    if columns != 4 {
        return Err(format!("found {columns} columns, must be 4: {HEADER}"));
    }
    let mut values = [0.0; 4];
    for ((value, column), field) in values.iter_mut().zip(HEADER.split(',')).zip(row.split(',')) {
        *value = field.trim().parse().map_err(|_| format!("{column} is {}, must be a number", quoted(field.trim())))?;
    }
    Ok(values)
}
