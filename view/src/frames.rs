//! What a picture is in bytes: little-endian, every number at a multiple of its size, so that a page reads it in place.
//!
//! | kind | message | after the kind |
//! | --- | --- | --- |
//! | 1 | topology | nodes, triangles, 0; rest positions (3 f32 each), corners (3 u32 each) |
//! | 2 | tools | tools; time, time of the surface (f64); [`TOOL_FLOATS`] f32 each; contacts, [`CONTACT_FLOATS`] f32 each |
//! | 3 | samples | device; first time (f64), deadline (s, f64); rows, see [`Row`](crate::samples::Row) |
//! | 4 | surface | nodes; time (f64); positions (3 f32 each); equivalent stress (Pa, f32 each) while somebody looks at it |

use bytes::Bytes;
use palpate::model::Vec3;
use palpate::session::ToolView;

/// Position 3, orientation w x y z, computed force 3, commanded force 3, pointer 3, mode of the contact.
pub(crate) const TOOL_FLOATS: usize = 17;
/// Place 3, force on the tool 3, triangle, device.
pub(crate) const CONTACT_FLOATS: usize = 8;

/// Where a tool touches.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct Touch {
    pub(crate) place_m: [f32; 3],
    pub(crate) force_n: [f32; 3],
    pub(crate) triangle: u32,
    pub(crate) device: u16,
}

/// The nodes of the surface among all nodes of the body, and its triangles by them.
#[derive(Clone, Debug, Default)]
pub(crate) struct Topology {
    pub(crate) nodes: Vec<u32>,
    pub(crate) triangles: Vec<[u32; 3]>,
}

impl Topology {
    /// The nodes that `triangles` name, in their order.
    pub(crate) fn of(triangles: &[[u32; 3]]) -> Self {
        let mut nodes: Vec<u32> = triangles.iter().flatten().copied().collect();
        nodes.sort_unstable();
        nodes.dedup();
        let place = |node: u32| nodes.binary_search(&node).map_or(0, |place| place as u32);
        Self { triangles: triangles.iter().map(|corners| corners.map(place)).collect(), nodes }
    }

    /// The positions of its nodes (m) among those of all.
    pub(crate) fn points<'a>(&'a self, positions: &'a [Vec3]) -> impl Iterator<Item = [f64; 3]> + 'a {
        self.nodes.iter().map(|&node| positions.get(node as usize).copied().unwrap_or_default().into())
    }

    /// The message with the positions of its nodes at rest (m).
    pub(crate) fn bytes(&self, rest: impl Iterator<Item = [f64; 3]>) -> Bytes {
        let mut to = Writer::new(1, 16 + 12 * (self.nodes.len() + self.triangles.len()));
        to.u32(self.nodes.len() as u32).u32(self.triangles.len() as u32).u32(0);
        rest.for_each(|point| to.vector(point));
        for &corner in self.triangles.iter().flatten() {
            to.u32(corner);
        }
        to.0.into()
    }
}

/// A surface at `time` (s), with the stress at its nodes (Pa), if that is known.
pub(crate) fn surface(time: f64, points: impl ExactSizeIterator<Item = [f64; 3]>, stress: &[f64]) -> Bytes {
    let mut to = Writer::new(4, 16 + 12 * points.len() + 4 * stress.len());
    to.u32(points.len() as u32).f64(time);
    points.for_each(|point| to.vector(point));
    stress.iter().for_each(|&pascal| to.f32(pascal as f32));
    to.0.into()
}

/// Where a node is (m) in what [`surface`] made.
pub(crate) fn place(surface: &[u8], node: u32) -> Option<[f64; 3]> {
    let first = 16 + 12 * node as usize;
    let (numbers, _) = surface.get(first..first + 12)?.as_chunks::<4>();
    let &[x, y, z] = numbers else { return None };
    Some([x, y, z].map(|c| f32::from_le_bytes(c).into()))
}

/// Tools with their pointers, of a surface of another time (s).
pub(crate) fn tools(surface_time: f64, tools: &[ToolView], pointers: &[[f64; 3]], touches: &[Touch]) -> Bytes {
    let time = tools.iter().map(|tool| tool.time.as_secs_f64()).fold(0.0, f64::max);
    let mut to = Writer::new(2, 24 + 4 * (TOOL_FLOATS * tools.len() + CONTACT_FLOATS * touches.len()));
    to.u32(tools.len() as u32).f64(time).f64(surface_time);
    for (number, tool) in tools.iter().enumerate() {
        to.vector(tool.position.into());
        let turn = tool.orientation;
        [turn.w, turn.i, turn.j, turn.k].into_iter().for_each(|c| to.f32(c as f32));
        to.vector(tool.computed_force.into());
        to.vector(tool.commanded_force.into());
        to.vector(pointers.get(number).copied().unwrap_or(tool.position.into()));
        to.f32(f32::from(tool.mode as u8));
    }
    for touch in touches {
        touch.place_m.into_iter().chain(touch.force_n).for_each(|c| to.f32(c));
        to.f32(touch.triangle as f32);
        to.f32(f32::from(touch.device));
    }
    to.0.into()
}

/// Bytes of a message.
#[derive(Debug)]
pub(crate) struct Writer(pub(crate) Vec<u8>);

impl Writer {
    pub(crate) fn new(kind: u32, length: usize) -> Self {
        let mut to = Self(Vec::with_capacity(length));
        to.u32(kind);
        to
    }

    pub(crate) fn u32(&mut self, value: u32) -> &mut Self {
        self.0.extend_from_slice(&value.to_le_bytes());
        self
    }

    pub(crate) fn f64(&mut self, value: f64) -> &mut Self {
        self.0.extend_from_slice(&value.to_le_bytes());
        self
    }

    pub(crate) fn f32(&mut self, value: f32) {
        self.0.extend_from_slice(&value.to_le_bytes());
    }

    fn vector(&mut self, value: [f64; 3]) {
        value.into_iter().for_each(|c| self.f32(c as f32));
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_number_lies_at_a_multiple_of_its_size_and_lengths_are_exact() {
        let topology = Topology::of(&[[7, 3, 9], [3, 9, 12]]);
        assert_eq!((topology.nodes.as_slice(), topology.triangles[1]), (&[3, 7, 9, 12][..], [0, 2, 3]));
        assert_eq!(topology.bytes([[0.0; 3]; 4].into_iter()).len(), 16 + 12 * 4 + 12 * 2);
        let surface = surface(1.5, [[1.0, 2.0, 3.0]].into_iter(), &[4e3]);
        assert_eq!(surface.len(), 16 + 12 + 4);
        assert_eq!(f64::from_le_bytes(surface[8..16].try_into().unwrap()), 1.5);
        assert_eq!((place(&surface, 0), place(&surface, 1)), (Some([1.0, 2.0, 3.0]), None));
        let shown = tools(0.25, &[ToolView::default()], &[[4.0, 5.0, 6.0]], &[Touch::default()]);
        assert_eq!(shown.len(), 24 + 4 * (TOOL_FLOATS + CONTACT_FLOATS));
        let at = 24 + 4 * 13;
        assert_eq!(f32::from_le_bytes(shown[at..at + 4].try_into().unwrap()), 4.0, "the pointer");
    }
}
