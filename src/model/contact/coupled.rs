//! The contact of an implicit step: normal and tangential motion couple, and every node answers.

use super::deformable::Deformable;
use super::resolve::{Place, Resolution, approach};
use super::{ContactMode, Law, ToolMotion};
use crate::linear::ImplicitStep;
use crate::{Mat3, Vec3};

/// Rounds for the direction of slip; it turns by the anisotropy of W, a few degrees, and less in every round.
const ROUNDS: usize = 8;

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
    let (nodes, weights) = (body.corners(place.triangle), place.weights);
    let compliance = system.compliance(&nodes, weights);
    let (normal, closing) = match approach(body, law, place, tool, [d_c, system.step()], compliance.trace()) {
        Ok(found) => found,
        Err(without_force) => return without_force,
    };
    let friction = if place.is_glued { None } else { Some(law.friction) };
    let (mode, impulse) = impulse(&compliance, closing, &normal, friction);
    system.push(body.velocities, &nodes, weights, impulse);
    Resolution { mode, impulse, normal }
}

/// The impulse on the tool (N s) that takes away `closing` = G v* - v_t (m/s) within the cone of `friction`; `None` is glued.
/// Whatever the numbers, the impulse is in the cone.
fn impulse(compliance: &Mat3, closing: Vec3, normal: &Vec3, friction: Option<f64>) -> (ContactMode, Vec3) {
    let none = (ContactMode::Free, Vec3::zeros());
    let Some(sticking) = compliance.try_inverse().map(|inverse| inverse * closing) else { return none };
    let Some(friction) = friction else { return (ContactMode::Stick, sticking) };
    let along = sticking.dot(normal);
    let mut across = sticking - normal * along;
    if along > 0.0 && across.norm() <= friction * along {
        return (ContactMode::Stick, sticking);
    }
    // A surface that leaves the tool by itself is released; what cannot slip has to stick. Written so that what is not a
    // number releases.
    if !(closing.dot(normal) > 0.0 && across.norm() > 0.0 && friction.is_finite()) {
        return none;
    }
    let pressed = |direction: Vec3| {
        let compliance = normal.dot(&(compliance * direction));
        (compliance > 0.0).then(|| direction * (closing.dot(normal) / compliance))
    };
    // Friction opposes the sliding that is left; each round turns it towards that by a projected gradient.
    let gain = 1.0 / compliance.trace();
    let mut found = None;
    for _ in 0..ROUNDS {
        let Some(slipping) = pressed(normal + across * (friction / across.norm())) else { break };
        found = Some(slipping);
        let sliding = closing - compliance * slipping;
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

    #[test]
    fn within_the_cone_the_point_follows_the_tool() {
        let closing = Vec3::new(0.02, -0.01, 1.0);
        let (mode, impulse) = impulse(&anisotropic(), closing, &Vec3::z(), Some(3.0));
        assert_eq!(mode, ContactMode::Stick);
        assert!((anisotropic() * impulse - closing).norm() < 1e-14);
    }

    #[test]
    fn sliding_is_opposed_in_its_own_direction_and_the_normal_motion_is_met() {
        for mu in [0.0, 0.1, 0.5, 1.0] {
            let closing = Vec3::new(5.0, -3.0, 1.0);
            let (mode, impulse) = impulse(&anisotropic(), closing, &Vec3::z(), Some(mu));
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
        assert_eq!(impulse(&anisotropic(), away, &Vec3::z(), Some(0.3)), (ContactMode::Free, Vec3::zeros()));
        assert_eq!(impulse(&anisotropic(), Vec3::repeat(f64::NAN), &Vec3::z(), Some(0.3)).0, ContactMode::Free);
        for n in 0..2000 {
            let n = f64::from(n);
            let closing = Vec3::new((3.1 * n).sin(), (1.7 * n).cos(), (0.9 * n).sin());
            let mu = 2.0 * (0.7 * n).sin().abs();
            let (_, j) = impulse(&anisotropic(), closing, &Vec3::z(), Some(mu));
            assert!(j.z >= 0.0 && j.xy().norm() <= mu * j.z * (1.0 + 1e-12) + 1e-15, "{j}");
        }
    }
}
