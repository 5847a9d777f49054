//! A page that sleeps, or whose connection breaks off, comes again by itself; meanwhile the tool stays where it was.

mod visitor;

use std::time::Duration;

use visitor::{enter, enter_again, farewell_with_code, find, key, open, role, say, server, tool};

const REFUSED: u16 = 1008;

// Check that only a wrong token is a reason not to come again.
#[test]
fn a_page_that_sleeps_before_it_has_said_its_token_may_come_again() {
    let (server, token) = server();
    let origin = format!("http://{}", server.address());
    let mut asleep = open(server.address(), Some(&origin)).unwrap();
    let (code, words) = farewell_with_code(&mut asleep).unwrap();
    assert_ne!(code, REFUSED, "{words}");
    let mut awake = enter(&server, &token);
    assert_eq!(find(&mut awake, role).as_deref(), Some("hand"));
    let mut stranger = open(server.address(), Some(&origin)).unwrap();
    say(&mut stranger, r#"{"do":"enter","token":"0"}"#);
    assert_eq!(farewell_with_code(&mut stranger).unwrap().0, REFUSED);
}

#[test]
fn a_page_that_says_nothing_for_long_stays() {
    let (server, token) = server();
    let mut hidden = enter(&server, &token);
    let (begin, ..) = find(&mut hidden, tool).unwrap();
    // It reads, and says nothing.
    assert!(find(&mut hidden, |message| tool(message).filter(|tool| tool.0 > begin + 6.0)).is_some());
    say(&mut hidden, r#"{"do":"move","device":0,"to":[0.05,0.05,0.16]}"#);
    assert!(find(&mut hidden, |message| tool(message).filter(|tool| tool.2 == [0.05, 0.05, 0.16])).is_some());
}

#[test]
fn a_page_whose_connection_seems_to_be_there_takes_its_place_and_its_tool_again() {
    let (server, token) = server();
    let mut first = enter(&server, &token);
    let own = find(&mut first, key).unwrap();
    say(&mut first, r#"{"do":"move","device":0,"to":[0.05,0.05,0.16]}"#);
    let pressed = find(&mut first, |message| tool(message).filter(|tool| (tool.1[2] - 0.16).abs() < 1e-3)).unwrap();
    let mut second = enter(&server, &token);
    assert_eq!(find(&mut second, role).as_deref(), Some("watch"));

    // Nobody reads the first connection and nobody closes it: that of a phone that has left the network.
    std::thread::sleep(Duration::from_secs(2));
    let mut again = enter_again(&server, &token, &own);
    assert_eq!(find(&mut again, role).as_deref(), Some("hand"));
    let (time, place, pointer) = find(&mut again, tool).unwrap();
    assert!(time > pressed.0 + 1.5, "the same session goes on");
    assert_eq!(pointer, pressed.2);
    assert!((0..3).all(|axis| (place[axis] - pressed.1[axis]).abs() < 2e-3), "{place:?} {pressed:?}");
    assert_eq!(farewell_with_code(&mut first).map(|told| told.1).as_deref(), Some("the page has come again"));
    say(&mut again, r#"{"do":"move","device":0,"to":[0.09,0.05,0.2]}"#);
    assert!(find(&mut again, |message| tool(message).filter(|tool| tool.2 == [0.09, 0.05, 0.2])).is_some());
    assert_ne!(find(&mut second, tool), None, "who watches goes on watching");

    // A key that was used is none, and one that is guessed neither.
    for old in [own.as_str(), "", &"0".repeat(32)] {
        let mut other = enter_again(&server, &token, old);
        assert_eq!(find(&mut other, role).as_deref(), Some("watch"));
    }
}

#[test]
fn a_page_that_comes_again_needs_no_free_place() {
    let (server, token) = server();
    let mut all: Vec<_> = (0..4).map(|_| enter(&server, &token)).collect();
    let keys: Vec<_> = all.iter_mut().map(|visitor| find(visitor, key).unwrap()).collect();
    let mut again = enter_again(&server, &token, &keys[2]);
    assert_eq!(find(&mut again, role).as_deref(), Some("watch"));
    let (code, words) = farewell_with_code(&mut enter(&server, &token)).unwrap();
    assert!(code != REFUSED && words.contains("too many browsers"), "{code} {words}");
    let (code, words) = farewell_with_code(&mut enter_again(&server, "0", &keys[1])).unwrap();
    assert_eq!(code, REFUSED, "a key is no token: {words}");
}

#[test]
fn a_server_that_ends_says_so_and_a_page_waits_for_it() {
    let (server, token) = server();
    let mut visitor = enter(&server, &token);
    find(&mut visitor, tool).unwrap();
    server.stopper()();
    let (code, words) = farewell_with_code(&mut visitor).unwrap();
    assert!(code != REFUSED && words == "the server has ended", "{code} {words}");
}
