//! A block whose evaluation of forces is the program's own: it counts, stalls or fails, and is a block in all the rest.

use std::fmt;

use palpate::model::Vec3;
use palpate::model::body::{Block, Body, State, TangentBlock};
use palpate::model::mesh::Surface;

/// A [`Block`] with other `forces`.
#[derive(Clone)]
pub struct AlteredBlock<F> {
    block: Block,
    forces: F,
    copies: bool,
}

impl<F: FnMut(&mut Block, &State, &mut [Vec3]) + Clone + Send + Sync + 'static> AlteredBlock<F> {
    /// `forces` is called in place of the block's.
    pub fn new(block: Block, forces: F) -> Self {
        Self { block, forces, copies: false }
    }

    /// It can be copied for a restart; what `forces` shares by reference, copies share.
    pub fn with_copies(self) -> Self {
        Self { copies: true, ..self }
    }
}

impl<F> fmt::Debug for AlteredBlock<F> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("AlteredBlock").field("block", &self.block).finish_non_exhaustive()
    }
}

impl<F: FnMut(&mut Block, &State, &mut [Vec3]) + Clone + Send + Sync + 'static> Body for AlteredBlock<F> {
    fn rest(&self) -> &[Vec3] {
        self.block.rest()
    }
    fn inverse_masses(&self) -> &[f64] {
        self.block.inverse_masses()
    }
    fn surface(&self) -> &Surface {
        self.block.surface()
    }
    fn forces(&mut self, state: &State, forces: &mut [Vec3]) {
        (self.forces)(&mut self.block, state, forces);
    }
    fn node_forces(&self, state: &State, nodes: &[u32], forces: &mut [Vec3]) {
        self.block.node_forces(state, nodes, forces);
    }
    fn tangent(&self, state: &State, nodes: &[u32], clamp: bool, emit: &mut dyn FnMut(TangentBlock)) {
        self.block.tangent(state, nodes, clamp, emit);
    }
    fn duplicate(&self) -> Option<Box<dyn Body>> {
        self.copies.then(|| Box::new(self.clone()) as Box<dyn Body>)
    }
    fn patch(&self, triangles: &[u32], size: [usize; 3], nodes: &mut Vec<u32>) {
        self.block.patch(triangles, size, nodes);
    }
}
