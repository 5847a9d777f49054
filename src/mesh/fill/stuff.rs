//! Isosurface stuffing (Labelle and Shewchuk 2007): the lattice is cut by the surface, warped to it where a cut is near, and filled.

use std::collections::HashMap;

use palpate_model::Vec3;
use palpate_model::mesh::TetrahedralMesh;

use super::ImplicitShape;
use super::lattice::{FORWARD, Lattice, Steps};
use super::stencil::{Corner, fill_one};

/// Below these fractions of a long and a short edge a cut point draws the end to itself: the pair with which the worst of all cases,
/// tried one by one, has the largest smallest angle, the paper's bounds of 10.7 and 164.8 degrees.
pub(super) const NEAR: [f64; 2] = [0.2852, 0.3977];

/// Where the surface crosses an edge of the lattice.
struct Cut {
    ends: [u32; 2],
    /// Along the edge, from its first end.
    fraction: f64,
    position: Vec3,
}

/// The lattice and what the surface did to it.
pub(super) struct Warped {
    pub lattice: Lattice,
    /// 1 inside, 0 on the surface, -1 outside.
    pub signs: Vec<i8>,
    /// Positions of points that were drawn to the surface.
    drawn: HashMap<u32, Vec3>,
    cuts: HashMap<[u32; 2], Vec3>,
}

impl Warped {
    /// Cuts and warps `lattice`; `depths` are positive inside, one for each point.
    pub fn new(lattice: Lattice, depths: &[f32], shape: &impl ImplicitShape, progress: &mut dyn FnMut(f64)) -> Self {
        let cuts = cut_edges(&lattice, depths, shape, progress);
        let mut signs: Vec<i8> = depths.iter().map(|&depth| (depth > 0.0) as i8 - (depth < 0.0) as i8).collect();
        let mut at_point: Vec<(u32, u32)> =
            cuts.iter().enumerate().flat_map(|(n, cut)| cut.ends.map(|end| (end, n as u32))).collect();
        at_point.sort_unstable();
        let mut drawn = HashMap::new();
        for of_point in at_point.chunk_by(|one, other| one.0 == other.0) {
            let point = of_point[0].0;
            let mut nearest = (f64::INFINITY, None);
            for cut in of_point.iter().map(|&(_, n)| &cuts[n as usize]) {
                // A cut is gone once the other end was drawn to the surface.
                let [first, second] = cut.ends;
                let is_long = lattice.steps(first)[0] % 2 == lattice.steps(second)[0] % 2;
                let fraction = if point == first { cut.fraction } else { 1.0 - cut.fraction };
                let distance = fraction * if is_long { 1.0 } else { 0.75_f64.sqrt() };
                let stands = signs[first as usize] * signs[second as usize] < 0;
                if stands && fraction < NEAR[usize::from(!is_long)] && distance < nearest.0 {
                    nearest = (distance, Some(cut.position));
                }
            }
            if let (_, Some(position)) = nearest {
                signs[point as usize] = 0;
                drawn.insert(point, position);
            }
        }
        let cuts = cuts.into_iter().map(|cut| (cut.ends, cut.position)).collect();
        Self { lattice, signs, drawn, cuts }
    }

    /// The sign of a point.
    pub fn sign(&self, steps: Steps) -> i8 {
        self.signs[self.lattice.id_inside(steps) as usize]
    }
}

/// The cuts of all edges, in the order of their first ends.
fn cut_edges(lattice: &Lattice, depths: &[f32], shape: &impl ImplicitShape, progress: &mut dyn FnMut(f64)) -> Vec<Cut> {
    let mut cuts = Vec::new();
    for first in 0..lattice.len() as u32 {
        if first % 65_536 == 0 {
            progress(f64::from(first) / lattice.len() as f64);
        }
        let depth = depths[first as usize];
        if depth == 0.0 {
            continue;
        }
        let from = lattice.steps(first);
        for way in FORWARD {
            let to = [0, 1, 2].map(|axis| from[axis] + way[axis]);
            let Some(second) = lattice.id(to) else { continue };
            let other = depths[second as usize];
            // Not by their product: two small ones have none.
            if (depth > 0.0 && other < 0.0) || (depth < 0.0 && other > 0.0) {
                let (start, end) = (lattice.position(from), lattice.position(to));
                let fraction = crossing(|x| -shape.signed_distance(&(start + (end - start) * x)), [depth, other]);
                cuts.push(Cut { ends: [first, second], fraction, position: start + (end - start) * fraction });
            }
        }
    }
    cuts
}

/// Where `depth` is zero between 0 and 1, given its values of opposite signs at the ends: false position, the Illinois way.
fn crossing(depth: impl Fn(f64) -> f64, ends: [f32; 2]) -> f64 {
    let [mut low, mut high] = [(0.0, f64::from(ends[0])), (1.0, f64::from(ends[1]))];
    let tolerance = 1e-7 * (low.1.abs() + high.1.abs());
    let mut middle = 0.5;
    for _ in 0..40 {
        let at = (low.0 * high.1 - high.0 * low.1) / (high.1 - low.1);
        middle = if at > low.0 && at < high.0 { at } else { 0.5 * (low.0 + high.0) };
        let value = depth(middle);
        if value.abs() <= tolerance || value.is_nan() {
            break;
        }
        // An end that stays counts half, so that both close in.
        if (value > 0.0) == (high.1 > 0.0) {
            high = (middle, value);
            low.1 *= 0.5;
        } else {
            low = (middle, value);
            high.1 *= 0.5;
        }
    }
    middle
}

/// The elements inside the surface, with nodes in the order of their first use.
pub(super) struct Elements<'a> {
    warped: &'a Warped,
    own: HashMap<u32, u32>,
    cut: HashMap<[u32; 2], u32>,
    pub mesh: TetrahedralMesh,
}

impl<'a> Elements<'a> {
    pub fn new(warped: &'a Warped) -> Self {
        let (own, cut) = (HashMap::new(), HashMap::new());
        Self { warped, own, cut, mesh: TetrahedralMesh::default() }
    }

    /// Adds what is inside of the tetrahedron with corners at `at`, 0-1 and 2-3 being its long edges.
    pub fn add(&mut self, at: [Steps; 4]) {
        let signs = at.map(|steps| self.warped.sign(steps));
        fill_one(&at, signs, |corners| {
            let nodes = corners.map(|corner| self.node(&at, corner));
            self.mesh.tetrahedra.push(nodes);
        });
    }

    fn node(&mut self, at: &[Steps; 4], corner: Corner) -> u32 {
        let Self { warped, own, cut, mesh } = self;
        let mut push = |position: Vec3| {
            mesh.points.push(position);
            mesh.points.len() as u32 - 1
        };
        match corner {
            Corner::Own(n) => {
                let id = warped.lattice.id_inside(at[n]);
                let position = || warped.drawn.get(&id).copied().unwrap_or_else(|| warped.lattice.position(at[n]));
                *own.entry(id).or_insert_with(|| push(position()))
            }
            Corner::Cut(a, b) => {
                let [a, b] = [a, b].map(|n| warped.lattice.id_inside(at[n]));
                // Every edge is named from one of its ends.
                let key = if warped.cuts.contains_key(&[a, b]) { [a, b] } else { [b, a] };
                *cut.entry(key).or_insert_with(|| push(warped.cuts[&key]))
            }
        }
    }
}
