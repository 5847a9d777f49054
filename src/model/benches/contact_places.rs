//! What a 1 kHz tick of `predictive` costs by the number of places at which a tool touches: spheres of growing radius on the 12^3
//! body, two substeps, windows of 6 x 6 x 3 nodes, 250 states, a small circle. Each row is of 4,000 ticks after 400 that warm up.
//!
//! `cargo bench -p palpate-model --bench contact_places`

use std::sync::Arc;
use std::time::Instant;

use palpate_model::body::{Block, Body, State};
use palpate_model::contact::{Contact, Law, ToolMotion, ToolShape};
use palpate_model::local::{Kind, ResyncView, Template, ToolForecast};
use palpate_model::mesh::Face;
use palpate_model::simulation::{Simulation, Stepping};
use palpate_model::surroundings::{Bases, Basis, RestingBody};
use palpate_model::{Pose, Vec3};

const TICKS: usize = 4_000;
const WARM_UP: usize = 400;
const STATES: usize = 250;
/// Radii and depths (mm).
const TOOLS: [[f64; 2]; 9] =
    [[4.0, 1.0], [8.0, 3.0], [20.0, 3.0], [36.0, 3.0], [40.0, 4.0], [60.0, 5.0], [80.0, 5.0], [80.0, 7.0], [80.0, 9.0]];

fn main() {
    println!("| radius, depth (mm) | places | patch nodes | p50 (us) | p99 (us) |");
    println!("| --- | ---: | ---: | ---: | ---: |");
    TOOLS.into_iter().for_each(row);
}

/// A sphere that was pressed into the middle of the top in half a second, where it is, and the triangles beneath.
fn pressed([radius, depth]: [f64; 2]) -> (Simulation, Vec3, Vec<u32>) {
    let builder = Block::builder([12; 3], [0.1; 3]).stiffness(30.0).node_mass(0.5e-3).damping_ratio(0.3);
    let body = builder.fix(Face::ZMin).build().expect("a valid block");
    let state = State::at_rest(body.rest());
    let law = Law { friction: 0.5.into(), ..Law::default() };
    let stepping = Stepping { tick: 1e-3, substeps: 2 };
    let sim = Simulation::new(Box::new(body), state, Contact::default(), law, stepping).expect("it fits");
    let mut sim = sim.with_shape(0, ToolShape::Sphere { radius });
    let at = |k: i32| Vec3::new(0.047, 0.0512, 0.1 + radius - depth * f64::from(k) / 500.0);
    for k in 0..500 {
        sim.tick(ToolMotion::straight(at(k), at(k + 1)));
    }
    let mut triangles = vec![sim.contact(0).triangle.expect("the tool touches")];
    sim.footprint(0, &Pose::at(at(500)), 0.0, &mut triangles);
    (sim, at(500), triangles)
}

fn row([radius, depth]: [f64; 2]) {
    let (mut sim, tool, triangles) = pressed([radius * 1e-3, depth * 1e-3]);
    let size = [6, 6, 3];
    let mut patch = Vec::new();
    sim.patch(0, &triangles, size, &mut patch);
    let resting = RestingBody::new(sim.body()).expect("a body that can be taken apart");
    let mut bases = Bases::default();
    let basis = Basis::compute(&resting, &patch, STATES).expect("held").expect("there are surroundings");
    bases.insert(Arc::new(basis));
    let mut model = Template::new(Kind::Predictive, size, sim.body()).expect("it fits").empty();
    model.rebuild(ResyncView {
        global: &mut sim,
        tick: 500,
        triangles: &triangles,
        nearest: &[],
        patch: Some(&patch),
        tools: &[ToolForecast::at_rest(tool)],
        index: 0,
        horizon: 67,
        bases: &bases,
    });
    let circle = |k: usize| {
        let angle = k as f64 * 0.01;
        tool + Vec3::new(angle.cos() - 1.0, angle.sin(), 0.0) * 0.5e-3
    };
    let (mut times, mut places) = (Vec::with_capacity(TICKS), 0);
    for k in 0..WARM_UP + TICKS {
        let start = Instant::now();
        std::hint::black_box(model.tick(&[ToolMotion::straight(circle(k), circle(k + 1))]));
        times.push(start.elapsed().as_secs_f64() * 1e6);
        places += if k < WARM_UP { 0 } else { model.contact_points(0).len() };
    }
    assert_eq!(model.serves_as(0), Kind::Predictive, "the contact is inside the patch");
    let times = &mut times[WARM_UP..];
    times.sort_by(f64::total_cmp);
    let share = |percent: usize| times[TICKS * percent / 100];
    let places = places as f64 / TICKS as f64;
    println!("| {radius}, {depth} | {places:.1} | {} | {:.1} | {:.1} |", patch.len(), share(50), share(99));
}
