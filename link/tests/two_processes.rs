//! Two processes over loopback: the force of the virtual link, and a safe one whatever becomes of either process or of what comes.

mod support;

use std::time::Instant;

use palpate::model::Vec3;
use palpate::model::local::Kind;
use palpate::scene::LinkSpec;
use support::{Felt, Process, free_address, session, until};

/// Both sides of every test.
#[test]
fn as_a_child() {
    support::child();
}

struct Pair {
    folder: tempfile::TempDir,
    address: String,
    global: Option<Process>,
    haptic: Process,
    began: Instant,
}

impl Pair {
    /// Both sides at work, for so many seconds.
    fn start(seconds: f64) -> Self {
        let (folder, address) = (tempfile::tempdir().unwrap(), free_address());
        let global = Some(Process::serve(&address));
        let haptic = Process::haptic(&address, seconds, &folder.path().join("felt"));
        haptic.waits_for("began");
        Self { folder, address, global, haptic, began: Instant::now() }
    }

    fn global(&self) -> &Process {
        self.global.as_ref().expect("it serves")
    }
}

#[test]
fn the_force_is_that_of_the_virtual_link() {
    let felt = Pair::start(2.5).haptic.felt();
    let link = LinkSpec { delay_ms: 0.5, ..LinkSpec::default() };
    let simulated = session(Kind::Predictive, 0.5).link(link).virtual_time().keep_records().duration_s(2.5);
    let simulated = Felt::of(&simulated.build().unwrap().run().unwrap());
    let peak = simulated.ticks.iter().map(|tick| Vec3::from(tick.2).norm()).fold(0.0, f64::max);
    assert!(peak > 0.2 && felt.ticks.len() > 1500, "{peak} N, {} ticks", felt.ticks.len());
    let at = |time: f64| (time * 1e3).round() as usize;
    let there =
        |tick: &&(f64, f64, [f64; 3], f64)| simulated.ticks.get(at(tick.0).wrapping_sub(1)).map(|other| other.2);
    let apart: Vec<f64> = felt
        .ticks
        .iter()
        .filter_map(|tick| Some((Vec3::from(tick.2) - Vec3::from(there(&tick)?)).norm_squared()))
        .collect();
    let rms = (apart.iter().sum::<f64>() / apart.len() as f64).sqrt() / peak;
    println!("{:.3} % of {peak:.2} N apart", 100.0 * rms);
    assert!(rms < 0.02, "{rms}");
}

#[test]
fn a_global_side_that_is_killed_takes_the_force_away_and_another_one_gives_it_back_within_a_second() {
    let mut pair = Pair::start(5.0);
    until(pair.began, 1.5);
    pair.global = None;
    until(pair.began, 2.8);
    pair.global = Some(Process::serve(&pair.address));
    let back = pair.began.elapsed().as_secs_f64();
    let felt = pair.haptic.felt();
    assert!(felt.largest(1.0, 1.5) > 0.1, "a force before");
    assert_eq!(felt.largest(2.0, 2.8), 0.0, "none by the age limit");
    assert!(felt.largest(back, back + 1.0) > 0.05, "back within a second of {back} s");
    assert!(felt.largest(back + 1.0, 5.0) > 0.1);
}

#[test]
fn a_global_side_that_stands_still_takes_the_force_away_until_it_goes_on() {
    for stopped in [0.8, 3.0] {
        let pair = Pair::start(3.2 + stopped);
        until(pair.began, 1.5);
        pair.global().signal("STOP");
        until(pair.began, 1.5 + stopped);
        pair.global().signal("CONT");
        let back = pair.began.elapsed().as_secs_f64();
        let felt = pair.haptic.felt();
        assert_eq!(felt.largest(2.0, 1.5 + stopped), 0.0, "none by the age limit");
        assert!(felt.largest(back, back + 1.0) > 0.05, "back within a second of {back} s");
    }
}

#[test]
fn a_haptic_side_that_stands_still_or_is_killed_harms_nobody() {
    let pair = Pair::start(5.0);
    until(pair.began, 1.5);
    pair.haptic.signal("STOP");
    until(pair.began, 2.7);
    pair.haptic.signal("CONT");
    let back = pair.began.elapsed().as_secs_f64();
    let felt = pair.haptic.felt();
    assert!(felt.within(1.6, 2.6).count() < 200, "it stood still");
    assert!(felt.largest(back, back + 1.0) > 0.05, "back within a second of {back} s");
    // Killed in the midst of its run, and another one at once.
    let again = Process::haptic(&pair.address, 9.0, &pair.folder.path().join("again"));
    again.waits_for("began");
    until(Instant::now(), 1.0);
    drop(again);
    let last = Process::haptic(&pair.address, 2.0, &pair.folder.path().join("last"));
    last.waits_for("began");
    assert!(last.felt().largest(1.0, 2.0) > 0.1);
}
