//! What a sphere feels that is pressed in or slides slowly: against Hertz, and wherever the nodes lie. The full tables are made by
//! tools/examples/tool_convergence.rs and stand in docs/tissue.md.

use crate::tool_support::*;
use palpate_model::body::Body;
use palpate_model::contact::{ToolMotion, ToolShape};
use palpate_model::{Pose, Turn, Vec3};

const SPHERE: ToolShape = ToolShape::Sphere { radius: 0.008 };
const DEPTH: f64 = 0.003;

/// Check that a sphere feels what Hertz found for a half space, on elements that are half as large as what it touches.
#[test]
fn a_sphere_on_tissue_feels_the_force_of_hertz() {
    // Of a coarse surface it touches one facet, which is tilted by up to two degrees.
    for (size, limit, most_sideways) in [(4e-3, 0.02, 0.03), (2.5e-3, 0.05, 0.04)] {
        let pressed = press_tissue(0.010, 0.002, 0.45, size);
        let (force, area) = hertz(0.010, 0.002, 0.45);
        let (ratio, area) = (pressed.wrench.force.z / force, pressed.area / area);
        let sideways = pressed.wrench.force.xy().norm() / force;
        println!("{size}: {ratio:.3}, {} places, area {area:.2}, {sideways:.3} sideways", pressed.places);
        assert!((ratio - 1.0).abs() < limit, "elements of {size} m: {ratio}");
        assert!((area - 1.0).abs() < limit, "elements of {size} m: {area}");
        assert!(sideways < most_sideways, "{sideways}");
    }
}

/// Check that a sphere that is held is held still where elements are just becoming fine against what it touches: how it meets the surface
/// there hangs on the force, and the force on that. (If both followed each other in 5 ms the force would swing by its own size.) And where
/// they are much finer: it meets many corners there. (If it met triangles the force would swing by a tenth.)
#[test]
fn a_sphere_is_held_still_where_elements_become_fine_and_where_they_are() {
    let becoming = [1.7e-3, 2.1e-3, 2.4e-3, 2.7e-3, 3.2e-3].map(|depth| (0.0149_f64, depth, 0.49, 3e-3));
    let are = [(0.0148, 3.2e-3, 0.35, 2.6e-3), (0.011, 1.2e-3, 0.335, 1.6e-3)];
    for (radius, depth, ratio, size) in becoming.into_iter().chain(are) {
        let body = graded(size, 1.6 * (radius * depth).sqrt(), ratio);
        let mut body = Calm::new(Box::new(body), ToolShape::Sphere { radius });
        let above = |tick: u32| radius + 1e-4 - (depth + 1e-4) * f64::from(tick.min(100)) / 100.0;
        let at = |tick: u32| Vec3::new(3e-4, 2e-4, above(tick));
        // What is left is no swing of the body by itself.
        let felt = |tick: u32| body.tick(ToolMotion::straight(at(tick), at(tick + 1)), CALM).force.z;
        let forces: Vec<f64> = (0..400).map(felt).collect();
        let calm = spread(&forces[300..]);
        println!(
            "{depth} m: {:.4} N, {:.3} of Hertz', {calm:.2} %",
            forces[399],
            forces[399] / hertz(radius, depth, ratio).0
        );
        assert!(calm < 0.1, "{depth} m: {:?}", &forces[300..]);
    }
}

/// Check that a sphere does not feel where the nodes of the lattice are, and that a point does.
#[test]
fn a_sphere_feels_the_same_over_nodes_edges_and_faces_of_a_lattice() {
    let forces = |shape: ToolShape| {
        on_lattice(12).map(|(_, place)| press(Box::new(lattice(12)), shape, place, Vec3::z(), DEPTH).wrench.force.z)
    };
    let (sphere, point) = (forces(SPHERE), forces(ToolShape::Point));
    println!("sphere {sphere:.4?}: {:.1} %, point {point:.4?}", spread(&sphere));
    assert!(spread(&sphere) < 0.6, "{sphere:?}");
    assert!(point[3] > 1.8 * point[0], "{point:?}");
}

/// Check that a sphere does not feel how fine a lattice of the same material is, and that a point does.
#[test]
fn a_sphere_feels_the_same_on_coarse_and_fine_lattices() {
    let middle = Vec3::new(0.5 * SIDE, 0.5 * SIDE, SIDE);
    let forces = |shape: ToolShape| {
        [8, 12, 16].map(|nodes| press(Box::new(lattice(nodes)), shape, middle, Vec3::z(), 1e-3).wrench.force.z)
    };
    for radius in [4e-3, 8e-3, 20e-3] {
        let sphere = forces(ToolShape::Sphere { radius });
        println!("{radius} m: {sphere:.4?}, {:.2} %", spread(&sphere));
        assert!(spread(&sphere) < 0.5, "{sphere:?}");
    }
    let point = forces(ToolShape::Point);
    assert!(point[0] > 1.8 * point[2], "{point:?}");
}

/// The same on an organ, pressed along one normal by as much from where the sphere just touches.
#[test]
fn a_sphere_feels_the_same_over_a_node_an_edge_and_a_face_of_an_organ() {
    let body = organ_body();
    let middle = body.rest().iter().sum::<Vec3>() / body.rest().len() as f64;
    let (places, outward) = on_top(&body, middle);
    let forces = |shape: ToolShape| {
        places.map(|(_, place)| {
            let depth = DEPTH + first_touch(Box::new(organ_body()), shape, place, outward);
            press(Box::new(organ_body()), shape, place, outward, depth).wrench.force.dot(&outward)
        })
    };
    let (sphere, point) = (forces(SPHERE), forces(ToolShape::Point));
    println!("sphere {sphere:.4?}: {:.1} %, point {point:.4?}: {:.0} %", spread(&sphere), spread(&point));
    assert!(spread(&sphere) < 3.0, "{sphere:?}");
}

/// Check that a sphere that slides over four cells of a flat lattice feels little of them, and that a point does.
#[test]
fn a_sphere_slides_over_a_flat_lattice_with_little_ripple() {
    let cell = SIDE / 11.0;
    let path = [3.5, 7.5].map(|x| Vec3::new(x * cell, 0.0512, SIDE));
    let of = |shape: ToolShape| {
        let forces = slide(Box::new(lattice(12)), shape, path, Vec3::z(), DEPTH, 2.0);
        ripple(&forces, forces.len() / 4)
    };
    let (sphere, point) = (of(SPHERE), of(ToolShape::Point));
    println!("{sphere:.2} %, point {point:.2} %");
    assert!(sphere < 2.0, "{sphere}");
    assert!(point > 20.0, "{point}");
}

/// Check that a search that goes on from what it knows of a tool's vicinity finds what one does that begins anew in every tick, to
/// the last bit: fast and slow, over rims, with a tool that turns.
#[test]
fn what_is_known_of_a_vicinity_changes_nothing() {
    let capsule = ToolShape::Capsule { radius: 4e-3, half_axis: Vec3::new(8e-3, 0.0, 0.0) };
    for (shape, speed) in [(SPHERE, 0.05), (SPHERE, 0.6), (capsule, 0.3)] {
        let mut simulation = resting(Box::new(lattice(12)), shape);
        let pose = |tick: u32| {
            let t = 1e-3 * f64::from(tick);
            let sunk = DEPTH * (t / 0.05).min(1.0);
            let position = Vec3::new(0.05 + speed * t, 0.047 + 0.3 * speed * t, SIDE + shape.radius() + 1e-3 - sunk);
            Pose { orientation: Turn::from_scaled_axis(Vec3::z() * (3.0 * t)), ..Pose::at(position) }
        };
        let mut touched = 0;
        for tick in 0..250 {
            let motion = ToolMotion { from: pose(tick), to: pose(tick + 1) };
            let mut anew = simulation.duplicate().unwrap();
            let wrench = simulation.tick(motion);
            assert_eq!(anew.tick(motion), wrench, "{shape:?} tick {tick}");
            assert_eq!(anew.contact_points(0), simulation.contact_points(0));
            touched += usize::from(wrench.force != Vec3::zeros());
        }
        assert!(touched > 50, "{touched}");
    }
}
