//! What a stranger or a broken browser may try: nothing of it reaches the tool, and nobody else notices.

mod visitor;

use std::io::Write;
use std::net::TcpStream;
use std::time::{Duration, Instant};

use palpate_view::Server;
use tungstenite::Message;
use visitor::{PATIENCE, ask, enter, farewell, find, open, role, say, server, tool};

/// Checks that somebody who comes now is shown pictures.
fn assert_alive(server: &Server, token: &str) {
    let (time, position, _) = find(&mut enter(server, token), tool).expect("a picture");
    assert!(time >= 0.0 && position.iter().all(|c| c.is_finite()));
}

#[test]
fn a_foreign_page_opens_no_socket_and_a_foreign_name_leads_nowhere() {
    let (server, token) = server();
    let address = server.address();
    let foreign =
        ["http://evil.example", "https://evil.example", "null", "http://127.0.0.1:1", "http://localhost.evil"];
    for origin in foreign {
        assert_eq!(open(address, Some(origin)).err().as_deref(), Some("403"), "{origin}");
    }
    assert_eq!(open(address, None).err().as_deref(), Some("403"), "nobody says where it comes from");
    for host in ["evil.example", "evil.example:80", &format!("evil.example:{}", address.port()), "127.0.0.1:1"] {
        for path in ["/", "/socket", "/log"] {
            let answer = ask(address, &format!("GET {path} HTTP/1.1\r\nHost: {host}\r\nAuthorization: Bearer {token}"));
            assert!(answer.starts_with("HTTP/1.1 421 "), "{host} {path}: {answer}");
        }
    }
    assert_alive(&server, &token);
}

#[test]
fn without_the_token_nothing_is_shown() {
    let (server, token) = server();
    let address = server.address();
    let origin = format!("http://{address}");
    for text in [
        r#"{"do":"enter","token":""}"#.to_owned(),
        format!(r#"{{"do":"enter","token":"{}"}}"#, &token[1..]),
        format!(r#"{{"do":"enter","token":"{}"}}"#, "0".repeat(32)),
        r#"{"do":"move","device":0,"to":[0,0,0]}"#.to_owned(),
        token.clone(),
    ] {
        let mut socket = open(address, Some(&origin)).unwrap();
        say(&mut socket, &text);
        assert_eq!(farewell(&mut socket).as_deref(), Some("the address lacks its token"), "{text}");
    }
    for head in ["", "\r\nAuthorization: Bearer x", "\r\nAuthorization: Basic eDp4"] {
        let answer = ask(address, &format!("GET /log HTTP/1.1\r\nHost: {address}{head}"));
        assert!(answer.starts_with("HTTP/1.1 403 "), "{answer}");
    }
    let page = ask(address, &format!("GET / HTTP/1.1\r\nHost: {address}"));
    assert!(page.starts_with("HTTP/1.1 200 ") && !page.contains(&token), "the page does not hold it");
}

#[test]
fn nothing_that_is_asked_for_names_a_file() {
    let (server, token) = server();
    let address = server.address();
    for path in
        ["/../Cargo.toml", "/etc/passwd", "/%2e%2e/Cargo.toml", "/log/../x", "/log?file=/etc/passwd", "//log", "*"]
    {
        let head = format!("GET {path} HTTP/1.1\r\nHost: {address}\r\nAuthorization: Bearer {token}");
        let answer = ask(address, &head);
        assert!(answer.starts_with("HTTP/1.1 404 ") || answer.is_empty(), "{path}: {answer}");
    }
    for method in ["POST", "PUT", "DELETE", "OPTIONS", "TRACE"] {
        let answer = ask(address, &format!("{method} / HTTP/1.1\r\nHost: {address}"));
        assert!(answer.starts_with("HTTP/1.1 405 "), "{method}: {answer}");
    }
    assert_alive(&server, &token);
}

#[test]
fn a_thousand_connections_leave_a_visitor_alone_and_the_next_one_a_place() {
    let (server, token) = server();
    let mut visitor = enter(&server, &token);
    let (before, ..) = find(&mut visitor, tool).unwrap();
    // Some say nothing, some half of something.
    let crowd: Vec<TcpStream> = (0..1000)
        .filter_map(|n| {
            let mut stream = TcpStream::connect(server.address()).ok()?;
            let _ = stream.write_all(if n % 2 == 0 { b"" } else { b"GET /socket HTTP/1.1\r\nHost: x" });
            Some(stream)
        })
        .collect();
    assert!(crowd.len() > 900, "{}", crowd.len());
    let after = find(&mut visitor, |message| tool(message).map(|tool| tool.0).filter(|time| *time > before + 0.5));
    assert!(after.is_some(), "pictures go on");
    // The crowd stays connected; who says nothing loses its place.
    let begin = Instant::now();
    let page = loop {
        let page = ask(server.address(), &format!("GET / HTTP/1.1\r\nHost: {}", server.address()));
        if !page.is_empty() || begin.elapsed() > PATIENCE {
            break page;
        }
        std::thread::sleep(Duration::from_millis(100));
    };
    assert!(page.starts_with("HTTP/1.1 200 "), "{page}");
    drop(crowd);
    assert_alive(&server, &token);
}

#[test]
fn only_so_many_visitors_are_shown_anything() {
    let (server, token) = server();
    let mut visitors: Vec<_> = (0..4).map(|_| enter(&server, &token)).collect();
    assert!(visitors.iter_mut().all(|visitor| find(visitor, tool).is_some()));
    let mut fifth = enter(&server, &token);
    assert_eq!(farewell(&mut fifth).as_deref(), Some("too many browsers, close one"));
    drop(visitors.pop());
    let begin = Instant::now();
    while find(&mut enter(&server, &token), tool).is_none() {
        assert!(begin.elapsed() < PATIENCE, "the place of one that went stays taken");
    }
}

#[test]
fn messages_that_are_long_wrong_or_too_many_end_their_own_connection() {
    let (server, token) = server();
    let long = "x".repeat(1 << 20);
    let flood = r#"{"do":"move","device":0,"to":[0.03,0.05,0.2]}"#;
    for (message, words) in [
        (Message::Text(long.clone().into()), "that message is too long"),
        (Message::Binary(long.into_bytes().into()), "that message is too long"),
        (Message::Binary(vec![1, 2, 3].into()), "that is no message of the page"),
        (Message::Text(r#"{"do":"open","path":"/etc/passwd"}"#.into()), "that is no message of the page"),
        (Message::Text(flood.into()), "too many messages"),
    ] {
        let mut visitor = enter(&server, &token);
        find(&mut visitor, tool).expect("it is let in");
        let count = if words == "too many messages" { 5000 } else { 1 };
        // The server may go before all is sent.
        let sent = (0..count).take_while(|_| visitor.send(message.clone()).is_ok()).count();
        let told = farewell(&mut visitor);
        assert!(
            told.as_deref() == Some(words) || (told.is_none() && (sent < count || words.ends_with("long"))),
            "{told:?}"
        );
    }
    assert_alive(&server, &token);
}

// Check that neither many fragments at once nor one byte after the other keeps a connection.
#[test]
fn fragments_without_an_end_keep_nobody_out() {
    const FIRST: [u8; 6] = [0x01, 0x80, 0, 0, 0, 0];
    const NEXT: [u8; 6] = [0x00, 0x80, 0, 0, 0, 0];
    let (server, token) = server();
    let address = server.address();
    let origin = format!("http://{address}");
    // Fifteen that do not know the token, and one that does.
    let mut sockets: Vec<_> = (0..15).map(|_| open(address, Some(&origin)).unwrap()).collect();
    sockets.insert(0, enter(&server, &token));
    let begin = Instant::now();
    std::thread::scope(|scope| {
        for (number, socket) in sockets.iter().enumerate() {
            let mut pieces = FIRST.into_iter().chain(NEXT.into_iter().cycle());
            let (size, pause) =
                if number % 2 == 0 { (NEXT.len() << 7, Duration::ZERO) } else { (1, Duration::from_millis(2)) };
            scope.spawn(move || {
                while socket.get_ref().write_all(&pieces.by_ref().take(size).collect::<Vec<_>>()).is_ok() {
                    assert!(begin.elapsed() < Duration::from_secs(10), "connection {number} stays");
                    std::thread::sleep(pause);
                }
            });
        }
    });
    let page = ask(address, &format!("GET / HTTP/1.1\r\nHost: {address}"));
    assert!(page.starts_with("HTTP/1.1 200 "), "{page}");
    assert_alive(&server, &token);
}

#[test]
fn no_number_that_is_none_moves_the_tool() {
    let (server, token) = server();
    let mut watcher = enter(&server, &token);
    let (_, home, target) = find(&mut watcher, tool).unwrap();
    drop(watcher);
    for place in
        ["NaN,0,0", "0,Infinity,0", "1e308,0,0", "0,0,-1e308", "1e999,0,0", "null,0,0", "\"0\",0,0", "0,0", "0,0,0,0"]
    {
        let mut visitor = enter(&server, &token);
        // The place of the one before may be taken still: who watches moves nothing anyway.
        let begin = Instant::now();
        while find(&mut visitor, role).as_deref() != Some("hand") {
            assert!(begin.elapsed() < PATIENCE);
        }
        say(&mut visitor, &format!(r#"{{"do":"move","device":0,"to":[{place}]}}"#));
        assert_eq!(farewell(&mut visitor).as_deref(), Some("that is no message of the page"), "{place}");
    }
    let mut visitor = enter(&server, &token);
    let (_, position, pointer) = find(&mut visitor, tool).unwrap();
    assert_eq!(pointer, target, "the pointer is where it was");
    assert!(position.iter().zip(home).all(|(now, then)| (now - then).abs() < 1e-3), "{position:?} {home:?}");
    // A place that is one and far away is as far as the room around the body goes.
    say(&mut visitor, r#"{"do":"move","device":0,"to":[900,0.05,0.2]}"#);
    let far =
        find(&mut visitor, |message| tool(message).map(|tool| tool.2).filter(|pointer| pointer[0] > 0.1)).unwrap();
    assert!(far[0] < 0.3, "{far:?}");
    say(&mut visitor, r#"{"do":"move","device":99,"to":[0,0,0]}"#);
    assert!(find(&mut visitor, tool).is_some(), "a device that there is not is nobody's");
}

#[test]
fn who_goes_without_a_word_or_stops_in_the_middle_of_one_is_forgotten() {
    let (server, token) = server();
    for _ in 0..20 {
        let visitor = enter(&server, &token);
        // Gone without a close of the WebSocket; and one that begins a message and never ends it.
        let mut stream = visitor.get_ref().try_clone().unwrap();
        drop(visitor);
        let _ = stream.write_all(&[0x81, 0xFE]);
    }
    let begin = Instant::now();
    while find(&mut enter(&server, &token), tool).is_none() {
        assert!(begin.elapsed() < PATIENCE, "their places stay taken");
    }
}

/// Stops reading for `span`, beside somebody who reads.
fn stall(span: Duration) {
    let (server, token) = server();
    let mut stalled = enter(&server, &token);
    let (before, ..) = find(&mut stalled, tool).unwrap();
    let mut visitor = enter(&server, &token);
    let reads_until = before + span.as_secs_f64();
    // Second by second: no picture is waited for longer than another.
    for second in 1..=span.as_secs() {
        let until = before + second as f64;
        let went_on = find(&mut visitor, |message| tool(message).map(|tool| tool.0).filter(|time| *time > until));
        assert!(went_on.is_some(), "nobody waits for it");
    }
    // What the system's buffers hold is old; what follows is the newest.
    let newest = find(&mut stalled, |message| tool(message).map(|tool| tool.0).filter(|time| *time > reads_until));
    assert!(newest.is_some(), "it is shown the newest when it reads again");
}

#[test]
fn a_browser_that_stops_reading_costs_nobody_anything_and_gets_the_newest_later() {
    stall(Duration::from_secs(4));
}

#[test]
#[ignore = "takes a minute"]
fn a_browser_that_stops_reading_for_a_minute_costs_nobody_anything() {
    stall(Duration::from_secs(60));
}

#[test]
fn a_second_visitor_watches_until_the_first_has_gone() {
    let (server, token) = server();
    let mut first = enter(&server, &token);
    assert_eq!(find(&mut first, role).as_deref(), Some("hand"));
    let mut second = enter(&server, &token);
    assert_eq!(find(&mut second, role).as_deref(), Some("watch"));
    say(&mut second, r#"{"do":"move","device":0,"to":[0.09,0.05,0.2]}"#);
    say(&mut second, r#"{"do":"change","friction":0.1}"#);
    say(&mut second, r#"{"do":"restart"}"#);
    let (begin, _, pointer) = find(&mut second, tool).unwrap();
    let later = find(&mut second, |message| tool(message).filter(|tool| tool.0 > begin + 0.5)).unwrap();
    assert_eq!(later.2, pointer, "it moves nothing and starts nothing anew");
    drop(first);
    assert_eq!(find(&mut second, role).as_deref(), Some("hand"));
    say(&mut second, r#"{"do":"move","device":0,"to":[0.09,0.05,0.2]}"#);
    assert!(find(&mut second, |message| tool(message).filter(|tool| tool.2 == [0.09, 0.05, 0.2])).is_some());
}
