//! Shapes of regions: which nodes of a block lie in them.

/// What is wrong with a region: the key in scene files, and what would be right.
pub(super) type RegionFault = (&'static str, String);

/// A part of space, closed: what lies on its boundary belongs to it.
///
/// # Real-time
/// A plain value: its methods are wait-free and real-time safe.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Shape {
    /// All points within `radius` of `centre` (m).
    Sphere {
        /// The sphere's middle (m).
        centre: [f64; 3],
        /// The sphere's radius (m).
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
        /// The ellipsoid's middle (m).
        centre: [f64; 3],
        /// The ellipsoid's semi-axes (m).
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

    /// The first of its numbers that is wrong.
    pub(super) fn fault(&self) -> Option<RegionFault> {
        let is_finite = |values: &[f64]| values.iter().all(|value| value.is_finite());
        let is_positive = |values: &[f64]| is_finite(values) && values.iter().all(|&value| value > 0.0);
        let refuse = |is_good: bool, key, what: String| (!is_good).then_some((key, what));
        let finite = |key, x: [f64; 3]| refuse(is_finite(&x), key, format!("is {x:?}, must be three finite numbers"));
        match *self {
            Self::Sphere { centre, radius } => finite("shape.sphere.centre_m", centre).or_else(|| {
                let what = format!("is {radius}, must be a finite number above 0");
                refuse(is_positive(&[radius]), "shape.sphere.radius_m", what)
            }),
            Self::Ellipsoid { centre, radii } => finite("shape.ellipsoid.centre_m", centre).or_else(|| {
                let what = format!("is {radii:?}, must be three finite numbers above 0");
                refuse(is_positive(&radii), "shape.ellipsoid.radii_m", what)
            }),
            Self::Box { min, max } => finite("shape.box.min_m", min).or_else(|| {
                let what = format!("is {max:?}, must be three finite numbers of at least {min:?}");
                refuse(is_finite(&max) && (0..3).all(|n| max[n] >= min[n]), "shape.box.max_m", what)
            }),
            Self::Layer { axis, from, to } => {
                let axis = refuse(axis < 3, "shape.layer.axis", format!("is {axis}, must be 0, 1 or 2 for x, y or z"));
                let least = format!("is {to}, must be a finite number of at least from_m, {from}");
                let from_fault = format!("is {from}, must be a finite number");
                axis.or_else(|| refuse(from.is_finite(), "shape.layer.from_m", from_fault))
                    .or_else(|| refuse(to.is_finite() && to >= from, "shape.layer.to_m", least))
            }
        }
    }
}

fn is_in_ellipsoid(point: [f64; 3], tolerance: [f64; 3], centre: [f64; 3], radii: [f64; 3]) -> bool {
    let share = |n: usize| ((point[n] - centre[n]).abs() - tolerance[n]).max(0.0) / radii[n];
    // The tolerance is not enough where the surface is oblique: the sum of three squares rounds too.
    (0..3).map(share).map(|share| share * share).sum::<f64>() <= 1.0 + 4.0 * f64::EPSILON
}
