//! The reduced basis of what surrounds a patch: how its ring answers to forces, in few states.

use std::collections::HashMap;
use std::sync::Arc;

use super::super::dense;
use super::super::sparse::SparseFactor;
use super::super::{Mat3, Vec3};
use super::SpringGraph;
use crate::error::{Error, ErrorKind};

/// The real frequency that the Krylov vectors are expanded at (rad/s): between rest and what a hand does.
const EXPANSION: f64 = 2.0 * std::f64::consts::PI * 15.0;
/// Moments: Z_0, Z_1 and Z_2.
const MOMENTS: usize = 3;

/// The surroundings of one patch in r states eta: displacements of the ring Phi eta, with
/// eta'' = K eta + C eta' + B^T f for forces f on the ring.
///
/// Phi spans the leading left singular vectors of `[Z_0/|Z_0|, Z_1/|Z_1|, Z_2/|Z_2|]`, Z_0 = A^-1 B the answers to unit
/// forces on the ring, Z_(i+1) = A^-1 M Z_i, A = s0^2 M - s0 C - K over the springs that touch no patch node, at rest:
/// moment matching at a real frequency (Grimme 1997) and a singular value truncation. It depends on patch, material and
/// topology, not on time.
#[derive(Clone, Debug, PartialEq)]
pub struct Basis {
    /// Ids of the patch nodes, in increasing order.
    pub(crate) patch: Vec<u32>,
    /// Ids of the ring nodes, in increasing order.
    pub(crate) ring: Vec<u32>,
    /// States r.
    pub(crate) states: usize,
    /// Phi on the ring: 3 |ring| rows of r.
    pub(crate) shapes: Vec<f64>,
    /// M_r^-1 K_r, r rows of r (1/s^2).
    pub(crate) stiffness: Vec<f64>,
    /// M_r^-1 C_r, r rows of r (1/s).
    pub(crate) damping: Vec<f64>,
    /// Phi M_r^-1 on the ring: 3 |ring| rows of r (1/kg).
    pub(crate) inputs: Vec<f64>,
}

impl Basis {
    /// The basis of the surroundings of `patch` (ids in increasing order) with at most `states` states.
    ///
    /// # Errors
    /// If nothing holds the surroundings together, so that they have no finite answer.
    ///
    /// # Real-time
    /// Not real-time safe: factorises a matrix of the whole body's size, seconds of work for a large one.
    pub fn compute(graph: &SpringGraph, patch: &[u32], states: usize) -> Result<Self, Error> {
        let (mut ring, mut held) = (Vec::new(), Vec::new());
        graph.neighbours(patch, &mut ring, &mut held);
        let far = Far::new(graph, patch);
        if ring.is_empty() || far.nodes.is_empty() {
            return Ok(Self::rigid(patch, ring));
        }
        let indefinite =
            || Error::new(ErrorKind::Scene, "the surroundings of a patch are not held together").at("local.patch");
        let factor = SparseFactor::new(3 * far.nodes.len(), &far.entries()).ok_or_else(indefinite)?;
        let columns = 3 * ring.len();
        let rows = 3 * far.nodes.len();
        let mut moments = Vec::with_capacity(MOMENTS * rows * columns);
        let mut right = vec![0.0; rows * columns];
        for (place, &node) in ring.iter().enumerate() {
            for axis in 0..3 {
                let row = 3 * far.place[node as usize] as usize + axis;
                right[(3 * place + axis) * rows + row] = 1.0;
            }
        }
        for _ in 0..MOMENTS {
            factor.solve(&mut right);
            let scale = 1.0 / right.iter().map(|x| x * x).sum::<f64>().sqrt();
            moments.extend(right.iter().map(|x| x * scale));
            for column in right.chunks_exact_mut(rows) {
                for (x, &mass) in column.chunks_exact_mut(3).zip(&far.masses) {
                    x.iter_mut().for_each(|x| *x *= mass);
                }
            }
        }
        let shapes = dense::leading_left_singular_vectors(&moments, rows, states);
        if !shapes.iter().all(|x| x.is_finite()) {
            return Err(indefinite());
        }
        Ok(far.reduce(patch, ring, &shapes, shapes.len() / rows))
    }

    /// Of a ring that moves as predicted, whatever happens.
    fn rigid(patch: &[u32], ring: Vec<u32>) -> Self {
        let none = Vec::new;
        let patch = patch.to_vec();
        Self { patch, ring, states: 0, shapes: none(), stiffness: none(), damping: none(), inputs: none() }
    }

    /// States r.
    ///
    /// # Real-time
    /// Wait-free, real-time safe.
    pub fn states(&self) -> usize {
        self.states
    }
}

/// The part of a body that no spring of a patch touches.
struct Far {
    nodes: Vec<u32>,
    /// Place of each node of the body in `nodes`; `u32::MAX` for those of the patch and held ones.
    place: Vec<u32>,
    masses: Vec<f64>,
    /// Springs outside the patch, with the direction that they have at rest.
    links: Vec<(u32, u32, Vec3, f64, f64)>,
}

impl Far {
    fn new(graph: &SpringGraph, patch: &[u32]) -> Self {
        let mut place = vec![u32::MAX; graph.rest().len()];
        let mut nodes = Vec::new();
        for (node, &w) in graph.inverse_masses().iter().enumerate() {
            if w > 0.0 && patch.binary_search(&(node as u32)).is_err() {
                place[node] = nodes.len() as u32;
                nodes.push(node as u32);
            }
        }
        let masses = nodes.iter().map(|&node| 1.0 / graph.inverse_masses()[node as usize]).collect();
        let outside = |node: u32| patch.binary_search(&node).is_err();
        let links = graph.links().iter().filter(|link| link.nodes.iter().all(|&node| outside(node)));
        let links = links.map(|link| {
            let [a, b] = link.nodes.map(|node| node as usize);
            let along = graph.rest()[b] - graph.rest()[a];
            (place[a], place[b], along / along.norm(), link.spring.stiffness, link.spring.damping)
        });
        let links = links.filter(|link| link.0 != u32::MAX || link.1 != u32::MAX).collect();
        Self { nodes, place, masses, links }
    }

    /// A = s0^2 M - s0 C - K, lower triangle.
    fn entries(&self) -> Vec<(usize, usize, f64)> {
        let mut entries = Vec::with_capacity(self.links.len() * 21 + 3 * self.nodes.len());
        for (node, mass) in self.masses.iter().enumerate() {
            entries.extend((0..3).map(|axis| (3 * node + axis, 3 * node + axis, EXPANSION * EXPANSION * mass)));
        }
        for &(a, b, u, k, damping) in &self.links {
            let block: Mat3 = u * u.transpose() * (k + EXPANSION * damping);
            for (row, column, sign) in [(a, a, 1.0), (b, b, 1.0), (a.max(b), a.min(b), -1.0)] {
                if row == u32::MAX || column == u32::MAX {
                    continue;
                }
                for i in 0..3 {
                    for j in 0..3 {
                        let at = (3 * row as usize + i, 3 * column as usize + j);
                        if at.0 >= at.1 {
                            entries.push((at.0, at.1, sign * block[(i, j)]));
                        }
                    }
                }
            }
        }
        entries
    }

    /// The matrices of the reduced model; `shapes` has `states` columns.
    fn reduce(&self, patch: &[u32], ring: Vec<u32>, shapes: &[f64], states: usize) -> Basis {
        let rows = 3 * self.nodes.len();
        // Rows of Phi, so that a node's three lie together.
        let mut by_row = vec![0.0; rows * states];
        for (column, shape) in shapes.chunks_exact(rows).enumerate() {
            for (row, &x) in shape.iter().enumerate() {
                by_row[row * states + column] = x;
            }
        }
        let at = |place: u32| (place != u32::MAX).then(|| &by_row[3 * place as usize * states..][..3 * states]);
        let (mut k, mut c) = (dense::zeros(states), dense::zeros(states));
        let mut stretch = vec![0.0; states];
        for &(a, b, u, stiffness, damping) in &self.links {
            // How far each shape stretches the spring.
            for (state, stretch) in stretch.iter_mut().enumerate() {
                let along = |rows: Option<&[f64]>| {
                    rows.map_or(0.0, |rows| {
                        u.x * rows[state] + u.y * rows[states + state] + u.z * rows[2 * states + state]
                    })
                };
                *stretch = along(at(b)) - along(at(a));
            }
            dense::add_outer(&mut k, &stretch, -stiffness);
            dense::add_outer(&mut c, &stretch, -damping);
        }
        let mut m = dense::zeros(states);
        for (rows, &mass) in by_row.chunks_exact(3 * states).zip(&self.masses) {
            rows.chunks_exact(states).for_each(|row| dense::add_outer(&mut m, row, mass));
        }
        let mut on_ring = Vec::with_capacity(3 * ring.len() * states);
        for &node in &ring {
            on_ring.extend_from_slice(&by_row[3 * self.place[node as usize] as usize * states..][..3 * states]);
        }
        Basis {
            patch: patch.to_vec(),
            ring,
            states,
            stiffness: transposed(&dense::solve_rows(&m, &k, states), states),
            damping: transposed(&dense::solve_rows(&m, &c, states), states),
            inputs: dense::solve_rows(&m, &on_ring, states),
            shapes: on_ring,
        }
    }
}

/// A square matrix the other way round: (K M^-1)^T = M^-1 K.
fn transposed(matrix: &[f64], n: usize) -> Vec<f64> {
    (0..n * n).map(|at| matrix[at % n * n + at / n]).collect()
}

/// The bases that are there, by patch.
#[derive(Clone, Debug, Default)]
pub struct Bases {
    of: HashMap<Vec<u32>, Arc<Basis>>,
}

impl Bases {
    /// The basis for `patch` (ids in increasing order), if it is there.
    ///
    /// # Real-time
    /// Bounded, by the patch; does not allocate.
    pub fn get(&self, patch: &[u32]) -> Option<&Arc<Basis>> {
        self.of.get(patch)
    }

    /// Adds one.
    ///
    /// # Real-time
    /// For the global actor: allocates.
    pub fn insert(&mut self, basis: Arc<Basis>) {
        self.of.insert(basis.patch.clone(), basis);
    }

    /// How many there are.
    ///
    /// # Real-time
    /// Wait-free, real-time safe.
    pub fn len(&self) -> usize {
        self.of.len()
    }

    /// True without any.
    ///
    /// # Real-time
    /// Wait-free, real-time safe.
    pub fn is_empty(&self) -> bool {
        self.of.is_empty()
    }
}
