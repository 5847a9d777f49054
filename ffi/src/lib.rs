//! palpate for C and C++.
//!
//! The header `include/palpate.h` is made from this crate, `include/palpate.hpp` wraps it for C++17; the page `docs/c.md` of the
//! repository explains both. A Rust program has no use for it: it uses `palpate` itself.
//!
//! ```text
//! exports      the functions that C calls
//!    |         setup, session (contacts): what they are about
//!    |         haptic_loop: the sessions that a thread ticks
//!    v
//! boundary     nothing unwinds across it; codes and texts (code, last_error)
//! memory       the one place where pointers of C's are followed; types: what they point at
//! handles      what is alive, by number; fair_mutex: taken in turns
//! ```

mod boundary;
mod code;
mod contacts;
pub mod exports;
mod fair_mutex;
mod handles;
mod haptic_loop;
mod last_error;
mod memory;
mod session;
mod setup;
mod types;

pub use code::PalpateCode;
pub use types::{
    PalpateBlock, PalpateCommand, PalpateContact, PalpateContactMode, PalpateDevice, PalpateSession, PalpateSetup,
    PalpateState, PalpateSummary, PalpateTetrahedra, PalpateTool,
};
