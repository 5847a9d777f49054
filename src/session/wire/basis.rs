//! The background group that reduces surroundings, and what has to be there before a run begins.

use std::sync::Arc;

use crate::actors::{BasisActor, BasisPace, BasisPorts, BasisStore, Wishes};
use crate::error::Error;
use crate::model::Pose;
use crate::model::local::{Aim, Beside, Kind, ToolForecast, Windows};
use crate::model::surroundings::{Bases, Reduction, RestingBody};
use crate::runtime::{Actor, ExchangePort, Nanos, RuntimeBuilder};
use crate::session::prepare::Prepared;

/// The basis actor's side of a session.
pub(super) struct BasisSide {
    pub(super) wishes: ExchangePort<Wishes>,
    pub(super) bases: ExchangePort<Bases>,
    /// Those that are there before the start.
    pub(super) known: Bases,
    resting: Arc<RestingBody>,
    store: BasisStore,
    pace: BasisPace,
    /// Between two releases.
    period: Nanos,
}

impl BasisSide {
    /// Its ports, and the bases around each of `tools` (m).
    ///
    /// # Errors
    /// If the surface cannot be searched.
    pub(super) fn new(graph: &mut RuntimeBuilder, prepared: &Prepared, tools: &[Pose]) -> Result<Option<Self>, Error> {
        let Some(resting) = prepared.plan.resting.clone() else {
            return Ok(None);
        };
        let folder = prepared.plan.basis_folder.clone();
        let mut store = BasisStore::new(prepared.scene.local.basis_states(), folder);
        let given = prepared.scene.global.basis_latency_ms.map(|ms| Nanos::from_secs_f64(ms * 1e-3));
        let pace = match given {
            _ if prepared.plan.in_real_time => BasisPace::Measured,
            None => BasisPace::Nominal,
            Some(cost) => BasisPace::Given(cost),
        };
        Ok(Some(Self {
            wishes: graph.exchange_port(Wishes::default),
            bases: graph.exchange_port(Bases::default),
            known: if prepared.plan.template.kind == Kind::Predictive {
                first_bases(prepared, &resting, &mut store, tools)?
            } else {
                Bases::default()
            },
            store,
            resting,
            pace,
            period: prepared.plan.timing.global.period(),
        }))
    }

    pub(super) fn actor(&self) -> Box<dyn Actor> {
        let ports = BasisPorts { wishes: self.wishes.reader(), bases: self.bases.writer() };
        let (resting, store, known) = (Arc::clone(&self.resting), self.store.clone(), self.known.clone());
        Box::new(BasisActor::new(resting, store, known, (self.pace, self.period), ports))
    }
}

/// What bases of windows beside the first ones may take before a session begins (s, nominally), for each tool.
const BESIDE_S: f64 = 0.5;
/// So many at most: on a large body, windows that look the same take next to no time, and memory all the same.
const BESIDE: usize = 25;

/// The bases of the window that each tool is over, of one that holds the others too, and of the widest there and beside it: a fast
/// tool leaves its first window before another basis is made.
fn first_bases(
    prepared: &Prepared,
    resting: &RestingBody,
    store: &mut BasisStore,
    tools: &[Pose],
) -> Result<Bases, Error> {
    let simulation = &prepared.simulation;
    let aim = Aim::new(simulation.body().surface(), &simulation.state().positions)?;
    let (mut bases, mut beside) = (Bases::default(), Beside::default());
    let triangles = |(index, &tool): (usize, &Pose)| {
        let mut triangles = Vec::new();
        aim.triangles((simulation, index), &ToolForecast::at_rest(tool), [0.0; 2], &mut triangles);
        triangles
    };
    let of_tools: Vec<Vec<u32>> = tools.iter().enumerate().map(triangles).collect();
    // False if no time is left for it.
    let mut make = |patch: &[u32], left: &mut f64| {
        if bases.get(patch).is_some() {
            return true;
        }
        let Some(reduction) = Reduction::new(resting, patch, store.states()) else { return true };
        *left -= reduction.nominal();
        if *left < 0.0 {
            return false;
        }
        // What cannot be reduced is told by the actor, when it is wanted.
        if let Ok(basis) = store.get(resting, reduction) {
            bases.insert(Arc::new(basis));
        }
        true
    };
    for (index, triangles) in of_tools.iter().enumerate() {
        let windows = Windows::new(simulation, index, prepared.plan.template.patch);
        simulation.pressed_beside(index, |other| &of_tools[other], &mut beside.soon);
        let others = of_tools.iter().enumerate().filter(|&(other, _)| other != index);
        beside.triangles = others.map(|(_, triangles)| triangles[0]).collect();
        let [mut patch, mut shared] = [Vec::new(), Vec::new()];
        windows.choose((simulation, index), triangles, &Beside::default(), |_| true, &mut patch);
        windows.choose((simulation, index), triangles, &beside, |_| true, &mut shared);
        let mut needed = f64::INFINITY;
        make(&patch, &mut needed);
        make(&shared, &mut needed);
        if simulation.contact(index).glued {
            continue;
        }
        if let Some(widest) = windows.widest(triangles[0], &patch) {
            make(widest, &mut needed);
        }
        let mut left = BESIDE_S;
        let _ = windows.widest_around(triangles[0]).take(BESIDE).all(|patch| make(patch, &mut left));
    }
    Ok(bases)
}
