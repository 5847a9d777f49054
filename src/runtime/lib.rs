//! The runtime: actors in rate groups, on real-time threads or in deterministic virtual time; no physics.
//!
//! A graph is a set of [rate groups](RateGroup), each with [actors](Actor) that are released together, connected by
//! ports. It runs *threaded*, one thread per group with absolute sleeps and, where granted, SCHED_FIFO, or in *virtual
//! time*, one thread for everything, in the order (time, group), bit-identical every time. The actors are the same.
//!
//! - Ports: [`exchange`](RuntimeBuilder::exchange) for the newest value of a large state,
//!   [`queue`](RuntimeBuilder::queue) for ordered samples, [`outlet`](RuntimeBuilder::outlet) for threads outside.
//! - Records: 64-byte [records](Record) leave a tick through wait-free [recorders](Recorder); a logger
//!   [drains](RuntimeBuilder::drain) them. Every release leaves its [timing](TickTiming).
//! - Release modes: the clock, or a [device](Release::DevicePaced) whose blocking read drives its group.
//! - Slips: `released + skipped = elapsed periods` for every group, exactly, with a [cause](SlipCause) for each and a
//!   [policy](OverrunPolicy) for what is late. Virtual time [injects](Disturbance) what threads only suffer.
//! - Re-execution: a run on threads, [recorded](Recording), is repeated in virtual time bit for bit.
//! - Admission: a graph that cannot work is refused when it is built, with the sum that failed; its
//!   [plan](Runtime::plan) says what it asks for and what this system would refuse.
//! - Introspection: [`Running::live`] shows counts, lateness and execution time of every group at any moment.
//! - Faults: a panic or a reported fault stops the whole graph in order, after [winding down](RateGroup::wind_down), and
//!   is in the [report](RuntimeReport); a [restartable](RuntimeBuilder::restartable) group is started again instead.
//!
//! Words with a fixed meaning in these docs: *wait-free* (done in a bounded number of steps whatever others do),
//! *lock-free* (some thread always gets on), *bounded*, *allocates*, *may block*, *real-time safe* (no allocation, no
//! lock, no system call).
//!
//! What a tick may call says under *Real-time* which of these it is. That holds on threads. Virtual time has no deadline
//! to meet: ports take locks there, which nobody contends for, and allocate until they are warm.
//!
//! # Example
//!
//! A slow producer and a fast consumer in virtual time; with `Execution::Threaded` the same graph runs in real time.
//!
//! ```
//! use palpate_runtime::{Execution, Nanos, Outcome, RateGroup, Runtime, actor_fn};
//! use std::time::Duration;
//!
//! let mut graph = Runtime::builder(Execution::Virtual);
//! let (mut model, mut newest) = graph.exchange(|| vec![0.0; 1000]);
//! let slow = actor_fn("slow", move |ctx| {
//!     model.buffer().fill(ctx.scheduled.as_secs_f64());
//!     model.publish(ctx);
//!     Outcome::Continue
//! });
//! let (mut shown, mut display) = graph.outlet(|| 0.0);
//! let fast = actor_fn("fast", move |ctx| {
//!     if newest.refresh(ctx) {
//!         *shown.buffer() = newest.get()[0];
//!         shown.publish(ctx);
//!     }
//!     Outcome::Continue
//! });
//! let running = graph
//!     .group(RateGroup::hz(1000).name("fast"), vec![fast])
//!     .group(RateGroup::hz(50).name("slow").latency(Nanos(5_000_000)), vec![slow])
//!     .until(Nanos(100_000_000))
//!     .build()?
//!     .start()?;
//! running.wait_for(Duration::from_millis(50));
//! assert!(display.refresh());
//! assert_eq!(*display.get(), 0.040); // published at 40 ms, visible from 45 ms on
//!
//! running.wait_for(Duration::MAX);
//! let report = running.stop();
//! assert_eq!(report.groups[0].released, 101);
//! assert_eq!(report.fault, None);
//! # Ok::<(), palpate_runtime::GraphError>(())
//! ```

mod actor;
mod builder;
mod deadline;
mod disturbance;
mod error;
pub mod exchange;
mod grant;
mod group_thread;
pub mod histogram;
mod laps;
mod link;
mod linked_queue;
mod live;
pub mod mailbox;
mod members;
mod numbers;
mod os;
mod outlet;
mod overrun;
mod pace;
mod panic_hook;
mod plan;
mod port;
mod port_memory;
mod port_use;
mod queue_port;
mod rate_group;
pub mod record;
mod recorder;
mod recording;
mod reexecution;
mod release;
mod report;
mod restart;
mod rewire;
pub mod ring;
mod running;
mod schedule;
mod script;
mod stopwatch;
mod successor;
mod supervisor;
mod sync;
mod tenure;
mod threaded;
mod time;
mod timeline;
mod virtual_port;
mod virtual_queue;
mod virtual_time;
mod wait;
mod wake;

pub use actor::{Actor, Mode, Outcome, TickContext, actor_fn};
pub use builder::{Execution, RuntimeBuilder};
pub use deadline::SlipCounts;
pub use disturbance::Disturbance;
pub use error::{ActorError, GraphError, GraphErrorKind};
pub use grant::{GrantHandle, GroupGrant, SystemGrant};
pub use live::GroupLive;
pub use outlet::{OutletReader, OutletWriter};
pub use plan::{Coincidence, GroupPlan, Plan};
pub use port::{Reader, Writer};
pub use port_use::{PortUse, PortUseKind};
pub use queue_port::{QueueReader, QueueWriter};
pub use rate_group::{OverrunPolicy, RateGroup, Release, Wait};
pub use record::{ActorTimes, Channel, Event, Record, SlipCause, TickTiming};
pub use recorder::{RecordDrain, RecordGap, Recorder};
pub use recording::Recording;
pub use report::{GroupCost, GroupReport, RuntimeFault, RuntimeReport};
pub use restart::Restart;
pub use rewire::{ExchangePort, OutletPort, QueuePort, RecorderPort};
pub use running::{Running, Runtime, STOP_BOUND};
pub use schedule::admit_here;
pub use stopwatch::Stopwatch;
pub use supervisor::StopHandle;
pub use time::{Nanos, Rate};
