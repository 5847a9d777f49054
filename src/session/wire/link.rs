//! The two bridges of a link, and what is between them and the actors beside them.

use super::global::ToolLink;
use crate::actors::{GlobalBridge, GlobalEnd, HapticBridge, HapticEnd, LocalPorts, ModelMaker};
use crate::error::{Error, ErrorKind};
use crate::link::{Conditions, VirtualLink};
use crate::model::local::Image;
use crate::model::simulation::Simulation;
use crate::runtime::{Actor, RuntimeBuilder};

/// Records between two drains: one every 50 ms.
const RECORDS: usize = 256;

/// The link of a session that has one.
pub(super) struct Linking {
    image: Image,
    conditions: Conditions,
    haptic: Vec<HapticEnd>,
    global: Vec<GlobalEnd>,
}

impl Linking {
    /// Under `conditions`, with the body of `simulation` on both sides.
    ///
    /// # Errors
    /// If the body cannot be copied.
    pub(super) fn new(conditions: &Conditions, simulation: &Simulation) -> Result<Self, Error> {
        let copy = simulation.duplicate();
        let copy = copy.ok_or_else(|| Error::new(ErrorKind::Runtime, "a link needs a body that can be copied"))?;
        let (haptic, global) = Default::default();
        Ok(Self { image: Image::new(copy), conditions: conditions.clone(), haptic, global })
    }

    /// Puts a bridge on either side between a local actor and the global one, with models of `maker`; up to so many `ticks` wait.
    pub(super) fn connect(
        &mut self,
        graph: &mut RuntimeBuilder,
        maker: &ModelMaker,
        ticks: usize,
    ) -> (ToolLink, LocalPorts) {
        let (local, departing) = (maker.clone(), maker.clone());
        let (to_bridge, from_local) = graph.queue(ticks);
        let (from_bridge, models) = graph.exchange(move || local.first());
        self.haptic.push(HapticEnd { ticks: from_local, models: from_bridge });
        let models_out = graph.exchange_port(move || departing.departing());
        let link = ToolLink { ticks: graph.queue_port(ticks), geometry: None, models: models_out };
        self.global.push(GlobalEnd { ticks: link.ticks.writer(), models: link.models.reader() });
        (link, LocalPorts { models, ticks: to_bridge, geometry: None })
    }

    /// The bridges in the order of their starts: what the global side tells at first is there when the haptic side begins.
    pub(super) fn bridges(self, graph: &mut RuntimeBuilder) -> Vec<Box<dyn Actor>> {
        let [haptic, global] = VirtualLink::ends(self.conditions);
        vec![
            Box::new(GlobalBridge::new(Box::new(global), self.global)),
            Box::new(HapticBridge::new(Box::new(haptic), self.haptic, self.image, graph.recorder(RECORDS))),
        ]
    }
}
