//! Scenes whose body is of tetrahedra: every key, every local model, logs that need no mesh file, and what is refused.

use std::path::{Path, PathBuf};

use palpate::log::{Environment, LogEntry, LogReader, LogRecord};
use palpate::model::Vec3;
use palpate::model::body::{Shape, Where};
use palpate::model::local::{Feedback, Kind};
use palpate::model::mesh::{Group, TetrahedralMesh};
use palpate::prelude::*;
use palpate::scene::{NodeSpec, TissueRegionSpec, TissueSpec, Volume};

/// Cubes along x, y and z, of 2 cm each: six tetrahedra around a diagonal, the same in every cube.
const CUBES: [usize; 3] = [3, 3, 2];
const EDGE_M: f64 = 0.02;

/// A block of tetrahedra. Groups: "bottom", the nodes at z = 0, and "core", the elements of the cube in the middle of the top.
fn block() -> TetrahedralMesh {
    let [nx, ny, nz] = CUBES.map(|cubes| cubes + 1);
    let id = |i: usize, j: usize, k: usize| (i + nx * (j + ny * k)) as u32;
    let mut mesh = TetrahedralMesh::default();
    for k in 0..nz {
        for j in 0..ny {
            for i in 0..nx {
                mesh.points.push(Vec3::new(i as f64, j as f64, k as f64) * EDGE_M);
            }
        }
    }
    let mut core = Vec::new();
    for k in 0..CUBES[2] {
        for j in 0..CUBES[1] {
            for i in 0..CUBES[0] {
                // A way along the edges from corner to opposite corner for each order of the axes.
                for [a, b, c] in [[0, 1, 2], [1, 2, 0], [2, 0, 1], [1, 0, 2], [0, 2, 1], [2, 1, 0]] {
                    let mut at = [i, j, k];
                    let mut corners = vec![id(i, j, k)];
                    for axis in [a, b, c] {
                        at[axis] += 1;
                        corners.push(id(at[0], at[1], at[2]));
                    }
                    let is_odd = [[1, 0, 2], [0, 2, 1], [2, 1, 0]].contains(&[a, b, c]);
                    if is_odd {
                        corners.swap(2, 3);
                    }
                    if [i, j, k] == [1, 1, 1] {
                        core.push(mesh.tetrahedra.len() as u32);
                    }
                    mesh.tetrahedra.push([corners[0], corners[1], corners[2], corners[3]]);
                }
            }
        }
    }
    let of_core = core.iter().flat_map(|&element| mesh.tetrahedra[element as usize]);
    let mut nodes: Vec<u32> = of_core.collect();
    nodes.sort_unstable();
    nodes.dedup();
    let bottom = (0..(nx * ny) as u32).collect();
    mesh.groups = vec![
        Group { name: "bottom".into(), nodes: bottom, tetrahedra: Vec::new() },
        Group { name: "core".into(), nodes, tetrahedra: core },
    ];
    mesh
}

/// The head of every scene here.
const BODY: &str = r#"[body]
kind = "tetrahedra"
mesh = "meshes/block.msh"
fixed = ["bottom"]
[body.tissue]
young_modulus_pa = 5000.0
poisson_ratio = 0.45
density_kg_m3 = 1060.0
viscosity_pa_s = 2.0
"#;

/// A tool that presses 5 mm into the top, drags and comes back: 0.3 s.
const TOOL: &str = r#"[contact]
friction = 0.5
[device]
path_csv = "press.csv"
[run]
duration_s = 0.3
"#;

const PRESS: &str =
    "t_s,x_m,y_m,z_m\n0,0.031,0.028,0.042\n0.1,0.031,0.028,0.035\n0.2,0.037,0.03,0.035\n0.3,0.037,0.03,0.043\n";

struct Folder(tempfile::TempDir);

impl Folder {
    /// With the block as a mesh file, in a folder of its own, and the tool's path.
    fn new() -> Self {
        let folder = Self(tempfile::tempdir().unwrap());
        std::fs::create_dir(folder.path("meshes")).unwrap();
        folder.mesh("meshes/block.msh", &block());
        folder.write("press.csv", PRESS);
        folder
    }

    fn path(&self, name: &str) -> PathBuf {
        self.0.path().join(name)
    }

    fn write(&self, name: &str, text: impl AsRef<[u8]>) {
        std::fs::write(self.path(name), text).unwrap();
    }

    fn mesh(&self, name: &str, mesh: &TetrahedralMesh) {
        let mut bytes = Vec::new();
        palpate::mesh::write_msh(mesh, &mut bytes).unwrap();
        self.write(name, bytes);
    }

    fn load(&self, text: &str) -> Result<Scene, Error> {
        self.write("scene.toml", text);
        Scene::load(&self.path("scene.toml"))
    }

    #[track_caller]
    fn scene(&self, text: &str) -> Scene {
        self.load(text).unwrap_or_else(|error| panic!("{error}"))
    }

    /// What is said of a bad scene, without the folder.
    #[track_caller]
    fn refusal(&self, text: &str) -> String {
        let error = self.load(text).expect_err("a scene that cannot work");
        assert!(error.kind().is_input(), "{error}");
        let text = error.to_string();
        assert!(!text.contains('\n'), "{text}");
        text.replace(&format!("{}/", self.0.path().display()), "")
    }
}

fn pressed() -> String {
    format!("{BODY}{TOOL}")
}

fn run(scene: Scene) -> Summary {
    let session = Session::from_scene(scene).virtual_time().keep_records().build();
    session.unwrap_or_else(|error| panic!("{error}")).run().unwrap()
}

/// Every force on the tool (N), as bits.
fn forces(summary: &Summary) -> Vec<[u64; 3]> {
    let of_force = |record: &LogRecord| match record {
        LogRecord::Force(sample) => Some(sample.force_n.map(f64::to_bits)),
        _ => None,
    };
    summary.records.iter().filter_map(of_force).collect()
}

fn peak_n(summary: &Summary) -> f64 {
    let norm = |bits: &[u64; 3]| Vec3::from(bits.map(f64::from_bits)).norm();
    forces(summary).iter().map(norm).fold(0.0, f64::max)
}

#[test]
fn every_key_is_read() {
    let folder = Folder::new();
    folder.mesh("meshes/mm.msh", &block().scaled(1000.0));
    let text = r#"[body]
kind = "tetrahedra"
mesh = "meshes/mm.msh"
unit_m = 0.001
fixed = ["bottom", { layer = { axis = "z", from_m = 0.0, to_m = 0.001 } }]
[body.tissue]
young_modulus_pa = 4000.0
poisson_ratio = 0.49
density_kg_m3 = 1000.0
viscosity_pa_s = 3.0
nodal_pressure = false
[[body.region]]
name = "the core"
group = "core"
young_modulus_pa = 30000.0
[[body.region]]
shape = { box = { min_m = [0, 0, 0], max_m = [0.02, 0.02, 0.02] } }
poisson_ratio = 0.3
density_kg_m3 = 900.0
viscosity_pa_s = 1.0
[device]
attach_node = { near_m = [0.041, 0.019, 0.05] }
[[probe]]
node = 7
[[probe]]
node = { near_m = [0.02, 0.02, 0.019] }
[initial]
pull = { node = { near_m = [0.04, 0.02, 0.04] }, offset_m = [0.0, 0.0, 0.001] }
hold = [40]
[run]
duration_s = 0.01
"#;
    let scene = folder.scene(text);
    let spec = scene.body.as_ref().unwrap().tetrahedra().unwrap();
    assert_eq!(spec.mesh.as_deref(), Some(Path::new("meshes/mm.msh")));
    assert_eq!(spec.unit_m, 0.001);
    let layer = Where::Shape(Shape::Layer { axis: 2, from: 0.0, to: 0.001 });
    assert_eq!(spec.fixed, [Where::Group("bottom".into()), layer]);
    let tissue = TissueSpec {
        young_modulus_pa: 4000.0,
        poisson_ratio: 0.49,
        density_kg_m3: 1000.0,
        viscosity_pa_s: 3.0,
        nodal_pressure: false,
    };
    assert_eq!(spec.tissue, tissue);
    let core = TissueRegionSpec {
        name: Some("the core".into()),
        place: Where::Group("core".into()),
        young_modulus_pa: Some(30000.0),
        poisson_ratio: None,
        density_kg_m3: None,
        viscosity_pa_s: None,
    };
    assert_eq!(spec.regions[0], core);
    let corner = &spec.regions[1];
    let values = (corner.poisson_ratio, corner.density_kg_m3, corner.viscosity_pa_s);
    assert_eq!(values, (Some(0.3), Some(900.0), Some(1.0)));
    assert_eq!(scene.devices[0].attach_node, Some(NodeSpec::Near { near_m: [0.041, 0.019, 0.05] }));
    assert_eq!(scene.probes[0].node, NodeSpec::Number(7));
    // In metres, whatever the file's unit.
    let mesh = spec.volume.as_ref().unwrap().mesh();
    assert!((mesh.points[47].z - 0.04).abs() < 1e-15, "{}", mesh.points[47]);

    let [nx, ny, _] = CUBES.map(|cubes| cubes + 1);
    let node = |i: usize, j: usize, k: usize| (i + nx * (j + ny * k)) as u32;
    let body = scene.body.as_ref().unwrap().build().unwrap();
    assert_eq!(scene.glued_node(0, &*body).unwrap(), Some(node(2, 1, 2)));
    let records = run(scene).records;
    let probed = |record: &LogRecord| match record {
        LogRecord::Probe(sample) => Some(sample.node),
        _ => None,
    };
    let probed: Vec<u32> = records.iter().filter_map(probed).take(2).collect();
    assert_eq!(probed, [7, node(1, 1, 1)]);
}

#[test]
fn what_is_left_out_has_its_default() {
    let folder = Folder::new();
    let text = pressed().replace("viscosity_pa_s = 2.0\n", "");
    let scene = folder.scene(&text);
    let spec = scene.body.as_ref().unwrap().tetrahedra().unwrap();
    assert_eq!((spec.unit_m, spec.tissue.viscosity_pa_s, spec.tissue.nodal_pressure), (1.0, 0.0, true));
    assert!(spec.regions.is_empty() && spec.surface.is_none());
}

#[test]
fn a_scene_is_written_and_read_back() {
    let folder = Folder::new();
    let regions = "[[body.region]]\nname = \"hard\"\ngroup = \"core\"\nyoung_modulus_pa = 3e4\n[[body.region]]\n\
                   shape = { sphere = { centre_m = [0.02, 0.02, 0.02], radius_m = 0.02 } }\npoisson_ratio = 0.3\n";
    let scene = folder.scene(&format!("{BODY}{regions}{TOOL}[[probe]]\nnode = {{ near_m = [0.02, 0.02, 0.04] }}\n"));
    let again = folder.scene(&scene.to_toml().unwrap());
    assert_eq!(again.to_toml().unwrap(), scene.to_toml().unwrap());
    assert_eq!((again.body, again.probes), (scene.body, scene.probes));
}

#[test]
fn every_local_model_works_and_runs_the_same_twice() {
    let folder = Folder::new();
    let scene = folder.scene(&pressed());
    let full = peak_n(&run(scene.clone().with_model(Kind::Full)));
    assert!((0.05..5.0).contains(&full), "{full} N");
    for kind in MODELS {
        let [once, again] = [(); 2].map(|()| run(scene.clone().with_model(kind)));
        assert!(once.runtime.fault.is_none(), "{kind:?}");
        assert_eq!(forces(&once).len(), 300, "{kind:?}");
        assert_eq!(forces(&once), forces(&again), "{kind:?}");
        let peak = peak_n(&once);
        assert!((0.5 * full..2.0 * full).contains(&peak), "{kind:?}: {peak} N, full {full} N");
    }
}

const MODELS: [Kind; 8] = Kind::ALL;

#[test]
fn a_model_is_chosen_for_it_and_the_same_every_time() {
    let folder = Folder::new();
    let scene = folder.scene(&pressed());
    let chosen = || {
        let session = Session::from_scene(scene.clone()).virtual_time().build().unwrap();
        session.choice().cloned().expect("no model was named")
    };
    assert_eq!(chosen(), chosen());
    assert_eq!(chosen().model, Kind::Full, "a hundred elements cost nothing");
}

#[test]
fn all_feedback_reaches_the_global_model() {
    let folder = Folder::new();
    let scene = folder.scene(&pressed()).with_model(Kind::Patch);
    for feedback in [Feedback::Trajectory, Feedback::ContactNodes, Feedback::Geometry] {
        let mut scene = scene.clone();
        scene.local.feedback = Some(feedback);
        let peak = peak_n(&run(scene));
        assert!((0.05..5.0).contains(&peak), "{feedback:?}: {peak} N");
    }
}

#[test]
fn a_patch_has_as_many_nodes_as_its_product() {
    let folder = Folder::new();
    let scene = folder.scene(&pressed()).with_model(Kind::Patch);
    let body = scene.body.as_ref().unwrap().build().unwrap();
    let triangle = body.surface().at_node(scene.first_touched(&*body).unwrap())[0];
    for size in [[2, 2, 1], [3, 3, 1], [3, 2, 2]] {
        let mut nodes = Vec::new();
        body.patch(&[triangle], size, &mut nodes);
        assert_eq!(nodes.len(), size.iter().product::<usize>(), "{size:?}");
    }
}

#[test]
fn two_devices_feel_each_other_through_the_body() {
    let folder = Folder::new();
    folder.write("rest.csv", "t_s,x_m,y_m,z_m\n0,0.012,0.028,0.042\n0.05,0.012,0.028,0.037\n");
    let device = |name: &str, path: &str| format!("[[device]]\nname = \"{name}\"\npath_csv = \"{path}\"\n");
    let tools = device("left", "rest.csv") + &device("right", "press.csv") + "[run]\nduration_s = 0.3\n";
    let scene = folder.scene(&format!("{BODY}{tools}")).with_model(Kind::Patch);
    let alone = folder.scene(&format!("{BODY}[device]\npath_csv = \"rest.csv\"\n[run]\nduration_s = 0.3\n"));
    let alone = run(alone.with_model(Kind::Patch));
    let both = run(scene);
    let left = |record: &LogRecord| match record {
        LogRecord::Force(sample) if sample.device == 0 => Some(sample.force_n.map(f64::to_bits)),
        _ => None,
    };
    let left: Vec<[u64; 3]> = both.records.iter().filter_map(left).collect();
    assert_eq!(left.len(), 300);
    assert_ne!(left, forces(&alone), "the other tool moves the body");
}

#[test]
fn a_log_is_replayed_without_the_mesh_file() {
    let folder = Folder::new();
    let text = pressed().replace("[contact]", "[[body.region]]\ngroup = \"core\"\nyoung_modulus_pa = 2e4\n[contact]");
    let scene = folder.scene(&text).with_model(Kind::Patch);
    let log = folder.path("run.mcap");
    let session = Session::from_scene(scene.clone()).virtual_time().log(&log).log_scene().probe(20).build().unwrap();
    let summary = session.run().unwrap();
    assert!(summary.to_string().contains("48 nodes, 16 of them held, 108 tetrahedra: E 5000 Pa"), "{summary}");
    std::fs::remove_dir_all(folder.path("meshes")).unwrap();

    let report = Session::replay(&log).unwrap_or_else(|error| panic!("{error}")).run().unwrap();
    assert!(report.is_identical(), "{report}");
    let mut attached = Vec::new();
    for entry in LogReader::open(&log).unwrap() {
        match entry {
            LogEntry::Attachment { name, data } => attached.push((name, data)),
            LogEntry::Environment(environment) => {
                let body = environment.body.expect("it says what was run");
                assert!(body.contains("1 region"), "{body}");
            }
            _ => {}
        }
    }
    let named = |name: &str| attached.iter().find(|(found, _)| found == name).map(|(_, data)| data.clone());
    let session = String::from_utf8(named(Environment::SESSION).unwrap()).unwrap();
    assert!(!session.contains("block.msh"), "a log chooses no path where it is read: {session}");
    let mesh = palpate::mesh::read_volume("mesh", &named(Environment::MESH).unwrap()).unwrap().mesh;
    assert_eq!(&mesh, scene.body.unwrap().tetrahedra().unwrap().volume.as_ref().unwrap().mesh());
}

#[test]
fn a_log_of_another_mesh_is_that_of_another_session() {
    let folder = Folder::new();
    let scene = folder.scene(&pressed()).with_model(Kind::Patch);
    let log = folder.path("run.mcap");
    Session::from_scene(scene.clone()).virtual_time().log(&log).build().unwrap().run().unwrap();
    assert!(Session::from_scene(scene.clone()).replay(&log).unwrap().run().unwrap().is_identical());
    let mut moved = scene;
    let spec = moved.body.as_mut().unwrap().tetrahedra_mut().unwrap();
    let mut mesh = spec.volume.as_ref().unwrap().mesh().clone();
    mesh.points[40].x += 1e-12;
    spec.volume = Some(Volume::new(mesh).unwrap());
    let error = Session::from_scene(moved).replay(&log).unwrap_err().to_string();
    assert!(error.contains("another mesh"), "{error}");
}

#[test]
fn a_program_gives_its_mesh_itself() {
    let mut scene = Folder::new().scene(&pressed());
    let spec = scene.body.as_mut().unwrap().tetrahedra_mut().unwrap();
    (spec.mesh, spec.volume) = (None, None);
    let error = Session::from_scene(scene.clone()).build().unwrap_err().to_string();
    assert!(error.starts_with("body.mesh: was not read"), "{error}");
    let spec = scene.body.as_mut().unwrap().tetrahedra_mut().unwrap();
    spec.volume = Some(Volume::new(block()).unwrap());
    assert!(peak_n(&run(scene.with_model(Kind::Patch))) > 0.05);
}

#[test]
fn a_builder_takes_the_body_itself() {
    let tissue =
        palpate::model::body::Tissue { young_modulus: 5e3, poisson_ratio: 0.45, density: 1060.0, viscosity: 2.0 };
    let body = Tetrahedra::builder(block()).tissue(tissue).fix(Where::Group("bottom".into())).build().unwrap();
    let path = ToolPath::from_csv(PRESS, "press.csv").unwrap();
    let session = Session::builder(body).path(path).model(Kind::Patch).virtual_time().duration_s(0.3).keep_records();
    assert!(peak_n(&session.build().unwrap().run().unwrap()) > 0.05);
}
