//! The restriction of a body to some of its nodes: the same forces there, and nothing of them in what is left.

use palpate_model::Vec3;
use palpate_model::body::{Block, Body, Region, Restriction, Shape, SpringNetwork, State};
use palpate_model::mesh::Face;
use proptest::prelude::*;

/// A block of two materials, held below.
fn block() -> Block {
    let stiff = Region::new(Shape::Sphere { centre: [0.03, 0.03, 0.05], radius: 0.02 }).stiffness(200.0);
    Block::builder([6, 5, 5], [0.06, 0.05, 0.05]).region(stiff).fix(Face::ZMin).build().unwrap()
}

/// The same as a network.
fn network(block: &Block) -> SpringNetwork {
    let masses = vec![0.5e-3; block.rest().len()];
    let builder = SpringNetwork::builder(block.rest().to_vec()).masses(masses).springs(block.springs());
    let held = (0..).zip(block.inverse_masses()).filter(|(_, w)| **w == 0.0);
    held.fold(builder, |builder, (node, _)| builder.fix(node)).build().unwrap()
}

/// Every node somewhere else, and moving.
fn shaken(body: &dyn Body, seed: f64) -> State {
    let wave = |n: usize, k: f64| {
        let n = n as f64;
        Vec3::new((k * n + seed).sin(), (1.3 * k * n + seed).cos(), (1.7 * k * n).sin())
    };
    let positions = body.rest().iter().enumerate().map(|(n, x)| x + wave(n, 1.1) * 1e-3).collect();
    State { positions, velocities: (0..body.rest().len()).map(|n| wave(n, 2.3) * 0.1).collect() }
}

/// Its force on the nodes asked for is that of the whole body, and its own nodes are in the order that it promises.
fn check(body: &mut dyn Body, asked: &[u32], seed: f64) {
    let state = shaken(body, seed);
    let Restriction { nodes, body: mut part } = body.restriction(asked).unwrap();
    assert_eq!(&nodes[..asked.len()], asked);
    let is_held = |node: &u32| body.inverse_masses()[*node as usize] == 0.0;
    assert!(nodes[asked.len()..].is_sorted_by_key(|node| (is_held(node), *node)));
    let of = |all: &[Vec3]| nodes.iter().map(|&node| all[node as usize]).collect::<Vec<_>>();
    assert_eq!(part.rest(), of(body.rest()));
    let inner = State { positions: of(&state.positions), velocities: of(&state.velocities) };
    let (mut whole, mut own) = (vec![Vec3::zeros(); body.rest().len()], vec![Vec3::zeros(); nodes.len()]);
    body.forces(&state, &mut whole);
    part.forces(&inner, &mut own);
    for (place, &node) in asked.iter().enumerate() {
        assert!((own[place] - whole[node as usize]).norm() < 1e-13, "node {node}");
    }
    // What the part does to its other nodes is what it takes from those asked for.
    assert!(own.iter().sum::<Vec3>().norm() < 1e-12);
}

proptest! {
    #[test]
    fn it_exerts_what_the_whole_body_does(asked in prop::collection::btree_set(0_u32..150, 1..40), seed in 0.0..6.0) {
        let (mut block, asked) = (block(), asked.into_iter().collect::<Vec<_>>());
        let mut network = network(&block);
        check(&mut block, &asked, seed);
        check(&mut network, &asked, seed);
        // In any order.
        let backwards: Vec<u32> = asked.iter().rev().copied().collect();
        check(&mut block, &backwards, seed);
    }
}
