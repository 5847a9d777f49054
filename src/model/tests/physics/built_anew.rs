//! A local model that is built anew knows nothing of what it was: which of them is, hangs on the threads, and a replay of a run is
//! to be the same.

use palpate_model::Vec3;
use palpate_model::body::{Block, Body, State};
use palpate_model::contact::{Contact, Law, ToolMotion};
use palpate_model::local::{Kind, LocalModel, ResyncView, Template, ToolForecast};
use palpate_model::mesh::Face;
use palpate_model::simulation::{Simulation, Stepping};
use palpate_model::surroundings::Bases;

const PRESSES: u64 = 60;

/// A tool that was pressed into the top, and where it is.
fn pressed() -> (Simulation, Vec3) {
    let builder = Block::builder([8; 3], [0.07; 3]).stiffness(30.0).node_mass(0.5e-3).damping_ratio(0.3);
    let body = builder.fix(Face::ZMin).build().unwrap();
    let state = State::at_rest(body.rest());
    let law = Law { friction: 0.5.into(), ..Law::default() };
    let stepping = Stepping { tick: 1e-3, substeps: 2 };
    let mut simulation = Simulation::new(Box::new(body), state, Contact::default(), law, stepping).unwrap();
    let at = |tick: u64| Vec3::new(0.033, 0.0362, 0.0705 - 1e-4 * tick as f64);
    for tick in 0..PRESSES {
        simulation.tick(ToolMotion::straight(at(tick), at(tick + 1)));
    }
    assert!(simulation.contact(0).is_touching());
    (simulation, at(PRESSES))
}

fn build(model: &mut dyn LocalModel, simulation: &mut Simulation, tool: Vec3) {
    let triangle = simulation.contact(0).triangle.unwrap();
    model.rebuild(ResyncView {
        global: simulation,
        tick: PRESSES,
        triangles: &[triangle],
        nearest: &[],
        patch: None,
        tools: &[ToolForecast::at_rest(tool)],
        index: 0,
        horizon: 5,
        bases: &Bases::default(),
    });
}

/// The forces of a drag by `way` (m) in each tick, far out of the patch.
fn drag(model: &mut dyn LocalModel, from: Vec3, way: Vec3) -> Vec<[u64; 3]> {
    let at = |tick: u32| from + way * f64::from(tick);
    let force = |tick| model.tick(&[ToolMotion::straight(at(tick), at(tick + 1))]).force;
    (0..60).map(force).map(|force| [force.x, force.y, force.z].map(f64::to_bits)).collect()
}

#[test]
fn a_model_that_is_built_anew_is_as_a_new_one() {
    for kind in [Kind::Hold, Kind::Patch, Kind::LinearBoundary, Kind::ScaledBoundary, Kind::Predictive] {
        let (mut simulation, tool) = pressed();
        let template = Template::new(kind, [3, 3, 2], simulation.body()).unwrap();
        let mut new = template.empty();
        build(&mut *new, &mut simulation, tool);
        let expected = drag(&mut *new, tool, Vec3::new(4e-4, 0.0, 0.0));

        let mut used = template.empty();
        build(&mut *used, &mut simulation, tool);
        drag(&mut *used, tool, Vec3::new(-2e-4, 3e-4, -5e-5));
        build(&mut *used, &mut simulation, tool);
        assert_eq!(drag(&mut *used, tool, Vec3::new(4e-4, 0.0, 0.0)), expected, "{kind:?}");
    }
}
