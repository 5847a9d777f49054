//! The restriction of a body of tetrahedra to some of its nodes: the same forces there, and nothing of them in what is left.

use crate::tissue_support::*;
use nalgebra::DMatrix;
use palpate_model::Vec3;
use palpate_model::body::{Body, Restriction, Shape, State, Tetrahedra, Tissue, TissueRegion, Where};
use palpate_model::contact::{Contact, Law, ToolMotion};
use palpate_model::local::{Aim, Kind, ResyncView, Template, ToolForecast};
use palpate_model::simulation::{Simulation, Stepping};
use palpate_model::surroundings::Bases;
use proptest::prelude::*;

/// A block of two tissues, held below.
fn block(is_averaged: bool) -> Tetrahedra {
    let shape = Shape::Sphere { centre: [0.02, 0.02, 0.03], radius: 0.02 };
    let hard = TissueRegion::of(Where::Shape(shape), Tissue { poisson_ratio: 0.3, ..Tissue::TUMOUR });
    let builder = Tetrahedra::builder(irregular_box([6, 5, 5], [0.06, 0.05, 0.05], 0.25)).region(hard);
    builder.nodal_pressure(is_averaged).fix(bottom()).build().unwrap()
}

proptest! {
    #[test]
    fn it_exerts_what_the_whole_body_does(
        asked in prop::collection::btree_set(0_u32..252, 1..40),
        is_averaged in any::<bool>(),
        seed in any::<u64>(),
    ) {
        let (mut body, asked) = (block(is_averaged), asked.into_iter().rev().collect::<Vec<_>>());
        let mut noise = Noise(seed);
        let state = State {
            positions: body.rest().iter().map(|x| x + noise.vector() * 5e-3).collect(),
            velocities: body.rest().iter().map(|_| noise.vector()).collect(),
        };
        let Restriction { nodes, body: mut part } = body.restriction(&asked).unwrap();
        prop_assert_eq!(&nodes[..asked.len()], &asked[..]);
        let is_held = |node: &u32| body.inverse_masses()[*node as usize] == 0.0;
        prop_assert!(nodes[asked.len()..].is_sorted_by_key(|node| (is_held(node), *node)));
        let of = |all: &[Vec3]| nodes.iter().map(|&node| all[node as usize]).collect::<Vec<_>>();
        prop_assert_eq!(part.rest(), &of(body.rest())[..]);
        let inner = State { positions: of(&state.positions), velocities: of(&state.velocities) };
        let (whole, own) = (forces(&mut body, &state), forces(&mut *part, &inner));
        let scale = largest(&whole);
        for (place, &node) in asked.iter().enumerate() {
            prop_assert!((own[place] - whole[node as usize]).norm() < 1e-12 * scale, "node {}", node);
        }
        prop_assert!(own.iter().sum::<Vec3>().norm() < 1e-11 * scale);
    }
}

/// -df/dx and -df/dv at rest of all nodes, at their places in the whole body.
fn resting(body: &dyn Body, ids: &[u32], size: usize) -> [DMatrix<f64>; 2] {
    let mut matrices = [DMatrix::zeros(3 * size, 3 * size), DMatrix::zeros(3 * size, 3 * size)];
    let nodes: Vec<u32> = (0..ids.len() as u32).collect();
    body.tangent(&State::at_rest(body.rest()), &nodes, false, &mut |block| {
        let [row, column] = [block.row, block.column].map(|node| 3 * ids[node as usize] as usize);
        for (matrix, value) in matrices.iter_mut().zip([block.position, block.velocity]) {
            let mut place = matrix.fixed_view_mut::<3, 3>(row, column);
            place -= value;
        }
    });
    matrices
}

#[test]
fn what_is_left_of_one_tissue_does_not_know_the_nodes_and_gives_no_energy() {
    for (is_averaged, poisson_ratio) in [(false, 0.45), (true, 0.3), (true, 0.45), (true, 0.49)] {
        let tissue = Tissue { poisson_ratio, ..Tissue::LIVER };
        let body = body(irregular_box([5, 4, 4], [0.05, 0.04, 0.04], 0.25), tissue, is_averaged);
        let size = body.rest().len();
        let mut asked = Vec::new();
        body.patch(&[body.surface().at_node(size as u32 - 15)[0]], [3, 3, 2], &mut asked);
        let Restriction { nodes, body: part } = body.restriction(&asked).unwrap();
        let all: Vec<u32> = (0..size as u32).collect();
        for (whole, near) in resting(&body, &all, size).into_iter().zip(resting(&*part, &nodes, size)) {
            let left = &whole - near;
            for &node in &asked {
                assert!(left.rows(3 * node as usize, 3).amax() < 1e-12 * whole.amax(), "node {node}");
            }
            assert!((&left - left.transpose()).amax() < 1e-12 * whole.amax());
            let least = left.symmetric_eigenvalues().min() / whole.amax();
            println!("nodal pressure {is_averaged}, nu {poisson_ratio}: least eigenvalue of what is left {least:.1e}");
            assert!(least > -1e-12, "{least}");
        }
    }
}

/// Check that a linear model around a tool that is over a part which is held through and through, where nothing can move, feels nothing and
/// goes on.
#[test]
fn linear_models_are_made_where_nothing_can_move() {
    let mesh = irregular_box([6, 3, 3], [0.06, 0.03, 0.03], 0.1);
    let half = Where::Shape(Shape::Layer { axis: 0, from: -1.0, to: 0.045 });
    let mut body = Tetrahedra::builder(mesh).fix(half).build().unwrap();
    let stepping = Stepping { tick: 1e-3, substeps: Stepping::stable_substeps(&mut body, 1e-3) };
    let state = State::at_rest(body.rest());
    let mut simulation = Simulation::new(Box::new(body), state, Contact::default(), Law::default(), stepping).unwrap();
    let at = Vec3::new(0.005, 0.015, 0.0305);
    let forecast = ToolForecast::at_rest(at);
    let aim = Aim::new(simulation.body().surface(), &simulation.state().positions).unwrap();
    let mut triangles = Vec::new();
    aim.triangles((&simulation, 0), &forecast, [0.0; 2], &mut triangles);
    for kind in [Kind::Patch, Kind::LinearBoundary, Kind::ScaledBoundary, Kind::Condensed] {
        let mut model = Template::new(kind, [4, 4, 2], simulation.body()).unwrap().empty();
        model.rebuild(ResyncView {
            global: &mut simulation,
            tick: 0,
            triangles: &triangles,
            nearest: &[],
            patch: None,
            tools: &[forecast],
            index: 0,
            horizon: 33,
            bases: &Bases::default(),
        });
        let force = model.tick(&[ToolMotion::straight(at, at - Vec3::z() * 1e-3)]).force;
        assert_eq!(force, Vec3::zeros(), "{kind:?}");
    }
}
