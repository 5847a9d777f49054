//! The linear model of a patch, and the implicit step that it can take.

mod blocks;
mod implicit;
mod tangent;

pub(crate) use implicit::ImplicitStep;
pub(crate) use tangent::{Drift, PatchTangent};

/// A patch of a block for tests: the nodes around the middle of its top, and their tangent.
#[cfg(test)]
pub(crate) fn patch_of(block: &crate::body::Block, state: &crate::body::State) -> (Vec<u32>, PatchTangent) {
    use crate::body::Body;
    let (mut nodes, mut tangent) = (Vec::new(), PatchTangent::default());
    block.patch(&[block.surface().triangles.len() as u32 - 5], [4, 4, 2], &mut nodes);
    let place = |node: u32| nodes.iter().position(|&other| other == node);
    tangent.rebuild(block, state, &nodes, &place, &|_, _| 1.0);
    (nodes, tangent)
}
