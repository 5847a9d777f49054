//! What the command `palpate` is made of.

pub mod reduction;
