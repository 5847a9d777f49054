//! A visitor pushes, changes and takes the log along; a program serves a session of its own.

mod visitor;

use palpate::log::{LogEntry, LogReader, LogRecord};
use palpate::prelude::*;
use palpate_view::{Options, Pushed};
use tungstenite::Message;
use visitor::{ask, enter, find, say, server, tool};

fn text(message: &Message) -> Option<serde_json::Value> {
    let Message::Text(text) = message else { return None };
    Some(serde_json::from_str(text).unwrap())
}

fn hello(message: &Message) -> Option<serde_json::Value> {
    text(message).filter(|message| message["kind"] == "hello")
}

#[test]
fn the_tool_goes_where_the_pointer_is_and_a_new_session_keeps_the_pointer() {
    let (server, token) = server();
    let mut visitor = enter(&server, &token);
    let first = find(&mut visitor, hello).unwrap();
    assert_eq!((first["mode"].as_str(), first["model"].as_str()), (Some("live"), Some("hold")));
    say(&mut visitor, r#"{"do":"move","device":0,"to":[0.05,0.05,0.16]}"#);
    let is_there = |position: [f32; 3]| (position[0] - 0.05).abs() < 1e-3 && (position[2] - 0.16).abs() < 1e-3;
    assert!(find(&mut visitor, |message| tool(message).filter(|tool| is_there(tool.1))).is_some());
    say(&mut visitor, r#"{"do":"change","friction":0.2}"#);
    say(&mut visitor, r#"{"do":"restart"}"#);
    let second = find(&mut visitor, hello).unwrap();
    assert_eq!((second["session"].as_u64(), second["settings"]["friction"].as_f64()), (Some(2), Some(0.2)));
    assert!(find(&mut visitor, |message| tool(message).filter(|tool| tool.2 == [0.05, 0.05, 0.16])).is_some());
    assert!(server.stop().is_some_and(|summary| summary.runtime.fault.is_none()));
}

#[test]
fn a_page_is_told_how_far_its_pointer_may_go() {
    let (server, token) = server();
    let mut visitor = enter(&server, &token);
    let hello = find(&mut visitor, hello).unwrap();
    let bound = |corner: usize, axis: usize| hello["bounds"][corner][axis].as_f64().unwrap() as f32;
    say(&mut visitor, r#"{"do":"move","device":0,"to":[900,-900,900]}"#);
    let far = [bound(1, 0), bound(0, 1), bound(1, 2)];
    assert!(find(&mut visitor, |message| tool(message).filter(|tool| tool.2 == far)).is_some());
}

#[test]
fn friction_stiffness_and_model_change_while_the_body_goes_on() {
    let (server, token) = server();
    let mut visitor = enter(&server, &token);
    let first = find(&mut visitor, hello).unwrap();
    let most = first["settings"]["stiffness_limits"][1].as_f64().unwrap();
    assert!(most > 1.0, "{first}");
    let mut last_s = 0.0;
    for (wish, name, value) in [
        (r#"{"do":"change","friction":0.25}"#.to_owned(), "friction", serde_json::json!(0.25)),
        (format!(r#"{{"do":"change","stiffness":{most}}}"#), "stiffness", serde_json::json!(most)),
        (r#"{"do":"change","model":"full"}"#.to_owned(), "model", serde_json::json!("full")),
        (r#"{"do":"change","model":"patch"}"#.to_owned(), "model", serde_json::json!("patch")),
    ] {
        say(&mut visitor, &wish);
        let mut is_set = false;
        let time_s = find(&mut visitor, |message| {
            assert_eq!(hello(message), None, "no other session begins");
            is_set |= text(message).is_some_and(|said| said["kind"] == "settings" && said["settings"][name] == value);
            tool(message).filter(|_| is_set).map(|(time_s, ..)| time_s)
        });
        assert!(time_s.unwrap() >= last_s, "the same run goes on");
        last_s = time_s.unwrap();
    }
    // What the session's steps do not bear is refused with the limit, and nothing else is changed.
    say(&mut visitor, r#"{"do":"change","stiffness":10}"#);
    let told = find(&mut visitor, |message| text(message).filter(|said| said["kind"] == "note"));
    assert!(told.unwrap()["text"].as_str().unwrap().contains(&format!("{most:.3}")), "the limit is named");
    assert!(server.stop().is_some_and(|summary| summary.runtime.fault.is_none()));
}

#[test]
fn stress_is_sent_while_somebody_looks_at_it() {
    let (server, token) = server();
    let mut visitor = enter(&server, &token);
    assert_eq!(find(&mut visitor, hello).unwrap()["has_stress"], true);
    let stress = |message: &Message| match message {
        Message::Binary(bytes) if bytes[..4] == [4, 0, 0, 0] => {
            let nodes = u32::from_le_bytes(bytes[4..8].try_into().unwrap()) as usize;
            Some((bytes.len() - 16 - 12 * nodes) / (4 * nodes))
        }
        _ => None,
    };
    assert_eq!(find(&mut visitor, stress), Some(0));
    for shown in [true, false] {
        say(&mut visitor, &format!(r#"{{"do":"stress","shown":{shown}}}"#));
        let numbers = usize::from(shown);
        assert!(find(&mut visitor, |message| stress(message).filter(|found| *found == numbers)).is_some());
    }
}

// Check that percentiles are those of the report, and not the largest value under each name.
#[test]
fn the_figures_of_a_group_are_in_order() {
    let (server, token) = server();
    let mut visitor = enter(&server, &token);
    let stats = find(&mut visitor, |message| text(message).filter(|message| message["kind"] == "stats")).unwrap();
    let local = &stats["groups"][0];
    let [p50, p99, max] = ["p50", "p99", "max"].map(|name| local["execution_us"][name].as_f64().unwrap());
    assert!(0.0 < p50 && p50 <= p99 && p99 <= max && p50 < max, "{local}");
}

#[test]
fn a_session_that_cannot_start_is_told_of_and_the_body_starts_as_it_was() {
    let folder = tempfile::tempdir().unwrap();
    // The second session has no place for its log.
    std::fs::create_dir(folder.path().join("felt-2.mcap")).unwrap();
    let pushed = Pushed::new(Scene::demo()).log(folder.path().join("felt.mcap"));
    let server = palpate_view::serve_scene(pushed, &Options::default()).unwrap();
    let token = server.url().split_once('#').unwrap().1.to_owned();
    let mut visitor = enter(&server, &token);
    assert_eq!(find(&mut visitor, hello).unwrap()["session"], 1);
    say(&mut visitor, r#"{"do":"restart"}"#);
    // What was said before the new session is read first or after it.
    let (mut again, mut told) = (None, None);
    find(&mut visitor, |message| {
        let message = text(message)?;
        match message["kind"].as_str() {
            Some("hello") => again = Some(message),
            Some("note") => {
                told = message["text"].as_str().map(str::to_owned).filter(|words| words.contains("not work"))
            }
            _ => {}
        }
        (again.is_some() && told.is_some()).then_some(())
    });
    let again = again.unwrap();
    assert_eq!((&again["session"], &again["settings"]["friction"]), (&3.into(), &0.5.into()), "{told:?}");
    assert!(told.unwrap().contains("felt-2.mcap"));
    assert!(find(&mut visitor, tool).is_some());
}

#[test]
fn the_log_of_what_was_felt_holds_what_was_shown() {
    let (server, token) = server();
    let mut visitor = enter(&server, &token);
    // The samples that a strip is drawn from.
    let shown = find(&mut visitor, |message| match message {
        Message::Binary(bytes) if bytes[..4] == [3, 0, 0, 0] => Some(bytes.clone()),
        _ => None,
    });
    let shown = shown.unwrap();
    let first_s = f64::from_le_bytes(shown[8..16].try_into().unwrap());
    let address = server.address();
    let head = format!("GET /log HTTP/1.0\r\nHost: {address}\r\nAuthorization: Bearer {token}\r\n\r\n");
    let mut stream = std::net::TcpStream::connect(address).unwrap();
    std::io::Write::write_all(&mut stream, head.as_bytes()).unwrap();
    let mut answer = Vec::new();
    std::io::Read::read_to_end(&mut stream, &mut answer).unwrap();
    let body = answer.windows(4).position(|end| end == b"\r\n\r\n").unwrap() + 4;
    let mut reader = LogReader::new(&answer[body..], "log").unwrap();
    let commands: Vec<_> = reader
        .readable()
        .filter_map(|entry| match entry {
            LogEntry::Record(LogRecord::Command(sample)) => Some(sample),
            _ => None,
        })
        .collect();
    assert_eq!(reader.damage(), None);
    assert!(commands.iter().any(|sample| (sample.time.as_secs_f64() - first_s).abs() < 1e-9), "{first_s}");
    assert!(reader.topics().get("/scene").is_some_and(|count| *count > 0), "with pictures: {:?}", reader.topics());
}

/// A session that a program starts.
fn started() -> palpate::session::Running {
    let body = Block::builder([6, 6, 6], [0.05; 3]).fix(palpate::model::mesh::Face::ZMin).build().unwrap();
    let path = ToolPath::constant([0.02, 0.02, 0.07]).unwrap();
    Session::builder(body).path(path).endless().share_records().build().unwrap().start().unwrap()
}

#[test]
fn a_session_that_cannot_be_shown_goes_on() {
    let taken = std::net::TcpListener::bind("127.0.0.1:0").unwrap();
    let options = Options { port: taken.local_addr().unwrap().port(), ..Options::default() };
    let refused = palpate_view::serve(started(), &options).unwrap_err();
    assert!(refused.to_string().contains("cannot listen"), "{refused}");
    assert!(!refused.running.finished());
    // Check that nothing of it was taken, either
    let server = palpate_view::serve(*refused.running, &Options::default()).unwrap();
    let mut visitor = enter(&server, server.url().split_once('#').unwrap().1);
    assert!(find(&mut visitor, hello).is_some_and(|hello| hello["has_samples"] == true));
    assert!(find(&mut visitor, tool).is_some());
    assert!(server.stop().is_some_and(|summary| summary.runtime.fault.is_none()));
}

#[test]
fn a_session_of_a_program_is_not_restarted_and_nobody_is_told_that_it_is() {
    let server = palpate_view::serve(started(), &Options::default()).unwrap();
    let mut visitor = enter(&server, server.url().split_once('#').unwrap().1);
    assert_eq!(find(&mut visitor, hello).unwrap()["can_restart"], false);
    say(&mut visitor, r#"{"do":"restart"}"#);
    let told = find(&mut visitor, |message| text(message).filter(|said| said["kind"] == "note"));
    let told = told.unwrap()["text"].to_string();
    assert!(told.contains("does not work") && told.contains("program"), "{told}");
    assert!(find(&mut visitor, tool).is_some());
    assert!(server.stop().is_some_and(|summary| summary.runtime.fault.is_none()));
}

#[test]
fn a_program_serves_its_own_session_in_three_lines() {
    let server = palpate_view::serve(started(), &Options::default()).unwrap();
    let token = server.url().split_once('#').unwrap().1.to_owned();
    let mut visitor = enter(&server, &token);
    let hello = find(&mut visitor, hello).unwrap();
    assert_eq!(hello["can_restart"], false);
    assert_eq!(hello["tools"][0]["pointer"], false, "a path cannot be pushed");
    assert_eq!(find(&mut visitor, tool).unwrap().1, [0.02, 0.02, 0.07]);
    let page = ask(server.address(), &format!("GET / HTTP/1.1\r\nHost: {}", server.address()));
    assert!(page.contains("default-src 'none'") && page.contains("<canvas"));
    assert!(server.stop().unwrap().runtime.fault.is_none());
}
