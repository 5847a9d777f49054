//! The part of a body that no spring of a patch touches, linear around its rest state.

use super::graph::SpringGraph;
use crate::Vec3;
use crate::body::{Spring, assemble};
use crate::linear_algebra::{Matrix, SparseFactor, dissection, product_t, push_block, symmetric_product};

/// Damping over stiffness may differ by this much between springs and still count as proportional.
const PROPORTIONAL: f64 = 1e-9;

/// A spring in the direction that it has at rest, between places in [`Far::nodes`]; `None` is a node that does not move.
#[derive(Debug)]
struct FarSpring {
    places: [Option<u32>; 2],
    direction: Vec3,
    spring: Spring,
}

/// The movable nodes outside a patch, and the springs between them.
#[derive(Debug)]
pub(super) struct Far {
    /// Ids, in increasing order.
    pub(super) nodes: Vec<u32>,
    /// Their masses (kg).
    pub(super) masses: Vec<f64>,
    place: Vec<Option<u32>>,
    springs: Vec<FarSpring>,
}

impl Far {
    /// Outside `patch` (ids in increasing order).
    pub(super) fn new(graph: &SpringGraph, patch: &[u32]) -> Self {
        let mut place = vec![None; graph.rest().len()];
        let mut nodes = Vec::new();
        let outside = |node: u32| patch.binary_search(&node).is_err();
        for (node, &w) in graph.inverse_masses().iter().enumerate() {
            if w > 0.0 && outside(node as u32) {
                place[node] = Some(nodes.len() as u32);
                nodes.push(node as u32);
            }
        }
        let masses = nodes.iter().map(|&node| 1.0 / graph.inverse_masses()[node as usize]).collect();
        let springs = graph.links().iter().filter(|link| link.nodes.iter().all(|&node| outside(node)));
        let springs = springs.filter_map(|link| {
            let places = link.nodes.map(|node| place[node as usize]);
            let direction = graph.direction(link).filter(|_| places != [None; 2])?;
            Some(FarSpring { places, direction, spring: link.spring })
        });
        let springs = springs.collect();
        Self { nodes, masses, place, springs }
    }

    /// Three unknowns per node.
    pub(super) fn unknowns(&self) -> usize {
        3 * self.nodes.len()
    }

    /// The unknowns of `nodes` (ids), three each.
    pub(super) fn unknowns_of(&self, nodes: &[u32]) -> Vec<usize> {
        let place = |&node: &u32| self.place[node as usize].expect("it is far and can move") as usize;
        nodes.iter().map(place).flat_map(|place| 3 * place..3 * place + 3).collect()
    }

    /// A unit force on each of `nodes` (ids) along each axis, as columns.
    pub(super) fn unit_forces(&self, nodes: &[u32]) -> Matrix {
        let mut forces = Matrix::zeros(self.unknowns(), 3 * nodes.len());
        self.unknowns_of(nodes).into_iter().enumerate().for_each(|(column, row)| forces[(row, column)] = 1.0);
        forces
    }

    /// Entries (row, column, value) of the lower triangle of s^2 M - s C - K.
    fn shifted(&self, s: f64) -> Vec<(usize, usize, f64)> {
        let mut entries = Vec::with_capacity(self.springs.len() * 21 + self.unknowns());
        for (place, mass) in self.masses.iter().enumerate() {
            entries.extend((0..3).map(|axis| (3 * place + axis, 3 * place + axis, s * s * mass)));
        }
        for spring in &self.springs {
            let rows = spring.places.map(|place| place.map(|place| 3 * place as usize));
            let weight = spring.spring.stiffness + s * spring.spring.damping;
            assemble(spring.direction, weight, rows, |row, column, block| {
                push_block(&mut entries, row, column, &block);
            });
        }
        entries
    }

    /// s^2 M - s C - K, factorised. `None` if nothing holds the body.
    pub(super) fn factorised(&self, graph: &SpringGraph, s: f64) -> Option<SparseFactor> {
        // In an order of elimination with little fill, if the places of the nodes give one.
        let points: Vec<Vec3> = self.nodes.iter().map(|&node| graph.rest()[node as usize]).collect();
        let pairs = self.springs.iter().filter_map(|spring| Some([spring.places[0]?, spring.places[1]?]));
        SparseFactor::new(self.unknowns(), &self.shifted(s), dissection(&points, pairs).as_deref())
    }

    /// Multiplies each column of `columns` by M.
    pub(super) fn times_mass(&self, columns: &mut Matrix) {
        for mut column in columns.column_iter_mut() {
            for (x, mass) in column.as_mut_slice().as_chunks_mut::<3>().0.iter_mut().zip(&self.masses) {
                x.iter_mut().for_each(|x| *x *= mass);
            }
        }
    }

    /// Phi^T M Phi for the columns of `shapes`.
    pub(super) fn mass(&self, shapes: &Matrix) -> Matrix {
        let mut weighted = shapes.clone();
        self.times_mass(&mut weighted);
        product_t(shapes, &weighted)
    }

    /// Phi^T K Phi and Phi^T C Phi: K and C answer to displacements and velocities with a force, so both are negative.
    pub(super) fn stiffness_and_damping(&self, shapes: &Matrix) -> (Matrix, Matrix) {
        let of = |weight: fn(&Spring) -> f64| {
            // How far each shape stretches each spring, times the root of the weight.
            let mut stretches = Matrix::zeros(self.springs.len(), shapes.ncols());
            for (shape, mut stretches) in shapes.column_iter().zip(stretches.column_iter_mut()) {
                let at = |place: Option<u32>| {
                    place.map_or_else(Vec3::zeros, |place| shape.fixed_rows::<3>(3 * place as usize).into_owned())
                };
                for (FarSpring { places, direction, spring }, stretch) in self.springs.iter().zip(&mut stretches) {
                    let [a, b] = places.map(at);
                    *stretch = direction.dot(&(b - a)) * weight(spring).sqrt();
                }
            }
            -symmetric_product(&stretches)
        };
        let stiffness = of(|spring| spring.stiffness);
        let damping = match self.proportional_damping() {
            Some(share) => &stiffness * share,
            None => of(|spring| spring.damping),
        };
        (stiffness, damping)
    }

    /// False if its nodes hang on the patch alone, as around a patch that is nearly all of a small body.
    pub(super) fn has_springs(&self) -> bool {
        !self.springs.is_empty()
    }

    /// Damping over stiffness, if it is the same for every spring.
    pub(super) fn proportional_damping(&self) -> Option<f64> {
        let first = self.springs.first().map(|first| first.spring).filter(|first| first.stiffness > 0.0)?;
        let share = first.damping / first.stiffness;
        let same = |spring: &Spring| (spring.damping - share * spring.stiffness).abs() <= PROPORTIONAL * spring.damping;
        self.springs.iter().all(|other| same(&other.spring)).then_some(share)
    }

    /// Columns of smooth displacements, polynomials of the position up to `degree` along each axis: what waves of the
    /// whole body look like.
    pub(super) fn smooth_fields(&self, graph: &SpringGraph, degree: i32) -> Matrix {
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
        Matrix::from_vec(self.unknowns(), columns.len() / self.unknowns(), columns)
    }
}
