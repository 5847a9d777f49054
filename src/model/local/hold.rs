//! `hold`: the last force of the global model, what haptics does without a local model.

use super::{Kind, LocalModel, ResyncView, Watched};
use crate::contact::{Contact, ContactPoint, ToolMotion};
use crate::{Vec3, Wrench};

/// The forces and torques of the global model's last tick, held until the next.
#[derive(Clone, Debug, Default)]
pub struct Hold {
    tools: Vec<Held>,
    /// The tool that it is built around.
    own: usize,
    built_at: u64,
    watched: Watched,
}

/// What one tool felt.
#[derive(Clone, Debug, Default)]
struct Held {
    wrench: Wrench,
    contact: Contact,
    points: Vec<ContactPoint>,
    area: f64,
}

impl LocalModel for Hold {
    fn rebuild(&mut self, resync: ResyncView<'_>) {
        let global = &*resync.global;
        self.tools.resize_with(global.tools(), Held::default);
        for (tool, held) in self.tools.iter_mut().enumerate() {
            (held.wrench, held.contact) = (global.wrench(tool), *global.contact(tool));
            global.contact_points(tool).clone_into(&mut held.points);
            held.area = global.contact_area(tool);
        }
        (self.own, self.built_at) = (resync.index, resync.tick);
        self.watched.take(global.state());
    }

    fn tick(&mut self, _: &[ToolMotion]) -> Wrench {
        self.wrench(self.own).unwrap_or_default()
    }

    fn built_at(&self) -> u64 {
        self.built_at
    }

    fn kind(&self) -> Kind {
        Kind::Hold
    }

    fn wrench(&self, tool: usize) -> Option<Wrench> {
        self.tools.get(tool).map(|held| held.wrench)
    }

    fn serves_as(&self, _: usize) -> Kind {
        Kind::Hold
    }

    fn catches_up(&self) -> bool {
        false
    }

    fn contact(&self, tool: usize) -> Contact {
        self.tools.get(tool).map(|held| held.contact).unwrap_or_default()
    }

    fn contact_points(&self, tool: usize) -> &[ContactPoint] {
        self.tools.get(tool).map_or(&[], |held| &held.points)
    }

    fn contact_area(&self, tool: usize) -> f64 {
        self.tools.get(tool).map_or(0.0, |held| held.area)
    }

    fn global_position(&self, probe: usize) -> Option<Vec3> {
        self.watched.position(probe)
    }

    fn watch(&mut self, nodes: &[u32]) {
        self.watched.set(nodes);
    }
}
