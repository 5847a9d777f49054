//! `full` of a body of tetrahedra against force series of an independent implementation.

use crate::tissue_support::*;
use palpate_model::Vec3;
use palpate_model::body::{Body, State, Tissue};
use palpate_model::contact::{Contact, Law};
use palpate_model::simulation::{Simulation, Stepping};

/// The reference's deviation, root mean square in percent of its peak.
fn deviation(name: &str, tissue: Tissue, is_averaged: bool, friction: f64) -> f64 {
    // The group `attached` of the file is empty: the reference holds what is at z = 0.
    let body = body(organ(), tissue, is_averaged);
    assert_eq!((body.rest().len(), body.element_count()), (1125, 4238));
    let state = State::at_rest(body.rest());
    let law = Law { friction: friction.into(), ..Law::default() };
    let stepping = Stepping { tick: 1e-3, substeps: 4 };
    let mut simulation = Simulation::new(Box::new(body), state, Contact::default(), law, stepping).expect("it fits");
    let forces = crate::common::forces(&mut simulation, &series(&format!("{name}.path.csv")));
    let expected: Vec<Vec3> = series(&format!("{name}.force.csv"));
    let rms = crate::common::rms_percent(&forces, &expected);
    println!("{name}: {rms:.2e} %");
    rms
}

#[test]
fn a_drag_over_an_organ_of_plain_elements_feels_the_reference_force() {
    let tissue = Tissue { young_modulus: 5e3, poisson_ratio: 0.45, density: 1060.0, viscosity: 2.0 };
    assert!(deviation("t1_drag", tissue, false, 0.5) < 1e-3);
}

#[test]
fn a_circle_over_a_nearly_incompressible_organ_feels_the_reference_force() {
    let tissue = Tissue { young_modulus: 6e3, poisson_ratio: 0.49, density: 1060.0, viscosity: 3.0 };
    assert!(deviation("t2_circle_incompressible", tissue, true, 0.3) < 1e-3);
}
