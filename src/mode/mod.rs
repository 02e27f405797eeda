//! Several motion models at once: which there are, and one density per model for a target that jumps between them.

mod bank;
mod set;

pub(crate) use bank::check_distribution;
pub use bank::{JumpMatrix, ModeBank};
pub use set::ModeSet;
