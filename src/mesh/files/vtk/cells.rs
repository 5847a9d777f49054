//! What VTK's two formats have in common: cells by type, and arrays of numbers at them.

use std::collections::HashMap;

use palpate_model::Vec3;

use crate::error::MeshError;
use crate::files::VolumeFile;
use crate::files::collected::{Collected, TETRAHEDRON};
use crate::surface::{PlaceKey, place_key};

/// Most different numbers of an array that become groups: beyond, it numbers the cells.
const MOST_VALUES: usize = 64;
/// Most arrays of a file that become groups.
const MOST_ARRAYS: usize = 16;

/// Arrays that mark cells of another piece, repeated around this one, and hidden cells.
const GHOSTS: [&str; 2] = ["vtkGhostType", "vtkGhostLevels"];
/// What of `vtkGhostType` does so; the rest of its bits are of no matter here. Levels count from one on.
const REPEATED_OR_HIDDEN: i64 = 1 | 32;

/// The nodes of earlier pieces by their places: a place where pieces meet is one node.
type Border = HashMap<PlaceKey, u32>;

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
    /// True for each cell that is left out as one of another piece; empty if there are none.
    pub ghosts: Vec<bool>,
}

impl Piece {
    /// True if an array of this name can become groups, or marks cells of other pieces.
    pub fn has_room(&self, name: &str) -> bool {
        GHOSTS.contains(&name) || self.arrays.len() < MOST_ARRAYS
    }

    /// Takes an array if there is room for it.
    pub fn keep_array(&mut self, name: &str, values: Vec<i64>) {
        if let Some(kind) = GHOSTS.iter().position(|ghosts| *ghosts == name) {
            let is_ghost = |value: i64| if kind == 0 { value & REPEATED_OR_HIDDEN != 0 } else { value > 0 };
            self.ghosts = values.into_iter().map(is_ghost).collect();
        } else if self.has_room(name) {
            self.arrays.push((name.to_owned(), values));
        }
    }

    /// Adds all cells, and groups such as `region=3` for the values of arrays. Where it meets earlier pieces its nodes are theirs.
    pub fn collect(self, found: &mut Collected, border: Option<&mut Border>) -> Result<(), MeshError> {
        let refuse = |message: String| Err(MeshError::new(message));
        let Self { points, connectivity, ends, types, arrays, ghosts } = self;
        let cells = types.len();
        if points.len() % 3 != 0 || ends.len() != cells {
            let (points, ends) = (points.len(), ends.len());
            return refuse(format!("{points} coordinates, {ends} cells and {cells} types of cells do not fit"));
        }
        let count = (points.len() / 3) as i64;
        let places = points.as_chunks::<3>().0.iter().map(|&place| Vec3::from(place));
        let numbers = numbered(places, &mut found.points, border);
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
            let is_ghost = ghosts.get(cell) == Some(&true);
            let kind = if is_ghost { "cells of other pieces".to_owned() } else { kind(number) };
            if kind == TETRAHEDRON && points.len() != 4 {
                return refuse(format!("cell {cell} is a tetrahedron of {} points", points.len()));
            }
            nodes.clear();
            nodes.extend(points.iter().map(|point| numbers[*point as usize]));
            found.add(&kind, &nodes, if is_ghost { &[] } else { &groups_of_cell[cell] });
        }
        Ok(())
    }
}

/// All pieces as one mesh.
pub fn joined(pieces: impl IntoIterator<Item = Piece>) -> Result<VolumeFile, MeshError> {
    let pieces: Vec<Piece> = pieces.into_iter().collect();
    let (mut found, mut border) = (Collected::default(), Border::new());
    let is_one = pieces.len() == 1;
    pieces.into_iter().try_for_each(|piece| piece.collect(&mut found, (!is_one).then_some(&mut border)))?;
    found.finish()
}

/// Adds the places of a piece to `points`; the number of each there. A place that is on the `border` to an earlier piece is the node there.
fn numbered(places: impl Iterator<Item = Vec3>, points: &mut Vec<Vec3>, border: Option<&mut Border>) -> Vec<u32> {
    let mut add = |place: Vec3| {
        points.push(place);
        points.len() as u32 - 1
    };
    let Some(border) = border else { return places.map(add).collect() };
    let number = |place: Vec3| {
        let key = place_key(&place);
        (key, border.get(&key).copied().unwrap_or_else(|| add(place)))
    };
    let numbered: Vec<_> = places.map(number).collect();
    border.extend(numbered.iter().copied());
    numbered.into_iter().map(|(_, number)| number).collect()
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
