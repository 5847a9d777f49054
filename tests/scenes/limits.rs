//! What a scene may ask for at most: every count and every file has a limit that is looked at before anything is made of it.

use palpate::devices::ToolPath;
use palpate::scene::Scene;
use palpate::{Error, ErrorKind};
use std::fmt::Write;
use std::path::Path;

const BODY: &str = r#"[body.block]
nodes = [6, 6, 6]
size_m = [0.1, 0.1, 0.1]
[body.material]
node_mass_kg = 0.0005
stiffness_n_per_m = 30.0
damping_ratio = 0.3
"#;

fn refusal(text: &str) -> Error {
    let error = Scene::from_toml(text, "scene.toml", None).expect_err("it is refused");
    let line = error.to_string();
    assert!(line.chars().count() < 1000 && !line.contains(|c: char| c.is_control()), "{line:?}");
    error
}

fn many(count: usize, mut write: impl FnMut(usize) -> String) -> String {
    (0..count).map(&mut write).collect()
}

#[test]
fn every_list_of_a_scene_has_a_largest_length() {
    let device = "[device]\nattach_node = [2, 2, 5]\n";
    let region =
        "[[body.region]]\nstiffness_n_per_m = 40.0\nshape = { layer = { axis = \"z\", from_m = 0.0, to_m = 0.1 } }\n";
    let grip = many(10_001, |n| format!("[{n}, 1],"));
    let held = many(10_001, |_| "[0, 0, 0],".to_owned());
    let fault = "[[device.fault]]\nkind = \"lost\"\nfrom_s = 0\nto_s = 1\n";
    let fixed = format!("fixed = [{}]\n[body.material]", many(33, |_| "\"z_min\",".to_owned()));
    for (text, place) in [
        (format!("{BODY}{device}{}", "[[probe]]\nnode = [1, 1, 1]\n".repeat(20_000)), "probe"),
        (format!("{BODY}{device}[local]\nrate_hz = 1000000\n{}", "[[probe]]\nnode = [1, 1, 1]\n".repeat(5)), "probe"),
        (format!("{BODY}{}", "[[device]]\nname = \"a\"\npath_csv = \"none.csv\"\n".repeat(10_000)), "device"),
        (format!("{BODY}{device}{}", region.repeat(257)), "body.region"),
        (format!("{BODY}{device}{}", fault.repeat(257)), "device.fault"),
        (format!("{BODY}{device}[device.hand]\ngrip = [{grip}]\n"), "device.hand.grip"),
        (format!("{BODY}{device}[device.plant]\naxes = [{}]\n", "\"x\",".repeat(33)), "device.plant.axes"),
        (format!("{BODY}{device}[safety]\noff = [{}]\n", "\"slew\",".repeat(33)), "safety.off"),
        (format!("{}{device}", BODY.replace("[body.material]", &fixed)), "body.block.fixed"),
        (
            format!("{BODY}{device}[initial]\npull = {{ node = [2, 2, 5], offset_m = [0, 0, 0.01] }}\nhold = [{held}]"),
            "initial.hold",
        ),
    ] {
        let error = refusal(&text);
        let words = error.to_string();
        assert!(
            error.place().ends_with(&format!(": {place}")) && words.contains("at most") || words.contains("1 to 8"),
            "{words}"
        );
    }
}

#[test]
fn a_scene_that_is_too_large_too_deep_or_of_long_words_is_refused_in_one_short_line() {
    let long = "x".repeat(900_000);
    for text in [
        "#".repeat(2 << 20),
        format!("{long} = 1"),
        format!("\"{long}\\n\\u001b[31m\\u202e\" = 1"),
        format!("{BODY}[run]\nduration_s = {}", "9".repeat(900_000)),
        format!("{BODY}[run]\nduration_s = \"{long}\""),
        format!("{BODY}[device]\nname = \"{long}\"\n[[device]]"),
        format!("[{long}]\n[{long}]"),
        format!("x = {}", "[".repeat(400_000)),
        format!("x = {}{}", "[".repeat(50_000), "]".repeat(50_000)),
        format!("{}x = 1", "a.".repeat(400_000)),
        format!("[{}x]", "a.".repeat(400_000)),
        format!("x = {}", "{a=".repeat(200_000)),
    ] {
        refusal(&text);
    }
}

#[test]
fn a_name_of_a_file_cannot_break_the_line_or_reach_the_terminal() {
    let folder = tempfile::tempdir().unwrap();
    let name = "a\nb\u{1b}[31m\u{202e}.toml";
    let path = folder.path().join(name);
    std::fs::write(&path, "body = 1").unwrap();
    for error in [Scene::load(&path).unwrap_err(), Scene::load(&folder.path().join(format!("no{name}"))).unwrap_err()] {
        let line = error.to_string();
        assert!(!line.contains(|c: char| c.is_control() || c == '\u{202e}'), "{line:?}");
        assert!(line.contains(r"a\nb\u{1b}[31m\u{202e}.toml"), "{line}");
    }
}

fn io_error<T: std::fmt::Debug>(result: Result<T, Error>, words: &str) {
    let error = result.expect_err("it is refused");
    assert!(error.kind() == ErrorKind::Io && error.to_string().contains(words), "{error}");
}

#[cfg(unix)]
#[test]
fn what_is_no_file_is_refused_before_it_is_opened() {
    let folder = tempfile::tempdir().unwrap();
    let fifo = folder.path().join("fifo");
    assert!(std::process::Command::new("mkfifo").arg(&fifo).status().unwrap().success());
    for (path, words) in [
        (Path::new("/dev/zero"), "is a device, must be a file"),
        (&fifo, "is a pipe"),
        (folder.path(), "is a directory"),
    ] {
        io_error(Scene::load(path), words);
        io_error(ToolPath::read_csv(path), words);
        let toml = format!("{BODY}[device]\nkind = \"replay\"\nlog = {:?}\n", path.display().to_string());
        let scene = Scene::from_toml(&toml, "scene.toml", None).unwrap();
        io_error(palpate::session::Session::from_scene(scene).virtual_time().build(), words);
    }
}

#[test]
fn files_that_are_too_large_are_refused_by_their_size() {
    let folder = tempfile::tempdir().unwrap();
    let huge = folder.path().join("huge");
    // Takes no room on the disk.
    std::fs::File::create(&huge).unwrap().set_len(1 << 40).unwrap();
    io_error(Scene::load(&huge), "is larger than 1 MiB");
    io_error(ToolPath::read_csv(&huge), "is larger than 244 MiB");
}

#[test]
fn a_path_has_four_million_samples_at_most() {
    let mut text = "t_s,x_m,y_m,z_m\n".to_owned();
    for n in 0..=4_000_000 {
        writeln!(text, "{n},0,0,0").unwrap();
    }
    let error = ToolPath::from_csv(&text, "path.csv").unwrap_err().to_string();
    assert_eq!(error, "path.csv:4000002: is one row too many, a path has at most 4000000");
}
