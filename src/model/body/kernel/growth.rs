//! The first of two passes over linear tetrahedra, eight at once: how their volumes have grown, and which of them have become so large that
//! the body's steps may be too long for them.

use super::super::tetrahedra::Element;
use super::nodes::{LANES, Lane, Motion};
use super::simd::{Numbers, Simd, Work};

/// By how much the stable step of an element's nodes may become shorter than that of the body at rest before they are looked at: steps at
/// rest are 1.3 times shorter than they must be.
const LOOKED_AT: f64 = 1.2;

/// The nodes of eight elements of which no two have a common one; nodes are counted from the part's first. A place that is
/// left over has the node after the last four times.
pub(super) type Corners = [Numbers; 4];

/// Eight elements at rest, for the first of two passes.
#[derive(Clone, Copy, Debug, Default)]
#[repr(C, align(64))]
pub(super) struct Resting {
    /// V (m^3).
    volume: Lane,
    /// Over the largest sum of the squares of twice the areas of the faces that is not looked at (1/m^4).
    inverse_faces: Lane,
    /// B B^T, 11, 22, 33, and twice 12, 13, 23, over the largest tr F^T F that is not looked at (1/m^2); zero without viscosity.
    metric: [Lane; 6],
}

impl Resting {
    /// Puts `element` in a `lane`.
    pub(super) fn put(&mut self, lane: usize, element: &Element) {
        self.volume[lane] = element.volume;
        // What limits a step is the square of an area, or a viscosity times the square of a stretch g, that along one axis of an element that
        // keeps its volume: tr F^T F = g + 2 / sqrt(g).
        let stretch = LOOKED_AT * element.spare;
        self.inverse_faces[lane] = 1.0 / (stretch * stretch * element.faces());
        if element.viscosity > 0.0 {
            let metric = element.metric() / (element.volume * (stretch + 2.0 / stretch.sqrt()));
            let numbers = [metric.m11, metric.m22, metric.m33, 2.0 * metric.m12, 2.0 * metric.m13, 2.0 * metric.m23];
            self.metric.iter_mut().zip(numbers).for_each(|(of_all, number)| of_all[lane] = number);
        }
    }
}

#[inline(always)]
pub(super) fn cross<S: Simd>(s: S, a: &[S::V; 3], b: &[S::V; 3]) -> [S::V; 3] {
    [
        s.fused_from(a[2], b[1], s.mul(a[1], b[2])),
        s.fused_from(a[0], b[2], s.mul(a[2], b[0])),
        s.fused_from(a[1], b[0], s.mul(a[0], b[1])),
    ]
}

#[inline(always)]
pub(super) fn dot<S: Simd>(s: S, a: &[S::V; 3], b: &[S::V; 3]) -> S::V {
    s.fused(a[2], b[2], s.fused(a[1], b[1], s.mul(a[0], b[0])))
}

/// First of two passes: by how much the volume at each node has grown, for average nodal pressure, and how large each element is.
pub(super) struct Growth<'a> {
    pub(super) corners: &'a [Corners],
    pub(super) resting: &'a [Resting],
    pub(super) nodes: &'a [Motion],
    pub(super) growth: &'a mut [f64],
    pub(super) sizes: &'a mut [Lane],
    pub(super) largest: &'a mut Lane,
}

impl Work for Growth<'_> {
    #[inline(always)]
    fn run<S: Simd>(self, s: S) {
        let Self { corners, resting, nodes, growth, sizes, largest } = self;
        let (sixth, mut most) = (s.splat(1.0 / 6.0), s.splat(0.0));
        for ((corners, resting), size) in corners.iter().zip(resting).zip(sizes) {
            let [[x1, y1, z1, _], _] = s.differences(nodes, &corners[0], &corners[1]);
            let [[x2, y2, z2, _], _] = s.differences(nodes, &corners[0], &corners[2]);
            let [[x3, y3, z3, _], _] = s.differences(nodes, &corners[0], &corners[3]);
            let (d1, d2, d3) = ([x1, y1, z1], [x2, y2, z2], [x3, y3, z3]);
            let (c1, c2, c3) = (cross(s, &d2, &d3), cross(s, &d3, &d1), cross(s, &d1, &d2));
            // The fourth face is their sum.
            let mut c0 = c1;
            for axis in 0..3 {
                c0[axis] = s.add(s.add(c1[axis], c2[axis]), c3[axis]);
            }
            let faces = s.add(s.add(dot(s, &c1, &c1), dot(s, &c2, &c2)), s.add(dot(s, &c3, &c3), dot(s, &c0, &c0)));
            let [m11, m22, m33, m12, m13, m23] = &resting.metric;
            let squares = [dot(s, &d1, &d1), dot(s, &d2, &d2), dot(s, &d3, &d3)];
            let products = [dot(s, &d1, &d2), dot(s, &d1, &d3), dot(s, &d2, &d3)];
            let squares = dot(s, &squares, &[s.load(m11), s.load(m22), s.load(m33)]);
            let products = dot(s, &products, &[s.load(m12), s.load(m13), s.load(m23)]);
            let grown = s.larger(s.mul(faces, s.load(&resting.inverse_faces)), s.add(squares, products));
            s.store(grown, size);
            most = s.larger(grown, most);
            let mut grown = [0.0; LANES];
            s.store(s.sub(s.mul(dot(s, &d1, &c1), sixth), s.load(&resting.volume)), &mut grown);
            for corner in corners {
                for lane in 0..LANES {
                    growth[corner[lane] as usize] += grown[lane];
                }
            }
        }
        s.store(most, largest);
    }
}
