//! The patch of `predictive` by an error budget, in whole sessions: what the report and the log say, and that a run with it
//! is the run with its numbers.

#[path = "../../tests/session_support/mod.rs"]
mod session_support;

use std::path::Path;
use std::process::Command;

use palpate::devices::ToolPath;
use palpate::log::{Environment, LogEntry, LogReader};
use palpate::model::local::Kind as LocalModelKind;
use palpate::scene::Scene;
use palpate::session::{Session, SessionBuilder, Summary};

use session_support::*;

const TEXT: &str = "[body.block]\nnodes = [6, 6, 6]\nsize_m = [0.1, 0.1, 0.1]\n[body.material]\nnode_mass_kg = 0.0005\n\
                    stiffness_n_per_m = 30.0\ndamping_ratio = 0.3\n[device]\nattach_node = [3, 3, 5]\n[local]\n\
                    model = \"predictive\"\n";

/// [`block`] with the tool glued to [`top`], in virtual time.
fn session(local: &str) -> SessionBuilder {
    let scene = Scene::from_toml(&format!("{TEXT}{local}"), "scene.toml", None).unwrap();
    Session::from_scene(scene).path(wiggling()).virtual_time().keep_records().duration_s(0.3)
}

fn run(session: SessionBuilder) -> Summary {
    session.build().unwrap().run().unwrap()
}

fn environment(summary: &Summary) -> &Environment {
    summary.report.environment.as_ref().unwrap()
}

/// The scene as it was run, by the log.
fn as_run(log: &Path) -> Scene {
    let text = LogReader::open(log).unwrap().map(Result::unwrap).find_map(|entry| match entry {
        LogEntry::Attachment { name, data } if name == Environment::SESSION => Some(String::from_utf8(data).unwrap()),
        _ => None,
    });
    Scene::from_session_toml(&text.unwrap(), "session.toml").unwrap()
}

#[test]
fn a_budget_takes_the_patch_that_keeps_it_and_says_which() {
    let folder = tempfile::tempdir().unwrap();
    let log = folder.path().join("run.mcap");
    let summary = run(session("error_pct = 0.4\n").log(&log));
    let reason = environment(&summary).model_reason.as_ref().unwrap();
    let words = [
        "error_pct = 0.4 takes patch 5 x 5 x 2 (0.40 % expected with 104 states at node [3, 3, 5])",
        "; error_pct = 0.4 takes 104 states at the start",
    ];
    assert!(words.iter().all(|words| reason.why.contains(words)) && reason.warning.is_none(), "{reason:?}");
    let timing = Command::new(env!("CARGO_BIN_EXE_palpate")).arg("timing").arg(&log).arg("--json").output().unwrap();
    let json = String::from_utf8(timing.stdout).unwrap();
    assert!(json.contains(words[0]), "{json}");
    let report = summary.to_string().split_whitespace().collect::<Vec<_>>().join(" ");
    assert!(report.contains("takes patch 5 x 5 x 2"), "{report}");
    // The same run by numbers says nothing, as nothing was chosen.
    let named = run(session("patch = [5, 5, 2]\nbasis = 104\n"));
    assert_eq!(environment(&named).model_reason, None);
    assert_eq!(forces(&named), forces(&summary), "bit for bit");
}

#[test]
fn a_missed_budget_is_a_warning() {
    let summary = run(session("error_pct = 1\nbasis = 20\n").duration_s(0.05));
    let reason = environment(&summary).model_reason.clone().unwrap();
    assert!(reason.why.contains("takes patch 6 x 6 x 2 (1.22 %"), "{reason:?}");
    assert!(reason.warning.unwrap().contains("not met by any patch"));
}

#[test]
fn numbers_win_and_without_a_budget_the_patch_is_that_of_ever() {
    let folder = tempfile::tempdir().unwrap();
    let log = |name: &str| folder.path().join(name);
    let named = run(session("error_pct = 0.4\npatch = [4, 4, 3]\nbasis = 20\n").log(log("named.mcap")));
    assert_eq!(environment(&named).model_reason, None);
    assert_eq!(as_run(&log("named.mcap")).local.patch, Some([4, 4, 3]));
    let [left_out, default] = ["", "patch = [6, 6, 3]\nbasis = 250\n"].map(|local| run(session(local)));
    assert_eq!(left_out.records, default.records);
    assert_ne!(forces(&left_out), forces(&named));
    // A budget sizes no linear patch, however little it allows.
    let of_patch = |local: &str| run(session(local).model(LocalModelKind::Patch).log(log("patch.mcap")));
    assert_eq!(of_patch("error_pct = 0.4\n").records, of_patch("").records);
    assert_eq!(as_run(&log("patch.mcap")).local.patch, Some([4, 4, 2]));
}

/// Check that a log never names a patch that its scene would be refused with: where few states are given, the largest is best.
#[test]
fn patches_larger_than_the_lattice_are_left_out() {
    let folder = tempfile::tempdir().unwrap();
    let log = folder.path().join("run.mcap");
    let small = TEXT.replace("[6, 6, 6]", "[5, 5, 5]").replace("[3, 3, 5]", "[2, 2, 4]");
    let path = ToolPath::new(vec![0.0, 0.1], vec![[0.05, 0.05, 0.1], [0.05, 0.052, 0.09]]).unwrap();
    for basis in [2, 10, 30] {
        let text = format!("{small}error_pct = 0.4\nbasis = {basis}\n");
        let scene = Scene::from_toml(&text, "scene.toml", None).unwrap();
        let session = Session::from_scene(scene).path(path.clone()).virtual_time().duration_s(0.1);
        let reason = environment(&run(session.log(&log))).model_reason.clone().unwrap();
        assert!(!reason.why.contains("patch 6 x 6"), "{reason:?}");
        assert!(Session::replay(&log).unwrap().run().unwrap().is_identical());
    }
}

#[test]
fn a_run_with_a_budget_is_replayed_bit_for_bit_from_the_patch_in_its_log() {
    let folder = tempfile::tempdir().unwrap();
    let log = folder.path().join("run.mcap");
    let summary = run(session("error_pct = 0.4\n").log(&log));
    let scene = as_run(&log);
    assert_eq!((scene.local.patch, scene.local.basis, scene.local.error_pct), (Some([5, 5, 2]), None, Some(0.4)));
    let report = Session::replay(&log).unwrap().run().unwrap();
    assert!(report.is_identical() && report.force.logged == summary.report.devices[0].force.ticks, "{report}");
    // A program's own body: the patch is that of the log.
    let own = || {
        let session = Session::builder(block()).attach_node(top()).path(wiggling()).duration_s(0.3).virtual_time();
        session.model(LocalModelKind::Predictive).error_pct(0.4)
    };
    let summary = run(own().log(&log));
    let why = &environment(&summary).model_reason.as_ref().unwrap().why;
    assert!(
        why.contains(&format!("takes patch 5 x 5 x 2 (0.40 % expected with 104 states at node {})", top())),
        "{why}"
    );
    let report = own().replay(&log).unwrap().run().unwrap();
    assert!(report.is_identical() && report.force.logged == summary.report.devices[0].force.ticks, "{report}");
}
