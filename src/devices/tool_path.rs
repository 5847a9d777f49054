//! The path of a scripted tool.

use std::path::Path;

use super::state::ROUGH_TURN;
use crate::error::{Error, ErrorKind, quoted};
use crate::files;
use crate::model::{Pose, Turn, turn_of};

/// The first line of a path file; the units in it are the reason that it must be exactly this.
const HEADER: &str = "t_s,x_m,y_m,z_m";
/// The first line of a path file that says how the tool is turned.
const TURNED_HEADER: &str = "t_s,x_m,y_m,z_m,qw,qx,qy,qz";

/// No coordinate of a tool lies farther out than this (m); it keeps every difference of positions finite.
const FARTHEST_M: f64 = 1e6;

/// Most samples of a path file, over an hour at 1 kHz: 128 MB.
const MOST_SAMPLES: usize = 4_000_000;

/// Room for so many samples of 64 characters (bytes).
const LARGEST_FILE: u64 = 64 * MOST_SAMPLES as u64;

/// Tool positions and orientations over time, linear in between, held after the last and before the first.
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
    /// Orientations, one per time, each of the sign that is nearer to the one before; empty if the tool is never turned.
    orientations: Vec<Turn>,
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
        Ok(Self { times_s, positions_m, orientations: Vec::new() })
    }

    /// The path with the tool turned by `quaternions` (w, x, y, z), one per time: evenly and on the shorter way in between.
    ///
    /// # Errors
    /// [`ErrorKind::Scene`] if there is not one per time, or one is not of length one within 1e-3.
    ///
    /// # Real-time
    /// Not real-time safe: allocates.
    pub fn turned(self, quaternions: &[[f64; 4]]) -> Result<Self, Error> {
        if quaternions.len() != self.times_s.len() {
            let (times, turns) = (self.times_s.len(), quaternions.len());
            let message = format!("{times} times and {turns} orientations, there must be one orientation per time");
            return Err(Error::new(ErrorKind::Scene, message));
        }
        let mut orientations: Vec<Turn> = Vec::with_capacity(quaternions.len());
        for (index, quaternion) in quaternions.iter().enumerate() {
            let turn = turn(orientations.last(), *quaternion)
                .map_err(|message| Error::new(ErrorKind::Scene, message).at(format!("sample {index}")))?;
            orientations.push(turn);
        }
        Ok(Self { orientations, ..self })
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

    /// Reads a file with the columns `t_s,x_m,y_m,z_m`, or `t_s,x_m,y_m,z_m,qw,qx,qy,qz` for a tool that turns.
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

    /// Reads the text of a file with the columns of [`read_csv`](Self::read_csv); `name` stands for the file in errors.
    ///
    /// # Errors
    /// [`ErrorKind::Scene`] with `name` and the line if the header or a row is unusable.
    ///
    /// # Real-time
    /// Not real-time safe: allocates.
    pub fn from_csv(text: &str, name: &str) -> Result<Self, Error> {
        parse(text, name)
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

    /// The pose at `time_s` (s): [`at`](Self::at) for the position, and the orientation likewise, on the shorter way between
    /// two samples.
    ///
    /// # Real-time
    /// Real-time safe: allocates nothing, bounded by a binary search over the samples.
    pub fn pose_at(&self, time_s: f64) -> Pose {
        let position = self.at(time_s).into();
        if self.orientations.is_empty() {
            return Pose::at(position);
        }
        let next = self.times_s.partition_point(|&sample_s| sample_s <= time_s);
        let from = next.saturating_sub(1);
        let turned = |sample: usize| Pose { position, orientation: self.orientations[sample] };
        if next == 0 || next == self.times_s.len() || time_s == self.times_s[from] {
            return turned(from);
        }
        let share = (time_s - self.times_s[from]) / (self.times_s[next] - self.times_s[from]);
        Pose { position, ..turned(from).towards(&turned(next), share) }
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

    /// The orientations of the samples, one per time; none for a tool that is never turned.
    ///
    /// # Real-time
    /// Wait-free, real-time safe.
    pub fn orientations(&self) -> &[Turn] {
        &self.orientations
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

/// The turn of a quaternion (w, x, y, z) of length one, of the sign that is nearer to the turn `before`; or what is wrong with it.
fn turn(before: Option<&Turn>, wxyz: [f64; 4]) -> Result<Turn, String> {
    let quaternion = turn_of(wxyz).into_inner();
    let length = quaternion.norm();
    if !length.is_finite() || (length - 1.0).abs() > ROUGH_TURN {
        return Err(format!("qw,qx,qy,qz have the length {length}, must be of length 1 within {ROUGH_TURN}"));
    }
    let turn = Turn::new_normalize(quaternion);
    let is_far = before.is_some_and(|before| before.dot(&turn) < 0.0);
    Ok(if is_far { Turn::new_unchecked(-turn.into_inner()) } else { turn })
}

/// The path in `text`, checked row by row so that every error names its line.
fn parse(text: &str, name: &str) -> Result<ToolPath, Error> {
    let at = |line: usize, message: String| Error::new(ErrorKind::Scene, message).at(format!("{name}:{line}"));
    let mut path = ToolPath { times_s: Vec::new(), positions_m: Vec::new(), orientations: Vec::new() };
    // Spreadsheets put a byte order mark in front and empty lines behind.
    let text = text.strip_prefix('\u{feff}').unwrap_or(text).trim_end();
    let mut lines = text.lines();
    let header = lines.next().unwrap_or_default().trim_end();
    let is_turned = header == TURNED_HEADER;
    if header != HEADER && !is_turned {
        let found = if header.is_empty() { "no header".to_owned() } else { format!("the header {}", quoted(header)) };
        let message = format!("found {found}, must be exactly {HEADER} (seconds and metres), or {TURNED_HEADER}");
        return Err(at(1, message));
    }
    for (index, row) in lines.enumerate() {
        let line = index + 2;
        if index == MOST_SAMPLES {
            return Err(at(line, format!("is one row too many, a path has at most {MOST_SAMPLES}")));
        }
        let wrong = |message| at(line, message);
        let [time_s, x, y, z, quaternion @ ..] = numbers(row, header).map_err(wrong)?;
        let position_m = [x, y, z];
        check_sample(path.times_s.last().copied(), time_s, &position_m).map_err(wrong)?;
        path.times_s.push(time_s);
        path.positions_m.push(position_m);
        if is_turned {
            path.orientations.push(turn(path.orientations.last(), quaternion).map_err(wrong)?);
        }
    }
    if path.times_s.is_empty() {
        return Err(at(1, "the header has no row below it, a path needs at least one sample".to_owned()));
    }
    Ok(path)
}

/// The numbers of a row, as many as `header` has names; the rest is zero.
fn numbers(row: &str, header: &str) -> Result<[f64; 8], String> {
    if row.trim().is_empty() {
        return Err(format!("the line is empty, must be a row {header}"));
    }
    let (columns, named) = (row.split(',').count(), header.split(',').count());
    if columns != named {
        return Err(format!("found {columns} columns, must be {named}: {header}"));
    }
    let mut values = [0.0; 8];
    for ((value, column), field) in values.iter_mut().zip(header.split(',')).zip(row.split(',')) {
        *value = field.trim().parse().map_err(|_| format!("{column} is {}, must be a number", quoted(field.trim())))?;
    }
    Ok(values)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::model::Vec3;

    fn read(text: &str) -> Result<ToolPath, String> {
        ToolPath::from_csv(text, "path.csv").map_err(|error| error.to_string())
    }

    fn about_z(angle: f64) -> Turn {
        Turn::from_axis_angle(&Vec3::z_axis(), angle)
    }

    // Check that the sign in which a file writes a turn makes no way round, and that positions are those of `at`.
    #[test]
    fn a_turned_tool_goes_the_shorter_way_and_keeps_its_positions() {
        let (s, c) = (0.2_f64.sin(), 0.2_f64.cos());
        let path =
            read(&format!("{TURNED_HEADER}\n0,0,0,0,1,0,0,0\n1,0.3,0,0,{},0,0,{}\n2,0.3,0,0,{c},0,0,{s}\n", -c, -s));
        let path = path.unwrap();
        for time_s in [0.0, 0.1, 0.5, 1.0, 1.7, 2.0, 9.0] {
            let Pose { position, orientation } = path.pose_at(time_s);
            assert_eq!(position, Vec3::from(path.at(time_s)));
            assert!((orientation.angle_to(&about_z(0.4 * time_s.min(1.0)))).abs() < 2e-3, "{time_s}: {orientation}");
        }
        assert!(path.pose_at(0.5).orientation.angle_to(&about_z(0.2)) < 1e-7);
        assert_eq!(path.orientations()[1], path.pose_at(1.0).orientation);
        let turned =
            ToolPath::new(vec![0.0, 1.0], vec![[0.0; 3]; 2]).unwrap().turned(&[[1.0, 0.0, 0.0, 0.0], [c, 0.0, 0.0, s]]);
        assert_eq!(turned.unwrap().orientations()[1], path.orientations()[1]);
    }

    #[test]
    fn what_is_no_turn_is_named_with_its_line() {
        let row = |quaternion: &str| read(&format!("{TURNED_HEADER}\n0,0,0,0,1,0,0,0\n1,0,0,0,{quaternion}\n"));
        assert!(row("0.9995,0,0,0").unwrap().orientations()[1].coords.norm() == 1.0);
        let error = row("0.9,0,0,0").unwrap_err();
        assert_eq!(error, "path.csv:3: qw,qx,qy,qz have the length 0.9, must be of length 1 within 0.001");
        assert!(row("NaN,0,0,0").unwrap_err().contains("path.csv:3: qw,qx,qy,qz"));
        assert!(row("1,0,0").unwrap_err().contains("found 7 columns, must be 8"));
        assert!(row("1,0,up,0").unwrap_err().contains("qy is \"up\", must be a number"));
        let few = ToolPath::constant([0.0; 3]).unwrap().turned(&[]).unwrap_err().to_string();
        assert_eq!(few, "1 times and 0 orientations, there must be one orientation per time");
    }

    #[test]
    fn a_path_without_orientations_turns_nothing() {
        let path = read("t_s,x_m,y_m,z_m\n0,0.1,0.2,0.3\n").unwrap();
        assert_eq!(path.pose_at(0.5), Pose::at(Vec3::new(0.1, 0.2, 0.3)));
        assert!(path.orientations().is_empty());
    }
}
