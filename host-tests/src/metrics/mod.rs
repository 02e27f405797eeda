//! How good is a set of estimates? Distances between point sets, consistency, tracking over time.
//!
//! | module | metric |
//! |---|---|
//! | [`matching`] | the optimal pairing of truth and estimates below a cut-off, which the others rest on |
//! | [`point_sets`] | OSPA (Schuhmacher, Vo & Vo 2008), GOSPA with alpha = 2 (Rahmathullah et al. 2017) |
//! | [`mod@consistency`] | NEES and its 95 % chi-square interval (Bar-Shalom, Li & Kirubarajan 2001, 5.4) |
//! | [`sequence`] | over a sequence of scans: RMSE of pairs, identity changes, coverage |
//!
//! A point is anything that is a slice of coordinates (`[f64; 2]`, `Vec<f64>`); the base distance is
//! Euclidean. A point that is not finite is never close to anything, so a diverged estimate counts
//! as a false one and its target as missed. All computation is in f64, whatever the tracker ran in.

pub mod consistency;
pub mod matching;
pub mod point_sets;
pub mod sequence;

pub use consistency::{Consistency, chi_square_quantile, consistency, nees};
pub use matching::{Matching, Pair, match_points};
pub use point_sets::{Gospa, Ospa, gospa, ospa};
pub use sequence::{Labelled, Sequence, TruthScore};

/// Euclidean distance of two points \[m\]; coordinates that only one of them has count as zero.
#[must_use]
pub fn distance(a: &[f64], b: &[f64]) -> f64 {
    let coordinate = |p: &[f64], i: usize| p.get(i).copied().unwrap_or(0.0);
    (0..a.len().max(b.len())).map(|i| (coordinate(a, i) - coordinate(b, i)).powi(2)).sum::<f64>().sqrt()
}
