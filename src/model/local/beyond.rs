//! What a tool feels once it has left the patch: a spring as stiff as the surface was, and Coulomb's friction.

use crate::contact::{Friction, ToolShape};
use crate::{Pose, Vec3, Wrench};

/// The stiffness of a surface along itself over that towards it, about that of a round contact on an elastic half-space with a
/// Poisson's ratio of 0.4 (Mindlin 1949).
const ALONG: f64 = 0.75;
/// The spring pushes at most so many times as hard as the surface ever did.
const MOST: f64 = 1.2;

/// What it held across the normal beyond friction, and what pushes it with a stiffness that is not known, becomes so much less with each tick.
const EASING: f64 = 0.95;

/// A tool over a surface of which nothing is known any more but how stiff it was.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Beyond {
    /// Sums over the ticks in contact: force times depth (N m) and depth squared (m^2). Their quotient is the stiffness.
    work: f64,
    squares: f64,
    /// The largest force along the normal (N).
    most: f64,
    left: Option<Left>,
}

/// Where and how the tool left.
#[derive(Clone, Copy, Debug)]
struct Left {
    /// The outward unit normal of the surface at rest.
    normal: Vec3,
    /// How high the tool's lowest part was (m), and how hard the spring pushed (N).
    height: f64,
    pressed: f64,
    /// What it held across the normal for what pressed. The dent that it was in has another normal than the surface at rest, so that
    /// this may be more than friction allows.
    across: f64,
    /// What was felt last, and where (m).
    felt: Wrench,
    at: Vec3,
}

impl Beyond {
    /// The surface pushed with `force` (N) a tool that was `depth` (m) in the surface at rest.
    pub(super) fn learn(&mut self, force: f64, depth: f64) {
        if force > 0.0 && depth > 0.0 {
            self.work += force * depth;
            self.squares += depth * depth;
            self.most = self.most.max(force);
        }
    }

    /// A tool of that `shape` leaves the patch at `pose`, over a surface with the outward unit `normal`; it feels `felt`.
    pub(super) fn leave(&mut self, normal: Vec3, (shape, pose): (&ToolShape, &Pose), felt: Wrench) {
        let pressed = felt.force.dot(&normal).max(0.0);
        let across = if pressed > 0.0 { (felt.force - normal * pressed).norm() / pressed } else { 0.0 };
        let height = shape.height(pose, &normal);
        self.left = Some(Left { normal, height, pressed, across, felt, at: pose.position });
    }

    pub(super) fn has_left(&self) -> bool {
        self.left.is_some()
    }

    /// What the tool, of that `shape`, feels at the pose `to`, if it has left.
    pub(super) fn follow(&mut self, (shape, to): (&ToolShape, &Pose), friction: &Friction) -> Option<Wrench> {
        let is_known = self.squares > 0.0;
        let stiffness = if is_known { self.work / self.squares } else { 0.0 };
        let most = MOST * self.most;
        let Left { normal, height, pressed, across, felt, at } = self.left.as_mut()?;
        let before = felt.force.dot(normal);
        // Nothing says when a surface of unknown stiffness would let go.
        *pressed *= if is_known { 1.0 } else { EASING };
        let along = (*pressed + stiffness * (*height - shape.height(to, normal))).clamp(0.0, most.max(*pressed));
        let way = to.position - *at;
        *across *= EASING;
        let limit = if along > 0.0 { friction.kinetic.max(*across) * along } else { 0.0 };
        let across = felt.force - *normal * before - (way - *normal * way.dot(normal)) * (ALONG * stiffness);
        let across = if across.norm() > limit { across * (limit / across.norm()) } else { across };
        let torque = if before > 0.0 { felt.torque * (along / before) } else { Vec3::zeros() };
        *felt = Wrench { force: *normal * along + across, torque };
        *at = to.position;
        Some(*felt)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn beyond(force: Vec3) -> Beyond {
        let mut beyond = Beyond::default();
        (1..=10).for_each(|n| beyond.learn(0.1 * f64::from(n), 1e-4 * f64::from(n)));
        beyond.leave(Vec3::z(), (&ToolShape::Point, &Pose::at(Vec3::new(0.0, 0.0, -1e-3))), force.into());
        beyond
    }

    #[test]
    fn a_tool_that_stays_feels_what_it_felt_and_one_that_lifts_nothing() {
        let friction = Friction::from(0.5);
        let mut left = beyond(Vec3::new(0.3, 0.0, 1.0));
        let stays = left.follow((&ToolShape::Point, &Pose::at(Vec3::new(0.0, 0.0, -1e-3))), &friction).unwrap();
        assert!((stays.force - Vec3::new(0.3, 0.0, 1.0)).norm() < 1e-12, "{stays:?}");
        let steep = beyond(Vec3::new(0.9, 0.0, 1.0))
            .follow((&ToolShape::Point, &Pose::at(Vec3::new(0.0, 0.0, -1e-3))), &friction)
            .unwrap();
        assert!((steep.force.x - EASING * 0.9).abs() < 1e-12, "no jump: {steep:?}");
        let half = left.follow((&ToolShape::Point, &Pose::at(Vec3::new(0.0, 0.0, -0.5e-3))), &friction).unwrap();
        assert!((half.force - Vec3::new(0.25, 0.0, 0.5)).norm() < 1e-12, "in the cone: {half:?}");
        assert_eq!(
            left.follow((&ToolShape::Point, &Pose::at(Vec3::new(0.0, 0.0, 1e-3))), &friction),
            Some(Wrench::default())
        );
        // 1000 N/m, but never much more than what was felt.
        let deep = left.follow((&ToolShape::Point, &Pose::at(Vec3::new(0.0, 0.0, -0.1))), &friction).unwrap();
        assert!((deep.force.z - 1.2).abs() < 1e-12, "{deep:?}");
    }

    #[test]
    fn friction_turns_with_the_tool() {
        let mut left = beyond(Vec3::new(0.5, 0.0, 1.0));
        let mut force = Vec3::zeros();
        for n in 1..=20 {
            force = left
                .follow(
                    (&ToolShape::Point, &Pose::at(Vec3::new(1e-4 * f64::from(n), 0.0, -1e-3))),
                    &Friction::from(0.5),
                )
                .unwrap()
                .force;
        }
        assert!((force - Vec3::new(-0.5, 0.0, 1.0)).norm() < 1e-12, "{force:?}");
    }

    #[test]
    fn one_that_never_touched_feels_nothing_and_stays_inside_says_so() {
        let mut never = Beyond::default();
        assert!(
            !never.has_left()
                && never.follow((&ToolShape::Point, &Pose::at(Vec3::zeros())), &Friction::default()).is_none()
        );
        never.leave(Vec3::z(), (&ToolShape::Point, &Pose::default()), Wrench::default());
        assert_eq!(
            never.follow((&ToolShape::Point, &Pose::at(-Vec3::z())), &Friction::default()),
            Some(Wrench::default())
        );
    }

    /// An upright probe whose end is in the surface: it is let go where it is lifted, and soon if nothing was learned.
    #[test]
    fn a_capsule_that_is_lifted_is_let_go() {
        let probe = ToolShape::Capsule { radius: 3e-3, half_axis: Vec3::z() * 0.02 };
        let pose = |height: f64| Pose::at(Vec3::z() * (0.023 + height));
        let mut left = Beyond::default();
        (1..=10).for_each(|n| left.learn(0.1 * f64::from(n), 1e-4 * f64::from(n)));
        left.leave(Vec3::z(), (&probe, &pose(-1e-3)), Vec3::z().into());
        let mut feel = |height: f64| left.follow((&probe, &pose(height)), &Friction::default()).unwrap().force.z;
        assert!((feel(-0.5e-3) - 0.5).abs() < 1e-12 && feel(0.0).abs() < 1e-12);
        let mut unknown = Beyond::default();
        unknown.leave(Vec3::z(), (&probe, &pose(-1e-3)), Vec3::z().into());
        let force = |_| unknown.follow((&probe, &pose(-1e-3)), &Friction::default()).unwrap().force.z;
        let forces: Vec<f64> = (0..200).map(force).collect();
        assert!((forces[0] - EASING).abs() < 1e-12 && forces[199] < 1e-4, "{forces:?}");
    }

    #[test]
    fn a_tool_that_sticks_whatever_presses_is_let_go_in_the_air() {
        let mut left = beyond(Vec3::new(0.3, 0.0, 1.0));
        let mut feel = |at: Vec3| left.follow((&ToolShape::Point, &Pose::at(at)), &f64::INFINITY.into()).unwrap().force;
        assert!(feel(Vec3::new(-5e-3, 0.0, -1e-3)).x > 4.0);
        assert_eq!(feel(Vec3::new(-5e-3, 0.0, 1e-3)), Vec3::zeros());
        assert_eq!(feel(Vec3::new(-9e-3, 0.0, 1e-3)), Vec3::zeros());
    }
}
