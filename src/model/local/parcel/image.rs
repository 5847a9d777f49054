//! The global model as far as it is known on another computer.

use super::super::{LocalModels, ResyncView, ToolForecast};
use super::{MOST_FELT, Parcel, Pressing, Shipment};
use crate::simulation::Simulation;
use crate::surroundings::{Bases, Basis};

/// Triangles that a window is made around, at most.
const MOST_TRIANGLES: usize = 1 << 16;

/// The image of a simulation on another computer: of the same body, in the state that the last [`Parcel`] of each window told.
///
/// Whatever comes is asked whether it fits the body before anything is done with it.
///
/// # Real-time
/// Not for a tick: allocates, and builds models.
#[derive(Debug)]
pub struct Image {
    simulation: Simulation,
    /// The tools that are felt elsewhere.
    elsewhere: Vec<usize>,
    /// Working memory.
    tools: Vec<ToolForecast>,
}

impl Image {
    /// Of a simulation of the body and the tools that `simulation` has.
    pub fn new(simulation: Simulation) -> Self {
        let tools = vec![ToolForecast::default(); simulation.tools()];
        Self { simulation, elsewhere: Vec::new(), tools }
    }

    /// The same where the force on some `tools` is not needed: they are [set aside](LocalModels::set_aside) unless a model of others holds
    /// them.
    #[must_use]
    pub fn without(self, tools: Vec<usize>) -> Self {
        Self { elsewhere: tools, ..self }
    }

    /// Builds `models` as they would have been built where `shipment` comes from, with what there is of the `bases` here. False if it is one
    /// of another body or of other tools: then `models` are not to be used.
    ///
    /// # Real-time
    /// Not for a tick: costs what building models costs but for looking ahead, and allocates.
    pub fn rebuild(&mut self, shipment: &Shipment, bases: &Bases, models: &mut LocalModels) -> bool {
        if [shipment.hosts().len(), models.hosts().len()] != [self.tools.len(); 2] {
            return false;
        }
        for parcel in shipment.parcels() {
            match self.view(parcel, bases) {
                Some(resync) => models.rebuild(resync),
                None => return false,
            }
        }
        shipment.hosts().enumerate().all(|(tool, host)| {
            let is_served = models.share(host, tool);
            if !is_served {
                models.set_aside(tool, host);
            }
            is_served || self.elsewhere.contains(&tool)
        })
    }

    /// What `parcel` tells; `None` if it does not fit.
    fn view<'a>(&'a mut self, parcel: &'a Parcel, bases: &'a Bases) -> Option<ResyncView<'a>> {
        let index = parcel.tool();
        if index >= self.tools.len() || !self.fits(parcel) {
            return None;
        }
        let state = self.simulation.state_mut();
        let states = parcel.state.positions.iter().zip(&parcel.state.velocities);
        for (&node, (x, v)) in parcel.nodes.iter().zip(states) {
            (state.positions[node as usize], state.velocities[node as usize]) = (*x, *v);
        }
        self.simulation.set_friction(parcel.friction);
        self.simulation.be_told(parcel.stiffness, &parcel.path);
        for (tool, pressing) in parcel.tools.iter().enumerate() {
            self.simulation.be_told_of(tool, pressing.wrench, &pressing.exerted, |touch| {
                touch.go_on_from(pressing.contact, pressing.steady, &pressing.felt);
            });
            self.tools[tool] = ToolForecast::at_rest(pressing.pose);
        }
        Some(ResyncView {
            global: &mut self.simulation,
            tick: parcel.tick,
            triangles: &parcel.triangles,
            nearest: &parcel.nearest,
            patch: parcel.patch(),
            tools: &self.tools,
            index,
            horizon: 0,
            bases,
        })
    }

    /// The nodes of the body's surface, in increasing order.
    ///
    /// # Real-time
    /// Not for a tick: allocates.
    pub fn surface_nodes(&self) -> Vec<u32> {
        self.simulation.body().surface().nodes()
    }

    /// True if `basis` can be one of this body.
    pub fn has_room_for(&self, basis: &Basis) -> bool {
        self.is_patch(basis.patch()) && self.ring_of(basis.patch()).is_some_and(|ring| basis.answers.is_of(3 * ring))
    }

    /// The nodes of the ring around a patch; `None` if the body cannot be taken apart.
    fn ring_of(&self, patch: &[u32]) -> Option<usize> {
        self.simulation.body().restriction(patch).map(|near| near.ring(patch.len()).len())
    }

    /// Some nodes that can move, in increasing order.
    fn is_patch(&self, nodes: &[u32]) -> bool {
        let masses = self.simulation.body().inverse_masses();
        let can_move = |&node: &u32| masses.get(node as usize).is_some_and(|&w| w > 0.0);
        nodes.iter().all(can_move) && nodes.windows(2).all(|pair| pair[0] < pair[1]) && !nodes.is_empty()
    }

    fn fits(&self, parcel: &Parcel) -> bool {
        let body = self.simulation.body();
        let (nodes, triangles) = (body.rest().len(), body.surface().triangles.len());
        let is_node = |&node: &u32| (node as usize) < nodes;
        let is_triangle = |&triangle: &u32| (triangle as usize) < triangles;
        let presses = |tool: &Pressing| {
            let felt = tool.felt.len() <= MOST_FELT && tool.felt.iter().all(|felt| is_triangle(&felt.point.triangle));
            let touched = tool.contact.triangle.is_none_or(|triangle| is_triangle(&triangle));
            felt && touched && tool.exerted.iter().all(|(node, _)| is_node(node))
        };
        let tools = self.tools.len();
        let pressed = parcel.tools.len() == tools && parcel.tools.iter().all(presses);
        let nearest = [0, tools].contains(&parcel.nearest.len()) && parcel.nearest.iter().all(is_triangle);
        let around = (1..=MOST_TRIANGLES).contains(&parcel.triangles.len());
        pressed
            && nearest
            && around
            && parcel.nodes.iter().all(is_node)
            && parcel.triangles.iter().all(is_triangle)
            && parcel.patch().is_none_or(|patch| self.is_patch(patch))
    }
}
