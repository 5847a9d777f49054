//! What is beyond the neighbourhood of a patch, coarsely.

use std::collections::HashMap;

use super::coupling::{Coupling, LowerTriangle};
use crate::Vec3;
use crate::body::{Body, State, TangentBlock, bounds};

/// Boxes of the grid, at most about.
const BOXES: f64 = 700.0;
/// Nodes in a box, at least: with fewer the grid would be as fine as the body.
const IN_BOX: f64 = 8.0;
/// A corner that less than so much of a node follows is left out, unless the node has none that is followed more.
const LEAST: f64 = 0.5;
/// Along an axis where a body has less than this share of its largest extent it is flat but for rounding.
const FLAT: f64 = 1e-6;

/// The nodes of a body outside a part of it. Each moves as the corners of the box that it is in do, in a grid over all of them: linearly
/// between them along each axis, but where corners are left out.
///
/// In the motions that are left to them they store and dissipate what the body does, and yield less than it by what is left out. Their
/// masses are divided among the corners. As shares are not negative and add up to 1, the mass of a motion is at least what it is in the
/// body: what is stable with the body's nodes is stable with them.
#[derive(Debug)]
pub(super) struct Beyond {
    /// The number of nodes that follow.
    pub(super) nodes: usize,
    /// At rest (m).
    pub(super) corners: Vec<Vec3>,
    /// Their masses (kg).
    pub(super) masses: Vec<f64>,
    /// Between corners, the higher one first.
    pub(super) between: Vec<((u32, u32), Coupling)>,
    /// How a corner answers to a node of the part, in the part's numbering; the node answers to it likewise.
    pub(super) to_part: Vec<((u32, u32), Coupling)>,
}

impl Beyond {
    /// What of `body` is outside `part`, which has a place for each of its nodes that can move.
    ///
    /// # Real-time
    /// Not real-time safe: allocates, looks at all of the body.
    pub(super) fn new(body: &dyn Body, part: &HashMap<u32, u32>) -> Self {
        let (rest, inverse_masses) = (body.rest(), body.inverse_masses());
        let is_outside = |&node: &u32| inverse_masses[node as usize] > 0.0 && !part.contains_key(&node);
        let outside: Vec<u32> = (0..rest.len() as u32).filter(is_outside).collect();
        let points: Vec<Vec3> = outside.iter().map(|&node| rest[node as usize]).collect();
        let (corners, shares) = Grid::over(&points).followed(&points);
        let mut masses = vec![0.0; corners.len()];
        let mut place = vec![None; rest.len()];
        for (n, &node) in outside.iter().enumerate() {
            place[node as usize] = Some(n);
            shares[n]
                .iter()
                .for_each(|&(corner, share)| masses[corner as usize] += share / inverse_masses[node as usize]);
        }

        let (mut between, mut to_part) = (LowerTriangle::default(), HashMap::<_, Coupling>::new());
        // How one node answers to corners. Blocks of a row mostly follow each other; where they do not, this only takes longer.
        let (mut row, mut answers) = (None, Vec::<(u32, Coupling)>::new());
        let mut close = |row: Option<usize>, answers: &mut Vec<(u32, Coupling)>| {
            let of_row = row.map_or(&[][..], |row: usize| &shares[row][..]);
            for &(corner, share) in of_row {
                answers.iter().for_each(|(other, coupling)| between.add((corner, *other), coupling, share));
            }
            answers.clear();
        };
        body.tangent(&State::at_rest(rest), &outside, false, &mut |block| {
            let TangentBlock { column, .. } = block;
            let at = place[block.row as usize];
            if row != at {
                close(row, &mut answers);
                row = at;
            }
            let coupling = Coupling { stiffness: -block.position, damping: -block.velocity };
            let of_row = at.map_or(&[][..], |row| &shares[row][..]);
            if let Some(&node) = part.get(&column) {
                for &(corner, share) in of_row {
                    to_part.entry((corner, node)).or_default().add(&coupling, share);
                }
            } else if let Some(other) = place[column as usize] {
                for &(corner, share) in &shares[other] {
                    let known = answers.iter().position(|(other, _)| *other == corner);
                    let known = known.unwrap_or_else(|| {
                        answers.push((corner, Coupling::default()));
                        answers.len() - 1
                    });
                    answers[known].1.add(&coupling, share);
                }
            }
        });
        close(row, &mut answers);
        let mut to_part: Vec<_> = to_part.into_iter().collect();
        to_part.sort_unstable_by_key(|&(pair, _)| pair);
        Self { nodes: outside.len(), corners, masses, between: between.symmetrised(), to_part }
    }
}

/// Boxes that fill the box around some points.
#[derive(Debug)]
struct Grid {
    low: Vec3,
    /// Edges of a box (m).
    edges: Vec3,
    /// Corners along each axis.
    counts: [usize; 3],
}

impl Grid {
    /// Of boxes that are as long as wide where the points are: along an axis where they reach less far than that there is one.
    fn over(points: &[Vec3]) -> Self {
        let [low, high] = bounds(points.iter());
        let extents = high - low;
        let is_flat = |axis: usize| extents[axis] <= FLAT * extents.max();
        let boxes = (points.len() as f64 / IN_BOX).min(BOXES);
        let mut divided: Vec<usize> = (0..3).filter(|&axis| !is_flat(axis)).collect();
        let edge = loop {
            let extent: f64 = divided.iter().map(|&axis| extents[axis]).product();
            let edge = (extent / boxes).powf(1.0 / divided.len().max(1) as f64);
            let before = divided.len();
            divided.retain(|&axis| extents[axis] >= edge);
            if divided.len() == before {
                break edge;
            }
        };
        let boxes_along = |axis: usize| match divided.contains(&axis) {
            true => (extents[axis] / edge).round() as usize,
            false => usize::from(!is_flat(axis)),
        };
        let counts = [0, 1, 2].map(|axis| boxes_along(axis) + 1);
        let edges = Vec3::from_fn(|axis, _| extents[axis] / (counts[axis] - 1).max(1) as f64);
        Self { low, edges, counts }
    }

    /// The corners that `points` follow, and for each point which of them by what share.
    fn followed(&self, points: &[Vec3]) -> (Vec<Vec3>, Vec<Vec<(u32, f64)>>) {
        let mut shares: Vec<Vec<(u32, f64)>> = points.iter().map(|point| self.shares(point)).collect();
        let mut weights = vec![0.0; self.counts.iter().product()];
        shares.iter().flatten().for_each(|&(corner, share)| weights[corner as usize] += share);
        let heaviest = |shares: &[(u32, f64)]| {
            let by_weight = |a: &&(u32, f64), b: &&(u32, f64)| weights[a.0 as usize].total_cmp(&weights[b.0 as usize]);
            shares.iter().max_by(by_weight).map_or(0.0, |&(corner, _)| weights[corner as usize])
        };
        for shares in &mut shares {
            let least = LEAST.min(heaviest(shares));
            shares.retain(|&(corner, _)| weights[corner as usize] >= least);
            let sum: f64 = shares.iter().map(|(_, share)| share).sum();
            shares.iter_mut().for_each(|(_, share)| *share /= sum);
        }
        let mut used: Vec<u32> = shares.iter().flatten().map(|&(corner, _)| corner).collect();
        used.sort_unstable();
        used.dedup();
        let number: HashMap<u32, u32> = used.iter().copied().zip(0..).collect();
        shares.iter_mut().flatten().for_each(|(corner, _)| *corner = number[corner]);
        (used.into_iter().map(|corner| self.corner(corner as usize)).collect(), shares)
    }

    /// Which corners `point` follows, by what share; all of it is 1.
    fn shares(&self, point: &Vec3) -> Vec<(u32, f64)> {
        let along = [0, 1, 2].map(|axis| {
            let (count, edge) = (self.counts[axis], self.edges[axis]);
            if count == 1 {
                return [(0, 1.0), (0, 0.0)];
            }
            let at = (point[axis] - self.low[axis]) / edge;
            let first = (at.max(0.0) as usize).min(count - 2);
            let share = at - first as f64;
            [(first, 1.0 - share), (first + 1, share)]
        });
        let [x, y, z] = along;
        let number = |[i, j, k]: [usize; 3]| ((k * self.counts[1] + j) * self.counts[0] + i) as u32;
        let all = x.into_iter().flat_map(|x| y.into_iter().flat_map(move |y| z.into_iter().map(move |z| [x, y, z])));
        // Next to a corner rounding leaves shares of nothing to the others.
        let all = all
            .map(|of: [(usize, f64); 3]| (number(of.map(|(at, _)| at)), of.iter().map(|(_, share)| share).product()));
        all.filter(|&(_, share): &(u32, f64)| share > 1e-9).collect()
    }

    fn corner(&self, number: usize) -> Vec3 {
        let [nx, ny, _] = self.counts;
        let at = [number % nx, number / nx % ny, number / (nx * ny)];
        self.low + Vec3::from_fn(|axis, _| at[axis] as f64 * self.edges[axis])
    }
}

#[cfg(test)]
mod tests {
    use super::super::coupling::couplings;
    use super::super::far::Far;
    use super::super::resting::RestingBody;
    use super::*;
    use crate::body::{Block, BlockBuilder, Shape, Tetrahedra, Tissue, Where};
    use crate::linear_algebra::Matrix;
    use crate::mesh::{Face, TetrahedralMesh};

    /// A block of 16^3 nodes, 9 mm apart, and a patch in the middle of its top.
    fn block(builder: impl Fn(BlockBuilder) -> BlockBuilder) -> (Block, Vec<u32>) {
        let block = builder(Block::builder([16; 3], [0.135; 3]).damping_ratio(0.3)).build().unwrap();
        let nearest = crate::mesh::NearestTriangle::new(block.surface(), block.rest()).unwrap();
        let mut patch = Vec::new();
        block.patch(&[nearest.find(&Vec3::new(0.067, 0.066, 0.135))], [4, 4, 2], &mut patch);
        (block, patch)
    }

    /// What is beyond the nodes in the lower half of `body`, and the place of each of these.
    fn beyond_the_lower_half(body: &dyn Body) -> (Beyond, HashMap<u32, u32>) {
        let is_low = |&node: &u32| body.rest()[node as usize].z < 0.064;
        let part = (0..body.rest().len() as u32).filter(is_low).zip(0..).collect();
        (Beyond::new(body, &part), part)
    }

    #[test]
    fn corners_have_the_mass_of_what_follows_them_and_none_is_left_without() {
        let (block, _) = block(|builder| builder.node_mass(1e-3));
        let (beyond, part) = beyond_the_lower_half(&block);
        let mass = 1e-3 * (block.rest().len() - part.len()) as f64;
        assert!((beyond.masses.iter().sum::<f64>() - mass).abs() < 1e-12);
        let least = beyond.masses.iter().copied().fold(f64::INFINITY, f64::min);
        assert!(least >= LEAST * 1e-3 && beyond.corners.len() < 500, "{least} kg, {} corners", beyond.corners.len());
    }

    /// A cube of tetrahedra with averaged pressure, whose couplings are not symmetric in themselves.
    fn tetrahedra(cells: usize) -> Tetrahedra {
        let nodes = cells + 1;
        let id = |at: [usize; 3]| (at[0] + nodes * (at[1] + nodes * at[2])) as u32;
        let mut mesh = TetrahedralMesh::default();
        let at = |n: usize, count: usize| [n % count, n / count % count, n / (count * count)];
        mesh.points.extend((0..nodes.pow(3)).map(|n| Vec3::from(at(n, nodes).map(|c| 0.01 * c as f64))));
        for first in (0..cells.pow(3)).map(|n| at(n, cells)) {
            for axes in [[0, 1, 2], [1, 2, 0], [2, 0, 1], [0, 2, 1], [1, 0, 2], [2, 1, 0]] {
                let mut corner = first;
                let mut next = |axis: usize| {
                    corner[axis] += 1;
                    id(corner)
                };
                let mut corners = [id(first), next(axes[0]), next(axes[1]), next(axes[2])];
                if (axes[0] + 1) % 3 != axes[1] {
                    corners.swap(2, 3);
                }
                mesh.tetrahedra.push(corners);
            }
        }
        let bottom = Where::Shape(Shape::Layer { axis: 2, from: 0.0, to: 0.0 });
        Tetrahedra::builder(mesh).tissue(Tissue::LIVER).fix(bottom).build().unwrap()
    }

    /// A strain that is the same everywhere is one that a grid can follow: its energy is that of the body.
    fn assert_same_energy(body: &dyn Body) {
        let (beyond, part) = beyond_the_lower_half(body);
        let strain = |x: &Vec3| Vec3::new(0.3 * x.x + 0.1 * x.z, 0.2 * x.x - 0.4 * x.y, 0.5 * x.z - 0.2 * x.y);
        let energy = |a: Vec3, coupling: &Coupling, b: Vec3, is_same: bool| {
            a.dot(&(coupling.stiffness * b)) * if is_same { 0.5 } else { 1.0 }
        };
        let is_beyond = |node: u32| !part.contains_key(&node);
        let at = |node: u32| strain(&body.rest()[node as usize]);
        let of_body = couplings(body).into_iter().filter(|((row, column), _)| is_beyond(*row) || is_beyond(*column));
        let of_body: f64 = of_body.map(|((row, column), of)| energy(at(row), &of, at(column), row == column)).sum();
        let corner = |corner: u32| strain(&beyond.corners[corner as usize]);
        let between = beyond.between.iter().map(|((a, b), of)| energy(corner(*a), of, corner(*b), a == b));
        let nodes: HashMap<u32, u32> = part.iter().map(|(&node, &place)| (place, node)).collect();
        let to_part = beyond.to_part.iter().map(|((a, node), of)| energy(corner(*a), of, at(nodes[node]), false));
        let coarse: f64 = between.chain(to_part).sum();
        assert!((coarse - of_body).abs() < 1e-9 * of_body.abs(), "{coarse} J of {of_body}");
    }

    #[test]
    fn a_strain_that_is_the_same_everywhere_has_the_energy_that_it_has_in_the_body() {
        assert_same_energy(&block(|builder| builder).0);
        assert_same_energy(&tetrahedra(12));
    }

    #[test]
    fn boxes_are_as_long_as_wide_and_a_flat_body_has_one_layer_of_corners() {
        let counts = |nodes: [usize; 3], noise: f64| {
            let all = (0..nodes.iter().product())
                .map(|n: usize| [n % nodes[0], n / nodes[0] % nodes[1], n / (nodes[0] * nodes[1])]);
            let points: Vec<Vec3> = all
                .enumerate()
                .map(|(n, at)| Vec3::from(at.map(|c| 0.01 * c as f64)) + Vec3::z() * (noise * (n as f64).sin()))
                .collect();
            let grid = Grid::over(&points);
            let (corners, shares) = grid.followed(&points);
            let whole =
                |shares: &Vec<(u32, f64)>| (shares.iter().map(|(_, share)| share).sum::<f64>() - 1.0).abs() < 1e-12;
            assert!(shares.len() == points.len() && shares.iter().all(whole), "{nodes:?}");
            assert!(corners.len() <= grid.counts.iter().product());
            grid.counts
        };
        // With 8 nodes in a box, then with 700 boxes.
        assert_eq!(counts([9; 3], 0.0), [5; 3]);
        assert_eq!(counts([27; 3], 0.0), [10; 3]);
        for noise in [0.0, 1e-17, 1e-12] {
            assert_eq!(counts([13, 13, 1], noise), [6, 6, 1]);
        }
        assert_eq!(counts([100, 100, 4], 0.0), [27, 27, 2], "a plate");
        assert_eq!(counts([400, 1, 1], 0.0), [51, 1, 1], "a row");
        assert_eq!((counts([1; 3], 0.0), counts([0; 3], 0.0)), ([1; 3], [1; 3]));
        assert_eq!(counts([2; 3], 0.0), [2; 3]);
    }

    /// How far the ring goes where it is pushed, with what is beyond coarse, and with the nodes there held.
    #[test]
    fn a_ring_yields_nearly_as_in_the_whole_body_and_more_than_between_held_nodes() {
        let (block, patch) = block(|builder| builder.fix(Face::ZMin));
        let pushed = |body: &RestingBody, patch: &[u32]| {
            let restriction = body.restriction(patch).unwrap();
            let ring = restriction.ring(patch.len());
            let far = Far::new(body, patch, &restriction);
            let rows = far.unknowns_of(ring);
            let mut forces = Matrix::zeros(far.unknowns(), 3);
            rows.iter().enumerate().for_each(|(n, &row)| forces[(row, n % 3)] = 1.0);
            let ways = far.factorised(20.0).unwrap().solve(forces);
            let way = |axis: usize| rows.iter().skip(axis).step_by(3).map(|&row| ways[(row, axis)]).sum::<f64>();
            Vec3::from_fn(|axis, _| way(axis))
        };
        let whole = RestingBody::new(&block).unwrap();
        let exact = pushed(&whole, &patch);
        let whole = whole.with_neighbours(700);
        let mut around = whole.around(&patch).unwrap();
        let held = pushed(&around.body, &around.patch);
        around.look_beyond(&whole);
        let coarse = pushed(&around.body, &around.patch);
        let off = |way: Vec3| way.component_div(&exact).map(|share| (share - 1.0).abs()).max();
        assert!(off(held) > 0.1 && off(coarse) < 0.02, "off by {} and {}", off(held), off(coarse));
    }
}
