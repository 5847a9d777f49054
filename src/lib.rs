//! palpate: an actor-based real-time runtime for multi-rate haptic simulation of deformable bodies.
//!
//! A detailed simulation of a soft body at 30 Hz (the *global model*) and a small one around the tool at 1 kHz (the
//! *local model*) run side by side. The local one resolves contact and friction and computes the force for a device.
//! Both run on real threads, or in virtual time: on one thread, as fast as the machine allows and bit-identically every
//! time.
//!
//! # Layers
//!
//! | module | what it is |
//! | --- | --- |
//! | [`session`] | the way in: a builder or a scene becomes a running session, and a [`Summary`](session::Summary) at its end |
//! | [`scene`] | what is simulated, as plain data, and its TOML files |
//! | [`actors`] | global, local, device, logger: the glue between the layers below; of it, only the log file is for programs |
//! | [`model`] | physics without threads or clocks: [bodies](model::body), [contact](model::contact), [local models](model::local) |
//! | [`mesh`] | mesh files, filling of closed surfaces, parametric organs |
//! | [`runtime`] | actors, rate groups, ports, real and virtual time; without physics, usable on its own |
//! | [`devices`] | what moves the tool: a path, a simulated hand, a log, or a program's own [`Device`] |
//! | [`safety`] | what stands between a computed force and a device |
//! | [`link`] | what crosses between two computers, and a link that is simulated |
//! | [`log`], [`report`] | records, MCAP files, and what they say about a run |
//!
//! # Example
//!
//! A tool is glued to a node of a block and pulls it up by 5 mm; in virtual time, with every record kept in memory.
//!
//! ```
//! use palpate::devices::ToolPath;
//! use palpate::log::LogRecord;
//! use palpate::prelude::*;
//!
//! # fn main() -> Result<(), Error> {
//! let body = Block::builder([6, 6, 6], [0.05; 3]).fix(Face::ZMin).build()?;
//! let node = body.lattice().id([2, 2, 5]);
//! let [x, y, z]: [f64; 3] = body.rest()[node as usize].into();
//! let path = ToolPath::new(vec![0.0, 0.2], vec![[x, y, z], [x, y, z + 0.005]])?;
//! let session = Session::builder(body).attach_node(node).path(path).duration_s(0.25).virtual_time().keep_records();
//! let summary = session.build()?.run()?;
//!
//! let forces = summary.records.iter().filter_map(|record| match record {
//!     LogRecord::Force(sample) => Some(sample.force_n[2]),
//!     _ => None,
//! });
//! assert!(forces.last().unwrap() < -0.1, "the body pulls the tool back");
//! println!("{summary}"); // the timing report
//! # Ok(())
//! # }
//! ```
//!
//! In real time the same session has no `virtual_time()` and, if wanted, `.local(RateGroup::hz(1000).realtime(80))`.
//!
//! # Features
//!
//! `parallel`: the forces of one large body on several cores.
//!
//! Words with a fixed meaning in all docs, such as *wait-free* and *real-time safe*, are defined in [`runtime`].

pub mod actors;
pub mod devices;
mod error;
mod files;
pub mod link;
pub mod log;
mod printable;
pub mod random;
pub mod report;
pub mod safety;
pub mod scene;
pub mod session;

pub use palpate_mesh as mesh;
pub use palpate_model as model;
pub use palpate_runtime as runtime;

pub use devices::Device;
pub use error::{Error, ErrorKind};
pub use printable::printable;
pub use session::Session;

/// The names that most programs need.
pub mod prelude {
    pub use crate::devices::{Capabilities, Device, DeviceFault, DeviceState, ForceCommand, ToolPath};
    pub use crate::error::Error;
    pub use crate::model::Vec3;
    pub use crate::model::body::{Block, Tetrahedra};
    // For its methods; who implements it names it.
    pub use crate::model::body::Body as _;
    pub use crate::model::contact::ToolShape;
    pub use crate::model::mesh::Face;
    pub use crate::runtime::{Nanos, RateGroup};
    pub use crate::scene::Scene;
    pub use crate::session::{Controls, Running, Session, SessionBuilder, Summary, Viewer};
}

/// The README's program must compile.
#[cfg(doctest)]
#[doc = include_str!("../README.md")]
struct Readme;
