//! Several motion models at once: which there are, and one density per model for a target that jumps between them.

mod bank;
mod set;

pub use bank::{JumpMatrix, ModeBank};
pub(crate) use bank::{LEAST_PROBABILITY, check_distribution};
pub use set::ModeSet;
