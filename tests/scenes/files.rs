//! The scenes that come with palpate.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use palpate::devices::ToolPath;
use palpate::model::contact::{Equations, Normals};
use palpate::model::local::BlendKind;
use palpate::model::local::{Feedback, Kind as LocalModelKind};
use palpate::model::mesh::Face;
use palpate::scene::{BuiltIn, FrictionSpec, NodeSpec, Scene, ToolSpec};

#[path = "../../examples/scene_paths.rs"]
#[allow(dead_code, reason = "its main function writes the files that are only compared here")]
mod scene_paths;

fn folder() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("scenes")
}

fn load(name: &str) -> Scene {
    Scene::load(&folder().join(name).with_extension("toml")).unwrap()
}

fn files_with(folder: &Path, extension: &str) -> Vec<PathBuf> {
    let entries = std::fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().path());
    let mut files: Vec<_> = entries.filter(|path| path.extension().is_some_and(|found| found == extension)).collect();
    files.sort();
    files
}

#[test]
fn every_scene_loads_and_says_what_it_shows() {
    let files = files_with(&folder(), "toml");
    let names: Vec<_> = files.iter().map(|path| path.file_stem().unwrap().to_str().unwrap()).collect();
    assert_eq!(
        names,
        [
            "cantilever",
            "demo",
            "device_faults",
            "drag_friction",
            "drag_slip",
            "drag_stick",
            "finger",
            "forceps",
            "hand",
            "hand_release",
            "haply",
            "layers",
            "liver",
            "liver_tumour",
            "nodule",
            "pull_release",
            "soft_deep",
            "stick_slip",
            "torso",
            "two_hands",
            "wave",
            "wave_probe",
            "z_width"
        ]
    );
    for file in files {
        let scene = Scene::load(&file).unwrap();
        let source = scene.source.as_deref().unwrap();
        assert!(source.starts_with("# ") && source.contains("Look for:"), "{}", file.display());
        assert_eq!(scene.validate().map_err(|error| error.to_string()), Ok(()), "{}", file.display());
        let body = scene.body.as_ref().unwrap();
        let is_predictive = body.tetrahedra().is_some()
            || body.region_count() > 0
            || scene.devices.len() > 1
            || scene.devices[0].tool != ToolSpec::Point
            || scene.contact.static_friction.is_some();
        let model = if is_predictive { LocalModelKind::Predictive } else { LocalModelKind::Patch };
        assert_eq!(scene.local.model, model.into(), "{}", file.display());
    }
}

#[test]
fn a_device_that_this_program_does_not_open_is_refused_with_what_opens_it() {
    let error = palpate::Session::from_scene(load("haply")).build().unwrap_err();
    let message =
        "device.kind: is \"haply\", which this program does not open: give `palpate_haply::open` to its session";
    assert_eq!(error.to_string(), message);
}

#[test]
fn every_scene_of_the_folder_is_built_in() {
    let names: Vec<_> = files_with(&folder(), "toml").iter().map(|file| file.file_stem().unwrap().to_owned()).collect();
    assert!(names.iter().map(|name| name.to_str().unwrap()).eq(BuiltIn::all().map(BuiltIn::name)), "{names:?}");
    for scene in BuiltIn::all() {
        assert_eq!(scene.load(), load(scene.name()));
        assert!((20..400).contains(&scene.about().len()), "{}", scene.about());
    }
    assert_eq!(Scene::demo(), load("demo"));
}

#[test]
fn the_demo_file_reads_as_it_is_written() {
    let scene = Scene::demo();
    assert_eq!(scene.body.as_ref().unwrap().mass_spring().unwrap().block.nodes, [12, 12, 12]);
    assert_eq!(scene.body.as_ref().unwrap().mass_spring().unwrap().block.size_m, [0.1; 3]);
    assert_eq!(scene.body.as_ref().unwrap().mass_spring().unwrap().block.fixed, [Face::ZMin]);
    assert_eq!(scene.body.as_ref().unwrap().mass_spring().unwrap().material.node_mass_kg, 0.0005);
    assert_eq!(scene.contact.friction, FrictionSpec::Coefficient(0.5));
    assert_eq!(scene.contact.normals, Normals::Interpolated);
    assert_eq!(scene.contact.equations, Equations::Corrected);
    assert_eq!((scene.global.rate_hz, scene.global.substeps_per_ms), (30.0, Some(2)));
    assert_eq!((scene.local.model, scene.local.feedback), (LocalModelKind::Predictive.into(), None));
    assert_eq!((scene.local.blend.kind, scene.local.blend.ms), (BlendKind::Crossfade, 10.0));
    assert_eq!(scene.safety.max_force_n, Some(3.3));
    assert_eq!(scene.probes.len(), 1);
    assert_eq!(scene.run.duration_s, 5.0);
}

/// The demo is the reference of the format: it must show every key, active or behind a `#`.
#[test]
fn the_demo_file_documents_every_key() {
    let everything = "[body]\n[body.block]\nnodes = [2, 2, 2]\nsize_m = [1, 1, 1]\n[body.material]\nnode_mass_kg = 1\n\
        stiffness_n_per_m = 1\ndamping_ratio = 1\n[[body.region]]\n\
        shape = { layer = { axis = \"z\", from_m = 0, to_m = 1 } }\n[contact]\n[global]\n[local]\n[device]\n[device.plant]\n[device.hand]\n[device.pointer]\n[device.haply]\nmax_force_n = 1\n[[device.fault]]\nkind = \"late\"\nfrom_s = 1\nto_s = 2\n[safety]\n[link]\n[log]\n[run]\n[initial]\n\
        pull = { node = [0, 0, 1], offset_m = [0, 0, 0] }\n[[probe]]\nnode = [0, 0, 0]\n";
    let demo = Scene::demo().source.unwrap();
    let words: Vec<&str> = demo.split(|c: char| !(c.is_ascii_alphanumeric() || c == '_')).collect();
    let mut texts = Vec::new();
    for table in [
        "",
        "[body]",
        "[body.block]",
        "[body.material]",
        "[[body.region]]",
        "[contact]",
        "[global]",
        "[local]",
        "[device]",
        "[device.plant]",
        "[device.hand]",
        "[device.pointer]",
        "[device.haply]",
        "[[device.fault]]",
        "[safety]",
        "[link]",
        "[log]",
        "[run]",
        "[initial]",
        "[[probe]]",
    ] {
        let text = if table.is_empty() {
            format!("qqq = 0\n{everything}")
        } else {
            everything.replacen(table, &format!("{table}\nqqq = 0"), 1)
        };
        texts.push((table.to_owned(), text));
    }
    let shape = "shape = { layer = { axis = \"z\", from_m = 0, to_m = 1 } }";
    assert!(everything.contains(shape));
    for kind in ["", "sphere", "box", "ellipsoid", "layer"] {
        let spoilt = if kind.is_empty() {
            "shape = { qqq = 0 }".to_owned()
        } else {
            format!("shape = {{ {kind} = {{ qqq = 0 }} }}")
        };
        texts.push((spoilt.clone(), everything.replacen(shape, &spoilt, 1)));
    }
    let tissue = "[body]\nkind = \"tetrahedra\"\n[body.tissue]\nqqq = 0\n";
    texts.push(("[body.tissue]".to_owned(), tissue.to_owned()));
    for (table, text) in texts {
        let message = Scene::from_toml(&text, "s", None).unwrap_err().to_string();
        let keys = message.split_once("the keys here are ").unwrap_or_else(|| panic!("{table}: {message}")).1;
        for key in keys.split(", ") {
            assert!(words.contains(&key), "demo.toml does not mention {key} of {table}");
        }
    }
}

#[test]
fn the_reference_scenes_have_the_reference_parameters() {
    for (name, is_slow, friction, duration_s) in [
        ("pull_release", false, FrictionSpec::Coefficient(0.0), 1.1),
        ("hand", false, FrictionSpec::Coefficient(0.0), 0.8),
        ("wave", true, FrictionSpec::Coefficient(0.0), 1.0),
        ("wave_probe", true, FrictionSpec::Coefficient(0.0), 1.0),
        ("drag_slip", false, FrictionSpec::Coefficient(0.0), 2.5),
        ("drag_stick", false, FrictionSpec::Stick, 2.5),
        ("drag_friction", false, FrictionSpec::Coefficient(1.0), 2.5),
    ] {
        let scene = load(name);
        let material = scene.body.as_ref().unwrap().mass_spring().unwrap().material;
        let numbers = (material.node_mass_kg, material.stiffness_n_per_m, material.damping_ratio);
        assert_eq!(numbers, if is_slow { (0.001, 6.0, 1.0) } else { (0.0005, 30.0, 0.3) }, "{name}");
        assert_eq!(scene.global.substeps_per_ms, Some(2), "{name}");
        assert_eq!(scene.local.blend.kind, BlendKind::None, "{name}");
        assert_eq!(scene.contact.friction, friction, "{name}");
        assert_eq!(scene.run.duration_s, duration_s, "{name}");
    }
    let wave = load("wave");
    assert_eq!((wave.devices[0].attach_node, &wave.devices[0].path), (Some([8, 5, 11].into()), &None));
    assert_eq!(wave.initial.unwrap().hold, [[8, 5, 11].into()]);
    let probe = load("wave_probe");
    assert_eq!((probe.probes[0].node, probe.initial.unwrap().hold.len()), ([8, 5, 11].into(), 0));
}

/// A last digit may differ with the platform's sine; anything more is a stale file.
#[test]
fn the_path_files_are_what_their_formulas_give() {
    let written = files_with(&folder().join("paths"), "csv");
    let mut stale: BTreeMap<String, PathBuf> =
        written.into_iter().map(|path| (path.file_name().unwrap().to_str().unwrap().to_owned(), path)).collect();
    for (name, text) in scene_paths::files() {
        let file = ToolPath::read_csv(&stale.remove(name).unwrap_or_else(|| panic!("{name} is missing"))).unwrap();
        let formula = ToolPath::from_csv(&text, name).unwrap();
        assert_eq!(file.times_s(), formula.times_s(), "{name}: run `cargo run --example scene_paths`");
        for (time_s, (is, should)) in file.times_s().iter().zip(file.positions_m().iter().zip(formula.positions_m())) {
            for axis in 0..3 {
                let difference = (is[axis] - should[axis]).abs();
                assert!(difference <= 1e-15, "{name} at {time_s} s: run `cargo run --example scene_paths`");
            }
        }
    }
    assert!(stale.is_empty(), "no formula makes {:?}", stale.keys());
}

#[test]
fn a_glued_tool_starts_where_its_node_rests() {
    for name in ["hand", "pull_release"] {
        let scene = load(name);
        let block = &scene.body.as_ref().unwrap().mass_spring().unwrap().block;
        let Some(NodeSpec::Lattice(node)) = scene.devices[0].attach_node else { panic!("{name}") };
        let start = scene.devices[0].path.as_ref().unwrap().at(0.0);
        for axis in 0..3 {
            let rest = block.size_m[axis] * node[axis] as f64 / (block.nodes[axis] - 1) as f64;
            assert!((start[axis] - rest).abs() < 1e-15, "{name}");
        }
    }
}

#[test]
fn another_model_drops_only_a_feedback_that_it_cannot_give() {
    let mut paper = Scene::demo().with_model(LocalModelKind::Patch);
    paper.local.feedback = Some(Feedback::Geometry);
    let full = paper.with_model(LocalModelKind::Full);
    assert_eq!((full.local.model, full.local.feedback), (LocalModelKind::Full.into(), None));
    assert!(full.validate().is_ok());
    let mut scene = Scene::demo();
    scene.local.feedback = Some(Feedback::Trajectory);
    assert_eq!(scene.with_model(LocalModelKind::Hold).local.feedback, Some(Feedback::Trajectory));
}
