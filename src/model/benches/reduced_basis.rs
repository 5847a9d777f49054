//! What the reduced surroundings of a patch cost: the whole, and each of its parts, on blocks held at the bottom with the
//! patch in the middle of the top.
//!
//! `taskset -c 0 cargo bench --bench reduced_basis [-- NODES_PER_EDGE ...]`

use std::time::Instant;

use palpate_model::body::{Block, Body};
use palpate_model::mesh::Face;
use palpate_model::surroundings::{Reduction, RestingBody, Size};

const PATCH: [usize; 3] = [6, 6, 3];
const STATES: usize = 150;
const BUDGET: Size = Size::ErrorPct(0.5);
const ROUNDS: usize = 5;

/// Ids of the patch in the middle of the top.
fn patch(nodes: usize) -> Vec<u32> {
    let from = [(nodes - PATCH[0]) / 2, (nodes - PATCH[1]) / 2, nodes - PATCH[2]];
    let mut ids = Vec::new();
    for k in 0..PATCH[2] {
        for j in 0..PATCH[1] {
            ids.extend((0..PATCH[0]).map(|i| (from[0] + i + nodes * (from[1] + j + nodes * (from[2] + k))) as u32));
        }
    }
    ids.sort_unstable();
    ids
}

/// What this thread has run on a core (s): other work on the machine does not count. Elapsed time where that is not told.
fn cpu_s(begun: Instant) -> f64 {
    let told = std::fs::read_to_string("/proc/thread-self/schedstat").ok();
    let ns = told.and_then(|told| told.split_whitespace().next()?.parse::<f64>().ok());
    ns.map_or(begun.elapsed().as_secs_f64(), |ns| ns * 1e-9)
}

/// Seconds of each part.
fn parts(resting: &RestingBody, patch: &[u32], size: Size) -> Vec<f64> {
    let (mut times, start) = (Vec::new(), Instant::now());
    let mut begun = cpu_s(start);
    let mut lap = |times: &mut Vec<f64>| {
        let now = cpu_s(start);
        times.push(now - begun);
        begun = now;
    };
    let mut reduction = Reduction::new(resting, patch, size).expect("the body moves");
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
    let sizes = if asked.is_empty() { vec![12, 16, 24] } else { asked };
    println!("medians of {ROUNDS} rounds, ms of CPU time on one core; {STATES} states, and those that 0.5 % ask for\n");
    println!("| nodes | all | prepare | factorise | moments | project | all, by the budget |");
    println!("| --- | ---: | ---: | ---: | ---: | ---: | ---: |");
    for nodes in sizes {
        let builder = Block::builder([nodes; 3], [0.1; 3]).stiffness(30.0).node_mass(0.5e-3).damping_ratio(0.3);
        let body = builder.fix(Face::ZMin).build().expect("a valid block");
        let (resting, patch) = (RestingBody::new(&body).expect("springs"), patch(nodes));
        let [by_states, by_budget] = [Size::States(STATES), BUDGET]
            .map(|size| (0..ROUNDS).map(|_| parts(&resting, &patch, size)).collect::<Vec<Vec<f64>>>());
        let median = |rounds: &[Vec<f64>], of: &dyn Fn(&[f64]) -> f64| {
            let mut values: Vec<f64> = rounds.iter().map(|round| 1e3 * of(round)).collect();
            values.sort_by(f64::total_cmp);
            values[values.len() / 2]
        };
        let last = by_states[0].len() - 1;
        println!(
            "| {nodes}^3 | {:.0} | {:.1} | {:.1} | {:.1} | {:.1} | {:.0} |",
            median(&by_states, &|round| round.iter().sum()),
            median(&by_states, &|round| round[0]),
            median(&by_states, &|round| round[1]),
            median(&by_states, &|round| round[2..last].iter().sum()),
            median(&by_states, &|round| round[last]),
            median(&by_budget, &|round| round.iter().sum()),
        );
        assert!(body.rest().len() == nodes.pow(3));
    }
}
