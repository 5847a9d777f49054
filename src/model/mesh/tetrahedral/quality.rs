//! How good the elements of a mesh are.

use super::TetrahedralMesh;
use crate::Vec3;

/// Counts, size and volume of a mesh, with the quality of its worst elements.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MeshQuality {
    /// Number of nodes.
    pub nodes: usize,
    /// Number of elements.
    pub elements: usize,
    /// The smallest dihedral angle, between two faces of an element (degrees). A regular tetrahedron has 70.5.
    pub smallest_angle_deg: f64,
    /// The element that has it.
    pub sharpest_element: u32,
    /// The largest dihedral angle (degrees).
    pub largest_angle_deg: f64,
    /// The element that has it.
    pub bluntest_element: u32,
    /// The smallest height of a corner above the opposite face (m): with the speed of waves it bounds the step.
    pub smallest_height: f64,
    /// The element that has it.
    pub flattest_element: u32,
    /// The sum of the elements' volumes (m^3).
    pub volume: f64,
    /// The lowest coordinates (m).
    pub low: Vec3,
    /// The highest coordinates (m).
    pub high: Vec3,
}

impl MeshQuality {
    /// The size of the smallest box along the axes that holds the mesh (m).
    ///
    /// # Real-time
    /// Wait-free, real-time safe.
    pub fn extent(&self) -> Vec3 {
        self.high - self.low
    }
}

impl TetrahedralMesh {
    /// What the mesh consists of and how good its worst elements are. Angles and heights of a mesh without elements, and the
    /// extent of one without nodes, are not finite.
    ///
    /// # Real-time
    /// Not for a tick: as long as there are elements.
    pub fn quality(&self) -> MeshQuality {
        let mut quality = MeshQuality {
            nodes: self.points.len(),
            elements: self.tetrahedra.len(),
            smallest_angle_deg: f64::INFINITY,
            sharpest_element: 0,
            largest_angle_deg: f64::NEG_INFINITY,
            bluntest_element: 0,
            smallest_height: f64::INFINITY,
            flattest_element: 0,
            volume: 0.0,
            low: Vec3::repeat(f64::INFINITY),
            high: Vec3::repeat(f64::NEG_INFINITY),
        };
        for point in &self.points {
            quality.low = quality.low.inf(point);
            quality.high = quality.high.sup(point);
        }
        for element in 0..self.tetrahedra.len() as u32 {
            let corners = self.corners(element);
            quality.volume += six_volumes(&corners) / 6.0;
            let height = smallest_height(&corners);
            if height < quality.smallest_height {
                (quality.smallest_height, quality.flattest_element) = (height, element);
            }
            let (smallest, largest) = dihedral_angles_deg(&corners);
            if smallest < quality.smallest_angle_deg {
                (quality.smallest_angle_deg, quality.sharpest_element) = (smallest, element);
            }
            if largest > quality.largest_angle_deg {
                (quality.largest_angle_deg, quality.bluntest_element) = (largest, element);
            }
        }
        quality
    }
}

/// Six times the volume (m^3): negative if the corners are in the order of a mirrored element.
pub(super) fn six_volumes(corners: &[Vec3; 4]) -> f64 {
    let [a, b, c, d] = corners;
    (b - a).cross(&(c - a)).dot(&(d - a))
}

/// The normals of the faces opposite to each corner, twice as long as the faces are large.
fn normals(corners: &[Vec3; 4]) -> [Vec3; 4] {
    let [a, b, c, d] = corners;
    [(c - b).cross(&(d - b)), (d - a).cross(&(c - a)), (b - a).cross(&(d - a)), (c - a).cross(&(b - a))]
}

/// The smallest height of a corner above the opposite face (m).
pub(super) fn smallest_height(corners: &[Vec3; 4]) -> f64 {
    let largest_face = normals(corners).iter().map(Vec3::norm).fold(0.0, f64::max);
    six_volumes(corners).abs() / largest_face
}

/// The smallest and the largest of the six angles between two faces.
fn dihedral_angles_deg(corners: &[Vec3; 4]) -> (f64, f64) {
    let normals = normals(corners);
    let pairs = (0..4).flat_map(|a| (a + 1..4).map(move |b| (a, b)));
    let angles = pairs.map(|(a, b)| {
        let (a, b) = (normals[a], normals[b]);
        // As the tangent: the cosine of a small angle does not tell it.
        a.cross(&b).norm().atan2(-a.dot(&b)).to_degrees()
    });
    angles.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), angle| (low.min(angle), high.max(angle)))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn mesh(points: [[f64; 3]; 4]) -> TetrahedralMesh {
        TetrahedralMesh { points: points.map(Vec3::from).to_vec(), tetrahedra: vec![[0, 1, 2, 3]], groups: vec![] }
    }

    #[test]
    fn a_regular_tetrahedron_has_the_angles_of_the_books() {
        let regular = mesh([[1.0, 1.0, 1.0], [-1.0, 1.0, -1.0], [1.0, -1.0, -1.0], [-1.0, -1.0, 1.0]]);
        let quality = regular.quality();
        let angle = (1.0f64 / 3.0).acos().to_degrees();
        assert!((quality.smallest_angle_deg - angle).abs() < 1e-12, "{quality:?}");
        assert!((quality.largest_angle_deg - angle).abs() < 1e-12, "{quality:?}");
        let edge = 8.0f64.sqrt();
        assert!((quality.smallest_height - edge * (2.0f64 / 3.0).sqrt()).abs() < 1e-12, "{quality:?}");
        assert!((quality.volume - 8.0 / 3.0).abs() < 1e-12, "{quality:?}");
        assert_eq!((quality.nodes, quality.elements, quality.extent()), (4, 1, Vec3::repeat(2.0)));
    }

    #[test]
    fn the_corner_of_a_cube_has_right_angles_and_a_sliver_is_told_by_its_height() {
        let quality = mesh([[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]]).quality();
        assert!((quality.largest_angle_deg - 90.0).abs() < 1e-12, "{quality:?}");
        assert!((quality.smallest_angle_deg - 2.0f64.sqrt().atan().to_degrees()).abs() < 1e-12, "{quality:?}");
        assert!((quality.smallest_height - 3.0f64.sqrt().recip()).abs() < 1e-12, "{quality:?}");
        // Four points that are almost a square: nothing but the height and the angles shows it.
        let sliver = mesh([[0.0; 3], [1.0, 0.0, 0.0], [1.0, 1.0, 1e-6], [0.0, 1.0, 0.0]]).quality();
        assert!(sliver.smallest_height < 1e-6 && sliver.largest_angle_deg > 179.99, "{sliver:?}");
    }
}
