//! Places and motions where contact with a tool that has a shape usually fails.

use crate::common::*;
use crate::{tissue_support, tool_support};
use palpate_model::Vec3;
use palpate_model::body::{Block, Body, State, Tissue};
use palpate_model::contact::{Contact, ContactMode, ContactPoint, Friction, Law, ToolMotion, ToolShape};
use palpate_model::mesh::Face;
use palpate_model::simulation::{Simulation, Stepping};

const SPACING: f64 = 0.1 / 11.0;

fn sphere(radius: f64) -> ToolShape {
    ToolShape::Sphere { radius }
}

fn with(mut body: Block, shape: ToolShape, friction: impl Into<Friction>) -> Simulation {
    let stepping = Stepping { tick: 1e-3, substeps: Stepping::stable_substeps(&mut body, 1e-3) };
    let state = State::at_rest(body.rest());
    let law = Law { friction: friction.into(), ..Law::default() };
    Simulation::new(Box::new(body), state, Contact::default(), law, stepping).unwrap().with_shape(0, shape)
}

fn reference_block(shape: ToolShape, friction: f64) -> Simulation {
    with(block(STD), shape, friction)
}

/// Forces while the tool goes from the first place of `path` on, a place per tick, all of them finite.
fn felt(simulation: &mut Simulation, path: &[Vec3]) -> Vec<Vec3> {
    let felt = forces(simulation, path);
    assert!(felt.iter().all(|force| force.iter().all(|c| c.is_finite())), "forces are numbers");
    assert!(simulation.state().is_finite());
    felt
}

/// From `above` (m) over `place` to `depth` (m) below it, in a tenth of a second, and as long there: the tool's near side.
fn press_path(place: Vec3, outward: Vec3, radius: f64, above: f64, depth: f64) -> Vec<Vec3> {
    let height = |k: i32| radius + above - (above + depth) * minjerk(f64::from(k) / 100.0);
    (0..=200).map(|k| place + outward * height(k)).collect()
}

/// Check that tools smaller than the elements, pressed in far deeper than their radius, are always pushed back the way they came:
/// they sink in beside the elements until their centre is in the surface, and the tilted capsule's axis goes through it.
#[test]
fn a_small_tool_that_is_pressed_deep_is_pushed_out_the_way_it_came() {
    let tilted = ToolShape::Capsule { radius: 2e-3, half_axis: Vec3::new(0.012, 0.003, -0.004) };
    for shape in [sphere(1e-3), sphere(2e-3), sphere(4e-3), tilted] {
        let mut simulation = reference_block(shape, 0.0);
        let path = press_path(Vec3::new(0.052, 0.049, 0.1), Vec3::z(), shape.radius(), 6e-3, 0.012);
        let mut last = Vec3::zeros();
        for (from, to) in path.iter().zip(&path[1..]) {
            last = simulation.tick(ToolMotion::straight(*from, *to)).force;
            let normals = simulation.contact_points(0).iter().map(|point| point.normal.z);
            assert!(last.z >= 0.0 && normals.fold(1.0, f64::min) > 0.7, "{shape:?}: {last} at {to}");
        }
        assert!(last.z > 0.1 && last.xy().norm() < 0.3 * last.z, "{shape:?}: {last}");
    }
}

/// Check that a thin capsule that lies flat is held along its whole length while its axis goes into the surface, however fine the elements are and
/// however it lies on them, by forces that grow little by little and turn it by next to nothing: it was held at one place alone from there on,
/// by less than half the force.
#[test]
fn a_thin_capsule_that_is_pressed_flat_keeps_its_places() {
    let coarse = || block(STD);
    let fine = || {
        let builder = Block::builder([17, 17, 5], [0.048, 0.048, 0.012]).stiffness(100.0).node_mass(2e-4);
        builder.damping_ratio(0.3).fix(Face::ZMin).build().unwrap()
    };
    for (body, radius, turn) in [
        (coarse(), 1.5e-3, 0.0),
        (coarse(), 2.5e-3, 0.0),
        (coarse(), 3.5e-3, 0.0),
        (fine(), 1.5e-3, 0.0),
        (fine(), 1.5e-3, std::f64::consts::FRAC_PI_6),
        (fine(), 1.5e-3, std::f64::consts::FRAC_PI_4),
    ] {
        let along = Vec3::new(f64::cos(turn), f64::sin(turn), 0.0);
        let far = *body.rest().last().unwrap();
        let shape = ToolShape::Capsule { radius, half_axis: along * 0.018 };
        let mut simulation = with(body, shape, 0.5);
        let at = |k: i32| {
            let height = far.z + radius - 2.0 * radius * minjerk(f64::from(k) / 600.0);
            Vec3::new(0.5 * far.x, 0.5 * far.y, height)
        };
        let (mut last, mut largest, mut deepest) = (Vec3::zeros(), 0.0_f64, 0.0_f64);
        for k in 0..600 {
            let wrench = simulation.tick(ToolMotion::straight(at(k), at(k + 1)));
            let places = simulation.contact_points(0).iter().filter(|point| point.force.norm() > 0.0);
            let (left, right): (Vec<&ContactPoint>, Vec<&ContactPoint>) =
                places.partition(|point| (point.place - at(k + 1)).dot(&along) < 0.0);
            largest = largest.max((wrench.force - last).norm());
            last = wrench.force;
            if last.z > 0.02 {
                assert!(!left.is_empty() && !right.is_empty(), "{radius}, {turn}: {left:?} {right:?} after {k} ms");
                assert!(wrench.torque.norm() < 0.1 * 0.018 * last.z, "{radius}, {turn}: {wrench:?} after {k} ms");
                let depths = left.iter().chain(&right).map(|point| point.place.z - at(k + 1).z);
                deepest = depths.fold(deepest, f64::max);
            }
        }
        println!("{radius}, {turn}: {:.3} N, at most {largest:.4} N more in a tick, axis {deepest:.5} m deep", last.z);
        assert!(deepest > 1e-4, "{radius}, {turn}: the axis has not gone in");
        assert!(largest < 0.02 * last.z, "{radius}, {turn}: {largest} N of {}", last.z);
    }
}

/// Check that no speed passes through a sheet that is one element thick, held at two sides. Faster than at 1.4 m/s a sphere of 5 mm turns a third
/// of its cells inside out, which springs allow: its sheet stays below it, and may not push it back any more.
#[test]
fn a_fast_sphere_does_not_pass_through_a_sheet() {
    for (speed, radii) in [
        (1.0, [1e-3, 2e-3, 4e-3, 5e-3].as_slice()),
        (2.0, &[4e-3]),
        (3.0, &[1e-3, 2e-3, 4e-3, 5e-3]),
        (4.0, &[2e-3, 4e-3]),
    ] {
        for &radius in radii {
            let sheet = Block::builder([11, 11, 2], [0.02, 0.02, 0.002])
                .stiffness(500.0)
                .node_mass(1e-4)
                .fix(Face::XMin)
                .fix(Face::XMax)
                .build()
                .unwrap();
            let mut simulation = with(sheet, sphere(radius), 0.3);
            // From 2 mm above the sheet to where it would be below it, and a while there.
            let height = |k: i32| (0.004 + radius - speed * 1e-3 * f64::from(k)).max(-0.001);
            let path: Vec<Vec3> = (0..60).map(|k| Vec3::new(0.0103, 0.0098, height(k))).collect();
            let felt = felt(&mut simulation, &path);
            let middle = 5 + 11 * (5 + 11);
            let (top, tool) = (simulation.state().positions[middle].z, path[59].z);
            println!(
                "{speed} m/s, {radius} m: at most {:.3} N, last {:.3} N, top {top:.4} m",
                largest(&felt),
                felt[58].z
            );
            let may_turn_inside_out = radius > 4e-3 && speed > 1.4;
            assert!(may_turn_inside_out || felt[58].z > 0.0, "{speed} m/s, {radius} m: the sheet still holds the tool");
            assert!(top < tool, "{speed} m/s, {radius} m: the sheet at {top} m is below the tool at {tool} m");
        }
    }
}

fn largest(forces: &[Vec3]) -> f64 {
    forces.iter().map(Vec3::norm).fold(0.0, f64::max)
}

/// Check that a tool that starts inside is let out: no faster than gaps are closed, with a force that is no blow.
#[test]
fn a_sphere_that_starts_inside_is_let_out_at_a_bounded_speed() {
    for depth in [1e-3, 4e-3, 6e-3] {
        let radius = 0.008;
        let mut simulation = reference_block(sphere(radius), 0.0);
        let at = Vec3::new(0.05, 0.0512, 0.1 + radius - depth);
        let mut fastest = 0.0_f64;
        let mut felt = Vec::new();
        for _ in 0..400 {
            felt.push(simulation.tick(ToolMotion::straight(at, at)).force);
            fastest = fastest.max(simulation.state().velocities.iter().map(Vec3::norm).fold(0.0, f64::max));
        }
        println!("{depth}: {fastest:.3} m/s, at most {:.3} N, {:.3} N at last", largest(&felt), felt[399].z);
        assert!(felt.iter().all(|force| force.iter().all(|c| c.is_finite())));
        assert!(fastest < 0.5, "{depth}: {fastest} m/s");
        assert!(felt[399].z > 0.0 && largest(&felt) < 4.0 * felt[399].z.max(0.5), "{depth}: {}", largest(&felt));
    }
}

/// Check that a tool beside the middle of a face, over its rim or its corner, is pushed away from the body.
#[test]
fn rims_and_corners_push_the_tool_away() {
    let top = |x: f64, y: f64| (Vec3::new(x, y, 0.1), Vec3::z());
    let slant = |x: f64, y: f64, z: f64, to: Vec3| (Vec3::new(x, y, z), to.normalize());
    let cases = [
        top(0.0, 0.05),
        top(0.1, 0.05),
        top(0.05, 0.0),
        top(0.0, 0.0),
        top(0.1, 0.1),
        slant(0.1, 0.05, 0.1, Vec3::new(1.0, 0.0, 1.0)),
        slant(0.1, 0.1, 0.1, Vec3::new(1.0, 1.0, 1.0)),
        slant(0.0, 0.1, 0.1, Vec3::new(-1.0, 1.0, 1.0)),
        slant(0.1, 0.05, 0.05, Vec3::x()),
    ];
    for (place, outward) in cases {
        for radius in [0.5e-3, 0.003, 0.008, 0.05] {
            let mut simulation = reference_block(sphere(radius), 0.5);
            let felt = felt(&mut simulation, &press_path(place, outward, radius, 1e-3, 3e-3));
            let last = felt.last().unwrap();
            println!("rim {radius} at {:?}: {:?}", place.as_slice(), last.as_slice());
            assert!(last.dot(&outward) >= 0.0 && last.norm() < 20.0, "{radius} at {place}: {last}");
            // A tenth of an element in radius: it slips off.
            assert!(last.dot(&outward) > 0.01 || radius < 1e-3, "{radius} at {place}: {last}");
        }
    }
}

/// Check that held nodes exert no force, and say so.
#[test]
fn a_sphere_on_held_nodes_is_lost_without_force() {
    for radius in [0.002, 0.008] {
        let mut simulation = reference_block(sphere(radius), 1.0);
        let path = press_path(Vec3::new(0.05, 0.0512, 0.0), -Vec3::z(), radius, 1e-3, 1e-3);
        let felt = felt(&mut simulation, &path);
        assert!(felt.iter().all(|force| *force == Vec3::zeros()), "{radius}");
        assert_eq!(simulation.contact(0).mode, ContactMode::Lost, "{radius}");
        assert!(simulation.contact_points(0).is_empty());
    }
}

/// Check that tools of any size are met: five times the body, and a tenth of an element.
#[test]
fn tools_far_larger_and_far_smaller_than_elements_are_met() {
    for radius in [0.5, 0.5e-3] {
        let mut simulation = reference_block(sphere(radius), 0.5);
        let felt = felt(&mut simulation, &press_path(Vec3::new(0.05, 0.0512, 0.1), Vec3::z(), radius, 1e-3, 2e-3));
        let last = felt.last().unwrap();
        println!("{radius}: {:?} N, {} places", last.as_slice(), simulation.contact_points(0).len());
        assert!(last.z > 0.02 && last.xy().norm() < 0.1 * last.z, "{radius}: {last}");
        assert!(simulation.contact_area(0) <= 0.011, "{radius}: no more than the top");
    }
}

/// Check that a jump of the tool, over the body and into it, is answered by a finite force, and that the body comes to rest.
#[test]
fn a_teleported_sphere_is_answered_by_a_finite_force() {
    let radius = 0.008;
    let start = Vec3::new(0.05, 0.0512, 0.1 + radius - 0.003);
    for jump in [Vec3::x() * 0.02, Vec3::z() * -0.02, Vec3::new(0.012, -0.012, -0.011)] {
        let mut simulation = reference_block(sphere(radius), 0.5);
        let path: Vec<Vec3> = (0..1500).map(|k| if k < 200 { start } else { start + jump }).collect();
        let felt = felt(&mut simulation, &path);
        let speed = simulation.state().velocities.iter().map(Vec3::norm).fold(0.0, f64::max);
        println!(
            "{jump:?}: at most {:.1} N, at last {:?} N, {speed:.2e} m/s",
            largest(&felt),
            felt.last().unwrap().as_slice()
        );
        assert!(largest(&felt) < 1000.0 && speed < 0.05, "{jump}: {} N, {speed} m/s", largest(&felt));
    }
}

/// Check that a body that was turned inside out under the tool recovers.
#[test]
fn an_inverted_body_recovers_under_a_sphere() {
    let radius = 0.008;
    let mut simulation = reference_block(sphere(radius), 0.5);
    let upper = (0..1728).filter(|&n| simulation.body().rest()[n].z > 0.085).collect::<Vec<_>>();
    for node in upper {
        // The upper two layers change places, and more.
        let z = &mut simulation.state_mut().positions[node].z;
        *z = 0.19 - *z;
    }
    let at = Vec3::new(0.05, 0.0512, 0.1 + radius - 0.002);
    let felt = felt(&mut simulation, &[at; 1500]);
    let last = felt.last().unwrap();
    println!("at most {:.1} N, at last {:?}", largest(&felt), last.as_slice());
    assert!(largest(&felt) < 100.0 && last.z >= 0.0);
}

/// Check that a tool that stands still on a body with friction feels the same for two seconds.
#[test]
fn a_resting_sphere_does_not_creep() {
    let radius = 0.008;
    let mut simulation = reference_block(sphere(radius), 0.5);
    let start = Vec3::new(0.045, 0.0512, 0.1 + radius);
    let path: Vec<Vec3> = (0..=1000)
        .map(|k| {
            let t = f64::from(k) * 1e-3;
            start + Vec3::new(2e-4 * minjerk((t - 0.3) / 0.2), 0.0, 1e-3 - 4e-3 * minjerk(t / 0.2))
        })
        .collect();
    felt(&mut simulation, &path);
    // The block swings for long.
    let pressed = *felt(&mut simulation, &[*path.last().unwrap(); 1500]).last().unwrap();
    let kept = felt(&mut simulation, &[*path.last().unwrap(); 2000]);
    let off = kept.iter().map(|force| (force - pressed).norm()).fold(0.0, f64::max) / pressed.norm();
    println!("{:?}: off by {off:.2e}", pressed.as_slice());
    assert!(simulation.contact_points(0).iter().any(|point| point.mode == ContactMode::Stick));
    assert!(off < 1e-3, "{off}");
}

/// The most by which the force falls, as a share of the largest, while a sphere is pressed in by 5 mm, so slowly that the body
/// does not swing.
fn falls(body: Box<dyn Body>, radius: f64, place: Vec3) -> f64 {
    let mut body = tool_support::Calm::new(body, sphere(radius));
    let at = |k: i32| place + Vec3::z() * (radius - 1e-5 * f64::from(k));
    let (mut most, mut fell) = (0.0_f64, 0.0_f64);
    for k in 0..500 {
        let force = body.tick(ToolMotion::straight(at(k), at(k + 1)), tool_support::CALM).force.z;
        fell = fell.max(most - force);
        most = most.max(force);
    }
    println!("{radius} at {:?}: {most:.4} N, fell by {:.3} %", place.as_slice(), 100.0 * fell / most);
    fell / most
}

/// Check that to press deeper never takes less, on elements that are larger than what a sphere touches.
#[test]
fn the_force_never_falls_while_a_sphere_is_pressed_in() {
    let tissue = Tissue { viscosity: 5.0, ..Tissue::LIVER };
    let mut worst = 0.0_f64;
    for radius in [0.002, 0.008, 0.02] {
        for (x, y) in [(5.0, 5.0), (5.3, 5.6)] {
            let place = Vec3::new(x * SPACING, y * SPACING, 0.1);
            worst = worst.max(falls(Box::new(block(STD)), radius, place));
        }
        let mesh = tissue_support::irregular_box([7, 7, 5], [0.063, 0.063, 0.045], 0.0);
        let body = tissue_support::body(mesh, tissue, true);
        worst = worst.max(falls(Box::new(body), radius, Vec3::new(0.030, 0.033, 0.045)));
    }
    assert!(worst <= 1e-3, "fell by {worst}");
}
