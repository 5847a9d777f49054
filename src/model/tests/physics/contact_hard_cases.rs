//! Places and motions where contact code usually fails.

use crate::common::*;
use palpate_model::Vec3;
use palpate_model::body::{Block, Body, State};
use palpate_model::contact::{Contact, ContactMode, Law, ToolMotion};
use palpate_model::local::ToolForecast;
use palpate_model::local::{Kind, ResyncView, Template};
use palpate_model::mesh::Face;
use palpate_model::simulation::{Simulation, Stepping};
use palpate_model::surroundings::Bases;
use proptest::prelude::*;

const SPACING: f64 = 0.1 / 11.0;

/// Presses 3 mm straight down at `(x, y)` of the top, from 1 mm above, and returns the force at the end.
fn press(x: f64, y: f64, friction: f64) -> (Vec3, Contact) {
    let mut sim = simulation(block(STD), Contact::default(), friction);
    let path: Vec<Vec3> = (0..=150).map(|k| Vec3::new(x, y, 0.101 - 0.004 * minjerk(f64::from(k) / 100.0))).collect();
    let force = *forces(&mut sim, &path).last().unwrap();
    (force, *sim.contact(0))
}

#[test]
fn contact_is_found_on_a_vertex_an_edge_the_diagonal_and_inside_a_triangle() {
    let at = |i: f64, j: f64| (i * SPACING, j * SPACING);
    let places = [
        ("vertex", at(5.0, 5.0)),
        ("edge along x", at(5.5, 5.0)),
        ("edge along y", at(5.0, 5.5)),
        ("diagonal", at(5.5, 5.5)),
        ("triangle", at(5.3, 5.6)),
    ];
    for (what, (x, y)) in places {
        for friction in [0.0, 1.0] {
            let (force, contact) = press(x, y, friction);
            assert!(contact.is_touching(), "{what}, friction {friction}: {contact:?}");
            assert!(force.z > 0.1 && force.z < 1.0, "{what}, friction {friction}: {force}");
        }
    }
}

#[test]
fn contact_is_found_on_the_edges_and_corners_of_the_body() {
    let edge = 0.1;
    for (x, y) in [(0.0, 0.05), (edge, 0.05), (0.05, 0.0), (0.05, edge), (0.0, 0.0), (edge, edge), (0.0, edge)] {
        let (force, contact) = press(x, y, 1.0);
        assert!(contact.triangle.is_some(), "({x}, {y}): {contact:?}");
        assert!(force.z > 0.0 && force.iter().all(|c| c.is_finite()), "({x}, {y}): {force}");
    }
}

#[test]
fn every_free_face_can_be_touched() {
    let middle = Vec3::new(0.05, 0.0512, 0.0507);
    for face in Face::ALL.into_iter().filter(|&face| face != Face::ZMin) {
        let mut outward = Vec3::zeros();
        outward[face.axis()] = if face.is_max() { 1.0 } else { -1.0 };
        let mut sim = simulation(block(STD), Contact::default(), 1.0);
        let depth = |k: i32| 0.051 - 0.005 * minjerk(f64::from(k) / 100.0);
        let path: Vec<Vec3> = (0..=150).map(|k| middle + outward * depth(k)).collect();
        let force = *forces(&mut sim, &path).last().unwrap();
        assert!(force.dot(&outward) > 0.05, "{face:?}: {force}");
    }
}

#[test]
fn a_tool_on_a_fixed_face_is_lost_without_force() {
    let mut sim = simulation(block(STD), Contact::default(), 1.0);
    let path: Vec<Vec3> = (0..=20).map(|k| Vec3::new(0.05, 0.0512, -0.001 + 0.0001 * f64::from(k))).collect();
    let felt = forces(&mut sim, &path);
    assert!(felt.iter().all(|force| *force == Vec3::zeros()));
    assert_eq!(sim.contact(0).mode, ContactMode::Lost);
    // It lets go like any other contact: below the face, nothing is tracked any more.
    let away = Vec3::new(0.05, 0.0512, -0.01);
    sim.tick(ToolMotion::straight(*path.last().unwrap(), away));
    assert_eq!((sim.contact(0).mode, sim.contact(0).triangle), (ContactMode::Lost, None));
}

#[test]
fn a_patch_on_a_held_face_reports_the_lost_contact_too() {
    let mut sim = simulation(block(STD), Contact::default(), 1.0);
    // In the middle of the bottom, away from the side faces.
    let in_the_middle = |node: u32| {
        let x = sim.body().rest()[node as usize];
        x.z == 0.0 && (x.xy() - nalgebra::Vector2::repeat(0.05)).norm() < 0.01
    };
    let bottom = (0..sim.body().surface().triangles.len() as u32)
        .find(|&t| sim.body().surface().triangles[t as usize].iter().all(|&n| in_the_middle(n)))
        .unwrap();
    let mut patch = Template::new(Kind::Patch, [4, 4, 2], sim.body()).unwrap().empty();
    patch.rebuild(ResyncView {
        global: &mut sim,
        tick: 0,
        triangles: &[bottom],
        nearest: &[],
        patch: None,
        tools: &[ToolForecast::default()],
        index: 0,
        horizon: 0,
        bases: &Bases::default(),
    });
    let corners = sim.body().surface().triangles[bottom as usize].map(|n| sim.body().rest()[n as usize]);
    let below = (corners[0] + corners[1] + corners[2]) / 3.0 - Vec3::z() * 0.001;
    let force = patch.tick(&[ToolMotion::straight(below, below + Vec3::z() * 0.002)]).force;
    assert_eq!((force, patch.contact(0).mode), (Vec3::zeros(), ContactMode::Lost));
    assert_eq!(patch.contact(0).triangle, Some(bottom));
}

#[test]
fn a_frictionless_tool_that_jumps_far_over_a_flat_surface_feels_no_sideways_force() {
    // Farther than one step may walk: 40 nodes per edge, 60 mm in one tick.
    let body = Block::builder([40, 40, 3], [0.1, 0.1, 0.01]).fix(Face::ZMin).build().unwrap();
    let mut sim = simulation(body, Contact::default(), 0.0);
    let at = |x: f64| Vec3::new(x, 0.0512, 0.0099);
    sim.tick(ToolMotion::straight(at(0.02) + Vec3::z() * 0.001, at(0.02)));
    assert!(sim.contact(0).is_touching());
    for (from, to) in [(0.02, 0.08), (0.08, 0.08), (0.08, 0.08)] {
        let force = sim.tick(ToolMotion::straight(at(from), at(to))).force;
        assert!(force.xy().norm() < 0.2 * force.z.abs() + 1e-9, "{force}");
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(40))]

    /// A tool that flies at up to 1.5 m/s at any free face is stopped by it: it never is inside without contact.
    #[test]
    fn a_fast_tool_does_not_tunnel(
        face in 1..6_usize, u in 0.1..0.9_f64, v in 0.1..0.9_f64, speed in 0.2..1.5_f64, tilt in -0.5..0.5_f64,
    ) {
        let face = [Face::ZMax, Face::XMin, Face::XMax, Face::YMin, Face::YMax][face - 1];
        let axis = face.axis();
        let mut target = Vec3::zeros();
        target[(axis + 1) % 3] = 0.1 * u;
        target[(axis + 2) % 3] = 0.1 * v;
        target[axis] = if face.is_max() { 0.1 } else { 0.0 };
        let mut inward = Vec3::zeros();
        inward[axis] = if face.is_max() { -1.0 } else { 1.0 };
        inward[(axis + 1) % 3] = tilt;
        let inward = inward.normalize();
        // One layer below the bottom rows, where nodes are held, nothing can give way.
        prop_assume!(target.z > 0.02);

        let mut sim = simulation(block(STD), Contact::default(), 0.5);
        let start = target - inward * (0.01 + 0.37e-3 * speed);
        let position = |k: i32| start + inward * (speed * 1e-3 * f64::from(k));
        let hit = (0.01 / (speed * 1e-3)) as i32 + 1;
        let mut peak = 0.0_f64;
        for k in 0..hit + 4 {
            let force = sim.tick(ToolMotion::straight(position(k), position(k + 1))).force;
            prop_assert!(force.iter().all(|c| c.is_finite()));
            peak = peak.max(force.norm());
            let inside = (position(k + 1) - target).dot(&inward) > 1e-5;
            if inside {
                prop_assert!(sim.contact(0).triangle.is_some(), "tick {}: {:?}", k, sim.contact(0));
            }
        }
        prop_assert!(peak > 0.0);
    }
}

#[test]
fn a_teleport_of_20_mm_stays_finite_and_the_body_recovers() {
    let mut sim = simulation(block(STD), Contact::default(), 1.0);
    let above = Vec3::new(0.045, 0.0512, 0.0995);
    sim.tick(ToolMotion::straight(above + Vec3::z() * 0.001, above));
    let jump = sim.tick(ToolMotion::straight(above, above - Vec3::z() * 0.02)).force;
    assert!(jump.norm() > 8.5 && jump.norm() < 100.0, "far above what a device may exert: {jump}");
    let away = Vec3::new(0.045, 0.0512, 0.12);
    let mut last = jump;
    for k in 0..3000 {
        let from = if k == 0 { above - Vec3::z() * 0.02 } else { away };
        last = sim.tick(ToolMotion::straight(from, away)).force;
        assert!(last.iter().all(|c| c.is_finite()));
    }
    assert_eq!(last, Vec3::zeros());
    let moved = sim.state().positions.iter().zip(sim.body().rest()).map(|(x, rest)| (x - rest).norm());
    // Its slowest mode still rings a little; a cell that stayed inverted would be off by a spacing, 9 mm.
    let farthest = moved.fold(0.0, f64::max);
    assert!(farthest < 1e-4, "the block is back at rest up to {farthest} m");
}

#[test]
fn an_indentation_to_half_the_body_stays_finite_and_recovers() {
    let mut body = block(STD);
    let substeps = palpate_model::simulation::Stepping::stable_substeps(&mut body, 1e-3);
    let state = State::at_rest(body.rest());
    let law = Law { friction: 1.0.into(), ..Law::default() };
    let stepping = Stepping { tick: 1e-3, substeps };
    let mut sim = Simulation::new(Box::new(body), state, Contact::default(), law, stepping).unwrap();
    let depth = |k: i32| 0.052 * (minjerk(f64::from(k) / 400.0) - minjerk((f64::from(k) - 600.0) / 400.0));
    let path: Vec<Vec3> = (0..=4000).map(|k| Vec3::new(0.05, 0.0512, 0.102 - depth(k))).collect();
    let felt = forces(&mut sim, &path);
    assert!(felt.iter().flatten().all(|c| c.is_finite()));
    assert!(felt[500].z > 1.0, "{}", felt[500]);
    assert_eq!(*felt.last().unwrap(), Vec3::zeros());
    assert!(sim.state().is_finite());
}

#[test]
fn slivers_and_collapsed_springs_stay_finite() {
    let body = block(STD);
    let mut state = State::at_rest(body.rest());
    let id = |i, j| body.lattice().id([i, j, 11]) as usize;
    // Two nodes in one place, and a third on the line between its neighbours: springs without direction, triangles
    // without area.
    state.positions[id(5, 5)] = state.positions[id(6, 5)];
    state.positions[id(4, 4)] = (state.positions[id(4, 3)] + state.positions[id(5, 4)]) / 2.0;
    let law = Law { friction: 0.5.into(), ..Law::default() };
    let mut sim = Simulation::new(Box::new(body), state, Contact::default(), law, STEPPING).unwrap();
    let path: Vec<Vec3> = (0..=300)
        .map(|k| {
            let t = f64::from(k) / 300.0;
            Vec3::new(0.035 + 0.025 * t, 0.0455, 0.1005 - 0.004 * minjerk(3.0 * t))
        })
        .collect();
    let felt = forces(&mut sim, &path);
    assert!(felt.iter().flatten().all(|c| c.is_finite()) && sim.state().is_finite());
    assert!(felt.iter().any(|force| force.norm() > 0.05));
}

#[test]
fn very_stiff_light_damped_and_undamped_bodies_are_stable_with_their_own_substeps() {
    for (mass, stiffness, zeta) in
        [(0.5e-3, 30.0, 0.001), (0.5e-3, 30.0, 2.0), (0.5e-3, 3000.0, 0.3), (0.5e-4, 30.0, 0.3)]
    {
        let mut body = cube(6, (mass, stiffness, zeta));
        let substeps = palpate_model::simulation::Stepping::stable_substeps(&mut body, 1e-3);
        let stepping = Stepping { tick: 1e-3, substeps };
        let state = State::at_rest(body.rest());
        let law = Law { friction: 1.0.into(), ..Law::default() };
        let mut sim = Simulation::new(Box::new(body), state, Contact::default(), law, stepping).unwrap();
        let path: Vec<Vec3> = (0..=500).map(|k| drag_path(f64::from(k) * 1e-3)).collect();
        let felt = forces(&mut sim, &path);
        let what = format!("m {mass}, k {stiffness}, zeta {zeta}, {substeps} substeps");
        assert!(sim.state().is_finite(), "{what}");
        let still = sim.state().velocities.iter().map(|v| v.norm()).fold(0.0, f64::max);
        assert!(still < 1.0 && felt[450].z > 0.0, "{what}: {still} m/s, {}", felt[450]);
    }
}

#[test]
fn a_released_tool_is_tracked_without_new_detection_and_dropped_when_it_leaves() {
    let mut sim = simulation(Block::clone(&block(STD)), Contact::default(), 0.5);
    let at = |z: f64| Vec3::new(0.0507, 0.0512, z);
    let run = |sim: &mut Simulation, from: f64, to: f64, ticks: i32| {
        for k in 0..ticks {
            let z = |k: i32| from + (to - from) * f64::from(k) / f64::from(ticks);
            sim.tick(ToolMotion::straight(at(z(k)), at(z(k + 1))));
        }
    };
    run(&mut sim, 0.101, 0.098, 60);
    assert!(sim.contact(0).is_touching());
    // Off the surface by a tenth of a millimetre: no force, but still tracked.
    run(&mut sim, 0.098, 0.1001, 60);
    run(&mut sim, 0.1001, 0.1001, 600);
    assert_eq!((sim.contact(0).mode, sim.contact(0).triangle.is_some()), (ContactMode::Free, true));
    assert_eq!(sim.force(0), Vec3::zeros());
    run(&mut sim, 0.1001, 0.102, 20);
    assert_eq!(sim.contact(0).triangle, None);
}
