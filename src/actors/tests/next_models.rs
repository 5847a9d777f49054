//! Which tools share a local model.

use std::sync::Arc;

use super::*;
use crate::actors::global_ports::ToolPorts;
use crate::actors::messages::ToolTick;
use crate::model::body::{Block, Body, State};
use crate::model::contact::{Contact, Law};
use crate::model::local::{Template, ToolHistory, Windows};
use crate::model::mesh::Face;
use crate::model::simulation::Stepping;
use crate::model::surroundings::{Basis, RestingBody};
use crate::model::{Pose, Vec3};
use crate::runtime::{Execution, Runtime};

const PATCH: [usize; 3] = [4, 4, 2];

/// A slab of 18 x 18 x 4 nodes, 1 cm apart, with a tool over each of `places` (m) on its top.
fn scene<const TOOLS: usize>(places: [[f64; 2]; TOOLS]) -> (Simulation, Vec<ToolSide>) {
    let block = Block::builder([18, 18, 4], [0.17, 0.17, 0.03]).node_mass(0.5e-3).stiffness(30.0).damping_ratio(0.3);
    let (body, stepping) = (block.fix(Face::ZMin).build().unwrap(), Stepping { tick: 1e-3, substeps: 2 });
    let state = State::at_rest(body.rest());
    let first = Simulation::new(Box::new(body), state, Contact::default(), Law::default(), stepping).unwrap();
    let simulation = (1..TOOLS).fold(first, |simulation, _| simulation.with_tool(Contact::default()));
    let mut graph = Runtime::builder(Execution::Virtual);
    let side = |(index, [x, y]): (usize, [f64; 2])| {
        let pose = Pose::at(Vec3::new(x, y, 0.03));
        let (_, ticks) = graph.queue(1);
        let windows = Windows::new(&simulation, index, PATCH);
        let history = ToolHistory::new(pose, 1e-3, 33e-3);
        ToolSide::new(ToolTick { pose, ..ToolTick::default() }, windows, history, ToolPorts { ticks, geometry: None })
    };
    let sides = places.into_iter().enumerate().map(side).collect();
    (simulation, sides)
}

/// The tool around which the model is built that serves each tool; with the bases of all windows there are, or of none.
fn hosts<const TOOLS: usize>(kind: Kind, places: [[f64; 2]; TOOLS], has_all: bool) -> Vec<usize> {
    let (mut simulation, mut sides) = scene(places);
    let template = Template::new(kind, PATCH, simulation.body()).unwrap();
    let mut models = LocalModels::new(TOOLS, || template.empty());
    let mut next = NextModels::new(&simulation).unwrap();
    next.aim((&simulation, &mut sides), 33e-3);
    next.look_beside((&simulation, &mut sides));
    let (mut wishes, mut bases) = (Wishes::default(), Bases::default());
    next.wish((&simulation, &sides), [33e-3, 33e-3], &bases, &mut wishes);
    assert!(!wishes.patches.is_empty());
    let resting = RestingBody::new(simulation.body()).unwrap();
    for patch in wishes.patches.iter().filter(|_| has_all) {
        bases.insert(Arc::new(Basis::compute(&resting, patch, 12).unwrap().unwrap()));
    }
    let chosen = (kind == Kind::Predictive).then_some(&bases);
    next.choose((&simulation, &mut sides), kind, chosen);
    next.build((&mut simulation, &sides), (33, &bases, chosen.is_some()), &mut models);
    for (tool, side) in sides.iter().enumerate() {
        let model = models.of(tool);
        assert!(model.wrench(tool).is_some(), "tool {tool} is resolved where it is served");
        let is_held = |node: u32| model.position(node).is_some();
        let corners = simulation.body().surface().triangles[side.triangles[0] as usize];
        assert!(!kind.has_patch() || corners.into_iter().all(is_held), "and its place is there");
    }
    models.hosts().to_vec()
}

#[test]
fn tools_share_a_model_where_one_window_holds_their_places() {
    let near = [[0.146, 0.147], [0.158, 0.152]];
    let far = [[0.012, 0.013], [0.158, 0.159]];
    assert_eq!(hosts(Kind::Predictive, near, true), [0, 0]);
    assert_eq!(hosts(Kind::Predictive, far, true), [0, 1]);
    // Two of three, whichever is first.
    assert_eq!(hosts(Kind::Predictive, [near[0], far[0], near[1]], true), [0, 1, 0]);
    assert_eq!(hosts(Kind::Predictive, [far[0], near[0], near[1]], true), [0, 1, 1]);
}

#[test]
fn models_without_a_patch_serve_all_and_those_with_a_patch_of_their_own_one() {
    let far = [[0.012, 0.013], [0.158, 0.159]];
    for kind in Kind::ALL {
        let near = [[0.146, 0.147], [0.158, 0.152]];
        let expected = if kind.has_patch() { [0, 1] } else { [0, 0] };
        if kind != Kind::Predictive {
            assert_eq!(hosts(kind, far, false), expected, "{kind:?}");
            assert_eq!(hosts(kind, near, false), expected, "{kind:?}");
        }
    }
}
