//! Who may not: garbage, half-open connections, other scenes, other versions, other machines, other keys.

mod support;

use std::io::Write;
use std::net::TcpStream;
use std::path::Path;
use std::time::{Duration, Instant};

use palpate::link::{Header, Hello, Message};
use palpate::model::local::Kind;
use palpate_link::{Access, GlobalSide, TLS_RUNTIME, make_keys};
use support::{Felt, Process, free_address, session, until};
use zenoh::{Config, Wait};

/// Both sides of every test.
#[test]
fn as_a_child() {
    support::child();
}

/// Somebody who speaks zenoh and is no palpate.
fn stranger(address: &str) -> Option<zenoh::Session> {
    let mut config = Config::default();
    for (key, value) in [
        ("mode", "\"client\"".to_owned()),
        ("connect/endpoints", format!("[\"{address}\"]")),
        ("scouting/multicast/enabled", "false".to_owned()),
    ] {
        config.insert_json5(key, &value).unwrap();
    }
    zenoh::open(config).wait().ok()
}

/// The names under which both sides send.
fn names(zenoh: &zenoh::Session) -> Vec<String> {
    let heard = zenoh.declare_subscriber("palpate/session/**").wait().unwrap();
    let mut names: Vec<String> = Vec::new();
    let began = Instant::now();
    while began.elapsed() < Duration::from_millis(500) {
        if let Ok(Some(sample)) = heard.recv_timeout(Duration::from_millis(100)) {
            let name = sample.key_expr().to_string();
            if !names.contains(&name) {
                names.push(name);
            }
        }
    }
    names
}

/// Check that nothing of what the hand feels is late, and that it feels something.
#[track_caller]
fn assert_unmoved(felt: &Felt, from: f64, until: f64) {
    assert!(felt.largest(from, until) > 0.1);
    let oldest = felt.within(from, until).max_by(|a, b| a.3.total_cmp(&b.3)).unwrap();
    assert!(oldest.3 < 0.1, "at {} s a model that was {} s old", oldest.0, oldest.3);
}

/// Packets of garbage, half of which look like messages at their beginning; [`FLOOD`] says how many.
#[test]
fn garbage_and_half_open_connections_change_nothing() {
    const FLOOD: &str = "PALPATE_LINK_FLOOD";
    let packets: usize = std::env::var(FLOOD).ok().and_then(|count| count.parse().ok()).unwrap_or(20_000);
    let seconds = 4.0 + packets as f64 / 3e4;
    let (folder, address) = (tempfile::tempdir().unwrap(), free_address());
    let _global = Process::serve(&address);
    let haptic = Process::haptic(&address, seconds, &folder.path().join("felt"));
    haptic.waits_for("began");
    let began = Instant::now();
    let zenoh = stranger(&address).unwrap();
    let names = names(&zenoh);
    assert!(!names.is_empty(), "nothing was heard of the session");
    let socket = address.strip_prefix("tcp/").unwrap();
    // They stay open, and say nothing or nonsense.
    let mut half_open: Vec<TcpStream> = (0..200).map(|_| TcpStream::connect(socket).unwrap()).collect();
    for stream in half_open.iter_mut().step_by(2) {
        let _ = stream.write_all(b"GET / HTTP/1.1\r\n\r\n");
    }
    let mut message = Vec::new();
    for n in 0..packets {
        let name = &names[n % names.len()];
        // Of epoch 0, which is none, so that nothing depends on chance.
        Message::Ping.write(Header::default(), &mut message);
        message.truncate(message.len() - n % 4);
        message.extend_from_slice(&n.to_le_bytes()[..n % 9]);
        if n % 2 == 0 {
            message[n % 8] ^= 0x5a;
        }
        zenoh.put(name.as_str(), message.as_slice()).wait().unwrap();
        if n % 100 == 0 {
            std::thread::sleep(Duration::from_millis(1));
        }
    }
    let sent = began.elapsed().as_secs_f64();
    println!("{packets} packets in {sent:.1} s");
    assert!(sent < seconds, "the run was over before the flood: {sent} s");
    // Whoever comes next is let in as soon as those who say nothing are given up.
    let began = Instant::now();
    while stranger(&address).is_none() {
        assert!(began.elapsed() < Duration::from_secs(5), "nobody is let in any more");
        std::thread::sleep(Duration::from_millis(100));
    }
    assert_unmoved(&haptic.felt(), 0.7, seconds);
    drop(half_open);
}

#[test]
fn another_scene_is_refused_by_the_line_that_differs() {
    let (folder, address) = (tempfile::tempdir().unwrap(), free_address());
    let _global = Process::serve(&address);
    let other = Process::haptic_with(&address, "-", 0.4, 1.0, &folder.path().join("felt"));
    let said = other.says();
    assert!(said.contains("the scene has `") && said.contains("0.4") && said.contains("0.5"), "{said}");
    assert!(said.starts_with("error tcp/"), "{said}");
}

#[test]
fn a_second_haptic_machine_is_refused_by_name_and_the_first_one_unmoved() {
    let (folder, address) = (tempfile::tempdir().unwrap(), free_address());
    let _global = Process::serve(&address);
    let first = Process::haptic(&address, 6.0, &folder.path().join("felt"));
    first.waits_for("began");
    let second = Process::haptic(&address, 1.0, &folder.path().join("second"));
    let said = second.says();
    assert!(said.contains("works for another haptic machine"), "{said}");
    assert_unmoved(&first.felt(), 0.7, 6.0);
}

/// Check both ways: a haptic side of another version, and a global one.
#[test]
fn another_version_is_refused_by_name() {
    let address = free_address();
    let _global = Process::serve(&address);
    let zenoh = stranger(&address).unwrap();
    let mut hello = Vec::new();
    session(Kind::Predictive, 0.5).build_global().unwrap().hello().write(&mut hello);
    let asked = |bytes: &[u8]| {
        let replies = zenoh.get("palpate/hello").payload(bytes).timeout(Duration::from_secs(5)).wait().unwrap();
        let reply = replies.recv().unwrap();
        String::from_utf8_lossy(&reply.result().unwrap().payload().to_bytes()).into_owned()
    };
    hello[4] += 1;
    let said = asked(&hello);
    assert!(said.contains(&format!("version {}, this is version {}", Hello::VERSION + 1, Hello::VERSION)), "{said}");
    assert!(asked(b"GET / HTTP/1.1").contains("no message of palpate's"));

    let listens = free_address();
    let mut config = Config::default();
    config.insert_json5("listen/endpoints", &format!("[\"{listens}\"]")).unwrap();
    config.insert_json5("scouting/multicast/enabled", "false").unwrap();
    let newer = zenoh::open(config).wait().unwrap();
    let answer = |query: zenoh::query::Query| {
        let _ = query.reply(query.key_expr().clone(), [99, 0, 1].as_slice()).wait();
    };
    let _queryable = newer.declare_queryable("palpate/hello").callback(answer).wait().unwrap();
    let global = GlobalSide::at(&listens, &Access::default()).unwrap();
    let haptic = session(Kind::Predictive, 0.5).forget_bases().duration_s(1.0).global_over(global).build().unwrap();
    let error = haptic.start().map(|_| ()).unwrap_err();
    assert!(error.to_string().contains("version 99 of the link, this is version"), "{error}");
}

#[test]
fn keys_let_in_who_has_them_and_nobody_else() {
    let folder = tempfile::tempdir().unwrap();
    let [ours, others] = ["ours", "others"].map(|name| folder.path().join(name));
    make_keys(&ours, &["big-machine.example".to_owned()]).unwrap();
    make_keys(&others, &[]).unwrap();
    let address = free_address().replace("tcp/", "tls/");
    let config = |folder: &Path, side: &str| folder.join(side).join("link.toml").display().to_string();
    let _global = Process::serve_with(&address, &config(&ours, "global"), 0.5);
    let felt = folder.path().join("felt");
    let haptic = Process::haptic_with(&address, &config(&ours, "haptic"), 0.5, 10.0, &felt);
    haptic.waits_for("began");
    until(Instant::now(), 0.5);
    // Of another authority; the answer is that there is none.
    let stranger = Process::haptic_with(&address, &config(&others, "haptic"), 0.5, 1.0, &felt);
    assert_unmoved(&haptic.felt(), 0.7, 10.0);
    let said = stranger.says();
    assert!(said.contains("does not answer"), "{said}");
    // Neither does plain TCP get in where TLS is spoken.
    let plain = address.replace("tls/", "tcp/");
    let mut config = Config::default();
    config.insert_json5("mode", "\"client\"").unwrap();
    config.insert_json5("connect/endpoints", &format!("[\"{plain}\"]")).unwrap();
    config.insert_json5("scouting/multicast/enabled", "false").unwrap();
    assert!(zenoh::open(config).wait().is_err());
}

#[test]
fn keys_are_made_once_and_are_for_their_owner_alone() {
    let folder = tempfile::tempdir().unwrap();
    make_keys(folder.path(), &[]).unwrap();
    assert!(make_keys(folder.path(), &[]).is_err(), "keys that are there stay");
    // This program was not told to read and write on one thread.
    let access = Access::read(&folder.path().join("haptic").join("link.toml")).unwrap();
    let said = GlobalSide::at("tls/127.0.0.1:7447", &access).unwrap_err().to_string();
    assert!(said.contains(TLS_RUNTIME), "{said}");
    #[cfg(unix)]
    {
        use std::os::unix::fs::PermissionsExt;
        let key = folder.path().join("global").join("global.key");
        assert_eq!(std::fs::metadata(key).unwrap().permissions().mode() & 0o777, 0o600);
    }
}
