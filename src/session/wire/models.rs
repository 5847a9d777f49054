//! What computes the forces: the whole body, or local models that a global one sends.

use super::basis::BasisSide;
use super::buffers::ticks_buffered;
use super::global::{GlobalMaker, GlobalSide, ToolLink};
use crate::actors::{Checkpoint, GlobalPlan, LocalPorts, ModelMaker, Settings, SurfaceView};
use crate::model::Pose;
use crate::model::local::{PatchGeometry, Succession};
use crate::model::simulation::Simulation;
use crate::runtime::{ExchangePort, OutletPort, OutletWriter, Parameter, ParameterReader, RuntimeBuilder};
use crate::session::prepare::ModelPlan;

/// What computes the forces at the haptic rate.
#[expect(clippy::large_enum_variant, reason = "there is one per session, and it goes into an actor")]
pub(super) enum Models {
    /// The whole body with all tools, where its surface is shown, and what is changed while it runs.
    Whole(Simulation, Vec<OutletWriter<SurfaceView>>, ParameterReader<Settings>),
    /// The models of each tool, and where the next ones come from.
    Local(Vec<(Succession, LocalPorts)>),
}

/// What computes the forces; and what makes the global actor, unless that is the whole body.
pub(super) fn models(
    graph: &mut RuntimeBuilder,
    plan: &ModelPlan,
    simulation: Simulation,
    places: &[Pose],
    surfaces: Vec<OutletPort<SurfaceView>>,
    bases: Option<BasisSide>,
    settings: Parameter<Settings>,
) -> (Models, Option<GlobalMaker>) {
    if !plan.is_multi_rate() {
        let surfaces = surfaces.iter().map(OutletPort::writer).collect();
        return (Models::Whole(simulation, surfaces, settings.reader()), None);
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
    let link = |_| ToolLink {
        ticks: graph.queue_port(ticks),
        geometry: feeds_back.then(|| graph.exchange_port(move || PatchGeometry::with_room(nodes))),
        models: graph.exchange_port(model.clone()),
    };
    let side = GlobalSide {
        tools: places.iter().map(link).collect(),
        settings,
        surroundings,
        surfaces,
        checkpoint: graph.outlet_port(Checkpoint::default),
        recorder: graph.recorder_port(ticks),
    };
    let of_tool = |link: &ToolLink| {
        let ports = LocalPorts {
            models: link.models.reader(),
            ticks: link.ticks.writer(),
            geometry: link.geometry.as_ref().map(ExchangePort::writer),
        };
        (Succession::new([model(), model(), model()], plan.blend, Pose::default()), ports)
    };
    let models = Models::Local(side.tools.iter().map(of_tool).collect());
    let plan = GlobalPlan {
        haptic: plan.timing.haptic,
        global: plan.timing.global,
        horizon: plan.timing.horizon,
        models: maker,
        patch: plan.window(),
        bases: known,
    };
    (models, Some(GlobalMaker::new(simulation, places, plan, side)))
}
