//! What computes the forces: the whole body, or local models that a global one sends.

use super::basis::BasisSide;
use super::global::{GlobalMaker, GlobalSide, ToolLink};
use crate::actors::{Checkpoint, GlobalPlan, LocalPorts, SurfaceView};
use crate::model::Pose;
use crate::model::local::{Hold, Kind, PatchGeometry, Succession};
use crate::model::simulation::Simulation;
use crate::runtime::{ExchangePort, OutletPort, OutletWriter, RuntimeBuilder};
use crate::session::prepare::ModelPlan;

/// What computes the forces at the haptic rate.
#[expect(clippy::large_enum_variant, reason = "there is one per session, and it goes into an actor")]
pub(super) enum Models {
    /// The whole body with all tools, and where its surface is shown.
    Whole(Simulation, Vec<OutletWriter<SurfaceView>>),
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
    ticks: usize,
) -> (Models, Option<GlobalMaker>) {
    if plan.template.kind == Kind::Full {
        return (Models::Whole(simulation, surfaces.iter().map(OutletPort::writer).collect()), None);
    }
    let (surroundings, known) = match bases {
        Some(BasisSide { wishes, bases, known, .. }) => (Some((wishes, bases)), known),
        None => Default::default(),
    };
    let (template, probes) = (plan.template.clone(), plan.probes.clone());
    let model = move || {
        let mut model = template.empty().unwrap_or_else(|| Box::new(Hold::default()));
        model.watch(&probes);
        model
    };
    let feeds_back = plan.template.feeds_back();
    // No patch holds more nodes than the body, and patches grow as the tool leaves a held face.
    let nodes = simulation.state().positions.len();
    let link = |_| ToolLink {
        ticks: graph.queue_port(ticks),
        geometry: feeds_back.then(|| graph.exchange_port(move || PatchGeometry::with_room(nodes))),
        models: graph.exchange_port(model.clone()),
    };
    let side = GlobalSide {
        tools: places.iter().map(link).collect(),
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
        patch: plan.template.patch,
        bases: known,
    };
    (models, Some(GlobalMaker::new(simulation, places, plan, side)))
}
