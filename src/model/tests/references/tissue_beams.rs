//! Two bent bodies of tetrahedra against quadratic elements of another program (tests/reference/tissue/quadratic.py): how far
//! the deflection is from the converged one, and how fast it comes nearer with the mesh.

use crate::tissue_support::bent::*;
use crate::tissue_support::{forces, largest};
use palpate_model::body::Body;
use palpate_model::equilibrium::static_equilibrium;
use palpate_model::mesh::TetrahedralMesh;
use palpate_model::{Mat3, Vec3};

/// Prints a row of errors (%), each with the order at which it fell from the one before; returns both.
fn row(bent: Bent, split: Split, ratio: f64, is_averaged: bool, refinements: &[usize]) -> Vec<(f64, f64)> {
    let element = if is_averaged { "nodal pressure" } else { "plain" };
    let mut text = format!("| {} | {split:?} | {ratio} | {element} |", bent.name);
    let mut rows: Vec<(f64, f64)> = Vec::new();
    for (n, &refinement) in refinements.iter().enumerate() {
        let error = bent.error(split, refinement, ratio, is_averaged);
        let order =
            n.checked_sub(1).map(|n| (rows[n].0 / error).ln() / (refinement as f64 / refinements[n] as f64).ln());
        text += &order.map_or(format!(" {error:.1} |"), |order| format!(" {error:.1} ({order:.2}) |"));
        rows.push((error, order.unwrap_or(f64::NAN)));
    }
    println!("{text}");
    rows
}

#[test]
fn errors_fall_with_an_order_near_the_two_of_smooth_solutions() {
    // The clamped edge, where stress has no bound, takes away what is missing. An element of a wrong volume, gradient or law
    // comes to another solution: its order falls to 0.
    for bent in [CANTILEVER, COOK] {
        for (ratio, is_averaged) in [(0.3, false), (0.3, true), (0.45, true), (0.49, true)] {
            let rows = row(bent, Split::Centred, ratio, is_averaged, &[1, 2, 3]);
            assert!(rows.iter().all(|&(error, _)| error > 0.0), "too soft: {rows:?}");
            assert!(rows[2].0 < 4.5, "{rows:?}");
            assert!((1.55..2.05).contains(&rows[2].1), "{rows:?}");
        }
    }
}

#[test]
fn plain_elements_lock_near_incompressibility_and_nodal_pressure_does_not() {
    for bent in [CANTILEVER, COOK] {
        let error = |split, ratio, is_averaged| row(bent, split, ratio, is_averaged, &[3])[0].0;
        for (split, factor) in [(Split::Centred, 1.5), (Split::Diagonal, 4.5)] {
            let (averaged, plain) = (error(split, 0.49, true), error(split, 0.49, false));
            assert!(plain > factor * averaged, "{plain} and {averaged} %");
            let compressible = error(split, 0.3, true);
            assert!(averaged < 2.0 * compressible, "{averaged} % at 0.49, {compressible} % at 0.3");
        }
    }
}

/// The mesh under an orthogonal map; its elements are turned round if it mirrors.
fn mapped(mut mesh: TetrahedralMesh, map: &Mat3) -> TetrahedralMesh {
    mesh.points.iter_mut().for_each(|point| *point = map * *point);
    if map.determinant() < 0.0 {
        mesh.tetrahedra.iter_mut().for_each(|nodes| nodes.swap(2, 3));
    }
    mesh
}

#[test]
fn a_turned_and_a_mirrored_mesh_bend_the_same_way() {
    let turn = nalgebra::Rotation3::from_euler_angles(0.7, -0.4, 1.9).into_inner();
    let across = Vec3::new(0.3, -0.8, 0.5).normalize();
    let mirror = Mat3::identity() - 2.0 * across * across.transpose();
    for (split, is_averaged) in [(Split::Centred, true), (Split::Diagonal, true), (Split::Diagonal, false)] {
        let mesh = CANTILEVER.mesh(split, 1);
        let body = clamped(mesh.clone(), 0.49, is_averaged);
        let loads = CANTILEVER.loads(&body);
        let expected = displacements(&body, &loads);
        for map in [turn, mirror, turn * mirror] {
            let loads: Vec<Vec3> = loads.iter().map(|load| map * load).collect();
            let found = displacements(&clamped(mapped(mesh.clone(), &map), 0.49, is_averaged), &loads);
            let off: Vec<Vec3> = found.iter().zip(&expected).map(|(found, u)| found - map * u).collect();
            println!("{split:?}: off by {:.1e}", largest(&off) / largest(&expected));
            // Rounding, times the condition of the stiffness.
            assert!(largest(&off) < 1e-10 * largest(&expected));
        }
    }
}

#[test]
fn a_bent_beam_moves_sideways_only_where_the_mesh_has_a_direction() {
    let sideways = |split| {
        let body = clamped(CANTILEVER.mesh(split, 2), 0.49, true);
        let loads = CANTILEVER.loads(&body);
        let bent = displacements(&body, &loads);
        let across: Vec<Vec3> = loads.iter().map(|load| Vec3::y() * load.norm()).collect();
        (work(&across, &bent) / work(&loads, &bent)).abs()
    };
    let [centred, diagonal] = [Split::Centred, Split::Diagonal].map(sideways);
    println!("sideways: centred {:.1e} %, diagonal {:.2} %", 100.0 * centred, 100.0 * diagonal);
    assert!(centred < 1e-10, "{centred}");
    assert!(diagonal > 1e-3 && diagonal < 0.1, "{diagonal}: a one-sided mesh shows, and is no more than its error");
}

#[test]
fn the_equilibrium_of_an_end_that_is_held_where_a_load_moves_it_needs_that_load() {
    for is_averaged in [false, true] {
        let mut body = clamped(CANTILEVER.mesh(Split::Centred, 2), 0.49, is_averaged);
        let loads = CANTILEVER.loads(&body);
        let bent = displacements(&body, &loads);
        let end = (0..loads.len()).filter(|&node| loads[node] != Vec3::zeros());
        let held: Vec<(u32, Vec3)> = end.map(|node| (node as u32, body.rest()[node] + bent[node])).collect();
        let state = static_equilibrium(&mut body, &held).expect("an equilibrium");
        let reaction = forces(&mut body, &state);
        let needed: f64 = held.iter().map(|&(node, _)| -reaction[node as usize].dot(&CANTILEVER.direction)).sum();
        // The deflection is 5e-4 of the length, and the law of a bent beam is linear to its square.
        assert!((needed / LOAD - 1.0).abs() < 1e-4, "{needed} N");
        let off: Vec<Vec3> = state.positions.iter().zip(body.rest()).zip(&bent).map(|((x, r), u)| x - r - u).collect();
        assert!(largest(&off) < 1e-3 * largest(&bent), "{} of {} m", largest(&off), largest(&bent));
    }
}
