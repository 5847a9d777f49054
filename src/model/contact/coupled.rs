//! The contact of an implicit step: normal and tangential motion couple, and every node answers.

use super::deformable::Deformable;
use super::resolve::{Place, Resolution, approach};
use super::{ContactMode, Friction, Law, ToolMotion};
use crate::linear::ImplicitStep;
use crate::{Mat3, Vec3};

/// Rounds for the direction of slip; it turns by the anisotropy of W, a few degrees, and less in every round.
const ROUNDS: usize = 8;
/// Rounds where the coefficient changes with the speed of sliding, which comes down on its solution slower than the direction.
const GRADUAL_ROUNDS: usize = 32;

/// Solves the contact as [`super::resolve::resolve`] does, with the compliance W = G A^-1 G^T (3 x 3) of the contact point in place of the number
/// S: W J = G v* - v_t to stick, n.W (n + mu t) j_n = n.(G v* - v_t) to slip, v = v* - A^-1 G^T J.
pub(super) fn resolve_coupled(
    body: &mut Deformable<'_>,
    system: &ImplicitStep,
    law: &Law,
    place: Place<'_>,
    tool: ToolMotion,
    d_c: f64,
) -> Resolution {
    let nodes = body.corners(place.triangle).map(|node| node as u32);
    let nodes: [_; 3] = std::array::from_fn(|corner| (nodes[corner], place.weights[corner]));
    let compliance = system.coupling(&nodes, &nodes);
    let (normal, closing) = match approach(body, law, place, tool, [d_c, system.step()], compliance.trace()) {
        Ok(found) => found,
        Err(without_force) => return without_force,
    };
    let friction = if place.is_glued { None } else { Some((law.friction, place.was_sticking)) };
    let (mode, impulse) = impulse(&compliance, closing, &normal, friction);
    system.push(body.velocities, &nodes, impulse);
    Resolution { mode, impulse, normal }
}

/// The impulse on the tool (N s) that takes away `closing` = G v* - v_t (m/s) within the cone of the friction, with whether
/// the contact stuck in the step before; `None` is glued. Whatever the numbers, the impulse is in the cone.
pub(super) fn impulse(
    compliance: &Mat3,
    closing: Vec3,
    normal: &Vec3,
    friction: Option<(Friction, bool)>,
) -> (ContactMode, Vec3) {
    let none = (ContactMode::Free, Vec3::zeros());
    let Some(sticking) = compliance.try_inverse().map(|inverse| inverse * closing) else { return none };
    let Some((friction, was_sticking)) = friction else { return (ContactMode::Stick, sticking) };
    let along = sticking.dot(normal);
    let mut across = sticking - normal * along;
    let size = across.norm();
    let sticks_with = |coefficient: f64| along > 0.0 && size <= coefficient * along;
    if sticks_with(friction.holding(was_sticking)) {
        return (ContactMode::Stick, sticking);
    }
    // A surface that leaves the tool by itself is released; what cannot slip has to stick. Written so that what is not a
    // number releases.
    if !(closing.dot(normal) > 0.0 && size > 0.0 && friction.kinetic.is_finite()) {
        return none;
    }
    let pressed = |direction: Vec3| {
        let compliance = normal.dot(&(compliance * direction));
        (compliance > 0.0).then(|| direction * (closing.dot(normal) / compliance))
    };
    // Friction opposes the sliding that is left; each round turns it towards that by a projected gradient. The coefficient
    // begins with that of fast sliding and follows the speed down, as in `Friction::resolve`.
    let gain = 1.0 / compliance.trace();
    let mut coefficient = friction.kinetic;
    let mut found = None;
    for _ in 0..if friction.is_gradual() { GRADUAL_ROUNDS } else { ROUNDS } {
        let size = across.norm();
        let Some(slipping) = pressed(normal + across * (coefficient / size)) else { break };
        found = Some(slipping);
        let sliding = closing - compliance * slipping;
        if friction.is_gradual() {
            let speed = sliding.dot(&across) / size;
            if speed > 0.0 {
                coefficient = friction.sliding(speed);
            } else if sticks_with(friction.breakaway) {
                return (ContactMode::Stick, sticking);
            }
        }
        let turned = slipping + sliding * gain;
        across = turned - normal * turned.dot(normal);
        if across.norm() == 0.0 {
            break;
        }
    }
    // Coupling so strong that friction would lift the surface off: the normal part alone.
    let frictionless = || pressed(*normal);
    found.or_else(frictionless).map_or(none, |impulse| (ContactMode::Slip, impulse))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn anisotropic() -> Mat3 {
        let skew = Mat3::new(1.0, 0.3, 0.2, -0.1, 2.0, 0.4, 0.3, 0.1, 1.5);
        skew * skew.transpose()
    }

    fn coulomb(mu: f64) -> Option<(Friction, bool)> {
        Some((mu.into(), false))
    }

    #[test]
    fn within_the_cone_the_point_follows_the_tool() {
        let closing = Vec3::new(0.02, -0.01, 1.0);
        let (mode, impulse) = impulse(&anisotropic(), closing, &Vec3::z(), coulomb(3.0));
        assert_eq!(mode, ContactMode::Stick);
        assert!((anisotropic() * impulse - closing).norm() < 1e-14);
    }

    #[test]
    fn sliding_is_opposed_in_its_own_direction_and_the_normal_motion_is_met() {
        for mu in [0.0, 0.1, 0.5, 1.0] {
            let closing = Vec3::new(5.0, -3.0, 1.0);
            let (mode, impulse) = impulse(&anisotropic(), closing, &Vec3::z(), coulomb(mu));
            assert_eq!(mode, ContactMode::Slip, "{mu}");
            let left = closing - anisotropic() * impulse;
            assert!(left.z.abs() < 1e-12, "{mu}: {left}");
            let (friction, sliding) = (impulse.xy(), left.xy());
            assert!((friction.norm() - mu * impulse.z).abs() < 1e-12, "{mu}: on the cone");
            // Friction on the tool goes with the surface's own sliding.
            assert!(friction.dot(&sliding) >= 0.99 * friction.norm() * sliding.norm(), "{mu}: {friction} {sliding}");
        }
    }

    #[test]
    fn a_surface_that_leaves_is_released_and_nothing_leaves_the_cone() {
        let away = Vec3::new(0.5, 0.0, -1.0);
        assert_eq!(impulse(&anisotropic(), away, &Vec3::z(), coulomb(0.3)), (ContactMode::Free, Vec3::zeros()));
        assert_eq!(impulse(&anisotropic(), Vec3::repeat(f64::NAN), &Vec3::z(), coulomb(0.3)).0, ContactMode::Free);
        for n in 0..2000 {
            let n = f64::from(n);
            let closing = Vec3::new((3.1 * n).sin(), (1.7 * n).cos(), (0.9 * n).sin());
            let mu = 2.0 * (0.7 * n).sin().abs();
            let (_, j) = impulse(&anisotropic(), closing, &Vec3::z(), coulomb(mu));
            assert!(j.z >= 0.0 && j.xy().norm() <= mu * j.z * (1.0 + 1e-12) + 1e-15, "{j}");
        }
    }

    /// Check that the same compliance in every direction gives what the number S gives, whatever the friction.
    #[test]
    fn an_isotropic_point_slides_and_sticks_as_one_of_an_explicit_step() {
        let s = 800.0;
        for n in 0..2000 {
            let n = f64::from(n);
            let friction = Friction {
                kinetic: (0.7 * n).sin().abs(),
                breakaway: 0.4 + (0.7 * n).sin().abs(),
                stribeck: if n % 3.0 == 0.0 { 0.0 } else { 10.0_f64.powf(-4.0 * (0.3 * n).cos().abs()) },
            };
            let closing = Vec3::new((3.1 * n).sin(), (1.7 * n).cos(), 0.1 + (0.9 * n).sin().abs());
            let sticks = n % 2.0 == 0.0;
            let (mode, found) = impulse(&(Mat3::identity() * s), closing, &Vec3::z(), Some((friction, sticks)));
            let holds = Vec3::new(closing.x, closing.y, 0.0) / s;
            let (expected, tangential) = friction.resolve(sticks, holds, closing.z / s, s);
            assert_eq!(mode, expected, "{n}: {friction:?} {closing}");
            let expected = tangential + Vec3::z() * (closing.z / s);
            // The rounds of the two are counted one apart, which shows where they are barely enough.
            assert!((found - expected).norm() <= 1e-3 * expected.norm(), "{n}: {friction:?} {found} {expected}");
        }
    }

    #[test]
    fn nothing_leaves_the_cone_of_breakaway() {
        for n in 0..4000 {
            let n = f64::from(n);
            let closing = Vec3::new((3.1 * n).sin(), (1.7 * n).cos(), (0.9 * n).sin());
            let kinetic = (0.7 * n).sin().abs();
            let friction = Friction { kinetic, breakaway: 2.0 * kinetic, stribeck: (0.2 * n).cos().max(0.0) };
            for sticks in [true, false] {
                let (_, j) = impulse(&anisotropic(), closing, &Vec3::z(), Some((friction, sticks)));
                assert!(j.z >= 0.0 && j.xy().norm() <= friction.breakaway * j.z * (1.0 + 1e-12) + 1e-15, "{n}: {j}");
            }
        }
    }
}
