//! Dense and sparse linear algebra for reduced models and studies of them: the only room that talks to faer.
//!
//! Everything runs on the calling thread and gives the same bits every time.
//!
//! # Real-time
//! Not real-time safe: everything here allocates.

mod dense;
mod dissection;
mod sparse;

pub use dense::{
    ComplexMatrix, Matrix, cholesky, eigenvalues, lower_factor, product, product_t, solve_complex, solve_positive, svd,
    symmetric_eigen,
};
pub(crate) use dense::{eliminate, leading_combinations, leading_left_singular_vectors, modes};
pub use dissection::dissection;
pub use sparse::SparseFactor;
pub(crate) use sparse::push_block;
