//! The spring kernels, side by side: nanoseconds per spring and evaluation of the force.
//!
//! Contestants take turns; each figure is the least of many rounds. `cargo bench --bench spring_kernel --features parallel`

mod common;

use std::hint::black_box;
use std::time::Instant;

use palpate_model::Vec3;
use palpate_model::body::{Block, Body, InstructionSet, Region, Shape, Spring, SpringNetwork, State};
use palpate_model::contact::{Contact, Law, ToolMotion};
use palpate_model::mesh::Face;
use palpate_model::simulation::{Simulation, Stepping};

use common::{Contestant, deformed, least};

fn block(nodes: usize) -> Block {
    let builder = Block::builder([nodes; 3], [0.1; 3]).stiffness(30.0).node_mass(0.5e-3).damping_ratio(0.3);
    builder.fix(Face::ZMin).build().expect("a valid block")
}

/// The same of several materials: layers of tissue, or another material in every node.
fn mixed(nodes: usize, is_layered: bool) -> Block {
    let builder = Block::builder([nodes; 3], [0.1; 3]).stiffness(30.0).node_mass(0.5e-3).damping_ratio(0.3);
    let spacing = 0.1 / (nodes - 1) as f64;
    let layer = |from, to, k| Region::new(Shape::Layer { axis: 2, from, to }).stiffness(k);
    let regions: Vec<Region> = if is_layered {
        vec![layer(0.0, 0.04, 60.0), layer(0.04, 0.085, 10.0), layer(0.085, 0.1, 120.0)]
    } else {
        let at = |n: usize| [n % nodes, n / nodes % nodes, n / (nodes * nodes)].map(|c| c as f64 * spacing);
        let one = |n: usize| Shape::Sphere { centre: at(n), radius: 0.1 * spacing };
        (0..nodes.pow(3)).map(|n| Region::new(one(n)).stiffness(30.0 + n as f64 * 1e-3)).collect()
    };
    let builder = regions.into_iter().fold(builder, |builder, region| builder.region(region));
    builder.fix(Face::ZMin).build().expect("a valid block")
}

/// The straightforward loop over a list.
fn scalar(springs: &[(u32, u32, Spring)], state: &State, forces: &mut [Vec3]) {
    forces.fill(Vec3::zeros());
    for (i, j, spring) in springs {
        let (i, j) = (*i as usize, *j as usize);
        let along = state.positions[j] - state.positions[i];
        let closing = state.velocities[j] - state.velocities[i];
        let force = spring.force(along, closing);
        forces[i] += force;
        forces[j] -= force;
    }
}

/// A body's forces in a deformed state.
fn forces(mut body: impl Body + 'static, state: &State) -> Box<dyn FnMut()> {
    let (state, mut out) = (state.clone(), vec![Vec3::zeros(); state.positions.len()]);
    Box::new(move || body.forces(black_box(&state), &mut out))
}

fn network(block: &Block) -> SpringNetwork {
    let builder = SpringNetwork::builder(block.rest().to_vec()).masses(vec![0.5e-3; block.rest().len()]);
    builder.springs(block.springs()).build().expect("a valid network")
}

/// The same network, and a state of it, with its nodes in no order.
fn shuffled(block: &Block, state: &State) -> (SpringNetwork, State) {
    let mut order: Vec<usize> = (0..block.rest().len()).collect();
    order.sort_by_key(|&n| (n as u64).wrapping_mul(0x9e37_79b9_7f4a_7c15));
    let mut place = vec![0; order.len()];
    order.iter().enumerate().for_each(|(new, &old)| place[old] = new as u32);
    let pick = |vectors: &[Vec3]| order.iter().map(|&old| vectors[old]).collect::<Vec<_>>();
    let springs = block.springs().into_iter().map(|(i, j, spring)| (place[i as usize], place[j as usize], spring));
    let builder = SpringNetwork::builder(pick(block.rest())).masses(vec![0.5e-3; order.len()]).springs(springs);
    let state = State { positions: pick(&state.positions), velocities: pick(&state.velocities) };
    (builder.build().expect("a valid network"), state)
}

fn per_spring(nodes: usize) {
    let (whole, state) = (block(nodes), deformed(block(nodes).rest()));
    let (springs, net) = (whole.springs(), network(&whole));
    let mut contestants: Vec<Contestant> = Vec::new();
    let (count, s, mut out) = (springs.len(), state.clone(), vec![Vec3::zeros(); state.positions.len()]);
    contestants.push(("scalar loop over a list".into(), Box::new(move || scalar(black_box(&springs), &s, &mut out))));
    for set in InstructionSet::ALL.into_iter().filter(|set| set.is_available()) {
        let block = whole.clone().with_instruction_set(set).expect("it is available");
        contestants.push((format!("lattice, {}", set.name()), forces(block, &state)));
        let net = net.clone().with_instruction_set(set).expect("it is available");
        contestants.push((format!("network, {}", set.name()), forces(net, &state)));
    }
    contestants.push(("lattice, layers of three materials".into(), forces(mixed(nodes, true), &state)));
    contestants.push(("lattice, another material in each node".into(), forces(mixed(nodes, false), &state)));
    let (shuffled, shuffled_state) = shuffled(&whole, &state);
    contestants.push(("network, shuffled nodes".into(), forces(shuffled, &shuffled_state)));
    let times = least(&mut contestants, 40, 10);
    for ((name, _), time) in contestants.iter().zip(&times) {
        let share = times[0] / time;
        println!("| {nodes}^3 | {name} | {:.1} | {:.2} | {share:.1} |", time * 1e6, time * 1e9 / count as f64);
    }
}

#[cfg(feature = "parallel")]
fn two_cores(nodes: usize) {
    let (whole, state) = (block(nodes), deformed(block(nodes).rest()));
    let net = network(&whole);
    let mut contestants: Vec<Contestant> = vec![
        ("lattice".into(), forces(whole.clone(), &state)),
        ("lattice".into(), forces(whole.on_cores(2).expect("threads"), &state)),
        ("network".into(), forces(net.clone(), &state)),
        ("network".into(), forces(net.on_cores(2).expect("threads"), &state)),
    ];
    let times = least(&mut contestants, 400, 1);
    for pair in 0..2 {
        let (name, one, two) = (&contestants[2 * pair].0, times[2 * pair], times[2 * pair + 1]);
        println!("| {nodes}^3 | {name} | {:.1} | {:.1} | {:.2} |", one * 1e6, two * 1e6, one / two);
    }
}

/// Half the ticks of `full` take longer than this: two substeps of the 12^3 body with a tool that rubs over it.
fn full_tick() -> f64 {
    let body = block(12);
    let state = State::at_rest(body.rest());
    let law = Law { friction: 0.5.into(), ..Law::default() };
    let stepping = Stepping { tick: 1e-3, substeps: 2 };
    let mut sim = Simulation::new(Box::new(body), state, Contact::default(), law, stepping).expect("it fits");
    let path = |k: usize| {
        let (pressed, angle) = ((k as f64 / 100.0).min(1.0), k as f64 * 0.01);
        Vec3::new(0.047 + 5e-3 * angle.cos(), 0.0512 + 5e-3 * angle.sin(), 0.101 - 0.006 * pressed)
    };
    let tick = |k: usize, sim: &mut Simulation| {
        let start = Instant::now();
        black_box(sim.tick(ToolMotion::straight(path(k), path(k + 1))));
        start.elapsed().as_secs_f64()
    };
    (0..200).for_each(|k| {
        tick(k, &mut sim);
    });
    let mut times: Vec<f64> = (200..5200).map(|k| tick(k, &mut sim)).collect();
    assert!(sim.contact(0).is_touching(), "the ticks measured have a contact in them");
    times.sort_by(f64::total_cmp);
    times[times.len() / 2]
}

fn main() {
    println!("instruction set of this machine: {}\n", InstructionSet::detect().name());
    println!("| body | forces | us | ns per spring | times faster |\n| --- | --- | ---: | ---: | ---: |");
    per_spring(12);
    per_spring(24);
    #[cfg(feature = "parallel")]
    {
        println!("\n| body | forces | us on 1 core | us on 2 | ratio |\n| --- | --- | ---: | ---: | ---: |");
        [8, 12, 16, 24, 32].into_iter().for_each(two_cores);
    }
    let p50 = (0..5).map(|_| full_tick()).fold(f64::INFINITY, f64::min);
    println!("\ntick of `full` with contact, 12^3, 2 substeps: p50 {:.1} us", p50 * 1e6);
}
