//! Shapes of regions: which nodes of a block lie in them.

use super::region::RegionFault;

/// A part of space, closed: what lies on its boundary belongs to it.
///
/// # Real-time
/// A plain value: its methods are wait-free and real-time safe.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Shape {
    /// All points within `radius` of `centre` (m).
    Sphere {
        /// Its middle (m).
        centre: [f64; 3],
        /// Its radius (m).
        radius: f64,
    },
    /// All points between two corners (m).
    Box {
        /// The lowest coordinates (m).
        min: [f64; 3],
        /// The highest coordinates (m).
        max: [f64; 3],
    },
    /// An ellipsoid with its axes along x, y and z.
    Ellipsoid {
        /// Its middle (m).
        centre: [f64; 3],
        /// Its semi-axes (m).
        radii: [f64; 3],
    },
    /// All points between two planes.
    Layer {
        /// The axis across it: 0, 1 or 2 for x, y or z.
        axis: usize,
        /// The lower plane (m).
        from: f64,
        /// The upper plane (m).
        to: f64,
    },
}

impl Shape {
    /// True if `point` (m) is in it, or beyond its boundary by no more than `tolerance` (m) along any axis.
    pub fn holds(&self, point: [f64; 3], tolerance: [f64; 3]) -> bool {
        let (low, high) = self.bounds();
        let is_between = (0..3).all(|n| point[n] >= low[n] - tolerance[n] && point[n] <= high[n] + tolerance[n]);
        let is_round = match *self {
            Self::Box { .. } | Self::Layer { .. } => true,
            Self::Sphere { centre, radius } => is_in_ellipsoid(point, tolerance, centre, [radius; 3]),
            Self::Ellipsoid { centre, radii } => is_in_ellipsoid(point, tolerance, centre, radii),
        };
        is_between && is_round
    }

    /// The corners of the smallest box around it (m).
    pub(super) fn bounds(&self) -> ([f64; 3], [f64; 3]) {
        let around = |centre: [f64; 3], radii: [f64; 3]| {
            let corner = |sign: f64| std::array::from_fn(|n| centre[n] + sign * radii[n]);
            (corner(-1.0), corner(1.0))
        };
        match *self {
            Self::Sphere { centre, radius } => around(centre, [radius; 3]),
            Self::Ellipsoid { centre, radii } => around(centre, radii),
            Self::Box { min, max } => (min, max),
            Self::Layer { axis, from, to } => {
                let corner = |end: f64, far: f64| std::array::from_fn(|n| if n == axis { end } else { far });
                (corner(from, f64::NEG_INFINITY), corner(to, f64::INFINITY))
            }
        }
    }

    /// What is wrong with it: the number's name in scene files, and what would be right.
    pub(super) fn fault(&self) -> Option<RegionFault> {
        let is_finite = |values: &[f64]| values.iter().all(|value| value.is_finite());
        let is_positive = |values: &[f64]| is_finite(values) && values.iter().all(|&value| value > 0.0);
        let fault = |key, message| Some((key, message));
        match *self {
            Self::Sphere { centre, .. } if !is_finite(&centre) => {
                fault("shape.sphere.centre_m", format!("is {centre:?}, must be three finite numbers"))
            }
            Self::Sphere { radius, .. } if !is_positive(&[radius]) => {
                fault("shape.sphere.radius_m", format!("is {radius}, must be a finite number above 0"))
            }
            Self::Ellipsoid { centre, .. } if !is_finite(&centre) => {
                fault("shape.ellipsoid.centre_m", format!("is {centre:?}, must be three finite numbers"))
            }
            Self::Ellipsoid { radii, .. } if !is_positive(&radii) => {
                fault("shape.ellipsoid.radii_m", format!("is {radii:?}, must be three finite numbers above 0"))
            }
            Self::Box { min, .. } if !is_finite(&min) => {
                fault("shape.box.min_m", format!("is {min:?}, must be three finite numbers"))
            }
            Self::Box { min, max } if !is_finite(&max) || (0..3).any(|n| max[n] < min[n]) => {
                fault("shape.box.max_m", format!("is {max:?}, must be three finite numbers of at least {min:?}"))
            }
            Self::Layer { axis, .. } if axis > 2 => {
                fault("shape.layer.axis", format!("is {axis}, must be 0, 1 or 2 for x, y or z"))
            }
            Self::Layer { from, .. } if !from.is_finite() => {
                fault("shape.layer.from_m", format!("is {from}, must be a finite number"))
            }
            Self::Layer { from, to, .. } if !(to.is_finite() && to >= from) => {
                fault("shape.layer.to_m", format!("is {to}, must be a finite number of at least from_m, {from}"))
            }
            _ => None,
        }
    }
}

fn is_in_ellipsoid(point: [f64; 3], tolerance: [f64; 3], centre: [f64; 3], radii: [f64; 3]) -> bool {
    let share = |n: usize| ((point[n] - centre[n]).abs() - tolerance[n]).max(0.0) / radii[n];
    // The tolerance is not enough where the surface is oblique: the sum of three squares rounds too.
    (0..3).map(share).map(|share| share * share).sum::<f64>() <= 1.0 + 4.0 * f64::EPSILON
}
