//! The local actor driven by hand: what it does about periods that were skipped.

use super::*;
use crate::devices::DeviceState;
use crate::log::{JoinedRecords, LogRecord};
use crate::model::body::{Block, Body, State};
use crate::model::contact::{Law, ToolMotion};
use crate::model::local::Blend;
use crate::model::local::{Full, Hold};
use crate::model::mesh::Face;
use crate::model::simulation::{Simulation, Stepping};
use crate::runtime::{Execution, Runtime};

const HAPTIC: Rate = Rate::hz(1000);

/// A block of 6^3 nodes, 2 cm apart, held at the bottom.
fn block() -> Block {
    let block = Block::builder([6; 3], [0.1; 3]).node_mass(0.5e-3).stiffness(30.0).damping_ratio(0.3);
    block.fix(Face::ZMin).build().unwrap()
}

/// A node in the middle of the top.
fn top() -> u32 {
    block().lattice().id([3, 3, 5])
}

fn bits(force: [f64; 3]) -> [u64; 3] {
    force.map(f64::to_bits)
}

/// A local actor driven by hand, so that periods can be skipped at will.
struct ByHand {
    actor: LocalActor,
    samples: crate::runtime::Writer<DeviceSample>,
    commands: crate::runtime::Reader<ComputedForce>,
    drain: crate::runtime::RecordDrain,
    /// The same body, ticked directly.
    simulation: Simulation,
}

fn glued_simulation() -> Simulation {
    let (body, node) = (block(), top());
    let triangle = body.surface().at_node(node)[0];
    let corners = body.surface().triangles[triangle as usize];
    let contact = Contact::glued(triangle, corners.map(|corner| f64::from(u8::from(corner == node))));
    let state = State::at_rest(body.rest());
    Simulation::new(Box::new(body), state, contact, Law::default(), Stepping { tick: 1e-3, substeps: 2 }).unwrap()
}

impl ByHand {
    fn new() -> Self {
        let mut graph = Runtime::builder(Execution::Virtual);
        let drain = graph.drain();
        let (samples, sample_reader) = graph.exchange(DeviceSample::default);
        let (commands, command_reader) = graph.exchange(ComputedForce::default);
        let (surface, _) = graph.outlet(SurfaceView::default);
        let ports = LocalPorts {
            samples: sample_reader,
            commands,
            source: ModelSource::Alone(vec![surface]),
            recorder: graph.recorder(256),
        };
        let spare = || Box::new(Hold::default()) as Box<dyn LocalModel>;
        let full = Box::new(Full::new(glued_simulation()));
        let models = Succession::new([full, spare(), spare()], Blend::default(), Pose::default());
        let actor = LocalActor::new(models, HAPTIC, Rate::hz(30), Vec::new(), ports);
        Self { actor, samples, commands: command_reader, drain, simulation: glued_simulation() }
    }

    /// Release `n` with the tool at `position`; gives the force row that it wrote.
    fn release(&mut self, n: u64, position: Vec3) -> Option<ForceSample> {
        let ctx = TickContext::by_hand(HAPTIC, n);
        *self.samples.buffer() = DeviceSample { id: 1, state: DeviceState { position, ..DeviceState::default() } };
        self.samples.publish(&ctx);
        assert_eq!(self.actor.tick(&ctx), Outcome::Continue);
        let mut records = Vec::new();
        self.drain.drain(&mut records);
        let mut joined = JoinedRecords::default();
        let rows: Vec<ForceSample> = records
            .iter()
            .filter_map(|record| match joined.read(record) {
                Some(LogRecord::Force(row)) => Some(row),
                _ => None,
            })
            .collect();
        assert!(rows.len() <= 1, "one row per release at most");
        rows.first().copied()
    }
}

#[test]
fn skipped_periods_are_made_up_with_the_tool_interpolated_and_eight_ticks_a_release_at_most() {
    let mut hand = ByHand::new();
    let rest = block().rest()[top() as usize];
    let tool = |n: u64| rest - Vec3::z() * (n as f64 * 1e-4);
    assert_eq!(hand.release(0, tool(0)), None);
    let mut simulated = 0;
    let mut at = rest;
    // Releases that come on time, after 4 skipped periods, after 20, and then on time until all is made up.
    for n in [1, 2, 3, 8, 9, 30, 31, 32, 33, 34, 60, 61, 62, 63, 64] {
        let row = hand.release(n, tool(n)).unwrap();
        let ticks = (n - simulated).min(8);
        let mut force = Vec3::zeros();
        for k in 0..ticks {
            let next = at + (tool(n) - at) / (n - simulated - k) as f64;
            force = hand.simulation.tick(ToolMotion::straight(at, next)).force;
            at = next;
        }
        simulated += ticks;
        assert_eq!(row.time, HAPTIC.release(simulated), "release {n}");
        assert_eq!(bits(row.force_n), bits(force.into()), "release {n}");
        assert!(hand.commands.refresh(&TickContext::by_hand(HAPTIC, n)));
        let command = hand.commands.get();
        assert_eq!((command.time, command.position), (row.time, at), "release {n}");
    }
    assert_eq!(simulated, 64, "simulated time has caught up");
    assert!((at - tool(64)).norm() < 1e-12);
}
