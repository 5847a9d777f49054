//! What the tests of tools with a shape share: bodies, and presses and slides that are slow enough to be static.
#![allow(dead_code)]

use palpate_model::body::{Block, Body, State, Tetrahedra, Tissue, Where};
use palpate_model::contact::{Contact, Law, ToolMotion, ToolShape};
use palpate_model::mesh::{Face, Group, TetrahedralMesh};
use palpate_model::simulation::{Simulation, Stepping};
use palpate_model::{Vec3, Wrench};

use crate::tissue_support::{WIDE, bent::centred, body, organ, orient};

/// Young's modulus of the tissue that is pressed (Pa).
pub const YOUNG: f64 = 5000.0;
/// What velocities keep in a tick while a body is to come to rest.
pub const CALM: f64 = 0.93;
/// Side of the block of springs (m).
pub const SIDE: f64 = 0.1;

/// A body without contact yet, at rest, with steps that are stable and no friction.
pub fn resting(body: Box<dyn Body>, shape: ToolShape) -> Simulation {
    resting_in(body, shape, 1)
}

/// The same in so many times the steps.
pub fn resting_in(mut body: Box<dyn Body>, shape: ToolShape, times: u32) -> Simulation {
    let stepping = Stepping { tick: 1e-3, substeps: times * Stepping::stable_substeps(&mut *body, 1e-3) };
    let state = State::at_rest(body.rest());
    Simulation::new(body, state, Contact::default(), Law::default(), stepping).expect("it fits").with_shape(0, shape)
}

/// A body that swings no longer than one asks for, where tissue of little viscosity would.
pub struct Calm {
    pub simulation: Simulation,
    /// Steps in a tick of a millisecond.
    steps: u32,
}

impl Calm {
    /// At rest, without contact yet and without friction.
    pub fn new(mut body: Box<dyn Body>, shape: ToolShape) -> Self {
        let steps = Stepping::stable_substeps(&mut *body, 1e-3);
        let stepping = Stepping { tick: 1e-3 / f64::from(steps), substeps: 1 };
        let state = State::at_rest(body.rest());
        let simulation = Simulation::new(body, state, Contact::default(), Law::default(), stepping).expect("it fits");
        Self { simulation: simulation.with_shape(0, shape), steps }
    }

    /// A tick in which velocities keep so large a `share`. They lose the rest in equal parts after each step: all at once would drive the modes
    /// that swing in time with it.
    pub fn tick(&mut self, motion: ToolMotion, share: f64) -> Wrench {
        let n = f64::from(self.steps);
        let mut sum = Wrench::default();
        for step in 0..self.steps {
            let step = f64::from(step);
            sum += self.simulation.tick(motion.part(step / n, (step + 1.0) / n));
            let velocities = &mut self.simulation.state_mut().velocities;
            velocities.iter_mut().for_each(|v| *v *= share.powf(1.0 / n));
        }
        sum / n
    }
}

/// Where a sphere of `radius` (m) is at the start of a tick as it goes down at `speed` (m/s) to `depth` (m) in the middle of a slab that is
/// `thick` (m).
pub fn down(thick: f64, radius: f64, [depth, speed]: [f64; 2]) -> impl Fn(u32) -> Vec3 {
    move |tick| {
        let way = (speed * 1e-3 * f64::from(tick)).min(depth + 1e-4);
        Vec3::new(0.51 * WIDE, 0.488 * WIDE, thick + radius + 1e-4 - way)
    }
}

/// The largest force (N) on a sphere that goes [`down`] into `slab` in so many times the steps that are stable at rest, and in `rest` ticks
/// after; infinite if one is not finite.
pub fn crush(slab: Tetrahedra, thick: f64, radius: f64, way: [f64; 2], times: u32, rest: u32) -> f64 {
    let at = down(thick, radius, way);
    let mut simulation = resting_in(Box::new(slab), ToolShape::Sphere { radius }, times);
    let ticks = (way[0] / way[1] * 1e3) as u32 + rest;
    (0..ticks).fold(0.0, |peak: f64, tick| {
        let force = simulation.tick(ToolMotion::straight(at(tick), at(tick + 1))).force.norm();
        if force.is_finite() { peak.max(force) } else { f64::INFINITY }
    })
}

/// What a tool that is pressed in feels at last.
#[derive(Clone, Copy, Debug, Default)]
pub struct Pressed {
    pub wrench: Wrench,
    /// Places at which it touches.
    pub places: usize,
    /// m^2
    pub area: f64,
    /// The force came to rest.
    pub rests: bool,
}

/// Presses a tool until its near side is `depth` (m) below `place`, along `outward`, and waits for the body to come to rest.
pub fn press(body: Box<dyn Body>, shape: ToolShape, place: Vec3, outward: Vec3, depth: f64) -> Pressed {
    let mut body = Calm::new(body, shape);
    let above = |tick: u32| {
        let s = (f64::from(tick) / 60.0).min(1.0);
        1e-4 - (depth + 1e-4) * s * s * (3.0 - 2.0 * s)
    };
    let at = |tick: u32| place + outward * (shape.radius() + above(tick));
    let (mut wrench, mut before, mut rests) = (Wrench::default(), f64::NAN, false);
    for tick in 0..1000 {
        wrench = body.tick(ToolMotion::straight(at(tick), at(tick + 1)), CALM);
        if tick > 100 && tick % 20 == 0 {
            let now = wrench.force.norm();
            rests = (now - before).abs() < 1e-4 * now;
            if rests {
                break;
            }
            before = now;
        }
    }
    let Calm { simulation, .. } = body;
    Pressed { wrench, places: simulation.contact_points(0).len(), area: simulation.contact_area(0), rests }
}

/// How far below `place` (m), along `outward`, the near side of a tool is that just touches.
pub fn first_touch(body: Box<dyn Body>, shape: ToolShape, place: Vec3, outward: Vec3) -> f64 {
    const STEP: f64 = 2e-5;
    let mut simulation = resting(body, shape);
    let at = |tick: i32| place + outward * (shape.radius() + 2e-3 - STEP * f64::from(tick));
    let touches = |&tick: &i32| simulation.tick(ToolMotion::straight(at(tick), at(tick + 1))).force.norm() > 0.0;
    let tick = (0..400).find(touches).expect("the tool comes to the body");
    STEP * (f64::from(tick) + 0.5) - 2e-3
}

/// Forces along `outward` (N), one per tick, of a tool that is pressed in by `depth` (m), waits for the body to come to rest and
/// then goes from `from` to `to` (m) in `seconds`.
pub fn slide(
    body: Box<dyn Body>,
    shape: ToolShape,
    [from, to]: [Vec3; 2],
    outward: Vec3,
    depth: f64,
    seconds: f64,
) -> Vec<f64> {
    let mut body = Calm::new(body, shape);
    let in_by = |tick: i32| 1e-4 - (depth + 1e-4) * (f64::from(tick) / 200.0).min(1.0);
    let along = |tick: i32| (f64::from(tick - 600) * 1e-3 / seconds).clamp(0.0, 1.0);
    let at = |tick: i32| from + (to - from) * along(tick) + outward * (shape.radius() + in_by(tick));
    let ticks = 600 + (1e3 * seconds) as i32;
    let mut forces = Vec::new();
    for tick in 0..ticks {
        let motion = ToolMotion::straight(at(tick), at(tick + 1));
        let force = body.tick(motion, if tick < 600 { CALM } else { 1.0 }).force;
        if tick >= 600 {
            forces.push(force.dot(&outward));
        }
    }
    forces
}

/// How far some forces are apart, in percent of the middle between the largest and the smallest.
pub fn spread(forces: &[f64]) -> f64 {
    let (low, high) = forces.iter().fold((f64::MAX, f64::MIN), |(low, high), &f| (low.min(f), high.max(f)));
    200.0 * (high - low) / (high + low)
}

/// How far forces are apart, in percent of their mean, beside what changes from one cell to the next, as it does towards the rims of a
/// finite body: each is compared with the mean over a cell of `ticks` around it.
pub fn ripple(forces: &[f64], ticks: usize) -> f64 {
    let mean = |forces: &[f64]| forces.iter().sum::<f64>() / forces.len() as f64;
    let beside: Vec<f64> = forces.windows(ticks + 1).map(|window| window[ticks / 2] - mean(&window[..ticks])).collect();
    let (low, high) = beside.iter().fold((f64::MAX, f64::MIN), |(low, high), &f| (low.min(f), high.max(f)));
    100.0 * (high - low) / mean(forces)
}

/// A block of springs of 0.1 m with `nodes` per axis, its bottom held: the same material for any number, as that of 12 nodes
/// with 30 N/m and 0.5 g.
pub fn lattice(nodes: usize) -> Block {
    let size = 11.0 / (nodes - 1) as f64;
    let builder = Block::builder([nodes; 3], [SIDE; 3]).stiffness(30.0 * size).node_mass(0.5e-3 * size.powi(3));
    builder.damping_ratio(0.3).fix(Face::ZMin).build().expect("a valid block")
}

/// Places on the top of a lattice with `nodes` per axis, around its middle.
pub fn on_lattice(nodes: usize) -> [(&'static str, Vec3); 4] {
    let cell = SIDE / (nodes - 1) as f64;
    let middle = ((nodes - 1) / 2) as f64;
    let at = |x: f64, y: f64| Vec3::new((middle + x) * cell, (middle + y) * cell, SIDE);
    [("node", at(0.0, 0.0)), ("edge", at(0.5, 0.0)), ("diagonal", at(0.5, 0.5)), ("face", at(2.0 / 3.0, 1.0 / 3.0))]
}

/// A block of tissue, 80 mm wide and deep, its top at z = 0 with its middle at the origin: elements of `size` (m) down to
/// `fine` (m) around that, coarser ones outside.
pub fn graded(size: f64, fine: f64, poisson_ratio: f64) -> Tetrahedra {
    let (half, depth) = (0.04, 0.08);
    let side = ticks(size, fine, half);
    let across: Vec<f64> = side.iter().skip(1).rev().map(|x| -x).chain(side.iter().copied()).collect();
    let down: Vec<f64> = ticks(size, fine, depth).into_iter().rev().map(|z| -z).collect();
    let axes = [&across, &across, &down];
    let cells = axes.map(|axis| axis.len() - 1);
    let places = |counts: [usize; 3], at: &dyn Fn(usize, usize) -> f64| -> Vec<Vec3> {
        let n = counts.iter().product();
        let indices = |n: usize| [n % counts[0], n / counts[0] % counts[1], n / (counts[0] * counts[1])];
        (0..n).map(|n| Vec3::from_fn(|axis, _| at(axis, indices(n)[axis]))).collect()
    };
    let mut points = places(cells.map(|count| count + 1), &|axis, n| axes[axis][n]);
    points.extend(places(cells, &|axis, n| 0.5 * (axes[axis][n] + axes[axis][n + 1])));
    let is_held = |&node: &u32| points[node as usize].z < 1e-6 - depth;
    let nodes = (0..points.len() as u32).filter(is_held).collect();
    let groups = vec![Group { name: "held".to_owned(), nodes, tetrahedra: vec![] }];
    let mut mesh = TetrahedralMesh { points, tetrahedra: centred(cells), groups };
    orient(&mut mesh);
    let tissue = Tissue { young_modulus: YOUNG, poisson_ratio, density: 1060.0, viscosity: 0.0 };
    Tetrahedra::builder(mesh).tissue(tissue).fix(Where::Group("held".to_owned())).build().expect("a valid body")
}

/// From 0 to `end`: steps of `size` up to `fine`, growing ones from there.
fn ticks(size: f64, fine: f64, end: f64) -> Vec<f64> {
    let mut ticks = vec![0.0];
    let (mut last, mut step) = (0.0, size);
    while last < end {
        if last >= fine {
            step *= 1.3;
        }
        last += step;
        ticks.push(last);
    }
    let from = ticks.iter().copied().find(|&x| x >= fine).unwrap_or(last).min(end);
    let stretched = |x: f64| if x > from { from + (x - from) * (end - from) / (last - from) } else { x };
    ticks.into_iter().map(stretched).collect()
}

/// The force of a sphere on a half space of the tissue (N), and the area that it touches (m^2).
pub fn hertz(radius: f64, depth: f64, poisson_ratio: f64) -> (f64, f64) {
    let modulus = YOUNG / (1.0 - poisson_ratio * poisson_ratio);
    (4.0 / 3.0 * modulus * radius.sqrt() * depth.powf(1.5), std::f64::consts::PI * radius * depth)
}

/// A sphere in the middle of a block of tissue that is fine where it touches.
pub fn press_tissue(radius: f64, depth: f64, poisson_ratio: f64, size: f64) -> Pressed {
    press_tissue_at([0.0; 2], radius, depth, poisson_ratio, size)
}

/// The same beside the middle, where there is a node, by so many elements.
pub fn press_tissue_at([x, y]: [f64; 2], radius: f64, depth: f64, poisson_ratio: f64, size: f64) -> Pressed {
    let body = graded(size, 1.6 * (radius * depth).sqrt() + size * x.abs().max(y.abs()), poisson_ratio);
    press(Box::new(body), ToolShape::Sphere { radius }, Vec3::new(x, y, 0.0) * size, Vec3::z(), depth)
}

/// The reference organ, held at its bottom.
pub fn organ_body() -> Tetrahedra {
    body(organ(), Tissue { young_modulus: YOUNG, poisson_ratio: 0.45, density: 1060.0, viscosity: 2.0 }, true)
}

/// Places on the upper surface of a body around its node that is nearest to the vertical line through `near`, and the normal
/// there.
pub fn on_top(body: &dyn Body, near: Vec3) -> ([(&'static str, Vec3); 3], Vec3) {
    let (surface, rest) = (body.surface(), body.rest());
    let corners = |t: u32| surface.triangles[t as usize];
    let across = |t: u32| {
        let [a, b, c] = corners(t).map(|node| rest[node as usize]);
        (b - a).cross(&(c - a))
    };
    let normal = |node: u32| surface.at_node(node).iter().map(|&t| across(t)).sum::<Vec3>().normalize();
    let is_upper = |&node: &u32| surface.has_node(node) && normal(node).z > 0.5;
    let far = |node: u32| (rest[node as usize] - near).xy().norm();
    let node = (0..rest.len() as u32).filter(is_upper).min_by(|&a, &b| far(a).total_cmp(&far(b))).expect("a top");
    let triangle = surface.at_node(node)[0];
    let [a, b, c] = corners(triangle).map(|node| rest[node as usize]);
    let other = corners(triangle).into_iter().find(|&other| other != node).expect("three corners");
    let edge = (rest[node as usize] + rest[other as usize]) / 2.0;
    ([("node", rest[node as usize]), ("edge", edge), ("face", (a + b + c) / 3.0)], normal(node))
}
