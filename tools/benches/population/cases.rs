//! Random but ordinary scenes: a case is its seed.

use std::f64::consts::TAU;
use std::fmt;

use palpate::Error;
use palpate::devices::ToolPath;
use palpate::model::body::Shape;
use palpate::model::local::{BlendKind, Kind};
use palpate::model::mesh::Face;
use palpate::scene::{
    BlendSpec, BlockSpec, BodySpec, DeviceSpec, FrictionSpec, MassSpringSpec, MaterialSpec, RegionSpec, Scene,
    TissueSpec, ToolSpec,
};
use palpate_mesh::{Sizes, organs};

use super::common::tissue;
use super::paths::{Ground, Motion};
use super::random::Random;
use super::shapes;

/// Simulated time (s).
pub const DURATION_S: f64 = 1.2;

/// How many times as many nodes those scenes have along each edge of a block that are called larger.
pub const LONGER: f64 = 1.7;

/// How long the elements of tissue under a tool with a shape are, in those of other scenes.
const FINE: f64 = 0.65;

/// A third of the cases is for judging: nothing was chosen by what they say.
pub fn is_unseen(seed: u64) -> bool {
    seed % 3 == 2
}

/// What a body is like.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Class {
    Cube,
    Brick,
    Slab,
    Pillar,
    Sheet,
    Tissue,
}

impl Class {
    pub const ALL: [Self; 6] = [Self::Cube, Self::Brick, Self::Slab, Self::Pillar, Self::Sheet, Self::Tissue];

    pub fn name(self) -> &'static str {
        match self {
            Self::Cube => "cube",
            Self::Brick => "brick",
            Self::Slab => "slab",
            Self::Pillar => "pillar",
            Self::Sheet => "sheet",
            Self::Tissue => "tissue",
        }
    }
}

/// What is made of a seed's scene.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Variety {
    /// As it is, with one tool.
    Single,
    /// With a second tool.
    Pairs,
    /// Blocks are so many times as long each way around the same motion.
    Larger(f64),
    /// With a capsule that turns or a sphere that presses deep, on finer tissue.
    Shapes,
}

/// One scene of the population.
pub struct Case {
    pub seed: u64,
    pub class: Class,
    pub motion: Motion,
    /// What of the body differs from the rest of it.
    pub inside: &'static str,
    pub scene: Scene,
}

impl fmt::Display for Case {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { seed, class, motion, inside, scene } = self;
        let tools: Vec<&str> = scene.devices.iter().map(|device| device.tool.name()).collect();
        let (class, motion, tools) = (class.name(), motion.name(), tools.join(" and "));
        write!(f, "{seed:>4} {class} {inside}, {motion}, {tools}, {} Hz", scene.local.rate_hz)
    }
}

impl Case {
    /// The scene of `seed` in that variety.
    pub fn new(seed: u64, variety: Variety) -> Result<Self, Error> {
        // Not by the remainder that says what is unseen.
        let random = &mut Random(0x70a1_9a7e ^ (seed << 20));
        let class = random.one_of(&[
            Class::Cube,
            Class::Cube,
            Class::Brick,
            Class::Brick,
            Class::Slab,
            Class::Pillar,
            Class::Sheet,
            Class::Tissue,
            Class::Tissue,
        ]);
        let mut scene = Scene::of_program().with_model(Kind::Predictive);
        let (body, inside, ground) = match class {
            Class::Tissue => organ(if variety == Variety::Shapes { FINE } else { 1.0 }, random)?,
            _ => springs(class, if let Variety::Larger(times) = variety { times } else { 1.0 }, random),
        };
        scene.body = Some(body);
        let motion = random.one_of(&Motion::ALL);
        if random.chance(0.4) {
            scene.devices[0].tool = ToolSpec::Sphere { radius_m: ground.cell_m * random.within(0.4, 1.2) };
        }
        let friction = if random.chance(0.2) { 0.0 } else { random.within(0.1, 1.5) };
        scene.contact.friction = FrictionSpec::Coefficient(friction);
        scene.local.rate_hz = random.one_of(&[500.0, 1000.0, 1000.0, 1000.0, 2000.0, 4000.0]);
        // An explicit step of tissue is short already, and a fine tick only adds to what the reference takes.
        if class == Class::Tissue {
            scene.local.rate_hz = scene.local.rate_hz.min(1000.0);
        }
        scene.global.rate_hz = random.one_of(&[20.0, 30.0, 30.0, 30.0, 50.0]);
        scene.local.blend = BlendSpec { kind: BlendKind::Crossfade, ms: 10.0 };
        scene.run.duration_s = DURATION_S;
        let radius = scene.devices[0].tool.shape().radius();
        scene.devices[0].path = Some(path(motion, &ground, radius, random)?);
        let mut case = Self { seed, class, motion, inside, scene };
        match variety {
            Variety::Single | Variety::Larger(_) => {}
            Variety::Pairs => case.add_second(ground, random)?,
            Variety::Shapes => shapes::use_shape(&mut case.scene, motion, ground, random)?,
        }
        Ok(case)
    }

    /// A second tool, which does something of its own at most some cells from the first: their ways may meet.
    fn add_second(&mut self, ground: Ground, random: &mut Random) -> Result<(), Error> {
        let (motion, angle) = (random.one_of(&Motion::ALL), random.within(0.0, TAU));
        let away = ground.cell_m * random.within(0.0, 5.0);
        let moved = |n: usize| ground.centre_m[n] + away * [angle.cos(), angle.sin()][n];
        let room =
            |n: usize| moved(n).clamp(ground.centre_m[n] - ground.room_m[n], ground.centre_m[n] + ground.room_m[n]);
        let ground = Ground { centre_m: [room(0), room(1)], room_m: ground.room_m.map(|room| 0.5 * room), ..ground };
        let mut second = DeviceSpec { name: Some("second".to_owned()), ..DeviceSpec::default() };
        if random.chance(0.6) {
            second.tool = ToolSpec::Sphere { radius_m: ground.cell_m * random.within(0.4, 1.2) };
        }
        second.path = Some(path(motion, &ground, second.tool.shape().radius(), random)?);
        self.scene.devices[0].name = Some("first".to_owned());
        self.scene.devices.push(second);
        Ok(())
    }
}

/// A block of springs, with the ground that a tool finds on its top, which is that of the block before it is made `larger`.
fn springs(class: Class, larger: f64, random: &mut Random) -> (BodySpec, &'static str, Ground) {
    let mut between = |low: usize, high: usize| low + (random.next() * (high - low + 1) as f64) as usize;
    let nodes = match class {
        Class::Cube | Class::Tissue => [between(8, 13); 3],
        Class::Brick => [between(10, 15), between(7, 10), between(6, 9)],
        Class::Slab => [between(12, 16), between(12, 16), between(4, 6)],
        Class::Pillar => [between(5, 7), between(5, 7), between(11, 16)],
        Class::Sheet => [between(12, 18), between(10, 14), between(2, 3)],
    };
    let cell_m = random.within(6e-3, 11e-3);
    let size = |nodes: [usize; 3]| nodes.map(|count| (count - 1) as f64 * cell_m);
    let ground_m = size(nodes);
    let nodes = nodes.map(|count| (count as f64 * larger).round() as usize);
    let size_m = size(nodes);
    // What hangs between two clamps, or lies on a table.
    let fixed = if class == Class::Sheet { vec![Face::XMin, Face::XMax] } else { vec![Face::ZMin] };
    let stiffness_n_per_m = random.sized(10.0, 300.0);
    let material = MaterialSpec {
        node_mass_kg: random.sized(0.2e-3, 1e-3),
        stiffness_n_per_m,
        damping_ratio: random.sized(0.05, 1.0),
    };
    let region = |shape, factor: f64| RegionSpec {
        name: None,
        shape,
        stiffness_n_per_m: Some(stiffness_n_per_m * factor),
        damping_ratio: None,
        node_mass_kg: None,
    };
    let (regions, inside) = match random.next() {
        ..0.25 if class != Class::Sheet => {
            let radius = cell_m * random.within(1.2, 2.2);
            let centre = [
                size_m[0] * random.within(0.35, 0.65),
                size_m[1] * random.within(0.35, 0.65),
                size_m[2] - radius - cell_m * random.within(0.6, 1.6),
            ];
            (vec![region(Shape::Sphere { centre, radius }, random.sized(3.0, 10.0))], "with a nodule")
        }
        ..0.5 if class != Class::Sheet => {
            let from = size_m[2] - cell_m * random.within(1.2, 2.4);
            let skin = Shape::Layer { axis: 2, from, to: size_m[2] + cell_m };
            let factor = if random.chance(0.5) { random.sized(0.2, 0.5) } else { random.sized(2.0, 5.0) };
            (vec![region(skin, factor)], "in layers")
        }
        _ => (Vec::new(), "plain"),
    };
    let ground = Ground {
        centre_m: [0, 1].map(|axis| size_m[axis] * random.within(0.42, 0.58)),
        room_m: [0, 1].map(|axis| (0.42 * ground_m[axis] - 1.2 * cell_m).max(0.5 * cell_m)),
        depth_m: (0.2 * ground_m[2]).min(random.within(2.5e-3, 8e-3)).max(2e-3),
        cell_m,
        surface: Box::new(move |_| size_m[2]),
    };
    let body = BodySpec::MassSpring(MassSpringSpec { block: BlockSpec { nodes, size_m, fixed }, material, regions });
    (body, inside, ground)
}

/// An organ or a beam of tetrahedra, `times` as long as those of most scenes.
fn organ(times: f64, random: &mut Random) -> Result<(BodySpec, &'static str, Ground), Error> {
    let kind = random.one_of(&["beam", "prostate", "liver"]);
    let (mesh, cell_m, centre_m, room_m, depth_m) = match kind {
        "beam" => {
            let size = [random.within(0.05, 0.08), random.within(0.03, 0.05), random.within(0.025, 0.04)];
            let cell = times * random.within(6e-3, 8e-3);
            let room = [0.35 * size[0] - cell, 0.35 * size[1] - cell].map(|room: f64| room.max(2e-3));
            (organs::beam(size, cell)?, cell, [0.55 * size[0], 0.5 * size[1]], room, random.within(2e-3, 4e-3))
        }
        "prostate" => {
            let cell = times * random.within(4.5e-3, 6e-3);
            (organs::prostate(Sizes::uniform(cell))?, cell, [0.0105, -0.003], [3e-3, 5e-3], random.within(1e-3, 2.5e-3))
        }
        _ => {
            let cell = times * random.within(9e-3, 11e-3);
            (organs::liver(Sizes::uniform(cell))?, cell, [-0.036, 0.003], [12e-3, 8e-3], random.within(2.5e-3, 5e-3))
        }
    };
    let material = TissueSpec {
        young_modulus_pa: random.sized(3e3, 15e3),
        poisson_ratio: random.within(0.4, 0.47),
        density_kg_m3: 1060.0,
        viscosity_pa_s: random.within(0.5, 2.0),
        nodal_pressure: true,
    };
    let surface = {
        let (mesh, triangles) = (mesh.clone(), mesh.surface_triangles());
        Box::new(move |at| tissue::height(&mesh, &triangles, at))
    };
    let ground = Ground { centre_m, room_m, depth_m, cell_m, surface };
    Ok((tissue::body(mesh, material)?, kind, ground))
}

/// A tool of that radius along `motion`, a sample every millisecond.
pub fn path(motion: Motion, ground: &Ground, radius: f64, random: &mut Random) -> Result<ToolPath, Error> {
    let way = motion.way(ground, radius, DURATION_S, random);
    let times: Vec<f64> = (0..=(DURATION_S * 1e3).round() as u32).map(|tick| 1e-3 * f64::from(tick)).collect();
    let positions = times.iter().map(|&t| way(t)).collect();
    ToolPath::new(times, positions)
}
