//! What VTK's two formats have in common: cells by type, and arrays of numbers at them.

use palpate_model::Vec3;

use crate::error::MeshError;
use crate::files::VolumeFile;
use crate::files::collected::{Collected, TETRAHEDRON};

/// Most different numbers of an array that become groups: beyond, it numbers the cells.
const MOST_VALUES: usize = 64;
/// Most arrays of a file that become groups.
const MOST_ARRAYS: usize = 16;

/// A piece of a file.
#[derive(Debug, Default)]
pub struct Piece {
    /// x, y, z of each point.
    pub points: Vec<f64>,
    /// The points of all cells.
    pub connectivity: Vec<i64>,
    /// Where the points of each cell end in `connectivity`.
    pub ends: Vec<i64>,
    /// The type of each cell.
    pub types: Vec<i64>,
    /// Names and values of arrays of whole numbers, one for each cell.
    pub arrays: Vec<(String, Vec<i64>)>,
}

impl Piece {
    /// True if another array can become groups.
    pub fn has_room(&self) -> bool {
        self.arrays.len() < MOST_ARRAYS
    }

    /// Takes an array if it can become groups.
    pub fn keep_array(&mut self, name: &str, values: Vec<i64>) {
        if self.has_room() {
            self.arrays.push((name.to_owned(), values));
        }
    }

    /// Adds all cells, and groups such as `region=3` for the values of arrays.
    pub fn collect(self, found: &mut Collected) -> Result<(), MeshError> {
        let refuse = |message: String| Err(MeshError::new(message));
        let Self { points, connectivity, ends, types, arrays } = self;
        let cells = types.len();
        if points.len() % 3 != 0 || ends.len() != cells {
            let (points, ends) = (points.len(), ends.len());
            return refuse(format!("{points} coordinates, {ends} cells and {cells} types of cells do not fit"));
        }
        let first = found.points.len() as u32;
        let count = (points.len() / 3) as i64;
        found.points.extend(points.chunks_exact(3).map(|point| Vec3::new(point[0], point[1], point[2])));
        let mut groups_of_cell = vec![Vec::new(); cells];
        for (name, values) in arrays.iter().filter(|(_, values)| values.len() == cells) {
            let mut different = values.clone();
            different.sort_unstable();
            different.dedup();
            if different.len() > MOST_VALUES {
                continue;
            }
            for value in different {
                let group = found.group(&format!("{name}={value}"))?;
                let with_it = values.iter().zip(&mut groups_of_cell).filter(|(other, _)| **other == value);
                with_it.for_each(|(_, groups)| groups.push(group));
            }
        }
        let mut nodes = Vec::new();
        let mut start = 0;
        for (cell, (&end, &number)) in ends.iter().zip(&types).enumerate() {
            let range = usize::try_from(end).ok().and_then(|end| connectivity.get(start..end));
            let Some(points) = range else {
                let all = connectivity.len();
                return refuse(format!("cell {cell} has points {start} to {end} of a list of {all}"));
            };
            start = end as usize;
            if let Some(point) = points.iter().find(|point| !(0..count).contains(point)) {
                return refuse(format!("cell {cell} has point {point}, the points are 0 to {}", count - 1));
            }
            let kind = kind(number);
            if kind == TETRAHEDRON && points.len() != 4 {
                return refuse(format!("cell {cell} is a tetrahedron of {} points", points.len()));
            }
            nodes.clear();
            nodes.extend(points.iter().map(|point| first + *point as u32));
            found.add(&kind, &nodes, &groups_of_cell[cell]);
        }
        Ok(())
    }
}

/// All pieces as one mesh.
pub fn joined(pieces: impl IntoIterator<Item = Piece>) -> Result<VolumeFile, MeshError> {
    let mut found = Collected::default();
    pieces.into_iter().try_for_each(|piece| piece.collect(&mut found))?;
    found.finish()
}

/// What cells of this type are called.
fn kind(number: i64) -> String {
    let name = match number {
        1 | 2 => "points",
        3 | 4 => "lines",
        5 | 6 => "triangles",
        7 => "polygons",
        8 | 9 => "quadrangles",
        10 => TETRAHEDRON,
        11 | 12 => "hexahedra",
        13 => "prisms",
        14 => "pyramids",
        21 => "second-order lines",
        22 => "second-order triangles",
        23 | 28 => "second-order quadrangles",
        24 => "second-order tetrahedra",
        25 | 29 => "second-order hexahedra",
        26 => "second-order prisms",
        27 => "second-order pyramids",
        42 => "polyhedra",
        69 => "Lagrange triangles",
        71 => "Lagrange tetrahedra",
        _ => return format!("cells of VTK's type {number}"),
    };
    name.to_owned()
}
