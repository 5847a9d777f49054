//! Model reduction: linear systems of springs in few states, with what each reduction leaves out, and where a local model may be trusted.
//!
//! | what | how | error |
//! | --- | --- | --- |
//! | [`Balanced`] | square-root balanced truncation; Gramians mode by mode where damping is proportional, by a Schur form otherwise | twice the Hankel singular values left out (Enns 1984, Glover 1984) |
//! | [`low_rank`] | the same of a large system by way of its answers at real frequencies (rational Krylov) | the same, and that of the projection |
//! | [`one_shift`], [`krylov::many_shifts`] | congruences that match moments at real frequencies | [`ErrorBound`], from the residual |
//! | [`guyan`], [`craig_bampton`] | static condensation, and with modes of the inside | [`ErrorBound`] |
//! | [`patch`], [`PaperMesh::local`] | the paper's local model: part of the body between held surroundings | [`ErrorBound`]; [`LocalityCheck`] by contact |
//!
//! A [`SecondOrder`] system comes from the paper's meshes ([`PaperMesh`]), from any body around any state ([`LinearBody`]) or from its matrices.
//! Its ports are forces or displacements at any set of nodes, or at a point of a triangle. All frequencies of responses are in Hz, shifts
//! in rad/s.

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
#[cfg(test)]
mod tests;

pub(crate) use balance::{Balanced, StateSpace};
pub(crate) use condense::{condensed, craig_bampton, guyan, patch};
pub(crate) use estimate::ErrorBound;
pub(crate) use krylov::{Projection, low_rank, one_shift};
pub(crate) use linalg::{CMatrix, Matrix};
pub(crate) use linear_body::LinearBody;
pub(crate) use locality::{ContactStiffness, LocalityCheck, StiffnessError, stiffness_along};
pub(crate) use modal::{Modal, gain_error, typical_gain_error};
pub(crate) use paper::PaperMesh;
pub(crate) use response::{Response, log_spaced};
pub(crate) use system::SecondOrder;
