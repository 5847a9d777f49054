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

mod builder;
mod controls;
mod global;
mod parts;
mod prepare;
mod records;
mod replay;
mod running;
mod wire;
mod words;

pub use crate::actors::{LOG_FAILURE, SurfaceView, ToolView};
pub use builder::SessionBuilder;
pub use controls::Controls;
pub use global::GlobalSession;
pub use prepare::Choice;
pub use records::SharedRecords;
pub use replay::{Compared, Difference, LoggedFault, Replay, ReplayReport, Unrepeated, UnrepeatedRelease};
pub use running::{Running, Summary, Viewer};

use crate::error::{Error, ErrorKind};
use crate::model::body::Body;
use crate::runtime::{Execution, Plan};
use crate::scene::Scene;
use prepare::{Prepared, prepare};

/// A session that has passed every check and can start.
///
/// ```
/// use palpate::prelude::*;
///
/// # fn main() -> Result<(), Error> {
/// let session = Session::from_scene(Scene::demo()).duration_s(0.1).virtual_time().build()?;
/// println!("{}", session.plan()?); // who needs how much of which core
/// println!("{}", session.run()?); // the timing report
/// # Ok(())
/// # }
/// ```
#[derive(Debug)]
pub struct Session {
    prepared: Prepared,
}

impl Session {
    /// Begins a session with a program's own body or one that was built.
    pub fn builder(body: impl Body + 'static) -> SessionBuilder {
        SessionBuilder::new(Some(Box::new(body)), Scene::of_program())
    }

    /// Begins a session as a scene describes it; the builder can still change it.
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
        Ok(Plan::of(self.prepared.options.execution, &self.prepared.groups())?)
    }

    /// Reads the log of a scene's run, in real or in simulated time, to execute it again in simulated time from what was
    /// logged: the states that the device gave and what each tick saw of the other rate group. Logged forces are only
    /// compared with. A run with a fault is repeated up to it.
    ///
    /// # Errors
    /// [`ErrorKind::Io`] if it cannot be read; [`ErrorKind::Log`] if it is
    /// damaged, if a record is missing, if it holds no force before its first fault, if it was made with another
    /// instruction set, or if the body was a program's own.
    pub fn replay(log: &std::path::Path) -> Result<Replay, Error> {
        Replay::of_scene(log)
    }

    /// Starts the session: threads are up and the first local model is built when this returns.
    ///
    /// # Errors
    /// If the log cannot be created, the device gives no first state or a thread cannot be started.
    pub fn start(self) -> Result<Running, Error> {
        wire::start(self.prepared, None)
    }

    /// Runs the session to its end, see [`SessionBuilder::duration_s`].
    ///
    /// # Errors
    /// [`ErrorKind::Runtime`] if it has no end; if it cannot be started, see [`start`](Self::start).
    pub fn run(self) -> Result<Summary, Error> {
        if self.prepared.until.is_none() {
            return Err(Error::new(ErrorKind::Runtime, "the session has no end: give duration_s(), or use start()"));
        }
        let running = self.start()?;
        running.wait();
        Ok(running.stop())
    }
}

impl SessionBuilder {
    /// Reads the log of an earlier run of this session, to execute it again in simulated time, as
    /// [`Session::replay`] does for a scene. The builder must be filled as it was for that run, a body of the program's own is not
    /// in the log. Devices may be left out, those of the log are used; where several are glued give any in their places, as
    /// [`attach_node`](Self::attach_node) belongs to the one given last, and where several of the program's own differ give them again, as
    /// their limits are in no log.
    ///
    /// # Errors
    /// Those of [`Session::replay`]; also [`ErrorKind::Log`] if the log is one of another session.
    pub fn replay(self, log: &std::path::Path) -> Result<Replay, Error> {
        Replay::of_parts(self.parts, log)
    }

    /// Checks everything and makes the session ready to start.
    ///
    /// # Errors
    /// If something cannot work, naming the field of a scene, or the call of this builder if it began with
    /// [`Session::builder`], and what would be right.
    pub fn build(self) -> Result<Session, Error> {
        if self.parts.options.measures_cost && self.parts.options.execution == Execution::Threaded {
            return Err(Error::new(ErrorKind::Runtime, "cost is measured in virtual time only: use virtual_time()"));
        }
        let of_program = self.parts.is_of_program.then(|| self.parts.scene.clone());
        let prepared = prepare(self.parts).map_err(|error| match &of_program {
            Some(scene) => words::of_builder(error, scene),
            None => error,
        })?;
        Ok(Session { prepared })
    }
}
