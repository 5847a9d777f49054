//! `model = "auto"`: which local model a session takes when nobody names one, and that it says why.

mod session_support;

use std::time::{Duration, Instant};

use palpate::model::Vec3;
use palpate::model::body::{Block, Body, State};
use palpate::model::local::Kind as LocalModelKind;
use palpate::scene::{ModelChoice, Scene};
use palpate::session::{Choice, Session, SessionBuilder};
use session_support::*;

/// A block that is no body of springs, each evaluation of whose forces takes its time.
fn slow(takes: Duration) -> impl Body {
    AlteredBlock::new(block(), move |block: &mut Block, state: &State, forces: &mut [Vec3]| {
        let start = Instant::now();
        block.forces(state, forces);
        while start.elapsed() < takes {
            std::hint::spin_loop();
        }
    })
}

fn session(body: impl Body + 'static) -> SessionBuilder {
    Session::builder(body).path(pressing()).substeps_per_ms(2).duration_s(0.1)
}

fn choice(session: SessionBuilder) -> Choice {
    session.build().unwrap().choice().cloned().expect("no model was named")
}

#[test]
fn auto_is_the_default_of_programs_and_a_named_model_is_not_questioned() {
    let scene = Scene::of_program();
    assert_eq!((scene.local.model, scene.local.chosen_within_pct()), (ModelChoice::Auto, 1.0));
    let named = session(block()).model(LocalModelKind::Hold).virtual_time().build().unwrap();
    assert_eq!(named.choice(), None);
    assert_eq!(choice(session(block()).model(ModelChoice::Auto).virtual_time()).model, LocalModelKind::Full);
}

#[test]
fn settings_that_the_chosen_model_does_not_use_are_said() {
    let asked = session(block()).crossfade_ms(10.0).global(palpate::runtime::RateGroup::hz(30)).virtual_time();
    let summary = asked.build().unwrap().run().unwrap().to_string();
    let words = summary.split_whitespace().collect::<Vec<_>>().join(" ");
    assert!(words.contains("without effect in full: crossfade_ms() and global()"), "{summary}");
    let used = session(block()).model(LocalModelKind::Patch).crossfade_ms(10.0).virtual_time();
    assert!(!used.build().unwrap().run().unwrap().to_string().contains("without effect"));
}

#[test]
fn auto_is_the_default_of_scenes() {
    let text = "[body.block]\nnodes = [6, 6, 6]\nsize_m = [0.1, 0.1, 0.1]\n[body.material]\nnode_mass_kg = 0.0005\n\
                stiffness_n_per_m = 30.0\ndamping_ratio = 0.3\n[device]\nattach_node = [3, 3, 5]\n";
    let scene = |more: &str| Scene::from_toml(&format!("{text}{more}"), "scene.toml", None).unwrap();
    assert_eq!(scene("").local.model, ModelChoice::Auto);
    let loose = scene("[local]\nmodel = \"auto\"\nerror_pct = 30\n");
    assert_eq!((loose.local.model, loose.local.error_pct), (ModelChoice::Auto, Some(30.0)));
}

#[test]
fn in_virtual_time_the_choice_is_nominal_and_the_machine_has_no_say() {
    let nominal = choice(session(slow(Duration::ZERO)).virtual_time());
    assert!(nominal.reason.why.contains("nominal"), "{nominal}");
    assert_eq!(choice(session(slow(Duration::from_micros(400))).virtual_time()), nominal);
    // 94,178 springs at 4 kHz take longer than a tick may.
    let large = || {
        let body = Block::builder([20; 3], [0.1; 3]).node_mass(0.5e-3).stiffness(30.0).damping_ratio(0.3);
        let fast = palpate::runtime::RateGroup::hz(4000);
        Session::builder(body.fix(palpate::model::mesh::Face::ZMin).build().unwrap())
            .path(pressing())
            .local(fast)
            .virtual_time()
            .duration_s(0.1)
    };
    let strict = choice(large());
    assert!(strict.model != LocalModelKind::Full && strict.reason.why.contains("of 250 us (nominal)"), "{strict}");
    assert_eq!(choice(large()), strict);
    assert_eq!(choice(large().error_pct(60.0)).model, LocalModelKind::Hold);
}

#[test]
fn a_body_that_is_too_small_for_a_patch_runs_without_one() {
    let body = Block::builder([3; 3], [0.1; 3]).node_mass(0.5e-3).stiffness(30.0).fix(palpate::model::mesh::Face::ZMin);
    let choice = choice(session(body.build().unwrap()).virtual_time());
    assert_eq!(choice.model, LocalModelKind::Full, "{choice}");
}

/// At 2 x 340 us of 1 ms `full` is beyond what a tick may take, on any machine, and a global period holds the work.
const TOO_SLOW: Duration = Duration::from_micros(340);

#[test]
fn on_threads_the_cost_is_measured_and_what_is_missed_is_a_warning_in_the_report() {
    let built = session(slow(TOO_SLOW)).build().unwrap();
    let choice = built.choice().cloned().unwrap();
    assert!(choice.model != LocalModelKind::Full && choice.reason.why.contains("measured"), "{choice}");
    assert!(choice.reason.warning.is_some(), "there is no spring to predict: {choice}");
    let summary = built.run().unwrap();
    let environment = summary.report.environment.as_ref().unwrap();
    assert_eq!((&*environment.model, environment.model_reason.as_ref()), (choice.model.name(), Some(&choice.reason)));
    let words = |text: &str| text.split_whitespace().map(str::to_owned).collect::<Vec<_>>().join(" ");
    let report = words(&summary.to_string());
    assert!(report.contains(&format!("model {}: {}", choice.model.name(), choice.reason.why)), "{summary}");
    assert!(report.contains(&format!("warning {}", choice.reason.warning.unwrap())), "{summary}");
}

/// Check that the log says what was chosen and why, and that a replay takes it: in virtual time this body would be run whole.
#[test]
fn a_replay_takes_the_model_of_the_log_and_does_not_choose_again() {
    use palpate::log::{Environment, LogEntry, LogReader};
    let folder = tempfile::tempdir().unwrap();
    let log = folder.path().join("run.mcap");
    let built = session(slow(TOO_SLOW)).log(&log).build().unwrap();
    let choice = built.choice().cloned().unwrap();
    built.run().unwrap();
    let (mut environment, mut scene) = (None, None);
    for entry in LogReader::open(&log).unwrap().map(Result::unwrap) {
        match entry {
            LogEntry::Environment(found) => environment = Some(found),
            LogEntry::Attachment { name, data } if name == Environment::SESSION => {
                scene = Some(Scene::from_session_toml(&String::from_utf8(data).unwrap(), "session.toml").unwrap());
            }
            _ => {}
        }
    }
    assert_eq!(environment.unwrap().model_reason, Some(choice.reason));
    assert_eq!(scene.unwrap().local.model, choice.model.into());
    let again = session(slow(Duration::ZERO));
    let report = again.replay(&log).unwrap().run().unwrap();
    assert!(report.is_identical(), "{report}");
    let chosen_anew = session(slow(Duration::ZERO)).virtual_time().build().unwrap();
    assert_ne!(chosen_anew.choice().unwrap().model, choice.model);
}
