//! The part of a body that no spring of a patch touches, linear around its rest state.

use super::super::dissection::{Adjacency, dissection};
use super::super::sparse::SparseFactor;
use super::super::{Mat3, Vec3, dense};
use super::SpringGraph;

/// A node that does not move, or that belongs to the patch.
const NOT_FAR: u32 = u32::MAX;
/// Damping over stiffness may differ by this much between springs and still count as proportional.
const PROPORTIONAL: f64 = 1e-9;

/// A spring in the direction that it has at rest, between places in [`Far::nodes`] or [`NOT_FAR`].
#[derive(Debug)]
struct FarSpring {
    places: [u32; 2],
    direction: Vec3,
    stiffness: f64,
    damping: f64,
}

/// The movable nodes outside a patch, and the springs between them.
#[derive(Debug)]
pub(super) struct Far {
    /// Ids, in increasing order.
    pub(super) nodes: Vec<u32>,
    /// Their masses (kg).
    pub(super) masses: Vec<f64>,
    place: Vec<u32>,
    springs: Vec<FarSpring>,
}

impl Far {
    /// Outside `patch` (ids in increasing order).
    pub(super) fn new(graph: &SpringGraph, patch: &[u32]) -> Self {
        let mut place = vec![NOT_FAR; graph.rest().len()];
        let mut nodes = Vec::new();
        let outside = |node: u32| patch.binary_search(&node).is_err();
        for (node, &w) in graph.inverse_masses().iter().enumerate() {
            if w > 0.0 && outside(node as u32) {
                place[node] = nodes.len() as u32;
                nodes.push(node as u32);
            }
        }
        let masses = nodes.iter().map(|&node| 1.0 / graph.inverse_masses()[node as usize]).collect();
        let springs = graph.links().iter().filter(|link| link.nodes.iter().all(|&node| outside(node)));
        let springs = springs.filter_map(|link| {
            let [a, b] = link.nodes.map(|node| node as usize);
            let along = graph.rest()[b] - graph.rest()[a];
            let is_spring = along.norm() > 0.0 && (place[a] != NOT_FAR || place[b] != NOT_FAR);
            is_spring.then(|| FarSpring {
                places: [place[a], place[b]],
                direction: along.normalize(),
                stiffness: link.spring.stiffness,
                damping: link.spring.damping,
            })
        });
        let springs = springs.collect();
        Self { nodes, masses, place, springs }
    }

    /// Three unknowns per node.
    pub(super) fn unknowns(&self) -> usize {
        3 * self.nodes.len()
    }

    /// The unknown of `node` (an id) along `axis`.
    pub(super) fn unknown(&self, node: u32, axis: usize) -> usize {
        3 * self.place[node as usize] as usize + axis
    }

    /// Entries (row, column, value) of the lower triangle of s^2 M - s C - K.
    fn shifted(&self, s: f64) -> Vec<(usize, usize, f64)> {
        let mut entries = Vec::with_capacity(self.springs.len() * 21 + self.unknowns());
        for (place, mass) in self.masses.iter().enumerate() {
            entries.extend((0..3).map(|axis| (3 * place + axis, 3 * place + axis, s * s * mass)));
        }
        for spring in &self.springs {
            let [a, b] = spring.places;
            let block: Mat3 = spring.direction * spring.direction.transpose() * (spring.stiffness + s * spring.damping);
            for (row, column, sign) in [(a, a, 1.0), (b, b, 1.0), (a.max(b), a.min(b), -1.0)] {
                if row == NOT_FAR || column == NOT_FAR {
                    continue;
                }
                for i in 0..3 {
                    for j in 0..3 {
                        let (row, column) = (3 * row as usize + i, 3 * column as usize + j);
                        if row >= column {
                            entries.push((row, column, sign * block[(i, j)]));
                        }
                    }
                }
            }
        }
        entries
    }

    /// s^2 M - s C - K, factorised. `None` if nothing holds the body.
    pub(super) fn factorised(&self, graph: &SpringGraph, s: f64) -> Option<SparseFactor> {
        let (n, entries) = (self.unknowns(), self.shifted(s));
        match self.order(graph) {
            Some(order) => SparseFactor::new_ordered(n, &entries, &order),
            None => SparseFactor::new(n, &entries),
        }
    }

    /// The unknowns in an order of elimination with little fill, if their places give one.
    fn order(&self, graph: &SpringGraph) -> Option<Vec<usize>> {
        let points: Vec<Vec3> = self.nodes.iter().map(|&node| graph.rest()[node as usize]).collect();
        let pairs = self.springs.iter().map(|spring| spring.places).filter(|places| !places.contains(&NOT_FAR));
        let order = dissection(&points, &Adjacency::new(points.len(), pairs))?;
        Some(order.into_iter().flat_map(|place| (0..3).map(move |axis| 3 * place as usize + axis)).collect())
    }

    /// Multiplies each column of `columns` by M.
    pub(super) fn times_mass(&self, columns: &mut [f64]) {
        for column in columns.chunks_exact_mut(self.unknowns()) {
            for (x, mass) in column.chunks_exact_mut(3).zip(&self.masses) {
                x.iter_mut().for_each(|x| *x *= mass);
            }
        }
    }

    /// Phi^T M Phi for the columns of `shapes`.
    pub(super) fn mass(&self, shapes: &[f64]) -> Vec<f64> {
        let mut weighted = shapes.to_vec();
        self.times_mass(&mut weighted);
        dense::product(shapes, &weighted, self.unknowns())
    }

    /// Phi^T K Phi and Phi^T C Phi: K and C answer to displacements and velocities with a force, so both are negative.
    pub(super) fn stiffness_and_damping(&self, shapes: &[f64]) -> (Vec<f64>, Vec<f64>) {
        let of = |weight: &dyn Fn(&FarSpring) -> f64| {
            // How far each shape stretches each spring, times the root of the weight.
            let mut stretches = Vec::with_capacity(shapes.len() / self.unknowns().max(1) * self.springs.len());
            for shape in shapes.chunks_exact(self.unknowns()) {
                let at = |place: u32| match place {
                    NOT_FAR => Vec3::zeros(),
                    place => Vec3::from_column_slice(&shape[3 * place as usize..][..3]),
                };
                let stretch = |spring: &FarSpring| {
                    let [a, b] = spring.places.map(at);
                    spring.direction.dot(&(b - a)) * weight(spring).sqrt()
                };
                stretches.extend(self.springs.iter().map(stretch));
            }
            let mut matrix = dense::symmetric_product(&stretches, self.springs.len());
            matrix.iter_mut().for_each(|x| *x = -*x);
            matrix
        };
        let stiffness = of(&|spring| spring.stiffness);
        let damping = match self.proportional_damping() {
            Some(share) => stiffness.iter().map(|x| x * share).collect(),
            None => of(&|spring| spring.damping),
        };
        (stiffness, damping)
    }

    /// False if its nodes hang on the patch alone, as around a patch that is nearly all of a small body.
    pub(super) fn has_springs(&self) -> bool {
        !self.springs.is_empty()
    }

    /// Damping over stiffness, if it is the same for every spring.
    pub(super) fn proportional_damping(&self) -> Option<f64> {
        let first = self.springs.first().filter(|spring| spring.stiffness > 0.0)?;
        let share = first.damping / first.stiffness;
        let same =
            |spring: &FarSpring| (spring.damping - share * spring.stiffness).abs() <= PROPORTIONAL * spring.damping;
        self.springs.iter().all(same).then_some(share)
    }

    /// Columns of smooth displacements, polynomials of the position up to `degree` along each axis: what waves of the
    /// whole body look like.
    pub(super) fn smooth_fields(&self, graph: &SpringGraph, degree: i32) -> Vec<f64> {
        let rest = |node: u32| graph.rest()[node as usize];
        let low = self.nodes.iter().fold(Vec3::repeat(f64::INFINITY), |low, &node| low.inf(&rest(node)));
        let high = self.nodes.iter().fold(Vec3::repeat(f64::NEG_INFINITY), |high, &node| high.sup(&rest(node)));
        let extent = (high - low).map(|length| length.max(f64::MIN_POSITIVE));
        let powers = (0..=degree).flat_map(|a| (0..=degree - a).map(move |b| (a, b)));
        let powers = powers.flat_map(|(a, b)| (0..=degree - a - b).map(move |c| [a, b, c]));
        let mut columns = Vec::new();
        for [a, b, c] in powers {
            for axis in 0..3 {
                for &node in &self.nodes {
                    let x = (rest(node) - low).component_div(&extent) * 2.0 - Vec3::repeat(1.0);
                    let value = x.x.powi(a) * x.y.powi(b) * x.z.powi(c);
                    columns.extend((0..3).map(|along| if along == axis { value } else { 0.0 }));
                }
            }
        }
        columns
    }
}
