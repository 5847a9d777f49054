//! `hold`: the last force of the global model, what haptics does without a local model.

use super::{Kind, LocalModel, ResyncView, Watched};
use crate::Vec3;
use crate::contact::{Contact, ToolMotion};

/// The force of the global model's last tick, held until the next.
#[derive(Clone, Debug, Default)]
pub struct Hold {
    force: Vec3,
    contact: Contact,
    built_at: u64,
    watched: Watched,
}

impl LocalModel for Hold {
    fn rebuild(&mut self, resync: ResyncView<'_>) {
        self.force = resync.global.force(resync.index);
        self.contact = *resync.global.contact(resync.index);
        self.built_at = resync.tick;
        self.watched.take(resync.global.state());
    }

    fn tick(&mut self, _: ToolMotion) -> Vec3 {
        self.force
    }

    fn built_at(&self) -> u64 {
        self.built_at
    }

    fn serves_as(&self) -> Kind {
        Kind::Hold
    }

    fn catches_up(&self) -> bool {
        false
    }

    fn contact(&self) -> Contact {
        self.contact
    }

    fn global_position(&self, probe: usize) -> Option<Vec3> {
        self.watched.position(probe)
    }

    fn watch(&mut self, nodes: &[u32]) {
        self.watched.set(nodes);
    }
}
