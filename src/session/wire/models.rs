//! What computes the forces: the whole body, or local models that a global one sends.

use super::basis::BasisSide;
use super::buffers::ticks_buffered;
use super::global::{GlobalMaker, GlobalSide, ToolLink};
use super::link::{Ends, Linking};
use crate::actors::{Checkpoint, GlobalPlan, LocalPorts, ModelMaker, Settings, SurfaceView};
use crate::error::Error;
use crate::model::Pose;
use crate::model::local::{PatchGeometry, Succession};
use crate::model::simulation::Simulation;
use crate::runtime::{Actor, ExchangePort, OutletPort, OutletWriter, Parameter, ParameterReader, RuntimeBuilder};
use crate::session::prepare::ModelPlan;

/// What computes the forces at the haptic rate.
#[expect(clippy::large_enum_variant, reason = "there is one per session, and it goes into an actor")]
pub(super) enum Models {
    /// The whole body with all tools, where its surface is shown, and what is changed while it runs.
    Whole(Simulation, Vec<OutletWriter<SurfaceView>>, ParameterReader<Settings>),
    /// The models of each tool, and where the next ones come from; none where the devices are elsewhere.
    Local(Vec<(Succession, LocalPorts)>),
}

/// What computes the forces; what makes the global actor, unless that is the whole body or elsewhere; and the bridges between the two,
/// if there are any.
pub(super) type Wired = (Models, Option<GlobalMaker>, Vec<Box<dyn Actor>>);

/// Wires what computes the forces, with a link between `ends` if there is one.
///
/// # Errors
/// If there is a link and the body cannot be copied.
pub(super) fn models(
    graph: &mut RuntimeBuilder,
    plan: &ModelPlan,
    (simulation, places): (Simulation, &[Pose]),
    surfaces: Vec<OutletPort<SurfaceView>>,
    bases: Option<BasisSide>,
    settings: Parameter<Settings>,
    ends: Option<Ends>,
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
    let first = maker.clone();
    let model = move || first.first();
    // A model that comes later may feed back, if the first one does not.
    let feeds_back = plan.template.feeds_back() || plan.kinds.len() > 1;
    let ticks = ticks_buffered(plan);
    // No patch holds more nodes than the body, and patches grow as the tool leaves a held face.
    let nodes = simulation.state().positions.len();
    let has_global = !matches!(ends, Some(Ends::Haptic(_)));
    let mut linking = ends.map(|ends| Linking::new(ends, &simulation)).transpose()?;
    let mut connected = |_| match &mut linking {
        Some(linking) => linking.connect(graph, &maker, ticks),
        None => {
            let link = ToolLink {
                ticks: graph.queue_port(ticks),
                geometry: feeds_back.then(|| graph.exchange_port(move || PatchGeometry::with_room(nodes))),
                models: graph.exchange_port(model.clone()),
            };
            let ports = LocalPorts {
                models: link.models.reader(),
                ticks: link.ticks.writer(),
                geometry: link.geometry.as_ref().map(ExchangePort::writer),
            };
            (Some(link), Some(ports))
        }
    };
    let (tools, locals): (Vec<_>, Vec<_>) = places.iter().map(&mut connected).unzip();
    let linked = linking.is_some();
    let maker = has_global.then(|| {
        let side = GlobalSide {
            tools: tools.into_iter().flatten().collect(),
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
    let of_tool = |ports| (Succession::new([model(), model(), model()], plan.blend), ports);
    let models = Models::Local(locals.into_iter().flatten().map(of_tool).collect());
    let bridges = linking.map(|linking| linking.bridges(graph)).unwrap_or_default();
    Ok((models, maker, bridges))
}
