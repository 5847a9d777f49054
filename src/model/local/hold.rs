//! `hold`: the last force of the global model, what haptics does without a local model.

use super::{Kind, LocalModel, ResyncView, Watched};
use crate::contact::{Contact, ContactPoint, ToolMotion};
use crate::{Vec3, Wrench};

/// The force and torque of the global model's last tick, held until the next.
#[derive(Clone, Debug, Default)]
pub struct Hold {
    wrench: Wrench,
    contact: Contact,
    points: Vec<ContactPoint>,
    area: f64,
    built_at: u64,
    watched: Watched,
}

impl LocalModel for Hold {
    fn rebuild(&mut self, resync: ResyncView<'_>) {
        self.wrench = resync.global.wrench(resync.index);
        self.contact = *resync.global.contact(resync.index);
        resync.global.contact_points(resync.index).clone_into(&mut self.points);
        self.area = resync.global.contact_area(resync.index);
        self.built_at = resync.tick;
        self.watched.take(resync.global.state());
    }

    fn tick(&mut self, _: &[ToolMotion]) -> Wrench {
        self.wrench
    }

    fn built_at(&self) -> u64 {
        self.built_at
    }

    fn kind(&self) -> Kind {
        Kind::Hold
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

    fn contact_points(&self) -> &[ContactPoint] {
        &self.points
    }

    fn contact_area(&self) -> f64 {
        self.area
    }

    fn global_position(&self, probe: usize) -> Option<Vec3> {
        self.watched.position(probe)
    }

    fn watch(&mut self, nodes: &[u32]) {
        self.watched.set(nodes);
    }
}
