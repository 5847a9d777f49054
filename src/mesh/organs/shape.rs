//! Organs as smooth unions of ellipsoids on a plane.

use palpate_model::Vec3;

use crate::ImplicitShape;

/// An ellipsoid along the axes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Ellipsoid {
    pub centre: [f64; 3],
    pub radii: [f64; 3],
}

impl Ellipsoid {
    /// Negative inside; at most the distance (m).
    fn signed_distance(&self, point: &Vec3) -> f64 {
        let scaled = (point - Vec3::from(self.centre)).component_div(&Vec3::from(self.radii));
        (scaled.norm() - 1.0) * Vec3::from(self.radii).min()
    }

    pub fn holds(&self, point: &Vec3) -> bool {
        self.signed_distance(point) <= 0.0
    }
}

/// The shape of an organ: a smooth union of ellipsoids, cut by the plane z = 0 that it lies on.
#[derive(Clone, Debug)]
pub struct Organ {
    /// How far the union rounds the creases between its ellipsoids (m).
    pub(super) blend_m: f64,
    pub(super) lobes: &'static [Ellipsoid],
    /// The lump inside: a tumour or a nodule.
    pub(super) lump: Ellipsoid,
}

impl Organ {
    /// Negative inside the lump, positive outside (m).
    pub fn lump_distance(&self, point: &Vec3) -> f64 {
        self.lump.signed_distance(point)
    }
}

impl ImplicitShape for Organ {
    fn signed_distance(&self, point: &Vec3) -> f64 {
        let lobes = self.lobes.iter().map(|lobe| lobe.signed_distance(point));
        // The polynomial smooth minimum of second order (Quilez 2013).
        let smooth_min = |a: f64, b: f64| {
            let near = (self.blend_m - (a - b).abs()).max(0.0);
            a.min(b) - near * near / (4.0 * self.blend_m)
        };
        lobes.fold(f64::INFINITY, smooth_min).max(-point.z)
    }

    fn bounds(&self) -> [Vec3; 2] {
        let ends =
            |sign: f64| self.lobes.iter().map(move |lobe| Vec3::from(lobe.centre) + Vec3::from(lobe.radii) * sign);
        let (low, high) = ends(-1.0)
            .zip(ends(1.0))
            .fold((Vec3::repeat(f64::INFINITY), Vec3::repeat(f64::NEG_INFINITY)), |(low, high), (start, end)| {
                (low.inf(&start), high.sup(&end))
            });
        // What the union adds where lobes meet.
        let [low, high] = [low.add_scalar(-self.blend_m), high.add_scalar(self.blend_m)];
        [Vec3::new(low.x, low.y, low.z.max(0.0)), high]
    }
}
