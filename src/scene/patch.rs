//! Which patches a block has room for.

use super::BlockSpec;
use crate::model::mesh::Face;

/// The window is clamped at thin faces, so it has to fit one of the faces that can be touched: those that are not fixed.
pub(super) fn patch_fits(patch: [usize; 3], block: &BlockSpec) -> bool {
    free_faces(block).any(|(_, limits)| (0..3).all(|part| (2..=limits[part]).contains(&patch[part])))
}

/// The largest patch of at most `patch` nodes that fits a free face; of several such faces, that with most nodes.
pub(super) fn fitting_patch(patch: [usize; 3], block: &BlockSpec) -> [usize; 3] {
    let on = |(_, limits): (_, [usize; 3])| -> [usize; 3] { std::array::from_fn(|part| patch[part].min(limits[part])) };
    free_faces(block).map(on).max_by_key(|patch| patch.iter().product::<usize>()).unwrap_or(patch)
}

/// The faces that can be touched, and the largest patch on each.
pub(super) fn free_faces(block: &BlockSpec) -> impl Iterator<Item = (&'static Face, [usize; 3])> {
    let limits = |face: &'static Face| {
        let across = face.axis();
        let [first, second] = [[1, 2], [0, 2], [0, 1]][across];
        (face, [first, second, across].map(|axis| block.nodes[axis]))
    };
    Face::ALL.iter().filter(|face| !block.fixed.contains(face)).map(limits)
}
