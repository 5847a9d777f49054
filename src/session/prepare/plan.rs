//! How local models are made, followed by one another and watched, and what may be changed of them while a session runs.

use std::path::PathBuf;
use std::sync::Arc;

use super::body::Start;
use super::situation::Situation;
use super::timing::Timing;
use crate::actors::{Settings, Tunable};
use crate::link::Conditions;
use crate::model::body::Stiffness;
use crate::model::contact::Equations;
use crate::model::local::{Blend, Kind, Template};
use crate::model::surroundings::RestingBody;
use crate::runtime::RuntimeBuilder;
use crate::scene::Scene;

/// How local models are made, followed by one another and watched.
#[derive(Debug)]
pub(crate) struct ModelPlan {
    pub(crate) template: Template,
    /// The kinds that the local models may be, with the patch of each; the first is that of the start.
    pub(crate) kinds: Vec<(Kind, [usize; 3])>,
    /// The body around its rest state, if one of them takes reduced surroundings.
    pub(crate) resting: Option<Arc<RestingBody>>,
    pub(crate) timing: Timing,
    pub(crate) blend: Blend,
    /// A basis takes its time here: they are made one by one.
    pub(crate) in_real_time: bool,
    /// Logged nodes.
    pub(crate) probes: Vec<u32>,
    /// What is between local and global model, if they are to be taken for two computers.
    pub(crate) link: Option<Conditions>,
    /// Where reduced surroundings are kept from run to run.
    pub(crate) basis_folder: Option<PathBuf>,
    /// What may be changed while it runs, as it is at the start.
    pub(crate) settings: Settings,
    /// The stiffest body that the explicit steps bear.
    pub(crate) stiffest: Stiffness,
    pub(crate) equations: Equations,
}

impl ModelPlan {
    /// True if there is a global model beside the local ones: always, but for `full` that stays what it is.
    pub(crate) fn is_multi_rate(&self) -> bool {
        self.template.kind != Kind::Full || self.kinds.len() > 1
    }

    /// What may be changed, with the end of an actor of `graph` that takes it.
    pub(crate) fn tunable(&self, graph: &mut RuntimeBuilder) -> Tunable {
        Tunable::new(graph.parameter(self.settings), self.stiffest, self.equations)
    }

    /// Of the windows that may have a basis: patch nodes along the surface, along it, into depth.
    pub(crate) fn window(&self) -> [usize; 3] {
        let of = |(kind, patch): &(Kind, [usize; 3])| (*kind == Kind::Predictive).then_some(*patch);
        self.kinds.iter().find_map(of).unwrap_or(self.template.patch)
    }
}

/// The kinds that the local models of `scene`, which names its own, may be: that one, and in a switchable session the others that body
/// and rates allow. A replay has them all: what a tick of `full` took is known where the run was.
pub(super) fn kinds(
    scene: &Scene,
    first: Kind,
    is_replay: bool,
    situation: impl FnOnce() -> Situation,
) -> Vec<(Kind, [usize; 3])> {
    let mut kinds = vec![(first, scene.patch_size())];
    // Over a link both sides make their models of one kind.
    if !scene.run.switchable || scene.link.is_some() {
        return kinds;
    }
    let situation = situation();
    for kind in situation.possible.iter().copied().filter(|kind| *kind != first) {
        let fits = kind != Kind::Full || is_replay || situation.tight_share().is_some();
        if fits {
            kinds.push((kind, scene.clone().with_model(kind).patch_size()));
        }
    }
    kinds
}

/// The body around its rest state, if one of `kinds` takes reduced surroundings.
pub(super) fn resting(
    scene: &Scene,
    template: &Template,
    kinds: &[(Kind, [usize; 3])],
    start: &Start,
) -> Option<Arc<RestingBody>> {
    let reduces = kinds.iter().any(|(kind, _)| *kind == Kind::Predictive);
    if !reduces || scene.local.basis_states() == 0 {
        return None;
    }
    template.resting.clone().or_else(|| RestingBody::new(&*start.body).map(Arc::new))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::model::body::{Block, Body, State};
    use crate::model::mesh::Face;
    use crate::runtime::{Execution, Rate};

    #[test]
    fn a_replay_can_be_switched_to_full_whatever_its_tick_would_take_here() {
        let mut scene = Scene::of_program().with_model(Kind::Hold);
        scene.run.switchable = true;
        let timing = Timing { haptic: Rate::hz(1000), global: Rate::hz(40), substeps: 10_000, stride: 1, horizon: 32 };
        let situation = || {
            let mut body = Block::builder([4; 3], [0.03; 3]).fix(Face::ZMin).build().unwrap();
            let state = State::at_rest(body.rest());
            Situation::of(&scene, &mut body, &state, timing, Execution::Virtual)
        };
        let [run, replay] = [false, true].map(|is_replay| kinds(&scene, Kind::Hold, is_replay, situation));
        assert!(run.iter().all(|(kind, _)| *kind != Kind::Full) && run.len() > 1, "{run:?}");
        assert!(replay.iter().any(|(kind, _)| *kind == Kind::Full), "{replay:?}");
    }
}
