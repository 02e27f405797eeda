//! Complete trackers: each states its equations, its state and its step.

mod imm_pdaf;
mod printed;

pub use imm_pdaf::{ImmPdaf, State};
