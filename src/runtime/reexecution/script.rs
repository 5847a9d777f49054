//! What the ports of a re-execution must show: the recorded uses, and how far the writers have come.
//!
//! The executor and all ports share one script. One thread runs everything, so its lock is never contended.

use crate::actor::TickContext;
use crate::primitives::sync::lock;
use crate::records::input::InputUse;
use crate::records::port_use::PortUse;
use crate::time::Nanos;
use std::collections::VecDeque;
use std::sync::{Arc, Mutex};

/// The script of one port.
#[derive(Debug, Default)]
pub(crate) struct PortScript {
    /// What readers took or saw, in order.
    pub(crate) reads: VecDeque<PortUse>,
    /// What actors took from outside, in order.
    pub(crate) inputs: VecDeque<InputUse>,
    /// The attempts to send that failed, in order.
    pub(crate) drops: VecDeque<u64>,
    /// The newest version published, or the number of the newest sample sent.
    pub(crate) produced: u64,
    /// The number of the newest sample that the reader has seen.
    pub(crate) seen: u64,
}

/// A recorded use that a release cannot have yet.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Missing {
    pub(crate) needed: PortUse,
    pub(crate) produced: u64,
}

/// The scripts of all ports, by their number.
#[derive(Clone, Debug, Default)]
pub(crate) struct Script(Arc<Mutex<Vec<PortScript>>>);

impl Script {
    pub(crate) fn new(ports: Vec<PortScript>) -> Self {
        Self(Arc::new(Mutex::new(ports)))
    }

    /// The script of port `port`, which is empty if nothing was recorded.
    pub(crate) fn port(&self, port: u32) -> ScriptedPort {
        let index = port as usize;
        let mut ports = lock(&self.0);
        if ports.len() <= index {
            ports.resize_with(index + 1, PortScript::default);
        }
        ScriptedPort { script: self.clone(), index }
    }

    /// The first thing that release `tick` of `group` needs and that has not been written yet.
    pub(crate) fn missing(&self, group: u16, tick: u64) -> Option<Missing> {
        let ports = lock(&self.0);
        let missing = |port: &PortScript| {
            let next = port.reads.front().filter(|next| next.group == group && next.tick == tick)?;
            (next.count > port.produced).then_some(Missing { needed: *next, produced: port.produced })
        };
        ports.iter().find_map(missing)
    }

    /// The port of a use that release `tick` of `group`, due at `scheduled`, should have made and has not.
    pub(crate) fn left_out(&self, group: u16, tick: u64, scheduled: Nanos) -> Option<(u64, u32)> {
        let ports = lock(&self.0);
        let is_late = |next: &&InputUse| next.group == group && next.time <= scheduled;
        if let Some(input) = ports.iter().find_map(|port| port.inputs.front().filter(is_late)) {
            return Some((tick, input.port));
        }
        let is_past = |next: &&PortUse| next.group == group && next.tick <= tick;
        ports.iter().find_map(|port| port.reads.front().filter(is_past)).map(|used| (used.tick, used.port))
    }
}

/// One port's view of the script.
#[derive(Clone, Debug)]
pub(crate) struct ScriptedPort {
    script: Script,
    index: usize,
}

impl ScriptedPort {
    fn with<R>(&self, act: impl FnOnce(&mut PortScript) -> R) -> R {
        act(&mut lock(&self.script.0)[self.index])
    }

    /// The writer has published this version, or sent the sample with this number.
    pub(crate) fn produced(&self, count: u64) {
        self.with(|port| port.produced = count);
    }

    /// The count of the next read.
    pub(crate) fn next_count(&self) -> Option<u64> {
        self.with(|port| port.reads.front().map(|next| next.count))
    }

    /// The version that this release took, if it took one.
    pub(crate) fn took(&self, ctx: &TickContext) -> Option<u64> {
        let is_now = |next: &mut PortUse| next.group == ctx.group && next.tick == ctx.tick;
        self.with(|port| port.reads.pop_front_if(is_now)).map(|now| now.count)
    }

    /// The next value that this release took from outside, if there is one.
    pub(crate) fn input(&self, ctx: &TickContext) -> Option<[u64; 5]> {
        let is_now = |next: &mut InputUse| next.group == ctx.group && next.time == ctx.scheduled;
        self.with(|port| port.inputs.pop_front_if(is_now)).map(|now| now.value)
    }

    /// The number of the newest sample that this release saw.
    pub(crate) fn saw(&self, ctx: &TickContext) -> u64 {
        let now = self.took(ctx);
        self.with(|port| {
            port.seen = now.unwrap_or(port.seen);
            port.seen
        })
    }

    /// Whether this attempt to send failed.
    pub(crate) fn drops(&self, attempt: u64) -> bool {
        self.with(|port| port.drops.pop_front_if(|failed| *failed == attempt)).is_some()
    }
}
