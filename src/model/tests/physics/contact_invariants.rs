//! What every contact must keep, whatever the masses, the motion and the friction.

use crate::common::*;
use palpate_model::Vec3;
use palpate_model::body::{Block, Body, State};
use palpate_model::contact::{Contact, ContactMode, Deformable, Law, ToolMotion, ToolShape, step};
use palpate_model::equilibrium::static_equilibrium;
use palpate_model::mesh::{Face, Lattice, Surface};
use palpate_model::simulation::{Simulation, Stepping};
use proptest::prelude::*;

const D: f64 = 0.5e-3;

/// A small surface with masses and velocities of its own and no springs: what the contact solve alone does.
#[derive(Clone, Debug)]
struct Sheet {
    surface: Surface,
    positions: Vec<Vec3>,
    velocities: Vec<Vec3>,
    inverse_masses: Vec<f64>,
}

impl Sheet {
    fn step(&mut self, contact: &mut Contact, law: &Law, tool: ToolMotion) -> Vec3 {
        let candidates: Vec<u32> = (0..self.surface.triangles.len() as u32).collect();
        let forces = vec![Vec3::zeros(); self.positions.len()];
        let mut body = Deformable {
            positions: &mut self.positions,
            velocities: &mut self.velocities,
            inverse_masses: &self.inverse_masses,
            surface: &self.surface,
            candidates: &candidates,
        };
        step(&mut body, &forces, contact, law, tool, D)
    }

    fn point(&self, of: &[Vec3], contact: &Contact) -> Vec3 {
        let corners = self.surface.triangles[contact.triangle.unwrap() as usize];
        corners.iter().zip(&contact.weights).map(|(&node, w)| of[node as usize] * *w).sum()
    }

    fn kinetic_energy(&self) -> f64 {
        self.velocities.iter().zip(&self.inverse_masses).map(|(v, w)| 0.5 * v.norm_squared() / w).sum()
    }

    fn momentum(&self) -> Vec3 {
        self.velocities.iter().zip(&self.inverse_masses).map(|(v, w)| v / *w).sum()
    }
}

fn vector(scale: f64) -> impl Strategy<Value = Vec3> {
    prop::array::uniform3(-scale..scale).prop_map(Vec3::from)
}

/// Masses from 1 mg to 1 kg, velocities up to 2 m/s, a surface bent by up to 2 mm.
fn sheet() -> impl Strategy<Value = Sheet> {
    let lattice = Lattice { nodes: [4, 4, 2] };
    let n = lattice.len();
    let exponents = prop::collection::vec(-6.0..0.0_f64, n);
    (prop::collection::vec(vector(2e-3), n), prop::collection::vec(vector(2.0), n), exponents).prop_map(
        move |(bends, velocities, exponents)| Sheet {
            surface: Surface::new(n, lattice.surface_triangles()).unwrap(),
            positions: (0..n)
                .map(|id| Vec3::from(lattice.coordinates(id as u32).map(|c| c as f64 * 0.01)) + bends[id])
                .collect(),
            velocities,
            inverse_masses: exponents.iter().map(|exponent| 10.0_f64.powf(-exponent)).collect(),
        },
    )
}

fn weights() -> impl Strategy<Value = [f64; 3]> {
    (0.0..1.0_f64, 0.0..1.0_f64).prop_map(|(a, b)| {
        let (a, b) = if a + b > 1.0 { (1.0 - a, 1.0 - b) } else { (a, b) };
        [1.0 - a - b, a, b]
    })
}

fn touching(triangle: u32, weights: [f64; 3]) -> Contact {
    Contact { triangle: Some(triangle), weights, ..Contact::default() }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(2000))]

    #[test]
    fn momentum_is_balanced_to_rounding(
        sheet in sheet(), triangle in 0..60_u32, weights in weights(), motion in vector(1e-3), gap in vector(1e-4), mu in 0.0..2.0_f64,
    ) {
        let mut sheet = sheet;
        let mut contact = touching(triangle, weights);
        let from = sheet.point(&sheet.positions, &contact) + gap;
        let before = sheet.momentum();
        let force = sheet.step(&mut contact, &Law { friction: mu.into(), ..Law::default() }, ToolMotion::straight(from, from + motion));
        let scale: f64 = before.norm() + (force * D).norm()
            + sheet.velocities.iter().zip(&sheet.inverse_masses).map(|(v, w)| v.norm() / w).sum::<f64>();
        prop_assert!((sheet.momentum() - before + force * D).norm() <= 1e-14 * scale);
    }

    #[test]
    fn a_sticking_point_moves_with_the_tool_and_a_slipping_one_along_its_normal(
        sheet in sheet(), triangle in 0..60_u32, weights in weights(), motion in vector(1e-3), gap in vector(2e-5), mu in 0.0..2.0_f64,
    ) {
        let mut sheet = sheet;
        let mut contact = touching(triangle, weights);
        let held = contact;
        let from = sheet.point(&sheet.positions, &contact) + gap;
        // |gap| is below the recovery cap of 0.1 m/s, so it is closed in full.
        let target = (motion + gap) / D;
        sheet.step(&mut contact, &Law { friction: mu.into(), ..Law::default() }, ToolMotion::straight(from, from + motion));
        let error = sheet.point(&sheet.velocities, &held) - target;
        // Rounding is that of the fastest node, and a light one may be far faster than the tool.
        let fastest = sheet.velocities.iter().map(|v| v.norm()).fold(target.norm(), f64::max);
        let limit = 1e-14 * fastest.max(1.0);
        match contact.mode {
            ContactMode::Stick => prop_assert!(error.norm() <= limit, "{} > {}", error.norm(), limit),
            ContactMode::Slip => prop_assert!(error.dot(&contact.normal).abs() <= limit),
            ContactMode::Free | ContactMode::Lost => {}
        }
    }

    #[test]
    fn a_resting_tool_never_raises_kinetic_energy_for_any_masses(
        sheet in sheet(), triangle in 0..60_u32, weights in weights(), mu in prop_oneof![Just(0.0), 0.0..2.0_f64, Just(f64::INFINITY)],
    ) {
        let mut sheet = sheet;
        let mut contact = touching(triangle, weights);
        let at = sheet.point(&sheet.positions, &contact);
        let before = sheet.kinetic_energy();
        sheet.step(&mut contact, &Law { friction: mu.into(), ..Law::default() }, ToolMotion::straight(at, at));
        prop_assert!(sheet.kinetic_energy() <= before * (1.0 + 1e-14));
    }

    #[test]
    fn the_friction_cone_is_never_violated_and_never_pulls(
        sheet in sheet(), triangle in 0..60_u32, weights in weights(), motion in vector(1e-3), gap in vector(1e-3), mu in 0.0..2.0_f64,
    ) {
        let mut sheet = sheet;
        let mut contact = touching(triangle, weights);
        let from = sheet.point(&sheet.positions, &contact) + gap;
        let force = sheet.step(&mut contact, &Law { friction: mu.into(), ..Law::default() }, ToolMotion::straight(from, from + motion));
        let along = force.dot(&contact.normal);
        let across = (force - contact.normal * along).norm();
        prop_assert!(along >= 0.0);
        prop_assert!(across <= mu * along * (1.0 + 1e-9) + 1e-9 * force.norm());
        prop_assert_eq!(contact.mode == ContactMode::Free, force.norm() == 0.0);
    }
}

#[test]
fn a_static_pull_balances_the_reactions_of_the_held_nodes() {
    let mut body = block(STD);
    let node = body.lattice().id([5, 5, 11]);
    let pulled = body.rest()[node as usize] + Vec3::new(0.003, 0.0, 0.02);
    let state = static_equilibrium(&mut body, &[(node, pulled)]).unwrap();
    let mut forces = vec![Vec3::zeros(); state.positions.len()];
    body.forces(&state, &mut forces);
    let held = |n: &usize| body.inverse_masses()[*n] == 0.0;
    let reactions: Vec3 = (0..forces.len()).filter(held).map(|n| forces[n]).sum();
    let contact = glued(&body, node);
    let mut sim = Simulation::new(Box::new(body), state, contact, Law::default(), STEPPING).unwrap();
    assert!((sim.force(0) + reactions).norm() < 1e-11 * sim.force(0).norm(), "before the first tick");
    let resting = ToolMotion::straight(pulled, pulled);
    let force = (0..20).map(|_| sim.tick(resting).force).last().unwrap();
    assert!((force + reactions).norm() < 1e-9 * force.norm(), "and it stays: {force} against {reactions}");
    assert!(force.norm() > 1.0);
}

#[test]
fn a_closed_frictionless_circle_gives_the_tool_no_energy() {
    for zeta in [0.01, 0.1, 0.3, 1.0] {
        let (got, stored) = circle(zeta, ToolShape::Point);
        println!("zeta {zeta}: {:+.3e} of {stored:.3e} J", got);
        assert!(stored > 1e-4, "the tool did press");
        assert!(got <= 0.0, "zeta {zeta}: {got} J");
    }
    let (got, stored) = circle(0.001, ToolShape::Point);
    println!("zeta 0.001: {:+.3} %", 100.0 * got / stored);
    assert!(got <= 0.01 * stored, "{got} of {stored} J");
}

#[test]
fn forces_converge_under_step_refinement() {
    let body = block(STD);
    let run = |substeps: u32| {
        let stepping = Stepping { tick: 1e-3, substeps };
        let law = Law { friction: 1.0.into(), ..Law::default() };
        let state = State::at_rest(body.rest());
        let mut sim = Simulation::new(Box::new(body.clone()), state, Contact::default(), law, stepping).unwrap();
        let path: Vec<Vec3> = (0..=600).map(|k| drag_path(f64::from(k) * 1e-3)).collect();
        forces(&mut sim, &path)
    };
    let fine = run(32);
    let errors: Vec<f64> = [2, 4, 8, 16].iter().map(|&n| rms_percent(&run(n), &fine)).collect();
    println!("rms against 32 substeps: {errors:.4?} %");
    assert!(errors.windows(2).all(|pair| pair[1] < pair[0]), "{errors:?}");
    assert!(errors[0] < 0.5 && errors[3] < 0.5 * errors[0], "{errors:?}");
}

#[test]
fn a_block_with_unequal_edges_and_spacing_is_as_symmetric_as_it_should_be() {
    // A press in the middle of a brick with odd node counts: no sideways force but that of the quads' diagonals.
    let body = Block::builder([7, 9, 5], [0.06, 0.12, 0.05]).fix(Face::ZMin).build().unwrap();
    let top = 0.05;
    let mut sim = simulation(body, Contact::default(), 0.0);
    let path: Vec<Vec3> =
        (0..=400).map(|k| Vec3::new(0.03, 0.06, top + 0.001 - 0.006 * minjerk(f64::from(k) / 300.0))).collect();
    let force = *forces(&mut sim, &path).last().unwrap();
    assert!(force.z > 0.05 && force.xy().norm() < 1e-3 * force.z, "{force}");
}
