//! What several test programs share: the reference series and the scenes they were made with.
#![allow(dead_code)]

use palpate_model::Vec3;
use palpate_model::body::{Block, Body, State};
use palpate_model::contact::{Contact, Friction, Law, ToolMotion, ToolShape};
use palpate_model::mesh::Face;
use palpate_model::simulation::{Simulation, Stepping};

/// Parameter sets of the reference data.
pub const STD: (f64, f64, f64) = (0.5e-3, 30.0, 0.3);
pub const SLOW: (f64, f64, f64) = (1e-3, 6.0, 1.0);

/// The reference block: 12^3 nodes, side 0.1 m, bottom held.
pub fn block((mass, stiffness, zeta): (f64, f64, f64)) -> Block {
    cube(12, (mass, stiffness, zeta))
}

pub fn cube(nodes: usize, (mass, stiffness, zeta): (f64, f64, f64)) -> Block {
    let builder = Block::builder([nodes; 3], [0.1; 3]).node_mass(mass).stiffness(stiffness).damping_ratio(zeta);
    builder.fix(Face::ZMin).build().expect("a valid block")
}

pub const STEPPING: Stepping = Stepping { tick: 1e-3, substeps: 2 };

/// The contact that glues a tool to `node`.
pub fn glued(body: &dyn Body, node: u32) -> Contact {
    let triangle = body.surface().at_node(node)[0];
    let weights = body.surface().triangles[triangle as usize].map(|n| if n == node { 1.0 } else { 0.0 });
    Contact::glued(triangle, weights)
}

pub fn simulation(body: Block, contact: Contact, friction: impl Into<Friction>) -> Simulation {
    let state = State::at_rest(body.rest());
    Simulation::new(Box::new(body), state, contact, Law { friction: friction.into(), ..Law::default() }, STEPPING)
        .expect("it fits")
}

/// Columns of a reference series, without the header.
pub fn reference(name: &str) -> Vec<Vec<f64>> {
    // Programs of several crates share this file.
    let here = std::path::Path::new(env!("CARGO_MANIFEST_DIR"));
    let folder = here.ancestors().map(|folder| folder.join("tests/reference")).find(|folder| folder.is_dir());
    let path = folder.expect("the reference series are in the repository").join(format!("{name}.csv"));
    let text = std::fs::read_to_string(&path).unwrap_or_else(|error| panic!("{}: {error}", path.display()));
    let parse = |line: &str| line.split(',').map(|cell| cell.parse().expect("a number")).collect();
    text.lines().skip(1).map(parse).collect()
}

pub fn minjerk(u: f64) -> f64 {
    let u = u.clamp(0.0, 1.0);
    u.powi(3) * (10.0 + u * (6.0 * u - 15.0))
}

/// The reference's drag path at time t (s).
pub fn drag_path(t: f64) -> Vec3 {
    let x = 0.025 + 0.025 * minjerk((t - 0.5) / 1.5);
    let z = 0.101 - 0.009 * minjerk(t / 0.3) + 0.011 * minjerk((t - 2.2) / 0.3);
    Vec3::new(x, 0.0512, z)
}

/// Forces of every tick along `path` (a position per tick, tick 0 first).
pub fn forces(simulation: &mut Simulation, path: &[Vec3]) -> Vec<Vec3> {
    path.windows(2).map(|q| simulation.tick(ToolMotion::straight(q[0], q[1])).force).collect()
}

/// Root mean square of the difference, in percent of the reference's peak.
pub fn rms_percent(forces: &[Vec3], reference: &[Vec3]) -> f64 {
    assert_eq!(forces.len(), reference.len());
    let peak = reference.iter().map(|f| f.norm()).fold(0.0, f64::max);
    let sum: f64 = forces.iter().zip(reference).map(|(a, b)| (a - b).norm_squared()).sum();
    100.0 * (sum / forces.len() as f64).sqrt() / peak
}

/// Work that a frictionless tool gets from the body over one closed circle (after one to settle), and the most that it
/// had put in before (J).
pub fn circle(zeta: f64, shape: ToolShape) -> (f64, f64) {
    let mut body = block((0.5e-3, 30.0, zeta));
    let stepping = Stepping { tick: 1e-3, substeps: Stepping::stable_substeps(&mut body, 1e-3) };
    let state = State::at_rest(body.rest());
    let mut sim = Simulation::new(Box::new(body), state, Contact::default(), Law::default(), stepping)
        .unwrap()
        .with_shape(0, shape);
    let centre = Vec3::new(0.05, 0.0512, 0.0);
    let path = |tick: i32| {
        let t = f64::from(tick) * 1e-3;
        let angle = std::f64::consts::TAU * (t - 0.4).max(0.0);
        let around = Vec3::new(angle.cos(), angle.sin(), 0.0) * 0.012;
        centre + around + Vec3::z() * (0.101 + shape.radius() - 0.007 * minjerk(t / 0.3))
    };
    let (mut got, mut put_in, mut most) = (0.0, 0.0, 0.0_f64);
    for tick in 0..2400 {
        let tool = ToolMotion::straight(path(tick), path(tick + 1));
        let work = sim.tick(tool).force.dot(&tool.way());
        put_in -= work;
        most = most.max(put_in);
        if tick >= 1400 {
            got += work;
        }
    }
    (got, most)
}
