//! Model reduction: linear systems of springs in few states, with what each reduction leaves out, and where a local model may be trusted.
//!
//! | what | how | error |
//! | --- | --- | --- |
//! | [`Balanced`] | square-root balanced truncation; Gramians mode by mode where damping is proportional, by a Schur form otherwise | twice the Hankel singular values left out (Enns 1984, Glover 1984) |
//! | [`low_rank`] | the same of a large system by way of its answers at real frequencies (rational Krylov) | the same, and that of the projection |
//! | [`one_shift`], [`many_shifts`] | congruences that match moments at real frequencies | [`ErrorBound`], from the residual |
//! | [`guyan`], [`craig_bampton`] | static condensation, and with modes of the inside | [`ErrorBound`] |
//! | [`patch`], [`PaperMesh::local`] | the paper's local model: part of the body between held surroundings | [`ErrorBound`]; [`LocalityCheck`] by contact |
//!
//! A [`SecondOrder`] system comes from the paper's meshes ([`PaperMesh`]), from any body around any state ([`LinearBody`]) or from its matrices.
//! Its ports are forces or displacements at any set of nodes, or at a point of a triangle. All frequencies of responses are in Hz, shifts
//! in rad/s.
//!
//! ```
//! use palpate_cli::reduction::{Balanced, Modal, PaperMesh, Response};
//!
//! # fn main() -> Result<(), palpate::model::ModelError> {
//! let system = PaperMesh::square(5).system()?;
//! let whole = Modal::new(&system).expect("its damping is proportional");
//! let balanced = Balanced::modal(&whole)?;
//! let reduced = balanced.truncated(20);
//! let [a, b] = [whole.at_hz(30.0), reduced.at_hz(30.0)].map(|gain| gain.expect("no pole there")[(0, 0)].norm());
//! assert!((a - b).abs() <= balanced.error_bound(20) + 1e-12 * a);
//! # Ok(())
//! # }
//! ```

mod balance;
mod condense;
mod congruence;
mod estimate;
mod gramian;
mod krylov;
mod linalg;
mod linear_body;
mod locality;
mod modal;
mod paper;
mod response;
mod system;
pub use balance::Balanced;
pub(crate) use balance::StateSpace;
pub use condense::{condensed, craig_bampton, guyan, patch};
pub use congruence::Congruence;
pub use estimate::ErrorBound;
pub use krylov::{Projection, low_rank, many_shifts, one_shift, spread_shifts};
pub(crate) use linalg::{CMatrix, Matrix};
pub use linear_body::LinearBody;
pub(crate) use locality::{ContactStiffness, stiffness_along};
pub use locality::{LocalityCheck, StiffnessError};
pub(crate) use modal::typical_gain_error;
pub use modal::{Modal, gain_error};
pub use paper::PaperMesh;
pub use response::{Response, largest_gain, log_spaced};
pub use system::{Ports, SecondOrder};
