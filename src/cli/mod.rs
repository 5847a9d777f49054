//! The subcommands of `palpate`, one file each.

pub mod export;
pub mod timing;

mod output;
