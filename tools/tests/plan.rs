//! `palpate run --plan`: the schedule is printed, nothing runs, and a scene that cannot fit is refused before it starts.

mod support;

use support::{Called, Folder};

#[test]
fn the_plan_is_printed_and_nothing_runs_or_is_written() {
    let folder = Folder::new();
    let files = folder.files();
    let plan = folder.succeed(&["run", "scene.toml", "--plan"]);
    for words in
        ["scene.toml: in real time", "local", "1000 Hz", "SCHED_FIFO 80", "global", "30 Hz", "33.333 ms", "logger"]
    {
        assert!(plan.contains(words), "{words:?} is not in\n{plan}");
    }
    assert!(plan.contains("budgets    all groups"), "the global model's cost was not measured\n{plan}");
    // The haptic thread may have a core to itself; the logger and the global model share the others.
    assert!(plan.contains("global and logger: 10 times per second, every 100 ms"), "{plan}");
    assert_eq!(folder.files(), files);
}

#[test]
fn the_plan_of_a_virtual_run_is_the_same_every_time_and_measures_nothing() {
    let folder = Folder::new();
    let plan = || folder.succeed(&["run", "scene.toml", "--plan", "--virtual"]);
    let first = plan();
    assert_eq!(plan(), first);
    assert!(first.contains("in virtual time") && !first.contains("budgets") && !first.contains("missing"), "{first}");
    assert!(first.contains("local and global: 10 times per second"), "{first}");
    let full = folder.succeed(&["run", "scene.toml", "--plan", "--virtual", "--model", "full"]);
    assert!(full.contains("logger") && !full.contains("global"), "{full}");
}

/// Check that it is a refusal in one line that writes no file, with and without `--plan`, and fine in virtual time.
#[track_caller]
fn assert_refused_in_real_time(folder: &Folder, args: &[&str], words: &[&str]) {
    let files = folder.files();
    for plan in [&[][..], &["--plan"]] {
        let Called { code, out, err } = folder.call(&[&["run", "scene.toml"], args, plan].concat());
        assert_eq!((code, &*out, err.trim_end().lines().count()), (Some(2), "", 1), "{err}");
        assert!(words.iter().all(|word| err.contains(word)), "{words:?} in {err}");
        assert_eq!(folder.files(), files);
    }
    folder.succeed(&[&["run", "scene.toml", "--plan", "--virtual"], args].concat());
}

#[test]
fn a_latency_beyond_the_period_is_refused_in_real_time() {
    let folder = Folder::new();
    folder.spoil("compute_latency_ms = 0", "compute_latency_ms = 33.34");
    assert_refused_in_real_time(&folder, &[], &["global.compute_latency_ms", "33.34", "33.333 ms", "--virtual"]);
}

#[test]
fn a_body_that_takes_longer_than_its_period_is_refused_in_real_time_with_what_was_measured() {
    let folder = Folder::new();
    // Stiff springs: tens of thousands of evaluations per period, on any machine too many.
    folder.spoil("nodes = [6, 6, 6]", "nodes = [12, 12, 12]");
    let scene = std::fs::read_to_string(folder.path("scene.toml")).unwrap();
    folder.write("scene.toml", scene.replace("[3, 3, 5]", "[3, 3, 11]").replace("_m = 30.0", "_m = 3000000.0"));
    let words = ["scene.toml: body: ", "force evaluations of", "33.3 ms", "fewer nodes", "of 1728 fit"];
    assert_refused_in_real_time(&folder, &[], &words);
    let words = ["scene.toml: local.model: ", "a haptic tick of `full`", "1.00 ms", "another local model"];
    assert_refused_in_real_time(&folder, &["--model", "full"], &words);
}

#[test]
fn auto_says_in_plan_report_timing_and_json_which_model_it_took_and_why() {
    let folder = Folder::new();
    let auto = ["run", "scene.toml", "--virtual", "--model", "auto"];
    let why = "a full tick takes 9.7 us of 1 ms (nominal), and nothing beats full where it fits; without effect in full: \
               local.blend and local.patch";
    let words = |text: &str| text.split_whitespace().map(str::to_owned).collect::<Vec<_>>().join(" ");
    let plan = folder.succeed(&[&auto[..], &["--plan"]].concat());
    let line = format!("model full: {why}");
    assert!(words(&plan).contains(&line), "{plan}");
    for report in [folder.succeed(&auto), folder.succeed(&["timing", "palpate-virtual.mcap"])] {
        assert!(words(&report).contains(&line), "{report}");
    }
    let json = folder.succeed(&["timing", "palpate-virtual.mcap", "--json"]);
    let json: serde_json::Value = serde_json::from_str(&json).unwrap();
    assert_eq!(json["environment"]["model_reason"], why);
    assert!(json["environment"]["model_warning"].is_null(), "{json}");
    // A model that is named has no reason to give.
    let named = folder.succeed(&["run", "scene.toml", "--virtual", "--plan"]);
    assert!(!named.contains("model"), "{named}");
    folder.succeed(&["replay", "palpate-virtual.mcap"]);
}
