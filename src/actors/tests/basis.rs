//! The basis actor driven by hand: when a basis is there.

use std::path::PathBuf;

use super::*;
use crate::model::body::{Block, Body};
use crate::model::mesh::Face;
use crate::runtime::{Execution, Rate, Runtime};

const RATE: Rate = Rate::hz(50);

fn block() -> Block {
    Block::builder([6; 3], [0.1; 3]).fix(Face::ZMin).build().unwrap()
}

/// Patches at different places of the top.
fn patches() -> Vec<Vec<u32>> {
    let block = block();
    let patch = |x: usize| {
        let mut nodes = Vec::new();
        block.patch(&[block.surface().at_node(block.lattice().id([x, 2, 5]))[0]], [2, 2, 1], &mut nodes);
        nodes
    };
    vec![patch(1), patch(2), patch(4)]
}

/// How many of [`patches`] are there after each of so many releases, all wanted from the first on.
fn there(pace: Pace, folder: Option<PathBuf>, releases: u64) -> Vec<usize> {
    let mut graph = Runtime::builder(Execution::Virtual);
    let (mut wishes, wished) = graph.exchange(Wishes::default);
    let (bases, mut there) = graph.exchange(Bases::default);
    let resting = Arc::new(RestingBody::new(&block()).unwrap());
    let store = BasisStore::new(10, folder);
    let ports = BasisPorts { wishes: wished, bases };
    let mut actor = BasisActor::new(resting, store, Bases::default(), (pace, RATE.period()), ports);
    let mut release = |n| {
        let ctx = TickContext::by_hand(RATE, n);
        wishes.buffer().patches = patches();
        wishes.publish(&ctx);
        assert_eq!(actor.tick(&ctx), Outcome::Continue);
        there.refresh(&ctx);
        there.get().len()
    };
    (0..releases).map(&mut release).collect()
}

#[test]
fn bases_are_made_one_after_the_other_and_each_takes_its_time() {
    let given = |ms| Pace::Given(Nanos::from_secs_f64(ms * 1e-3));
    assert_eq!(there(given(0.0), None, 2), [3, 3]);
    // Every 20 ms: at 8, 16 and 24 ms.
    assert_eq!(there(given(8.0), None, 3), [0, 2, 3]);
    // At 45, 90 and 135 ms, or from the release after that on: one begins when the one before is there.
    assert_eq!(there(given(45.0), None, 9), [0, 0, 0, 1, 1, 2, 2, 3, 3]);
    assert_eq!(there(Pace::Measured, None, 4), [1, 2, 3, 3], "one a release");
}

#[test]
fn what_was_kept_takes_no_less() {
    let folder = tempfile::tempdir().unwrap();
    let with = |pace| there(pace, Some(folder.path().to_owned()), 8);
    for pace in [Pace::Nominal, Pace::Measured] {
        let without = there(pace, None, 8);
        assert_eq!(without.last(), Some(&3), "{pace:?}");
        let cold = with(pace);
        assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 3);
        assert_eq!((cold, with(pace)), (without.clone(), without), "{pace:?}");
    }
    let quick = RestingBody::new(&block()).unwrap();
    let nominal = Reduction::new(&quick, &patches()[0], 10).unwrap().nominal();
    assert!((1e-4..0.1).contains(&nominal), "{nominal}: it takes time");
}
