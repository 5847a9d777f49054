//! The path of a scripted tool.

use std::path::Path;

use crate::error::{Error, ErrorKind, quoted};
use crate::files;

/// The first line of every path file; the units in it are the reason that it must be exactly this.
const HEADER: &str = "t_s,x_m,y_m,z_m";

/// No coordinate of a tool lies farther out than this (m); it keeps every difference of positions finite.
const FARTHEST_M: f64 = 1e6;

/// Most samples of a path file, over an hour at 1 kHz: 128 MB.
const MOST_SAMPLES: usize = 4_000_000;

/// Room for so many samples of 64 characters (bytes).
const LARGEST_FILE: u64 = 64 * MOST_SAMPLES as u64;

/// Tool positions over time, linear in between, held after the last and before the first.
///
/// ```
/// use palpate::devices::ToolPath;
///
/// # fn main() -> Result<(), palpate::Error> {
/// let down = ToolPath::new(vec![0.0, 0.5], vec![[0.0, 0.0, 0.12], [0.0, 0.0, 0.10]])?;
/// assert_eq!(down.at(0.25), [0.0, 0.0, 0.11]);
/// assert_eq!(down.at(9.0), [0.0, 0.0, 0.10]);
/// # Ok(())
/// # }
/// ```
#[derive(Clone, Debug, PartialEq)]
pub struct ToolPath {
    /// Strictly increasing times (s).
    times_s: Vec<f64>,
    /// Positions (m), one per time.
    positions_m: Vec<[f64; 3]>,
}

impl ToolPath {
    /// A path through `positions_m` (m) at `times_s` (s).
    ///
    /// # Errors
    /// [`ErrorKind::Scene`] if there is no sample, the lengths differ, a number is not finite, the first time is negative
    /// or a time is not after the one before.
    ///
    /// # Real-time
    /// Not real-time safe: an error allocates and frees what was given.
    pub fn new(times_s: Vec<f64>, positions_m: Vec<[f64; 3]>) -> Result<Self, Error> {
        if times_s.len() != positions_m.len() {
            let (times, positions) = (times_s.len(), positions_m.len());
            let message = format!("{times} times and {positions} positions, there must be one position per time");
            return Err(Error::new(ErrorKind::Scene, message));
        }
        if times_s.is_empty() {
            return Err(Error::new(ErrorKind::Scene, "no sample, a path needs at least one"));
        }
        let mut before_s = None;
        for (index, (&time_s, position_m)) in times_s.iter().zip(&positions_m).enumerate() {
            check_sample(before_s, time_s, position_m)
                .map_err(|message| Error::new(ErrorKind::Scene, message).at(format!("sample {index}")))?;
            before_s = Some(time_s);
        }
        Ok(Self { times_s, positions_m })
    }

    /// A tool that stays at `position_m` (m).
    ///
    /// # Errors
    /// [`ErrorKind::Scene`] if a coordinate is not finite.
    ///
    /// # Real-time
    /// Not real-time safe: allocates.
    pub fn constant(position_m: [f64; 3]) -> Result<Self, Error> {
        Self::new(vec![0.0], vec![position_m])
    }

    /// Reads a file with the columns `t_s,x_m,y_m,z_m`.
    ///
    /// # Errors
    /// [`ErrorKind::Io`] if the file cannot be read or is larger than 244 MiB, [`ErrorKind::Scene`] with its name and line
    /// if a row is unusable or there are more than four million.
    ///
    /// # Real-time
    /// Not real-time safe: reads a file, allocates.
    pub fn read_csv(path: &Path) -> Result<Self, Error> {
        let name = path.display().to_string();
        let text = String::from_utf8(files::read(path, LARGEST_FILE)?)
            .map_err(|_| Error::new(ErrorKind::Io, "is not UTF-8 text, save the file as UTF-8").at(&name))?;
        Self::from_csv(&text, &name)
    }

    /// Reads the text of a file with the columns `t_s,x_m,y_m,z_m`; `name` stands for the file in errors.
    ///
    /// # Errors
    /// [`ErrorKind::Scene`] with `name` and the line if the header or a row is unusable.
    ///
    /// # Real-time
    /// Not real-time safe: allocates.
    pub fn from_csv(text: &str, name: &str) -> Result<Self, Error> {
        let (times_s, positions_m) = parse(text, name)?;
        Ok(Self { times_s, positions_m })
    }

    /// The position (m) at `time_s` (s): a sample's own value at its time, linear in between, held outside.
    ///
    /// # Real-time
    /// Real-time safe: allocates nothing, bounded by a binary search over the samples.
    pub fn at(&self, time_s: f64) -> [f64; 3] {
        let next = self.times_s.partition_point(|&sample_s| sample_s <= time_s);
        if next == 0 {
            return self.positions_m[0];
        }
        let (from_s, from_m) = (self.times_s[next - 1], self.positions_m[next - 1]);
        // Equality is exact on purpose: a sample's own time must give its own value to the last bit.
        if next == self.times_s.len() || time_s == from_s {
            return from_m;
        }
        let (to_s, to_m) = (self.times_s[next], self.positions_m[next]);
        let share = (time_s - from_s) / (to_s - from_s);
        std::array::from_fn(|axis| from_m[axis] + share * (to_m[axis] - from_m[axis]))
    }

    /// The time of the last sample (s); the tool stays there from then on.
    ///
    /// # Real-time
    /// Real-time safe.
    pub fn duration_s(&self) -> f64 {
        self.times_s[self.times_s.len() - 1]
    }

    /// The times of the samples (s), strictly increasing.
    ///
    /// # Real-time
    /// Wait-free, real-time safe.
    pub fn times_s(&self) -> &[f64] {
        &self.times_s
    }

    /// The positions of the samples (m), one per time.
    ///
    /// # Real-time
    /// Wait-free, real-time safe.
    pub fn positions_m(&self) -> &[[f64; 3]] {
        &self.positions_m
    }
}

/// What is wrong with a sample after one at `before_s`, and what would be right.
fn check_sample(before_s: Option<f64>, time_s: f64, position_m: &[f64; 3]) -> Result<(), String> {
    if !time_s.is_finite() {
        return Err(format!("t_s is {time_s}, must be a finite number"));
    }
    if time_s < 0.0 {
        return Err(format!("t_s is {time_s}, a path starts at 0 or later"));
    }
    if let Some(before_s) = before_s
        && time_s <= before_s
    {
        return Err(format!("t_s is {time_s} after {before_s}, times must increase from row to row"));
    }
    for (name, value) in ["x_m", "y_m", "z_m"].into_iter().zip(position_m) {
        if !value.is_finite() {
            return Err(format!("{name} is {value}, must be a finite number"));
        }
        if value.abs() > FARTHEST_M {
            return Err(format!(
                "{name} is {value}, must lie within {FARTHEST_M} m of the origin (the unit is the metre)"
            ));
        }
    }
    Ok(())
}

/// The times (s) and positions (m) in `text`, checked row by row so that every error names its line.
fn parse(text: &str, name: &str) -> Result<(Vec<f64>, Vec<[f64; 3]>), Error> {
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
        if index == MOST_SAMPLES {
            return Err(at(line, format!("is one row too many, a path has at most {MOST_SAMPLES}")));
        }
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
