//! Reduced surroundings that are kept from run to run: what is on the disk decides nothing in virtual time.

use std::path::Path;

use crate::session_support::*;
use palpate::scene::Scene;
use palpate::session::Session;

/// A stroke along a brick, over more windows than there are bases at the start.
const SCENE: &str = r#"
[body]
kind = "mass_spring"
[body.block]
nodes = [18, 6, 5]
size_m = [0.17, 0.05, 0.04]
fixed = ["z_min"]
[body.material]
node_mass_kg = 0.0005
stiffness_n_per_m = 60.0
damping_ratio = 0.3
[contact]
friction = 0.3
[global]
rate_hz = 30
[local]
model = "predictive"
patch = [3, 3, 2]
basis = 20
[device]
path_csv = "path.csv"
[run]
duration_s = 0.6
"#;

fn scene(bases: Option<&Path>) -> Scene {
    let folder = tempfile::tempdir().unwrap();
    let row = |n: u32| {
        let t = f64::from(n) * 1e-3;
        format!("{t},{},0.026,{}\n", 0.02 + 0.2 * t, 0.04 - 0.003 * (t / 0.05).min(1.0))
    };
    let path = (0..=600).map(row).fold("t_s,x_m,y_m,z_m\n".to_owned(), |all, row| all + &row);
    std::fs::write(folder.path().join("path.csv"), path).unwrap();
    let mut scene = Scene::from_toml(SCENE, "scene.toml", Some(folder.path())).unwrap();
    scene.local.basis_folder = bases.map(Path::to_owned);
    scene
}

/// The bits of all forces.
fn forces_of(scene: Scene) -> Vec<[u64; 3]> {
    let summary = Session::from_scene(scene).virtual_time().keep_records().build().unwrap().run().unwrap();
    assert_eq!(summary.runtime.fault, None);
    forces(&summary).iter().map(|force| bits(force.force_n)).collect()
}

#[test]
fn a_virtual_run_is_the_same_whatever_was_kept() {
    let folder = tempfile::tempdir().unwrap();
    let bases = folder.path().join("bases");
    let expected = forces_of(scene(None));
    assert_eq!(expected.len(), 600);
    let cold = forces_of(scene(Some(&bases)));
    let kept = || std::fs::read_dir(&bases).unwrap().map(|file| file.unwrap().path());
    assert!(kept().count() > 4);
    let warm = forces_of(scene(Some(&bases)));
    assert!(cold == expected && warm == expected);
    // Check half of them damaged.
    kept().step_by(2).for_each(|file| std::fs::write(file, b"not a basis").unwrap());
    assert!(forces_of(scene(Some(&bases))) == expected);
    let mut unkept = scene(Some(&bases));
    unkept.local.keep_bases = false;
    std::fs::remove_dir_all(&bases).unwrap();
    assert!(forces_of(unkept) == expected && !bases.exists());
}

#[test]
fn bases_cost_time_in_virtual_time() {
    let with = |latency_ms| {
        let mut scene = scene(None);
        scene.global.basis_latency_ms = latency_ms;
        forces_of(scene)
    };
    let [at_once, nominal, slow] = [Some(0.0), None, Some(400.0)].map(with);
    assert!(at_once != nominal && nominal != slow);
    assert!(with(None) == nominal, "the same bits every time");
}

/// The first windows reach 25 mm, and the stroke goes on for 120: those beside them are there before it begins.
#[test]
fn a_stroke_that_begins_with_the_session_is_served_though_no_basis_is_made_in_time() {
    let with = |latency_ms| {
        let mut scene = scene(None);
        scene.global.basis_latency_ms = Some(latency_ms);
        let summary = Session::from_scene(scene).virtual_time().keep_records().build().unwrap().run().unwrap();
        forces(&summary).iter().map(|force| force.force_n).collect::<Vec<_>>()
    };
    let [at_once, never] = [0.0, 60_000.0].map(with);
    let norm = |force: [f64; 3]| force.iter().map(|c| c * c).sum::<f64>().sqrt();
    let peak = at_once.iter().copied().map(norm).fold(0.0, f64::max);
    let apart = |(a, b): (&[f64; 3], &[f64; 3])| norm(std::array::from_fn(|i| a[i] - b[i])) / peak;
    let worst = at_once.iter().zip(&never).map(apart).fold(0.0, f64::max);
    assert!(worst < 0.05, "{worst}");
}
