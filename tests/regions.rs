//! Blocks of several materials: the kernel's forces against their springs one by one, as a test of its own works them out.

mod kernel_support;

use kernel_support::*;
use nalgebra::DMatrix;
use palpate::model::Vec3;
use palpate::model::body::{Block, BlockBuilder, Body, Region, Shape, Spring, State};
use palpate::model::integrator::Spectrum;
use palpate::model::linear_algebra::symmetric_eigen;
use palpate::model::mesh::{Face, Lattice};
use proptest::prelude::*;

const SIZE: [f64; 3] = [0.1, 0.12, 0.07];

/// k (N/m), zeta and m (kg) of a node.
type Material = (f64, f64, f64);

const BASE: Material = (30.0, 0.3, 0.5e-3);

fn builder(nodes: [usize; 3], regions: &[Region]) -> BlockBuilder {
    regions.iter().fold(Block::builder(nodes, SIZE), |builder, &region| builder.region(region))
}

/// The material of each node of `block`.
fn materials(block: &Block, regions: &[Region]) -> Vec<Material> {
    let of = |x: &Vec3| {
        let inside = |region: &&Region| region.shape.holds([x.x, x.y, x.z], SIZE.map(|edge| 1e-9 * edge));
        regions.iter().filter(inside).fold(BASE, |(k, zeta, m), region| {
            (region.stiffness.unwrap_or(k), region.damping_ratio.unwrap_or(zeta), region.node_mass.unwrap_or(m))
        })
    };
    block.rest().iter().map(of).collect()
}

/// The springs of a block of `regions`: half of each end's material.
fn springs(block: &Block, regions: &[Region]) -> Vec<(u32, u32, Spring)> {
    let materials = materials(block, regions);
    let (lattice, rest) = (block.lattice(), block.rest());
    let in_series = |a: f64, b: f64| if a + b == 0.0 { 0.0 } else { 2.0 * a * b / (a + b) };
    let damping = |(k, zeta, m): Material| zeta * (2.0 * m * k).sqrt();
    let mut springs = Vec::new();
    for node in 0..lattice.len() as u32 {
        let ends = Lattice::FORWARD.iter().filter_map(|&o| lattice.neighbour(lattice.coordinates(node), o));
        for to in ends.map(|to| lattice.id(to)) {
            let (a, b) = (materials[node as usize], materials[to as usize]);
            let rest_length = (rest[to as usize] - rest[node as usize]).norm();
            let spring =
                Spring { stiffness: in_series(a.0, b.0), damping: in_series(damping(a), damping(b)), rest_length };
            springs.push((node, to, spring));
        }
    }
    springs
}

/// A region that holds the middle of one cell at least, so a node of every block.
fn any_region() -> impl Strategy<Value = Region> {
    let at = prop::array::uniform3(0.0..1.0_f64).prop_map(|at| [0, 1, 2].map(|axis| at[axis] * SIZE[axis]));
    let shape = prop_oneof![
        (at.clone(), 0.11..0.15_f64).prop_map(|(centre, radius)| Shape::Sphere { centre, radius }),
        (at.clone(), 0.11..0.3_f64).prop_map(|(centre, r)| Shape::Ellipsoid { centre, radii: [r, 0.11, 2.0 * r] }),
        at.prop_map(|max| Shape::Box { min: [0.0; 3], max }),
        (0_usize..3, 0.0..0.07_f64).prop_map(|(axis, to)| Shape::Layer { axis, from: -0.01, to }),
    ];
    let value = |values: [f64; 4]| prop::option::of(prop::sample::select(values.to_vec()));
    let stiffness = prop::sample::select(vec![30.0, 300.0, 0.4, 7e3]);
    (shape, stiffness, value([0.0, 0.3, 0.9, 2.0]), value([0.5e-3, 1e-5, 3e-3, 0.2]))
        .prop_map(|(shape, k, damping_ratio, node_mass)| Region { shape, stiffness: Some(k), damping_ratio, node_mass })
}

/// A block of any size and materials, and displacements and velocities of its nodes.
fn any_block() -> impl Strategy<Value = (Vec<Region>, Block, State)> {
    let vectors =
        |nodes, size: f64| prop::collection::vec(prop::array::uniform3(-size..=size).prop_map(Vec3::from), nodes);
    let regions = prop::collection::vec(any_region(), 0..4);
    // The exponent makes displacements from far below the spacing to far beyond the body.
    (prop::array::uniform3(2_usize..7), -6..3_i32, regions).prop_flat_map(move |(nodes, exponent, regions)| {
        let count: usize = nodes.iter().product();
        (vectors(count, 10_f64.powi(exponent)), vectors(count, 10.0)).prop_map(move |(displacements, velocities)| {
            let block = builder(nodes, &regions).build().unwrap();
            let positions = block.rest().iter().zip(displacements).map(|(x, u)| x + u).collect();
            (regions.clone(), block, State { positions, velocities })
        })
    })
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(96))]

    #[test]
    fn a_block_of_any_materials_has_the_forces_of_its_springs(
        (regions, block, mut state) in any_block(),
        collapsed in any::<prop::sample::Index>(),
    ) {
        let springs = springs(&block, &regions);
        // One spring without length, and so without direction.
        let (i, j, _) = springs[collapsed.index(springs.len())];
        state.positions[i as usize] = state.positions[j as usize];
        let expected = one_by_one(&springs, &state);
        for set in sets() {
            let mut block = block.clone().with_instruction_set(set).unwrap();
            let got = forces(&mut block, &state);
            agree(&format!("{set:?}"), &got, &expected)?;
            prop_assert_eq!(&got, &forces(&mut block, &state), "twice the same bits");
            // What a spring gives to one node it takes from another.
            let total: f64 = expected.1.iter().sum();
            prop_assert!(got.iter().sum::<Vec3>().norm() <= 2e-14 * total, "{:?}: momentum", set);
        }
        let nodes: Vec<u32> = (0..state.positions.len() as u32).collect();
        let mut single = vec![Vec3::zeros(); nodes.len()];
        block.node_forces(&state, &nodes, &mut single);
        agree("node by node", &single, &expected)?;
    }

    #[test]
    fn a_block_tells_the_springs_and_masses_that_it_has((regions, block, _) in any_block()) {
        let mut told = block.springs();
        told.sort_by_key(|&(i, j, _)| (i, j));
        let mut expected = springs(&block, &regions);
        expected.sort_by_key(|&(i, j, _)| (i, j));
        prop_assert_eq!(told.len(), expected.len());
        for (told, expected) in told.iter().zip(&expected) {
            prop_assert_eq!((told.0, told.1), (expected.0, expected.1));
            let (a, b) = (told.2, expected.2);
            let is_near = |a: f64, b: f64| (a - b).abs() <= 1e-14 * b;
            prop_assert!(is_near(a.stiffness, b.stiffness) && is_near(a.damping, b.damping), "{:?} and {:?}", a, b);
        }
        let masses: Vec<f64> = materials(&block, &regions).iter().map(|&(_, _, m)| 1.0 / m).collect();
        prop_assert_eq!(block.inverse_masses(), &masses[..]);
    }

    #[test]
    fn regions_of_the_same_material_change_no_bit((regions, block, state) in any_block()) {
        let same = |region: &Region| Region::new(region.shape).stiffness(BASE.0).damping_ratio(BASE.1).node_mass(BASE.2);
        let regions: Vec<Region> = regions.iter().map(same).collect();
        let nodes = block.lattice().nodes;
        let blocks = [builder(nodes, &regions).build().unwrap(), builder(nodes, &[]).build().unwrap()];
        for set in sets() {
            let [a, b] = blocks.clone().map(|block| forces(&mut block.with_instruction_set(set).unwrap(), &state));
            prop_assert_eq!(a, b);
        }
    }

    #[test]
    fn the_tangent_is_the_derivative_of_the_force((_, block, _) in any_block()) {
        let state = deformed(&block);
        let count = state.positions.len();
        let rows: Vec<u32> = (0..count as u32).collect();
        let mut tangent = [DMatrix::zeros(3 * count, 3 * count), DMatrix::zeros(3 * count, 3 * count)];
        block.tangent(&state, &rows, false, &mut |entry| {
            let at = (3 * entry.row as usize, 3 * entry.column as usize);
            for (sum, part) in tangent.iter_mut().zip([entry.position, entry.velocity]) {
                let mut place = sum.view_mut(at, (3, 3));
                place += part;
            }
        });
        let (node, step) = (count / 2, 1e-6);
        let mut block = block;
        for axis in 0..3 {
            for (which, tangent) in tangent.iter().enumerate() {
                let mut at = |sign: f64| {
                    let mut moved = state.clone();
                    let part = if which == 0 { &mut moved.positions } else { &mut moved.velocities };
                    part[node][axis] += sign * step;
                    forces(&mut block, &moved)
                };
                let (plus, minus) = (at(1.0), at(-1.0));
                let column = tangent.column(3 * node + axis);
                let scale = column.amax().max(1.0);
                for n in 0..count {
                    let derivative = (plus[n] - minus[n]) / (2.0 * step);
                    let off = (derivative - Vec3::new(column[3 * n], column[3 * n + 1], column[3 * n + 2])).norm();
                    prop_assert!(off <= 1e-5 * scale, "node {}: off by {:e} of {:e}", n, off, scale);
                }
            }
        }
    }

    #[test]
    fn the_step_is_chosen_for_the_stiffest_and_lightest_part((_, block, _) in any_block()) {
        // Against all eigenvalues of M^-1/2 K M^-1/2 and the same of C.
        let count = block.rest().len();
        prop_assume!(count <= 80);
        let rows: Vec<u32> = (0..count as u32).collect();
        let mut scaled = [DMatrix::zeros(3 * count, 3 * count), DMatrix::zeros(3 * count, 3 * count)];
        let roots: Vec<f64> = block.inverse_masses().iter().map(|w| w.sqrt()).collect();
        block.tangent(&State::at_rest(block.rest()), &rows, false, &mut |entry| {
            let (row, column) = (entry.row as usize, entry.column as usize);
            for (sum, part) in scaled.iter_mut().zip([entry.position, entry.velocity]) {
                let mut place = sum.view_mut((3 * row, 3 * column), (3, 3));
                place -= part * (roots[row] * roots[column]);
            }
        });
        let [stiffness, damping] = scaled.map(|matrix| {
            let (eigenvalues, _) = symmetric_eigen(&matrix).unwrap();
            eigenvalues.last().map_or(0.0, |largest| largest.max(0.0))
        });
        let (found, exact) = (Spectrum::estimate(&mut block.clone()), Spectrum { stiffness, damping });
        // The substeps have a margin of 1.3.
        let share = found.stable_step() / exact.stable_step();
        prop_assert!((share - 1.0).abs() < 0.05, "{share} of the stable step, {found:?} and {exact:?}");
    }
}

#[test]
fn far_from_an_inclusion_no_bit_is_changed() {
    let corner = Region::new(Shape::Box { min: [0.0; 3], max: [0.02; 3] }).stiffness(300.0);
    let (mixed, uniform) = (builder([9; 3], &[corner]).build().unwrap(), builder([9; 3], &[]).build().unwrap());
    let state = deformed(&mixed);
    for set in sets() {
        let [a, b] =
            [&mixed, &uniform].map(|block| forces(&mut block.clone().with_instruction_set(set).unwrap(), &state));
        let differing: Vec<usize> = (0..a.len()).filter(|&n| a[n] != b[n]).collect();
        let near = |&n: &usize| mixed.rest()[n].iter().all(|&c| c < 0.04);
        assert!(!differing.is_empty() && differing.iter().all(near), "{set:?}: {differing:?}");
    }
}

/// A row of springs through two materials carries one force: the harmonic mean is the series of the halves.
#[test]
fn a_pulled_column_stretches_as_its_materials_in_series() {
    let stiff = Region::new(Shape::Layer { axis: 2, from: SIZE[2] / 2.0, to: SIZE[2] }).stiffness(90.0);
    let block = builder([2, 2, 4], &[stiff]).fix(Face::ZMin).build().unwrap();
    let springs = block.springs();
    let stiffness = |pair| springs.iter().find(|&&(i, j, _)| (i, j) == pair).unwrap().2.stiffness;
    let along = [(0, 4), (4, 8), (8, 12)].map(stiffness);
    assert_eq!((along[0], along[2]), (30.0, 90.0));
    // Half a spring has twice the stiffness.
    let halves = 1.0 / (1.0 / 60.0 + 1.0 / 180.0);
    assert!((along[1] - halves).abs() < 1e-12, "{along:?}");
}

#[test]
fn a_region_that_cannot_be_is_refused_with_its_number() {
    let nowhere = Region::new(Shape::Sphere { centre: [1.0; 3], radius: 0.1 }).stiffness(3.0);
    let fine = Region::new(Shape::Layer { axis: 0, from: 0.0, to: 0.1 }).damping_ratio(0.0);
    let error = builder([4; 3], &[fine, nowhere]).build().unwrap_err().to_string();
    assert!(error.starts_with("region[1].shape: holds no node"), "{error}");
}

/// Time (s) and magnitude (N) of every tick of a scene with the whole body at 1 kHz.
fn felt(name: &str) -> Vec<(f64, f64)> {
    use palpate::log::LogRecord;
    use palpate::model::local::Kind as LocalModelKind;
    use palpate::scene::Scene;

    let file = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join(format!("scenes/{name}.toml"));
    let scene = Scene::load(&file).unwrap().with_model(LocalModelKind::Full);
    let session = palpate::Session::from_scene(scene).virtual_time().keep_records().build().unwrap();
    let magnitude = |record: &LogRecord| match record {
        LogRecord::Force(sample) => Some((sample.time.as_secs_f64(), Vec3::from(sample.force_n).norm())),
        _ => None,
    };
    session.run().unwrap().records.iter().filter_map(magnitude).collect()
}

#[test]
fn the_scenes_keep_their_contact_and_stay_below_two_newtons() {
    // Until the lift begins.
    for (name, until_s) in [("nodule", 2.3), ("layers", 2.0), ("soft_deep", 2.0)] {
        let felt = felt(name);
        assert!(felt.iter().all(|&(_, f)| f < 2.0), "{name}");
        let lost = felt.iter().find(|&&(t, f)| t > 0.1 && t < until_s && f == 0.0);
        assert_eq!(lost, None, "{name}");
    }
}

#[test]
fn a_tool_that_slides_over_the_nodule_feels_it() {
    let felt = felt("nodule");
    let most =
        |from: f64, to: f64| felt.iter().filter(|(t, _)| *t > from && *t < to).map(|&(_, f)| f).fold(0.0, f64::max);
    // Before it and over it.
    let (before, over) = (most(0.4, 0.9), most(1.2, 1.7));
    assert!(over > 1.4 * before, "{over} N over it, {before} N before");
}
