//! The small questions that validation asks again and again.

use super::super::BlockSpec;
use crate::error::Error;
use crate::model::mesh::Face;

/// A finite number above zero.
pub(super) fn positive(field: &str, value: f64) -> Result<(), Error> {
    if value.is_finite() && value > 0.0 {
        return Ok(());
    }
    Err(Error::scene(field, format!("is {value}, must be a finite number above 0")))
}

/// A finite number of at least zero.
pub(super) fn not_negative(field: &str, value: f64) -> Result<(), Error> {
    if value.is_finite() && value >= 0.0 {
        return Ok(());
    }
    Err(Error::scene(field, format!("is {value}, must be a finite number of at least 0")))
}

/// A time of at most `longest_ms` (ms).
pub(super) fn at_most_ms(field: &str, ms: f64, longest_ms: f64) -> Result<(), Error> {
    if ms <= longest_ms {
        return Ok(());
    }
    Err(Error::scene(field, format!("is {ms}, must be at most {longest_ms} ms")))
}

/// Three finite lengths within `limit_m` (m).
pub(super) fn lengths_within(field: &str, values_m: [f64; 3], limit_m: f64) -> Result<(), Error> {
    if values_m.iter().all(|value| value.is_finite() && value.abs() <= limit_m) {
        return Ok(());
    }
    Err(Error::scene(field, format!("is {values_m:?}, must be three finite numbers of at most {limit_m} m")))
}

/// A node of the block.
pub(super) fn inside(field: &str, node: [usize; 3], block: &BlockSpec) -> Result<(), Error> {
    if (0..3).all(|axis| node[axis] < block.nodes[axis]) {
        return Ok(());
    }
    let last = block.nodes.map(|nodes| nodes - 1);
    Err(Error::scene(field, format!("{node:?} is outside the body, nodes run from [0, 0, 0] to {last:?}")))
}

/// A node that can move; `why` completes the sentence for one that cannot.
pub(super) fn movable(field: &str, node: [usize; 3], block: &BlockSpec, why: &str) -> Result<(), Error> {
    inside(field, node, block)?;
    match block.fixed.iter().find(|face| face.holds(node, block.nodes)) {
        None => Ok(()),
        Some(face) => {
            let face = face.name();
            Err(Error::scene(
                field,
                format!("{node:?} is on the fixed face {face}: {why}, choose a node off that face"),
            ))
        }
    }
}

/// True if `node` lies on any face.
pub(super) fn on_surface(node: [usize; 3], nodes: [usize; 3]) -> bool {
    Face::ALL.iter().any(|face| face.holds(node, nodes))
}
