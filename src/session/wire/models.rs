//! Where the local models come from: one model of the whole body, or new ones from a global model.

use super::basis::BasisSide;
use super::global::{GlobalMaker, GlobalSide, ToolLink};
use crate::actors::{Checkpoint, GlobalPlan, ModelSource, SurfaceView};
use crate::model::Pose;
use crate::model::local::{Full, Hold, LocalModel, PatchGeometry};
use crate::model::simulation::Simulation;
use crate::runtime::{ExchangePort, OutletPort, RuntimeBuilder};
use crate::session::prepare::ModelPlan;

/// What a local actor begins with, and where its next models come from.
pub(super) struct Source {
    pub(super) models: [Box<dyn LocalModel>; 3],
    pub(super) source: ModelSource,
}

/// The source of each tool's models; and what makes the global actor, unless the local model is the whole body.
pub(super) fn models(
    graph: &mut RuntimeBuilder,
    plan: &ModelPlan,
    simulation: Simulation,
    places: &[Pose],
    surfaces: Vec<OutletPort<SurfaceView>>,
    bases: Option<BasisSide>,
    ticks: usize,
) -> (Vec<Source>, Option<GlobalMaker>) {
    let spare = || Box::new(Hold::default()) as Box<dyn LocalModel>;
    if plan.template.empty().is_none() {
        let full = watching(Box::new(Full::new(simulation)), &plan.probes);
        let source = ModelSource::Alone(surfaces.iter().map(OutletPort::writer).collect());
        return (vec![Source { models: [full, spare(), spare()], source }], None);
    }
    let (surroundings, known) = match bases {
        Some(BasisSide { wishes, bases, known, .. }) => (Some((wishes, bases)), known),
        None => Default::default(),
    };
    let (template, probes) = (plan.template.clone(), plan.probes.clone());
    let model = move || watching(template.empty().unwrap_or_else(spare), &probes);
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
    let source = |link: &ToolLink| ModelSource::Global {
        models: link.models.reader(),
        ticks: link.ticks.writer(),
        geometry: link.geometry.as_ref().map(ExchangePort::writer),
    };
    let begin = |link: &ToolLink| Source { source: source(link), models: [model(), model(), model()] };
    let sources = side.tools.iter().map(begin).collect();
    let plan = GlobalPlan {
        haptic: plan.timing.haptic,
        global: plan.timing.global,
        horizon: plan.timing.horizon,
        patch: plan.template.patch,
        bases: known,
    };
    (sources, Some(GlobalMaker::new(simulation, places, plan, side)))
}

fn watching(mut model: Box<dyn LocalModel>, probes: &[u32]) -> Box<dyn LocalModel> {
    model.watch(probes);
    model
}
