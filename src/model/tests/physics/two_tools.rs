//! Tools that meet in a local model: resolved together there, as in the whole body.

use palpate_model::Vec3;
use palpate_model::body::{Block, Body, State};
use palpate_model::contact::{Contact, Friction, Law, ToolMotion, ToolShape};
use palpate_model::local::{Aim, Kind, LocalModel, ResyncView, Template, ToolForecast};
use palpate_model::mesh::Face;
use palpate_model::simulation::{Simulation, Stepping};
use palpate_model::surroundings::{Bases, Basis, RestingBody};

const PRESSES: u32 = 80;
const TICKS: u32 = 33;
/// Of a patch.
const SIZE: [usize; 3] = [6, 6, 3];
const SPHERE: ToolShape = ToolShape::Sphere { radius: 6e-3 };
const POINT: ToolShape = ToolShape::Point;

/// Two tools near the middle of the top of a block of 10 mm cells.
#[derive(Clone, Copy, Debug)]
struct Pair {
    nodes: usize,
    shapes: [ToolShape; 2],
    /// Where each is from there (m).
    away: [Vec3; 2],
    /// How far each is pressed in a millisecond (m), and how it is dragged afterwards.
    press: f64,
    drag: [Vec3; 2],
}

impl Pair {
    fn new(shapes: [ToolShape; 2], away: Vec3) -> Self {
        let drag = [Vec3::new(5e-5, 0.0, -2e-5), Vec3::new(-1e-4, 1.5e-4, -1e-4)];
        Self { nodes: 9, shapes, away: [Vec3::zeros(), away], press: 6e-5, drag }
    }

    /// The same with the tools in the other order.
    fn swapped(self) -> Self {
        let Self { shapes: [a, b], away: [c, d], drag: [e, f], .. } = self;
        Self { shapes: [b, a], away: [d, c], drag: [f, e], ..self }
    }

    fn at(&self, tool: usize, tick: u32) -> Vec3 {
        let side = 0.01 * (self.nodes - 1) as f64;
        let middle = Vec3::new(0.5 * side - 6.2e-3, 0.5 * side + 1.3e-3, side);
        let above = Vec3::z() * (self.shapes[tool].radius() + 5e-4 - self.press * f64::from(tick.min(PRESSES)));
        middle + self.away[tool] + above + self.drag[tool] * f64::from(tick.saturating_sub(PRESSES))
    }

    fn motions(&self, tick: u32) -> [ToolMotion; 2] {
        std::array::from_fn(|tool| ToolMotion::straight(self.at(tool, tick), self.at(tool, tick + 1)))
    }

    /// The body after the tools have pressed.
    fn pressed(&self) -> Simulation {
        let side = 0.01 * (self.nodes - 1) as f64;
        let builder = Block::builder([self.nodes; 3], [side; 3]).stiffness(30.0).node_mass(0.5e-3).damping_ratio(0.3);
        let body = builder.fix(Face::ZMin).build().unwrap();
        let state = State::at_rest(body.rest());
        let law = Law { friction: Friction::from(0.6), ..Law::default() };
        let stepping = Stepping { tick: 1e-3, substeps: 2 };
        let simulation = Simulation::new(Box::new(body), state, Contact::default(), law, stepping).unwrap();
        let mut simulation = simulation.with_tool(Contact::default());
        for (tool, &shape) in self.shapes.iter().enumerate() {
            simulation = simulation.with_shape(tool, shape);
        }
        (0..PRESSES).for_each(|tick| simulation.tick_all(&self.motions(tick)));
        assert!((0..2).any(|tool| simulation.contact(tool).is_touching()), "{self:?}");
        simulation
    }

    fn forecasts(&self) -> [ToolForecast; 2] {
        std::array::from_fn(|tool| ToolForecast::at_rest(self.at(tool, PRESSES)))
    }

    /// The triangles under each tool.
    fn triangles(&self, simulation: &Simulation) -> [Vec<u32>; 2] {
        let aim = Aim::new(simulation.body().surface(), &simulation.state().positions).unwrap();
        std::array::from_fn(|tool| {
            let mut triangles = Vec::new();
            aim.triangles((simulation, tool), &self.forecasts()[tool], [0.0; 2], &mut triangles);
            triangles
        })
    }

    /// The nodes around both tools.
    fn patch(&self, simulation: &Simulation, size: [usize; 3]) -> Vec<u32> {
        let (mut patch, mut pressed) = (Vec::new(), Vec::new());
        let triangles = self.triangles(simulation);
        simulation.patch(0, &triangles.concat(), size, &mut patch);
        simulation.pressed_beside(0, |other| &triangles[other], &mut pressed);
        patch.append(&mut pressed);
        patch.sort_unstable();
        patch.dedup();
        patch
    }

    /// The models of both tools as a resync builds them, of a body in which the tools are expected to stay; told of each other or not.
    fn models(
        &self,
        template: &Template,
        simulation: &mut Simulation,
        known: (&[u32], &Bases),
        told: bool,
    ) -> [Box<dyn LocalModel>; 2] {
        let (patch, bases) = known;
        let (tools, triangles) = (self.forecasts(), self.triangles(simulation));
        let nearest = triangles.each_ref().map(|triangles| triangles[0]);
        std::array::from_fn(|index| {
            let mut model = template.empty();
            model.rebuild(ResyncView {
                global: simulation,
                tick: PRESSES.into(),
                triangles: &triangles[index],
                nearest: if told { &nearest } else { &[] },
                patch: (!bases.is_empty()).then_some(patch),
                tools: &tools,
                index,
                horizon: TICKS,
                bases,
            });
            model
        })
    }

    /// The forces on both tools in the ticks after the resync: of the whole body, and of the local models.
    fn felt(&self, size: [usize; 3], told: bool) -> [Vec<[Vec3; 2]>; 2] {
        let (simulation, models) = self.predictive(size, told);
        self.follow(simulation, models)
    }

    /// The body after the tools have pressed, and its predictive models with a basis around both.
    fn predictive(&self, size: [usize; 3], told: bool) -> (Simulation, [Box<dyn LocalModel>; 2]) {
        let mut simulation = self.pressed();
        let patch = self.patch(&simulation, size);
        let resting = RestingBody::new(simulation.body()).unwrap();
        let mut bases = Bases::default();
        bases.insert(Basis::compute(&resting, &patch, 150).unwrap().unwrap().into());
        let template = Template::new(Kind::Predictive, size, simulation.body()).unwrap();
        let models = self.models(&template, &mut simulation, (&patch, &bases), told);
        assert!(models.iter().enumerate().all(|(tool, model)| model.serves_as(tool) == Kind::Predictive));
        (simulation, models)
    }

    fn follow(&self, mut whole: Simulation, mut models: [Box<dyn LocalModel>; 2]) -> [Vec<[Vec3; 2]>; 2] {
        let mut felt: [Vec<_>; 2] = Default::default();
        for tick in PRESSES..PRESSES + TICKS {
            let motions = self.motions(tick);
            whole.tick_all(&motions);
            felt[0].push([whole.force(0), whole.force(1)]);
            felt[1].push(models.each_mut().map(|model| model.tick(&motions).force));
        }
        felt
    }
}

/// How far apart two courses are on each tool at most, over the largest of the first.
fn apart([expected, felt]: &[Vec<[Vec3; 2]>; 2]) -> [f64; 2] {
    std::array::from_fn(|tool| {
        let largest = expected.iter().map(|forces| forces[tool].norm()).fold(0.0, f64::max);
        let apart = expected.iter().zip(felt).map(|(a, b)| (a[tool] - b[tool]).norm());
        apart.fold(0.0, f64::max) / largest
    })
}

/// Over the same nodes, over neighbours, and with a cell between them.
fn pairs() -> impl Iterator<Item = Pair> {
    let shapes = [[POINT, POINT], [SPHERE, SPHERE], [SPHERE, POINT]];
    let aways = [Vec3::new(2e-3, 1e-3, 0.0), Vec3::new(9e-3, 2e-3, 0.0), Vec3::new(1.8e-2, -4e-3, 0.0)];
    shapes.into_iter().flat_map(move |shapes| aways.map(|away| Pair::new(shapes, away)))
}

/// Check that a tool which does what nobody expected is felt by its neighbour at once, and not from the next resync on.
#[test]
fn tools_in_one_window_feel_each_other_as_in_the_whole_body() {
    let mut untold = Vec::new();
    for pair in pairs() {
        let together = apart(&pair.felt(SIZE, true));
        println!("{pair:?}: {together:.4?}");
        assert!(together.iter().all(|&apart| apart < 0.02), "{pair:?}: {together:?}");
        untold.push(apart(&pair.felt(SIZE, false)));
    }
    let worst = untold.iter().map(|[a, b]| a.max(*b)).fold(f64::INFINITY, f64::min);
    assert!(worst > 0.05, "a model that is not told of the other is far off: {untold:.3?}");
}

#[test]
fn the_order_of_the_tools_does_not_matter() {
    for pair in pairs() {
        let [[_, one], [_, other]] = [pair.felt(SIZE, true), pair.swapped().felt(SIZE, true)];
        let other = other.into_iter().map(|[a, b]| [b, a]).collect();
        let apart = apart(&[one, other]);
        assert!(apart.iter().all(|&apart| apart < 1e-6), "{pair:?}: {apart:?}");
    }
}

/// Check that one model is enough for both tools.
#[test]
fn a_model_serves_another_tool_as_well_as_its_own() {
    for pair in pairs() {
        let (_, mut models) = pair.predictive(SIZE, true);
        for tick in PRESSES..PRESSES + TICKS {
            let motions = pair.motions(tick);
            let own = models.each_mut().map(|model| model.tick(&motions).force);
            for (tool, own) in own.iter().enumerate() {
                let [mine, other] = [tool, 1 - tool].map(|host| models[host].wrench(tool).unwrap().force);
                assert_eq!(mine, *own);
                assert!((mine - other).norm() < 1e-6 * mine.norm().max(0.1), "{pair:?} {tick}: {mine} and {other}");
                assert_eq!(models[0].contact(tool).mode, models[1].contact(tool).mode);
            }
        }
        let (_, [untold, _]) = pair.predictive(SIZE, false);
        assert_eq!(untold.wrench(1), None);
    }
}

/// Check that a model goes on for the tool that stays, whichever it was built around, and gives the other what it felt, without a jump.
#[test]
fn of_two_tools_in_a_model_either_may_leave() {
    let mut left = 0;
    for (pair, gone) in pairs().filter(|pair| pair.away[1].x > 0.005).flat_map(|pair| [(pair, 0), (pair, 1)]) {
        let mut drag = [Vec3::zeros(); 2];
        drag[gone] = Vec3::new(if gone == 0 { -1e-3 } else { 1e-3 }, 2e-4, 0.0);
        let pair = Pair { drag, ..pair };
        let (mut whole, [mut model, _]) = pair.predictive([4, 4, 3], true);
        let (mut before, mut largest, mut apart, mut jump) = (None::<Vec3>, [0.0_f64; 2], 0.0_f64, 0.0_f64);
        for tick in PRESSES..PRESSES + TICKS {
            let motions = pair.motions(tick);
            whole.tick_all(&motions);
            model.tick(&motions);
            let felt = [0, 1].map(|tool| model.wrench(tool).unwrap().force);
            (0..2).for_each(|tool| largest[tool] = largest[tool].max(whole.force(tool).norm()));
            apart = apart.max((felt[1 - gone] - whole.force(1 - gone)).norm());
            let step =
                before.filter(|_| model.serves_as(gone) == Kind::Hold).map(|before| (felt[gone] - before).norm());
            jump = jump.max(step.unwrap_or_default());
            before = Some(felt[gone]);
        }
        assert_eq!(model.serves_as(1 - gone), Kind::Predictive);
        left += u32::from(model.serves_as(gone) == Kind::Hold);
        let (apart, jump) = (apart / largest[1 - gone], jump / largest[gone]);
        println!("{pair:?} without {gone}: {apart:.4}, in a tick {jump:.4}");
        assert!(apart < 0.12 && jump < 0.05, "{pair:?} without {gone}: {apart}, {jump}");
    }
    assert!(left >= 6, "{left} have left");
}

/// Check that a tool which goes where its neighbour's window does not reach leaves that as it last pressed.
#[test]
fn a_tool_that_leaves_its_neighbours_window_spoils_nothing() {
    for pair in pairs().filter(|pair| pair.away[1].x > 0.005) {
        let drag = [Vec3::zeros(), Vec3::new(1e-3, 2e-4, 0.0)];
        let pair = Pair { drag, ..pair };
        let gone = apart(&pair.felt([4, 4, 3], true))[0];
        let kept = apart(&pair.felt([8, 8, 3], true))[0];
        println!("{pair:?}: {gone:.4} and {kept:.4}");
        assert!(gone < 0.12 && kept < 0.02, "{pair:?}: {gone} and {kept}");
    }
}

/// Check the linear patch, in explicit and in implicit steps, on a body so small that the patch holds it, and so little pressed that it
/// is linear. An implicit step of a millisecond is as far off for one tool alone.
#[test]
fn tools_on_a_linear_patch_feel_each_other_too() {
    for pair in pairs().filter(|pair| pair.away[1].x == 9e-3) {
        let drag = pair.drag.map(|drag| drag * 0.05);
        let pair = Pair { nodes: 5, press: 1e-5, drag, ..pair };
        let explicit = Template::new(Kind::Patch, [5, 5, 4], pair.pressed().body()).unwrap();
        for (template, limit) in [(explicit.clone(), 0.015), (explicit.with_implicit_steps(), 0.12)] {
            let felt = |told| {
                let models = pair.models(&template, &mut pair.pressed(), (&[], &Bases::default()), told);
                apart(&pair.follow(pair.pressed(), models))
            };
            let ([together, other], untold) = (felt(true), felt(false));
            println!("{pair:?} {together:.4} {other:.4}, untold {untold:.4?}");
            assert!(together < limit && other < limit && untold[0] > 0.3, "{pair:?}: {together} {other}, {untold:?}");
        }
    }
}

/// Check that a point that taps a body feels what it feels alone, whoever presses far away: its first touch, within a step, too.
#[test]
fn a_point_that_taps_feels_the_same_beside_another_tool() {
    let builder = Block::builder([17, 5, 4], [0.16, 0.04, 0.03]).stiffness(30.0).node_mass(0.5e-3).damping_ratio(0.3);
    let body = builder.fix(Face::ZMin).build().unwrap();
    let law = Law { friction: Friction::from(0.5), ..Law::default() };
    let stepping = Stepping { tick: 1e-3, substeps: 2 };
    let alone = || {
        let state = State::at_rest(body.rest());
        Simulation::new(Box::new(body.clone()), state, Contact::default(), law, stepping).unwrap()
    };
    // Down at half a metre a second to 4 mm, and up again; the other one comes from above, 13 cm away.
    let tap = |k: i32| Vec3::new(0.0137, 0.0212, 0.03 + 5e-4 * f64::from((k - 5).abs().min(13)) - 4e-3 + 1.3e-4);
    let beside = |k: i32| Vec3::new(0.147, 0.0197, 0.03 + 7e-3 - 1e-4 * f64::from(k));
    let motion = |at: &dyn Fn(i32) -> Vec3, k: i32| ToolMotion::straight(at(k), at(k + 1));
    let mut lone = alone();
    let felt: Vec<Vec3> = (-20..30).map(|k| lone.tick(motion(&tap, k)).force).collect();
    assert!(felt.iter().filter(|force| force.z > 0.1).count() > 5, "it taps: {felt:?}");
    for shape in [POINT, SPHERE] {
        let mut both = alone().with_tool(Contact::default()).with_shape(1, shape);
        for (k, force) in (-20..30).zip(&felt) {
            both.tick_all(&[motion(&tap, k), motion(&beside, k)]);
            let other = both.wrench(0).force;
            // What the other tool does comes here as a wave, which is weak yet.
            assert!((other - force).norm() < 1e-6, "{shape:?} at {k}: {other} and {force}");
        }
    }
}
