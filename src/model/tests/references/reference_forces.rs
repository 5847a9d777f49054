//! `full` against force series of an independent implementation, within the limits that the project promises.

use crate::common::*;
use palpate_model::Vec3;
use palpate_model::body::{Body, State};
use palpate_model::contact::{Contact, Law};
use palpate_model::equilibrium::static_equilibrium;
use palpate_model::simulation::Simulation;

fn positions_and_forces(name: &str) -> (Vec<Vec3>, Vec<Vec3>) {
    let rows = reference(name);
    let at = |row: &Vec<f64>, first: usize| Vec3::new(row[first], row[first + 1], row[first + 2]);
    // The tool's position column belongs to the end of the tick; the series starts one tick earlier, at the first.
    let path = std::iter::once(&rows[0]).chain(&rows).map(|row| at(row, 1)).collect();
    (path, rows.iter().map(|row| at(row, 4)).collect())
}

#[test]
fn a_pulled_node_feels_the_reference_force() {
    let rows = reference("pull");
    let body = block(STD);
    let node = body.lattice().id([5, 5, 11]);
    let rest = body.rest()[node as usize];
    let mut sim = simulation(body.clone(), glued(&body, node), f64::INFINITY);
    let z = |k: usize| {
        let t = k as f64 * 1e-3;
        0.02 * minjerk(t / 0.4) * (1.0 - minjerk((t - 0.6) / 0.4))
    };
    let path: Vec<Vec3> = (0..=rows.len()).map(|k| rest + Vec3::z() * z(k)).collect();
    let expected: Vec<Vec3> = rows.iter().map(|row| Vec3::new(row[2], row[3], row[4])).collect();
    let rms = rms_percent(&forces(&mut sim, &path), &expected);
    println!("pull: {rms:.4} %");
    assert!(rms <= 0.02, "{rms} %");
}

#[test]
fn a_hand_held_node_feels_the_reference_force() {
    let (path, expected) = positions_and_forces("hand");
    let body = block(STD);
    let node = body.lattice().id([5, 5, 11]);
    let mut sim = simulation(body.clone(), glued(&body, node), f64::INFINITY);
    let rms = rms_percent(&forces(&mut sim, &path), &expected);
    println!("hand: {rms:.4} %");
    assert!(rms <= 0.02, "{rms} %");
}

#[test]
fn a_dragged_tool_feels_the_reference_force_without_friction_and_with_it() {
    for (name, friction) in [("drag_mu0", 0.0), ("drag_mu1", 1.0)] {
        let (path, expected) = positions_and_forces(name);
        let mut sim = simulation(block(STD), Contact::default(), friction);
        let rms = rms_percent(&forces(&mut sim, &path), &expected);
        println!("{name}: {rms:.4} %");
        assert!(rms <= 0.02, "{name}: {rms} %");
    }
}

#[test]
fn a_wave_reaches_a_resting_tool_with_the_reference_force() {
    let rows = reference("wave");
    let mut body = block(SLOW);
    let [pulled, felt] = [[5, 5, 11], [8, 5, 11]].map(|at| body.lattice().id(at));
    let rest = body.rest().to_vec();
    let held = [(pulled, rest[pulled as usize] + Vec3::z() * 0.02), (felt, rest[felt as usize])];
    let state = static_equilibrium(&mut body, &held).unwrap();
    let contact = glued(&body, felt);
    let state = State { velocities: vec![Vec3::zeros(); state.positions.len()], ..state };
    let law = Law { friction: f64::INFINITY.into(), ..Law::default() };
    let mut sim = Simulation::new(Box::new(body), state, contact, law, STEPPING).unwrap();
    let path = vec![rest[felt as usize]; rows.len() + 1];
    let along = |f: &Vec3| Vec3::z() * f.z;
    let felt: Vec<Vec3> = forces(&mut sim, &path).iter().map(along).collect();
    let expected: Vec<Vec3> = rows.iter().map(|row| Vec3::z() * row[1]).collect();
    let rms = rms_percent(&felt, &expected);
    println!("wave: {rms:.4} %");
    assert!(rms <= 0.02, "{rms} %");
}
