//! `palpate reduce`: which of its words go together, the report, the JSON document and the page.

use serde_json::Value;

use crate::support::{Called, Folder};

/// The document that a call prints.
#[track_caller]
fn reduced(folder: &Folder, args: &[&str]) -> Value {
    let out = folder.succeed(&[&["reduce"], args, &["--json"]].concat());
    assert_eq!(out.lines().count(), 1, "{out}");
    serde_json::from_str(&out).expect("one JSON document")
}

fn numbers(list: &Value) -> Vec<f64> {
    list.as_array().expect("a list").iter().map(|value| value.as_f64().expect("a number")).collect()
}

#[test]
fn words_and_values_that_do_not_go_together_are_refused_in_one_line() {
    let folder = Folder::new();
    let files = folder.files();
    let cases: &[(&[&str], &[&str])] = &[
        (&[], &["SCENE", "--paper", "--cells", "palpate reduce --help"]),
        (&["--json"], &["SCENE", "--paper", "--cells"]),
        (&["--order", "10"], &["SCENE", "--paper", "--cells"]),
        (&["scene.toml", "--paper", "table1"], &["cannot be used with", "--paper"]),
        (&["scene.toml", "--cells", "5,5"], &["cannot be used with", "--cells"]),
        (&["--paper", "table1", "--cells", "5,5"], &["cannot be used with", "--paper", "--cells"]),
        (&["--paper", "table1", "table2"], &["cannot be used with", "--paper"]),
        (&["--paper", "table3"], &["table3", "table1, table2, fig4, fig5, fig8 and all"]),
        (&["--paper", "table1,fig6"], &["fig6", "fig8 and all"]),
        (&["--paper", "table1", "--patch", "4,4,2"], &["--patch", "cannot be used with", "--paper"]),
        (&["--paper", "all", "--order", "10"], &["--order", "cannot be used with", "--paper"]),
        (&["--paper", "all", "--fail-if-not-local"], &["--fail-if-not-local", "cannot be used with", "--paper"]),
        (&["--cells", "5,5", "--measure"], &["--measure", "cannot be used with", "--cells"]),
        (&["--cells", "5,5", "--error-pct", "1"], &["--error-pct", "cannot be used with", "--cells"]),
        (&["scene.toml", "--zeta", "1"], &["--zeta", "cannot be used with"]),
        (&["scene.toml", "--hz", "10"], &["--hz", "cannot be used with"]),
        (&["--cells", "12"], &["'12'", "--cells", "such as 12,12"]),
        (&["--cells", "5,1"], &["'5,1'", "at least 2"]),
        (&["--cells", "5,5,5,5"], &["'5,5,5,5'", "two or three"]),
        (&["--cells", "5,-5"], &["'5,-5'", "at least 2"]),
        (&["--cells", "5,5", "--zeta", "-1"], &["'-1'", "--zeta", "above 0"]),
        (&["--cells", "5,5", "--zeta", "nan"], &["'nan'", "--zeta", "above 0"]),
        (&["--cells", "5,5", "--stiffness", "inf"], &["'inf'", "--stiffness", "above 0"]),
        (&["--cells", "5,5", "--mass", "0"], &["'0'", "--mass", "above 0"]),
        (&["--cells", "5,5", "--hz", "10,-1"], &["'-1'", "--hz", "0,10,100"]),
        (&["--cells", "5,5", "--order", "0"], &["'0'", "--order", "at least 1"]),
        (&["scene.toml", "--patch", "4,4"], &["'4,4'", "--patch", "such as 4,4,2"]),
        (&["scene.toml", "--patch", "4,0,2"], &["'4,0,2'", "--patch", "such as 4,4,2"]),
        (&["scene.toml", "--node", "1,2"], &["'1,2'", "--node", "5,5,11"]),
        (&["scene.toml", "--every", "0"], &["'0'", "--every", "at least 1"]),
        (&["scene.toml", "--error-pct", "-0.5"], &["'-0.5'", "--error-pct", "above 0"]),
        (&["nowhere.toml"], &["nowhere.toml", "No such file"]),
        (&["scene.toml", "--html", "scene.toml"], &["scene.toml: is the input itself"]),
        (&["scene.toml", "--html", "path.csv"], &["path.csv: is the input itself"]),
    ];
    for (args, words) in cases {
        let Called { code, out, err } = folder.call(&[&["reduce"], *args].concat());
        assert_eq!((code, &*out, err.trim_end().lines().count()), (Some(2), "", 1), "{args:?}: {err}");
        assert!(err.starts_with("error: ") && words.iter().all(|word| err.contains(word)), "{words:?} in {err}");
        assert_eq!(folder.files(), files);
    }
    folder.spoil("size_m = [0.1", "size_mm = [0.1");
    let refused = folder.call(&["reduce", "scene.toml"]);
    assert!(refused.code == Some(2) && refused.err.contains("scene.toml:3: body.block.size_mm"), "{refused:?}");
}

#[test]
fn help_is_an_answer() {
    let help = Folder::new().succeed(&["reduce", "--help"]);
    for word in ["Usage: palpate reduce", "--paper", "--cells", "--fail-if-not-local", "--html"] {
        assert!(help.contains(word), "{word} is not in\n{help}");
    }
}

#[test]
fn a_mesh_of_any_size_is_reduced_at_the_frequencies_that_were_named() {
    let folder = Folder::new();
    let files = folder.files();
    let document = reduced(&folder, &["--cells", "5,5", "--order", "8", "--hz", "100,0,10,10"]);
    let response = &document["responses"][0];
    assert_eq!(numbers(&response["frequencies_hz"]), [0.0, 10.0, 100.0]);
    let models = response["models"].as_array().unwrap();
    // The paper's Table 1: 5 x 5 cells have 76 states.
    assert_eq!(models[0]["order"], 76);
    let channels = response["channels"].as_array().unwrap().len();
    for model in models {
        assert_eq!(model["gains"].as_array().unwrap().len(), channels, "{}", model["name"]);
        for gains in model["gains"].as_array().unwrap() {
            assert_eq!(gains.as_array().unwrap().len(), 3);
            assert!(gains.as_array().unwrap().iter().all(|gain| numbers(gain).len() == 2));
        }
    }
    let values = numbers(&document["hankel"][0]["values"]);
    assert!(values.len() > 8 && values.windows(2).all(|pair| pair[0] >= pair[1]), "{values:?}");
    assert_eq!(document["locality"], Value::Null);
    assert_eq!(folder.files(), files);
}

#[test]
fn stiffness_and_mass_together_scale_the_gains_and_change_nothing_else() {
    let folder = Folder::new();
    let values =
        |args: &[&str]| numbers(&reduced(&folder, &[&["--cells", "5,5"], args].concat())["hankel"][0]["values"]);
    let (one, other) = (values(&[]), values(&["--stiffness", "200", "--mass", "0.002"]));
    // Those far above rounding.
    for (one, other) in one.iter().zip(&other).take_while(|(value, _)| **value > 1e-6 * one[0]) {
        assert!((other / one - 2.0).abs() < 1e-6, "{one} and {other}");
    }
}

#[test]
fn published_and_computed_stand_in_one_table() {
    let folder = Folder::new();
    let document = reduced(&folder, &["--paper", "table2"]);
    assert_eq!(document["tables"].as_array().unwrap().len(), 1);
    let rows = document["tables"][0]["rows"].as_array().unwrap();
    assert_eq!(rows[0]["published_error_percent"], 51.1);
    for row in rows {
        let figure = |name: &str| row[name].as_f64().unwrap();
        assert_eq!(row["stable"], true, "{row}");
        // The paper does not define its error: magnitude, not digits.
        let ratio = figure("error_percent") / figure("published_error_percent");
        assert!((0.125..8.0).contains(&ratio), "{row}");
        // A parser may round the last bit.
        assert!((figure("ratio") / ratio - 1.0).abs() < 1e-12, "{row}");
    }
    let text = folder.succeed(&["reduce", "--paper", "table2"]);
    assert!(text.lines().all(|line| line.chars().count() <= 100), "{text}");
    for words in ["published", "ratio", "H-inf", "The paper does not define its % error", "51.1"] {
        assert!(text.contains(words), "{words:?} is not in\n{text}");
    }
}

#[test]
fn studies_come_in_the_order_in_which_they_were_named_and_once() {
    let folder = Folder::new();
    let titles = |args: &[&str]| {
        let document = reduced(&folder, args);
        let tables = document["tables"].as_array().unwrap().iter();
        tables.map(|table| table["title"].as_str().unwrap().to_owned()).collect::<Vec<_>>()
    };
    let both = titles(&["--paper", "table2", "--paper", "table2,table2"]);
    assert_eq!(both, titles(&["--paper", "table2"]));
}

#[test]
fn the_page_is_one_file_that_needs_nothing_else() {
    let folder = Folder::new();
    folder.succeed(&["reduce", "--cells", "5,5", "--html", "page.html"]);
    let page = std::fs::read_to_string(folder.path("page.html")).unwrap();
    assert!(page.contains("Hankel singular values") && page.contains("gain (dB re 1 N/m)"), "{page}");
    assert!(page.matches("<svg").count() >= 4 && page.contains("prefers-color-scheme: dark"));
    for outside in ["http", "src=", "@import", "url(", "<script", "<link", "NaN"] {
        assert!(!page.contains(outside), "the page has {outside:?}");
    }
    let refused = folder.call(&["reduce", "--cells", "5,5", "--html", "nowhere/page.html"]);
    assert!(
        refused.code == Some(2) && refused.out.is_empty() && refused.err.contains("nowhere/page.html"),
        "{refused:?}"
    );
}

#[test]
fn a_scene_has_its_verdict_first_and_the_exit_code_follows_it_on_request() {
    let folder = Folder::new();
    let document = reduced(&folder, &["scene.toml", "--error-pct", "5"]);
    let locality = &document["locality"];
    assert_eq!(document["subject"], "scene.toml");
    assert_eq!(
        (&locality["patch"], &locality["budget"]["error_percent"]),
        (&serde_json::json!([3, 3, 2]), &5.0.into())
    );
    for face in locality["faces"].as_array().unwrap() {
        let sizes = ["first_m", "second_m"].map(|axis| face[axis].as_array().unwrap().len());
        assert_eq!(face["contacts"].as_array().unwrap().len(), sizes[0] * sizes[1], "{}", face["face"]);
    }
    let is_local = locality["local"].as_bool().unwrap();
    let verdict = locality["verdict"].as_str().unwrap();
    let text = folder.succeed(&["reduce", "scene.toml", "--html", "page.html"]);
    assert!(text.starts_with(if is_local { "Local at " } else { "Not local. " }), "{text}");
    let page = std::fs::read_to_string(folder.path("page.html")).unwrap();
    assert!(page.contains("Over the surface") && page.contains("between resyncs (10 to 1000 Hz)"));
    let called = folder.call(&["reduce", "scene.toml", "--error-pct", "5", "--fail-if-not-local"]);
    assert_eq!(called.code, Some(if is_local { 0 } else { 1 }));
    assert_eq!(called.err.contains(verdict), !is_local, "{called:?}");
}

#[test]
fn another_patch_has_other_errors_and_a_larger_one_smaller() {
    let folder = Folder::new();
    let error = |patch: &str| {
        let document = reduced(&folder, &["scene.toml", "--patch", patch, "--node", "3,3,5"]);
        document["locality"]["contact"]["at_rest_error_percent"].as_f64().unwrap()
    };
    let (small, large) = (error("3,3,2"), error("5,5,4"));
    assert!(small > large && large > 0.0, "{small} and {large}");
}
