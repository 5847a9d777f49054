//! A session that is being set up: a scene or a body, and what a program changes of it.

use std::path::Path;

use palpate::devices::{HostSide, Hosted};
use palpate::model::body::{Block, Tetrahedra, Tissue, Where};
use palpate::model::mesh::{Face, Group, TetrahedralMesh};
use palpate::runtime::{Rate, RateGroup};
use palpate::scene::Scene;
use palpate::session::{Session, SessionBuilder};

use crate::code::Failure;
use crate::handles::Handles;
use crate::types::{PalpateBlock, PalpateDevice};

pub(crate) static SETUPS: Handles<Setup> = Handles::new("setup");

/// The name of the group of nodes that a program holds.
const FIXED: &str = "fixed";

/// A session that is being set up.
pub(crate) struct Setup {
    /// `None` only while it is changed, or after that panicked.
    builder: Option<SessionBuilder>,
    haptic: Rate,
    /// The program said how long it runs.
    has_end: bool,
    is_virtual: bool,
}

/// A body of tetrahedra as C gives it.
pub(crate) struct Mesh {
    pub(crate) points: Vec<f64>,
    pub(crate) elements: Vec<u32>,
    pub(crate) fixed: Vec<u32>,
    pub(crate) tissue: Tissue,
}

impl Setup {
    fn new(builder: SessionBuilder, haptic_hz: f64) -> Self {
        // What is no rate is refused when the session is built.
        let haptic = Rate::from_hz(haptic_hz).unwrap_or(Rate::hz(1000));
        Self { builder: Some(builder), haptic, has_end: false, is_virtual: false }
    }

    pub(crate) fn of_scene(scene: Scene) -> Self {
        let haptic_hz = scene.local.rate_hz;
        Self::new(Session::from_scene(scene), haptic_hz)
    }

    pub(crate) fn of_file(path: &Path) -> Result<Self, Failure> {
        Ok(Self::of_scene(Scene::load(path)?))
    }

    pub(crate) fn of_block(block: &PalpateBlock) -> Result<Self, Failure> {
        let mut builder = Block::builder(block.nodes.map(|count| count as usize), block.size_m);
        for (bit, face) in Face::ALL.into_iter().enumerate() {
            if block.fixed_faces & 1 << bit != 0 {
                builder = builder.fix(face);
            }
        }
        if block.fixed_faces >> Face::ALL.len() != 0 {
            return Err(Failure::argument(format!("fixed_faces is {:#x}, a block has six faces", block.fixed_faces)));
        }
        let given = |value: f64| value != 0.0;
        if given(block.stiffness_n_per_m) {
            builder = builder.stiffness(block.stiffness_n_per_m);
        }
        if given(block.damping_ratio) {
            builder = builder.damping_ratio(block.damping_ratio);
        }
        if given(block.node_mass_kg) {
            builder = builder.node_mass(block.node_mass_kg);
        }
        let body = builder.build().map_err(palpate::Error::from)?;
        Ok(Self::new(Session::builder(body), 1000.0))
    }

    pub(crate) fn of_tetrahedra(mesh: Mesh) -> Result<Self, Failure> {
        let Mesh { points, elements, mut fixed, tissue } = mesh;
        let nodes = points.len() / 3;
        if let Some(&node) = elements.iter().chain(&fixed).find(|&&node| node as usize >= nodes) {
            return Err(Failure::argument(format!("node {node} is named and there are {nodes}, counted from 0")));
        }
        fixed.sort_unstable();
        fixed.dedup();
        let mesh = TetrahedralMesh {
            points: points.chunks_exact(3).map(|at| [at[0], at[1], at[2]].into()).collect(),
            tetrahedra: elements.chunks_exact(4).map(|at| [at[0], at[1], at[2], at[3]]).collect(),
            groups: vec![Group { name: FIXED.to_owned(), nodes: fixed, ..Group::default() }],
        };
        let body = Tetrahedra::builder(mesh).tissue(tissue).fix(Where::Group(FIXED.to_owned())).build();
        Ok(Self::new(Session::builder(body.map_err(palpate::Error::from)?), 1000.0))
    }

    /// Changes what is built.
    pub(crate) fn change(&mut self, change: impl FnOnce(SessionBuilder) -> SessionBuilder) -> Result<(), Failure> {
        let builder = self.builder.take().ok_or_else(broken)?;
        self.builder = Some(change(builder));
        Ok(())
    }

    pub(crate) fn set_rates(&mut self, haptic_hz: f64, global_hz: f64) -> Result<(), Failure> {
        let rate = |hz: f64, what: &str| {
            let rule = "must be 0.001 to 1000000 Hz with at most six decimals";
            Rate::from_hz(hz).ok_or_else(|| Failure::argument(format!("{what} is {hz}, {rule}")))
        };
        self.haptic = rate(haptic_hz, "haptic_hz")?;
        let global = RateGroup::new(rate(global_hz, "global_hz")?);
        let local = RateGroup::new(self.haptic);
        self.change(|builder| builder.local(local).global(global))
    }

    pub(crate) fn set_duration(&mut self, seconds: f64) -> Result<(), Failure> {
        self.has_end = true;
        self.change(|builder| builder.duration_s(seconds))
    }

    pub(crate) fn set_virtual(&mut self) -> Result<(), Failure> {
        self.is_virtual = true;
        self.change(SessionBuilder::virtual_time)
    }

    pub(crate) fn is_virtual(&self) -> bool {
        self.is_virtual
    }

    /// The session, in which palpate owns the haptic loop.
    pub(crate) fn session(mut self) -> Result<Session, Failure> {
        Ok(self.builder.take().ok_or_else(broken)?.build()?)
    }

    /// The session in which the program owns it, its ends of the devices, and the haptic rate.
    pub(crate) fn hosted(
        mut self,
        devices: &[(Option<String>, PalpateDevice)],
    ) -> Result<(Session, Vec<HostSide>, Rate), Failure> {
        let mut builder = self.builder.take().ok_or_else(broken)?;
        let mut hosts = Vec::with_capacity(devices.len());
        for (index, (name, device)) in devices.iter().enumerate() {
            let (hosted, host) = Hosted::new(device.capabilities(), device.first())?;
            builder = match name {
                None if devices.len() == 1 => builder.device(hosted),
                None => builder.named_device(format!("tool{index}"), hosted),
                Some(name) => builder.named_device(name.as_str(), hosted),
            };
            hosts.push(host);
        }
        builder = builder.local(RateGroup::new(self.haptic).hosted());
        if !self.has_end {
            builder = builder.endless();
        }
        Ok((builder.build()?, hosts, self.haptic))
    }
}

fn broken() -> Failure {
    Failure::argument("a call that changed this setup panicked: free it and begin anew")
}
