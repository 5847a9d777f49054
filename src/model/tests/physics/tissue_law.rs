//! The law of tetrahedra against what must hold of a continuum.

use crate::tissue_support::*;
use palpate_model::body::{Body, State, Tetrahedra, Tissue};
use palpate_model::integrator::Spectrum;
use palpate_model::mesh::TetrahedralMesh;
use palpate_model::{Mat3, Vec3};
use proptest::prelude::*;

const TISSUE: Tissue = Tissue { young_modulus: 5e3, poisson_ratio: 0.45, density: 1060.0, viscosity: 2.0 };

/// A block with an irregular inside.
fn block(is_averaged: bool) -> Tetrahedra {
    body(irregular_box([4, 3, 5], [0.04, 0.03, 0.05], 0.25), TISSUE, is_averaged)
}

/// The state x = F X + t, v = Fdot X + u.
fn uniform(rest: &[Vec3], f: &Mat3, rate: &Mat3, offset: Vec3) -> State {
    State {
        positions: rest.iter().map(|x| f * x + offset).collect(),
        velocities: rest.iter().map(|x| rate * x + offset * 3.0).collect(),
    }
}

/// True for a node inside the block.
fn is_inner(x: &Vec3) -> bool {
    [0.04, 0.03, 0.05].iter().enumerate().all(|(axis, edge)| x[axis] > 1e-9 && x[axis] < edge - 1e-9)
}

#[test]
fn a_uniform_strain_has_no_force_inside_and_its_stress_on_the_faces() {
    let f = Mat3::new(1.2, 0.1, -0.05, 0.15, 0.9, 0.2, -0.1, 0.05, 1.1);
    let rate = Mat3::new(0.3, -1.0, 0.5, 0.2, 0.7, -0.4, 0.1, 0.9, -0.6);
    for is_averaged in [false, true] {
        let mut body = block(is_averaged);
        let state = uniform(body.rest(), &f, &rate, Vec3::new(0.1, -0.2, 0.3));
        let forces = forces(&mut body, &state);
        let pressure = (TISSUE.lame() + TISSUE.shear_modulus()) * (f.determinant() - 1.0);
        let stress = stress(&TISSUE, &f, &rate, pressure);
        let scale = largest(&forces);
        for (x, force) in body.rest().iter().zip(&forces) {
            assert!(!is_inner(x) || force.norm() < 1e-12 * scale, "{force:?} at {x:?}");
        }
        // The moment of the nodal forces is the mean stress times the volume (Green).
        let moment: Mat3 = body.rest().iter().zip(&forces).map(|(x, force)| -force * x.transpose()).sum();
        assert!((moment / body.volume() - stress).norm() < 1e-12 * stress.norm(), "{moment} {stress}");
    }
}

#[test]
fn a_bar_stretched_and_compressed_follows_the_closed_law() {
    let (mu, lambda) = (TISSUE.shear_modulus(), TISSUE.lame() + TISSUE.shear_modulus());
    for stretch in [0.5, 0.8, 1.3, 2.0] {
        // No stress across: mu t + (lambda (s t^2 - 1) - mu) s t = 0.
        let across = ((lambda + mu - mu / stretch) / (lambda * stretch)).sqrt();
        let pressure = lambda * (stretch * across * across - 1.0);
        let along = mu * stretch + (pressure - mu) * across * across;
        for is_averaged in [false, true] {
            let mut body = block(is_averaged);
            let f = Mat3::from_diagonal(&Vec3::new(across, across, stretch));
            let state = uniform(body.rest(), &f, &Mat3::zeros(), Vec3::zeros());
            let forces = forces(&mut body, &state);
            let at = |z: f64| {
                let face = body.rest().iter().zip(&forces).filter(move |(x, _)| (x.z - z).abs() < 1e-9);
                face.map(|(_, force)| *force).sum::<Vec3>()
            };
            let expected = Vec3::z() * (along * 0.04 * 0.03);
            assert!((at(0.05) + expected).norm() < 1e-12 * mu * 0.04 * 0.03, "{:?} and {expected:?}", at(0.05));
            assert!((at(0.0) - expected).norm() < 1e-12 * mu * 0.04 * 0.03);
            let free = body.rest().iter().zip(&forces).filter(|(x, _)| x.z > 1e-9 && x.z < 0.05 - 1e-9);
            free.for_each(|(x, force)| assert!(force.norm() < 1e-12, "{force:?} at {x:?}"));
        }
    }
}

#[test]
fn a_body_that_is_turned_and_moved_as_a_whole_has_no_force() {
    let turn = *nalgebra::Rotation3::from_euler_angles(0.7, -1.1, 2.3).matrix();
    let spin = turn * Mat3::new(0.0, -3.0, 2.0, 3.0, 0.0, -1.0, -2.0, 1.0, 0.0);
    for is_averaged in [false, true] {
        let mut body = block(is_averaged);
        let state = uniform(body.rest(), &turn, &spin, Vec3::new(0.05, 0.02, -0.04));
        // Shear stress of a strain of one, over the face of an element.
        let scale = TISSUE.shear_modulus() * 1e-4;
        assert!(largest(&forces(&mut body, &state)) < 1e-13 * scale.max(1.0));
    }
}

#[test]
fn a_turned_and_a_mirrored_body_feel_the_turned_and_mirrored_force() {
    let turn = *nalgebra::Rotation3::from_euler_angles(0.4, 0.9, -1.7).matrix();
    let mirror = Mat3::from_diagonal(&Vec3::new(-1.0, 1.0, 1.0));
    for (is_averaged, map) in [false, true].into_iter().flat_map(|averaged| [(averaged, turn), (averaged, mirror)]) {
        let mut body = block(is_averaged);
        let state = shaken(body.rest(), 3e-3, 0.5);
        let expected = forces(&mut body, &state);
        let mut mesh = body.mesh().clone();
        mesh.points.iter_mut().for_each(|x| *x = map * *x);
        // Mirrored throughout, the mesh is turned round; what was at z = 0 is still held.
        let held = mesh.points.iter().zip(0..).zip(body.inverse_masses()).filter(|(_, w)| **w == 0.0);
        let nodes: Vec<u32> = held.map(|((_, node), _)| node).collect();
        mesh.groups.push(palpate_model::mesh::Group { name: "held".to_owned(), nodes, tetrahedra: vec![] });
        let builder = Tetrahedra::builder(mesh).tissue(TISSUE).nodal_pressure(is_averaged);
        let mut mapped = builder.fix(palpate_model::body::Where::Group("held".to_owned())).build().unwrap();
        let state = State {
            positions: state.positions.iter().map(|x| map * x).collect(),
            velocities: state.velocities.iter().map(|v| map * v).collect(),
        };
        let scale = largest(&expected);
        for (force, expected) in forces(&mut mapped, &state).iter().zip(&expected) {
            assert!((force - map * expected).norm() < 1e-12 * scale, "{force:?}");
        }
    }
}

/// The tangent as a matrix of blocks: by positions and by velocities.
fn tangent(body: &Tetrahedra, state: &State, clamp: bool) -> [nalgebra::DMatrix<f64>; 2] {
    let size = 3 * state.positions.len();
    let mut matrices = [nalgebra::DMatrix::zeros(size, size), nalgebra::DMatrix::zeros(size, size)];
    let nodes: Vec<u32> = (0..state.positions.len() as u32).collect();
    body.tangent(state, &nodes, clamp, &mut |block| {
        let (row, column) = (3 * block.row as usize, 3 * block.column as usize);
        for (matrix, value) in matrices.iter_mut().zip([block.position, block.velocity]) {
            let mut place = matrix.fixed_view_mut::<3, 3>(row, column);
            place += value;
        }
    });
    matrices
}

fn small(is_averaged: bool, tissue: Tissue) -> Tetrahedra {
    body(irregular_box([2, 2, 2], [0.02, 0.02, 0.02], 0.2), tissue, is_averaged)
}

#[test]
fn the_tangent_is_the_derivative_of_the_force_and_symmetric_for_one_material() {
    for is_averaged in [false, true] {
        let mut body = small(is_averaged, TISSUE);
        let state = shaken(body.rest(), 2e-3, 0.3);
        let [by_position, by_velocity] = tangent(&body, &state, false);
        for n in 0..3 * state.positions.len() {
            let step = 1e-6;
            let moved = |sign: f64, is_velocity: bool| {
                let mut state = state.clone();
                let list = if is_velocity { &mut state.velocities } else { &mut state.positions };
                list[n / 3][n % 3] += sign * step;
                state
            };
            for (is_velocity, matrix) in [(false, &by_position), (true, &by_velocity)] {
                let plus = forces(&mut body, &moved(1.0, is_velocity));
                let minus = forces(&mut body, &moved(-1.0, is_velocity));
                let scale = matrix.amax();
                for (node, (plus, minus)) in plus.iter().zip(&minus).enumerate() {
                    let expected = (plus - minus) / (2.0 * step);
                    let found = matrix.fixed_view::<3, 1>(3 * node, n);
                    assert!((expected - found).norm() < 1e-6 * scale, "{expected:?} {found:?} {is_velocity}");
                }
            }
        }
        let still = State { velocities: vec![Vec3::zeros(); state.positions.len()], ..state };
        let [by_position, by_velocity] = tangent(&body, &still, false);
        assert!((&by_position - by_position.transpose()).amax() < 1e-12 * by_position.amax());
        assert!((&by_velocity - by_velocity.transpose()).amax() < 1e-12 * by_velocity.amax());
    }
}

#[test]
fn the_clamped_tangent_is_the_true_one_at_rest_and_pushes_nowhere() {
    for is_averaged in [false, true] {
        let body = small(is_averaged, TISSUE);
        let rest = State::at_rest(body.rest());
        let ([exact, _], [clamped, _]) = (tangent(&body, &rest, false), tangent(&body, &rest, true));
        assert!((&exact - clamped).amax() < 1e-12 * exact.amax());
        let state = shaken(body.rest(), 3e-3, 0.3);
        let ([exact, _], [clamped, _]) = (tangent(&body, &state, false), tangent(&body, &state, true));
        let least = |matrix: nalgebra::DMatrix<f64>| {
            let symmetric = (&matrix + matrix.transpose()) * -0.5;
            symmetric.symmetric_eigenvalues().min() / symmetric.amax()
        };
        let (exact, clamped) = (least(exact), least(clamped));
        println!("least eigenvalue over the largest entry: {exact:.2e}, clamped {clamped:.2e}");
        assert!(exact < -1e-3, "the state is hard enough to tell");
        assert!(clamped > -1e-12, "{clamped}");
    }
}

#[test]
fn a_body_recovers_from_inversion() {
    for is_averaged in [false, true] {
        let mut body = block(is_averaged);
        let mut state = State::at_rest(body.rest());
        let inner = body.rest().iter().position(is_inner).unwrap();
        state.positions[inner].z += 0.03;
        let is_inverted = |state: &State, mesh: &TetrahedralMesh| {
            mesh.tetrahedra.iter().any(|nodes| {
                let [a, b, c, d] = nodes.map(|node| state.positions[node as usize]);
                Mat3::from_columns(&[b - a, c - a, d - a]).determinant() < 0.0
            })
        };
        assert!(is_inverted(&state, body.mesh()));
        let step = 0.2 * Spectrum::estimate(&mut body).stable_step();
        for _ in 0..20_000 {
            let forces = forces(&mut body, &state);
            for (n, force) in forces.iter().enumerate() {
                state.velocities[n] += force * (step * body.inverse_masses()[n]);
                state.positions[n] += state.velocities[n] * step;
            }
        }
        assert!(!is_inverted(&state, body.mesh()));
        let off = state.positions.iter().zip(body.rest()).map(|(x, rest)| (x - rest).norm()).fold(0.0, f64::max);
        assert!(off < 1e-4, "{off} m");
    }
}

#[test]
fn the_step_of_a_viscous_body_is_that_of_its_viscosity() {
    let tissue = Tissue { young_modulus: 5e3, poisson_ratio: 0.45, density: 1060.0, viscosity: 10.0 };
    let mut body = body(irregular_box([5; 3], [0.02; 3], 0.2), tissue, false);
    let spectrum = Spectrum::estimate(&mut body);
    let by_stiffness = 2.0 / spectrum.stiffness.sqrt();
    let run = |body: &mut Tetrahedra, step: f64| {
        let mut state = shaken(body.rest(), 1e-6, 0.0);
        for _ in 0..4000 {
            let forces = forces(body, &state);
            for (n, force) in forces.iter().enumerate() {
                state.velocities[n] += force * (step * body.inverse_masses()[n]);
                state.positions[n] += state.velocities[n] * step;
            }
        }
        let off = |(x, rest): (&Vec3, &Vec3)| (x - rest).norm();
        let is_finite = state.is_finite();
        is_finite.then(|| state.positions.iter().zip(body.rest()).map(off).fold(0.0, f64::max))
    };
    assert!(spectrum.stable_step() < 0.6 * by_stiffness, "viscosity counts here");
    assert!(run(&mut body, 0.95 * spectrum.stable_step()).is_some_and(|off| off < 1e-5));
    let diverged = run(&mut body, 0.8 * by_stiffness);
    assert!(diverged.is_none_or(|off| off > 1e-3), "{diverged:?}");
}

/// A body of several tissues, and any state of it.
fn any_body() -> impl Strategy<Value = (Tetrahedra, bool, State)> {
    let inputs = (prop::array::uniform3(1_usize..5), any::<bool>(), any::<bool>(), any::<u64>(), -6..1_i32);
    inputs.prop_map(|(cells, is_averaged, is_viscous, seed, exponent)| {
        let tissue = Tissue { viscosity: if is_viscous { 2.0 } else { 0.0 }, ..TISSUE };
        let mesh = irregular_box(cells, [0.03, 0.05, 0.04], 0.25);
        let shape = palpate_model::body::Shape::Sphere { centre: [0.0; 3], radius: 0.04 };
        let place = palpate_model::body::Where::Shape(shape);
        let hard = palpate_model::body::TissueRegion::of(place, Tissue { poisson_ratio: 0.3, ..Tissue::TUMOUR });
        let hard = palpate_model::body::TissueRegion { viscosity: None, ..hard };
        let builder = Tetrahedra::builder(mesh).tissue(tissue).nodal_pressure(is_averaged).region(hard);
        let body = builder.fix(bottom()).build().unwrap();
        let mut noise = Noise(seed);
        let size = 0.03 * 10_f64.powi(exponent);
        let state = State {
            positions: body.rest().iter().map(|x| x + noise.vector() * size).collect(),
            velocities: body.rest().iter().map(|_| noise.vector()).collect(),
        };
        (body, is_averaged, state)
    })
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(64))]

    #[test]
    fn forces_are_those_of_a_plain_loop_with_the_same_bits_on_every_set((body, is_averaged, state) in any_body()) {
        let expected = plain_loop(&body, is_averaged, &state);
        // Products of two edges of moved nodes, over a height squared, are what rounding is a share of.
        let reach = state.positions.iter().map(|x| x.norm()).fold(0.05, f64::max) / 0.01;
        let scale = largest(&expected).max(1e-3 * reach.powi(3));
        let mut all = Vec::new();
        for set in sets() {
            let mut body = body.clone().with_instruction_set(set).unwrap();
            let got = forces(&mut body, &state);
            for (got, expected) in got.iter().zip(&expected) {
                prop_assert!((got - expected).norm() < 1e-12 * scale, "{:?}: {:?} {:?}", set, got, expected);
            }
            prop_assert_eq!(&got, &forces(&mut body, &state), "twice the same bits");
            all.push(got);
        }
        prop_assert!(all.iter().all(|forces| *forces == all[0]), "the same bits on every set");
        let nodes: Vec<u32> = (0..state.positions.len() as u32).step_by(3).collect();
        let mut some = vec![Vec3::zeros(); nodes.len()];
        body.node_forces(&state, &nodes, &mut some);
        for (&node, force) in nodes.iter().zip(&some) {
            prop_assert!((force - expected[node as usize]).norm() < 1e-12 * scale);
        }
    }

    #[test]
    fn forces_and_their_moments_balance((mut body, _, state) in any_body()) {
        let forces = forces(&mut body, &state);
        let reach = state.positions.iter().map(|x| x.norm()).fold(0.05, f64::max);
        let scale = largest(&forces).max(1e-3 * (reach / 0.01).powi(3)) * forces.len() as f64;
        prop_assert!(forces.iter().sum::<Vec3>().norm() < 1e-12 * scale);
        let moment: Vec3 = state.positions.iter().zip(&forces).map(|(x, force)| x.cross(force)).sum();
        prop_assert!(moment.norm() < 1e-12 * scale * reach, "{:?}", moment);
    }

    #[cfg(feature = "parallel")]
    #[test]
    fn several_cores_find_the_same_forces((body, _, state) in any_body(), cores in 2_usize..5) {
        let expected = forces(&mut body.clone(), &state);
        let mut divided = body.on_cores(cores).unwrap();
        let got = forces(&mut divided, &state);
        let reach = state.positions.iter().map(|x| x.norm()).fold(0.05, f64::max) / 0.01;
        let scale = largest(&expected).max(1e-3 * reach.powi(3));
        for (got, expected) in got.iter().zip(&expected) {
            prop_assert!((got - expected).norm() < 1e-12 * scale);
        }
        prop_assert_eq!(&got, &forces(&mut divided, &state), "twice the same bits");
    }
}
