//! The structs that cross the border. Each begins with its own size, which the caller sets: `size = sizeof(PalpateState)`.

use std::ffi::c_char;

use palpate::devices::{Capabilities, DeviceState};
use palpate::model::body::Tissue;
use palpate::model::contact::ContactMode;
use palpate::model::{Turn, turn_of, wxyz};
use palpate::session::ToolView;

/// A session that is being set up. A plain number: copy it freely; once used up or freed it is recognised.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub struct PalpateSetup {
    /// The number; 0 for none.
    pub id: u64,
}

/// A session that runs. A plain number: copy it freely; once stopped it is recognised.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub struct PalpateSession {
    /// The number; 0 for none.
    pub id: u64,
}

/// A block of springs: a lattice of nodes, each on springs to its 26 neighbours.
#[repr(C)]
#[derive(Clone, Copy, Debug)]
pub struct PalpateBlock {
    /// sizeof(PalpateBlock).
    pub size: u32,
    /// Faces that are held: bits 0 to 5 for x_min, x_max, y_min, y_max, z_min, z_max.
    pub fixed_faces: u32,
    /// Nodes along x, y and z, at least 2 each and at most 1000000 in all.
    pub nodes: [u32; 3],
    /// Extent along x, y and z (m); the block lies between the origin and there.
    pub size_m: [f64; 3],
    /// Stiffness of every spring (N/m); 0 for the library's default.
    pub stiffness_n_per_m: f64,
    /// Damping ratio of every spring; 0 for the library's default.
    pub damping_ratio: f64,
    /// Mass of every node (kg); 0 for the library's default.
    pub node_mass_kg: f64,
}

/// A body of tetrahedra. The arrays are copied.
#[repr(C)]
#[derive(Clone, Copy, Debug)]
pub struct PalpateTetrahedra {
    /// sizeof(PalpateTetrahedra).
    pub size: u32,
    /// Leave it 0.
    pub reserved: u32,
    /// Positions of the nodes (m), three numbers each.
    pub points_m: *const f64,
    /// Number of nodes.
    pub point_count: usize,
    /// The four nodes of each element, counted from 0.
    pub elements: *const u32,
    /// Number of elements.
    pub element_count: usize,
    /// Nodes that are held.
    pub fixed_nodes: *const u32,
    /// Number of nodes that are held; every connected part needs one.
    pub fixed_count: usize,
    /// Young's modulus (Pa); 0 for that of liver, 5000.
    pub young_modulus_pa: f64,
    /// Poisson's ratio, below 0.5; 0 for 0.45.
    pub poisson_ratio: f64,
    /// Density (kg/m^3); 0 for 1060.
    pub density_kg_per_m3: f64,
    /// Shear viscosity (Pa s); 0 for 2.
    pub viscosity_pa_s: f64,
}

/// What a host's device can do, and where it is at the start. A 0 stands for what is not known: a weak and soft device is then taken.
#[repr(C)]
#[derive(Clone, Copy, Debug)]
pub struct PalpateDevice {
    /// sizeof(PalpateDevice).
    pub size: u32,
    /// Leave it 0.
    pub reserved: u32,
    /// The name in logs and reports, of each of several; null for the only one.
    pub name: *const c_char,
    /// Largest force that it can or may exert (N).
    pub max_force_n: f64,
    /// Largest torque that it can or may exert (N m); 0 if it exerts none.
    pub max_torque_n_m: f64,
    /// Largest stiffness that it renders without a limit cycle (N/m).
    pub max_stiffness_n_per_m: f64,
    /// Largest damping that it renders without a limit cycle (N s/m).
    pub max_damping_n_s_per_m: f64,
    /// Radius of a ball in its workspace (m).
    pub workspace_radius_m: f64,
    /// Where the tool is before the first tick (m), in the axes of the body.
    pub position_m: [f64; 3],
    /// How it is turned then: w, x, y, z; all 0 if it tells no orientation.
    pub orientation: [f64; 4],
}

/// What a device tells, once per tick.
#[repr(C)]
#[derive(Clone, Copy, Debug)]
pub struct PalpateState {
    /// sizeof(PalpateState).
    pub size: u32,
    /// Pressed buttons, a bit each; the lowest 16 are taken.
    pub buttons: u32,
    /// Where the tool is (m), in the axes of the body.
    pub position_m: [f64; 3],
    /// How fast it moves (m/s).
    pub velocity_m_s: [f64; 3],
    /// The turn from the tool's own axes to those of the body: w, x, y, z, of length 1; all 0 if the device tells none.
    pub orientation: [f64; 4],
}

/// What a device is to exert, once per tick.
#[repr(C)]
#[derive(Clone, Copy, Debug)]
pub struct PalpateCommand {
    /// sizeof(PalpateCommand).
    pub size: u32,
    /// 1 if this tick computed it; 0 if the period had had its release, and it is the command of before.
    pub is_new: u32,
    /// Force on the tool (N), after all limits.
    pub force_n: [f64; 3],
    /// Torque about the tool's centre (N m); 0 for a device that exerts none.
    pub torque_n_m: [f64; 3],
    /// Time of the run (s), at which the command was fetched.
    pub time_s: f64,
}

/// What a contact does.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum PalpateContactMode {
    /// No force.
    Free = 0,
    /// The contact point follows the tool.
    Stick = 1,
    /// The tool slides over the surface.
    Slip = 2,
    /// Every node of the triangle is held: no force can be computed.
    Lost = 3,
}

/// The newest tool and its forces, for a program that draws.
#[repr(C)]
#[derive(Clone, Copy, Debug)]
pub struct PalpateTool {
    /// sizeof(PalpateTool).
    pub size: u32,
    /// State of its contact: a PalpateContactMode.
    pub mode: u32,
    /// Time of the run that it belongs to (s).
    pub time_s: f64,
    /// Where the simulated tool is (m).
    pub position_m: [f64; 3],
    /// How it is turned: w, x, y, z.
    pub orientation: [f64; 4],
    /// Force that the model computed (N): nobody feels it.
    pub computed_force_n: [f64; 3],
    /// Force that the device was commanded (N): what the hand feels.
    pub commanded_force_n: [f64; 3],
    /// Torque that the device was commanded (N m).
    pub commanded_torque_n_m: [f64; 3],
}

/// A place where a tool touches the body.
#[repr(C)]
#[derive(Clone, Copy, Debug)]
pub struct PalpateContact {
    /// sizeof(PalpateContact).
    pub size: u32,
    /// What it does: a PalpateContactMode.
    pub mode: u32,
    /// The triangle of the surface, by its place in `palpate_triangles`.
    pub triangle: u32,
    /// The tool, counted from 0.
    pub tool: u32,
    /// Time of the run that it belongs to (s).
    pub time_s: f64,
    /// Where (m).
    pub place_m: [f32; 3],
    /// Unit normal, from the surface to the tool.
    pub normal: [f32; 3],
    /// Force on the tool there (N).
    pub force_n: [f32; 3],
}

/// What a session came to.
#[repr(C)]
#[derive(Clone, Copy, Debug)]
pub struct PalpateSummary {
    /// sizeof(PalpateSummary).
    pub size: u32,
    /// Number of tools.
    pub tools: u32,
    /// Length of the run (s).
    pub duration_s: f64,
    /// Haptic ticks with a force, all tools together.
    pub ticks: u64,
    /// Local models that the global model has sent, all tools together.
    pub resyncs: u64,
    /// Periods without a release, all rate groups together.
    pub skipped: u64,
    /// Deadlines missed, all rate groups together.
    pub missed: u64,
    /// Largest force before the limits (N), of all tools.
    pub peak_force_n: f64,
    /// Largest force that a device was commanded (N), of all tools.
    pub peak_commanded_n: f64,
}

impl PalpateState {
    /// As a session takes it.
    #[inline]
    pub(crate) fn state(&self) -> DeviceState {
        DeviceState {
            position: self.position_m.into(),
            velocity: self.velocity_m_s.into(),
            orientation: turn(self.orientation),
            buttons: (self.buttons & 0xffff) as u16,
        }
    }
}

impl PalpateDevice {
    /// Where it is at the start.
    pub(crate) fn first(&self) -> DeviceState {
        DeviceState { position: self.position_m.into(), orientation: turn(self.orientation), ..DeviceState::default() }
    }

    /// What it can do; what is impossible is refused when the session is started.
    pub(crate) fn capabilities(&self) -> Capabilities {
        let weak = Capabilities::default();
        Capabilities {
            max_force_n: known(self.max_force_n, weak.max_force_n),
            max_torque_n_m: (self.max_torque_n_m != 0.0).then_some(self.max_torque_n_m),
            max_stiffness_n_per_m: known(self.max_stiffness_n_per_m, weak.max_stiffness_n_per_m),
            max_damping_n_s_per_m: known(self.max_damping_n_s_per_m, weak.max_damping_n_s_per_m),
            workspace_radius_m: known(self.workspace_radius_m, weak.workspace_radius_m),
            ..weak
        }
    }
}

impl PalpateTetrahedra {
    pub(crate) fn tissue(&self) -> Tissue {
        let liver = Tissue::LIVER;
        Tissue {
            young_modulus: known(self.young_modulus_pa, liver.young_modulus),
            poisson_ratio: known(self.poisson_ratio, liver.poisson_ratio),
            density: known(self.density_kg_per_m3, liver.density),
            viscosity: known(self.viscosity_pa_s, liver.viscosity),
        }
    }
}

/// `value`, or `default` where the program left it 0.
fn known(value: f64, default: f64) -> f64 {
    if value == 0.0 { default } else { value }
}

impl PalpateTool {
    pub(crate) fn of(view: &ToolView) -> Self {
        Self {
            size: size_of::<Self>() as u32,
            mode: mode(view.mode) as u32,
            time_s: view.time.as_secs_f64(),
            position_m: view.position.into(),
            orientation: wxyz(&view.orientation),
            computed_force_n: view.computed_force.into(),
            commanded_force_n: view.commanded_force.into(),
            commanded_torque_n_m: view.commanded_torque.into(),
        }
    }
}

pub(crate) fn mode(mode: ContactMode) -> PalpateContactMode {
    match mode {
        ContactMode::Free => PalpateContactMode::Free,
        ContactMode::Stick => PalpateContactMode::Stick,
        ContactMode::Slip => PalpateContactMode::Slip,
        ContactMode::Lost => PalpateContactMode::Lost,
    }
}

/// w, x, y, z as they are told: what is no turn is a fault of the device, which the session sees and counts.
fn turn(told: [f64; 4]) -> Turn {
    if told == [0.0; 4] { Turn::identity() } else { turn_of(told) }
}
