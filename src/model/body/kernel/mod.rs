//! The force kernels: eight springs or elements at once, by explicit vector instructions that are chosen at run time.
//!
//! [`simd`] says what the kernels ask of an instruction set; `avx512`, `avx2` and `portable` answer it. [`lattice`] is the
//! kernel of a block, [`network`] that of an arbitrary list of springs, [`tetrahedra`] that of elements. All divide their
//! work into parts, one for each core; a part has memory of its own, and what it adds to nodes of another is added at the
//! end, in a fixed order: results are bit-identical from run to run, for one instruction set and number of cores.

#[cfg(target_arch = "x86_64")]
mod avx2;
#[cfg(target_arch = "x86_64")]
mod avx512;
mod colouring;
mod cores;
mod growth;
mod lattice;
mod network;
mod nodes;
mod numbering;
mod portable;
mod pull;
mod simd;
mod tetrahedra;

/// What the vector kernels take for a spring on an AVX-512 machine (s; `cargo bench --bench spring_kernel`).
pub(super) const NOMINAL_SPRING_S: f64 = 2e-9;
/// The same of an element (s).
pub(super) const NOMINAL_ELEMENT_S: f64 = 10e-9;

pub(super) use lattice::LatticeKernel;
pub(crate) use network::NetworkKernel;
pub(super) use nodes::Lane;
pub(crate) use nodes::{LANES, Singles};
pub use simd::InstructionSet;
pub(crate) use simd::{Simd, Work};
pub(super) use tetrahedra::TetrahedraKernel;
