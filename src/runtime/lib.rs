//! Actors in rate groups, on real-time threads or in deterministic virtual time; no physics.
//!
//! A graph is a set of [rate groups](RateGroup), each with [actors](Actor) that are released together, connected by
//! ports. It runs *threaded*, one thread per group with absolute sleeps and, where granted, SCHED_FIFO, or in *virtual
//! time*, one thread for everything, in the order (time, group), bit-identical every time. The actors are the same.
//!
//! - Ports: [`exchange`](RuntimeBuilder::exchange) for the newest value of a large state,
//!   [`queue`](RuntimeBuilder::queue) for ordered samples, [`outlet`](RuntimeBuilder::outlet) for threads outside,
//!   [`parameter`](RuntimeBuilder::parameter) and [`commands`](RuntimeBuilder::commands) from threads outside.
//! - Records: 64-byte [records](Record) leave a tick through wait-free [recorders](Recorder); a logger
//!   [drains](RuntimeBuilder::drain) them. Every release leaves its [timing](TickTiming).
//! - Release modes: the clock, a [device](Release::DevicePaced) whose blocking read drives its group, or a thread of the
//!   [program's own](Release::Hosted) that has a loop already.
//! - Slips: `released + skipped = elapsed periods` for every group, exactly, with a [cause](SlipCause) for each and a
//!   [policy](OverrunPolicy) for what is late. Virtual time [injects](Disturbance) what threads only suffer.
//! - Re-execution: a run on threads, [recorded](Recording), is repeated in virtual time bit for bit.
//! - Admission: a graph that cannot work is refused when it is built, with the sum that failed; its
//!   [plan](Runtime::plan) says what it asks for and what this system would refuse.
//! - Introspection: [`RunningGraph::live`] shows counts, lateness and execution time of every group at any moment,
//!   [`RunningGraph::graph`] the whole graph as text, JSON, DOT and SVG.
//! - Events: a thread outside the groups tells the program's `tracing` subscriber of slips, misses, restarts and faults,
//!   under the targets `palpate_runtime::slip`, `::miss`, `::restart` and `::fault`.
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

/// `Debug` for types of which only a part can be shown: these fields, and that there are more.
macro_rules! impl_debug {
    ($type:ident $(<$param:ident>)? $(, $field:literal: |$own:ident| $shown:expr)*) => {
        impl $(<$param>)? std::fmt::Debug for $type $(<$param>)? {
            fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
                f.debug_struct(stringify!($type))
                    $(.field($field, &(|$own: &Self| $shown)(self)))*
                    .finish_non_exhaustive()
            }
        }
    };
}

mod accounting;
mod actor;
mod admission;
mod builder;
mod error;
mod executor;
mod graph;
mod group;
mod ports;
mod primitives;
mod rate_group;
mod records;
mod reexecution;
mod reports;
mod runtime;
mod supervision;
mod system;
mod time;

pub use actor::{Actor, GroupMode, Outcome, TickContext, actor_fn};
pub use admission::plan::{Coincidence, GroupPlan, Plan};
pub use builder::RuntimeBuilder;
pub use error::{ActorError, GraphError, GraphErrorKind};
pub use executor::Execution;
pub use executor::disturbance::Disturbance;
pub use executor::hosted::{HostRelease, HostedGroup};
pub use graph::view::{GraphGroup, GraphPort, GraphView, PortEnd, PortKind};
pub use ports::exchange_port::{Reader, Writer};
pub use ports::inlet::{CommandReceiver, Commands, InputValue, Parameter, ParameterReader};
pub use ports::outlet::{OutletReader, OutletWriter};
pub use ports::queue_port::{QueueReader, QueueWriter};
pub use ports::restartable::{ExchangePort, OutletPort, QueuePort, RecorderPort};
pub use primitives::histogram::{Histogram, HistogramReader};
pub use primitives::{exchange, ring};
pub use rate_group::{OverrunPolicy, RateGroup, Release, Wait};
pub use records::input::InputUse;
pub use records::port_use::{PortUse, PortUseKind};
pub use records::record::{Channel, Event, EventCode, Record};
pub use records::recorder::{RecordDrain, RecordGap, Recorder};
pub use records::timing::{ActorTimes, SlipCause, SlipCounts, TickTiming};
pub use reexecution::recording::Recording;
pub use reports::group_live::GroupLive;
pub use reports::report::{GroupCost, GroupReport, RuntimeFault, RuntimeFaultKind, RuntimeReport};
pub use runtime::{RunningGraph, Runtime};
pub use supervision::restart::Restart;
pub use supervision::stop::{STOP_BOUND, StopHandle};
pub use system::grant::{GrantHandle, GroupGrant, SystemGrant};
pub use system::machine::{MachineFinding, Readiness};
pub use system::os::pinnable_cores;
pub use system::stopwatch::Stopwatch;
pub use time::{Nanos, Rate};

/// The README's program must compile.
#[cfg(doctest)]
#[doc = include_str!("README.md")]
struct Readme;
