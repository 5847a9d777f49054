//! What a tool feels of a patch: the patch's own force until the contact leaves it, the last one from then on.

use super::super::Vec3;
use super::super::body::State;

/// The force of the last tick whose contact was inside the patch.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Felt {
    force: Vec3,
    has_left: bool,
}

impl Felt {
    /// The force that the global model has (N), and a contact inside.
    pub(super) fn new(force: Vec3) -> Self {
        Self { force, has_left: false }
    }

    /// The last force, once the contact has left (N).
    pub(super) fn held(&self) -> Option<Vec3> {
        self.has_left.then_some(self.force)
    }

    /// What is felt (N) after a tick with `force` that ended in `state`, and outside if the contact `has_left` in it.
    pub(super) fn after(&mut self, force: Vec3, state: &State, has_left: bool) -> Vec3 {
        // A state that is not finite touches nothing: its zero force would look like a free tool.
        if !state.is_finite() {
            return Vec3::repeat(f64::NAN);
        }
        self.has_left = has_left;
        if !has_left {
            self.force = force;
        }
        self.force
    }
}
