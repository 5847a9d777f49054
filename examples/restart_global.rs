//! The global model crashes, then hangs; the haptic side does not notice, and both times a new one takes its place.
//!
//!     cargo run --release --example restart_global
//!
//! A body of the program's own panics at 1 s and stops answering at 2 s. What it needs for a restart is
//! [`Body::duplicate`]: the new global model starts from the last good state and catches up along the tool's path.

use palpate::model::Vec3;
use palpate::model::body::{Block, Body, State, TangentBlock};
use palpate::model::local::Kind as LocalModelKind;
use palpate::model::mesh::{Face, Surface};
use palpate::prelude::*;
use std::sync::{Arc, Mutex};
use std::time::{Duration, Instant};

/// When things go wrong (s): first a panic, then a call that does not return.
const FAULTS_S: [f64; 2] = [1.0, 2.0];

/// A block that fails twice, however often it is copied.
#[derive(Clone, Debug)]
struct Fragile {
    block: Block,
    faults: Arc<Mutex<usize>>,
    begun: Instant,
}

impl Fragile {
    /// Fails if it is time to; otherwise does nothing.
    fn strain(&self) {
        let mut faults = self.faults.lock().expect("nobody panics under it");
        if FAULTS_S.get(*faults).is_none_or(|&due| self.begun.elapsed().as_secs_f64() < due) {
            return;
        }
        *faults += 1;
        let panics = *faults == 1;
        drop(faults);
        assert!(!panics, "the body gave way");
        // Longer than anybody waits: the thread is left behind after two seconds.
        std::thread::sleep(Duration::from_secs(60));
    }
}

impl Body for Fragile {
    fn rest(&self) -> &[Vec3] {
        self.block.rest()
    }
    fn inverse_masses(&self) -> &[f64] {
        self.block.inverse_masses()
    }
    fn surface(&self) -> &Surface {
        self.block.surface()
    }
    fn forces(&mut self, state: &State, forces: &mut [Vec3]) {
        self.strain();
        self.block.forces(state, forces);
    }
    fn node_forces(&self, state: &State, nodes: &[u32], forces: &mut [Vec3]) {
        self.block.node_forces(state, nodes, forces);
    }
    fn tangent(&self, state: &State, nodes: &[u32], clamp: bool, emit: &mut dyn FnMut(TangentBlock)) {
        self.block.tangent(state, nodes, clamp, emit);
    }
    fn patch(&self, triangles: &[u32], size: [usize; 3], nodes: &mut Vec<u32>) {
        self.block.patch(triangles, size, nodes);
    }
    fn duplicate(&self) -> Option<Box<dyn Body>> {
        Some(Box::new(self.clone()))
    }
}

fn main() -> Result<(), Error> {
    let block = Block::builder([8; 3], [0.1; 3]).fix(Face::ZMin).build()?;
    let body = Fragile { block, faults: Arc::default(), begun: Instant::now() };
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
