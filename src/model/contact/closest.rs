//! The places of triangle and axis that are nearest to each other.

use crate::Vec3;

/// The place on a triangle that is nearest to a point.
///
/// Source: Ericson, Real-Time Collision Detection (2005), section 5.1.5.
pub(super) fn weights(corners: &[Vec3; 3], point: &Vec3) -> [f64; 3] {
    let [a, b, c] = corners;
    let (ab, ac) = (b - a, c - a);
    let ap = point - a;
    let (d1, d2) = (ab.dot(&ap), ac.dot(&ap));
    if d1 <= 0.0 && d2 <= 0.0 {
        return [1.0, 0.0, 0.0];
    }
    let bp = point - b;
    let (d3, d4) = (ab.dot(&bp), ac.dot(&bp));
    if d3 >= 0.0 && d4 <= d3 {
        return [0.0, 1.0, 0.0];
    }
    let vc = d1 * d4 - d3 * d2;
    if vc <= 0.0 && d1 >= 0.0 && d3 <= 0.0 {
        let v = d1 / (d1 - d3);
        return [1.0 - v, v, 0.0];
    }
    let cp = point - c;
    let (d5, d6) = (ab.dot(&cp), ac.dot(&cp));
    if d6 >= 0.0 && d5 <= d6 {
        return [0.0, 0.0, 1.0];
    }
    let vb = d5 * d2 - d1 * d6;
    if vb <= 0.0 && d2 >= 0.0 && d6 <= 0.0 {
        let w = d2 / (d2 - d6);
        return [1.0 - w, 0.0, w];
    }
    let va = d3 * d6 - d5 * d4;
    if va <= 0.0 && d4 - d3 >= 0.0 && d5 - d6 >= 0.0 {
        let w = (d4 - d3) / ((d4 - d3) + (d5 - d6));
        return [0.0, 1.0 - w, w];
    }
    let scale = 1.0 / (va + vb + vc);
    let (v, w) = (vb * scale, vc * scale);
    [1.0 - v - w, v, w]
}

/// How far a segment is from `point`, squared.
pub(super) fn squared_to(axis: &[Vec3; 2], point: &Vec3) -> f64 {
    (axis[0] + (axis[1] - axis[0]) * share_at(axis, point) - point).norm_squared()
}

/// How far a segment is from every place of the triangle `a` `b` `c` at least, squared, where it is so far from its corners, `squares`.
///
/// From the place sum w_i x_i a point p is away by sum w_i |p - x_i|^2 - sum w_i w_j |x_i - x_j|^2, squared, and the second sum is a
/// third of the longest side squared at most.
#[inline]
pub(super) fn least_squared(squares: [f64; 3], a: &Vec3, b: &Vec3, c: &Vec3) -> f64 {
    let sides = [(b - a).norm_squared(), (c - a).norm_squared(), (c - b).norm_squared()];
    // One instruction each, where `f64::min` and `max` look for what is no number.
    let nearest = squares.into_iter().reduce(|one, other| if other < one { other } else { one });
    let longest = sides.into_iter().reduce(|one, other| if other > one { other } else { one });
    // Rounding must not take a place away that is just as near.
    (nearest.unwrap_or(0.0) - longest.unwrap_or(0.0) * (1.0 / 3.0)) * (1.0 - 1e-12)
}

/// The share of the segment from `a` to `b` at which it is nearest to `point`.
pub(super) fn share_at([a, b]: &[Vec3; 2], point: &Vec3) -> f64 {
    let along = b - a;
    let length = along.norm_squared();
    if length == 0.0 { 0.0 } else { ((point - a).dot(&along) / length).clamp(0.0, 1.0) }
}

/// The share of the segment from `a` to `b` at which it is nearest to the triangle `corners`.
pub(super) fn share_of_axis([a, b]: &[Vec3; 2], corners: &[Vec3; 3]) -> f64 {
    let along = b - a;
    let length = along.norm_squared();
    if length == 0.0 {
        return 0.0;
    }
    // Where the axis goes through the plane inside the triangle the distance is zero; else an end of it is nearest, or it is
    // nearest to an edge.
    let across = (corners[1] - corners[0]).cross(&(corners[2] - corners[0]));
    let steep = along.dot(&across);
    if steep != 0.0 {
        let share = (corners[0] - a).dot(&across) / steep;
        if (0.0..=1.0).contains(&share) {
            let through = a + along * share;
            let foot = super::triangle::interpolate(&weights(corners, &through), corners);
            if (foot - through).norm_squared() <= 1e-20 * length {
                return share;
            }
        }
    }
    let distance = |share: f64| {
        let point = a + along * share;
        (super::triangle::interpolate(&weights(corners, &point), corners) - point).norm_squared()
    };
    let to_edge = |i: usize| share_of_segments(a, &along, &corners[i], &(corners[(i + 1) % 3] - corners[i]));
    let mut best = (f64::INFINITY, 0.0);
    for share in [to_edge(0), to_edge(1), to_edge(2), 0.0, 1.0] {
        let d = distance(share);
        // Ends come last: they win only where they are nearer.
        if d < best.0 * (1.0 - 1e-12) {
            best = (d, share);
        }
    }
    best.1
}

/// The share of the segment a + s u at which it is nearest to the segment c + t v, both with shares in [0, 1].
fn share_of_segments(a: &Vec3, u: &Vec3, c: &Vec3, v: &Vec3) -> f64 {
    let r = a - c;
    let (uu, vv, uv) = (u.dot(u), v.dot(v), u.dot(v));
    let (ur, vr) = (u.dot(&r), v.dot(&r));
    let determinant = uu * vv - uv * uv;
    // Parallel ones are nearest everywhere: the middle of what they share.
    if determinant <= 1e-12 * uu * vv {
        let (t0, t1) = (-ur / uu, (uv - ur) / uu);
        let (low, high) = (t0.min(t1).max(0.0), t0.max(t1).min(1.0));
        return (0.5 * (low + high)).clamp(0.0, 1.0);
    }
    let s = ((uv * vr - vv * ur) / determinant).clamp(0.0, 1.0);
    let t = ((uv * s + vr) / vv).clamp(0.0, 1.0);
    ((uv * t - ur) / uu).clamp(0.0, 1.0)
}

#[cfg(test)]
mod tests {
    use super::super::triangle::interpolate;
    use super::*;

    /// A number in [-1, 1) from a counter.
    fn number(n: &mut u64) -> f64 {
        *n = n.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        ((*n >> 11) as f64 / (1u64 << 53) as f64).mul_add(2.0, -1.0)
    }

    #[test]
    fn no_place_of_the_triangle_or_of_the_axis_is_nearer() {
        let mut n = 5;
        let mut vector = || Vec3::new(number(&mut n), number(&mut n), number(&mut n));
        for _ in 0..500 {
            let (corners, axis) = ([vector(), vector(), vector()], [vector(), vector()]);
            let at = |share: f64| axis[0] + (axis[1] - axis[0]) * share;
            let nearest = |point: &Vec3| (interpolate(&weights(&corners, point), &corners) - point).norm();
            let point = axis[0];
            let found = nearest(&point);
            for i in 0..=20 {
                for j in 0..=20 - i {
                    let w = [f64::from(i) / 20.0, f64::from(j) / 20.0, f64::from(20 - i - j) / 20.0];
                    assert!((interpolate(&w, &corners) - point).norm() >= found - 1e-12);
                }
            }
            let found = nearest(&at(share_of_axis(&axis, &corners)));
            let [a, b, c] = &corners;
            let least = least_squared([a, b, c].map(|corner| squared_to(&axis, corner)), a, b, c);
            assert!(least <= found * found, "{axis:?} {corners:?}");
            assert!((0..=100).all(|i| nearest(&at(f64::from(i) / 100.0)) >= found - 1e-9), "{axis:?} {corners:?}");
        }
    }
}
