//! The kernel of networks against [`Spring::force`], spring by spring, and against that of blocks: every instruction set of this
//! machine, any state.

use crate::kernel_support::*;
use palpate_model::Vec3;
use palpate_model::body::{Block, Body, Spring, SpringNetwork, State};
use proptest::prelude::*;

/// A network of `rest`.
fn network(rest: &[Vec3], springs: &[(u32, u32, Spring)]) -> SpringNetwork {
    let builder = SpringNetwork::builder(rest.to_vec()).masses(vec![0.5e-3; rest.len()]);
    builder.springs(springs.iter().copied()).build().unwrap()
}

fn vectors(nodes: usize, size: f64) -> impl Strategy<Value = Vec<Vec3>> {
    let vector = prop::array::uniform3(-size..=size).prop_map(Vec3::from);
    prop::collection::vec(vector, nodes)
}

/// A block of any size, and displacements and velocities of its nodes.
fn any_block() -> impl Strategy<Value = (Block, State)> {
    // The exponent makes displacements from far below the spacing to far beyond the body.
    (prop::array::uniform3(2_usize..7), -6..3_i32).prop_flat_map(|(nodes, exponent)| {
        let count: usize = nodes.iter().product();
        let states = (vectors(count, 10_f64.powi(exponent)), vectors(count, 10.0));
        states.prop_map(move |(displacements, velocities)| {
            let block = Block::builder(nodes, [0.1, 0.12, 0.07]).build().unwrap();
            let positions = block.rest().iter().zip(displacements).map(|(x, u)| x + u).collect();
            (block, State { positions, velocities })
        })
    })
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(128))]

    #[test]
    fn a_lattice_and_a_network_have_the_forces_of_their_springs_in_any_order(
        (block, mut state) in any_block(),
        collapsed in any::<prop::sample::Index>(),
        keys in prop::collection::vec(any::<u32>(), 3000),
    ) {
        let springs = block.springs();
        // One spring without length, and so without direction.
        let (i, j, _) = springs[collapsed.index(springs.len())];
        state.positions[i as usize] = state.positions[j as usize];
        let expected = one_by_one(&springs, &state);
        // Nodes and springs in another order, and every other spring turned around.
        let mut order: Vec<usize> = (0..state.positions.len()).collect();
        order.sort_by_key(|&n| keys[n]);
        let mut place = vec![0; order.len()];
        order.iter().enumerate().for_each(|(new, &old)| place[old] = new as u32);
        let mut mixed: Vec<_> = springs.iter().map(|&(i, j, s)| (place[i as usize], place[j as usize], s)).collect();
        mixed.sort_by_key(|&(i, j, _)| keys[(i as usize * 31 + j as usize * 17) % keys.len()]);
        mixed.iter_mut().step_by(2).for_each(|(i, j, _)| std::mem::swap(i, j));
        let pick = |vectors: &[Vec3]| order.iter().map(|&old| vectors[old]).collect::<Vec<_>>();
        let permuted = State { positions: pick(&state.positions), velocities: pick(&state.velocities) };
        let permuted_rest = pick(block.rest());
        for set in sets() {
            let mut lattice = block.clone().with_instruction_set(set).unwrap();
            agree(&format!("lattice, {set:?}"), &forces(&mut lattice, &state), &expected)?;
            let mut straight = network(block.rest(), &springs).with_instruction_set(set).unwrap();
            agree(&format!("network, {set:?}"), &forces(&mut straight, &state), &expected)?;
            let mut network = network(&permuted_rest, &mixed).with_instruction_set(set).unwrap();
            let got = forces(&mut network, &permuted);
            prop_assert_eq!(&got, &forces(&mut network, &permuted), "twice the same bits");
            let back: Vec<Vec3> = place.iter().map(|&new| got[new as usize]).collect();
            agree(&format!("permuted network, {set:?}"), &back, &expected)?;
        }
    }

    #[test]
    fn springs_of_any_size_agree(
        along in prop::array::uniform3(-1.0..1.0_f64),
        closing in prop::array::uniform3(-1.0..1.0_f64),
        exponent in -100..100_i32,
        strain in 1e-4..1e4_f64,
    ) {
        let (along, closing) = (Vec3::from(along) * 10_f64.powi(exponent), Vec3::from(closing));
        let spring = Spring { stiffness: 3.0, damping: 0.7, rest_length: along.norm() * strain + 1e-110 };
        // At the limit of collapse, rounding decides.
        prop_assume!((along.norm() / (Spring::COLLAPSED * spring.rest_length) - 1.0).abs() > 1e-9);
        let state = State { positions: vec![Vec3::zeros(), along], velocities: vec![Vec3::zeros(), closing] };
        let expected = one_by_one(&[(0, 1, spring)], &state);
        for set in sets() {
            let mut network = network(&state.positions, &[(0, 1, spring)]).with_instruction_set(set).unwrap();
            agree(&format!("{set:?}"), &forces(&mut network, &state), &expected)?;
        }
    }
}

#[test]
fn what_is_not_a_number_stays_none_and_leaves_nothing_behind() {
    let block = Block::builder([3, 4, 5], [0.1; 3]).build().unwrap();
    let mut state = State::at_rest(block.rest());
    state.positions.iter_mut().skip(17).for_each(|x| x.y = f64::NAN);
    for set in sets() {
        let mut bodies: [Box<dyn Body>; 2] = [
            Box::new(block.clone().with_instruction_set(set).unwrap()),
            Box::new(network(block.rest(), &block.springs()).with_instruction_set(set).unwrap()),
        ];
        for body in &mut bodies {
            assert!(
                forces(&mut **body, &state)[17].iter().any(|c| c.is_nan()),
                "{set:?}: a force of zero would hide it"
            );
        }
    }
}

#[test]
fn a_network_agrees_with_its_block_in_everything_that_a_body_is_asked() {
    let block = Block::builder([4, 3, 5], [0.1; 3]).build().unwrap();
    let network = network(block.rest(), &block.springs());
    let state = deformed(&block);
    let nodes = [0, 17, 33, 59];
    let (mut ours, mut theirs) = ([Vec3::zeros(); 4], [Vec3::zeros(); 4]);
    network.node_forces(&state, &nodes, &mut ours);
    block.node_forces(&state, &nodes, &mut theirs);
    assert!(ours.iter().zip(&theirs).all(|(a, b)| (a - b).norm() < 1e-13));

    let tangent = |body: &dyn Body| {
        let mut sums = std::collections::BTreeMap::new();
        body.tangent(&state, &nodes, true, &mut |block| {
            let zero = (nalgebra::Matrix3::<f64>::zeros(), nalgebra::Matrix3::<f64>::zeros());
            let sum = sums.entry((block.row, block.column)).or_insert(zero);
            sum.0 += block.position;
            sum.1 += block.velocity;
        });
        sums
    };
    let (ours, theirs) = (tangent(&network), tangent(&block));
    assert_eq!(ours.keys().collect::<Vec<_>>(), theirs.keys().collect::<Vec<_>>());
    for (ours, theirs) in ours.values().zip(theirs.values()) {
        assert!((ours.0 - theirs.0).norm() < 1e-11 && (ours.1 - theirs.1).norm() < 1e-13);
    }
    assert!(network.duplicate().is_some());
}

#[test]
fn a_bad_network_is_refused_and_says_why() {
    let spring = Spring { stiffness: 1.0, damping: 0.1, rest_length: 1.0 };
    let nodes_at = |last| SpringNetwork::builder(vec![Vec3::zeros(), Vec3::x(), last]).masses(vec![1.0; 3]);
    let nodes = || nodes_at(Vec3::y());
    let bad = Spring { stiffness: f64::NAN, ..spring };
    let flat = Spring { rest_length: 0.0, ..spring };
    let cases = [
        (nodes().spring(0, 3, spring), "nodes 0 and 3"),
        (nodes().spring(0, 1, spring).spring(2, 2, spring), "spring 1: it joins node 2 to itself"),
        (nodes_at(Vec3::x()).spring(1, 2, spring), "springs: spring 0: nodes 1 and 2 are at the same place"),
        (nodes().spring(0, 1, bad), "stiffness NaN"),
        (nodes().spring(0, 1, flat), "rest length 0"),
        (nodes().masses(vec![1.0; 2]), "2 for 3 nodes"),
        (nodes().masses(vec![1.0, -1.0, 1.0]), "node 1 has -1 kg"),
        (nodes().fix(7), "node 7"),
        (nodes().surface(vec![[0, 1, 5]]), "[0, 1, 5]"),
        (SpringNetwork::builder(vec![Vec3::new(f64::INFINITY, 0.0, 0.0)]).masses(vec![1.0]), "node 0 is at"),
        (SpringNetwork::builder(Vec::new()), "nodes"),
    ];
    for (builder, words) in cases {
        let error = builder.build().unwrap_err().to_string();
        assert!(error.contains(words), "{error}");
    }
    let held = nodes().spring(0, 1, spring).fix(1).build().unwrap();
    assert_eq!(held.inverse_masses(), [1.0, 0.0, 1.0]);
}

#[cfg(feature = "parallel")]
#[test]
fn several_cores_give_the_same_bits_every_time_and_the_same_forces() {
    use palpate_model::body::{Region, Shape};
    let soft = Region::new(Shape::Sphere { centre: [0.05; 3], radius: 0.03 }).stiffness(3.0).damping_ratio(1.0);
    let uniform = Block::builder([9, 8, 7], [0.1; 3]);
    for builder in [uniform.clone(), uniform.region(soft)] {
        let block = builder.build().unwrap();
        let (springs, state) = (block.springs(), deformed(&block));
        let expected = one_by_one(&springs, &state);
        // More cores than there are lanes of nodes, too.
        for cores in [1, 2, 3, 100] {
            let mut bodies: [Box<dyn Body>; 2] = [
                Box::new(block.clone().on_cores(cores).unwrap()),
                Box::new(network(block.rest(), &springs).on_cores(cores).unwrap()),
            ];
            for body in &mut bodies {
                let first = forces(&mut **body, &state);
                agree(&format!("{cores} cores"), &first, &expected).unwrap();
                for _ in 0..20 {
                    assert_eq!(forces(&mut **body, &state), first);
                }
            }
        }
        assert!(block.on_cores(0).is_err());
    }
}
