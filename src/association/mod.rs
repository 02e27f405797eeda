//! From likelihood ratios to association probabilities. Nothing here knows of states or sensors.

mod assignment;
mod beam;
mod cluster;
mod gate;
mod gnn;
mod jpda;
mod k_best;
mod lbp;
mod matrix;
mod merging;
mod partition;
mod scaling;
mod single;
mod small;
mod subsets;
mod sweep;
mod work;

pub use assignment::Assignment;
pub use gate::Gate;
pub use gnn::{Gnn, GnnMemory};
pub use jpda::{Jpda, JpdaMemory};
pub use k_best::KBest;
pub use matrix::{AssociationMatrix, Associator, ClutterPrior, Completeness, Domain};
pub use merging::{MergingJpda, MergingMemory, PairRow, UnresolvedPair, UnresolvedPairs};
pub use single::{NearestNeighbour, Pda, PrintedPda, SingleAssociator};
#[cfg(feature = "count")]
pub use work::take_operations;
