//! What the reduced surroundings of a patch cost: the whole, each of its parts, and what the nominal time says, on blocks of springs and
//! cubes of tetrahedra held at the bottom with the patch in the middle of the top.
//!
//! `taskset -c 0 cargo bench --bench reduced_basis [-- NODES_PER_EDGE ...]`

mod cubes;

use std::time::Instant;

use palpate_model::Vec3;
use palpate_model::body::{Block, Body};
use palpate_model::mesh::Face;
use palpate_model::surroundings::{Reduction, RestingBody};

use cubes::cube;

/// Of all cubes (m).
const EDGE: f64 = 0.1;
const STATES: usize = 250;
const ROUNDS: usize = 3;

/// Ids of the patch in the middle of the top of a cube of that edge (m).
fn patch(body: &dyn Body, edge: f64, size: [usize; 3]) -> Vec<u32> {
    let middle = Vec3::new(0.5 * edge, 0.5 * edge, edge);
    let far =
        |triangle: &[u32; 3]| triangle.iter().map(|&node| (body.rest()[node as usize] - middle).norm()).sum::<f64>();
    let triangles = body.surface().triangles.iter().enumerate();
    let (nearest, _) = triangles.min_by(|a, b| far(a.1).total_cmp(&far(b.1))).expect("it has a surface");
    let mut ids = Vec::new();
    body.patch(&[nearest as u32], size, &mut ids);
    ids
}

/// What this thread has run on a core (s): other work on the machine does not count. Elapsed time where that is not told.
fn cpu_s(begun: Instant) -> f64 {
    let told = std::fs::read_to_string("/proc/thread-self/schedstat").ok();
    let ns = told.and_then(|told| told.split_whitespace().next()?.parse::<f64>().ok());
    ns.map_or(begun.elapsed().as_secs_f64(), |ns| ns * 1e-9)
}

/// Seconds of each part.
fn parts(resting: &RestingBody, patch: &[u32]) -> Vec<f64> {
    let (mut times, start) = (Vec::new(), Instant::now());
    let mut begun = cpu_s(start);
    let mut lap = |times: &mut Vec<f64>| {
        let now = cpu_s(start);
        times.push(now - begun);
        begun = now;
    };
    let mut reduction = Reduction::new(resting, patch, STATES).expect("the body moves");
    lap(&mut times);
    loop {
        let basis = reduction.advance(resting).expect("the body is held");
        lap(&mut times);
        if basis.is_some() {
            return times;
        }
    }
}

fn main() {
    let asked: Vec<usize> = std::env::args().filter_map(|word| word.parse().ok()).collect();
    let sizes = if asked.is_empty() { vec![8, 12, 16, 24] } else { asked };
    println!("medians of {ROUNDS} rounds, ms of CPU time on one core; {STATES} states\n");
    println!("| nodes | ring | all | nominal | prepare | factorise | moments | project |");
    println!("| --- | ---: | ---: | ---: | ---: | ---: | ---: | ---: |");
    for nodes in sizes {
        let builder = Block::builder([nodes; 3], [EDGE; 3]).stiffness(30.0).node_mass(0.5e-3).damping_ratio(0.3);
        let block = builder.fix(Face::ZMin).build().expect("a valid block");
        row(&format!("{nodes}^3 springs"), &block, [6, 6, 3]);
        for (is_averaged, name) in [(false, "tetrahedra"), (true, "with nodal pressure")] {
            row(&format!("{nodes}^3 {name}"), &cube(6 * (nodes - 1).pow(3), EDGE, is_averaged), [4, 4, 3]);
        }
    }
}

/// Measures and prints `body` with a patch of that size.
fn row(name: &str, body: &dyn Body, size: [usize; 3]) {
    // A new one each time: of a large body it keeps what was made around a window for those that look the same.
    let resting = || RestingBody::new(body).expect("springs or elements");
    let patch = patch(body, EDGE, size);
    let reduction = Reduction::new(&resting(), &patch, STATES).expect("the body moves");
    let rounds = (0..ROUNDS).map(|_| parts(&resting(), &patch)).collect::<Vec<Vec<f64>>>();
    assert_eq!(rounds[0].len(), 1 + reduction.parts());
    let ring = body.restriction(&patch).map_or(0, |near| near.nodes.len() - patch.len());
    let median = |of: &dyn Fn(&[f64]) -> f64| {
        let mut values: Vec<f64> = rounds.iter().map(|round| 1e3 * of(round)).collect();
        values.sort_by(f64::total_cmp);
        values[values.len() / 2]
    };
    let last = rounds[0].len() - 1;
    println!(
        "| {name} | {ring} | {:.0} | {:.0} | {:.1} | {:.1} | {:.1} | {:.1} |",
        median(&|round| round.iter().sum()),
        1e3 * reduction.nominal(),
        median(&|round| round[0]),
        median(&|round| round[1]),
        median(&|round| round[2..last].iter().sum()),
        median(&|round| round[last]),
    );
}
