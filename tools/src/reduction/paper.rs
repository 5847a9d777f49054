//! The meshes of the paper's section 2.2: squares and cubes of cells whose top-middle node is moved.

use palpate::model::ModelError;

use super::linalg::Matrix;
use super::system::{Assembly, Ports, SecondOrder};

/// A 2D or 3D lattice of cells with springs and dampers to all neighbours, every edge or face but the top held. Its input is
/// the displacement of the top's middle node, its output the force that moves it.
///
/// The paper's "n x n" counts cells: (n + 1)^d nodes; that is how all its orders come out. The node in the middle is at index
/// n/2, (n + 1)/2 for an odd n.
#[derive(Clone, Debug, PartialEq)]
pub struct PaperMesh {
    /// Cells along each axis, the last one upward: two or three.
    pub cells: Vec<usize>,
    /// k of every spring (N/m).
    pub stiffness: f64,
    /// m of every node (kg).
    pub mass: f64,
    /// zeta in b = zeta sqrt(2 m k).
    pub damping_ratio: f64,
}

impl PaperMesh {
    /// A mesh of n x n cells.
    pub fn square(n: usize) -> Self {
        Self::of(vec![n; 2])
    }

    /// A mesh of n x n x n cells.
    pub fn cube(n: usize) -> Self {
        Self::of(vec![n; 3])
    }

    /// The paper's local model, 4 x 2 or 4 x 4 x 2 cells, in as many dimensions as this mesh has and of the same material.
    pub fn local(&self) -> Self {
        let cells = if self.cells.len() == 2 { vec![4, 2] } else { vec![4, 4, 2] };
        Self { cells, ..self.clone() }
    }

    fn of(cells: Vec<usize>) -> Self {
        Self { cells, stiffness: 100.0, mass: 1e-3, damping_ratio: 1.0 }
    }

    /// Sets zeta to `ratio`.
    #[must_use]
    pub fn damping_ratio(mut self, ratio: f64) -> Self {
        self.damping_ratio = ratio;
        self
    }

    /// The number of dimensions: 2 or 3.
    pub fn dimensions(&self) -> usize {
        self.cells.len()
    }

    /// The node that is moved, by its place along each axis.
    pub fn middle(&self) -> Vec<usize> {
        let top = self.cells.len() - 1;
        self.cells.iter().enumerate().map(|(axis, &n)| if axis == top { n } else { n.div_ceil(2) }).collect()
    }

    fn is_held(&self, node: &[usize]) -> bool {
        let top = self.cells.len() - 1;
        node.iter().zip(&self.cells).enumerate().any(|(axis, (&i, &n))| i == 0 || (axis != top && i == n))
    }

    /// All nodes by their places along each axis, the first axis fastest.
    fn nodes(&self) -> Vec<Vec<usize>> {
        let mut nodes = vec![Vec::new()];
        for &n in self.cells.iter().rev() {
            nodes =
                (nodes.into_iter()).flat_map(|rest| (0..=n).map(move |i| [vec![i], rest.clone()].concat())).collect();
        }
        nodes
    }

    /// The free nodes, in the order of the coordinates of [`system`](Self::system), as many numbers each as dimensions.
    pub fn free_nodes(&self) -> Vec<Vec<usize>> {
        let middle = self.middle();
        self.nodes().into_iter().filter(|node| !self.is_held(node) && *node != middle).collect()
    }

    /// The linear system: M x'' + C_ff x' + K_ff x = -K_fi u, y = K_ii u + K_if x + C_if x'.
    ///
    /// # Errors
    /// If a number is not positive, the mesh has fewer than two cells along an axis, or not two or three axes.
    pub fn system(&self) -> Result<SecondOrder, ModelError> {
        self.check()?;
        let d = self.cells.len();
        let (free, middle) = (self.free_nodes(), self.middle());
        let place: std::collections::HashMap<&[usize], usize> =
            free.iter().enumerate().map(|(place, node)| (&node[..], place)).collect();
        let n = d * free.len();
        let beta = self.damping_ratio * (2.0 * self.mass * self.stiffness).sqrt() / self.stiffness;
        let mut assembly = Assembly::default();
        (0..n).for_each(|at| assembly.add(at, at, [self.mass, 0.0, 0.0]));
        let (mut coupling, mut direct) = (Matrix::zeros(n, d), Matrix::zeros(d, d));
        for node in self.nodes() {
            for offset in forward(d) {
                let Some(other) = neighbour(&node, &offset, &self.cells) else { continue };
                let norm = offset.iter().map(|&c| (c * c) as f64).sum::<f64>();
                let block = |i: usize, j: usize| self.stiffness * (offset[i] * offset[j]) as f64 / norm;
                for (here, there) in [(&node, &other), (&other, &node)] {
                    if *here == middle {
                        direct += Matrix::from_fn(d, d, block);
                    }
                    let Some(&row) = place.get(&here[..]) else { continue };
                    for i in 0..d {
                        for j in 0..d {
                            let k = block(i, j);
                            assembly.add(d * row + i, d * row + j, [0.0, beta * k, k]);
                            match place.get(&there[..]) {
                                Some(&column) => assembly.add(d * row + i, d * column + j, [0.0, -beta * k, -k]),
                                None if *there == middle => coupling[(d * row + i, j)] -= k,
                                None => {}
                            }
                        }
                    }
                }
            }
        }
        let damping = &coupling * beta;
        Ok(assembly.build(n, Ports::held(coupling, damping, direct)))
    }

    fn check(&self) -> Result<(), ModelError> {
        let positive = |x: f64| x.is_finite() && x > 0.0;
        if !matches!(self.cells.len(), 2 | 3) || self.cells.iter().any(|&n| n < 2) {
            return Err(ModelError::of(
                "cells",
                format!("{:?}: two or three numbers of at least 2 are needed", self.cells),
            ));
        }
        for (field, value) in
            [("stiffness", self.stiffness), ("mass", self.mass), ("damping_ratio", self.damping_ratio)]
        {
            if !positive(value) {
                return Err(ModelError::of(field, format!("{value}: a finite value above 0 is needed")));
            }
        }
        Ok(())
    }
}

/// The offsets to half of the neighbours; with their opposites they are all 8 or 26.
fn forward(dimensions: usize) -> Vec<Vec<isize>> {
    let mut offsets = vec![Vec::new()];
    for _ in 0..dimensions {
        offsets = offsets.into_iter().flat_map(|o| (-1..=1).map(move |c| [o.clone(), vec![c]].concat())).collect();
    }
    let is_forward = |offset: &Vec<isize>| offset.iter().rev().find(|&&c| c != 0).is_some_and(|&c| c > 0);
    offsets.retain(is_forward);
    offsets
}

fn neighbour(node: &[usize], offset: &[isize], cells: &[usize]) -> Option<Vec<usize>> {
    let moved = node.iter().zip(offset).zip(cells);
    moved.map(|((&i, &by), &n)| i.checked_add_signed(by).filter(|&to| to <= n)).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    // Check all orders of the paper's Tables 1 and 2, and of its local models.
    #[test]
    fn the_orders_are_those_of_the_paper() {
        let order = |mesh: PaperMesh| mesh.system().unwrap().order();
        assert_eq!([5, 10, 12, 15, 20, 25].map(|n| order(PaperMesh::square(n))), [76, 356, 524, 836, 1516, 2396]);
        assert_eq!([4, 5, 6, 7].map(|n| order(PaperMesh::cube(n))), [210, 474, 894, 1506]);
        assert_eq!(order(PaperMesh::square(12).local()), 20);
        assert_eq!(order(PaperMesh::cube(6).local()), 102);
    }

    #[test]
    fn meshes_that_are_none_are_refused() {
        assert!(PaperMesh::square(1).system().unwrap_err().to_string().contains("at least 2"));
        assert!(PaperMesh::square(4).damping_ratio(0.0).system().unwrap_err().to_string().contains("damping_ratio"));
    }
}
