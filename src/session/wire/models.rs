//! What computes the forces: the whole body, or local models that a global one sends.

use super::basis::BasisSide;
use super::buffers::ticks_buffered;
use super::global::{GlobalMaker, GlobalSide, ToolLink};
use super::link::{Ends, Linking, Outer};
use crate::actors::{Checkpoint, GlobalPlan, LocalPorts, LocalSource, ModelMaker, Settings, SurfaceView, Tunable};
use crate::devices::ElsewhereHandle;
use crate::error::Error;
use crate::model::Pose;
use crate::model::local::{PatchGeometry, Succession};
use crate::model::simulation::Simulation;
use crate::runtime::{Actor, ExchangePort, OutletPort, OutletReader, OutletWriter, ParameterReader, RuntimeBuilder};
use crate::session::prepare::ModelPlan;

/// What computes the forces at the haptic rate.
#[expect(clippy::large_enum_variant, reason = "there is one per session, and it goes into an actor")]
pub(super) enum Models {
    /// The whole body with all tools, where its surface is shown, and what is changed while it runs.
    Whole(Simulation, Vec<OutletWriter<SurfaceView>>, ParameterReader<Settings>),
    /// The models, and the ports of each tool; none where the devices are elsewhere.
    Local(Option<(LocalSource, Vec<LocalPorts>)>),
}

/// What computes the forces; what makes the global actor, unless that is the whole body or elsewhere; and the bridges between the two,
/// if there are any.
pub(super) type Wired = (Models, Option<GlobalMaker>, Vec<Box<dyn Actor>>);

/// Wires what computes the forces, with a link between `ends` if there is one; over it the body is `seen` on the other side, and some tools are
/// `elsewhere`.
///
/// # Errors
/// If there is a link and the body cannot be copied.
pub(super) fn models(
    graph: &mut RuntimeBuilder,
    plan: &ModelPlan,
    (simulation, places): (Simulation, &[Pose]),
    surfaces: Vec<OutletPort<SurfaceView>>,
    bases: Option<BasisSide>,
    settings: &Tunable,
    (ends, seen, elsewhere): (Option<Ends>, Option<OutletReader<SurfaceView>>, Vec<Option<ElsewhereHandle>>),
) -> Result<Wired, Error> {
    if !plan.is_multi_rate() {
        let surfaces = surfaces.iter().map(OutletPort::writer).collect();
        return Ok((Models::Whole(simulation, surfaces, settings.reader()), None, Vec::new()));
    }
    let (surroundings, known) = match bases {
        Some(BasisSide { wishes, bases, known, .. }) => (Some((wishes, bases)), known),
        None => Default::default(),
    };
    let maker = ModelMaker::new(plan.template.clone(), plan.kinds.clone(), plan.probes.clone());
    let (first, count) = (maker.clone(), places.len());
    let empty = move || first.first(count);
    // A model that comes later may feed back, if the first one does not.
    let feeds_back = plan.template.feeds_back() || plan.kinds.len() > 1;
    let ticks = ticks_buffered(plan);
    // No patch holds more nodes than the body, and patches grow as the tool leaves a held face.
    let nodes = simulation.state().positions.len();
    let mut linking = match ends {
        Some(ends) => {
            let outer = Outer::new(graph, &ends, plan, settings, &surfaces, seen);
            Some(Linking::new(ends, &simulation, (places, elsewhere), plan.timing.haptic, outer)?)
        }
        None => None,
    };
    let mut connected = |_| match &mut linking {
        Some(linking) => linking.connect(graph, ticks),
        None => {
            let link = ToolLink {
                ticks: graph.queue_port(ticks),
                geometry: feeds_back.then(|| graph.exchange_port(move || PatchGeometry::with_room(nodes))),
            };
            let ports =
                LocalPorts { ticks: link.ticks.writer(), geometry: link.geometry.as_ref().map(ExchangePort::writer) };
            (Some(link), Some(ports))
        }
    };
    let (tools, locals): (Vec<_>, Vec<_>) = places.iter().map(&mut connected).unzip();
    let (next, arrivals) = match &mut linking {
        Some(linking) => linking.connect_models(graph, &maker, count),
        None => {
            let next = graph.exchange_port(empty.clone());
            let arrivals = next.reader();
            (Some(next), Some(arrivals))
        }
    };
    let surroundings = surroundings.map(|(wishes, made)| match &mut linking {
        Some(linking) => (wishes, linking.connect_bases(graph, &made, &known)),
        None => (wishes, made),
    });
    let linked = linking.is_some();
    let settings = linking.as_ref().map_or(settings, Linking::global_settings).clone();
    let maker = next.map(|models| {
        let side = GlobalSide {
            tools: tools.into_iter().flatten().collect(),
            models,
            settings,
            surroundings,
            surfaces,
            checkpoint: graph.outlet_port(Checkpoint::default),
            recorder: graph.recorder_port(ticks),
        };
        let plan = GlobalPlan {
            haptic: plan.timing.haptic,
            global: plan.timing.global,
            horizon: plan.timing.horizon,
            models: maker,
            patch: plan.window(),
            bases: known,
            linked,
        };
        GlobalMaker::new(simulation, places, plan, side)
    });
    let source = arrivals.map(|arrivals| {
        let models = Succession::new([empty(), empty(), empty()], plan.blend);
        (LocalSource { models, arrivals }, locals.into_iter().flatten().collect())
    });
    let models = Models::Local(source);
    let bridges = linking.map(|linking| linking.bridges(graph)).unwrap_or_default();
    Ok((models, maker, bridges))
}
