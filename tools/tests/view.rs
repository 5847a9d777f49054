//! `palpate view`: what it takes, what it prints and how it ends; and scenes with a pointer in other commands.

mod support;

use std::io::{BufRead, BufReader, Read, Write};
use std::net::{TcpListener, TcpStream};
use std::process::{Command, Stdio};

use support::Folder;

#[test]
fn it_prints_an_address_that_answers_and_ends_in_order() {
    let folder = Folder::new();
    let mut view = Command::new(env!("CARGO_BIN_EXE_palpate"))
        .args(["view", "scene.toml", "--no-browser", "--out", "felt.mcap"])
        .current_dir(folder.path("."))
        .stdout(Stdio::piped())
        .spawn()
        .unwrap();
    let mut out = BufReader::new(view.stdout.take().unwrap());
    let mut line = String::new();
    out.read_line(&mut line).unwrap();
    let (address, token) = line.trim().rsplit_once("http://").unwrap().1.split_once("/#").unwrap();
    assert!(line.starts_with("scene.toml: ") && token.len() == 32, "{line}");
    let mut stream = TcpStream::connect(address).unwrap();
    stream.write_all(format!("GET / HTTP/1.1\r\nHost: {address}\r\n\r\n").as_bytes()).unwrap();
    let mut page = String::new();
    stream.read_to_string(&mut page).unwrap();
    assert!(page.starts_with("HTTP/1.1 200 OK") && page.contains("scene.toml"), "{page}");
    let ended = Command::new("kill").args(["-INT", &view.id().to_string()]).status().unwrap();
    assert!(ended.success());
    let mut report = String::new();
    out.read_to_string(&mut report).unwrap();
    assert_eq!(view.wait().unwrap().code(), Some(0), "{report}");
    assert!(report.contains("served by"), "{report}");
    // The log of it has the pictures that the page plays.
    assert!(folder.succeed(&["log", "info", "felt.mcap"]).contains("/scene"));
}

#[test]
fn what_cannot_be_shown_is_refused_in_one_line() {
    let folder = Folder::new();
    folder.succeed(&["run", "scene.toml", "--virtual", "--duration", "0.1", "--out", "plain.mcap"]);
    let taken = TcpListener::bind("127.0.0.1:0").unwrap();
    let port = taken.local_addr().unwrap().port().to_string();
    for (args, code, words) in [
        (&["view", "none.toml"][..], 2, "none.toml"),
        (&["view", "plain.mcap"], 2, "--log-scene"),
        (&["view", "plain.mcap", "--model", "hold"], 2, "--model is for scenes"),
        (&["view", "scene.toml", "--model", "best"], 2, "the local models are"),
        (&["view", "scene.toml", "--listen", "somewhere"], 2, "somewhere"),
        (&["view", "scene.toml", "--out", "scene.toml"], 2, "scene.toml"),
        (&["view", "scene.toml", "--port", &port, "--no-browser"], 1, "cannot listen"),
    ] {
        let called = folder.call(args);
        assert_eq!((called.code, called.err.lines().count()), (Some(code), 1), "{args:?}: {called:?}");
        assert!(called.err.contains(words), "{args:?}: {called:?}");
    }
}

#[test]
fn a_scene_with_a_pointer_runs_and_is_executed_again_bit_for_bit() {
    let folder = Folder::new();
    folder.spoil("path_csv = \"path.csv\"", "kind = \"pointer\"");
    folder.succeed(&["run", "scene.toml", "--virtual", "--duration", "0.3", "--out", "run.mcap"]);
    folder.succeed(&["replay", "run.mcap"]);
    folder.spoil("[device]", "[device]\nkind = \"pointer\"");
    let called = folder.call(&["run", "scene.toml", "--virtual"]);
    assert_eq!(called.code, Some(2), "{called:?}");
    assert!(called.err.contains("device.path_csv"), "{called:?}");
}
