//! The implicit local step against explicit steps of the same linear patch, with contact, stiff and strongly damped.

use crate::common::minjerk;
use palpate_model::Vec3;
use palpate_model::body::{Block, State};
use palpate_model::contact::{Contact, ContactMode, Law, ToolMotion};
use palpate_model::integrator::Spectrum;
use palpate_model::local::ToolForecast;
use palpate_model::local::{Kind, LocalModel, ResyncView, Template};
use palpate_model::mesh::Face;
use palpate_model::simulation::{Simulation, Stepping};
use palpate_model::surroundings::Bases;

fn block(factor: f64, zeta: f64) -> Block {
    let builder = Block::builder([8; 3], [0.07; 3]).node_mass(0.5e-3).stiffness(30.0 * factor).damping_ratio(zeta);
    builder.fix(Face::ZMin).build().unwrap()
}

/// A patch in the middle of the top, `ticks` per millisecond.
fn patch(factor: f64, zeta: f64, friction: f64, is_implicit: bool, ticks: u32) -> Box<dyn LocalModel> {
    let mut body = block(factor, zeta);
    let tick = 1e-3 / f64::from(ticks);
    let substeps = if is_implicit { 1 } else { 4 * Spectrum::estimate(&mut body).substeps(tick) };
    let template = Template::new(Kind::Patch, [4, 4, 2], &body).unwrap();
    let template = if is_implicit { template.with_implicit_steps() } else { template };
    let state = State::at_rest(palpate_model::body::Body::rest(&body));
    let law = Law { friction: friction.into(), ..Law::default() };
    let mut sim = Simulation::new(Box::new(body), state, Contact::default(), law, Stepping { tick, substeps }).unwrap();
    let top = |&t: &u32| {
        let corners = sim.body().surface().triangles[t as usize].map(|n| sim.body().rest()[n as usize]);
        let centre = (corners[0] + corners[1] + corners[2]) / 3.0;
        (centre - Vec3::new(0.035, 0.035, 0.07)).norm() < 0.006
    };
    let triangle = (0..sim.body().surface().triangles.len() as u32).find(top).unwrap();
    let mut model = template.empty();
    model.rebuild(ResyncView {
        global: &mut sim,
        tick: 0,
        triangles: &[triangle],
        nearest: &[],
        patch: None,
        tools: &[ToolForecast::default()],
        index: 0,
        horizon: 0,
        bases: &Bases::default(),
    });
    model
}

/// The tool at `ms`: presses 1 mm, drags 4 mm, lifts.
fn tool(ms: f64) -> Vec3 {
    let depth = 0.0015 * (minjerk(ms / 60.0) - minjerk((ms - 180.0) / 60.0));
    Vec3::new(0.033 + 0.004 * minjerk((ms - 70.0) / 100.0), 0.0351, 0.0705 - depth)
}

const MS: u32 = 260;

/// Mean force of every millisecond, and the modes seen at their ends.
fn run(mut model: Box<dyn LocalModel>, ticks: u32) -> (Vec<Vec3>, Vec<ContactMode>) {
    let at = |tick: u32| tool(f64::from(tick) / f64::from(ticks));
    (0..MS)
        .map(|ms| {
            let forces =
                (ms * ticks..(ms + 1) * ticks).map(|n| model.tick(&[ToolMotion::straight(at(n), at(n + 1))]).force);
            (forces.sum::<Vec3>() / f64::from(ticks), model.contact(0).mode)
        })
        .unzip()
}

/// Root mean square of the difference in % of the peak.
fn rms(forces: &[Vec3], reference: &[Vec3]) -> f64 {
    let peak = reference.iter().map(Vec3::norm).fold(0.0, f64::max);
    let sum: f64 = forces.iter().zip(reference).map(|(a, b)| (a - b).norm_squared()).sum();
    100.0 * (sum / forces.len() as f64).sqrt() / peak
}

#[test]
fn one_implicit_step_per_millisecond_is_stable_and_near_to_many_explicit_ones() {
    for (factor, zeta) in [(1.0, 0.3), (1.0, 1.0), (10.0, 0.3), (10.0, 1.0), (100.0, 0.3), (100.0, 1.0)] {
        for friction in [0.0, 0.5] {
            let (explicit, _) = run(patch(factor, zeta, friction, false, 1), 1);
            let (implicit, modes) = run(patch(factor, zeta, friction, true, 1), 1);
            let error = rms(&implicit, &explicit);
            println!("k x {factor}, zeta {zeta}, mu {friction}: {error:.2} %");
            assert!(error < 2.0, "k x {factor}, zeta {zeta}, mu {friction}: {error} %");
            assert!(modes.contains(&ContactMode::Slip) && modes.contains(&ContactMode::Free), "{modes:?}");
            assert!(friction == 0.0 || modes.contains(&ContactMode::Stick), "{modes:?}");
            assert!(implicit.last().unwrap().norm() == 0.0, "lifted");
        }
    }
}

#[test]
fn finer_ticks_bring_it_nearer() {
    let exact = run(patch(10.0, 0.3, 0.5, false, 16), 16).0;
    let errors = [1, 2, 4].map(|ticks| rms(&run(patch(10.0, 0.3, 0.5, true, ticks), ticks).0, &exact));
    println!("{errors:?}");
    assert!(errors[1] < 0.7 * errors[0] && errors[2] < 0.7 * errors[1], "{errors:?}");
}
