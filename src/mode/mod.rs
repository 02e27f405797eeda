//! Several motion models at once: which there are, and one density per model for a target that jumps between them.

mod active;
mod bank;
mod deviations;
mod likely;
mod mixing;
mod set;

pub use active::ActiveSet;
pub use bank::{JumpMatrix, ModeBank};
pub(crate) use bank::{LEAST_PROBABILITY, check_distribution};
pub use deviations::Deviations;
pub use likely::{Adaptation, LikelyModes};
pub use set::ModeSet;
