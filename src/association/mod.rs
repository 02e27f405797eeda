//! From likelihood ratios to association probabilities. Nothing here knows of states or sensors.

mod gate;
mod single;

pub use gate::Gate;
pub use single::{NearestNeighbour, Pda, PrintedPda, SingleAssociator};
