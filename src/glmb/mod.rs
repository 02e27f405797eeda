//! Labelled random finite sets: the pieces of the generalised labelled multi-Bernoulli filter.
//!
//! The posterior is a mixture of hypotheses. A hypothesis is a set of targets that exist, each known by its label and by which
//! detections it was seen in, and a weight:
//!
//! ```text
//! π(X) = Δ(X) Σ_h w_h δ_{I_h}(L(X)) Π_{(x,ℓ) ∈ X} p_{h,ℓ}(x)         Vo and Vo 2013; Vo, Vo and Hoang 2017 (joint prediction and update)
//! ```
//!
//! Hypotheses share most of their targets. A density p depends on its label and the detections of its past alone, so all
//! hypotheses index one table, and a target that a thousand of them agree on is filtered once.
//!
//! | file | holds |
//! |---|---|
//! | `density.rs` | what a density must do: predict, weigh detections, absorb one |
//! | `mixture.rs` | Gaussians in every mode: linear, extended and unscented filters |
//! | `particles.rs`, `random.rs` | points in every mode |
//! | `row.rs`, `look.rs` | what may become of one target in one scan, and how probable that is |
//! | `total.rs` | the weight of all events of a hypothesis together: what truncation is measured by |
//! | `ranked.rs`, `gibbs.rs` | truncation: the events of the greatest weight, or a random walk among them |
//! | `pool.rs`, `table.rs` | hypotheses: the heaviest, the same set once; the tracks that they are made of |
//! | `birth.rs` | where targets appear |
//! | `work.rs` | the most work that a scan can make |
//!
//! The tracker made of them is [`JmsGlmb`](crate::tracker::JmsGlmb).

mod birth;
mod density;
mod gibbs;
mod look;
mod mixture;
mod particles;
mod pool;
mod random;
mod ranked;
mod row;
mod table;
mod total;
mod work;

pub use birth::Region;
pub(crate) use birth::{Adaptive, Unexplained};
pub use density::{Density, Sight};
pub use gibbs::Gibbs;
pub(crate) use look::Look;
pub use mixture::Mixture;
pub use particles::Particles;
pub(crate) use pool::{Hypothesis, Pool};
pub use ranked::Ranked;
pub use row::{Event, Limits, Outcome, Problem, Row, Truncation};
pub(crate) use row::{GONE, ln_add};
pub(crate) use table::{Generation, Slot, decode, encode};
pub(crate) use total::ln_total;
pub use work::GlmbWork;
#[cfg(feature = "count")]
pub use work::take_work;
pub(crate) use work::{COUNTED, Capacities};

/// The identity of a target: never given twice in 2³² scans, and kept as long as the target is tracked.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord, Hash)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Label {
    /// The scan of its birth, from 0; scans at the time of the one before do not count
    pub birth_scan: u32,
    /// Where it was born: a region by its number, or beyond those a detection of the scan before by its place among those taken in
    pub index: u16,
}
