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
    for entry in LogReader::open(&log).unwrap().map(Result::unwrap) {
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

/// A log says what was run and holds the mesh; what it names beside that is never opened.
#[test]
fn a_log_that_names_a_file_reads_none() {
    let folder = Folder::new();
    let scene = folder.scene(&pressed()).with_model(Kind::Patch);
    let log = folder.path("run.mcap");
    Session::from_scene(scene.clone()).virtual_time().log(&log).build().unwrap().run().unwrap();
    let environment = LogReader::open(&log).unwrap().map(Result::unwrap).find_map(|entry| match entry {
        LogEntry::Environment(environment) => Some(environment),
        _ => None,
    });
    let session = LogReader::open(&log).unwrap().map(Result::unwrap).find_map(|entry| match entry {
        LogEntry::Attachment { name, data } if name == Environment::SESSION => Some(data),
        _ => None,
    });
    let session = String::from_utf8(session.unwrap()).unwrap();
    let kind = "kind = \"tetrahedra\"";
    assert!(session.contains(kind), "{session}");
    let session = session.replace(kind, &format!("{kind}\nmesh = \"meshes/block.msh\""));
    let volume = scene.body.as_ref().unwrap().tetrahedra().unwrap().volume.as_ref().unwrap();
    for mesh in [None, Some(volume.file().into()), Some(b"no mesh".as_slice().into())] {
        let is_good = mesh.as_ref().is_some_and(|mesh: &std::sync::Arc<[u8]>| &**mesh == volume.file());
        let named = Environment { session: Some(session.clone()), mesh, ..environment.clone().unwrap() };
        let other = folder.path("named.mcap");
        let mut writer = palpate::log::McapWriter::create(&other, &named).unwrap();
        for entry in LogReader::open(&log).unwrap().map(Result::unwrap) {
            match entry {
                LogEntry::Record(record) => writer.write(&record).unwrap(),
                LogEntry::Stats(stats) => writer.write_stats(&stats).unwrap(),
                LogEntry::Text(text) => writer.write_text(&text).unwrap(),
                LogEntry::Scene(frame) => writer.write_scene(&frame).unwrap(),
                _ => {}
            }
        }
        writer.finish().unwrap();
        let replayed = Session::replay(&other);
        match is_good {
            true => assert!(replayed.unwrap().run().unwrap().is_identical()),
            false => {
                let message = replayed.unwrap_err().to_string();
                assert!(message.contains("mesh"), "{message}");
            }
        }
    }
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

/// What is said of the scene with `good` replaced by `bad`.
#[track_caller]
fn refused(folder: &Folder, good: &str, bad: &str, place: &str, words: &[&str]) {
    let text = pressed();
    assert!(text.contains(good), "{good:?} is not in the scene");
    let message = folder.refusal(&text.replacen(good, bad, 1));
    assert!(message.starts_with(place), "{bad:?}: {message}");
    for word in words {
        assert!(message.contains(word), "{bad:?}: {message} does not say {word:?}");
    }
}

// One case a line reads like the table it is.
#[rustfmt::skip]
#[test]
fn a_bad_key_is_refused_with_its_line() {
    let folder = Folder::new();
    let case = |good: &str, bad: &str, place: &str, words: &[&str]| refused(&folder, good, bad, place, words);
    // Keys of the other kind, and of nobody.
    case("fixed = [", "block = { nodes = [2, 2, 2], size_m = [1, 1, 1] }\nfixed = [", "scene.toml:4: body.block: belongs to kind = \"mass_spring\"", &["set that or leave it out", "mesh, surface, element_size_m"]);
    case("[body.tissue]", "[body.material]\nnode_mass_kg = 1\n[body.tissue]", "scene.toml:5: body.material: belongs to kind = \"mass_spring\"", &[]);
    case("[contact]", "[[body.region]]\ngroup = \"core\"\nstiffness_n_per_m = 3\n[contact]", "scene.toml:12: body.region[0].stiffness_n_per_m: belongs to kind = \"mass_spring\"", &["young_modulus_pa"]);
    case("kind = \"tetrahedra\"", "kind = \"mass_spring\"", "scene.toml:3: body.mesh: belongs to kind = \"tetrahedra\"", &["set that", "block, material"]);
    case("kind = \"tetrahedra\"\n", "", "scene.toml:2: body.mesh: belongs to kind = \"tetrahedra\"", &[]);
    case("kind = \"tetrahedra\"", "kind = \"tetrahedral\"", "scene.toml:2: body.kind: is \"tetrahedral\"", &["\"mass_spring\" or \"tetrahedra\""]);
    case("mesh =", "mash =", "scene.toml:3: body.mash: unknown key", &["did you mean mesh?"]);
    case("young_modulus_pa", "young_modulus", "scene.toml:6: body.tissue.young_modulus: unknown key", &["did you mean young_modulus_pa?"]);
    // What is missing.
    case("mesh = \"meshes/block.msh\"\n", "", "scene.toml:1: body: has no mesh", &[".msh", "surface"]);
    case("poisson_ratio = 0.45\n", "", "scene.toml:5: body.tissue.poisson_ratio: is missing", &[]);
    case("fixed = [\"bottom\"]\n", "", "scene.toml:1: body.fixed: ", &["nothing holds", "name a group"]);
    case("fixed = [\"bottom\"]", "fixed = []", "scene.toml:4: body.fixed: ", &["nothing holds"]);
    case("[contact]", "[[body.region]]\nyoung_modulus_pa = 3\n[contact]", "scene.toml:10: body.region[0].shape: is missing", &[]);
    case("[contact]", "[[body.region]]\ngroup = \"core\"\n[contact]", "scene.toml:10: body.region[0]: differs in nothing", &["young_modulus_pa"]);
    // Numbers.
    case("poisson_ratio = 0.45", "poisson_ratio = 0.5", "scene.toml:7: body.tissue.poisson_ratio: is 0.5, must be at least 0 and below 0.5", &["0.49"]);
    case("poisson_ratio = 0.45", "poisson_ratio = -0.1", "scene.toml:7: body.tissue.poisson_ratio: is -0.1", &["at least 0"]);
    case("poisson_ratio = 0.45", "poisson_ratio = nan", "scene.toml:7: body.tissue.poisson_ratio: is NaN", &[]);
    case("young_modulus_pa = 5000.0", "young_modulus_pa = 0", "scene.toml:6: body.tissue.young_modulus_pa: is 0, must be a finite number of Pa above 0", &[]);
    case("density_kg_m3 = 1060.0", "density_kg_m3 = -1", "scene.toml:8: body.tissue.density_kg_m3: is -1, must be a finite number of kg/m^3", &[]);
    case("viscosity_pa_s = 2.0", "viscosity_pa_s = -2", "scene.toml:9: body.tissue.viscosity_pa_s: is -2", &["at least 0"]);
    case("viscosity_pa_s = 2.0", "nodal_pressure = 1", "scene.toml:9: body.tissue.nodal_pressure: is 1", &[]);
    case("[contact]", "[[body.region]]\ngroup = \"core\"\npoisson_ratio = 0.6\n[contact]", "scene.toml:12: body.region[0].poisson_ratio: is 0.6", &["below 0.5"]);
    case("fixed = [", "unit_m = 0\nfixed = [", "scene.toml:4: body.unit_m: is 0", &["above 0"]);
    // A mesh and a surface.
    case("fixed = [", "surface = \"a.stl\"\nfixed = [", "scene.toml:4: body.surface: is given beside body.mesh", &["leave one out"]);
    case("fixed = [", "element_size_m = 0.004\nfixed = [", "scene.toml:4: body.element_size_m: belongs to surface", &["leave it out"]);
    case("mesh = \"meshes/block.msh\"", "surface = \"a.stl\"", "scene.toml:1: body.element_size_m: is missing", &["0.004"]);
    case("mesh = \"meshes/block.msh\"", "surface = \"a.stl\"\nelement_size_m = -1", "scene.toml:4: body.element_size_m: is -1", &["above 0"]);
    case("mesh = \"meshes/block.msh\"", "surface = \"a.stl\"\nelement_size_m = 0.01\nsurface_size_m = 0.02", "scene.toml:5: body.surface_size_m: is 0.02, must be at most body.element_size_m, 0.01", &[]);
    // Places in the mesh.
    case("fixed = [\"bottom\"]", "fixed = [\"bottum\"]", "scene.toml:4: body.fixed[0]: ", &["there is no \"bottum\"", "\"bottom\", \"core\""]);
    case("fixed = [\"bottom\"]", "fixed = [{ layer = { axis = \"z\", from_m = 1, to_m = 2 } }]", "scene.toml:4: body.fixed[0]: ", &["holds no node"]);
    case("fixed = [\"bottom\"]", "fixed = [7]", "scene.toml:4: body.fixed[0]: is 7, must be the name of a group of the mesh, or a shape", &[]);
    case("[contact]", "[[body.region]]\ngroup = \"tumour\"\nyoung_modulus_pa = 3e4\n[contact]", "scene.toml:11: body.region[0].group: ", &["there is no \"tumour\"", "\"core\""]);
    case("[contact]", "[[body.region]]\ngroup = \"bottom\"\nyoung_modulus_pa = 3e4\n[contact]", "scene.toml:11: body.region[0].group: ", &["has no tetrahedra"]);
    case("[contact]", "[[body.region]]\nshape = { sphere = { centre_m = [1, 0, 0], radius_m = 0.01 } }\nyoung_modulus_pa = 3e4\n[contact]", "scene.toml:11: body.region[0].shape: ", &["holds no element"]);
    case("[contact]", "[[body.region]]\ngroup = \"core\"\nshape = { layer = { axis = \"z\", from_m = 0, to_m = 1 } }\nyoung_modulus_pa = 1\n[contact]", "scene.toml:10: body.region[0]: has a shape and a group", &["a region for each"]);
    // Other units, and steps that no machine can do.
    case("fixed = [", "unit_m = 0.001\nfixed = [", "scene.toml:4: body.unit_m: ", &["metres per unit"]);
    case("fixed = [", "unit_m = 1000.0\nfixed = [", "scene.toml:4: body.unit_m: ", &["10 m", "0.001 for millimetres"]);
    case("young_modulus_pa = 5000.0", "young_modulus_pa = 5e12", "scene.toml:3: body.mesh: ", &["stable step", "element", "worst"]);
    // Nodes.
    case("path_csv = \"press.csv\"", "attach_node = [2, 2, 2]", "scene.toml:13: device.attach_node: is a place in a block", &["near_m"]);
    case("[run]", "[[probe]]\nnode = [2, 2, 2]\n[run]", "scene.toml:", &["probe: is a place in a block"]);
    case("[run]", "[[probe]]\nnode = 1.5\n[run]", "scene.toml:15: probe[0].node: is 1.5, must be a node: its place", &["near_m"]);
    case("[run]", "[[probe]]\nnode = { near = [0, 0, 0] }\n[run]", "scene.toml:15: probe[0].node.near: unknown key", &["near_m"]);
    case("[run]", "[[probe]]\nnode = [1, 2]\n[run]", "scene.toml:15: probe[0].node: has 2 entries, must be an array of 3", &[]);
    case("[run]", "[local]\npatch = [1, 1, 1]\n[run]", "scene.toml:15: local.patch: ", &["4 to 512 nodes"]);
}

/// Told when a session is built: before, nobody knows the body.
#[test]
fn a_node_that_is_not_there_is_refused() {
    let folder = Folder::new();
    let refused = |from: &str, to: &str, words: &[&str]| {
        let scene = folder.scene(&pressed().replacen(from, to, 1));
        let message = Session::from_scene(scene).virtual_time().build().unwrap_err().to_string();
        assert!(words.iter().all(|word| message.contains(word)), "{message}");
    };
    refused("path_csv = \"press.csv\"", "attach_node = 500", &["device.attach_node: node 500", "0 to 47"]);
    refused("path_csv = \"press.csv\"", "attach_node = 2", &["device.attach_node: node 2 is held"]);
    refused("path_csv = \"press.csv\"", "attach_node = 21", &["device.attach_node: node 21 is inside the body"]);
    let millimetres = "attach_node = { near_m = [20.0, 20.0, 40.0] }";
    refused("path_csv = \"press.csv\"", millimetres, &["from the nearest node", "is it in metres?"]);
    refused("[run]", "[[probe]]\nnode = 48\n[run]", &["probe[0].node: node 48", "0 to 47"]);
    let pull =
        |node: &str| format!("[initial]\npull = {{ node = {node}, offset_m = [0, 0, 0.001] }}\nhold = [40]\n[run]");
    refused("[run]", &pull("2"), &["initial.pull.node: node 2 is held, it cannot be pulled"]);
    refused("[run]", &pull("40"), &["initial.hold: node 40 is the pulled node"]);
}

#[test]
fn a_bad_mesh_file_is_refused_by_its_name() {
    let folder = Folder::new();
    let of_file = |words: &[&str]| {
        let message = folder.refusal(&pressed());
        assert!(words.iter().all(|word| message.contains(word)), "{message}");
    };
    let mut one_inverted = block();
    one_inverted.tetrahedra[5].swap(0, 1);
    folder.mesh("meshes/block.msh", &one_inverted);
    of_file(&["meshes/block.msh: 1 of 108 elements (5 at", "inverted"]);
    let mut flat = block();
    let corners = flat.tetrahedra[0];
    flat.points[corners[3] as usize] = flat.points[corners[2] as usize];
    folder.mesh("meshes/block.msh", &flat);
    of_file(&["meshes/block.msh: ", "flat"]);
    let mut three = block();
    let [a, b, c, d] = three.tetrahedra[0];
    three.points.push(three.points[d as usize] * 1.1);
    three.tetrahedra.push([a, b, c, 48]);
    folder.mesh("meshes/block.msh", &three);
    of_file(&["meshes/block.msh: face of nodes"]);
    folder.write("meshes/block.msh", "$MeshFormat\n4.1 0 8\n");
    of_file(&["meshes/block.msh"]);
    folder.write("meshes/block.msh", "no mesh at all");
    of_file(&["meshes/block.msh", "is no"]);
    folder.write("meshes/block.msh", "");
    of_file(&["meshes/block.msh"]);
    std::fs::remove_file(folder.path("meshes/block.msh")).unwrap();
    of_file(&["scene.toml:3: body.mesh: ", "meshes/block.msh", "No such file"]);
}

#[test]
fn a_mesh_that_can_be_mended_is_and_the_report_says_so() {
    let folder = Folder::new();
    let mut mesh = block();
    mesh.tetrahedra.iter_mut().for_each(|corners| corners.swap(0, 1));
    mesh.points.push(Vec3::new(0.01, 0.01, 0.01));
    folder.mesh("meshes/block.msh", &mesh);
    let report = run(folder.scene(&pressed()).with_model(Kind::Hold)).to_string();
    let words: String = report.split_whitespace().collect::<Vec<_>>().join(" ");
    // The group of nodes is written as one of triangles.
    assert!(words.contains("; left out: 18 "), "{report}");
    assert!(words.contains(", 1 node of no tetrahedron; turned round, it was inverted throughout"), "{report}");
}

#[test]
fn parts_are_held_one_by_one() {
    let folder = Folder::new();
    let mut mesh = block();
    let nodes = mesh.points.len() as u32;
    let other: Vec<Vec3> = mesh.points.iter().map(|point| point + Vec3::new(0.1, 0.0, 0.0)).collect();
    mesh.points.extend(other);
    let other: Vec<[u32; 4]> = mesh.tetrahedra.iter().map(|corners| corners.map(|node| node + nodes)).collect();
    mesh.tetrahedra.extend(other);
    folder.mesh("meshes/block.msh", &mesh);
    let message = folder.refusal(&pressed());
    assert!(message.starts_with("scene.toml:4: body.fixed: ") && message.contains("2 parts"), "{message}");
    let all = "fixed = [{ layer = { axis = \"z\", from_m = 0.0, to_m = 0.0 } }]";
    folder.scene(&pressed().replace("fixed = [\"bottom\"]", all));
}

/// The triangles of a box in millimetres, as an OBJ file.
fn box_surface(size_mm: [f64; 3]) -> String {
    let mut text = String::new();
    for corner in 0..8 {
        let at = |axis: usize| size_mm[axis] * f64::from(corner >> axis & 1);
        text += &format!("v {} {} {}\n", at(0), at(1), at(2));
    }
    // Counter-clockwise from outside.
    for [a, b, c, d] in [[1, 3, 4, 2], [5, 6, 8, 7], [1, 2, 6, 5], [3, 7, 8, 4], [1, 5, 7, 3], [2, 4, 8, 6]] {
        text += &format!("f {a} {b} {c}\nf {a} {c} {d}\n");
    }
    text
}

#[test]
fn a_closed_surface_is_filled_on_the_spot() {
    let folder = Folder::new();
    folder.write("box.obj", box_surface([60.0, 60.0, 40.0]));
    let surface = "surface = \"box.obj\"\nunit_m = 0.001\nelement_size_m = 0.012\nsurface_size_m = 0.012";
    let text = pressed().replace("mesh = \"meshes/block.msh\"", surface);
    let layer = "fixed = [{ layer = { axis = \"z\", from_m = -0.001, to_m = 0.002 } }]";
    let text = text.replace("fixed = [\"bottom\"]", layer);
    folder.write("scene.toml", &text);
    let mut told = Vec::new();
    let scene = Scene::load_with(&folder.path("scene.toml"), &mut |done| told.push(done)).unwrap();
    assert!(told.is_sorted() && told.last() == Some(&1.0), "{told:?}");
    let spec = scene.body.as_ref().unwrap().tetrahedra().unwrap();
    let quality = spec.volume.as_ref().unwrap().mesh().quality();
    assert!((quality.volume / 144e-6 - 1.0).abs() < 0.1, "{quality:?}");

    let log = folder.path("run.mcap");
    let session = Session::from_scene(scene.with_model(Kind::Patch)).virtual_time().log(&log).build().unwrap();
    let summary = session.run().unwrap();
    assert!(summary.to_string().contains("that fill a surface"), "{summary}");
    std::fs::remove_file(folder.path("box.obj")).unwrap();
    assert!(Session::replay(&log).unwrap().run().unwrap().is_identical());

    let message = folder.refusal(&text);
    assert!(message.starts_with("scene.toml:3: body.surface: box.obj: No such file"), "{message}");
    folder.write("box.obj", box_surface([60.0, 60.0, 40.0]).rsplit_once("f ").unwrap().0);
    let message = folder.refusal(&text);
    assert!(message.contains("box.obj"), "an open surface: {message}");
    folder.write("box.obj", box_surface([60.0, 60.0, 40.0]));
    let message = folder.refusal(&text.replace("unit_m = 0.001\n", ""));
    assert!(message.starts_with("scene.toml:1: body.unit_m: the surface is 6.000e1 m large"), "{message}");
}

/// A scene that comes with palpate.
fn shipped(name: &str) -> Scene {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("scenes");
    Scene::load(&folder.join(name).with_extension("toml")).unwrap_or_else(|error| panic!("{error}"))
}

/// The force on the tool around a time, a tenth of a second long (N).
fn around(summary: &Summary, time_s: f64) -> f64 {
    let first = ((time_s - 0.05) * 1000.0) as usize;
    let norm = |bits: &[u64; 3]| Vec3::from(bits.map(f64::from_bits)).norm();
    forces(summary)[first..first + 100].iter().map(norm).sum::<f64>() / 100.0
}

#[test]
fn a_liver_is_pressed_dragged_over_and_tapped() {
    let felt = run(shipped("liver").with_model(Kind::Full));
    let [press, drag, between, tap] = [0.8, 1.6, 3.0, 3.35].map(|time_s| around(&felt, time_s));
    println!("press {press:.3}, drag {drag:.3}, between {between:.3}, tap {tap:.3}, peak {:.3} N", peak_n(&felt));
    for force in [press, drag, tap] {
        assert!((0.1..2.0).contains(&force), "{force} N");
    }
    assert!(between < 0.01, "{between} N");
}

#[test]
fn a_tumour_is_found_by_touch() {
    let scene = shipped("liver_tumour").with_model(Kind::Full);
    let mut healthy = scene.clone();
    healthy.body.as_mut().unwrap().tetrahedra_mut().unwrap().regions.clear();
    let [tumour, healthy] = [scene, healthy].map(run);
    for time_s in [0.6, 1.0, 1.3, 1.5, 1.7, 2.0, 2.4] {
        println!("{time_s}: {:.3} N, healthy {:.3} N", around(&tumour, time_s), around(&healthy, time_s));
    }
    println!("peak {:.3} N", peak_n(&tumour));
    let over = |summary: &Summary| around(summary, 1.5);
    let before = |summary: &Summary| around(summary, 0.6);
    assert!(over(&tumour) > 1.3 * over(&healthy), "{} and {} N", over(&tumour), over(&healthy));
    assert!((before(&tumour) / before(&healthy) - 1.0).abs() < 0.05, "{} and {} N", before(&tumour), before(&healthy));
}

#[test]
fn a_cantilever_bends_as_beam_theory_says() {
    let felt = run(shipped("cantilever").with_model(Kind::Full));
    let force = around(&felt, 1.1);
    println!("{force:.4} N, peak {:.3} N", peak_n(&felt));
    // 3 E I / L^3 = 20 N/m, with shear 1.03 times as soft; 15 mm.
    assert!((0.27..0.36).contains(&force), "{force} N");
}
