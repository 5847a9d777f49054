//! The sizes of `predictive` by an error budget: what the report and the log say, and that a run with it is the run with its
//! numbers.

mod session_support;

use std::path::Path;

use palpate::log::{Environment, LogEntry, LogReader, ModelReason};
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

fn reason(summary: &Summary) -> Option<&ModelReason> {
    summary.report.environment.as_ref().unwrap().model_reason.as_ref()
}

/// Patch and states of the scene as it was run, by the log.
fn logged(log: &Path) -> (Option<[usize; 3]>, Option<usize>) {
    let text = LogReader::open(log).unwrap().map(Result::unwrap).find_map(|entry| match entry {
        LogEntry::Attachment { name, data } if name == Environment::SESSION => Some(String::from_utf8(data).unwrap()),
        _ => None,
    });
    let local = Scene::from_session_toml(&text.unwrap(), "session.toml").unwrap().local;
    (local.patch, local.basis)
}

#[test]
fn a_budget_takes_the_sizes_that_keep_it_says_so_and_is_replayed() {
    let folder = tempfile::tempdir().unwrap();
    let log = folder.path().join("run.mcap");
    let summary = run(session("error_pct = 10\n").log(&log));
    let said = reason(&summary).unwrap();
    let words = "error_pct = 10 takes patch 4 x 4 x 2 and 150 states (19 of 20 random scenes: ";
    assert!(said.why.contains(words) && said.warning.is_none(), "{said:?}");
    let report = summary.to_string().split_whitespace().collect::<Vec<_>>().join(" ");
    assert!(report.contains(words), "{report}");
    // The same run by numbers says nothing, as nothing was chosen.
    let named = run(session("patch = [4, 4, 2]\nbasis = 150\n"));
    assert_eq!(reason(&named), None);
    assert_eq!(forces(&named), forces(&summary), "bit for bit");
    assert_eq!(logged(&log), (Some([4, 4, 2]), Some(150)));
    let replayed = Session::replay(&log).unwrap().run().unwrap();
    assert!(replayed.is_identical() && replayed.force.logged == summary.report.devices[0].force.ticks, "{replayed}");
}

#[test]
fn a_budget_that_is_not_kept_is_a_warning_and_takes_what_no_budget_takes() {
    let [tight, without] = ["error_pct = 0.1\n", ""].map(|local| run(session(local)));
    let warning = reason(&tight).unwrap().warning.as_deref().unwrap();
    assert!(warning.contains("error_pct = 0.1 is not sure"), "{warning}");
    assert_eq!(reason(&without), None);
    assert_eq!(forces(&tight), forces(&without), "bit for bit");
}

#[test]
fn numbers_win_and_no_other_model_is_sized() {
    let folder = tempfile::tempdir().unwrap();
    let log = folder.path().join("run.mcap");
    let named = run(session("error_pct = 10\npatch = [4, 4, 3]\nbasis = 20\n").log(&log));
    assert_eq!((reason(&named), logged(&log)), (None, (Some([4, 4, 3]), Some(20))));
    let [left_out, usual] = ["", "patch = [6, 6, 3]\nbasis = 250\n"].map(|local| run(session(local)));
    assert_eq!(left_out.records, usual.records);
    let of_patch = |local: &str| run(session(local).model(LocalModelKind::Patch).log(&log));
    assert_eq!(of_patch("error_pct = 10\n").records, of_patch("").records);
    assert_eq!(logged(&log), (Some([4, 4, 2]), None));
}

#[test]
fn a_program_with_a_body_of_its_own_replays_what_its_budget_took() {
    let folder = tempfile::tempdir().unwrap();
    let log = folder.path().join("run.mcap");
    let own = || {
        let session = Session::builder(block()).attach_node(top()).path(wiggling()).duration_s(0.3).virtual_time();
        session.model(LocalModelKind::Predictive).error_pct(10.0)
    };
    let summary = run(own().log(&log));
    assert!(reason(&summary).unwrap().why.contains("patch 4 x 4 x 2 and 150 states"));
    let replayed = own().replay(&log).unwrap().run().unwrap();
    assert!(replayed.is_identical() && replayed.force.logged == summary.report.devices[0].force.ticks, "{replayed}");
}
