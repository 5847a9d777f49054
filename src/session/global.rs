//! The global side of a session alone: its devices are behind a link, on another computer.

use super::parts::{Parts, Side};
use super::prepare::{Prepared, prepare};
use super::running::Running;
use super::wire;
use super::{Choice, SessionBuilder};
use crate::devices::{Capabilities, Device, DeviceState, Scripted, ToolPath};
use crate::error::Error;
use crate::link::{HapticMachine, Hello};

/// The global model of a session whose devices are in another process: ready to start when one says [`Hello`].
///
/// The other process has a session of the same scene, see [`SessionBuilder::global_over`].
#[derive(Debug)]
pub struct GlobalSession {
    prepared: Prepared,
    hello: Hello,
}

impl GlobalSession {
    /// Checks everything that [`SessionBuilder::build`] does, but opens no device.
    ///
    /// # Errors
    /// If something cannot work, naming the field and what would be right.
    pub(super) fn of(mut parts: Parts) -> Result<Self, Error> {
        // In the places of those that are elsewhere.
        let none = Scripted::new(ToolPath::constant([0.0; 3])?);
        let like = |able: Capabilities| Box::new(none.clone().with_capabilities(able)) as Box<dyn Device>;
        parts.devices.iter_mut().for_each(|(_, device)| *device = like(device.capabilities()));
        let others = parts.scene.devices.iter().skip(parts.devices.len());
        parts.devices.extend(others.map(|spec| (None, like(spec.capabilities()))));
        parts.side = Side::Global;
        parts.endless = true;
        let prepared = prepare(parts)?;
        // Where the tools are is said by the other side.
        let hello = prepared.hello(&vec![DeviceState::default(); prepared.tools.len()])?;
        Ok(Self { prepared, hello })
    }

    /// What this side knows of itself, to hold against what [comes](Hello::difference).
    pub fn hello(&self) -> &Hello {
        &self.hello
    }

    /// The local model that was chosen and why; `None` if the scene or the program named one.
    pub fn choice(&self) -> Option<&Choice> {
        self.prepared.choice.as_ref()
    }

    /// Starts the global model for the `machines` that have the tools, each of which is at one of them; local models go to all of them, and
    /// tool ticks come from each. It runs until it is stopped.
    ///
    /// # Errors
    /// If a tool of the scene is at none of the machines or at two, or far from the body, or a thread cannot be started.
    pub fn start(self, machines: Vec<HapticMachine>) -> Result<Running, Error> {
        wire::start_global(self.prepared, machines)
    }
}

impl SessionBuilder {
    /// Makes the global side of the session ready to start; its devices are those of another process, and none is opened here.
    ///
    /// # Errors
    /// If something cannot work, naming the field and what would be right.
    pub fn build_global(self) -> Result<GlobalSession, Error> {
        GlobalSession::of(self.parts)
    }
}
