//! The organs, how fine each is meshed, and the way of the tool over each.

use palpate::Error;
use palpate::devices::ToolPath;
use palpate::model::Vec3;
use palpate::model::body::{Body, Tissue};
use palpate::model::local::BlendKind;
use palpate::model::mesh::TetrahedralMesh;
use palpate::scene::{BlendSpec, BodySpec, FrictionSpec, Scene, TissueSpec};
use palpate::session::{Session, SessionBuilder};
use palpate_mesh::{ImplicitShape, MeshError, Sizes, organs};

use crate::common::tissue;

/// Simulated time (s), and its parts: press, drag, lift.
const DURATION_S: f64 = 0.8;
const PRESS_S: f64 = 0.25;
const DRAG_S: f64 = 0.3;
const LIFT_S: f64 = 0.2;
/// How far above the surface the tool begins and ends, in depths of its press.
const ABOVE: f64 = 0.3;
/// Elements answer with more shapes than a lattice does.
const BASIS: usize = 100;
const FRICTION: f64 = 0.3;
/// Of the beam (m).
const BEAM: [f64; 3] = [0.06, 0.03, 0.03];

/// An organ and the way of a tool over it.
pub struct Organ {
    pub name: &'static str,
    pub tissue: Tissue,
    /// From coarse to fine (mm): the local models run on the third, errors are distances from the last.
    pub sizes_mm: [f64; 5],
    mesh: fn(f64) -> Result<TetrahedralMesh, MeshError>,
    /// True inside.
    pub holds: fn(&Vec3) -> bool,
    /// The axis whose lowest plane is held.
    pub held_axis: usize,
    /// From x, y to x, y (m).
    drag_m: [[f64; 2]; 2],
    pub depth_m: f64,
}

pub const ORGANS: [Organ; 3] = [
    Organ {
        name: "liver",
        tissue: Tissue::LIVER,
        sizes_mm: [10.0, 8.0, 6.0, 4.5, 3.0],
        mesh: |size_m| organs::liver(Sizes::uniform(size_m)),
        holds: |point| organs::liver_shape().signed_distance(point) < 0.0,
        held_axis: 2,
        drag_m: [[-0.042, 0.003], [-0.030, 0.003]],
        depth_m: 0.003,
    },
    Organ {
        name: "prostate",
        tissue: Tissue::PROSTATE,
        sizes_mm: [6.0, 5.0, 4.0, 3.0, 2.0],
        mesh: |size_m| organs::prostate(Sizes::uniform(size_m)),
        holds: |point| organs::prostate_shape().signed_distance(point) < 0.0,
        held_axis: 2,
        drag_m: [[0.0105, -0.006], [0.0105, 0.0]],
        depth_m: 0.0015,
    },
    Organ {
        name: "beam",
        tissue: Tissue::MUSCLE,
        sizes_mm: [10.0, 7.5, 6.0, 5.0, 3.0],
        mesh: |size_m| organs::beam(BEAM, size_m),
        holds: |point| (0..3).all(|axis| (0.0..BEAM[axis]).contains(&point[axis])),
        held_axis: 0,
        drag_m: [[0.031, 0.0137], [0.043, 0.0137]],
        depth_m: 0.003,
    },
];

impl Organ {
    pub fn mesh(&self, size_mm: f64) -> Result<TetrahedralMesh, Error> {
        Ok((self.mesh)(1e-3 * size_mm)?)
    }

    /// The tool on `path`, over a body that is still to be given.
    pub fn scene(&self, path: ToolPath) -> Scene {
        let mut scene = Scene::of_program();
        scene.contact.friction = FrictionSpec::Coefficient(FRICTION);
        scene.local.basis = Some(BASIS);
        scene.local.blend = BlendSpec { kind: BlendKind::Crossfade, ms: 10.0 };
        scene.devices[0].path = Some(path);
        scene.run.duration_s = DURATION_S;
        scene
    }

    /// The organ as tetrahedra with nodal pressure.
    pub fn body(&self, mesh: TetrahedralMesh) -> Result<BodySpec, Error> {
        let Tissue { young_modulus, poisson_ratio, density, viscosity } = self.tissue;
        let material = TissueSpec {
            young_modulus_pa: young_modulus,
            poisson_ratio,
            density_kg_m3: density,
            viscosity_pa_s: viscosity,
            nodal_pressure: true,
        };
        tissue::body(mesh, material)
    }

    /// Press, drag at the same depth below the surface of `mesh` at rest, lift.
    pub fn path(&self, mesh: &TetrahedralMesh) -> Result<ToolPath, Error> {
        let [from, to] = self.drag_m;
        let smooth = |part: f64| {
            let part = part.clamp(0.0, 1.0);
            part * part * (3.0 - 2.0 * part)
        };
        let triangles = mesh.surface_triangles();
        let ticks = (DURATION_S * 1e3).round() as u32;
        let times: Vec<f64> = (0..=ticks).map(|tick| 1e-3 * f64::from(tick)).collect();
        let at = |&time: &f64| {
            let along = smooth((time - PRESS_S) / DRAG_S);
            let [x, y] = [0, 1].map(|axis| from[axis] + along * (to[axis] - from[axis]));
            let pressed = smooth(time / PRESS_S) - smooth((time - PRESS_S - DRAG_S) / LIFT_S);
            let depth = self.depth_m * (pressed * (1.0 + ABOVE) - ABOVE);
            [x, y, tissue::height(mesh, &triangles, [x, y]) - depth]
        };
        let positions = times.iter().map(at).collect();
        ToolPath::new(times, positions)
    }
}

/// The same on a body that no scene describes.
pub fn session(body: impl Body + 'static, path: ToolPath) -> SessionBuilder {
    Session::builder(body).path(path).friction(FRICTION).duration_s(DURATION_S)
}
