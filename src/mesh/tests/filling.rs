//! Filling: every element positive and of the promised angles, every face shared or on the surface, the volume kept.

mod support;

use palpate_mesh::{ImplicitShape, Sizes, SurfaceMesh, fill, fill_shape};
use palpate_model::Vec3;
use palpate_model::mesh::TetrahedralMesh;
use proptest::prelude::*;
use support::{Shape, angles, noise, outer_faces, torus, turn, volume};

/// What the method promises (degrees).
const ANGLES: [f64; 2] = [10.7, 164.8];

fn check_valid(mesh: &TetrahedralMesh, depth: impl Fn(&Vec3) -> f64, tolerance: f64) {
    let [smallest, largest] = angles(mesh);
    assert!(smallest > ANGLES[0] && largest < ANGLES[1], "{smallest} to {largest} degrees");
    // A face that neighbours cut differently would have a node inside.
    let outer = outer_faces(mesh);
    for face in &outer {
        for &node in face {
            let depth = depth(&mesh.points[node as usize]);
            assert!(depth.abs() < tolerance, "an outer node is {depth} m from the surface");
        }
    }
    // Each edge of the outer surface has one face on each side: it is closed and a manifold.
    let mut passes: Vec<[u32; 2]> = outer.iter().flat_map(|&[a, b, c]| [[a, b], [b, c], [c, a]]).collect();
    passes.sort_unstable();
    assert!(passes.windows(2).all(|pair| pair[0] != pair[1]));
    assert!(passes.iter().all(|&[a, b]| passes.binary_search(&[b, a]).is_ok()));
    let enclosed: f64 = outer
        .iter()
        .map(|face| face.map(|node| mesh.points[node as usize]))
        .map(|[a, b, c]| a.dot(&b.cross(&c)) / 6.0)
        .sum();
    assert!((enclosed / volume(mesh) - 1.0).abs() < 1e-9);
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 60, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn what_is_finer_than_the_elements_still_gives_a_valid_mesh(seed: u64, waves in 1_usize..8) {
        let shape = noise(seed, waves);
        let mesh = fill_shape(&shape, Sizes::uniform(0.5), &mut |_| {}).unwrap();
        // Elements that touched others along an edge are gone, so outer nodes may lie inside.
        check_valid(&mesh, |_| 0.0, 1.0);
        prop_assert!(mesh.points.iter().all(|x| shape.signed_distance(x) < 1e-5));
    }

}

proptest! {
    #![proptest_config(ProptestConfig { cases: 12, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn smooth_shapes_of_any_direction_keep_their_volume(axis in [-1.0..1.0, -1.0..1.0, -1.0..1.0_f64], shift in [0.0..1.0, 0.0..1.0, 0.0..1.0_f64]) {
        let (turn, shift) = (turn(Vec3::from(axis)), Vec3::from(shift));
        let ellipsoid = Shape { reach: 3.0, distance: |x: &Vec3| (turn.transpose() * (x - shift)).component_div(&Vec3::new(2.0, 1.2, 0.9)).norm() - 1.0 };
        let mesh = fill_shape(&ellipsoid, Sizes::uniform(0.25), &mut |_| {}).unwrap();
        check_valid(&mesh, |x| ellipsoid.signed_distance(x), 1e-5);
        let exact = 4.0 / 3.0 * std::f64::consts::PI * 2.0 * 1.2 * 0.9;
        prop_assert!((volume(&mesh) / exact - 1.0).abs() < 0.02, "{}", volume(&mesh) / exact);

        // A box of 2 x 1.4 x 1 with edges rounded by 0.3.
        let rounded = Shape { reach: 3.0, distance: |x: &Vec3| {
            let x = (turn.transpose() * (x - shift)).abs() - Vec3::new(0.7, 0.4, 0.2);
            x.sup(&Vec3::zeros()).norm() + x.max().min(0.0) - 0.3
        } };
        let mesh = fill_shape(&rounded, Sizes::uniform(0.15), &mut |_| {}).unwrap();
        check_valid(&mesh, |x| rounded.signed_distance(x), 1e-5);

        let (major, minor) = (1.0, 0.45);
        let ring = torus(major, minor, [96, 48], |x| turn * x + shift);
        let mesh = fill(&ring, Sizes::uniform(0.12), &mut |_| {}).unwrap();
        let exact = 2.0 * std::f64::consts::PI.powi(2) * major * minor * minor;
        prop_assert!((volume(&mesh) / exact - 1.0).abs() < 0.02, "{}", volume(&mesh) / exact);
        let depth = |x: &Vec3| {
            let x = turn.transpose() * (x - shift);
            (x.xy().norm() - major).hypot(x.z) - minor
        };
        // The triangles themselves lie inside of the torus.
        check_valid(&mesh, depth, 0.002);
    }
}

#[test]
fn the_error_of_the_volume_falls_with_the_square_of_the_size() {
    let ball = Shape { reach: 1.0, distance: |x: &Vec3| x.norm() - 1.0 };
    let error = |size: f64| {
        let mesh = fill_shape(&ball, Sizes::uniform(size), &mut |_| {}).unwrap();
        1.0 - volume(&mesh) / (4.0 / 3.0 * std::f64::consts::PI)
    };
    let [coarse, fine] = [0.3, 0.1].map(error);
    assert!(coarse > 0.0 && coarse < 0.04, "{coarse}");
    assert!((7.0..11.0).contains(&(coarse / fine)), "{coarse} {fine}");
}

#[test]
fn a_surface_is_filled_as_the_shape_it_was_made_from_and_the_same_in_each_run() {
    let ring = torus(1.0, 0.4, [200, 100], |x| x);
    let mesh = fill(&ring, Sizes::uniform(0.1), &mut |_| {}).unwrap();
    assert_eq!(mesh, fill(&ring, Sizes::uniform(0.1), &mut |_| {}).unwrap());
    // Inside out, and with each triangle's corners for itself, as STL holds them.
    let triangles = ring.triangles.iter().map(|&[a, b, c]| [a, c, b]).collect();
    assert_eq!(
        mesh,
        fill(&SurfaceMesh { points: ring.points.clone(), triangles }, Sizes::uniform(0.1), &mut |_| {}).unwrap()
    );
    let points: Vec<Vec3> = ring.triangles.iter().flatten().map(|&node| ring.points[node as usize]).collect();
    let triangles = (0..points.len() as u32 / 3).map(|n| [3 * n, 3 * n + 1, 3 * n + 2]).collect();
    assert_eq!(mesh, fill(&SurfaceMesh { points, triangles }, Sizes::uniform(0.1), &mut |_| {}).unwrap());
}

#[test]
fn large_triangles_are_filled_like_small_ones() {
    // A box of twelve triangles, turned: its edges are rounded by the elements, its faces are met.
    let turn = turn(Vec3::new(0.3, 0.5, -0.2));
    let cube = support::cube(|x| turn * x);
    let mesh = fill(&cube, Sizes::uniform(0.05), &mut |_| {}).unwrap();
    check_valid(&mesh, |x| (turn.transpose() * x).abs().max() - 0.5, 1e-8);
    assert!((volume(&mesh) - 1.0).abs() < 0.02, "{}", volume(&mesh));
}

#[test]
fn progress_grows_from_0_to_1() {
    let mut done = Vec::new();
    fill(&torus(1.0, 0.4, [60, 30], |x| x), Sizes::uniform(0.1), &mut |part| done.push(part)).unwrap();
    assert_eq!((done[0], done[done.len() - 1]), (0.0, 1.0));
    assert!(done.len() > 10 && done.windows(2).all(|pair| pair[0] <= pair[1]), "{done:?}");
}

#[test]
fn what_cannot_be_filled_is_refused_in_one_line() {
    let ring = torus(1.0, 0.4, [60, 30], |x| x);
    let refused = |surface: &SurfaceMesh, size: f64| {
        let error = fill(surface, Sizes::uniform(size), &mut |_| {}).unwrap_err().to_string();
        assert!(!error.contains('\n'));
        error
    };
    for size in [0.0, -1.0, f64::NAN, f64::INFINITY] {
        assert!(refused(&ring, size).contains("above zero"), "{size}");
    }
    let error = refused(&ring, 1e-3);
    assert!(error.contains("2e7") && error.contains("m fits"), "{error}");
    assert!(refused(&ring, 1e-300).contains("m fits"));
    // What the message names does fit.
    let fits: f64 = error.split(' ').rev().nth(2).unwrap().parse().unwrap();
    assert!((1e-3..0.02).contains(&fits), "{error}");
    for size in [2.0, 3.0, 1e6] {
        let error = refused(&ring, size);
        assert!(error.contains("element_size_m is too large"), "{error}");
    }
    let sizes = Sizes { element_m: 0.1, surface_m: Some(0.2) };
    let error = fill(&ring, sizes, &mut |_| {}).unwrap_err().to_string();
    assert!(error.contains("only be finer"), "{error}");
    assert!(fill(&ring, Sizes { surface_m: Some(-0.1), ..sizes }, &mut |_| {}).is_err());
    assert!(refused(&SurfaceMesh::default(), 0.1).contains("no triangles"));
    let mut open = ring.clone();
    open.triangles.pop();
    assert!(refused(&open, 0.1).contains("3 edges"));
    let mut endless = ring.clone();
    endless.points[5].y = f64::NAN;
    assert!(refused(&endless, 0.1).contains("not finite"));
    let mut dangling = ring;
    dangling.triangles[3][1] = 1_000_000;
    assert!(refused(&dangling, 0.1).contains("triangle 3"));
    let outside = Shape { reach: 0.5, distance: |x: &Vec3| x.norm() - 1.0 };
    let error = fill_shape(&outside, Sizes::uniform(0.1), &mut |_| {}).unwrap_err().to_string();
    assert!(error.contains("bounds"), "{error}");
}

#[test]
fn parts_are_kept_and_crumbs_left_out() {
    let two = Shape {
        reach: 2.1,
        distance: |x: &Vec3| {
            let ball = |at: f64, radius: f64| (x - Vec3::x() * at).norm() - radius;
            ball(-1.0, 0.5).min(ball(1.0, 0.5)).min(ball(0.0, 0.06))
        },
    };
    let mesh = fill_shape(&two, Sizes::uniform(0.1), &mut |_| {}).unwrap();
    assert!(mesh.points.iter().all(|x| x.x.abs() > 0.4));
    assert!(mesh.points.iter().any(|x| x.x > 0.4) && mesh.points.iter().any(|x| x.x < -0.4));
}

#[test]
fn a_surface_is_filled_with_elements_that_grow_inside() {
    let ring = torus(1.0, 0.45, [96, 48], |x| x);
    let fill =
        |element_m: f64, surface_m: Option<f64>| fill(&ring, Sizes { element_m, surface_m }, &mut |_| {}).unwrap();
    let [fine, graded] = [fill(0.05, None), fill(0.1, Some(0.05))];
    check_valid(&graded, |x| (x.xy().norm() - 1.0).hypot(x.z) - 0.45, 0.002);
    // Sums of 400,000 elements: the last digits are rounding.
    assert!((volume(&graded) / volume(&fine) - 1.0).abs() < 1e-10);
    assert_eq!(outer_faces(&graded).len(), outer_faces(&fine).len());
    assert!(graded.tetrahedra.len() * 4 < fine.tetrahedra.len() * 3);
    // A size that does not double once is that of all.
    assert_eq!(fine, fill(0.09, Some(0.05)));
}
