//! Bodies against the reference series of the repository, which the package does not have.

#[path = "../common/mod.rs"]
mod common;
#[path = "../tissue_support/mod.rs"]
mod tissue_support;

mod reference_forces;
mod tissue_beams;
mod tissue_reference;
