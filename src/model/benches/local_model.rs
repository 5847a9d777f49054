//! What the local model and the whole body cost: one 1 kHz tick of `patch` with contact, building it on bodies of three
//! sizes (the paper's O(1) claim), and one substep of the whole 12^3 body.
//!
//! `cargo bench --bench local_model`

use std::hint::black_box;
use std::sync::Arc;

use criterion::{BatchSize, BenchmarkId, Criterion, criterion_group, criterion_main};
use palpate_model::Vec3;
use palpate_model::body::{Block, Body, State};
use palpate_model::contact::{Contact, Law, ToolMotion};
use palpate_model::local::ToolForecast;
use palpate_model::local::{Kind, LocalModel, ResyncView, Template};
use palpate_model::mesh::Face;
use palpate_model::simulation::{Simulation, Stepping};
use palpate_model::surroundings::{Bases, Condensation, RestingBody};

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

fn template(kind: Kind, sim: &Simulation) -> Template {
    Template::new(kind, [4, 4, 2], sim.body()).expect("a held body of resting")
}

fn model(template: &Template, sim: &mut Simulation) -> Box<dyn LocalModel> {
    let mut model = template.empty();
    rebuild(&mut *model, sim);
    model
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

fn patch_tick(c: &mut Criterion) {
    let (mut sim, tool) = pressed(12);
    let circle = |k: usize| {
        let angle = k as f64 * 0.01;
        tool + Vec3::new(angle.cos() - 1.0, angle.sin(), 0.0) * 1e-3
    };
    let explicit = template(Kind::Patch, &sim);
    for (name, template) in [("2 substeps", explicit.clone()), ("implicit", explicit.with_implicit_steps())] {
        let (mut patch, mut k) = (model(&template, &mut sim), 0);
        c.bench_function(&format!("patch 4x4x2: one 1 kHz tick with contact, {name}"), |b| {
            b.iter(|| {
                k += 1;
                black_box(patch.tick(&[ToolMotion::straight(circle(k - 1), circle(k))]))
            });
        });
        assert!(patch.contact(0).is_touching(), "the tick measured has a contact in it");
    }
}

fn patch_build(c: &mut Criterion) {
    let mut group = c.benchmark_group("patch 4x4x2: build at a resync");
    for nodes in [8, 12, 20] {
        let (mut sim, _) = pressed(nodes);
        let mut patch = model(&template(Kind::Patch, &sim), &mut sim);
        group.bench_function(BenchmarkId::from_parameter(format!("{nodes}^3 body")), |b| {
            b.iter(|| rebuild(&mut *patch, &mut sim));
        });
    }
    let (mut sim, _) = pressed(12);
    for kind in [Kind::LinearBoundary, Kind::ScaledBoundary, Kind::Condensed] {
        let mut patch = model(&template(kind, &sim), &mut sim);
        group.bench_function(BenchmarkId::from_parameter(kind.name()), |b| b.iter(|| rebuild(&mut *patch, &mut sim)));
    }
    let mut patch = model(&template(Kind::Patch, &sim).with_implicit_steps(), &mut sim);
    group.bench_function(BenchmarkId::from_parameter("implicit"), |b| b.iter(|| rebuild(&mut *patch, &mut sim)));
    group.finish();
}

/// What `condensed` costs besides: once for the body, and once for each window that the tool comes to.
fn condense(c: &mut Criterion) {
    let mut group = c.benchmark_group("condensed 4x4x2, 12^3 body");
    let (sim, _) = pressed(12);
    let resting = Arc::new(RestingBody::new(sim.body()).expect("a body that can be taken apart"));
    group.sample_size(10);
    group.bench_function("factorise the body", |b| {
        b.iter_batched(|| resting.clone(), |resting| Condensation::new(resting).expect("held"), BatchSize::LargeInput);
    });
    let body = Condensation::new(resting).expect("held");
    let mut nodes = Vec::new();
    sim.body().patch(&[sim.contact(0).triangle.expect("the tool touches")], [4, 4, 2], &mut nodes);
    group.bench_function("a new window", |b| b.iter(|| black_box(body.compliance(&nodes))));
    group.finish();
}

fn whole_body(c: &mut Criterion) {
    let (mut sim, tool) = pressed(12);
    let resting = ToolMotion::straight(tool, tool);
    c.bench_function("12^3 body: one substep with contact (half a tick)", |b| {
        // A tick is two substeps; criterion's time per iteration is for one.
        b.iter_custom(|iterations| {
            let start = std::time::Instant::now();
            for _ in 0..iterations.div_ceil(2) {
                black_box(sim.tick(resting));
            }
            start.elapsed()
        });
    });
    let builder = Block::builder([12; 3], [0.1; 3]).fix(Face::ZMin);
    c.bench_function("12^3 body: largest eigenvalues and substeps", |b| {
        b.iter_batched(
            || builder.clone().build().expect("a valid block"),
            |mut body| palpate_model::simulation::Stepping::stable_substeps(&mut body, 1e-3),
            BatchSize::LargeInput,
        );
    });
}

criterion_group! {
    name = benches;
    config = Criterion::default().sample_size(60);
    targets = patch_tick, patch_build, condense, whole_body
}
criterion_main!(benches);
