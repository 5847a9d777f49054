//! A scene is written as TOML and read back as the same scene, every number to its last bit.

use std::path::Path;

use palpate::model::body::Shape;
use palpate::model::contact::{Equations, Normals};
use palpate::model::local::BlendKind;
use palpate::model::local::Feedback;
use palpate::model::mesh::Face;
use palpate::scene::{
    BlendSpec, BlockSpec, BodySpec, FrictionSpec, InitialSpec, MassSpringSpec, MaterialSpec, ModelChoice, ProbeSpec,
    PullSpec, RegionSpec, Scene, StepKind, ToolSpec,
};
use proptest::prelude::*;

/// The scene without what its text does not hold.
fn without_path(mut scene: Scene) -> Scene {
    (scene.source, scene.devices[0].path) = (None, None);
    scene
}

#[test]
fn every_scene_that_comes_with_palpate_survives_the_trip() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("scenes");
    let mut scenes = 0;
    for entry in std::fs::read_dir(&folder).unwrap() {
        let path = entry.unwrap().path();
        if path.extension().is_none_or(|ending| ending != "toml") {
            continue;
        }
        let scene = Scene::load(&path).unwrap();
        let text = scene.to_toml().unwrap();
        let again = Scene::from_toml(&text, "again.toml", Some(&folder)).unwrap_or_else(|e| panic!("{e}\n{text}"));
        assert_eq!(again.devices[0].path, scene.devices[0].path, "the path is found by its name");
        assert_eq!(without_path(again), without_path(scene), "{}", path.display());
        scenes += 1;
    }
    assert!(scenes >= 8);
}

/// Positive numbers of every size that validation lets pass, with all their bits.
fn number(lowest: f64, highest: f64) -> impl Strategy<Value = f64> {
    (lowest.ln()..highest.ln(), any::<u16>())
        .prop_map(move |(log, bits)| f64::from_bits(log.exp().to_bits() ^ u64::from(bits)).clamp(lowest, highest))
}

/// A region of any kind that holds node [0, 0, 0], and so is somewhere in every body.
fn region() -> impl Strategy<Value = RegionSpec> {
    let lengths = || [number(0.01, 1.0), number(0.01, 1.0), number(0.01, 1.0)];
    let shape = prop_oneof![
        (lengths(), number(2.0, 9.0)).prop_map(|(centre, radius)| Shape::Sphere { centre, radius }),
        (lengths(), number(2.0, 9.0)).prop_map(|(centre, r)| Shape::Ellipsoid { centre, radii: [r, 2.0 * r, 3.0 * r] }),
        (lengths(), lengths()).prop_map(|(low, max)| Shape::Box { min: low.map(|x| -x), max }),
        (0_usize..3, number(0.01, 1.0)).prop_map(|(axis, to)| Shape::Layer { axis, from: -to, to }),
    ];
    let value = |least, most| prop::option::of(number(least, most));
    (shape, any::<bool>(), number(0.1, 1e4), value(0.01, 5.0), value(1e-6, 1.0)).prop_map(
        |(shape, is_named, stiffness, damping_ratio, node_mass_kg)| RegionSpec {
            name: is_named.then(|| "a \"hard\" part".to_owned()),
            shape,
            stiffness_n_per_m: Some(stiffness),
            damping_ratio,
            node_mass_kg,
        },
    )
}

fn body() -> impl Strategy<Value = BodySpec> {
    let size = [number(0.05, 5.0), number(0.05, 5.0), number(0.05, 5.0)];
    let fixed = prop::sample::subsequence(vec![Face::XMin, Face::YMax, Face::ZMin], 0..=3);
    let nodes = [6_usize..20, 6_usize..20, 6_usize..20];
    let material = (number(1e-6, 1.0), number(0.1, 1e4), number(0.01, 5.0));
    (nodes, size, fixed, material, prop::collection::vec(region(), 0..4)).prop_map(
        |(nodes, size_m, fixed, (node_mass_kg, stiffness_n_per_m, damping_ratio), regions)| {
            BodySpec::MassSpring(MassSpringSpec {
                block: BlockSpec { nodes, size_m, fixed },
                material: MaterialSpec { node_mass_kg, stiffness_n_per_m, damping_ratio },
                regions,
            })
        },
    )
}

fn tool() -> impl Strategy<Value = ToolSpec> {
    let radius = || number(1e-3, 0.5);
    prop_oneof![
        Just(ToolSpec::Point),
        radius().prop_map(|radius_m| ToolSpec::Sphere { radius_m }),
        (radius(), number(1e-3, 0.5), number(0.1, 10.0)).prop_map(|(radius_m, length_m, x)| ToolSpec::Capsule {
            radius_m,
            length_m,
            axis: [x, -0.0, -1.0 / x],
        }),
    ]
}

fn scenes() -> impl Strategy<Value = Scene> {
    let friction = prop_oneof![
        Just(FrictionSpec::Stick),
        Just(FrictionSpec::Coefficient(0.0)),
        number(1e-3, 10.0).prop_map(FrictionSpec::Coefficient)
    ];
    // A share of the coefficient, and a speed.
    let breakaway = prop::option::of((number(1e-3, 2.0), prop_oneof![Just(0.0), number(1e-4, 1.0)]));
    let contact = (friction, any::<bool>(), any::<bool>(), breakaway, tool());
    let node = [1_usize..5, 1_usize..5, 1_usize..5];
    let initial = prop::option::of((node.clone(), number(1e-4, 0.1), any::<bool>()));
    let local = (
        prop::sample::select(ModelChoice::NAMES.to_vec()),
        prop::option::of(prop::sample::select(vec![Feedback::Trajectory, Feedback::ContactNodes, Feedback::Geometry])),
        prop::sample::select(vec![StepKind::Auto, StepKind::Explicit, StepKind::Implicit]),
        prop::option::of((prop::sample::select(vec![BlendKind::Crossfade, BlendKind::Offset]), number(1.0, 30.0))),
    );
    let rest = (
        any::<bool>(),
        prop::option::of(1_u32..100),
        prop_oneof![Just(0.0), number(0.1, 100.0)],
        prop::option::of(number(0.1, 50.0)),
        number(0.01, 10.0),
        prop::collection::vec(node, 0..3),
        number(0.1, 100.0),
    );
    (prop::option::of(body()), contact, initial, local, rest).prop_map(|(body, contact, initial, local, rest)| {
        let (logs_scene, substeps_per_ms, latency_ms, max_force_n, slew, probes, duration_s) = rest;
        let (model, feedback, step, blend) = local;
        let mut scene = Scene::of_program();
        scene.contact.friction = contact.0;
        scene.contact.normals = if contact.1 { Normals::Face } else { Normals::Interpolated };
        scene.contact.equations = if contact.2 { Equations::Paper } else { Equations::Corrected };
        if let (FrictionSpec::Coefficient(kinetic), false, Some((more, stribeck_m_s))) =
            (contact.0, contact.2, contact.3)
        {
            scene.contact.static_friction = Some(kinetic + more);
            scene.contact.stribeck_m_s = if more > 0.0 { stribeck_m_s } else { 0.0 };
        }
        if !contact.2 {
            scene.devices[0].tool = contact.4;
        }
        if body.is_some() {
            scene.initial = initial.map(|(node, offset, holds)| InitialSpec {
                pull: PullSpec { node: node.into(), offset_m: [offset, -0.0, -offset] },
                hold: if holds {
                    vec![[2, 2, 2].map(|n: usize| n + usize::from(node == [2, 2, 2])).into()]
                } else {
                    Vec::new()
                },
            });
            scene.probes = probes.into_iter().map(|node| ProbeSpec { node: node.into() }).collect();
            scene.devices[0].attach_node = scene.initial.is_none().then_some([2, 2, 5].into());
        }
        scene.body = body;
        // What does not fit the model is left out.
        (scene.local.feedback, scene.local.step) = (feedback, step);
        scene = scene.with_model(ModelChoice::from_name(model).unwrap());
        if scene.contact.equations == Equations::Paper && step == StepKind::Implicit {
            scene.local.step = StepKind::Auto;
        }
        scene.local.blend = blend.map_or(BlendSpec::default(), |(kind, ms)| BlendSpec { kind, ms });
        (scene.global.substeps_per_ms, scene.global.compute_latency_ms) = (substeps_per_ms, latency_ms);
        (scene.safety.max_force_n, scene.safety.max_slew_n_per_ms) = (max_force_n, slew);
        scene.log.scene = logs_scene;
        scene.run.duration_s = duration_s;
        scene
    })
}

proptest! {
    #[test]
    fn any_scene_survives_the_trip(scene in scenes()) {
        // Some combinations name nodes that are not there; they are no scenes.
        prop_assume!(scene.validate().is_ok());
        let text = scene.to_toml().unwrap();
        let again = Scene::from_session_toml(&text, "again.toml");
        let again = again.map_err(|error| TestCaseError::fail(format!("{error}\n{text}")))?;
        // Not only equal: -0.0 equals 0.0
        prop_assert_eq!(format!("{again:?}"), format!("{scene:?}"));
        prop_assert_eq!(again.to_toml().unwrap(), text);
    }
}
