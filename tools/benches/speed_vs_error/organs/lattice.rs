//! An organ as a lattice of springs: what palpate's blocks are, cut to the organ's shape.

use std::collections::{BTreeMap, BTreeSet};

use palpate::Error;
use palpate::model::Vec3;
use palpate::model::body::{Spring, SpringNetwork};

use super::cases::Organ;

/// Young's modulus of the lattice with springs of 1 N/m at 1 m, mean over all directions (Voigt's): it is 2.7 along an axis and 5.6
/// along a diagonal of a cube.
const YOUNG_PER_STIFFNESS: f64 = 4.5;
/// The same of the shear modulus, and so of viscosity by damping.
const SHEAR_PER_STIFFNESS: f64 = 1.8;

/// The cubes of `spacing` that have their centre in the organ, from the lowest corner of its box, a corner of each as its name.
fn cells(organ: &Organ, [low, high]: [Vec3; 2], spacing: f64) -> BTreeSet<[usize; 3]> {
    let [nx, ny, nz] = [0, 1, 2].map(|axis| ((high[axis] - low[axis]) / spacing).ceil() as usize);
    let all = (0..nx).flat_map(|i| (0..ny).flat_map(move |j| (0..nz).map(move |k| [i, j, k])));
    let centre = |cell: &[usize; 3]| low + Vec3::from(cell.map(|n| (n as f64 + 0.5) * spacing));
    let mut cells: BTreeSet<[usize; 3]> = all.filter(|cell| (organ.holds)(&centre(cell))).collect();
    while let Some(cell) = cells.iter().find(|cell| meets_at_an_edge(&cells, **cell)).copied() {
        cells.remove(&cell);
    }
    cells
}

/// True for a cell that touches another one only along an edge: their surface would be none that a tool can follow.
fn meets_at_an_edge(cells: &BTreeSet<[usize; 3]>, cell: [usize; 3]) -> bool {
    let holds = |steps: [isize; 3]| neighbour(cell, steps).is_some_and(|other| cells.contains(&other));
    (0..3).any(|axis| {
        [(1, 1), (1, -1), (-1, 1), (-1, -1)].into_iter().any(|(u, v)| {
            let at = |u: isize, v: isize| {
                let mut steps = [0; 3];
                (steps[(axis + 1) % 3], steps[(axis + 2) % 3]) = (u, v);
                holds(steps)
            };
            at(u, v) && !at(u, 0) && !at(0, v)
        })
    })
}

fn neighbour(cell: [usize; 3], steps: [isize; 3]) -> Option<[usize; 3]> {
    let [i, j, k] = [0, 1, 2].map(|axis| cell[axis].checked_add_signed(steps[axis]));
    Some([i?, j?, k?])
}

fn corners(cell: [usize; 3]) -> [[usize; 3]; 8] {
    std::array::from_fn(|n| [cell[0] + (n & 1), cell[1] + (n >> 1 & 1), cell[2] + (n >> 2 & 1)])
}

/// The step to the cell behind each face, and the corners of the face counter-clockwise from outside.
fn faces(cell: [usize; 3]) -> impl Iterator<Item = ([isize; 3], [[usize; 3]; 4])> {
    (0..3).flat_map(move |axis| {
        [0, 1].map(move |side: usize| {
            let corner = |[u, v]: [usize; 2]| {
                let mut at = cell;
                at[axis] += side;
                at[(axis + 1) % 3] += u;
                at[(axis + 2) % 3] += v;
                at
            };
            let mut around = [[0, 0], [1, 0], [1, 1], [0, 1]].map(corner);
            let mut step = [0; 3];
            step[axis] = if side == 1 { 1 } else { -1 };
            if side == 0 {
                around.reverse();
            }
            (step, around)
        })
    })
}

/// The organ between the corners of `bounds` as nodes `spacing` (m) apart, springs to all 26 neighbours, and the cubes' outer faces for a
/// surface. One number is all there is to choose: Poisson's ratio is what such springs have, a quarter.
pub fn lattice(organ: &Organ, bounds: [Vec3; 2], spacing: f64) -> Result<SpringNetwork, Error> {
    let cells = cells(organ, bounds, spacing);
    let mut nodes: BTreeMap<[usize; 3], u32> =
        cells.iter().flat_map(|&cell| corners(cell)).map(|node| (node, 0)).collect();
    (0..).zip(nodes.values_mut()).for_each(|(number, node)| *node = number);
    let id = |corner: [usize; 3]| nodes[&corner];
    let rest: Vec<Vec3> = nodes.keys().map(|at| bounds[0] + Vec3::from(at.map(|n| n as f64 * spacing))).collect();
    let pairs: BTreeSet<(u32, u32)> = cells
        .iter()
        .map(|&cell| corners(cell).map(id))
        .flat_map(|ids| ids.into_iter().flat_map(move |i| ids.into_iter().map(move |j| (i, j))))
        .filter(|(i, j)| i < j)
        .collect();
    let spring = |(i, j): (u32, u32)| {
        let spring = Spring {
            stiffness: organ.tissue.young_modulus * spacing / YOUNG_PER_STIFFNESS,
            damping: organ.tissue.viscosity * spacing / SHEAR_PER_STIFFNESS,
            rest_length: (rest[j as usize] - rest[i as usize]).norm(),
        };
        (i, j, spring)
    };
    let springs: Vec<_> = pairs.into_iter().map(spring).collect();
    let outer = cells.iter().flat_map(|&cell| faces(cell).map(move |face| (cell, face)));
    let outer = outer.filter(|(cell, (step, _))| neighbour(*cell, *step).is_none_or(|other| !cells.contains(&other)));
    let triangles = outer.flat_map(|(_, (_, around))| {
        let [a, b, c, d] = around.map(id);
        [[a, b, c], [a, c, d]]
    });
    let mass = organ.tissue.density * spacing.powi(3);
    let held = nodes.iter().filter(|(at, _)| at[organ.held_axis] == 0).map(|(_, &node)| node);
    let triangles = triangles.collect();
    let network = SpringNetwork::builder(rest).masses(vec![mass; nodes.len()]).springs(springs).surface(triangles);
    Ok(held.fold(network, |network, node| network.fix(node)).build()?)
}
