//! A local model that is built on another computer: the same as here, and nothing that is sent there can break it.

use palpate_model::body::{Block, Body, State};
use palpate_model::bytes::{BytesReader, BytesWriter};
use palpate_model::contact::{Contact, Law, ToolMotion, ToolShape};
use palpate_model::local::{Image, Kind, LocalModels, ResyncView, Shipment, Template, ToolForecast};
use palpate_model::mesh::Face;
use palpate_model::simulation::{Simulation, Stepping};
use palpate_model::surroundings::{Bases, Basis, RestingBody};
use palpate_model::{Pose, Turn, Vec3};
use proptest::prelude::*;

const PRESSES: u64 = 60;
const HORIZON: u32 = 30;

/// A block with a tool over it, and a second one beside that presses as well: of that shape, and a point.
fn at_rest(shape: ToolShape) -> Simulation {
    at_rest_of([shape, ToolShape::Point])
}

/// Likewise with both shapes.
fn at_rest_of(shapes: [ToolShape; 2]) -> Simulation {
    let builder = Block::builder([8; 3], [0.07; 3]).stiffness(30.0).node_mass(0.5e-3).damping_ratio(0.3);
    let body = builder.fix(Face::ZMin).build().unwrap();
    let state = State::at_rest(body.rest());
    let law = Law { friction: 0.5.into(), ..Law::default() };
    let stepping = Stepping { tick: 1e-3, substeps: 2 };
    let simulation = Simulation::new(Box::new(body), state, Contact::default(), law, stepping).unwrap();
    simulation.with_tool(Contact::default()).with_shape(0, shapes[0]).with_shape(1, shapes[1])
}

/// The same after both have pressed, the second at x = `beside` (m), and where they are.
fn pressed(shape: ToolShape, beside: f64) -> (Simulation, [Pose; 2]) {
    pressed_by([shape, ToolShape::Point], Turn::identity(), beside)
}

/// Likewise with both shapes, the first one turned.
fn pressed_by(shapes: [ToolShape; 2], turn: Turn, beside: f64) -> (Simulation, [Pose; 2]) {
    let mut simulation = at_rest_of(shapes);
    let at = |tick: u64| {
        let down = 0.0705 - 1e-4 * tick as f64;
        let [first, second] = shapes.map(|shape| down + shape.radius());
        let first = Pose { position: Vec3::new(0.033, 0.0362, first), orientation: turn };
        [first, Pose::at(Vec3::new(beside, 0.0362, second))]
    };
    for tick in 0..PRESSES {
        let [from, to] = [at(tick), at(tick + 1)];
        simulation.tick_all(&[0, 1].map(|tool| ToolMotion { from: from[tool], to: to[tool] }));
    }
    assert!((0..2).all(|tool| simulation.contact(tool).is_touching()));
    (simulation, at(PRESSES))
}

/// The patch around the first tool, and its basis.
fn patch_and_bases(simulation: &Simulation) -> (Vec<u32>, Bases) {
    let triangle = simulation.contact(0).triangle.unwrap();
    let mut patch = Vec::new();
    simulation.patch(0, &[triangle], [4, 4, 2], &mut patch);
    let resting = RestingBody::new(simulation.body()).unwrap();
    let mut bases = Bases::default();
    bases.insert(Basis::compute(&resting, &patch, 30).unwrap().unwrap().into());
    (patch, bases)
}

/// Builds one model that serves both tools if it resolves them, else two.
fn build(models: &mut LocalModels, (simulation, tools): (&mut Simulation, &[Pose; 2]), patch: &[u32], bases: &Bases) {
    let nearest: [u32; 2] = std::array::from_fn(|tool| simulation.contact(tool).triangle.unwrap());
    for index in 0..2 {
        if index == 0 || !models.share(0, index) {
            models.rebuild(ResyncView {
                global: simulation,
                tick: PRESSES,
                triangles: &nearest[index..=index],
                nearest: &nearest,
                patch: (!bases.is_empty() && index == 0).then_some(patch),
                tools: &tools.map(ToolForecast::at_rest),
                index,
                horizon: HORIZON,
                bases,
            });
        }
    }
}

/// What the tools feel in each tick of a drag of both.
fn drag(models: &mut LocalModels, from: [Pose; 2]) -> Vec<[Vec3; 2]> {
    drag_for(40, models, from)
}

/// Likewise for so many ticks.
fn drag_for(ticks: u32, models: &mut LocalModels, from: [Pose; 2]) -> Vec<[Vec3; 2]> {
    let way = |tick: u32| Vec3::new(2e-4, 1e-4, -5e-5) * f64::from(tick);
    let at = |tick: u32| from.map(|from| Pose { position: from.position + way(tick), ..from });
    let motions = |tick| {
        let [from, to] = [at(tick), at(tick + 1)];
        [0, 1].map(|tool| ToolMotion { from: from[tool], to: to[tool] })
    };
    let felt = |tick| {
        models.tick(&motions(tick));
        [0, 1].map(|tool| models.wrench(tool).force)
    };
    (0..ticks).map(felt).collect()
}

fn empty(template: &Template) -> LocalModels {
    LocalModels::new(2, || template.empty())
}

/// What is sent of the models of a body that has been pressed.
fn sent(
    template: &Template,
    pressed: (&mut Simulation, &[Pose; 2]),
    (patch, bases): (&[u32], &Bases),
) -> (Shipment, Vec<u8>) {
    let mut departing = LocalModels::new(2, || template.departing());
    build(&mut departing, pressed, patch, bases);
    let (shipment, mut bytes) = (Shipment::of(&departing), Vec::new());
    shipment.write(&mut BytesWriter(&mut bytes));
    (shipment, bytes)
}

#[test]
fn models_that_are_built_over_there_are_those_that_would_be_built_here() {
    // The second tool is outside of the patch, or in it.
    let shapes = [ToolShape::Point, ToolShape::Sphere { radius: 6e-3 }];
    let mut shared = [0; 2];
    for (shape, beside) in shapes.into_iter().flat_map(|shape| [0.052, 0.041].map(|beside| (shape, beside))) {
        let (mut simulation, tools) = pressed(shape, beside);
        let (patch, bases) = patch_and_bases(&simulation);
        for kind in Kind::ALL.into_iter().filter(|&kind| kind != Kind::Full) {
            let template = Template::new(kind, [4, 4, 2], simulation.body()).unwrap();
            let bases = if kind == Kind::Predictive { bases.clone() } else { Bases::default() };
            let [mut here, mut there] = [empty(&template), empty(&template)];
            build(&mut here, (&mut simulation, &tools), &patch, &bases);
            shared[here.hosts()[1]] += 1;

            let (_, bytes) = sent(&template, (&mut simulation, &tools), (&patch, &bases));
            let mut from = BytesReader(&bytes);
            let shipment = Shipment::read(&mut from).unwrap();
            assert!(from.0.is_empty() && shipment.tick() == PRESSES);
            let mut image = Image::new(at_rest(shape));
            assert!(image.rebuild(&shipment, &bases, &mut there));
            assert_eq!((there.hosts(), there.built_at()), (here.hosts(), PRESSES));
            for tool in 0..2 {
                let [here, there] = [here.of(tool), there.of(tool)];
                assert_eq!(there.serves_as(tool), here.serves_as(tool), "{kind:?}");
                assert_eq!(there.contact(tool), here.contact(tool), "{kind:?}");
                assert_eq!(there.contact_points(tool), here.contact_points(tool), "{kind:?}");
                assert_eq!(there.contact_area(tool), here.contact_area(tool), "{kind:?}");
            }
            let forces = [drag(&mut here, tools), drag(&mut there, tools)];
            for tool in 0..2 {
                let largest = forces[0].iter().map(|force| force[tool].norm()).fold(0.0, f64::max);
                let apart = forces[0].iter().zip(&forces[1]).map(|(a, b)| (a[tool] - b[tool]).norm());
                let apart = apart.fold(0.0, f64::max);
                println!("{kind:?} {shape:?}: {} bytes, {:.1e} of {largest:.2} N apart", bytes.len(), apart);
                // To the last bit, but for a path that is rounded.
                let looks_ahead = matches!(kind, Kind::Predicted | Kind::Predictive);
                assert!(apart <= if looks_ahead { 2e-5 * largest } else { 0.0 }, "{kind:?}: {apart} of {largest}");
            }
        }
    }
    assert!(shared.iter().all(|&count| count >= 6), "models for both tools, and one for each: {shared:?}");
}

/// The models of both tools as they are built here, and over there.
fn here_and_there(
    template: &Template,
    pressed: (&mut Simulation, &[Pose; 2]),
    shapes: [ToolShape; 2],
) -> [LocalModels; 2] {
    let [mut here, mut there] = [empty(template), empty(template)];
    let none = Bases::default();
    let (simulation, tools) = pressed;
    build(&mut here, (&mut *simulation, tools), &[], &none);
    let (_, bytes) = sent(template, (simulation, tools), (&[], &none));
    let shipment = Shipment::read(&mut BytesReader(&bytes)).unwrap();
    assert!(Image::new(at_rest_of(shapes)).rebuild(&shipment, &none, &mut there));
    [here, there]
}

/// Check that `hold`, whose one model serves all tools, tells what each of them touches.
#[test]
fn the_contact_area_of_every_tool_is_told_over_there() {
    let shapes = [ToolShape::Sphere { radius: 6e-3 }; 2];
    let (mut simulation, tools) = pressed_by(shapes, Turn::identity(), 0.052);
    let template = Template::new(Kind::Hold, [4, 4, 2], simulation.body()).unwrap();
    let [here, there] = here_and_there(&template, (&mut simulation, &tools), shapes);
    for tool in 0..2 {
        let [here, there] = [&here, &there].map(|models| models.of(tool).contact_area(tool));
        assert!(here > 1e-5 && there == here, "tool {tool}: {here} m^2 here, {there} m^2 there");
    }
}

/// Check that a capsule that lies on the body is known to lie there: what it feels beyond its window hangs on how deep it was in it.
#[test]
fn a_tool_that_is_turned_leaves_its_window_over_there_as_here() {
    let shapes = [ToolShape::Capsule { radius: 5e-3, half_axis: Vec3::z() * 0.008 }, ToolShape::Point];
    let lies = Turn::from_axis_angle(&Vec3::y_axis(), std::f64::consts::FRAC_PI_2);
    let (mut simulation, tools) = pressed_by(shapes, lies, 0.052);
    let template = Template::new(Kind::Patch, [4, 4, 2], simulation.body()).unwrap();
    let models = here_and_there(&template, (&mut simulation, &tools), shapes);
    let [here, there] = models.map(|mut models| {
        let felt = drag_for(120, &mut models, tools);
        assert_eq!(models.of(0).serves_as(0), Kind::Hold, "it is beyond its window");
        felt
    });
    assert!(here[119][0].norm() > 0.1, "{} N", here[119][0]);
    assert_eq!(here, there);
}

/// Check that a computer where one tool is felt gets the model of that alone, feels in it what it would with all, and that one where the
/// other tool is felt too takes no shipment that lacks it.
#[test]
fn a_tool_that_is_felt_elsewhere_has_no_model_here() {
    for (beside, is_held) in [(0.052, false), (0.041, true)] {
        let (mut simulation, tools) = pressed(ToolShape::Point, beside);
        let (patch, bases) = patch_and_bases(&simulation);
        let template = Template::new(Kind::Predictive, [4, 4, 2], simulation.body()).unwrap();
        let mut departing = LocalModels::new(2, || template.departing());
        build(&mut departing, (&mut simulation, &tools), &patch, &bases);
        let [all, of_first] = [Shipment::of(&departing), Shipment::of_tools(&departing, &[0])];
        assert_eq!((all.parcels().len(), of_first.parcels().len()), (if is_held { 1 } else { 2 }, 1));
        let [all, of_first] = [all, of_first].map(|shipment| {
            let mut bytes = Vec::new();
            shipment.write(&mut BytesWriter(&mut bytes));
            Shipment::read(&mut BytesReader(&bytes)).unwrap()
        });
        let [mut with_all, mut alone] = [empty(&template), empty(&template)];
        assert!(Image::new(at_rest(ToolShape::Point)).rebuild(&all, &bases, &mut with_all));
        let image = || Image::new(at_rest(ToolShape::Point));
        assert_eq!(
            image().rebuild(&of_first, &bases, &mut empty(&template)),
            is_held,
            "nothing serves the second tool"
        );
        assert!(image().without(vec![1]).rebuild(&of_first, &bases, &mut alone));
        let [with_all, alone] = [&mut with_all, &mut alone].map(|models| drag(models, tools));
        for (all, one) in with_all.iter().zip(&alone) {
            assert_eq!(one[0], all[0]);
            assert_eq!(one[1], if is_held { all[1] } else { Vec3::zeros() });
        }
    }
}

/// Check that a tool which another machine puts to the other side of the first one is not dragged there past that one, and feels nothing.
#[test]
fn a_tool_that_is_put_elsewhere_tears_nothing_along() {
    for kind in [Kind::Patch, Kind::Predictive] {
        let (mut simulation, tools) = pressed(ToolShape::Sphere { radius: 6e-3 }, 0.041);
        let (patch, bases) = patch_and_bases(&simulation);
        let bases = if kind == Kind::Predictive { bases } else { Bases::default() };
        let template = Template::new(kind, [4, 4, 2], simulation.body()).unwrap();
        let mut models = empty(&template);
        build(&mut models, (&mut simulation, &tools), &patch, &bases);
        let rests = |pose: Pose| ToolMotion { from: pose, to: pose };
        models.tick(&tools.map(rests));
        let before = models.wrench(0).force;
        assert!(before.norm() > 0.1 && models.wrench(1).force.norm() > 0.1, "{kind:?}: both press");
        for _ in 0..20 {
            models.tick(&[rests(tools[0]), rests(Pose::at(Vec3::new(-0.03, 0.0362, 0.03)))]);
            let apart = (models.wrench(0).force - before).norm();
            // What the second one pressed down comes up to the first.
            assert!(apart < before.norm(), "{kind:?}: {apart} of {}", before.norm());
            assert_eq!(models.wrench(1).force, Vec3::zeros(), "{kind:?}");
        }
    }
}

#[test]
fn a_parcel_of_another_body_is_refused_and_a_path_of_another_ring_is_not_gone() {
    let (mut simulation, tools) = pressed(ToolShape::Point, 0.052);
    let (patch, bases) = patch_and_bases(&simulation);
    let template = Template::new(Kind::Predictive, [4, 4, 2], simulation.body()).unwrap();
    let (shipment, _) = sent(&template, (&mut simulation, &tools), (&patch, &bases));
    let small = Block::builder([4; 3], [0.03; 3]).fix(Face::ZMin).build().unwrap();
    let state = State::at_rest(small.rest());
    let stepping = Stepping { tick: 1e-3, substeps: 2 };
    let other = Simulation::new(Box::new(small), state, Contact::default(), Law::default(), stepping).unwrap();
    let mut image = Image::new(other.with_tool(Contact::default()));
    assert!(!image.rebuild(&shipment, &bases, &mut empty(&template)));
    let one = &mut LocalModels::new(1, || template.empty());
    assert!(!Image::new(at_rest(ToolShape::Point)).rebuild(&shipment, &bases, one), "models for other tools");
    assert!(!image.has_room_for(bases.iter().next().unwrap()));
    assert!(Image::new(at_rest(ToolShape::Point)).has_room_for(bases.iter().next().unwrap()));
}

#[test]
fn a_shipment_for_more_tools_than_anybody_has_is_refused() {
    let (mut simulation, tools) = pressed(ToolShape::Point, 0.041);
    let template = Template::new(Kind::Hold, [4, 4, 2], simulation.body()).unwrap();
    let (_, bytes) = sent(&template, (&mut simulation, &tools), (&[], &Bases::default()));
    // One model, and so many tools that it serves.
    let of = |tools: u32| {
        let mut all = tools.to_le_bytes().to_vec();
        all.extend((0..tools).flat_map(|_| 0_u16.to_le_bytes()));
        all.extend(&bytes[4 + 2 * 2..]);
        Shipment::read(&mut BytesReader(&all)).is_some()
    };
    assert_eq!([of(0), of(1), of(2), of(64), of(65)], [false, true, true, true, false]);
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(400))]

    #[test]
    fn bytes_of_anybody_are_refused_or_make_a_model_that_ticks(
        cut in 0_usize..200_000,
        flips in prop::collection::vec((0_usize..200_000, 1_u8..), 0..6),
        garbage in prop::collection::vec(any::<u8>(), 0..300),
        is_garbage in any::<bool>(),
        kind in prop::sample::select(vec![Kind::Hold, Kind::Patch, Kind::Predictive]),
    ) {
        thread_local! {
            static GOOD: Vec<(Kind, Vec<u8>)> = {
                let (mut simulation, tools) = pressed(ToolShape::Sphere { radius: 6e-3 }, 0.041);
                let (patch, bases) = patch_and_bases(&simulation);
                [Kind::Hold, Kind::Patch, Kind::Predictive].map(|kind| {
                    let template = Template::new(kind, [4, 4, 2], simulation.body()).unwrap();
                    let bases = if kind == Kind::Predictive { bases.clone() } else { Bases::default() };
                    (kind, sent(&template, (&mut simulation, &tools), (&patch, &bases)).1)
                }).into()
            };
        }
        let mut bytes = GOOD.with(|good| good.iter().find(|(of, _)| *of == kind).unwrap().1.clone());
        if is_garbage {
            bytes = garbage;
        }
        // Most of what can be wrong stands at the front.
        for (at, flip) in flips {
            let place = if at % 2 == 0 { at % bytes.len().clamp(1, 400) } else { at % bytes.len().max(1) };
            bytes.get_mut(place).into_iter().for_each(|byte| *byte ^= flip);
        }
        bytes.truncate(bytes.len().saturating_sub(cut % 3 * cut));
        let Some(shipment) = Shipment::read(&mut BytesReader(&bytes)) else { return Ok(()) };
        let simulation = at_rest(ToolShape::Sphere { radius: 6e-3 });
        let template = Template::new(kind, [4, 4, 2], simulation.body()).unwrap();
        let mut models = empty(&template);
        if Image::new(simulation).rebuild(&shipment, &Bases::default(), &mut models) {
            drag(&mut models, [0.033, 0.052].map(|x| Pose::at(Vec3::new(x, 0.0362, 0.07))));
        }
    }
}
