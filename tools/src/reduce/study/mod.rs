//! What `palpate reduce` does: the paper's tables and figures, any of its meshes, and the locality check of a scene.

use palpate::Error;
use palpate::scene::NodeSpec;

mod contact;
mod figures;
mod measure;
mod mesh;
mod paper;
mod scene;

pub use mesh::reduce_mesh;
pub use paper::reduce_paper;
pub use scene::reduce_scene;

/// A table or figure of the paper's.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum PaperStudy {
    /// Orders and errors of 2D and 3D meshes.
    Table1,
    /// Errors by damping ratio.
    Table2,
    /// Responses of the full and the balanced model.
    Fig4,
    /// Where the balanced states move the mesh.
    Fig5,
    /// Responses of the full, the local, the balanced and other reduced models.
    Fig8,
}

impl PaperStudy {
    /// All studies, in the paper's order.
    pub const ALL: [Self; 5] = [Self::Table1, Self::Table2, Self::Fig4, Self::Fig5, Self::Fig8];

    /// Name of the study on the command line.
    pub fn name(self) -> &'static str {
        ["table1", "table2", "fig4", "fig5", "fig8"][self as usize]
    }
}

/// A mesh like the paper's of any size.
#[derive(Clone, Debug, PartialEq)]
pub struct MeshStudy {
    /// Cells along each axis, two or three numbers.
    pub cells: Vec<usize>,
    /// Damping ratio zeta.
    pub damping_ratio: f64,
    /// Stiffness k of every spring (N/m).
    pub stiffness_n_per_m: f64,
    /// Mass m of every node (kg).
    pub node_mass_kg: f64,
    /// States of the reduced models.
    pub order: usize,
    /// Frequencies of the responses (Hz); empty for a choice of them.
    pub hz: Vec<f64>,
}

impl Default for MeshStudy {
    fn default() -> Self {
        Self {
            cells: vec![12, 12],
            damping_ratio: 1.0,
            stiffness_n_per_m: 100.0,
            node_mass_kg: 1e-3,
            order: 20,
            hz: Vec::new(),
        }
    }
}

/// The choice of what is to be found out about a scene.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct ReduceOptions {
    /// Patch nodes along the surface, along it, into depth, in place of the scene's.
    pub patch: Option<[usize; 3]>,
    /// The contact that is looked at closely, a surface node; left out: where the scene's tool touches first.
    pub node: Option<NodeSpec>,
    /// Looks at every so many nodes only of the surface along each axis; left out: all of a small surface, fewer of a large one.
    pub every: Option<usize>,
    /// An error budget (%): which patch and which r it needs.
    pub error_pct: Option<f64>,
    /// States of the balanced model; left out: 20.
    pub order: Option<usize>,
    /// True if the error at the contact is measured too, in the time domain and with the non-linear models.
    pub measure: bool,
}

fn no_modes() -> Error {
    Error::scene("cells", "the mesh has no modes: a number of it is not finite, or nothing holds it")
}

/// Shows how far the work is, step by step.
struct Steps<'a> {
    of: usize,
    done: usize,
    show: &'a mut dyn FnMut(&ReduceProgress),
}

impl<'a> Steps<'a> {
    fn new(of: usize, show: &'a mut dyn FnMut(&ReduceProgress)) -> Self {
        Self { of, done: 0, show }
    }

    /// Begins the next step.
    fn begin(&mut self, what: impl Into<String>) {
        (self.show)(&ReduceProgress { what: what.into(), done: self.done, of: self.of });
        self.done += 1;
    }
}

/// How far a reduction is.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct ReduceProgress {
    /// Name of the step that is being done.
    pub what: String,
    /// Number of steps that are done.
    pub done: usize,
    /// Number of steps in all.
    pub of: usize,
}
