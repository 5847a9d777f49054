//! Files that commands read and write: no output is an input, none is left half-written, and no two runs write one log.
#![cfg(target_os = "linux")]

mod support;

use std::io::Write;
use std::process::{Child, Command, Output, Stdio};

use support::{Called, Folder, SCENE, rewrite_log};

/// A folder with a run's log `drive.mcap` and the scene `replay.toml`, which follows it and has a basis.
fn folder() -> Folder {
    let folder = Folder::new();
    folder.succeed(&["run", "scene.toml", "--virtual", "--out", "drive.mcap"]);
    let replay = SCENE.replace("path_csv = \"path.csv\"", "kind = \"replay\"\nlog = \"drive.mcap\"");
    let replay = replay.replace("[local]\n", "[local]\nbasis_folder = \"bases\"\n");
    folder.write("replay.toml", replay);
    std::fs::create_dir(folder.path("bases")).unwrap();
    folder.write("bases/1.basis", "kept");
    folder
}

#[test]
fn no_output_overwrites_an_input_however_it_is_called() {
    let folder = folder();
    std::os::unix::fs::symlink("drive.mcap", folder.path("soft.mcap")).unwrap();
    std::fs::hard_link(folder.path("drive.mcap"), folder.path("hard.mcap")).unwrap();
    std::os::unix::fs::symlink("path.csv", folder.path("soft.csv")).unwrap();
    let of_logs = ["drive.mcap", "./bases/../drive.mcap", "soft.mcap", "hard.mcap"];
    let of_replay = [&of_logs[..], &["replay.toml", "bases/1.basis"]].concat();
    let of_scene = ["scene.toml", "./path.csv", "soft.csv"];
    let page_of_scene: [&[&str]; 2] = [&["compare", "SCENE", "--html"], &["reduce", "SCENE", "--html"]];
    let all_of_scene = [&[&["run", "SCENE", "--virtual", "--out"][..]], &page_of_scene[..]].concat();
    let mut cases: Vec<(Vec<&str>, &[&str])> = Vec::new();
    for (scene, outs) in [("replay.toml", &of_replay[..]), ("scene.toml", &of_scene)] {
        let named = |args: &[&'static str]| args.iter().map(|arg| if *arg == "SCENE" { scene } else { arg }).collect();
        cases.extend(all_of_scene.iter().map(|args| (named(args), outs)));
    }
    let of_a_log: [&[&str]; 4] = [
        &["timing", "drive.mcap", "--html"],
        &["timing", "cut.mcap", "--against", "drive.mcap", "--html"],
        &["export", "drive.mcap", "--topic", "/force", "--out"],
        &["log", "recover", "drive.mcap", "--out"],
    ];
    folder.write("cut.mcap", std::fs::read(folder.path("drive.mcap")).unwrap());
    cases.extend(of_a_log.iter().map(|args| (args.to_vec(), &of_logs[..])));
    for (args, outs) in cases {
        for out in outs {
            let before = std::fs::read(folder.path(out)).unwrap();
            let files = folder.files();
            let called = folder.call(&[&args[..], &[*out]].concat());
            assert_eq!((called.code, called.err.lines().count()), (Some(2), 1), "{args:?} {out}: {called:?}");
            assert!(called.err.contains("is the input itself"), "{args:?} {out}: {called:?}");
            assert!(std::fs::read(folder.path(out)).unwrap() == before, "{args:?} {out}");
            assert_eq!(folder.files(), files, "{args:?} {out}");
        }
    }
}

#[test]
fn a_log_chooses_no_path_where_it_is_replayed() {
    let folder = Folder::new();
    folder.spoil("model = \"patch\"", "model = \"predictive\"\nbasis = 10\nbasis_folder = \"bases\"");
    folder.succeed(&["run", "scene.toml", "--virtual", "--out", "drive.mcap"]);
    assert!(
        !std::fs::read_dir(folder.path("bases")).unwrap().collect::<Vec<_>>().is_empty(),
        "the run keeps its bases"
    );
    std::fs::remove_dir_all(folder.path("bases")).unwrap();
    folder.succeed(&["replay", "drive.mcap"]);
    assert!(!folder.files().contains(&"bases".to_owned()));
    // Check that a log that names a folder nevertheless is replayed without it
    let elsewhere = folder.path("elsewhere").display().to_string();
    let session = |session: String| {
        assert!(session.contains("[local]\n"), "{session}");
        session.replace("[local]\n", &format!("[local]\nbasis_folder = {elsewhere:?}\n"))
    };
    rewrite_log(&folder.path("drive.mcap"), session, |record| record);
    folder.succeed(&["replay", "drive.mcap"]);
    assert!(!folder.path("elsewhere").exists());
}

fn spawn(folder: &Folder, args: &[&str]) -> Child {
    let mut command = Command::new(env!("CARGO_BIN_EXE_palpate"));
    command.args(args).current_dir(folder.path("")).stdin(Stdio::null());
    command.stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().unwrap()
}

fn ended(output: Output) -> Called {
    let text = |bytes| String::from_utf8(bytes).unwrap();
    Called { code: output.status.code(), out: text(output.stdout), err: text(output.stderr) }
}

/// Starts a run of some seconds and waits until it has begun its log `run.mcap`.
fn run(folder: &Folder) -> Child {
    let mut child = spawn(folder, &["run", "scene.toml", "--duration", "4", "--out", "run.mcap"]);
    while std::fs::metadata(folder.path("run.mcap")).map_or(0, |file| file.len()) == 0 {
        assert_eq!(child.try_wait().unwrap(), None, "it ended by itself");
        std::thread::sleep(std::time::Duration::from_millis(5));
    }
    child
}

#[test]
fn a_second_run_into_the_same_log_is_refused_and_leaves_the_first_alone() {
    let folder = Folder::new();
    folder.succeed(&["run", "scene.toml", "--virtual", "--out", "old.mcap"]);
    let first = run(&folder);
    let second = folder.call(&["run", "scene.toml", "--virtual", "--out", "./run.mcap"]);
    assert_eq!((second.code, second.err.lines().count()), (Some(2), 1), "{second:?}");
    assert!(second.err.starts_with("error: ./run.mcap: another run is writing it"), "{second:?}");
    let page = folder.call(&["timing", "old.mcap", "--html", "run.mcap"]);
    assert_eq!((page.code, page.err.lines().count()), (Some(2), 1), "{page:?}");
    assert!(page.err.starts_with("error: run.mcap: a run is writing it"), "{page:?}");
    let first = ended(first.wait_with_output().unwrap());
    assert_eq!(first.code, Some(0), "{first:?}");
    folder.succeed(&["log", "check", "run.mcap"]);
    // Check that it is free again
    folder.succeed(&["run", "scene.toml", "--virtual", "--out", "run.mcap"]);
    folder.succeed(&["log", "check", "run.mcap"]);
}

#[test]
fn a_log_that_is_gone_at_the_end_is_not_named_but_missed() {
    for is_replaced in [false, true] {
        let folder = Folder::new();
        let child = run(&folder);
        std::fs::remove_file(folder.path("run.mcap")).unwrap();
        if is_replaced {
            folder.write("run.mcap", "of somebody else");
        }
        let called = ended(child.wait_with_output().unwrap());
        assert_eq!((called.code, called.err.lines().count()), (Some(1), 1), "{called:?}");
        assert!(called.err.contains("run.mcap: it is gone"), "{called:?}");
        assert!(called.out.contains("released") && !called.out.contains("log: run.mcap ("), "{called:?}");
    }
}

// A file system of 32 KiB in a mount space of its own: it is gone with the shell.
#[test]
fn a_full_disk_leaves_no_part_of_an_output_behind_and_keeps_what_was_there() {
    let folder = Folder::new();
    folder.succeed(&["run", "scene.toml", "--virtual", "--out", "run.mcap"]);
    std::fs::create_dir(folder.path("disk")).unwrap();
    let script = "mount -t tmpfs -o size=32k none disk || exit 99
        echo old > disk/old
        for out in disk/new disk/old; do
            $0 timing run.mcap --html $out > /dev/null; echo $?
            $0 export run.mcap --format chrome-trace --out $out; echo $?
            $0 log recover run.mcap --out $out > /dev/null; echo $?
        done
        ls -A disk; cat disk/old";
    let output = Command::new("unshare")
        .args(["-rm", "sh", "-c", script, env!("CARGO_BIN_EXE_palpate")])
        .current_dir(folder.path(""))
        .output()
        .unwrap();
    let called = ended(output);
    assert_eq!(called.out, "2\n2\n2\n2\n2\n2\nold\nold\n", "{called:?}");
    assert_eq!(called.err.matches("No space left on device").count(), 6, "{called:?}");
}

#[test]
fn an_output_that_cannot_be_written_is_refused_before_the_work() {
    let folder = Folder::new();
    // Check that it is what is told of, though the work would be refused, too
    folder.write("none.mcap", "no log");
    folder.write("open.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n");
    folder.write("page.html", "old");
    let files = folder.files();
    let works: [(&[&str], &str); 4] = [
        (&["compare", "scene.toml", "--duration", "-1", "--html"], "run.duration_s"),
        (&["reduce", "scene.toml", "--patch", "9,9,9", "--html"], "patch"),
        (&["timing", "none.mcap", "--html"], "no MCAP"),
        (&["mesh", "open.obj", "--size-mm", "4", "--out"], "the surface is open"),
    ];
    for (args, words) in works {
        let call = |out| folder.call(&[args, &[out]].concat());
        let refused = call("nowhere/out");
        assert!(refused.code == Some(2) && refused.err.starts_with("error: nowhere/out: "), "{args:?}: {refused:?}");
        // Check that what was there stays, and no part of another is left, where the work is refused
        let refused = call("page.html");
        assert!(refused.code == Some(2) && refused.err.contains(words), "{args:?}: {refused:?}");
        assert_eq!(
            (folder.files(), &*std::fs::read_to_string(folder.path("page.html")).unwrap()),
            (files.clone(), "old")
        );
    }
}

#[test]
fn an_interrupted_command_leaves_no_part_of_its_output() {
    let folder = Folder::new();
    let files = folder.files();
    let mut child = spawn(&folder, &["compare", "scene.toml", "--duration", "1000", "--html", "page.html"]);
    while folder.files() == files {
        assert_eq!(child.try_wait().unwrap(), None, "it ended by itself");
        std::thread::sleep(std::time::Duration::from_millis(5));
    }
    // Its handler is there a moment after the file.
    std::thread::sleep(std::time::Duration::from_millis(500));
    Command::new("kill").args(["-INT", &child.id().to_string()]).status().unwrap();
    let called = ended(child.wait_with_output().unwrap());
    assert_eq!((called.code, &*called.out), (Some(130), ""), "{called:?}");
    assert_eq!(folder.files(), files);
}

/// True if a process handles SIGINT.
fn handles_interrupts(child: &Child) -> bool {
    let status = std::fs::read_to_string(format!("/proc/{}/status", child.id())).unwrap_or_default();
    let caught = status.lines().find_map(|line| line.strip_prefix("SigCgt:"));
    caught.is_some_and(|mask| u64::from_str_radix(mask.trim(), 16).unwrap() & 1 << 1 != 0)
}

// Check a log that never ends, through a pipe, and one with a hole that takes long to look through.
#[test]
fn an_interrupted_copy_of_a_log_leaves_no_part_of_it() {
    let folder = Folder::new();
    folder.succeed(&["run", "scene.toml", "--virtual", "--out", "run.mcap"]);
    let begin = &std::fs::read(folder.path("run.mcap")).unwrap()[..4096];
    folder.write("hole.mcap", begin);
    let hole = std::fs::OpenOptions::new().write(true).open(folder.path("hole.mcap")).unwrap();
    hole.set_len(1 << 34).unwrap();
    Command::new("mkfifo").arg(folder.path("pipe")).status().unwrap();
    let files = folder.files();
    let interrupt = |mut child: Child| {
        for _ in 0..1000 {
            if folder.files() != files && handles_interrupts(&child) {
                break;
            }
            assert_eq!(child.try_wait().unwrap(), None, "it ended by itself");
            std::thread::sleep(std::time::Duration::from_millis(5));
        }
        Command::new("kill").args(["-INT", &child.id().to_string()]).status().unwrap();
        let called = ended(child.wait_with_output().unwrap());
        assert_eq!((called.code, &*called.out), (Some(130), ""), "{called:?}");
        assert_eq!(folder.files(), files);
    };
    let export = spawn(&folder, &["export", "pipe", "--format", "chrome-trace", "--out", "new"]);
    let mut pipe = std::fs::OpenOptions::new().write(true).open(folder.path("pipe")).unwrap();
    pipe.write_all(begin).unwrap();
    interrupt(export);
    interrupt(spawn(&folder, &["log", "recover", "hole.mcap", "--out", "new"]));
}

// A name space of users, in which nobody may do what permissions deny.
#[test]
fn a_file_in_a_folder_that_takes_no_other_is_written_over_when_there_is_something_to_write() {
    let folder = Folder::new();
    folder.succeed(&["run", "scene.toml", "--virtual", "--out", "run.mcap"]);
    folder.write("none.mcap", "no log");
    std::fs::create_dir(folder.path("full")).unwrap();
    let table = folder.succeed(&["export", "run.mcap", "--topic", "/force"]);
    folder.write("full/table.csv", table.repeat(2));
    folder.write("full/page.html", "old");
    let script = "chmod 500 full
        palpate() { setpriv --bounding-set=-dac_override \"$0\" \"$@\"; echo $?; }
        palpate timing none.mcap --html full/page.html
        palpate timing none.mcap --html full/new.html
        palpate export run.mcap --topic /force --out full/table.csv
        chmod 700 full; ls -A full";
    let output = Command::new("unshare")
        .args(["-r", "sh", "-c", script, env!("CARGO_BIN_EXE_palpate")])
        .current_dir(folder.path(""))
        .output()
        .unwrap();
    let called = ended(output);
    assert_eq!(called.out, "2\n2\n0\npage.html\ntable.csv\n", "{called:?}");
    assert_eq!(std::fs::read_to_string(folder.path("full/page.html")).unwrap(), "old");
    assert_eq!(std::fs::read_to_string(folder.path("full/table.csv")).unwrap(), table);
}

#[test]
fn an_output_follows_links_keeps_permissions_and_goes_to_devices_as_it_is_written() {
    use std::os::unix::fs::PermissionsExt;
    let folder = Folder::new();
    folder.succeed(&["run", "scene.toml", "--virtual", "--out", "run.mcap"]);
    let table = folder.succeed(&["export", "run.mcap", "--topic", "/force"]);
    folder.write("table.csv", "old");
    std::fs::set_permissions(folder.path("table.csv"), std::fs::Permissions::from_mode(0o600)).unwrap();
    std::os::unix::fs::symlink("table.csv", folder.path("soft.csv")).unwrap();
    std::os::unix::fs::symlink("next.csv", folder.path("open.csv")).unwrap();
    std::os::unix::fs::symlink("other.csv", folder.path("next.csv")).unwrap();
    for (out, file) in [("soft.csv", "table.csv"), ("open.csv", "other.csv")] {
        folder.succeed(&["export", "run.mcap", "--topic", "/force", "--out", out]);
        assert_eq!(std::fs::read_to_string(folder.path(file)).unwrap(), table);
        assert!(std::fs::symlink_metadata(folder.path(out)).unwrap().is_symlink(), "{out}");
    }
    assert_eq!(std::fs::metadata(folder.path("table.csv")).unwrap().permissions().mode() & 0o777, 0o600);
    let piped = folder.succeed(&["export", "run.mcap", "--topic", "/force", "--out", "/dev/stdout"]);
    assert_eq!(piped, table);
    // Check that a refused export leaves nothing behind
    let files = folder.files();
    assert_eq!(folder.call(&["export", "run.mcap", "--topic", "/nothing", "--out", "new.csv"]).code, Some(2));
    assert_eq!(folder.files(), files);
}

#[test]
fn a_full_standard_error_changes_no_exit_code() {
    let folder = Folder::new();
    folder.succeed(&["run", "scene.toml", "--virtual", "--out", "run.mcap"]);
    let log = std::fs::read(folder.path("run.mcap")).unwrap();
    folder.write("cut.mcap", &log[..log.len() / 2]);
    // A basis that cannot be kept is a warning of the engine.
    let basis = "model = \"predictive\"\nbasis = 10\nbasis_folder = \"path.csv/a\\n\\u001bb\"";
    folder.write("basis.toml", SCENE.replace("model = \"patch\"", basis));
    let warned: &[&str] = &["run", "basis.toml", "--virtual", "--out", "basis.mcap"];
    for (args, code) in [
        (&["run", "none.toml"][..], 2),
        (&["run", "--bogus"], 2),
        (&["timing", "cut.mcap"], 0),
        (&["log", "check", "cut.mcap"], 1),
        (warned, 0),
    ] {
        let full = std::fs::OpenOptions::new().write(true).open("/dev/full").unwrap();
        let mut command = Command::new(env!("CARGO_BIN_EXE_palpate"));
        let status = command.args(args).current_dir(folder.path("")).stdout(Stdio::null()).stderr(full).status();
        assert_eq!(status.unwrap().code(), Some(code), "{args:?}");
    }
    // Check that the warning is there, and on one line for each basis
    let called = folder.call(warned);
    assert!(called.code == Some(0) && !called.err.is_empty() && !called.err.contains('\u{1b}'), "{called:?}");
    assert!(called.err.lines().all(|line| line.contains(r"path.csv/a\n")), "{called:?}");
}

// A thread that is to have a stack of 2^62 bytes is refused to anybody; the engine's own threads say what they need.
#[test]
fn what_needs_a_thread_only_to_show_progress_goes_on_without() {
    let folder = Folder::new();
    folder.succeed(&["run", "scene.toml", "--virtual", "--out", "run.mcap"]);
    let without_threads = |args: &[&str]| {
        let mut command = Command::new(env!("CARGO_BIN_EXE_palpate"));
        command.args(args).current_dir(folder.path("")).env("RUST_MIN_STACK", (1_u64 << 62).to_string());
        ended(command.output().unwrap())
    };
    for args in [&["replay", "run.mcap"][..], &["compare", "scene.toml", "--models", "hold"], &["reduce", "scene.toml"]]
    {
        let called = without_threads(args);
        assert_eq!((called.code, &*called.err), (Some(0), ""), "{args:?}: {called:?}");
    }
    // Check that a run, which could not be interrupted, is refused in a line
    let called = without_threads(&["run", "scene.toml", "--virtual", "--out", "new.mcap"]);
    assert_eq!((called.code, called.err.lines().count()), (Some(1), 1), "{called:?}");
    assert!(called.err.starts_with("error: "), "{called:?}");
}

#[test]
fn no_output_overwrites_the_mesh_of_a_body() {
    let folder = folder();
    let scenes = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("../scenes");
    folder.write("beam.msh", std::fs::read(scenes.join("meshes/cantilever.msh")).unwrap());
    folder.write("bend.csv", std::fs::read(scenes.join("paths/bend.csv")).unwrap());
    let text = std::fs::read_to_string(scenes.join("cantilever.toml")).unwrap();
    let text = text.replace("meshes/cantilever.msh", "beam.msh").replace("paths/", "");
    folder.write("cantilever.toml", text);
    let before = std::fs::read(folder.path("beam.msh")).unwrap();
    for out in ["beam.msh", "./beam.msh", "bend.csv"] {
        let called = folder.call(&["run", "cantilever.toml", "--virtual", "--out", out]);
        assert!(called.code == Some(2) && called.err.contains("is the input itself"), "{out}: {called:?}");
    }
    assert!(std::fs::read(folder.path("beam.msh")).unwrap() == before);
}
