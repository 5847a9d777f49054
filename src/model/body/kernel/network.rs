//! The spring forces of an arbitrary list of springs, eight at once.
//!
//! Nodes are renumbered so that joined ones are near each other in memory, and springs are coloured: batches of eight of
//! which no two touch the same node, so the additions of a batch do not wait for each other. A node is one cache line
//! (position and velocity); differences are taken line by line and transposed in registers, which needs no gathers.

use std::ops::Range;

use super::super::super::Vec3;
use super::super::Spring;
use super::colouring::colour;
use super::cores::Cores;
use super::nodes::{LANES, Lane, Motion, Push};
use super::numbering::near_first;
use super::pull::{Springs, scale};
use super::simd::{InstructionSet, Numbers, Simd, Work};
#[cfg(feature = "parallel")]
use crate::error::ModelError;

/// Evaluates a list of springs.
#[derive(Clone, Debug)]
pub(crate) struct NetworkKernel {
    /// The caller's numbers of the nodes, in the order of the kernel.
    order: Vec<u32>,
    /// The kernel's numbers of the nodes, in the caller's order.
    place: Vec<u32>,
    parts: Vec<NetworkPart>,
    set: InstructionSet,
    cores: Cores,
}

impl NetworkKernel {
    pub(crate) fn new(nodes: usize, springs: &[(u32, u32, Spring)]) -> Self {
        let order = near_first(nodes, springs.iter().map(|&(i, j, _)| [i, j]));
        let mut place = vec![0; nodes];
        for (new, &old) in order.iter().enumerate() {
            place[old as usize] = new as u32;
        }
        let (parts, set, cores) = (Vec::new(), InstructionSet::detect(), Cores::default());
        let mut new = Self { order, place, parts, set, cores };
        new.divide(springs, 1);
        new
    }

    pub(crate) fn set_instruction_set(&mut self, set: InstructionSet) {
        self.set = set;
    }

    #[cfg(feature = "parallel")]
    pub(crate) fn set_cores(&mut self, springs: &[(u32, u32, Spring)], cores: usize) -> Result<(), ModelError> {
        self.cores = Cores::new(cores)?;
        self.divide(springs, cores);
        Ok(())
    }

    /// Contiguous ranges of nodes with about as many springs each; a spring belongs to its lower node.
    fn divide(&mut self, springs: &[(u32, u32, Spring)], parts: usize) {
        let place = &self.place;
        let mut sorted: Vec<(u32, u32, Spring)> = springs
            .iter()
            .map(|&(i, j, spring)| {
                let (i, j) = (place[i as usize], place[j as usize]);
                (i.min(j), i.max(j), spring)
            })
            .collect();
        sorted.sort_by_key(|&(i, j, _)| (i, j));
        let mut first = 0;
        self.parts = (0..parts)
            .map(|n| {
                let end = match sorted.get((n + 1) * sorted.len() / parts) {
                    Some(&(lower, ..)) if n + 1 < parts => (lower as usize).max(first),
                    _ => self.order.len(),
                };
                let begin = |node: usize| sorted.partition_point(|&(lower, ..)| (lower as usize) < node);
                let part = NetworkPart::new(first..end, &sorted[begin(first)..begin(end)]);
                first = end;
                part
            })
            .collect();
    }

    /// Writes the spring force on every node to `out`.
    pub(crate) fn forces(&mut self, positions: &[Vec3], velocities: &[Vec3], out: &mut [Vec3]) {
        let Self { order, place, parts, set, cores } = self;
        let order = &order[..];
        cores.each(parts.iter_mut(), |part| part.evaluate(*set, order, positions, velocities));
        // Several parts may have a force on a node; it is summed in their order.
        let (parts, length) = (&parts[..], out.len().div_ceil(parts.len()).max(1));
        cores.each(out.chunks_mut(length).zip(place.chunks(length)), |(out, place)| {
            for (force, &new) in out.iter_mut().zip(place) {
                let touching = parts.iter().take_while(|part| part.own.start <= new as usize);
                *force = touching.fold(Vec3::zeros(), |sum, part| sum + part.force(new as usize));
            }
        });
    }
}

/// Eight springs without a common node; nodes are counted from the part's first. A place that is left over joins
/// the node after the last to itself.
#[derive(Clone, Copy, Debug)]
#[repr(C, align(64))]
struct Batch {
    from: Numbers,
    to: Numbers,
    stiffness: Lane,
    damping: Lane,
    rest_length: Lane,
}

/// The springs that belong to a range of nodes, with working memory of their own: what one core does.
#[derive(Clone, Debug)]
struct NetworkPart {
    own: Range<usize>,
    /// Past the last node that the springs touch.
    end: usize,
    batches: Vec<Batch>,
    nodes: Vec<Motion>,
    forces: Vec<Push>,
}

impl NetworkPart {
    fn new(own: Range<usize>, springs: &[(u32, u32, Spring)]) -> Self {
        let end = springs.iter().map(|&(_, j, _)| j as usize + 1).fold(own.end, usize::max);
        let count = end - own.start;
        Self {
            batches: batches(springs, own.start, count),
            nodes: vec![Motion::default(); count + 1],
            forces: vec![Push::default(); count + 1],
            own,
            end,
        }
    }

    fn evaluate(&mut self, set: InstructionSet, order: &[u32], positions: &[Vec3], velocities: &[Vec3]) {
        for (&old, node) in order[self.own.start..self.end].iter().zip(&mut self.nodes) {
            let (x, v) = (&positions[old as usize], &velocities[old as usize]);
            node.0 = [x.x, x.y, x.z, 0.0, v.x, v.y, v.z, 0.0];
        }
        self.forces.fill(Push::default());
        set.run(Evaluation { batches: &self.batches, nodes: &self.nodes, forces: &mut self.forces });
    }

    /// What its springs do to node `new`, which may be beyond the nodes that they touch.
    #[inline]
    fn force(&self, new: usize) -> Vec3 {
        if new >= self.end {
            return Vec3::zeros();
        }
        let [x, y, z, _] = self.forces[new - self.own.start].0;
        Vec3::new(x, y, z)
    }
}

/// Batches of `springs`, sorted by their lower node; `count` nodes from `first` on.
fn batches(springs: &[(u32, u32, Spring)], first: usize, count: usize) -> Vec<Batch> {
    let nodes: Vec<[u32; 2]> = springs.iter().map(|&(i, j, _)| [i, j].map(|node| node - first as u32)).collect();
    let fill = |members: Vec<usize>| {
        let lone = count as u32;
        let mut batch = Batch {
            from: [lone; LANES],
            to: [lone; LANES],
            stiffness: [0.0; LANES],
            damping: [0.0; LANES],
            rest_length: [1.0; LANES],
        };
        for (lane, member) in members.into_iter().enumerate() {
            let (.., spring) = springs[member];
            [batch.from[lane], batch.to[lane]] = nodes[member];
            batch.stiffness[lane] = spring.stiffness;
            batch.damping[lane] = spring.damping;
            batch.rest_length[lane] = spring.rest_length;
        }
        batch
    };
    colour(&nodes, count).into_iter().map(fill).collect()
}

struct Evaluation<'a> {
    batches: &'a [Batch],
    nodes: &'a [Motion],
    forces: &'a mut [Push],
}

impl Work for Evaluation<'_> {
    #[inline(always)]
    fn run<S: Simd>(self, s: S) {
        let Self { batches, nodes, forces } = self;
        let share = s.splat(Spring::COLLAPSED);
        for batch in batches {
            let [[x, y, z, _], [u, v, w, _]] = s.differences(nodes, &batch.from, &batch.to);
            let (along, closing) = ([x, y, z], [u, v, w]);
            let rest_length = s.load(&batch.rest_length);
            let stiffness = s.load(&batch.stiffness);
            let shortest = s.mul(share, rest_length);
            let springs = Springs {
                exist: s.mask(u8::MAX),
                stiffness,
                damping: s.load(&batch.damping),
                preload: s.mul(stiffness, rest_length),
                shortest: s.mul(shortest, shortest),
            };
            let scale = scale(s, &along, &closing, &springs);
            let pull = [s.mul(scale, along[0]), s.mul(scale, along[1]), s.mul(scale, along[2])];
            s.exchange(pull, forces, &batch.from, &batch.to);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn no_two_springs_of_a_batch_share_a_node_and_none_is_lost() {
        let spring = |n: u32| Spring { stiffness: f64::from(n + 1), damping: 0.0, rest_length: 1.0 };
        // Node 0 has springs to all others, which are in a chain.
        let mut springs: Vec<_> = (1..60).map(|n| (0, n, spring(n))).collect();
        springs.extend((1..59).map(|n| (n, n + 1, spring(100 + n))));
        let batches = batches(&springs, 0, 60);
        let mut found = Vec::new();
        for batch in &batches {
            let mut nodes = Vec::new();
            for lane in (0..LANES).filter(|&lane| batch.stiffness[lane] > 0.0) {
                nodes.extend([batch.from[lane], batch.to[lane]]);
                found.push(batch.stiffness[lane] as u32);
            }
            let all = nodes.len();
            nodes.sort_unstable();
            nodes.dedup();
            assert_eq!(nodes.len(), all, "{batch:?}");
        }
        found.sort_unstable();
        let mut expected: Vec<u32> = springs.iter().map(|(.., spring)| spring.stiffness as u32).collect();
        expected.sort_unstable();
        assert_eq!(found, expected);
    }
}
