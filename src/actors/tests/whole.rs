//! The actor of the whole body driven by hand: what it does about periods that were skipped, and about several tools.

use super::*;
use crate::actors::messages::{ComputedForce, DeviceSample};
use crate::actors::tool::LocalToolPorts;
use crate::devices::DeviceState;
use crate::log::{ForceSample, JoinedRecords, LogRecord};
use crate::model::body::{Block, Body, State, Stiffness};
use crate::model::contact::{Contact, Law};
use crate::model::mesh::Face;
use crate::model::simulation::Stepping;
use crate::runtime::{Execution, Reader, RecordDrain, Runtime, Writer};

const HAPTIC: Rate = Rate::hz(1000);
const TOOLS: usize = 2;

/// A block of 6^3 nodes, 2 cm apart, held at the bottom.
fn block() -> Block {
    let block = Block::builder([6; 3], [0.1; 3]).node_mass(0.5e-3).stiffness(30.0).damping_ratio(0.3);
    block.fix(Face::ZMin).build().unwrap()
}

/// Two nodes of the top that share springs.
fn glued_to() -> [u32; TOOLS] {
    [[3, 3, 5], [2, 3, 5]].map(|node| block().lattice().id(node))
}

fn bits(force: [f64; 3]) -> [u64; 3] {
    force.map(f64::to_bits)
}

fn glued_simulation() -> Simulation {
    let (body, stepping) = (block(), Stepping { tick: 1e-3, substeps: 2 });
    let [first, second] = glued_to().map(|node| {
        let triangle = body.surface().at_node(node)[0];
        let corners = body.surface().triangles[triangle as usize];
        Contact::glued(triangle, corners.map(|corner| f64::from(u8::from(corner == node))))
    });
    let state = State::at_rest(body.rest());
    Simulation::new(Box::new(body), state, first, Law::default(), stepping).unwrap().with_tool(second)
}

/// What is left of the ports of a tool.
struct Ends {
    samples: Writer<DeviceSample>,
    commands: Reader<ComputedForce>,
}

/// An actor driven by hand, so that periods can be skipped at will.
struct ByHand {
    actor: WholeActor,
    ends: Vec<Ends>,
    drain: RecordDrain,
    /// The same body, ticked directly.
    simulation: Simulation,
}

impl ByHand {
    fn new() -> Self {
        let mut graph = Runtime::builder(Execution::Virtual);
        let drain = graph.drain();
        let mut tool = |number| {
            let (samples, sample_reader) = graph.exchange(DeviceSample::default);
            let (commands, command_reader) = graph.exchange(ComputedForce::default);
            let ports = LocalToolPorts { samples: sample_reader, commands, recorder: graph.recorder(256) };
            let tool = LocalTool::new(number, HAPTIC, Vec::new(), None, ports);
            (tool, Ends { samples, commands: command_reader })
        };
        let (tools, ends) = (0..TOOLS as u16).map(&mut tool).unzip();
        let (surface, _) = graph.outlet(SurfaceView::default);
        let settings = Settings { friction: 0.0.into(), stiffness: Stiffness::default(), model: Kind::Full };
        let settings = graph.parameter(settings).reader();
        let actor = WholeActor::new(glued_simulation(), tools, [HAPTIC, Rate::hz(30)], vec![surface], settings);
        Self { actor, ends, drain, simulation: glued_simulation() }
    }

    /// Release `n` with the tools at `positions`; gives the force row of each.
    fn release(&mut self, n: u64, positions: [Vec3; TOOLS]) -> [Option<ForceSample>; TOOLS] {
        let ctx = TickContext::by_hand(HAPTIC, n);
        for (ends, position) in self.ends.iter_mut().zip(positions) {
            *ends.samples.buffer() = DeviceSample { id: 1, state: DeviceState { position, ..DeviceState::default() } };
            ends.samples.publish(&ctx);
        }
        assert_eq!(self.actor.tick(&ctx), Outcome::Continue);
        let (mut records, mut joined) = (Vec::new(), JoinedRecords::default());
        self.drain.drain(&mut records);
        let mut rows = [None; TOOLS];
        for record in &records {
            if let Some(LogRecord::Force(row)) = joined.read(record) {
                let before = rows[usize::from(row.device)].replace(row);
                assert!(before.is_none(), "one row of a tool per release at most");
            }
        }
        rows
    }
}

// Check that every tool feels what it does where the body is ticked directly with all of them, in every bit.
#[test]
fn skipped_periods_are_made_up_with_the_tools_interpolated_and_eight_ticks_a_release_at_most() {
    let mut hand = ByHand::new();
    let rest = glued_to().map(|node| block().rest()[node as usize]);
    let tools = |n: u64| [rest[0] - Vec3::z() * (n as f64 * 1e-4), rest[1] + Vec3::x() * (n as f64 * 5e-5)];
    assert_eq!(hand.release(0, tools(0)), [None; TOOLS]);
    let (mut simulated, mut at) = (0, rest);
    // Releases that come on time, after 4 skipped periods, after 20, and then on time until all is made up.
    for n in [1, 2, 3, 8, 9, 30, 31, 32, 33, 34, 60, 61, 62, 63, 64] {
        let rows = hand.release(n, tools(n));
        let ticks = (n - simulated).min(8);
        for k in 0..ticks {
            let left = (n - simulated - k) as f64;
            let next: [Vec3; TOOLS] = std::array::from_fn(|tool| at[tool] + (tools(n)[tool] - at[tool]) / left);
            hand.simulation.tick_all(&[0, 1].map(|tool| ToolMotion::straight(at[tool], next[tool])));
            at = next;
        }
        simulated += ticks;
        for (tool, row) in rows.into_iter().enumerate() {
            let (row, force) = (row.unwrap(), hand.simulation.force(tool));
            assert!(force.norm() > 0.0, "release {n}");
            assert_eq!(row.time, HAPTIC.release(simulated), "release {n}");
            assert_eq!(bits(row.force_n), bits(force.into()), "release {n}, tool {tool}");
            assert!(hand.ends[tool].commands.refresh(&TickContext::by_hand(HAPTIC, n)));
            let command = hand.ends[tool].commands.get();
            assert_eq!((command.time, command.position), (row.time, at[tool]), "release {n}");
            assert_eq!(bits(command.force.into()), bits(row.force_n), "release {n}");
        }
    }
    assert_eq!(simulated, 64, "simulated time has caught up");
    assert!((0..TOOLS).all(|tool| (at[tool] - tools(64)[tool]).norm() < 1e-12));
}
