//! A log is shown as its session was.

mod visitor;

use palpate::prelude::*;
use palpate_view::Options;
use tungstenite::Message;
use visitor::{enter, find, say};

type Visitor = tungstenite::WebSocket<std::net::TcpStream>;

/// Place and force of the tool's contacts.
fn contacts(message: &Message) -> Option<Vec<[f32; 6]>> {
    let Message::Binary(bytes) = message else { return None };
    if bytes[..4] != [2, 0, 0, 0] {
        return None;
    }
    let numbers: Vec<f32> = bytes[24..].chunks_exact(4).map(|c| f32::from_le_bytes(c.try_into().unwrap())).collect();
    Some(numbers[17..].chunks_exact(8).map(|contact| contact[..6].try_into().unwrap()).collect())
}

/// The log of a session that presses from 0.2 s on, and a visitor of it.
fn pressed(folder: &std::path::Path, haptic_hz: u32) -> (palpate_view::Server, Visitor) {
    let log = folder.join("press.mcap");
    let body = Block::builder([6, 6, 6], [0.05; 3]).fix(palpate::model::mesh::Face::ZMin).build().unwrap();
    let places = [[0.02, 0.021, 0.055], [0.02, 0.021, 0.046], [0.02, 0.021, 0.046]];
    let path = ToolPath::new(vec![0.0, 0.2, 0.4], places.to_vec()).unwrap();
    let session = Session::builder(body).path(path).local(RateGroup::hz(haptic_hz)).duration_s(0.4).virtual_time();
    let running = session.log(&log).log_scene().build().unwrap().start().unwrap();
    running.wait();
    assert!(running.stop().runtime.fault.is_none());
    let server = palpate_view::serve_log(&log, &Options::default()).unwrap();
    let visitor = enter(&server, server.url().split_once('#').unwrap().1);
    (server, visitor)
}

#[test]
fn a_tool_that_is_a_point_shows_in_a_log_where_it_touches() {
    let folder = tempfile::tempdir().unwrap();
    let (_server, mut visitor) = pressed(folder.path(), 1000);
    for (time_s, count) in [(0.02, 0), (0.39, 1)] {
        say(&mut visitor, &format!(r#"{{"do":"seek","time":{time_s}}}"#));
        let shown = find(&mut visitor, contacts).unwrap();
        assert_eq!(shown.len(), count, "{time_s} s");
        for [x, y, z, .., force] in shown {
            assert!((x - 0.02).abs() < 5e-3 && (y - 0.021).abs() < 5e-3 && (0.04..0.05).contains(&z), "{x} {y} {z}");
            assert!(force > 0.0, "{force}");
        }
    }
}

#[test]
fn a_contact_that_is_held_shows_between_the_ticks_of_a_slow_log() {
    let folder = tempfile::tempdir().unwrap();
    let (_server, mut visitor) = pressed(folder.path(), 250);
    for after_ms in [0, 1, 2, 3] {
        say(&mut visitor, &format!(r#"{{"do":"seek","time":{}}}"#, 0.36 + 1e-3 * f64::from(after_ms)));
        assert_eq!(find(&mut visitor, contacts).unwrap().len(), 1, "{after_ms} ms after a tick");
    }
}
