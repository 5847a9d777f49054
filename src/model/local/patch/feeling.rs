//! What one tool feels of a patch, and of what is beyond it.

use super::super::beyond::Beyond;
use crate::contact::{Friction, Normals, Touch, contact_normal, interpolate};
use crate::mesh::Surface;
use crate::{Pose, Vec3, Wrench};

/// No forecast errs by so much (m): a tool that begins a tick farther from where it ended the last one was put there.
const PUT: f64 = 0.02;

/// What a tool feels.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Feeling {
    /// Over the steps of this tick so far.
    sum: Wrench,
    /// In the last tick.
    felt: Wrench,
    /// The normal of the surface at rest where it has come to press, in this tick, on nodes that give way in the body, but not here.
    strayed: Option<Vec3>,
    beyond: Beyond,
    /// Where the tool was at the end of the last tick (m).
    at: Vec3,
}

impl Feeling {
    /// At a resync, of a tool at `pose` that feels `wrench`.
    ///
    /// Nothing that a patch knew before: which one is built anew hangs on the threads, and a replay is to be the same.
    pub(super) fn new(wrench: Wrench, pose: &Pose, touch: &Touch, surface: (&Surface, &[Vec3])) -> Self {
        let mut feeling = Self { felt: wrench, at: pose.position, ..Self::default() };
        feeling.learn(pose, touch, surface);
        feeling
    }

    /// In the last tick.
    pub(super) fn felt(&self) -> Wrench {
        self.felt
    }

    /// From now on it feels what is not finite.
    pub(super) fn spoil(&mut self) {
        self.felt = Vec3::repeat(f64::NAN).into();
    }

    /// True from the end of the tick on in which it left the patch.
    pub(super) fn is_beyond(&self) -> bool {
        self.beyond.has_left()
    }

    /// A tick begins, with the tool at `from` (m). True if it was put there: it is not to be dragged there.
    pub(super) fn begin(&mut self, from: Vec3) -> bool {
        self.sum = Wrench::default();
        (from - self.at).norm() > PUT
    }

    /// A step is over in which it felt `wrench`, or a part of it: its share.
    pub(super) fn add(&mut self, wrench: Wrench) {
        self.sum += wrench;
    }

    /// It leaves the patch in this tick; `surface` is that at rest, with its nodes (m).
    pub(super) fn stray(&mut self, touch: &Touch, surface: (&Surface, &[Vec3])) {
        self.strayed = Some(contact_at_rest(touch, surface).map_or(Vec3::zeros(), |(_, normal)| normal));
    }

    /// A tick of `steps` steps is over, with the tool at `pose`.
    pub(super) fn end(&mut self, pose: &Pose, steps: u32, touch: &Touch, surface: (&Surface, &[Vec3])) {
        self.at = pose.position;
        match self.strayed.take() {
            Some(normal) => self.beyond.leave(normal, (&touch.shape, pose), self.felt),
            None => {
                self.felt = self.sum / f64::from(steps);
                self.learn(pose, touch, surface);
            }
        }
    }

    /// A tick is over beyond the patch, with the tool of that `touch` at `pose`.
    pub(super) fn follow(&mut self, pose: &Pose, touch: &Touch, friction: &Friction) {
        self.felt = self.beyond.follow((&touch.shape, pose), friction).unwrap_or(self.felt);
    }

    fn learn(&mut self, pose: &Pose, touch: &Touch, surface: (&Surface, &[Vec3])) {
        if let Some((place, normal)) = contact_at_rest(touch, surface) {
            let depth = place.dot(&normal) - touch.shape.height(pose, &normal);
            self.beyond.learn(self.felt.force.dot(&normal), depth);
        }
    }
}

/// Where a tool touches the surface at rest (m), and the outward unit normal there.
fn contact_at_rest(touch: &Touch, (surface, rest): (&Surface, &[Vec3])) -> Option<(Vec3, Vec3)> {
    let triangle = touch.contact.triangle?;
    let corners = surface.triangles[triangle as usize].map(|node| rest[node as usize]);
    let normal = contact_normal(Normals::Face, surface, rest, triangle, &touch.contact.weights);
    Some((interpolate(&touch.contact.weights, &corners), normal))
}
