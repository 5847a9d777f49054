//! How deep the points of the lattice lie below the surface: positive inside.

use super::ImplicitShape;
use super::distance::Closed;
use super::lattice::{FORWARD, Lattice};
use crate::MeshError;

/// The depth of every point, by asking for each.
pub(super) fn everywhere(
    shape: &impl ImplicitShape,
    lattice: &Lattice,
    progress: &mut dyn FnMut(f64),
) -> Result<Vec<f32>, MeshError> {
    let mut depths = vec![0.0; lattice.len()];
    for (id, depth) in depths.iter_mut().enumerate() {
        if id % 65_536 == 0 {
            progress(id as f64 / lattice.len() as f64);
        }
        let steps = lattice.steps(id as u32);
        *depth = -shape.signed_distance(&lattice.position(steps)) as f32;
        if depth.is_nan() {
            return Err(MeshError::new(format!("the shape has no distance at {:?}", lattice.position(steps))));
        }
        let at_rim = (0..3).any(|axis| steps[axis] < 2 || steps[axis] as usize > 2 * lattice.cells[axis] - 2);
        if *depth >= 0.0 && at_rim {
            return Err(MeshError::new("the shape reaches beyond its bounds: they must enclose it"));
        }
    }
    Ok(depths)
}

/// The depth of the points that have an edge through the surface, by asking for those near a triangle; of the others only whether they
/// are inside, which spreads from those.
pub(super) fn near(closed: &Closed, lattice: &Lattice, progress: &mut dyn FnMut(f64)) -> Result<Vec<f32>, MeshError> {
    let mut depths = vec![f32::NAN; lattice.len()];
    let mut known = points_near(closed, lattice);
    known.sort_unstable();
    known.dedup();
    for (n, &id) in known.iter().enumerate() {
        if n % 4096 == 0 {
            progress(n as f64 / known.len() as f64);
        }
        let depth = -closed.signed_distance(&lattice.position(lattice.steps(id))) as f32;
        if depth.is_nan() {
            return Err(MeshError::new("the surface has no distance from some point: its numbers are too large"));
        }
        depths[id as usize] = depth;
    }
    // An edge that leaves the known points is longer away from the surface than it is long.
    known.retain(|&id| depths[id as usize] != 0.0);
    while let Some(id) = known.pop() {
        let (steps, far) = (lattice.steps(id), f32::INFINITY.copysign(depths[id as usize]));
        for way in FORWARD.iter().flat_map(|way| [*way, way.map(|step| -step)]) {
            let Some(next) = lattice.id([0, 1, 2].map(|axis| steps[axis] + way[axis])) else { continue };
            if depths[next as usize].is_nan() {
                depths[next as usize] = far;
                known.push(next);
            }
        }
    }
    Ok(depths)
}

/// The points within an edge's length of a triangle, and some more; many of them several times.
fn points_near(closed: &Closed, lattice: &Lattice) -> Vec<u32> {
    let reach = 1.001 * lattice.cell_m;
    let mut points = Vec::new();
    for [a, b, c] in closed.triangles() {
        let normal = (b - a).cross(&(c - a)).try_normalize(0.0);
        let bounds = [a.inf(&b).inf(&c).add_scalar(-reach), a.sup(&b).sup(&c).add_scalar(reach)];
        let [low, high] = lattice.enclosing(bounds);
        for k in low[2]..=high[2] {
            for j in (low[1]..=high[1]).filter(|j| (j - k) % 2 == 0) {
                for i in (low[0]..=high[0]).filter(|i| (i - k) % 2 == 0) {
                    let offset = lattice.position([i, j, k]) - a;
                    if normal.is_none_or(|normal| normal.dot(&offset).abs() <= reach) {
                        points.push(lattice.id_inside([i, j, k]));
                    }
                }
            }
        }
    }
    points
}
