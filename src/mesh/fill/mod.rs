//! Filling of closed surfaces and implicit shapes with tetrahedra: isosurface stuffing (Labelle and Shewchuk 2007).
//!
//! A body-centred cubic lattice is cut by the surface; points of it that are near are drawn onto the surface, and what lies inside becomes
//! elements by a few stencils. All dihedral angles lie between 10.7 and 164.8 degrees, whatever the surface; sharp edges are rounded by
//! about an element.

mod depths;
mod distance;
mod lattice;
mod leaves;
mod manifold;
mod shape;
mod stencil;
mod stuff;

use palpate_model::mesh::TetrahedralMesh;

use crate::{MeshError, SurfaceMesh};
use distance::Closed;
use lattice::Lattice;
use leaves::Leaves;
pub use shape::ImplicitShape;
use stuff::{Elements, Warped};

/// Elements inside are at most this many times doubled: above it the lattice of the fine ones is too large for any body.
const MOST_DOUBLINGS: usize = 6;

/// How large elements are to be.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sizes {
    /// The longest edge of an undistorted element; the others are 0.87 of it (m). There are about 12 elements in its cube.
    pub element_m: f64,
    /// The same for the elements at the surface, where they are to be finer (m). Inside they double as often as stays within
    /// `element_m`; each doubling takes a few layers.
    pub surface_m: Option<f64>,
}

impl Sizes {
    /// Elements of one size throughout (m).
    pub fn uniform(element_m: f64) -> Self {
        Self { element_m, surface_m: None }
    }

    /// The size at the surface (m), and how often it doubles inside.
    fn finest(self) -> Result<(f64, usize), MeshError> {
        let Self { element_m, surface_m } = self;
        let finest = surface_m.unwrap_or(element_m);
        for (size, of) in [(element_m, "elements"), (finest, "elements at the surface")] {
            if !(size > 0.0 && size.is_finite()) {
                return Err(MeshError::new(format!("{of} of {size} m: a length above zero is needed")));
            }
        }
        if finest > element_m {
            let message =
                format!("elements of {finest} m at the surface are larger than those of {element_m} m inside");
            return Err(MeshError::new(format!("{message}: they can only be finer")));
        }
        // A ratio that is a power of two in decimal digits may be a little less.
        let doublings = (element_m / finest * (1.0 + 1e-9)).log2().floor() as usize;
        Ok((finest, doublings.min(MOST_DOUBLINGS)))
    }
}

/// Fills a closed `surface` with tetrahedra. `progress` is called with the part that is done, from 0 to 1. The result has no groups, and
/// is the same to the bit in each run.
///
/// The surface is cleaned first ([`SurfaceMesh::cleaned`]). What is thinner than an element may vanish; loose crumbs of two dozen
/// elements at most are left out, larger parts are kept.
///
/// # Errors
/// If the surface cannot be cleaned: it is open, crosses itself, has no triangles. If a size is not above zero, the one at the surface is
/// the larger, one is so small that the lattice would have above 20 million cells (what fits is named), or so large that less than
/// half of the volume would be left.
pub fn fill(surface: &SurfaceMesh, sizes: Sizes, progress: &mut dyn FnMut(f64)) -> Result<TetrahedralMesh, MeshError> {
    let closed = Closed::new(surface)?;
    let mesh = fill_by(&closed, sizes, progress, |lattice, progress| depths::near(&closed, lattice, progress))?;
    let filled = volume(&mesh);
    if filled < 0.5 * closed.volume {
        let part = 100.0 * filled / closed.volume;
        return Err(too_large(sizes, &format!("only {part:.0} % of its volume would be filled")));
    }
    Ok(mesh)
}

/// Fills a shape that is given by a function, as [`fill`] does a surface.
///
/// # Errors
/// As of [`fill`]; also if the shape reaches beyond its bounds.
pub fn fill_shape(
    shape: &impl ImplicitShape,
    sizes: Sizes,
    progress: &mut dyn FnMut(f64),
) -> Result<TetrahedralMesh, MeshError> {
    fill_by(shape, sizes, progress, |lattice, progress| depths::everywhere(shape, lattice, progress))
}

/// Fills `shape`, with the depths of the lattice's points from `depths`.
fn fill_by(
    shape: &impl ImplicitShape,
    sizes: Sizes,
    progress: &mut dyn FnMut(f64),
    depths: impl FnOnce(&Lattice, &mut dyn FnMut(f64)) -> Result<Vec<f32>, MeshError>,
) -> Result<TetrahedralMesh, MeshError> {
    let (finest, doublings) = sizes.finest()?;
    let lattice = Lattice::around(shape.bounds(), finest, 1 << doublings)?;
    progress(0.0);
    let depths = depths(&lattice, &mut |done| progress(0.4 * done))?;
    let warped = Warped::new(lattice, &depths, shape, &mut |done| progress(0.4 + 0.3 * done));
    let mesh = manifold::repaired(stuffed(&warped, doublings, &mut |done| progress(0.7 + 0.2 * done)));
    progress(1.0);
    match mesh.tetrahedra.is_empty() {
        true => Err(too_large(sizes, "no element fits into it")),
        false => Ok(mesh),
    }
}

/// All elements inside the surface.
fn stuffed(warped: &Warped, doublings: usize, progress: &mut dyn FnMut(f64)) -> TetrahedralMesh {
    let leaves = Leaves::new(&warped.lattice, doublings, |steps| warped.sign(steps) > 0);
    let mut elements = Elements::new(warped);
    let [nx, ny, nz] = warped.lattice.cells;
    for k in 0..nz {
        progress(k as f64 / nz as f64);
        for j in 0..ny {
            (0..nx).for_each(|i| leaves.tetrahedra_of([i, j, k], &mut |at| elements.add(at)));
        }
    }
    elements.mesh
}

/// The error of elements that are too large for the surface.
fn too_large(sizes: Sizes, because: &str) -> MeshError {
    let size = sizes.surface_m.unwrap_or(sizes.element_m);
    MeshError::new(format!("element_size_m is too large for this surface: with {size} m {because}"))
}

/// The volume of all elements (m^3).
fn volume(mesh: &TetrahedralMesh) -> f64 {
    let of = |element: &[u32; 4]| {
        let [a, b, c, d] = element.map(|node| mesh.points[node as usize]);
        (b - a).cross(&(c - a)).dot(&(d - a)) / 6.0
    };
    mesh.tetrahedra.iter().map(of).sum()
}

#[cfg(test)]
mod tests {
    use palpate_model::Vec3;
    use proptest::prelude::*;

    use super::*;
    use crate::support::{Shape, angles, noise, outer_faces};

    /// Check that every element is positive and of the promised angles, and that neighbours cut their common face alike, before
    /// anything is repaired: an outer face that comes from two different cuts has a node inside.
    fn check_stuffed(shape: &impl ImplicitShape, cell: f64, doublings: usize) -> TetrahedralMesh {
        let lattice = Lattice::around(shape.bounds(), cell, 1 << doublings).unwrap();
        let depths = depths::everywhere(shape, &lattice, &mut |_| {}).unwrap();
        let mesh = stuffed(&Warped::new(lattice, &depths, shape, &mut |_| {}), doublings, &mut |_| {});
        let [smallest, largest] = angles(&mesh);
        assert!(smallest > 10.7 && largest < 164.8, "{smallest} to {largest} degrees");
        for node in outer_faces(&mesh).into_iter().flatten() {
            let distance = shape.signed_distance(&mesh.points[node as usize]);
            assert!(distance.abs() < 1e-5, "an outer node is {distance} m from the surface");
        }
        mesh
    }

    proptest! {
        #![proptest_config(ProptestConfig { cases: 60, failure_persistence: None, ..ProptestConfig::default() })]

        #[test]
        fn any_pattern_of_signs_is_filled_without_gaps(seed: u64, waves in 1_usize..8) {
            check_stuffed(&noise(seed, waves), 0.5, 0);
        }

    }

    proptest! {
        #![proptest_config(ProptestConfig { cases: 8, failure_persistence: None, ..ProptestConfig::default() })]

        #[test]
        fn elements_that_grow_inside_leave_no_gaps(
            seed: u64,
            waves in 1_usize..4,
            doublings in 1_usize..4,
            holes in prop::collection::vec(prop::array::uniform3(-2.0..2.0), 40),
        ) {
            let shape = noise(seed, waves);
            // Large enough for all sizes, with caves, and holes as small as a cell.
            let caves = |x: &Vec3| shape.signed_distance(&(x * 0.5)).max(x.norm() - 2.9);
            let hole = |x: &Vec3| holes.iter().map(|&hole| 0.05 - (x - Vec3::from(hole)).norm()).fold(-1.0, f64::max);
            let caves = Shape { reach: 3.0, distance: |x: &Vec3| caves(x).max(hole(x)) };
            check_stuffed(&caves, 0.12, doublings);
        }
    }

    #[test]
    fn every_size_between_the_two_comes_up() {
        let ball = Shape { reach: 1.0, distance: |x: &Vec3| x.norm() - 1.0 };
        let mesh = check_stuffed(&ball, 0.04, 3);
        let edge = |element: &[u32; 4]| (mesh.points[element[0] as usize] - mesh.points[element[1] as usize]).norm();
        for doublings in 0..=3 {
            let long = 0.04 * f64::from(1 << doublings);
            assert!(mesh.tetrahedra.iter().any(|element| (edge(element) / long - 1.0).abs() < 1e-9), "{long}");
        }
        assert!(mesh.tetrahedra.len() * 3 < check_stuffed(&ball, 0.04, 0).tetrahedra.len());
    }
}
