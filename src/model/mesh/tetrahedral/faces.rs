//! The faces of elements: which are shared, and which are the surface.

use super::TetrahedralMesh;

/// The corners of each face of an element of positive volume, counter-clockwise from outside: those opposite to its first,
/// second, third and fourth.
const FACES: [[usize; 3]; 4] = [[1, 2, 3], [0, 3, 2], [0, 1, 3], [0, 2, 1]];

/// A face of an element.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(super) struct ElementFace {
    /// Its nodes in increasing order: the same for both elements at a face.
    pub(super) nodes: [u32; 3],
    /// The element.
    pub(super) element: u32,
    /// Which of its faces.
    face: u8,
    /// True if `nodes` are counter-clockwise from outside.
    pub(super) is_even: bool,
}

impl TetrahedralMesh {
    /// The triangles of the surface: the faces of one element only, counter-clockwise from outside if no element is inverted.
    /// In the order of the elements.
    ///
    /// # Real-time
    /// Not real-time safe: sorts all faces.
    pub fn surface_triangles(&self) -> Vec<[u32; 3]> {
        let faces = self.faces();
        let mut alone: Vec<&ElementFace> =
            faces.chunk_by(|a, b| a.nodes == b.nodes).filter(|same| same.len() == 1).flatten().collect();
        alone.sort_unstable_by_key(|face| (face.element, face.face));
        let corners = |face: &ElementFace| {
            let nodes = self.tetrahedra[face.element as usize];
            FACES[usize::from(face.face)].map(|corner| nodes[corner])
        };
        alone.into_iter().map(corners).collect()
    }

    /// All faces, those with the same nodes side by side.
    pub(super) fn faces(&self) -> Vec<ElementFace> {
        let of_element = |(element, nodes): (usize, &[u32; 4])| {
            let nodes = *nodes;
            (0..4).map(move |face| {
                let [a, b, c] = FACES[face].map(|corner| nodes[corner]);
                let mut sorted = [a, b, c];
                sorted.sort_unstable();
                let is_even = sorted == [a, b, c] || sorted == [b, c, a] || sorted == [c, a, b];
                ElementFace { nodes: sorted, element: element as u32, face: face as u8, is_even }
            })
        };
        let mut faces: Vec<ElementFace> = self.tetrahedra.iter().enumerate().flat_map(of_element).collect();
        faces.sort_unstable();
        faces
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Vec3;

    #[test]
    fn the_surface_of_two_elements_has_six_triangles_seen_from_outside() {
        let points = vec![Vec3::zeros(), Vec3::x(), Vec3::y(), Vec3::z(), Vec3::new(1.0, 1.0, 1.0)];
        let mesh = TetrahedralMesh { points, tetrahedra: vec![[0, 1, 2, 3], [1, 2, 3, 4]], groups: vec![] };
        let surface = mesh.surface_triangles();
        assert_eq!(surface.len(), 6);
        let middle = mesh.points.iter().sum::<Vec3>() / 5.0;
        for triangle in surface {
            let [a, b, c] = triangle.map(|node| mesh.points[node as usize]);
            assert!((b - a).cross(&(c - a)).dot(&(a - middle)) > 0.0, "{triangle:?}");
        }
    }
}
