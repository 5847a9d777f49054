//! A log is shown as its session was.

mod visitor;

use palpate::prelude::*;
use palpate_view::Options;
use tungstenite::Message;
use visitor::{enter, find, say};

/// Place and force of the tool's contacts.
fn contacts(message: &Message) -> Option<Vec<[f32; 6]>> {
    let Message::Binary(bytes) = message else { return None };
    if bytes[..4] != [2, 0, 0, 0] {
        return None;
    }
    let numbers: Vec<f32> = bytes[24..].chunks_exact(4).map(|c| f32::from_le_bytes(c.try_into().unwrap())).collect();
    Some(numbers[17..].chunks_exact(8).map(|contact| contact[..6].try_into().unwrap()).collect())
}

#[test]
fn a_tool_that_is_a_point_shows_in_a_log_where_it_touches() {
    let folder = tempfile::tempdir().unwrap();
    let log = folder.path().join("press.mcap");
    let body = Block::builder([6, 6, 6], [0.05; 3]).fix(palpate::model::mesh::Face::ZMin).build().unwrap();
    let places = [[0.02, 0.021, 0.055], [0.02, 0.021, 0.046], [0.02, 0.021, 0.046]];
    let path = ToolPath::new(vec![0.0, 0.2, 0.4], places.to_vec()).unwrap();
    let session = Session::builder(body).path(path).duration_s(0.4).virtual_time().log(&log).log_scene();
    let running = session.build().unwrap().start().unwrap();
    running.wait();
    assert!(running.stop().runtime.fault.is_none());
    let server = palpate_view::serve_log(&log, &Options::default()).unwrap();
    let mut visitor = enter(&server, server.url().split_once('#').unwrap().1);
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
