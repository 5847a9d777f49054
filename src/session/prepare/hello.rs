//! How one side of a link introduces itself to the other.

use super::{Prepared, Tool, link};
use crate::devices::DeviceState;
use crate::error::Error;
use crate::link::Hello;
use crate::model::body::Block;
use crate::runtime::Nanos;
use crate::scene::{DeviceSpec, LogSpec, RunSpec, SafetySpec, Scene};

impl Prepared {
    /// What this side says of itself, with the tools at `first`; who speaks and to which session is left to the transport.
    ///
    /// # Errors
    /// If the scene cannot be written.
    pub(in crate::session) fn hello(&self, first: &[DeviceState]) -> Result<Hello, Error> {
        let named = self.scene.devices.iter().map(|device| device.name.clone().unwrap_or_default());
        let place = |(tool, first): (&Tool, &DeviceState)| (!tool.is_elsewhere).then(|| first.pose());
        let places = self.tools.iter().zip(first).map(place);
        Ok(Hello {
            build: format!("palpate {} for {}", env!("CARGO_PKG_VERSION"), std::env::consts::ARCH),
            instructions: Block::instruction_set().to_owned(),
            scene: shared(&self.scene).to_toml()?,
            body: self.fingerprint(),
            tools: named.zip(places).collect(),
            ..Hello::default()
        })
    }

    /// Local models look ahead for results that are `round_trip` later than without a link.
    pub(in crate::session) fn look_ahead(&mut self, round_trip: Nanos) {
        let timing = &mut self.plan.timing;
        let ticks = link::real_lateness(round_trip, timing.global).as_secs_f64() * timing.haptic.as_hz();
        timing.horizon = timing.horizon.saturating_add(ticks.ceil() as u32);
    }

    /// Of the nodes, their masses and the surface: FNV-1a over their bits.
    fn fingerprint(&self) -> u64 {
        let body = self.simulation.body_as_made();
        let nodes =
            body.rest().iter().flat_map(|node| [node.x, node.y, node.z]).chain(body.inverse_masses().iter().copied());
        let corners = body.surface().triangles.iter().flatten().map(|&node| u64::from(node));
        let bits = nodes.map(f64::to_bits).chain(corners);
        bits.fold(0xcbf2_9ce4_8422_2325, |hash, bits| (hash ^ bits).wrapping_mul(0x0000_0100_0000_01b3))
    }
}

/// What of a scene both sides must have in common: not what is of the devices, of the log and of a run's length.
fn shared(scene: &Scene) -> Scene {
    let device = |device: &DeviceSpec| DeviceSpec {
        name: device.name.clone(),
        tool: device.tool,
        attach_node: device.attach_node,
        ..DeviceSpec::default()
    };
    let mut shared = scene.clone();
    shared.devices = scene.devices.iter().map(device).collect();
    (shared.safety, shared.log, shared.run) = (SafetySpec::default(), LogSpec::default(), RunSpec::default());
    shared
}
