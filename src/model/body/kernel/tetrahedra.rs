//! The forces of linear tetrahedra, eight at once.
//!
//! As in [`super::network`]: nodes are renumbered so that joined ones are near each other in memory, one cache line each, and
//! elements are put in batches without a common node. Every set computes the same fused operations in the same order, so
//! forces have the same bits on all of them.
//!
//! With the edges D = [x1 - x0, x2 - x0, x3 - x0], their rates W and the inverse B of D at rest, F = D B and Fdot = W B; none of
//! them is needed. The forces on nodes 1, 2, 3 are the columns of `-D (mu A + eta A Q A) - (p - mu) / 6 cof D`, with
//! A = V B B^T, once, and Q = D^T W + W^T D.

use std::ops::Range;

use super::super::super::Vec3;
use super::super::tetrahedra::Element;
use super::colouring::colour;
use super::cores::Cores;
use super::growth::{Corners, Growth, Resting, cross, dot};
use super::nodes::{LANES, Lane, Motion, Push};
use super::numbering::near_first;
use super::simd::{InstructionSet, Simd, Work};
#[cfg(feature = "parallel")]
use crate::error::ModelError;

/// Evaluates a list of elements.
#[derive(Clone, Debug)]
pub(crate) struct TetrahedraKernel {
    /// The caller's numbers of the nodes, in the order of the kernel.
    order: Vec<u32>,
    /// The kernel's numbers of the nodes, in the caller's order.
    place: Vec<u32>,
    /// 1 / sum V_e of the elements at each node (1/m^3), in the order of the kernel, if pressures are averaged.
    inverse_volumes: Option<Vec<f64>>,
    parts: Vec<Part>,
    set: InstructionSet,
    cores: Cores,
}

impl TetrahedraKernel {
    /// For `elements` between `nodes` nodes; with `inverse_volumes` (1/m^3, one per node) for average nodal pressure.
    pub(crate) fn new(nodes: usize, elements: &[Element], inverse_volumes: Option<&[f64]>) -> Self {
        let pairs = elements.iter().flat_map(|element| {
            let [a, b, c, d] = element.nodes;
            [[a, b], [a, c], [a, d], [b, c], [b, d], [c, d]]
        });
        let order = near_first(nodes, pairs);
        let mut place = vec![0; nodes];
        for (new, &old) in order.iter().enumerate() {
            place[old as usize] = new as u32;
        }
        let inverse_volumes = inverse_volumes.map(|all| order.iter().map(|&old| all[old as usize]).collect());
        let (parts, set, cores) = (Vec::new(), InstructionSet::detect(), Cores::default());
        let mut new = Self { order, place, inverse_volumes, parts, set, cores };
        new.divide(elements, 1);
        new
    }

    pub(crate) fn set_instruction_set(&mut self, set: InstructionSet) {
        self.set = set;
    }

    #[cfg(feature = "parallel")]
    pub(crate) fn set_cores(&mut self, elements: &[Element], cores: usize) -> Result<(), ModelError> {
        self.cores = Cores::new(cores)?;
        self.divide(elements, cores);
        Ok(())
    }

    /// Contiguous ranges of nodes with about as many elements each; an element belongs to its lowest node.
    fn divide(&mut self, elements: &[Element], parts: usize) {
        // The nodes of an element in the kernel's numbers and the caller's order, which its numbers are made for.
        let lowest = |nodes: &[u32; 4]| nodes.iter().copied().min().unwrap_or(0) as usize;
        let mut sorted: Vec<([u32; 4], Element)> =
            elements.iter().map(|e| (e.nodes.map(|node| self.place[node as usize]), *e)).collect();
        sorted.sort_by_key(|(nodes, _)| {
            let mut key = *nodes;
            key.sort_unstable();
            key
        });
        let mut first = 0;
        self.parts = (0..parts)
            .map(|n| {
                let end = match sorted.get((n + 1) * sorted.len() / parts) {
                    Some((nodes, _)) if n + 1 < parts => lowest(nodes).max(first),
                    _ => self.order.len(),
                };
                let begin = |node: usize| sorted.partition_point(|(nodes, _)| lowest(nodes) < node);
                let part = Part::new(first..end, &sorted[begin(first)..begin(end)]);
                first = end;
                part
            })
            .collect();
    }

    /// Writes the force on every node to `out`.
    pub(crate) fn forces(&mut self, positions: &[Vec3], velocities: &[Vec3], out: &mut [Vec3]) {
        let Self { order, place, inverse_volumes, parts, set, cores } = self;
        let (order, set) = (&order[..], *set);
        let is_averaged = inverse_volumes.is_some();
        cores.each(parts.iter_mut(), |part| part.start(set, order, positions, velocities, is_averaged));
        if let Some(inverse_volumes) = inverse_volumes {
            average(parts, inverse_volumes, cores);
            cores.each(parts.iter_mut(), |part| part.evaluate::<true>(set));
        }
        // Several parts may have a force on a node; it is summed in their order.
        let (parts, length) = (&parts[..], out.len().div_ceil(parts.len()).max(1));
        cores.each(out.chunks_mut(length).zip(place.chunks(length)), |(out, place)| {
            for (force, &new) in out.iter_mut().zip(place) {
                let touching = parts.iter().take_while(|part| part.own.start <= new as usize);
                *force = touching.fold(Vec3::zeros(), |sum, part| sum + part.force(new as usize));
            }
        });
    }

    /// Calls `found` with the nodes of each element that had become so large in the last evaluation, in its faces or, if it is viscous, along
    /// an axis, that its nodes may not bear the body's steps at rest.
    pub(crate) fn stretched(&self, mut found: impl FnMut([u32; 4])) {
        for part in &self.parts {
            if part.largest.iter().all(|&size| size <= 1.0) {
                continue;
            }
            for (corners, sizes) in part.corners.iter().zip(&part.sizes) {
                for lane in (0..LANES).filter(|&lane| sizes[lane] > 1.0) {
                    found([0, 1, 2, 3].map(|corner| self.order[part.own.start + corners[corner][lane] as usize]));
                }
            }
        }
    }
}

/// Gives every node of every part its J - 1, from what all parts found.
fn average(parts: &mut [Part], inverse_volumes: &[f64], cores: &Cores) {
    if let [part] = parts {
        for ((node, growth), inverse_volume) in part.nodes.iter_mut().zip(&part.growth).zip(inverse_volumes) {
            node.0[3] = growth * inverse_volume;
        }
        return;
    }
    // The parts read each other's sums while each writes its nodes: those are taken out meanwhile.
    let mut nodes: Vec<Vec<Motion>> = parts.iter_mut().map(|part| std::mem::take(&mut part.nodes)).collect();
    let shared = &*parts;
    cores.each(nodes.iter_mut().zip(shared), |(nodes, part)| {
        for (node, new) in nodes.iter_mut().zip(part.own.start..part.end) {
            let touching = shared.iter().take_while(|part| part.own.start <= new);
            let growth: f64 = touching.filter_map(|part| part.growth.get(new - part.own.start)).sum();
            node.0[3] = growth * inverse_volumes[new];
        }
    });
    parts.iter_mut().zip(nodes).for_each(|(part, nodes)| part.nodes = nodes);
}

/// Eight elements. All factors are negative, so that forces come out as they are and not as what resists them.
#[derive(Clone, Copy, Debug, Default)]
#[repr(C, align(64))]
struct Batch {
    /// A = V B B^T: 11, 22, 33, 12, 13, 23 (m).
    metric: [Lane; 6],
    /// -mu (Pa).
    shear: Lane,
    /// -eta / V (Pa s/m^3).
    viscosity: Lane,
    /// -lambda / 6 (Pa).
    pressure: Lane,
    /// mu / 6 (Pa).
    offset: Lane,
    /// 1 / (6 V) (1/m^3).
    inverse_volume: Lane,
}

/// The elements that belong to a range of nodes, with working memory of their own: what one core does.
#[derive(Clone, Debug)]
struct Part {
    own: Range<usize>,
    /// Past the last node that the elements touch.
    end: usize,
    corners: Vec<Corners>,
    batches: Vec<Batch>,
    resting: Vec<Resting>,
    /// How large each element is, over what is not looked at, and the largest of each lane.
    sizes: Vec<Lane>,
    largest: Lane,
    /// True if an element has a viscosity.
    is_viscous: bool,
    nodes: Vec<Motion>,
    forces: Vec<Push>,
    /// Sum of V_e (J_e - 1) at each node (m^3), and behind them what has no node.
    growth: Vec<f64>,
}

impl Part {
    fn new(own: Range<usize>, elements: &[([u32; 4], Element)]) -> Self {
        let last = elements.iter().flat_map(|(nodes, _)| nodes).map(|&node| node as usize + 1).max();
        let end = last.map_or(own.end, |last| last.max(own.end));
        let count = end - own.start;
        let nodes: Vec<[u32; 4]> =
            elements.iter().map(|(nodes, _)| nodes.map(|node| node - own.start as u32)).collect();
        let mut part = Self {
            end,
            corners: Vec::new(),
            batches: Vec::new(),
            resting: Vec::new(),
            sizes: Vec::new(),
            largest: [0.0; LANES],
            is_viscous: elements.iter().any(|(_, element)| element.viscosity != 0.0),
            nodes: vec![Motion::default(); count + 1],
            forces: vec![Push::default(); count + 1],
            growth: vec![0.0; count + 1],
            own,
        };
        for members in colour(&nodes, count) {
            part.push(&members, &nodes, elements);
        }
        part.sizes.resize(part.resting.len(), [0.0; LANES]);
        part
    }

    /// Appends a batch.
    fn push(&mut self, members: &[usize], nodes: &[[u32; 4]], elements: &[([u32; 4], Element)]) {
        let mut corners = [[(self.nodes.len() - 1) as u32; LANES]; 4];
        let (mut batch, mut resting) = (Batch::default(), Resting::default());
        for (lane, &member) in members.iter().enumerate() {
            let element = &elements[member].1;
            (0..4).for_each(|corner| corners[corner][lane] = nodes[member][corner]);
            let metric = element.metric();
            for (number, (row, column)) in [(0, 0), (1, 1), (2, 2), (0, 1), (0, 2), (1, 2)].into_iter().enumerate() {
                batch.metric[number][lane] = metric[(row, column)];
            }
            batch.shear[lane] = -element.shear_modulus;
            batch.viscosity[lane] = -element.viscosity / element.volume;
            batch.pressure[lane] = -element.bulk / 6.0;
            batch.offset[lane] = element.shear_modulus / 6.0;
            batch.inverse_volume[lane] = 1.0 / (6.0 * element.volume);
            resting.put(lane, element);
        }
        self.corners.push(corners);
        self.batches.push(batch);
        self.resting.push(resting);
    }

    /// Takes the nodes' motion over and computes their growth, or with pressures of single elements the forces.
    fn start(&mut self, set: InstructionSet, order: &[u32], x: &[Vec3], v: &[Vec3], is_averaged: bool) {
        for (&old, node) in order[self.own.start..self.end].iter().zip(&mut self.nodes) {
            let (x, v) = (&x[old as usize], &v[old as usize]);
            node.0 = [x.x, x.y, x.z, 0.0, v.x, v.y, v.z, 0.0];
        }
        self.growth.fill(0.0);
        let Self { corners, resting, nodes, growth, sizes, largest, .. } = self;
        set.run(Growth { corners, resting, nodes, growth, sizes, largest });
        if !is_averaged {
            self.evaluate::<false>(set);
        }
    }

    fn evaluate<const AVERAGED: bool>(&mut self, set: InstructionSet) {
        self.forces.fill(Push::default());
        let Self { corners, batches, nodes, forces, is_viscous, .. } = self;
        if *is_viscous {
            set.run(Evaluation::<AVERAGED, true> { corners, batches, nodes, forces });
        } else {
            set.run(Evaluation::<AVERAGED, false> { corners, batches, nodes, forces });
        }
    }

    /// What its elements do to node `new`, which may be beyond the nodes that they touch.
    #[inline]
    fn force(&self, new: usize) -> Vec3 {
        if new >= self.end {
            return Vec3::zeros();
        }
        let [x, y, z, _] = self.forces[new - self.own.start].0;
        Vec3::new(x, y, z)
    }
}

/// All forces; with AVERAGED the nodes have their J - 1, without it every element takes its own. Without VISCOUS
/// velocities are not looked at.
struct Evaluation<'a, const AVERAGED: bool, const VISCOUS: bool> {
    corners: &'a [Corners],
    batches: &'a [Batch],
    nodes: &'a [Motion],
    forces: &'a mut [Push],
}

impl<const AVERAGED: bool, const VISCOUS: bool> Work for Evaluation<'_, AVERAGED, VISCOUS> {
    #[inline(always)]
    fn run<S: Simd>(self, s: S) {
        let Self { corners, batches, nodes, forces } = self;
        let (zero, quarter, minus_one) = (s.splat(0.0), s.splat(0.25), s.splat(-1.0));
        for (corners, batch) in corners.iter().zip(batches) {
            let [[x1, y1, z1, p1], [u1, v1, w1, _]] = s.differences(nodes, &corners[0], &corners[1]);
            let [[x2, y2, z2, p2], [u2, v2, w2, _]] = s.differences(nodes, &corners[0], &corners[2]);
            let [[x3, y3, z3, p3], [u3, v3, w3, _]] = s.differences(nodes, &corners[0], &corners[3]);
            let (d1, d2, d3) = ([x1, y1, z1], [x2, y2, z2], [x3, y3, z3]);
            let (c1, c2, c3) = (cross(s, &d2, &d3), cross(s, &d3, &d1), cross(s, &d1, &d2));
            let growth = if AVERAGED {
                s.fused(s.add(s.add(p1, p2), p3), quarter, s.fourth(nodes, &corners[0]))
            } else {
                s.fused(dot(s, &d1, &c1), s.load(&batch.inverse_volume), minus_one)
            };
            let c = s.fused(s.load(&batch.pressure), growth, s.load(&batch.offset));

            // T = -(mu A + eta A Q A): 11, 22, 33, 12, 13, 23.
            let a = &batch.metric;
            let [a11, a22, a33] = [s.load(&a[0]), s.load(&a[1]), s.load(&a[2])];
            let [a12, a13, a23] = [s.load(&a[3]), s.load(&a[4]), s.load(&a[5])];
            let shear = s.load(&batch.shear);
            let [mut t11, mut t22, mut t33] = [s.mul(shear, a11), s.mul(shear, a22), s.mul(shear, a33)];
            let [mut t12, mut t13, mut t23] = [s.mul(shear, a12), s.mul(shear, a13), s.mul(shear, a23)];
            if VISCOUS {
                let (r1, r2, r3) = ([u1, v1, w1], [u2, v2, w2], [u3, v3, w3]);
                let viscosity = s.load(&batch.viscosity);
                let (q11, q22, q33) = (dot(s, &d1, &r1), dot(s, &d2, &r2), dot(s, &d3, &r3));
                let (q11, q22, q33) = (s.add(q11, q11), s.add(q22, q22), s.add(q33, q33));
                let q12 = s.add(dot(s, &d1, &r2), dot(s, &r1, &d2));
                let q13 = s.add(dot(s, &d1, &r3), dot(s, &r1, &d3));
                let q23 = s.add(dot(s, &d2, &r3), dot(s, &r2, &d3));
                let (a1, a2, a3) = ([a11, a12, a13], [a12, a22, a23], [a13, a23, a33]);
                let (q1, q2, q3) = ([q11, q12, q13], [q12, q22, q23], [q13, q23, q33]);
                let b1 = [dot(s, &a1, &q1), dot(s, &a1, &q2), dot(s, &a1, &q3)];
                let b2 = [dot(s, &a2, &q1), dot(s, &a2, &q2), dot(s, &a2, &q3)];
                let b3 = [dot(s, &a3, &q1), dot(s, &a3, &q2), dot(s, &a3, &q3)];
                t11 = s.fused(viscosity, dot(s, &b1, &a1), t11);
                t22 = s.fused(viscosity, dot(s, &b2, &a2), t22);
                t33 = s.fused(viscosity, dot(s, &b3, &a3), t33);
                t12 = s.fused(viscosity, dot(s, &b1, &a2), t12);
                t13 = s.fused(viscosity, dot(s, &b1, &a3), t13);
                t23 = s.fused(viscosity, dot(s, &b2, &a3), t23);
            }
            let f1 = force(s, [&d1, &d2, &d3], [t11, t12, t13], c, &c1);
            let f2 = force(s, [&d1, &d2, &d3], [t12, t22, t23], c, &c2);
            let f3 = force(s, [&d1, &d2, &d3], [t13, t23, t33], c, &c3);
            let mut f0 = [zero; 3];
            for axis in 0..3 {
                f0[axis] = s.sub(zero, s.add(s.add(f1[axis], f2[axis]), f3[axis]));
            }
            s.push(f0, forces, &corners[0]);
            s.push(f1, forces, &corners[1]);
            s.push(f2, forces, &corners[2]);
            s.push(f3, forces, &corners[3]);
        }
    }
}

/// d1 t1 + d2 t2 + d3 t3 + c area.
#[inline(always)]
fn force<S: Simd>(s: S, [d1, d2, d3]: [&[S::V; 3]; 3], t: [S::V; 3], c: S::V, area: &[S::V; 3]) -> [S::V; 3] {
    let mut force = *area;
    for axis in 0..3 {
        let shear = s.fused(d3[axis], t[2], s.fused(d2[axis], t[1], s.mul(d1[axis], t[0])));
        force[axis] = s.fused(c, area[axis], shear);
    }
    force
}
