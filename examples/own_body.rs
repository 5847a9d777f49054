//! A deformable body of the program's own as the global model: a soft ball with skin, flesh and stone.
//!
//! The ball is no block: its nodes are two nested spheres of triangles around a stone that is held, its springs run along
//! an arbitrary list of edges with a stiffness each, and its masses differ from node to node. All that palpate asks of it
//! is `impl Body`. A tool presses 7 mm into its top and rubs across it.
//!
//! Look for: a real-time run with every period kept, then what the local model of the ball costs in fidelity: `patch`
//! and `hold` against `full`, the whole ball at 1 kHz, in virtual time.
//!
//! `cargo run --release --example own_body`

#[path = "common/forces.rs"]
mod forces;

use std::collections::{BTreeMap, BTreeSet};

use forces::{Difference, forces, peak};
use palpate::model::body::{Body, Spring, State, TangentBlock};
use palpate::model::local::Kind as LocalModelKind;
use palpate::model::mesh::Surface;
use palpate::prelude::*;
use palpate::session::SessionBuilder;

/// Radius of the skin, and of the flesh's nodes below it (m).
const SKIN_RADIUS: f64 = 0.05;
const FLESH_RADIUS: f64 = 0.035;
/// Masses of skin and flesh, spread over their nodes (kg).
const SKIN_MASS: f64 = 0.08;
const FLESH_MASS: f64 = 0.12;
/// Stiffness (N/m) of a spring of the skin, between skin and flesh, and to the stone.
const SKIN_STIFFNESS: f64 = 60.0;
const FLESH_STIFFNESS: f64 = 25.0;
const STONE_STIFFNESS: f64 = 15.0;
/// Damping of a spring per stiffness (s).
const DAMPING_TIME: f64 = 2e-3;

/// A ball of springs over an arbitrary list of edges.
#[derive(Clone, Debug)]
struct Ball {
    rest: Vec<Vec3>,
    inverse_masses: Vec<f64>,
    surface: Surface,
    /// Every spring once, with the two nodes that it joins.
    springs: Vec<(u32, u32, Spring)>,
    /// For each node its neighbours, by spring.
    neighbours: Vec<Vec<(u32, Spring)>>,
}

impl Ball {
    /// A ball whose skin is an icosahedron split `splits` times.
    fn new(splits: u32) -> Result<Self, Error> {
        let (directions, triangles) = icosphere(splits);
        let skin = directions.len();
        // Node n of the skin lies over node skin + n of the flesh; the stone comes last.
        let stone = 2 * skin as u32;
        let rest: Vec<Vec3> = directions
            .iter()
            .map(|d| d * SKIN_RADIUS)
            .chain(directions.iter().map(|d| d * FLESH_RADIUS))
            .chain([Vec3::zeros()])
            .collect();

        // A node stands for a third of each triangle around it, so masses are as unequal as the triangles.
        let mut share = vec![0.0; skin];
        for &[a, b, c] in &triangles {
            let [p, q, r] = [a, b, c].map(|node| directions[node as usize]);
            let area = (q - p).cross(&(r - p)).norm() / 2.0;
            for node in [a, b, c] {
                share[node as usize] += area / 3.0;
            }
        }
        let whole: f64 = share.iter().sum();
        let masses = |mass: f64| share.iter().map(move |share| mass * share / whole);
        let inverse_masses = masses(SKIN_MASS).chain(masses(FLESH_MASS)).map(|m| 1.0 / m).chain([0.0]).collect();

        let edges: BTreeSet<(u32, u32)> = triangles
            .iter()
            .flat_map(|&[a, b, c]| [(a, b), (b, c), (c, a)])
            .map(|(a, b)| (a.min(b), a.max(b)))
            .collect();
        let below = |node: u32| node + skin as u32;
        let mut springs = Vec::new();
        let mut join = |a: u32, b: u32, stiffness: f64| {
            let rest_length = (rest[a as usize] - rest[b as usize]).norm();
            springs.push((a, b, Spring { stiffness, damping: stiffness * DAMPING_TIME, rest_length }));
        };
        for &(a, b) in &edges {
            join(a, b, SKIN_STIFFNESS);
            join(below(a), below(b), FLESH_STIFFNESS);
            // Both diagonals: skin and flesh must not slide over each other for free.
            join(a, below(b), FLESH_STIFFNESS);
            join(b, below(a), FLESH_STIFFNESS);
        }
        for node in 0..skin as u32 {
            join(node, below(node), FLESH_STIFFNESS);
            join(below(node), stone, STONE_STIFFNESS);
        }
        let mut neighbours = vec![Vec::new(); rest.len()];
        for &(a, b, spring) in &springs {
            neighbours[a as usize].push((b, spring));
            neighbours[b as usize].push((a, spring));
        }
        let surface = Surface::new(rest.len(), triangles)?;
        Ok(Self { rest, inverse_masses, surface, springs, neighbours })
    }

    /// Nodes of the skin; they come first.
    fn skin(&self) -> u32 {
        (self.rest.len() as u32 - 1) / 2
    }
}

impl Body for Ball {
    fn rest(&self) -> &[Vec3] {
        &self.rest
    }

    fn inverse_masses(&self) -> &[f64] {
        &self.inverse_masses
    }

    fn surface(&self) -> &Surface {
        &self.surface
    }

    fn forces(&mut self, state: &State, forces: &mut [Vec3]) {
        forces.fill(Vec3::zeros());
        for &(a, b, spring) in &self.springs {
            let (along, closing) = between(state, a, b);
            let force = spring.force(along, closing);
            forces[a as usize] += force;
            forces[b as usize] -= force;
        }
    }

    fn node_forces(&self, state: &State, nodes: &[u32], forces: &mut [Vec3]) {
        for (&node, force) in nodes.iter().zip(forces) {
            *force = self.neighbours[node as usize].iter().fold(Vec3::zeros(), |sum, &(other, spring)| {
                let (along, closing) = between(state, node, other);
                sum + spring.force(along, closing)
            });
        }
    }

    fn tangent(&self, state: &State, nodes: &[u32], clamp: bool, emit: &mut dyn FnMut(TangentBlock)) {
        for &row in nodes {
            for &(column, spring) in &self.neighbours[row as usize] {
                let (along, closing) = between(state, row, column);
                let tangent = spring.tangent(along, closing, clamp);
                TangentBlock::pair(row, column, &tangent).into_iter().for_each(&mut *emit);
            }
        }
    }

    /// The skin around the triangles, ring by ring, and the flesh below it: a patch of skin alone would be too soft to
    /// press against and too stiff to rub.
    fn patch(&self, triangles: &[u32], size: [usize; 3], nodes: &mut Vec<u32>) {
        let corners = triangles.iter().flat_map(|&triangle| self.surface.triangles[triangle as usize]);
        let mut rings: BTreeSet<u32> = corners.collect();
        while rings.len() < size[0] * size[1] {
            let grown: BTreeSet<u32> = rings
                .iter()
                .flat_map(|&node| self.surface.at_node(node))
                .flat_map(|&t| self.surface.triangles[t as usize])
                .collect();
            if grown.len() == rings.len() {
                break;
            }
            rings = grown;
        }
        nodes.clear();
        nodes.extend(&rings);
        if size[2] > 1 {
            nodes.extend(rings.iter().map(|node| node + self.skin()));
        }
    }
}

/// x_b - x_a and v_b - v_a.
fn between(state: &State, a: u32, b: u32) -> (Vec3, Vec3) {
    let (a, b) = (a as usize, b as usize);
    (state.positions[b] - state.positions[a], state.velocities[b] - state.velocities[a])
}

/// Unit directions and triangles, counter-clockwise seen from outside, of an icosahedron whose triangles are split
/// into four `splits` times.
fn icosphere(splits: u32) -> (Vec<Vec3>, Vec<[u32; 3]>) {
    // Top, two rings of five, bottom.
    let ring = |z: f64, turn: f64, i: u32| {
        let (angle, radius) = ((f64::from(i) + turn) * std::f64::consts::TAU / 5.0, (1.0 - z * z).sqrt());
        Vec3::new(radius * angle.cos(), radius * angle.sin(), z)
    };
    let z = 1.0 / 5.0_f64.sqrt();
    let mut directions = vec![Vec3::z()];
    directions.extend((0..5).map(|i| ring(z, 0.0, i)));
    directions.extend((0..5).map(|i| ring(-z, 0.5, i)));
    directions.push(-Vec3::z());
    let mut triangles: Vec<[u32; 3]> = (0..5)
        .flat_map(|i| {
            let next = (i + 1) % 5;
            let (upper, lower) = ([1 + i, 1 + next], [6 + i, 6 + next]);
            [
                [0, upper[0], upper[1]],
                [upper[0], lower[0], upper[1]],
                [upper[1], lower[0], lower[1]],
                [lower[0], 11, lower[1]],
            ]
        })
        .collect();
    for _ in 0..splits {
        let mut middles: BTreeMap<(u32, u32), u32> = BTreeMap::new();
        let mut middle = |a: u32, b: u32| {
            *middles.entry((a.min(b), a.max(b))).or_insert_with(|| {
                directions.push((directions[a as usize] + directions[b as usize]).normalize());
                directions.len() as u32 - 1
            })
        };
        triangles = triangles
            .iter()
            .flat_map(|&[a, b, c]| {
                let [ab, bc, ca] = [middle(a, b), middle(b, c), middle(c, a)];
                [[a, ab, ca], [b, bc, ab], [c, ca, bc], [ab, bc, ca]]
            })
            .collect();
    }
    (directions, triangles)
}

/// Down onto the top, 7 mm in, 2 cm across, up.
fn rub() -> Result<ToolPath, Error> {
    let (times, x, z) = ([0.0, 0.4, 1.4, 1.7], [-0.01, -0.01, 0.01, 0.01], [0.052, 0.043, 0.043, 0.054]);
    ToolPath::new(times.into(), x.into_iter().zip(z).map(|(x, z)| [x, 0.001, z]).collect())
}

fn session(ball: &Ball) -> Result<SessionBuilder, Error> {
    Ok(Session::builder(ball.clone()).path(rub()?).friction(0.3).crossfade_ms(10.0).duration_s(1.8))
}

fn main() -> Result<(), Error> {
    let ball = Ball::new(2)?;
    let lightest = ball.inverse_masses.iter().copied().fold(0.0, f64::max);
    let heaviest = ball.inverse_masses.iter().copied().filter(|&w| w > 0.0).fold(f64::INFINITY, f64::min);
    println!(
        "A ball of {} nodes, {} springs and {} triangles; node masses {:.2} g to {:.2} g.\n",
        ball.rest.len(),
        ball.springs.len(),
        ball.surface.triangles.len(),
        1e3 / lightest,
        1e3 / heaviest
    );

    println!("Real time, model patch:\n{}", session(&ball)?.model(LocalModelKind::Patch).build()?.run()?);

    let run = |model: LocalModelKind| -> Result<Vec<Vec3>, Error> {
        let summary = session(&ball)?.model(model).virtual_time().keep_records().build()?.run()?;
        Ok(forces(&summary.records))
    };
    let full = run(LocalModelKind::Full)?;
    println!("Virtual time, against the whole ball at 1 kHz (full, peak {:.2} N), in % of that peak:", peak(&full));
    for model in [LocalModelKind::Hold, LocalModelKind::Patch] {
        let off = Difference::of(&run(model)?, &full, peak(&full));
        println!(
            "  {:<5}  rms {:4.1}   max {:5.1}   worst one-tick jump {:4.1}",
            model.name(),
            off.rms,
            off.max,
            off.jump
        );
    }
    Ok(())
}
