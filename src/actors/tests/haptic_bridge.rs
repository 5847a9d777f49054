//! The bridge beside the local actors driven by hand: which models it begins with.

use super::*;
use crate::link::{Conditions, Header, VirtualLink};
use crate::model::body::{Block, Body, State};
use crate::model::contact::{Contact, Law, ToolMotion};
use crate::model::local::{Kind, ResyncView, Template, ToolForecast};
use crate::model::mesh::Face;
use crate::model::simulation::{Simulation, Stepping};
use crate::runtime::{Execution, Runtime};

/// A body that a tool presses by so many steps, and where the tool is.
fn pressed(ticks: u32) -> (Simulation, Vec3) {
    let block = Block::builder([4; 3], [0.06; 3]).stiffness(30.0).node_mass(0.5e-3).fix(Face::ZMin).build().unwrap();
    let state = State::at_rest(block.rest());
    let stepping = Stepping { tick: 1e-3, substeps: 2 };
    let mut simulation = Simulation::new(Box::new(block), state, Contact::default(), Law::default(), stepping).unwrap();
    let at = |tick: u32| Vec3::new(0.031, 0.033, 0.0605 - 1e-4 * f64::from(tick));
    (0..ticks).for_each(|tick| simulation.tick_all(&[ToolMotion::straight(at(tick), at(tick + 1))]));
    (simulation, at(ticks))
}

/// What `hold` is built from after so many steps, counted as tick 0; and the force that it holds.
fn shipment(template: &Template, ticks: u32) -> (Shipment, Vec3) {
    let (mut simulation, tool) = pressed(ticks);
    let mut models = LocalModels::new(1, || template.departing());
    let triangles = &[simulation.contact(0).triangle.unwrap()];
    models.rebuild(ResyncView {
        global: &mut simulation,
        tick: 0,
        triangles,
        nearest: triangles,
        patch: None,
        tools: &[ToolForecast::at_rest(tool)],
        index: 0,
        horizon: 0,
        bases: &Bases::default(),
    });
    (Shipment::of(&models), simulation.wrench(0).force)
}

/// Check that of models that waited for the session to begin, all of them of its tick 0, the last is taken: another machine's tool has
/// pressed the body meanwhile.
#[test]
fn it_begins_with_the_last_of_the_models_that_came_before() {
    let mut graph = Runtime::builder(Execution::Virtual);
    let template = Template::new(Kind::Hold, [2; 3], pressed(0).0.body()).unwrap();
    let [(early, _), (late, force)] = [20, 40].map(|ticks| shipment(&template, ticks));
    let [mut there, here] = VirtualLink::ends(Conditions::default());
    for (number, shipment) in (1..).zip([early, late]) {
        let mut bytes = Vec::new();
        Message::Models(shipment).write(Header { epoch: 1, number, sent: Nanos::ZERO }, &mut bytes);
        there.send(Lane::Models, &bytes, Nanos::ZERO);
    }
    let (models, mut published) = graph.exchange(move || LocalModels::new(1, || template.empty()));
    let first = Settings { friction: 0.5.into(), stiffness: Stiffness::default(), model: Kind::Hold };
    let ports = HapticBridgePorts {
        tools: vec![(graph.queue(8).1, None)],
        haptic: Rate::hz(1000),
        models,
        settings: graph.parameter(first).reader(),
        surfaces: Vec::new(),
        recorder: graph.recorder(8),
    };
    let mut bridge = HapticBridge::new(Box::new(here), Image::new(pressed(0).0), ports);
    let ctx = TickContext::by_hand(Rate::hz(1000), 0);
    bridge.start(&ctx).unwrap();
    assert!(published.refresh(&ctx) && force.norm() > 0.01);
    assert_eq!(published.get().wrench(0).force, force);
}
