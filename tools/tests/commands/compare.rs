//! `palpate compare`: the table, the JSON document and the page, on a short scene.

use palpate::model::local::Kind as LocalModelKind;
use serde_json::Value;

use crate::support::{Called, Folder};

fn compared(folder: &Folder, args: &[&str]) -> Value {
    let out = folder.succeed(&[&["compare", "scene.toml", "--json"], args].concat());
    assert_eq!(out.lines().count(), 1, "{out}");
    serde_json::from_str(&out).expect("one JSON document")
}

/// Model and latency of every row.
fn rows(document: &Value) -> Vec<(String, f64)> {
    let models = document["models"].as_array().expect("an array").iter();
    let row = |row: &Value| Some((row["model"].as_str()?.to_owned(), row["latency_ms"].as_f64()?));
    models.map(|model| row(model).expect("a name and a latency")).collect()
}

/// Every model but the reference and a chooser among them, twice.
fn expected_rows() -> Vec<(String, f64)> {
    let others =
        LocalModelKind::ALL.map(LocalModelKind::name).into_iter().filter(|name| !["full", "auto"].contains(name));
    let both = others.flat_map(|name| [(name.to_owned(), 0.0), (name.to_owned(), 33.34)]);
    [("full".to_owned(), 0.0)].into_iter().chain(both).collect()
}

#[test]
fn every_model_has_a_row_for_each_latency_and_full_has_no_error() {
    let folder = Folder::new();
    let files = folder.files();
    let document = compared(&folder, &[]);
    assert_eq!(rows(&document), expected_rows());
    assert!(document["peak_n"].as_f64().is_some_and(|peak| peak > 0.01), "{document}");
    assert_eq!(document["nodes"], 216);
    let full = &document["models"][0];
    for figure in ["rms", "max", "energy"] {
        assert_eq!(full["error_percent"][figure], 0.0, "{figure}");
    }
    assert!(full["error_percent"]["jump"].as_f64().is_some_and(|jump| jump > 0.0));
    assert_eq!((&full["cost"]["builds"], &full["cost"]["global_s_per_s"]), (&0.into(), &0.0.into()));
    for row in document["models"].as_array().unwrap() {
        assert_eq!((&row["ok"], &row["why_not"]), (&true.into(), &Value::Null), "{row}");
        let (cost, p50) = (&row["cost"], row["cost"]["tick_p50_ns"].as_u64());
        assert!(p50.is_some_and(|p50| p50 > 0 && Some(p50) <= cost["tick_p99_ns"].as_u64()), "{row}");
        if row["model"] != "full" {
            // 0.2 s at 30 Hz: one build at the start and six for the releases up to 0.2 s.
            assert_eq!(cost["builds"], 7, "{row}");
            assert!(row["resyncs"].as_u64().is_some_and(|resyncs| resyncs > 0), "{row}");
        }
    }
    assert_eq!(folder.files(), files);
}

#[test]
fn errors_are_the_same_every_time_and_the_scenes_own_model_and_latency_do_not_matter() {
    let folder = Folder::new();
    let errors = |folder: &Folder| {
        let document = compared(folder, &["--models", "hold,patch"]);
        let models = document["models"].as_array().unwrap().iter();
        models.map(|row| row["error_percent"].clone()).collect::<Vec<_>>()
    };
    let first = errors(&folder);
    assert_eq!(first.len(), 5);
    assert_eq!(errors(&folder), first);
    folder.spoil("compute_latency_ms = 0", "compute_latency_ms = 20");
    let changed = std::fs::read_to_string(folder.path("scene.toml")).unwrap().replace("\"patch\"", "\"full\"");
    folder.write("scene.toml", changed);
    assert_eq!(errors(&folder), first);
}

// Check one step a tick of a quarter of a millisecond: twice the steps are two.
#[test]
fn the_reference_differs_from_one_in_twice_its_steps_at_any_haptic_rate() {
    let folder = Folder::new();
    folder.spoil("rate_hz = 1000\n", "rate_hz = 4000\n");
    let scene = std::fs::read_to_string(folder.path("scene.toml")).unwrap();
    folder.write("scene.toml", scene.replace("[global]\n", "[global]\nsubsteps_per_ms = 2\n"));
    let document = compared(&folder, &["--models", "hold", "--duration", "0.1"]);
    let finer = &document["finer"][0];
    assert!(finer["error_percent"]["rms"].as_f64().is_some_and(|rms| rms > 0.0), "{finer}");
}

#[test]
fn the_table_has_the_rows_and_says_what_they_come_to() {
    let folder = Folder::new();
    let table = folder.succeed(&["compare", "scene.toml"]);
    assert!(table.lines().all(|line| line.chars().count() <= 100), "{table}");
    for (model, latency_ms) in &expected_rows()[1..] {
        let is_row = |line: &str| {
            let words: Vec<&str> = line.split_whitespace().collect();
            words.len() == 13 && words[0] == model && words[1].parse() == Ok(*latency_ms)
        };
        assert_eq!(table.lines().filter(|line| is_row(line)).count(), 1, "{model} {latency_ms}:\n{table}");
    }
    for words in ["the haptic tick here (CPU p99", "within 1 % rms of `full`", "within 5 % rms", "reading the clock"] {
        assert!(table.contains(words), "{words:?} is not in\n{table}");
    }
}

#[test]
fn the_page_has_every_plot_and_needs_nothing_else() {
    let folder = Folder::new();
    folder.succeed(&["compare", "scene.toml", "--html", "page.html", "--duration", "0.15"]);
    let page = std::fs::read_to_string(folder.path("page.html")).unwrap();
    for id in ["speed", "force-0", "resync-0", "error-0", "force-1", "resync-1", "error-1"] {
        assert_eq!(page.matches(&format!("<figure id=\"{id}\">")).count(), 1, "{id}");
    }
    let plots: Vec<&str> = page.split("<figure").skip(1).collect();
    assert_eq!(plots.len(), 7);
    let curves = |plot: &str| plot.matches("class=\"line ").count();
    let models = expected_rows().len() / 2;
    // Each is drawn for a broad page and for a narrow one.
    for width in [0, 1] {
        let drawn = |at: usize| plots[at].split("<div class=\"narrow\">").nth(width).expect("two drawings");
        assert_eq!(drawn(0).matches("<circle").count(), expected_rows().len());
        assert_eq!([1, 2, 3].map(|at| curves(drawn(at))), [models + 1, models + 1, models]);
    }
    for outside in ["http", "src=", "@import", "url(", "<script", "<link", "NaN"] {
        assert!(!page.contains(outside), "the page has {outside:?}");
    }
    assert!(page.contains("prefers-color-scheme: dark") && page.contains("@media print"));
    assert!(page.contains("<title>palpate compare: scene.toml</title>"));
}

#[test]
fn several_devices_have_their_own_rows_and_plots_and_the_worst_counts() {
    let folder = Folder::new();
    let second = "[[device]]\nname = \"right\"\nkind = \"scripted\"\npath_csv = \"right.csv\"\n";
    folder.spoil("[device]", &format!("{second}[[device]]\nname = \"left\""));
    // It touches nothing: there is no percentage of it.
    folder.write("right.csv", "t_s,x_m,y_m,z_m\n0,0.05,0.05,0.3\n");

    let document = compared(&folder, &["--models", "patch", "--html", "page.html"]);
    let named = |of: &Value| of["devices"].as_array().expect("devices").clone();
    let peaks: Vec<f64> = named(&document).iter().filter_map(|device| device["peak_n"].as_f64()).collect();
    assert!(peaks.len() == 2 && peaks[0] == 0.0 && document["peak_n"] == peaks[1] && peaks[1] > 0.01, "{document}");
    for model in document["models"].as_array().unwrap() {
        let [right, left] = &named(model)[..] else { panic!("{model}") };
        assert_eq!((&right["name"], &left["name"]), (&"right".into(), &"left".into()));
        assert_eq!((&right["error_percent"]["rms"], &left["error_percent"]), (&Value::Null, &model["error_percent"]));
        let resyncs = |of: &Value| of["resyncs"].as_u64().unwrap();
        assert_eq!(resyncs(left) + resyncs(right), resyncs(model));
    }
    let page = std::fs::read_to_string(folder.path("page.html")).unwrap();
    for id in ["speed", "left-force-0", "left-error-1", "right-resync-0"] {
        assert_eq!(page.matches(&format!("<figure id=\"{id}\">")).count(), 1, "{id}");
    }
    assert!(!page.contains("NaN"));

    let table = folder.succeed(&["compare", "scene.toml", "--models", "patch", "--models-only"]);
    let rows = |name: &str| table.lines().filter(|line| line.split_whitespace().next() == Some(name)).count();
    assert_eq!(["full", "patch", "left", "right"].map(rows), [1, 2, 3, 3], "{table}");
    assert!(table.contains(" N on left") && table.contains("0 N on right"), "{table}");
}

#[test]
fn what_cannot_be_compared_or_written_is_refused_in_one_line() {
    let folder = Folder::new();
    let files = folder.files();
    for (args, words) in [
        (&["compare"][..], &["SCENE", "palpate compare --help"][..]),
        (&["compare", "nowhere.toml"], &["nowhere.toml", "No such file"]),
        (&["compare", "scene.toml", "--models", "marble"], &["marble", "hold", "patch", "full"]),
        (&["compare", "scene.toml", "--duration", "-1"], &["scene.toml", "run.duration_s", "-1"]),
        (&["compare", "scene.toml", "--html", "scene.toml"], &["scene.toml: is the input itself"]),
        (&["compare", "scene.toml", "--html", "path.csv"], &["path.csv: is the input itself"]),
        (&["compare", "scene.toml", "--duration", "0.04", "--html", "nowhere/page.html"], &["nowhere/page.html"]),
    ] {
        let Called { code, out, err } = folder.call(args);
        assert_eq!((code, &*out, err.trim_end().lines().count()), (Some(2), "", 1), "{args:?}: {err}");
        assert!(words.iter().all(|word| err.contains(word)), "{words:?} in {err}");
        assert_eq!(folder.files(), files);
    }
    folder.spoil("duration_s = 0.2", "duration_s = -0.2");
    let refused = folder.call(&["compare", "scene.toml"]);
    assert!(refused.code == Some(2) && refused.err.contains("run.duration_s: is -0.2"), "{refused:?}");
}
