//! Tools that leave the window of their local model before the next one comes.

use crate::tool_support::resting;
use palpate_model::body::Block;
use palpate_model::contact::{ToolMotion, ToolShape};
use palpate_model::local::{Kind, LocalModel, ResyncView, Template, ToolForecast};
use palpate_model::mesh::Face;
use palpate_model::simulation::Simulation;
use palpate_model::surroundings::Bases;
use palpate_model::{Pose, Vec3};

const SIDE: f64 = 0.048;
const THICK: f64 = 0.012;

/// A tool of that shape that has been pressed for a second into a block of `cells` along its edges, and where its centre is.
fn pressed(cells: usize, shape: ToolShape, [depth, reach]: [f64; 2]) -> (Simulation, Vec3) {
    let spacing = SIDE / cells as f64;
    let layers = (THICK / spacing).round() as usize + 1;
    let builder = Block::builder([cells + 1, cells + 1, layers], [SIDE, SIDE, THICK]).stiffness(50.0).node_mass(1e-4);
    let mut simulation = resting(Box::new(builder.damping_ratio(0.5).fix(Face::ZMin).build().unwrap()), shape);
    let at = |k: i32| Vec3::new(0.015, 0.5 * SIDE + 4e-4, THICK + reach - depth * (f64::from(k) / 200.0).min(1.0));
    for k in 0..400 {
        simulation.tick(ToolMotion::straight(at(k), at(k + 1)));
    }
    (simulation, at(400))
}

/// What tool 0 will be served by for a while, with a patch of six nodes by six.
fn served(simulation: &mut Simulation, at: Vec3) -> Box<dyn LocalModel> {
    let mut triangles = vec![simulation.contact(0).triangle.expect("it touches")];
    simulation.footprint(0, &Pose::at(at), 0.0, &mut triangles);
    let mut model = Template::new(Kind::Predicted, [6, 6, 3], simulation.body()).unwrap().empty();
    model.rebuild(ResyncView {
        global: simulation,
        tick: 400,
        triangles: &triangles,
        nearest: &[],
        patch: None,
        tools: &[ToolForecast::at_rest(at)],
        index: 0,
        horizon: 67,
        bases: &Bases::default(),
    });
    model
}

/// Check that a sphere which meets fine elements at their corners, and goes where its window ends, is told to have left it while it is still
/// pressed as before: corners that the window does not move do not press, and it would have felt less and less of what is there.
#[test]
fn a_sphere_on_fine_elements_that_leaves_its_window_is_not_let_go() {
    let shape = ToolShape::Sphere { radius: 0.012 };
    let (mut simulation, at) = pressed(24, shape, [2e-3, 0.012]);
    assert!(simulation.contact_points(0).len() > 8, "elements are fine");
    let mut model = served(&mut simulation, at);
    let way = |k: i32| at + Vec3::x() * 4e-4 * f64::from(k);
    let forces: Vec<f64> = (0..60).map(|k| model.tick(&[ToolMotion::straight(way(k), way(k + 1))]).force.z).collect();
    println!("{forces:.3?}");
    assert_eq!(model.serves_as(0), Kind::Hold);
    let peak = forces.iter().copied().fold(0.0, f64::max);
    assert!(forces[59] > 0.9 * peak, "{} N of {peak}", forces[59]);
}

/// Check that an upright capsule that has left its window feels nothing once it is lifted.
#[test]
fn an_upright_capsule_that_left_its_window_is_let_go_when_it_is_lifted() {
    let half_axis = Vec3::new(2e-3, 0.0, 0.02);
    let shape = ToolShape::Capsule { radius: 3e-3, half_axis };
    let (mut simulation, at) = pressed(12, shape, [2e-3, 0.023]);
    let mut model = served(&mut simulation, at);
    let way = |k: i32| at + Vec3::x() * 4e-4 * f64::from(k.min(60)) + Vec3::z() * 2e-4 * f64::from((k - 60).max(0));
    let forces: Vec<f64> = (0..90).map(|k| model.tick(&[ToolMotion::straight(way(k), way(k + 1))]).force.z).collect();
    println!("{forces:.3?}");
    assert_eq!(model.serves_as(0), Kind::Hold);
    assert!(forces[59] > 0.3 * forces[0], "pressed as before");
    assert!(forces[85..].iter().all(|&force| force == 0.0), "lifted by 4 mm: {:?}", &forces[60..]);
}
