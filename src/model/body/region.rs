//! Regions of a block that are made of something else: layers and inclusions.

use super::shape::{RegionFault, Shape};
use crate::error::ModelError;
use crate::mesh::Lattice;

/// What the nodes of a block and the halves of the springs at them are made of.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Material {
    /// k of a spring between two such nodes (N/m).
    pub(super) stiffness: f64,
    /// zeta in b = zeta sqrt(2 m k).
    pub(super) damping_ratio: f64,
    /// m of the node (kg).
    pub(super) node_mass: f64,
}

impl Material {
    /// Damping b (N s/m) of a spring between two such nodes.
    pub(super) fn damping(&self) -> f64 {
        self.damping_ratio * (2.0 * self.node_mass * self.stiffness).sqrt()
    }

    fn is_usable(&self) -> bool {
        let per_mass = [self.stiffness, self.damping()].map(|value| (value / self.node_mass).is_finite());
        per_mass == [true; 2] && self.damping().is_finite()
    }
}

/// Half springs in series: a spring between two nodes is half of each one's material. Two springs of 2 a and 2 b in a row
/// are one of 2 a b / (a + b), the harmonic mean, and equal halves make the whole, to the last bit.
pub(super) fn in_series(a: f64, b: f64) -> f64 {
    if a == b {
        return a;
    }
    let (least, most) = (a.min(b), a.max(b));
    // No product of two numbers: neither overflow nor underflow.
    2.0 * least / (1.0 + least / most)
}

/// A part of a block that differs in material. What it leaves out stays as it was: the block's, or an earlier region's.
///
/// ```
/// use palpate_model::body::{Block, Region, Shape};
///
/// # fn main() -> Result<(), palpate_model::ModelError> {
/// let nodule = Region::new(Shape::Sphere { centre: [0.05, 0.05, 0.07], radius: 0.02 }).stiffness(300.0);
/// let block = Block::builder([12; 3], [0.1; 3]).stiffness(30.0).region(nodule).build()?;
/// # Ok(())
/// # }
/// ```
///
/// # Real-time
/// A plain value: its methods are wait-free and real-time safe.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Region {
    /// The part: all nodes whose rest position is in this shape.
    pub shape: Shape,
    /// Stiffness k of a spring between two of the region's nodes (N/m).
    pub stiffness: Option<f64>,
    /// Damping ratio zeta in b = zeta sqrt(2 m k).
    pub damping_ratio: Option<f64>,
    /// Mass of each of the region's nodes (kg).
    pub node_mass: Option<f64>,
}

impl Region {
    /// A node within this share of the block's edge from a region's boundary lies on it: far above the rounding of
    /// i (edge / (n - 1)), far below a distance of nodes.
    const TOLERANCE: f64 = 1e-9;

    /// A region that differs in nothing yet.
    pub fn new(shape: Shape) -> Self {
        Self { shape, stiffness: None, damping_ratio: None, node_mass: None }
    }

    /// Sets the stiffness of a spring between two of the region's nodes (N/m).
    #[must_use]
    pub fn stiffness(self, n_per_m: f64) -> Self {
        Self { stiffness: Some(n_per_m), ..self }
    }

    /// Sets the damping ratio zeta in b = zeta sqrt(2 m k), with m and k as they are in the region.
    #[must_use]
    pub fn damping_ratio(self, zeta: f64) -> Self {
        Self { damping_ratio: Some(zeta), ..self }
    }

    /// Sets the mass of each of the region's nodes (kg).
    #[must_use]
    pub fn node_mass(self, kg: f64) -> Self {
        Self { node_mass: Some(kg), ..self }
    }

    /// Changes the `materials` of a block of `size` (m) where the region is.
    fn apply(&self, lattice: Lattice, size: [f64; 3], materials: &mut [Material]) -> Result<(), RegionFault> {
        if let Some(fault) = self.shape.fault().or_else(|| self.values_fault()) {
            return Err(fault);
        }
        let tolerance = size.map(|edge| Self::TOLERANCE * edge);
        let spacing: [f64; 3] = std::array::from_fn(|axis| size[axis] / (lattice.nodes[axis] - 1) as f64);
        let mut is_empty = true;
        for [i, j, k] in self.candidates(lattice, spacing) {
            let at = [i as f64 * spacing[0], j as f64 * spacing[1], k as f64 * spacing[2]];
            if !self.shape.holds(at, tolerance) {
                continue;
            }
            is_empty = false;
            let material = &mut materials[lattice.id([i, j, k]) as usize];
            material.stiffness = self.stiffness.unwrap_or(material.stiffness);
            material.damping_ratio = self.damping_ratio.unwrap_or(material.damping_ratio);
            material.node_mass = self.node_mass.unwrap_or(material.node_mass);
            if !material.is_usable() {
                let message = "stiffness or damping over mass is beyond all numbers, check the units (kg, N/m)";
                return Err(("", message.to_owned()));
            }
        }
        if is_empty {
            let [x, y, z] = spacing;
            let message = format!(
                "holds no node of the block, which has one every [{x}, {y}, {z}] m from 0 to {size:?} m: move or enlarge it"
            );
            return Err(("shape", message));
        }
        Ok(())
    }

    /// The nodes in the smallest box of the lattice around the shape, and some beside.
    fn candidates(&self, lattice: Lattice, spacing: [f64; 3]) -> impl Iterator<Item = [usize; 3]> + use<> {
        let (low, high) = self.shape.bounds();
        // A cast of a float saturates: infinite bounds end with the lattice.
        let [x, y, z] = [0, 1, 2].map(|axis| {
            let first = (low[axis] / spacing[axis]).floor() as usize;
            let last = (high[axis] / spacing[axis]).ceil() as usize;
            first.saturating_sub(1)..last.saturating_add(2).min(lattice.nodes[axis])
        });
        z.flat_map(move |k| {
            let x = x.clone();
            y.clone().flat_map(move |j| x.clone().map(move |i| [i, j, k]))
        })
    }

    fn values_fault(&self) -> Option<RegionFault> {
        let positive = |value: f64| value.is_finite() && value > 0.0;
        if let Some(k) = self.stiffness.filter(|&k| !positive(k)) {
            return Some(("stiffness_n_per_m", format!("is {k}, must be a finite number above 0")));
        }
        if let Some(zeta) = self.damping_ratio.filter(|zeta| !(zeta.is_finite() && *zeta >= 0.0)) {
            return Some(("damping_ratio", format!("is {zeta}, must be a finite number of at least 0")));
        }
        if let Some(m) = self.node_mass.filter(|&m| !positive(m)) {
            return Some(("node_mass_kg", format!("is {m}, must be a finite number above 0")));
        }
        if (self.stiffness, self.damping_ratio, self.node_mass) == (None, None, None) {
            let message = "differs in nothing, give stiffness_n_per_m, damping_ratio or node_mass_kg";
            return Some(("", message.to_owned()));
        }
        None
    }
}

/// The material of every node of a block of `size` (m): `base`, and over it `regions` in order.
///
/// # Errors
/// If a region cannot be: `region[index].key` and what is wrong with it.
pub(super) fn materials(
    lattice: Lattice,
    size: [f64; 3],
    base: Material,
    regions: &[Region],
) -> Result<Vec<Material>, ModelError> {
    let mut materials = vec![base; lattice.len()];
    for (index, region) in regions.iter().enumerate() {
        region.apply(lattice, size, &mut materials).map_err(|(key, message)| {
            let dot = if key.is_empty() { "" } else { "." };
            ModelError::of(&format!("region[{index}]{dot}{key}"), message)
        })?;
    }
    Ok(materials)
}

#[cfg(test)]
mod tests {
    use super::*;

    const SIZE: [f64; 3] = [0.1; 3];
    const LATTICE: Lattice = Lattice { nodes: [12; 3] };
    const BASE: Material = Material { stiffness: 30.0, damping_ratio: 0.3, node_mass: 0.5e-3 };

    fn stiff_nodes(regions: &[Region]) -> Vec<u32> {
        let materials = materials(LATTICE, SIZE, BASE, regions).unwrap();
        (0..materials.len() as u32).filter(|&n| materials[n as usize].stiffness == 300.0).collect()
    }

    #[test]
    fn a_boundary_on_a_plane_of_nodes_takes_that_plane_in() {
        let spacing = 0.1 / 11.0;
        for plane in 0..12 {
            // The same plane, computed in three ways that round differently.
            for at in [plane as f64 * spacing, 0.1 * plane as f64 / 11.0, 0.1 - (11 - plane) as f64 * spacing] {
                for axis in 0..3 {
                    let layer = |from, to| [Region::new(Shape::Layer { axis, from, to }).stiffness(300.0)];
                    assert_eq!(stiff_nodes(&layer(at, 1.0)).len(), 144 * (12 - plane), "{axis}, from {at}");
                    assert_eq!(stiff_nodes(&layer(-1.0, at)).len(), 144 * (plane + 1), "{axis}, to {at}");
                    assert_eq!(stiff_nodes(&layer(at, at)).len(), 144, "{axis}, at {at}");
                }
            }
        }
        let centre = [4.0 * spacing, 5.0 * spacing, 6.0 * spacing];
        let radius = 2.0 * spacing;
        let sphere = stiff_nodes(&[Region::new(Shape::Sphere { centre, radius }).stiffness(300.0)]);
        // All offsets of at most two spacings: 1 + 6 + 12 + 8 + 6.
        assert_eq!(sphere.len(), 33);
        let ellipsoid = Region::new(Shape::Ellipsoid { centre, radii: [radius; 3] }).stiffness(300.0);
        assert_eq!(stiff_nodes(&[ellipsoid]), sphere);
    }

    #[test]
    fn the_search_near_a_shape_finds_what_a_search_of_all_nodes_finds() {
        let shapes = [
            Shape::Sphere { centre: [0.03, 0.11, 0.05], radius: 0.031 },
            Shape::Ellipsoid { centre: [0.05, 0.02, 0.09], radii: [0.04, 0.01, 0.02] },
            Shape::Box { min: [-1.0, 0.02, 0.05], max: [0.03, 0.04, 7.0] },
            Shape::Layer { axis: 1, from: 0.05, to: 0.0691 },
        ];
        for shape in shapes {
            let spacing = 0.1 / 11.0;
            let is_in = |n: &u32| shape.holds(LATTICE.coordinates(*n).map(|c| c as f64 * spacing), [1e-10; 3]);
            let all: Vec<u32> = (0..LATTICE.len() as u32).filter(is_in).collect();
            assert!(!all.is_empty());
            assert_eq!(stiff_nodes(&[Region::new(shape).stiffness(300.0)]), all, "{shape:?}");
        }
    }

    #[test]
    fn the_last_region_that_gives_a_value_wins_and_the_others_stay() {
        let slab = Shape::Layer { axis: 2, from: 0.05, to: 0.1 };
        let top = Shape::Layer { axis: 2, from: 0.08, to: 0.1 };
        let regions = [Region::new(slab).stiffness(10.0).node_mass(2e-3), Region::new(top).stiffness(300.0)];
        let materials = materials(LATTICE, SIZE, BASE, &regions).unwrap();
        assert_eq!(materials[0], BASE);
        assert_eq!(materials[7 * 144], Material { stiffness: 10.0, damping_ratio: 0.3, node_mass: 2e-3 });
        assert_eq!(materials[11 * 144], Material { stiffness: 300.0, damping_ratio: 0.3, node_mass: 2e-3 });
    }

    #[test]
    fn halves_in_series() {
        assert_eq!(in_series(30.0, 30.0), 30.0);
        assert_eq!((in_series(0.0, 3.0), in_series(0.0, 0.0)), (0.0, 0.0));
        assert!((in_series(30.0, 300.0) - 2.0 * 30.0 * 300.0 / 330.0).abs() < 1e-13);
        assert_eq!(in_series(30.0, 7.0), in_series(7.0, 30.0));
        assert!(in_series(1e-300, 1e300) > 0.0);
        assert!(in_series(1e300, 1.1e300).is_finite());
    }

    #[test]
    fn what_cannot_be_is_refused_with_its_key() {
        let inside = Shape::Sphere { centre: [0.05; 3], radius: 0.02 };
        let stiff = |shape| Region::new(shape).stiffness(300.0);
        for (region, key, words) in [
            (stiff(Shape::Sphere { centre: [0.05, f64::NAN, 0.0], radius: 0.1 }), "shape.sphere.centre_m", "finite"),
            (stiff(Shape::Sphere { centre: [0.05; 3], radius: 0.0 }), "shape.sphere.radius_m", "above 0"),
            (
                stiff(Shape::Ellipsoid { centre: [0.05; 3], radii: [0.1, -0.1, 0.1] }),
                "shape.ellipsoid.radii_m",
                "above 0",
            ),
            (stiff(Shape::Box { min: [0.0; 3], max: [0.1, -0.1, 0.1] }), "shape.box.max_m", "at least [0.0, 0.0, 0.0]"),
            (stiff(Shape::Layer { axis: 3, from: 0.0, to: 0.1 }), "shape.layer.axis", "0, 1 or 2"),
            (stiff(Shape::Layer { axis: 2, from: 0.1, to: 0.0 }), "shape.layer.to_m", "at least from_m"),
            (stiff(Shape::Sphere { centre: [0.005; 3], radius: 0.001 }), "shape", "holds no node"),
            (stiff(Shape::Layer { axis: 2, from: 0.2, to: 0.3 }), "shape", "holds no node"),
            (Region::new(inside), "", "differs in nothing"),
            (Region::new(inside).stiffness(f64::INFINITY), "stiffness_n_per_m", "finite"),
            (Region::new(inside).damping_ratio(-0.1), "damping_ratio", "at least 0"),
            (Region::new(inside).node_mass(0.0), "node_mass_kg", "above 0"),
            (Region::new(inside).node_mass(1e-320), "", "beyond all numbers"),
        ] {
            let error = materials(LATTICE, SIZE, BASE, &[stiff(inside), region]).unwrap_err();
            assert_eq!(error.place().trim_start_matches("region[1]").trim_start_matches('.'), key, "{region:?}");
            assert!(error.message().contains(words), "{region:?}: {error}");
        }
    }
}
