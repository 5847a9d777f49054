//! `scaled_boundary`: a linear patch held by springs as weak as the depth of material behind it makes them.

use super::super::Vec3;
use super::super::body::Body;
use super::Kind;
use super::linear::{Boundary, LinearPatch, LinearSpec};

/// As [`Patch`](super::Patch), but the springs to the outside answer to the patch's motion with k/n and b/n: the paper scales
/// them by depth (section 6) and does not say how, and n equal springs in a row, of which the far end is held, have the
/// stiffness k/n. Here n is the number of springs that fit between the patch node and the body's end, in the direction of
/// the spring. The force at the resync is not changed.
pub type ScaledBoundary = LinearPatch<Layered>;

/// Surroundings of many layers.
#[derive(Clone, Copy, Debug)]
pub struct Layered {
    /// Corners of the box around the body at rest (m).
    low: Vec3,
    high: Vec3,
}

impl Layered {
    /// The surroundings in `body`.
    ///
    /// # Real-time
    /// Not called in a tick: bounded by the body.
    pub fn new(body: &dyn Body) -> Self {
        let none = (Vec3::repeat(f64::INFINITY), Vec3::repeat(f64::NEG_INFINITY));
        let (low, high) = body.rest().iter().fold(none, |(low, high), x| (low.inf(x), high.sup(x)));
        Self { low, high }
    }

    /// How many times `along` (m) fits between `from` and the side of the box that it points to; at least once.
    fn layers(&self, from: &Vec3, along: &Vec3) -> f64 {
        let until_side = (0..3).filter(|&axis| along[axis] != 0.0).map(|axis| {
            let side = if along[axis] > 0.0 { self.high[axis] } else { self.low[axis] };
            (side - from[axis]) / along[axis]
        });
        let layers = until_side.fold(f64::INFINITY, f64::min).round();
        if layers.is_finite() { layers.max(1.0) } else { 1.0 }
    }
}

impl Boundary for Layered {
    const KIND: Kind = Kind::ScaledBoundary;

    fn share(&self, body: &dyn Body, row: u32, column: u32) -> f64 {
        let (from, to) = (body.rest()[row as usize], body.rest()[column as usize]);
        1.0 / self.layers(&from, &(to - from))
    }
}

impl ScaledBoundary {
    /// An empty patch of a body with surroundings `boundary`.
    ///
    /// # Real-time
    /// Not called in a tick. Memory comes with the first [`rebuild`](super::LocalModel::rebuild).
    pub fn new(spec: LinearSpec, boundary: Layered) -> Self {
        Self::with_boundary(spec, boundary)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn layers_are_counted_along_the_spring() {
        let body = Layered { low: Vec3::zeros(), high: Vec3::new(11.0, 11.0, 11.0) };
        let top = Vec3::new(5.0, 5.0, 10.0);
        assert_eq!(body.layers(&top, &-Vec3::z()), 10.0);
        assert_eq!(body.layers(&top, &Vec3::new(1.0, 0.0, -1.0)), 6.0);
        assert_eq!(body.layers(&top, &Vec3::new(-1.0, 0.0, 0.0)), 5.0);
        assert_eq!(body.layers(&top, &Vec3::new(0.0, 1.0, 1.0)), 1.0);
        assert_eq!(body.layers(&top, &Vec3::zeros()), 1.0);
    }
}
