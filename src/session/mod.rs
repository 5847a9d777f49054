//! From a scene or a builder to a running session: actors, their ports and the runtime that executes them.
//!
//! ```
//! use palpate::prelude::*;
//!
//! # fn main() -> Result<(), Error> {
//! let body = Block::builder([6, 6, 6], [0.05; 3]).fix(Face::ZMin).build()?;
//! let top = body.lattice().id([2, 2, 5]);
//! let summary = Session::builder(body).attach_node(top).virtual_time().duration_s(0.1).build()?.run()?;
//! assert_eq!(summary.report.devices[0].force.ticks, 100);
//! # Ok(())
//! # }
//! ```

mod basis;
mod budget;
mod builder;
mod checks;
mod choice;
mod device;
mod disturbed;
mod global;
mod graph;
mod hardware;
mod horizon;
mod patch;
mod prepare;
mod rate_groups;
mod replay;
mod running;
mod safety;
mod sink;
mod situation;
mod substeps;
mod tools;

pub use builder::SessionBuilder;
pub use hardware::OpenHaply;
pub use choice::Choice;
pub use replay::{Compared, Difference, LoggedFault, Replay, ReplayReport, Unrepeated, UnrepeatedRelease};
pub use running::{Running, Summary, Viewer};

use crate::error::Error;
use crate::model::body::Body;
use crate::runtime::Plan;
use crate::scene::Scene;
use prepare::Prepared;

/// A session that has passed every check and can start.
#[derive(Debug)]
pub struct Session {
    prepared: Prepared,
}

impl Session {
    /// A session with a program's own or a built body.
    pub fn builder(body: impl Body + 'static) -> SessionBuilder {
        SessionBuilder::new(Some(Box::new(body)), Scene::of_program())
    }

    /// A session as a scene describes it; the builder can still change it.
    pub fn from_scene(scene: Scene) -> SessionBuilder {
        SessionBuilder::new(None, scene)
    }

    /// The local model that was chosen and why; `None` if the scene or the program named one.
    pub fn choice(&self) -> Option<&Choice> {
        self.prepared.choice.as_ref()
    }

    /// The schedule: what each rate group asks for, what the cores bear, which releases coincide, and what this system
    /// would refuse now. Nothing is started, no device is asked, no file is created.
    ///
    /// # Errors
    /// If the process has been moved to fewer cores since the session was built and no longer fits.
    pub fn plan(&self) -> Result<Plan, Error> {
        Ok(Plan::of(self.prepared.execution, &graph::groups(&self.prepared))?)
    }

    /// Reads the log of a scene's run, in real or in simulated time, to execute it again in simulated time from what was
    /// logged: the states that the device gave and what each tick saw of the other rate group. Logged forces are only
    /// compared with. A run with a fault is repeated up to it.
    ///
    /// # Errors
    /// [`ErrorKind::Io`](crate::ErrorKind::Io) if it cannot be read; [`ErrorKind::Log`](crate::ErrorKind::Log) if it is
    /// damaged, if a record is missing, if it holds no force before its first fault, if it was made with another
    /// instruction set, or if the body was a program's own.
    pub fn replay(log: &std::path::Path) -> Result<Replay, Error> {
        Replay::of_scene(log)
    }

    /// Starts it: threads are up and the first local model is built when this returns.
    ///
    /// # Errors
    /// If the log cannot be created, the device gives no first state or a thread cannot be started.
    pub fn start(self) -> Result<Running, Error> {
        graph::start(self.prepared)
    }

    /// Runs it to its end, see [`SessionBuilder::duration_s`].
    ///
    /// # Errors
    /// As [`start`](Self::start).
    pub fn run(self) -> Result<Summary, Error> {
        let running = self.start()?;
        running.wait();
        Ok(running.stop())
    }
}
