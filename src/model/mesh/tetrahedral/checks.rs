//! What must hold of a mesh before a body is made of it.

use super::TetrahedralMesh;
use super::quality::{six_volumes, smallest_height};
use crate::Vec3;
use crate::error::ModelError;

/// Smallest height of an element in units of its longest edge: what is below has no volume but that of rounding.
const FLATTEST: f64 = 1e-6;
/// Largest coordinate (m): far beyond any body, and far from where products of coordinates overflow.
const FARTHEST: f64 = 1e9;
/// Most nodes and elements: their faces are still numbered by 32 bits.
const MOST: usize = 1 << 30;
/// Elements that a message names.
const NAMED: usize = 3;

/// A record of the changes that [`TetrahedralMesh::cleaned`] made to a mesh.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct LeftOut {
    /// Nodes that no element uses: they are left out.
    pub nodes: usize,
    /// True if every element was inverted: all were turned round.
    pub turned: bool,
}

impl TetrahedralMesh {
    /// The mesh as a body can use it: nodes that no element uses are left out, a mesh that is inverted throughout is turned
    /// round, and what cannot be simulated is refused. Nodes and elements are told in the numbering of this mesh, from 0.
    ///
    /// # Errors
    /// If there are no elements; a node, element or coordinate is impossible; an element is inverted among others that are
    /// not, or flat: with a height below 1e-6 of its longest edge; elements overlap at a face or three share it; the surface
    /// is no manifold because more than two of its triangles meet at an edge.
    ///
    /// # Real-time
    /// Not real-time safe: allocates.
    pub fn cleaned(mut self) -> Result<(Self, LeftOut), ModelError> {
        self.check_numbers()?;
        let turned = self.orient()?;
        self.check_faces()?;
        let nodes = self.drop_unused_nodes();
        self.check_surface()?;
        Ok((self, LeftOut { nodes, turned }))
    }

    /// Nodes that exist, coordinates that are some.
    fn check_numbers(&self) -> Result<(), ModelError> {
        let refuse = |message: String| Err(ModelError::new(message));
        let (nodes, elements) = (self.points.len(), self.tetrahedra.len());
        if elements == 0 {
            return refuse("the mesh has no tetrahedra: a volume of linear tetrahedra is needed".to_owned());
        }
        if nodes.max(elements) > MOST {
            return refuse(format!(
                "the mesh has {nodes} nodes and {elements} tetrahedra, at most {MOST} are possible"
            ));
        }
        let is_far = |point: &Vec3| !point.iter().all(|x| x.abs() <= FARTHEST);
        if let Some(node) = self.points.iter().position(is_far) {
            let [x, y, z] = self.points[node].into();
            return refuse(format!(
                "node {node} is at ({x}, {y}, {z}) m: finite numbers below {FARTHEST:e} are needed"
            ));
        }
        let is_wrong = |[a, b, c, d]: &[u32; 4]| {
            let largest = (*a).max(*b).max(*c).max(*d) as usize;
            largest >= nodes || a == b || a == c || a == d || b == c || b == d || c == d
        };
        if let Some(element) = self.tetrahedra.iter().position(is_wrong) {
            let corners = self.tetrahedra[element];
            return refuse(format!(
                "element {element} has nodes {corners:?}: four different ones below {nodes} are needed"
            ));
        }
        for group in &self.groups {
            let is_beyond = |list: &[u32], end: usize| list.iter().any(|&item| item as usize >= end);
            if is_beyond(&group.nodes, nodes) || is_beyond(&group.tetrahedra, elements) {
                let name: String = group.name.chars().take(60).collect();
                return refuse(format!("group {name:?} has nodes or elements that the mesh has not"));
            }
        }
        Ok(())
    }

    /// Refuses flat elements, and inverted ones among others; turns all round if all are inverted, and says so.
    fn orient(&mut self) -> Result<bool, ModelError> {
        let elements = 0..self.tetrahedra.len() as u32;
        let flat: Vec<u32> = elements.clone().filter(|&element| is_flat(&self.corners(element))).collect();
        if !flat.is_empty() {
            let bound = format!("a height below {FLATTEST:e} of the longest edge");
            return Err(self.refusal_of(&flat, &format!("flat ({bound}): mend the mesh or make it anew")));
        }
        let is_inverted = |element: &u32| six_volumes(&self.corners(*element)) < 0.0;
        let inverted: Vec<u32> = elements.filter(is_inverted).collect();
        if inverted.is_empty() {
            return Ok(false);
        }
        if inverted.len() < self.tetrahedra.len() {
            return Err(self.refusal_of(&inverted, "inverted: order their nodes as in the others"));
        }
        self.tetrahedra.iter_mut().for_each(|nodes| nodes.swap(2, 3));
        Ok(true)
    }

    fn refusal_of(&self, elements: &[u32], what: &str) -> ModelError {
        let named: Vec<String> = elements
            .iter()
            .take(NAMED)
            .map(|&element| format!("{element} at {}", place(&self.centroid(element))))
            .collect();
        let more = if elements.len() > NAMED { ", ..." } else { "" };
        let (count, all) = (elements.len(), self.tetrahedra.len());
        ModelError::new(format!("{count} of {all} elements ({}{more}) are {what}", named.join(", ")))
    }

    /// Two elements at a face, one on either side.
    fn check_faces(&self) -> Result<(), ModelError> {
        for same in self.faces().chunk_by(|a, b| a.nodes == b.nodes) {
            let is_overlap = same.len() == 2 && same[0].is_even == same[1].is_even;
            if same.len() > 2 || is_overlap {
                let elements: Vec<String> = same.iter().take(NAMED).map(|face| face.element.to_string()).collect();
                let (count, elements) = (same.len(), elements.join(", "));
                let how = if is_overlap { "lie on the same side of it, one may" } else { "share it, at most two may" };
                let (nodes, at) = (same[0].nodes, self.middle(&same[0].nodes));
                let message = format!("face of nodes {nodes:?} at {at}: {count} elements ({elements}) {how}");
                return Err(ModelError::new(message));
            }
        }
        Ok(())
    }

    /// Two triangles of the surface at an edge: contact walks from one to the other.
    fn check_surface(&self) -> Result<(), ModelError> {
        let edges = |[a, b, c]: &[u32; 3]| [(*a, *b), (*b, *c), (*c, *a)].map(|(a, b)| [a.min(b), a.max(b)]);
        let mut edges: Vec<[u32; 2]> = self.surface_triangles().iter().flat_map(edges).collect();
        edges.sort_unstable();
        match edges.chunk_by(|a, b| a == b).find(|same| same.len() > 2) {
            None => Ok(()),
            Some(same) => {
                let (nodes, at, count) = (same[0], self.middle(&same[0]), same.len());
                let message = format!("{count} triangles of the surface meet at the edge of nodes {nodes:?} at {at}");
                Err(ModelError::new(format!("{message}: two are possible, join or part what touches there")))
            }
        }
    }

    fn middle(&self, nodes: &[u32]) -> String {
        place(&(nodes.iter().map(|&node| self.points[node as usize]).sum::<Vec3>() / nodes.len() as f64))
    }

    /// Renumbers nodes and puts groups in order; returns how many nodes were left out.
    fn drop_unused_nodes(&mut self) -> usize {
        const UNUSED: u32 = u32::MAX;
        let mut new = vec![UNUSED; self.points.len()];
        self.tetrahedra.iter().flatten().for_each(|&node| new[node as usize] = 0);
        let used = new.iter_mut().filter(|new| **new != UNUSED);
        let kept = used.zip(0..).map(|(new, number)| *new = number).count();
        let left_out = self.points.len() - kept;
        let mut is_used = new.iter().map(|&new| new != UNUSED);
        self.points.retain(|_| is_used.next().unwrap_or(true));
        self.tetrahedra.iter_mut().flatten().for_each(|node| *node = new[*node as usize]);
        for group in &mut self.groups {
            group.nodes.iter_mut().for_each(|node| *node = new[*node as usize]);
            group.nodes.retain(|&node| node != UNUSED);
            for list in [&mut group.nodes, &mut group.tetrahedra] {
                list.sort_unstable();
                list.dedup();
            }
        }
        left_out
    }
}

/// In units of its longest edge, so that no product leaves the range of numbers.
fn is_flat(corners: &[Vec3; 4]) -> bool {
    let edges = (0..4).flat_map(|a| (a + 1..4).map(move |b| (a, b)));
    let longest = edges.map(|(a, b)| (corners[a] - corners[b]).norm()).fold(0.0, f64::max);
    let relative = corners.map(|corner| (corner - corners[0]) / longest);
    let height = smallest_height(&relative);
    // It is not a number if all four are one point.
    height.is_nan() || height < FLATTEST
}

fn place(point: &Vec3) -> String {
    format!("({:.4}, {:.4}, {:.4}) m", point.x, point.y, point.z)
}

#[cfg(test)]
mod tests {
    use super::super::Group;
    use super::*;
    use crate::mesh::Surface;

    /// Two elements at one face, and a node that nothing uses in front of them.
    fn pair() -> TetrahedralMesh {
        let points = [[9.0, 9.0, 9.0], [0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0], [1.0, 1.0, 1.0]];
        TetrahedralMesh {
            points: points.map(Vec3::from).to_vec(),
            tetrahedra: vec![[1, 2, 3, 4], [2, 3, 4, 5]],
            groups: vec![
                Group { name: "held".to_owned(), nodes: vec![4, 0, 1, 4], tetrahedra: vec![] },
                Group { name: "hard".to_owned(), nodes: vec![2, 3, 4, 5], tetrahedra: vec![1, 1] },
            ],
        }
    }

    fn refusal(change: impl FnOnce(&mut TetrahedralMesh)) -> String {
        let mut mesh = pair();
        change(&mut mesh);
        mesh.cleaned().unwrap_err().to_string()
    }

    #[test]
    fn unused_nodes_are_left_out_and_groups_follow() {
        let (mesh, left_out) = pair().cleaned().unwrap();
        assert_eq!(left_out, LeftOut { nodes: 1, turned: false });
        assert_eq!((mesh.points.len(), mesh.points[4]), (5, Vec3::repeat(1.0)));
        assert_eq!(mesh.tetrahedra, [[0, 1, 2, 3], [1, 2, 3, 4]]);
        assert_eq!(mesh.group("held").unwrap().nodes, [0, 3]);
        assert_eq!((&mesh.groups[1].nodes[..], &mesh.groups[1].tetrahedra[..]), (&[1, 2, 3, 4][..], &[1][..]));
        assert_eq!(mesh.clone().cleaned(), Ok((mesh, LeftOut::default())));
    }

    #[test]
    fn a_mesh_that_is_inverted_throughout_is_turned_round() {
        let mut mesh = pair();
        mesh.tetrahedra.iter_mut().for_each(|nodes| nodes.swap(0, 1));
        let (turned, left_out) = mesh.cleaned().unwrap();
        assert!(left_out.turned);
        assert!((turned.quality().volume - pair().quality().volume).abs() < 1e-12);
        let surface = Surface::new(turned.points.len(), turned.surface_triangles()).unwrap();
        assert!(surface.neighbours.iter().flatten().all(|&across| across != Surface::NONE));
    }

    #[test]
    fn what_cannot_be_simulated_is_named_in_one_line() {
        let cases = [
            (refusal(|mesh| mesh.tetrahedra.clear()), "the mesh has no tetrahedra"),
            (
                refusal(|mesh| mesh.tetrahedra[1][3] = 6),
                "element 1 has nodes [2, 3, 4, 6]: four different ones below 6",
            ),
            (refusal(|mesh| mesh.tetrahedra[0][3] = 1), "element 0 has nodes [1, 2, 3, 1]"),
            (refusal(|mesh| mesh.points[0].y = f64::NAN), "node 0 is at (9, NaN, 9) m"),
            (refusal(|mesh| mesh.points[5].x = 1e200), "node 5 is at"),
            (refusal(|mesh| mesh.groups[0].nodes.push(6)), "group \"held\""),
            (refusal(|mesh| mesh.groups[1].tetrahedra.push(2)), "group \"hard\""),
            (
                refusal(|mesh| mesh.tetrahedra[1].swap(0, 1)),
                "1 of 2 elements (1 at (0.5000, 0.5000, 0.5000) m) are inverted",
            ),
            (refusal(|mesh| mesh.points[5] = Vec3::new(0.5, 0.5, 1e-7)), "1 of 2 elements (1 at"),
            (
                refusal(|mesh| mesh.points[1..].fill(Vec3::zeros())),
                "2 of 2 elements (0 at (0.0000, 0.0000, 0.0000) m, 1 at",
            ),
        ];
        for (message, expected) in cases {
            assert!(message.starts_with(expected) && !message.contains('\n'), "{message}");
        }
        // In the plane of the face: the other corner is on the plane x + y + z = 1.
        let flat = refusal(|mesh| mesh.points[5] = Vec3::new(0.5, 0.5, 1e-7));
        assert!(flat.contains("flat (a height below 1e-6 of the longest edge)"), "{flat}");
    }

    #[test]
    fn elements_that_overlap_are_refused() {
        let twice = refusal(|mesh| mesh.tetrahedra.push([1, 2, 3, 4]));
        assert!(twice.contains("(0, 2) lie on the same side of it, one may"), "{twice}");
        let third = refusal(|mesh| {
            mesh.points.push(Vec3::new(1.0, 1.0, 2.0));
            mesh.tetrahedra.push([2, 3, 4, 6]);
        });
        assert_eq!(
            third,
            "face of nodes [2, 3, 4] at (0.3333, 0.3333, 0.3333) m: 3 elements (0, 1, 2) share it, at most two may"
        );
    }

    #[test]
    fn bodies_that_touch_along_an_edge_are_refused_and_at_a_corner_taken() {
        let mut points = pair().points;
        points.extend([[0.0, -1.0, 0.0], [0.0, 0.0, -1.0], [1.0, -1.0, -1.0]].map(Vec3::from));
        let at_edge = TetrahedralMesh { points, tetrahedra: vec![[1, 2, 3, 4], [1, 2, 6, 7]], groups: vec![] };
        let mut at_corner = at_edge.clone();
        let message = at_edge.cleaned().unwrap_err().to_string();
        assert!(message.starts_with("4 triangles of the surface meet at the edge of nodes [0, 1] at"), "{message}");
        at_corner.tetrahedra[1][1] = 8;
        let (mesh, _) = at_corner.cleaned().unwrap();
        assert!(Surface::new(mesh.points.len(), mesh.surface_triangles()).is_ok());
    }
}
