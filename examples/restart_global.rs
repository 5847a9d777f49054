//! The global model crashes, then hangs; the haptic side does not notice, and both times a new one takes its place.
//!
//!     cargo run --release --example restart_global
//!
//! A body of the program's own panics at 1 s and stops answering at 2 s. What it needs for a restart is
//! [`Body::duplicate`]: the new global model starts from the last good state and catches up along the tool's path.

#[path = "common/altered_block.rs"]
mod altered_block;

use altered_block::AlteredBlock;
use palpate::model::body::{Block, Body};
use palpate::model::local::Kind as LocalModelKind;
use palpate::model::mesh::Face;
use palpate::prelude::*;
use std::sync::{Arc, Mutex};
use std::time::{Duration, Instant};

/// When things go wrong (s): first a panic, then a call that does not return.
const FAULTS_S: [f64; 2] = [1.0, 2.0];

/// Fails if it is time to; otherwise does nothing.
fn strain(faults: &Mutex<usize>, begun: Instant) {
    let mut faults = faults.lock().expect("nobody panics under it");
    if FAULTS_S.get(*faults).is_none_or(|&due| begun.elapsed().as_secs_f64() < due) {
        return;
    }
    *faults += 1;
    let panics = *faults == 1;
    drop(faults);
    assert!(!panics, "the body gave way");
    // Longer than anybody waits: the thread is left behind after two seconds.
    std::thread::sleep(Duration::from_secs(60));
}

fn main() -> Result<(), Error> {
    let block = Block::builder([8; 3], [0.1; 3]).fix(Face::ZMin).build()?;
    // It fails twice, however often it is copied.
    let (faults, begun) = (Arc::<Mutex<usize>>::default(), Instant::now());
    let body = AlteredBlock::new(block, move |block, state, forces| {
        strain(&faults, begun);
        block.forces(state, forces);
    });
    let body = body.with_copies();
    let path =
        ToolPath::new(vec![0.0, 0.1, 10.0], vec![[0.05, 0.05, 0.101], [0.05, 0.05, 0.092], [0.06, 0.05, 0.092]])?;
    // Named, because a body of this size would be chosen to run whole at 1 kHz, without a global model to lose.
    let session = Session::builder(body).path(path).model(LocalModelKind::Patch).friction(0.5).duration_s(5.5);
    let mut running = session.build()?.start()?;
    if let Some(mut viewer) = running.take_viewer() {
        println!("  t (s)   force (N)   age of the global model's last result (ms)");
        while !running.finished() {
            running.wait_for(Duration::from_millis(250));
            let (tool, surface) = (viewer.tool(), viewer.surface().time);
            let age = tool.time.saturating_sub(surface).as_secs_f64() * 1e3;
            println!("{:7.2}   {:9.3}   {age:6.0}", tool.time.as_secs_f64(), tool.commanded_force.norm());
        }
    }
    println!("\n{}", running.stop());
    Ok(())
}
