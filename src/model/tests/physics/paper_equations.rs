//! What the paper's printed contact equations do differently from the corrected ones.

use crate::common::*;
use palpate_model::Vec3;
use palpate_model::body::{Body, State};
use palpate_model::contact::{Contact, ContactMode, Deformable, Equations, Law, ToolMotion, step};
use palpate_model::mesh::Surface;
use palpate_model::simulation::Simulation;

const D: f64 = 0.5e-3;

fn law(equations: Equations, friction: f64) -> Law {
    Law { equations, friction: friction.into(), ..Law::default() }
}

/// One triangle in the x-y plane, nodes with masses and velocities of their own.
struct Triangle {
    surface: Surface,
    positions: Vec<Vec3>,
    velocities: Vec<Vec3>,
    inverse_masses: Vec<f64>,
}

impl Triangle {
    fn new(masses: [f64; 3], velocities: [Vec3; 3]) -> Self {
        Self {
            surface: Surface::new(3, vec![[0, 1, 2]]).unwrap(),
            positions: vec![Vec3::zeros(), Vec3::x() * 0.01, Vec3::y() * 0.01],
            velocities: velocities.into(),
            inverse_masses: masses.map(|m| 1.0 / m).into(),
        }
    }

    fn step(&mut self, contact: &mut Contact, law: &Law, tool: ToolMotion) -> Vec3 {
        let mut body = Deformable {
            positions: &mut self.positions,
            velocities: &mut self.velocities,
            inverse_masses: &self.inverse_masses,
            surface: &self.surface,
            candidates: &[0],
        };
        step(&mut body, &[Vec3::zeros(); 3], contact, law, tool, D)
    }

    fn energy(&self) -> f64 {
        self.velocities.iter().zip(&self.inverse_masses).map(|(v, w)| 0.5 * v.norm_squared() / w).sum()
    }

    fn point(&self, weights: &[f64; 3]) -> Vec3 {
        self.positions.iter().zip(weights).map(|(x, w)| x * *w).sum()
    }
}

const WEIGHTS: [f64; 3] = [0.5, 0.3, 0.2];

fn touching() -> Contact {
    Contact { triangle: Some(0), weights: WEIGHTS, mode: ContactMode::Stick, ..Contact::default() }
}

fn resting_tool(triangle: &Triangle) -> ToolMotion {
    let at = triangle.point(&WEIGHTS);
    ToolMotion::straight(at, at)
}

#[test]
fn the_printed_force_is_the_multiplier_for_equal_masses_only() {
    let up = [Vec3::z() * 0.2, Vec3::new(0.01, 0.02, 0.1), Vec3::z() * 0.3];
    let force = |masses, equations| {
        let mut triangle = Triangle::new(masses, up);
        let tool = resting_tool(&triangle);
        triangle.step(&mut touching(), &law(equations, f64::INFINITY), tool)
    };
    let equal = [0.5e-3; 3];
    let difference = force(equal, Equations::Paper) - force(equal, Equations::Corrected);
    assert!(difference.norm() < 1e-12 * force(equal, Equations::Corrected).norm());
    let unequal = [0.5e-3, 5e-3, 0.1e-3];
    let (printed, right) = (force(unequal, Equations::Paper), force(unequal, Equations::Corrected));
    assert!((printed - right).norm() > 0.2 * right.norm(), "{printed} against {right}");
}

#[test]
fn the_printed_projection_raises_kinetic_energy_with_unequal_masses() {
    let masses = [0.5e-3, 0.5e-3, 0.5];
    let velocities = [Vec3::z(), Vec3::z(), Vec3::zeros()];
    let gain = |equations| {
        let mut triangle = Triangle::new(masses, velocities);
        let (tool, before) = (resting_tool(&triangle), triangle.energy());
        triangle.step(&mut touching(), &law(equations, f64::INFINITY), tool);
        triangle.energy() / before
    };
    assert!(gain(Equations::Paper) > 10.0, "{}", gain(Equations::Paper));
    assert!(gain(Equations::Corrected) <= 1.0);
}

#[test]
fn printed_friction_is_raised_to_its_limit_when_it_slips_below_it() {
    let velocities = [Vec3::new(0.01, 0.0, 0.2); 3];
    let share = |equations, mode| {
        let mut triangle = Triangle::new([0.5e-3; 3], velocities);
        let tool = resting_tool(&triangle);
        let mut contact = Contact { mode, ..touching() };
        let force = triangle.step(&mut contact, &law(equations, 1.0), tool);
        force.xy().norm() / force.z
    };
    assert!((share(Equations::Paper, ContactMode::Slip) - 1.0).abs() < 1e-12);
    assert!((share(Equations::Paper, ContactMode::Stick) - 0.05).abs() < 1e-12);
    assert!((share(Equations::Corrected, ContactMode::Slip) - 0.05).abs() < 1e-12);
    // 0/0 in (27) is read as no friction, not as NaN.
    let mut still = Triangle::new([0.5e-3; 3], [Vec3::z() * 0.2; 3]);
    let tool = resting_tool(&still);
    let force = still.step(&mut Contact { mode: ContactMode::Slip, ..touching() }, &law(Equations::Paper, 1.0), tool);
    assert!(force.xy().norm() == 0.0 && force.z > 0.0, "{force}");
}

#[test]
fn the_geometric_push_puts_the_contact_point_on_the_tool() {
    let velocities = [Vec3::z() * 0.2; 3];
    let mut triangle = Triangle::new([0.5e-3, 1e-3, 2e-3], velocities);
    let start = triangle.point(&WEIGHTS);
    let tool = ToolMotion::straight(start, start + Vec3::new(2e-5, 1e-5, -4e-5));
    triangle.step(&mut touching(), &law(Equations::Paper, f64::INFINITY), tool);
    assert!((triangle.point(&WEIGHTS) - tool.to.position).norm() < 1e-16, "with friction: along the tool's motion");

    let mut triangle = Triangle::new([0.5e-3; 3], velocities);
    triangle.step(&mut touching(), &law(Equations::Paper, 0.0), tool);
    let gap = tool.to.position - triangle.point(&WEIGHTS);
    assert!(gap.z.abs() < 1e-9, "without: along the normal only, {gap}");
    assert!(gap.xy().norm() > 2e-5);
}

/// Force difference of the two sets of equations when a node is pulled and let back, % rms.
fn pull_difference(zeta: f64) -> f64 {
    let body = block((0.5e-3, 30.0, zeta));
    let node = body.lattice().id([5, 5, 11]);
    let rest = body.rest()[node as usize];
    let path: Vec<Vec3> = (0..=1100)
        .map(|k| {
            let t = f64::from(k) * 1e-3;
            rest + Vec3::z() * (0.02 * minjerk(t / 0.4) * (1.0 - minjerk((t - 0.6) / 0.4)))
        })
        .collect();
    let run = |equations| {
        let (state, contact) = (State::at_rest(body.rest()), glued(&body, node));
        let law = law(equations, f64::INFINITY);
        forces(&mut Simulation::new(Box::new(body.clone()), state, contact, law, STEPPING).unwrap(), &path)
    };
    rms_percent(&run(Equations::Paper), &run(Equations::Corrected))
}

#[test]
fn without_the_tools_velocity_contact_damping_is_lost() {
    let differences = [0.1, 0.3].map(pull_difference);
    println!("paper against corrected, pull, zeta 0.1 and 0.3: {differences:.2?} % rms");
    assert!(differences[0] > 0.1 && differences[0] < 1.0, "{differences:?}");
    assert!(differences[1] > 2.0 * differences[0] && differences[1] < 3.0, "{differences:?}");
}

#[test]
fn a_drag_with_the_printed_equations_runs_and_differs() {
    let path: Vec<Vec3> = (0..=1500).map(|k| drag_path(f64::from(k) * 1e-3)).collect();
    let run = |equations| {
        let body = block(STD);
        let state = State::at_rest(body.rest());
        let mut sim =
            Simulation::new(Box::new(body), state, Contact::default(), law(equations, 0.5), STEPPING).unwrap();
        forces(&mut sim, &path)
    };
    let (printed, right) = (run(Equations::Paper), run(Equations::Corrected));
    assert!(printed.iter().flatten().all(|c| c.is_finite()));
    let rms = rms_percent(&printed, &right);
    println!("paper against corrected, drag at friction 0.5: {rms:.2} % rms");
    assert!(rms > 0.5, "{rms}");
}
