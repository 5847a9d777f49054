//! What the local model and the whole body cost: one 1 kHz tick of `patch` with contact, building it on bodies of three
//! sizes (the paper's O(1) claim), and one tick of the whole 12^3 body.
//!
//! Contestants take turns; each figure is the least of many rounds. `cargo bench --bench local_model`

mod common;

use std::hint::black_box;
use std::sync::Arc;

use palpate_model::Vec3;
use palpate_model::body::{Block, Body, State};
use palpate_model::contact::{Contact, Law, ToolMotion};
use palpate_model::local::{Kind, LocalModel, ResyncView, Template, ToolForecast};
use palpate_model::mesh::Face;
use palpate_model::simulation::{Simulation, Stepping};
use palpate_model::surroundings::{Bases, Condensation, RestingBody};

use common::{Contestant, least};

/// The reference material, two substeps per tick, a tool pressed 5 mm into the top.
fn pressed(nodes: usize) -> (Simulation, Vec3) {
    let builder = Block::builder([nodes; 3], [0.1; 3]).stiffness(30.0).node_mass(0.5e-3).damping_ratio(0.3);
    let body = builder.fix(Face::ZMin).build().expect("a valid block");
    let state = State::at_rest(body.rest());
    let law = Law { friction: 0.5.into(), ..Law::default() };
    let stepping = Stepping { tick: 1e-3, substeps: 2 };
    let mut sim = Simulation::new(Box::new(body), state, Contact::default(), law, stepping).expect("it fits");
    let at = |k: i32| Vec3::new(0.047, 0.0512, 0.101 - 0.006 * f64::from(k) / 100.0);
    for k in 0..100 {
        sim.tick(ToolMotion::straight(at(k), at(k + 1)));
    }
    assert!(sim.contact(0).is_touching());
    (sim, at(100))
}

fn rebuild(patch: &mut dyn LocalModel, sim: &mut Simulation) {
    let triangle = sim.contact(0).triangle.expect("the tool touches");
    patch.rebuild(ResyncView {
        global: sim,
        tick: 100,
        triangles: &[triangle],
        nearest: &[],
        patch: None,
        tools: &[ToolForecast::default()],
        index: 0,
        horizon: 0,
        bases: &Bases::default(),
    });
}

/// A local model, what it was built from, and where the tool is.
fn built(nodes: usize, kind: Kind, is_implicit: bool) -> (Box<dyn LocalModel>, Simulation, Vec3) {
    let (mut sim, tool) = pressed(nodes);
    let template = Template::new(kind, [4, 4, 2], sim.body()).expect("a held body of resting");
    let mut patch = if is_implicit { template.with_implicit_steps() } else { template }.empty();
    rebuild(&mut *patch, &mut sim);
    (patch, sim, tool)
}

fn patch_tick(steps: &str, is_implicit: bool) -> Contestant {
    let ((mut patch, _, tool), mut k) = (built(12, Kind::Patch, is_implicit), 0);
    let circle = move |k: usize| {
        let angle = k as f64 * 0.01;
        tool + Vec3::new(angle.cos() - 1.0, angle.sin(), 0.0) * 1e-3
    };
    let tick = move || {
        k += 1;
        black_box(patch.tick(&[ToolMotion::straight(circle(k - 1), circle(k))]));
        assert!(patch.contact(0).is_touching(), "the tick measured has a contact in it");
    };
    (format!("one 1 kHz tick with contact, {steps}"), Box::new(tick))
}

fn patch_build(what: &str, nodes: usize, kind: Kind, is_implicit: bool) -> Contestant {
    let (mut patch, mut sim, _) = built(nodes, kind, is_implicit);
    (format!("build at a resync, {what}"), Box::new(move || rebuild(&mut *patch, &mut sim)))
}

/// What `condensed` costs besides: once for the body, and once for each window that the tool comes to.
fn condense() -> [Contestant; 2] {
    let (sim, _) = pressed(12);
    let resting = Arc::new(RestingBody::new(sim.body()).expect("a body that can be taken apart"));
    let body = Condensation::new(resting.clone()).expect("held");
    let mut nodes = Vec::new();
    sim.body().patch(&[sim.contact(0).triangle.expect("the tool touches")], [4, 4, 2], &mut nodes);
    let factorise = move || drop(black_box(Condensation::new(resting.clone())));
    let window = move || drop(black_box(body.compliance(&nodes)));
    [("factorise the body".into(), Box::new(factorise)), ("a new window".into(), Box::new(window))]
}

fn whole_body() -> [Contestant; 2] {
    let (mut sim, tool) = pressed(12);
    let mut block = Block::builder([12; 3], [0.1; 3]).fix(Face::ZMin).build().expect("a valid block");
    let tick = move || {
        black_box(sim.tick(ToolMotion::straight(tool, tool)));
    };
    let spectrum = move || {
        black_box(Stepping::stable_substeps(&mut block, 1e-3));
    };
    [
        ("one tick with contact, 2 substeps".into(), Box::new(tick)),
        ("largest eigenvalues and substeps".into(), Box::new(spectrum)),
    ]
}

fn print(of: &str, mut contestants: Vec<Contestant>, rounds: usize, calls: usize) {
    let times = least(&mut contestants, rounds, calls);
    for ((name, _), time) in contestants.iter().zip(times) {
        println!("| {of} | {name} | {:.1} |", time * 1e6);
    }
}

fn main() {
    println!("| of | what | us |\n| --- | --- | ---: |");
    let patch = "patch 4x4x2";
    print(patch, vec![patch_tick("2 substeps", false), patch_tick("implicit", true)], 60, 1000);
    let sizes = [8, 12, 20].map(|nodes| patch_build(&format!("{nodes}^3 body"), nodes, Kind::Patch, false));
    let kinds = [Kind::LinearBoundary, Kind::ScaledBoundary, Kind::Condensed]
        .map(|kind| patch_build(kind.name(), 12, kind, false));
    let implicit = patch_build("implicit", 12, Kind::Patch, true);
    print(patch, sizes.into_iter().chain(kinds).chain([implicit]).collect(), 60, 10);
    print("condensed 4x4x2, 12^3 body", condense().into(), 10, 1);
    print("12^3 body", whole_body().into(), 60, 10);
}
