//! The parcels of one resync.

use super::{Parcel, path};
use crate::Pose;
use crate::bytes::{BytesReader, BytesWriter};
use crate::local::LocalModels;

/// A parcel is larger in memory than its least bytes: more tools than this are nobody's.
const MOST_TOOLS: usize = 64;
/// Numbers of all paths at most: four of the longest.
const MOST_NUMBERS: usize = 4 * path::MOST_NUMBERS;

/// The ingredients of the local models of all tools, to be built on another computer: they cross a link together, as they serve together.
///
/// # Real-time
/// Not for a tick: allocates.
#[derive(Clone, Debug, Default)]
pub struct Shipment {
    /// One for each model that serves somebody.
    parcels: Vec<Parcel>,
    /// The tool around which the model is built that serves each tool.
    hosts: Vec<u16>,
}

impl Shipment {
    /// What `models` are built from, if they are [for that](crate::local::Template::departing).
    ///
    /// # Real-time
    /// Not for a tick: allocates.
    pub fn of(models: &LocalModels) -> Self {
        Self::of_tools(models, &(0..models.hosts().len()).collect::<Vec<_>>())
    }

    /// Likewise those of them that serve some of the `tools`, for a computer that has no others; those are set aside.
    ///
    /// # Real-time
    /// Not for a tick: allocates.
    ///
    /// # Panics
    /// If there are no tools, or fewer than one of them says.
    pub fn of_tools(models: &LocalModels, tools: &[usize]) -> Self {
        let all = models.hosts();
        let serves = |host: usize| tools.iter().any(|&tool| all[tool] == host);
        let hosts = all.iter().map(|&host| if serves(host) { host } else { all[tools[0]] } as u16).collect();
        Self { parcels: models.parcels().filter(|parcel| serves(parcel.tool())).cloned().collect(), hosts }
    }

    /// Appends all of it but the bases.
    ///
    /// # Real-time
    /// Not for a tick: allocates.
    pub fn write(&self, to: &mut BytesWriter<'_>) {
        to.list(&self.hosts, |to, &host| to.u16(host));
        self.parcels.iter().for_each(|parcel| parcel.write(to));
    }

    /// Takes what [`write`](Self::write) has appended; `None` if the bytes cannot be that, or the parcels cannot be of one resync. Whether
    /// they fit a body is what [`Image::rebuild`](super::Image::rebuild) asks.
    ///
    /// # Real-time
    /// Not for a tick: allocates.
    pub fn read(from: &mut BytesReader<'_>) -> Option<Self> {
        let mut shipment = Self::default();
        from.list(2, &mut shipment.hosts, BytesReader::u16)?;
        if shipment.hosts.len() > MOST_TOOLS {
            return None;
        }
        let models = shipment.hosts().enumerate().filter(|(tool, host)| tool == host).count();
        let mut numbers = 0;
        for _ in 0..models {
            let parcel = Parcel::read(from)?;
            numbers += parcel.path.len();
            // A path is larger in memory than its bytes too.
            if numbers > MOST_NUMBERS {
                return None;
            }
            shipment.parcels.push(parcel);
        }
        shipment.is_sound().then_some(shipment)
    }

    /// The haptic tick of the states.
    ///
    /// # Real-time
    /// Wait-free, real-time safe.
    pub fn tick(&self) -> u64 {
        self.parcels.first().map_or(0, Parcel::tick)
    }

    /// Counts the tick of the states as `tick`, for whoever counts otherwise.
    ///
    /// # Real-time
    /// Wait-free, real-time safe.
    pub fn set_tick(&mut self, tick: u64) {
        self.parcels.iter_mut().for_each(|parcel| parcel.tick = tick);
    }

    /// Where each tool is, and how it is turned.
    ///
    /// # Real-time
    /// Wait-free, real-time safe.
    pub fn poses(&self) -> impl Iterator<Item = Pose> {
        self.parcels.first().into_iter().flat_map(|parcel| parcel.tools.iter().map(|tool| tool.pose))
    }

    /// One for each model that serves somebody.
    ///
    /// # Real-time
    /// Wait-free, real-time safe.
    pub fn parcels(&self) -> &[Parcel] {
        &self.parcels
    }

    /// The tools, each with the one around which its model is built.
    pub(super) fn hosts(&self) -> impl ExactSizeIterator<Item = usize> {
        self.hosts.iter().map(|&host| host.into())
    }

    /// True if there is one parcel for each tool that has a model, in their order, and such a one serves every tool.
    fn is_sound(&self) -> bool {
        let serves_itself = |tool: usize| self.hosts.get(tool).is_some_and(|&host| usize::from(host) == tool);
        let mut owners = self.hosts().enumerate().filter(|(tool, host)| tool == host).map(|(tool, _)| tool);
        !self.hosts.is_empty()
            && self.hosts().all(serves_itself)
            && self.parcels.iter().all(|parcel| owners.next() == Some(parcel.tool()) && parcel.tick() == self.tick())
    }
}
