//! Bodies without any regularity, for tests.

use crate::body::{Block, Body, Spring, SpringNetwork};
use crate::mesh::Face;

/// A number from 0 to 1.
pub(super) fn random(seed: &mut u64) -> f64 {
    *seed = seed.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
    (*seed >> 11) as f64 / (1_u64 << 53) as f64
}

/// A block whose springs and masses differ by up to ten times, damped out of all proportion; and its patch.
pub(super) fn uneven(seed: &mut u64) -> (SpringNetwork, Vec<u32>) {
    let block = Block::builder([6, 5, 5], [0.05, 0.04, 0.04]).fix(Face::ZMin).build().unwrap();
    let mut patch = Vec::new();
    block.patch(&[block.surface().triangles.len() as u32 - 9], [3, 3, 2], &mut patch);
    let mut builder = SpringNetwork::builder(block.rest().to_vec());
    builder = builder.masses(block.rest().iter().map(|_| 1e-4 * (1.0 + 9.0 * random(seed))).collect());
    for (i, j, spring) in block.springs() {
        let (stiffness, damping) = (10.0 + 90.0 * random(seed), 0.3 * random(seed));
        builder = builder.spring(i, j, Spring { stiffness, damping, ..spring });
    }
    let held = (0..block.rest().len() as u32).filter(|&node| block.inverse_masses()[node as usize] == 0.0);
    let builder = held.fold(builder, |builder, node| builder.fix(node));
    let body = builder.surface(block.surface().triangles.clone()).build().unwrap();
    (body, patch)
}
