//! The two bridges of a link, and what is between them and the actors beside them.

use super::global::ToolLink;
use crate::actors::{
    BasesPorts, Beyond, GlobalBridge, GlobalBridgePorts, HapticBridge, HapticBridgePorts, LocalPorts, ModelMaker,
    SurfaceView, ToolTick, Tunable,
};
use crate::devices::ElsewhereHandle;
use crate::error::{Error, ErrorKind};
use crate::link::{Conditions, Transport, VirtualLink};
use crate::model::Pose;
use crate::model::local::{Image, LocalModels};
use crate::model::simulation::Simulation;
use crate::model::surroundings::Bases;
use crate::runtime::{
    Actor, ExchangePort, OutletPort, OutletReader, OutletWriter, QueueReader, QueueWriter, Rate, Reader,
    RuntimeBuilder, Writer,
};
use crate::session::prepare::ModelPlan;

/// Records between two drains: one every 50 ms.
const RECORDS: usize = 256;

/// What the bridges are between.
pub(super) enum Ends {
    /// Both sides are here, and between them is a simulated link.
    Both(Conditions),
    /// The devices are here, and the way to the other side.
    Haptic(Box<dyn Transport>),
    /// The global model is here, and the haptic machines are beyond.
    Global(Vec<Beyond>),
}

/// What of a session that runs goes over the link besides ticks and models.
pub(super) struct Outer {
    /// What the program changes, and what the global actor takes: what crosses leads from one to the other.
    settings: [Tunable; 2],
    /// Where the body is seen, if it comes over the link.
    shown: Vec<OutletWriter<SurfaceView>>,
    /// The body that is to be seen on the other side.
    seen: Option<OutletReader<SurfaceView>>,
}

impl Outer {
    /// Between `ends`, with the `settings` that the program changes here, the body's `surfaces` as they are seen here, and as it is `seen` on
    /// the other side.
    pub(super) fn new(
        graph: &mut RuntimeBuilder,
        ends: &Ends,
        plan: &ModelPlan,
        settings: &Tunable,
        surfaces: &[OutletPort<SurfaceView>],
        seen: Option<OutletReader<SurfaceView>>,
    ) -> Self {
        let far = match ends {
            // The global actor does not know what the program wants before it has come over the link.
            Ends::Both(_) => plan.tunable(graph),
            Ends::Haptic(_) | Ends::Global(_) => settings.clone(),
        };
        let shown = match ends {
            Ends::Haptic(_) => surfaces.iter().map(OutletPort::writer).collect(),
            // The global actor shows it itself.
            Ends::Both(_) | Ends::Global(_) => Vec::new(),
        };
        Self { settings: [settings.clone(), far], shown, seen }
    }
}

/// The link of a session that has one.
pub(super) struct Linking {
    ends: Ends,
    /// Of the body, where the devices are.
    image: Option<Image>,
    /// From the local actor to the bridge, and from the bridge to the global one: of each tool.
    haptic: Vec<QueueReader<ToolTick>>,
    global: Vec<QueueWriter<ToolTick>>,
    /// From the bridge to the local actor, and from the global one to the bridge.
    arriving: Option<Writer<LocalModels>>,
    departing: Option<Reader<LocalModels>>,
    /// From the basis actor to the bridge, and from there to the global actor.
    bases: Option<BasesPorts>,
    outer: Outer,
    /// Those that are seen.
    surface_nodes: Vec<u32>,
    haptic_rate: Rate,
    /// Where each tool is at the start.
    places: Vec<Pose>,
    /// Where each goes whose device is at another machine.
    elsewhere: Vec<Option<ElsewhereHandle>>,
}

impl Linking {
    /// Between `ends`, with the body of `simulation` on both sides and tools that begin at `places`, of which some are `elsewhere`.
    ///
    /// # Errors
    /// If the body cannot be copied.
    pub(super) fn new(
        ends: Ends,
        simulation: &Simulation,
        (places, elsewhere): (&[Pose], Vec<Option<ElsewhereHandle>>),
        haptic_rate: Rate,
        outer: Outer,
    ) -> Result<Self, Error> {
        let copy = || {
            let copy = simulation.duplicate();
            copy.ok_or_else(|| Error::new(ErrorKind::Runtime, "a link needs a body that can be copied"))
        };
        let others = (0..).zip(&elsewhere).filter(|(_, handle)| handle.is_some()).map(|(tool, _)| tool).collect();
        let image = match ends {
            Ends::Global(_) => None,
            Ends::Both(_) | Ends::Haptic(_) => Some(Image::new(copy()?).without(others)),
        };
        let (haptic, global, arriving, departing, bases) = Default::default();
        let surface_nodes = simulation.body().surface().nodes();
        let places = places.to_vec();
        Ok(Self {
            ends,
            image,
            haptic,
            global,
            arriving,
            departing,
            bases,
            outer,
            surface_nodes,
            haptic_rate,
            places,
            elsewhere,
        })
    }

    /// What the global actor takes.
    pub(super) fn global_settings(&self) -> &Tunable {
        &self.outer.settings[1]
    }

    fn has_global(&self) -> bool {
        !matches!(self.ends, Ends::Haptic(_))
    }

    /// Puts a bridge on either side that is here, between a tool of the local actor and the global one; up to so many `ticks` wait.
    pub(super) fn connect(
        &mut self,
        graph: &mut RuntimeBuilder,
        ticks: usize,
    ) -> (Option<ToolLink>, Option<LocalPorts>) {
        let local = self.image.is_some().then(|| {
            let (to_bridge, from_local) = graph.queue(ticks);
            self.haptic.push(from_local);
            LocalPorts { ticks: to_bridge, geometry: None }
        });
        let link = self.has_global().then(|| {
            let link = ToolLink { ticks: graph.queue_port(ticks), geometry: None };
            self.global.push(link.ticks.writer());
            link
        });
        (link, local)
    }

    /// Likewise for the models of so many `tools`, which `maker` makes: where the global actor puts them, and where the local one gets them.
    pub(super) fn connect_models(
        &mut self,
        graph: &mut RuntimeBuilder,
        maker: &ModelMaker,
        tools: usize,
    ) -> (Option<ExchangePort<LocalModels>>, Option<Reader<LocalModels>>) {
        let local = self.image.is_some().then(|| {
            let maker = maker.clone();
            let (from_bridge, models) = graph.exchange(move || maker.first(tools));
            self.arriving = Some(from_bridge);
            models
        });
        let global = self.has_global().then(|| {
            let maker = maker.clone();
            let models = graph.exchange_port(move || maker.departing(tools));
            self.departing = Some(models.reader());
            models
        });
        (global, local)
    }

    /// Likewise for the bases that are `made`, of which some are `known` before the start: where the global actor gets them.
    pub(super) fn connect_bases(
        &mut self,
        graph: &mut RuntimeBuilder,
        made: &ExchangePort<Bases>,
        known: &Bases,
    ) -> ExchangePort<Bases> {
        let port = graph.exchange_port(Bases::default);
        self.bases = Some(BasesPorts { made: made.reader(), passed: port.writer(), known: known.clone() });
        port
    }

    /// The bridges in the order of their starts: what the global side tells at first is there when the haptic side begins.
    pub(super) fn bridges(self, graph: &mut RuntimeBuilder) -> Vec<Box<dyn Actor>> {
        let Self { ends, image, haptic, global, arriving, departing, bases, outer, surface_nodes, .. } = self;
        let Outer { settings: [settings, global_settings], shown, seen } = outer;
        let all = (0..self.places.len()).collect();
        let (here, there): (Option<Box<dyn Transport>>, Vec<Beyond>) = match ends {
            Ends::Both(conditions) => {
                let [haptic, global] = VirtualLink::ends(conditions);
                (Some(Box::new(haptic)), vec![(Box::new(global), all)])
            }
            Ends::Haptic(transport) => (Some(transport), Vec::new()),
            Ends::Global(machines) => (None, machines),
        };
        let global = departing.map(|models| {
            let ports = GlobalBridgePorts {
                models,
                bases,
                tools: self.places.into_iter().zip(global).collect(),
                settings: global_settings,
                surface: seen.map(|seen| (seen, surface_nodes)),
                haptic: self.haptic_rate,
            };
            Box::new(GlobalBridge::new(there, ports)) as Box<dyn Actor>
        });
        let haptic = here.zip(image).zip(arriving).map(|((transport, image), models)| {
            let (settings, recorder) = (settings.reader(), graph.recorder(RECORDS));
            let tools = haptic.into_iter().zip(self.elsewhere).collect();
            let ports =
                HapticBridgePorts { tools, haptic: self.haptic_rate, models, settings, surfaces: shown, recorder };
            Box::new(HapticBridge::new(transport, image, ports)) as Box<dyn Actor>
        });
        global.into_iter().chain(haptic).collect()
    }
}
