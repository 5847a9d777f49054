//! Bodies, contact, tools and local models: what must hold for any input, hard cases, and closed solutions.

#[path = "../common/mod.rs"]
mod common;
#[path = "../kernel_support/mod.rs"]
mod kernel_support;
#[path = "../tissue_support/mod.rs"]
mod tissue_support;
#[path = "../tool_support/mod.rs"]
mod tool_support;

mod built_anew;
mod contact_hard_cases;
mod contact_invariants;
mod crushed_tissue;
mod implicit_step;
mod left_window;
mod paper_equations;
mod parcel;
mod restriction;
mod spring_kernel;
mod stick_slip;
mod tissue_law;
mod tissue_refusals;
mod tissue_restriction;
mod tool_hard_cases;
mod tool_invariants;
mod tool_press;
mod two_tools;
