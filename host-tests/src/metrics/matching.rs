//! The optimal pairing of truth points with estimates that OSPA, GOSPA and the sequence scores share.
//!
//! Over all ways to pair the smaller set with distinct points of the larger one, minimise
//!
//! ```text
//! sum over pairs of min(c, d(x, y))^p
//! ```
//!
//! A pair at or beyond the cut-off c costs c^p, which is what GOSPA (alpha = 2) charges for one missed
//! and one false point; so the same pairing minimises OSPA's and GOSPA's sum, and only pairs closer
//! than c are reported.
//!
//! The assignment is solved by the Hungarian algorithm in integers: each cost is an integer multiple of
//! 2^-96 of the largest, which holds every f64 down to 2^-43 of it exactly. Floating-point labels could
//! miss a zero slack by rounding; integers cannot.

use super::distance;
use pathfinding::prelude::{Matrix, kuhn_munkres_min};

/// Truth point `truth` and estimate `estimate` (indices into their slices) at `distance` < c.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Pair {
    /// Index of the truth point.
    pub truth: usize,
    /// Index of the estimate.
    pub estimate: usize,
    /// Euclidean distance \[m\], below the cut-off.
    pub distance: f64,
}

/// The optimal pairing, in order of the truth points.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Matching {
    /// All pairs closer than the cut-off.
    pub pairs: Vec<Pair>,
}

impl Matching {
    /// Sum of d^p over the pairs.
    #[must_use]
    pub fn cost(&self, order: f64) -> f64 {
        self.pairs.iter().map(|pair| pair.distance.powf(order)).sum()
    }
}

/// Pairs `truth` with `estimates` so that the sum of `min(cutoff, d)^order` is least.
///
/// `cutoff` \[m\] and `order` are positive and finite; otherwise nothing is paired.
pub fn match_points<X: AsRef<[f64]>, Y: AsRef<[f64]>>(truth: &[X], estimates: &[Y], cutoff: f64, order: f64) -> Matching {
    let between = |t: usize, e: usize| distance(truth[t].as_ref(), estimates[e].as_ref());
    let usable = |x: f64| x.is_finite() && x > 0.0;
    if truth.is_empty() || estimates.is_empty() || !usable(cutoff) || !usable(order) {
        return Matching::default();
    }
    // The algorithm wants no more rows than columns.
    let turned = truth.len() > estimates.len();
    let (rows, columns) = match turned {
        false => (truth.len(), estimates.len()),
        true => (estimates.len(), truth.len()),
    };
    let oriented = |row: usize, column: usize| if turned { (column, row) } else { (row, column) };
    let costs = Matrix::from_fn(rows, columns, |(row, column)| {
        let (t, e) = oriented(row, column);
        integer_cost(between(t, e), cutoff, order)
    });
    let (_, column_of) = kuhn_munkres_min(&costs);

    let mut pairs: Vec<Pair> = column_of
        .into_iter()
        .enumerate()
        .map(|(row, column)| {
            let (t, e) = oriented(row, column);
            Pair { truth: t, estimate: e, distance: between(t, e) }
        })
        .filter(|pair| pair.distance < cutoff)
        .collect();
    pairs.sort_by_key(|pair| pair.truth);
    Matching { pairs }
}

/// `(min(cutoff, d) / cutoff)^order` in units of 2^-96; a distance that is not a number is beyond any cut-off.
fn integer_cost(d: f64, cutoff: f64, order: f64) -> i128 {
    const UNITS: f64 = (1_u128 << 96) as f64;
    let relative = if d < cutoff { (d / cutoff).powf(order) } else { 1.0 };
    (relative * UNITS) as i128
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    /// The definition itself: every way to pair, by recursion over the truth points.
    fn least_sum(truth: &[[f64; 2]], free: &mut Vec<[f64; 2]>, c: f64, p: f64) -> f64 {
        let Some((first, rest)) = truth.split_first() else { return 0.0 };
        let spare = truth.len() > free.len();
        let mut best = if spare { least_sum(rest, free, c, p) } else { f64::INFINITY };
        for i in 0..free.len() {
            let taken = free.swap_remove(i);
            let here = distance(first, &taken).min(c).powf(p);
            best = best.min(here + least_sum(rest, free, c, p));
            free.push(taken);
            let last = free.len() - 1;
            free.swap(i, last);
        }
        best
    }

    fn points(most: usize) -> impl Strategy<Value = Vec<[f64; 2]>> {
        prop::collection::vec([-50.0..50.0, -50.0..50.0_f64], 0..=most)
    }

    proptest! {
        #[test]
        fn no_other_pairing_is_cheaper(
            truth in points(5), estimates in points(5), c in 1.0..80.0_f64, p in 1..3_i32,
        ) {
            let p = f64::from(p);
            let matching = match_points(&truth, &estimates, c, p);
            let beyond = truth.len().min(estimates.len()) - matching.pairs.len();
            let cost = matching.cost(p) + beyond as f64 * c.powf(p);
            let least = least_sum(&truth, &mut estimates.clone(), c, p);
            prop_assert!((cost - least).abs() <= 1e-9 * (1.0 + least), "{cost} against {least}");
        }

        #[test]
        fn pairs_are_distinct_and_close(truth in points(8), estimates in points(8)) {
            let matching = match_points(&truth, &estimates, 20.0, 1.0);
            let mut taken: Vec<_> = matching.pairs.iter().map(|pair| pair.estimate).collect();
            taken.sort_unstable();
            taken.dedup();
            prop_assert_eq!(taken.len(), matching.pairs.len());
            prop_assert!(matching.pairs.is_sorted_by(|a, b| a.truth < b.truth));
            prop_assert!(matching.pairs.iter().all(|pair| pair.distance < 20.0));
        }
    }

    #[test]
    fn diverged_estimate_pairs_with_nothing() {
        let truth = [[0.0, 0.0], [5.0, 0.0]];
        let estimates = [[f64::NAN, 0.0], [5.5, 0.0]];
        let matching = match_points(&truth, &estimates, 10.0, 2.0);
        assert_eq!(matching.pairs, [Pair { truth: 1, estimate: 1, distance: 0.5 }]);
    }

    #[test]
    fn meaningless_parameters_pair_nothing() {
        for (c, p) in [(0.0, 1.0), (f64::NAN, 1.0), (10.0, f64::INFINITY), (10.0, -1.0)] {
            assert!(match_points(&[[0.0]], &[[0.0]], c, p).pairs.is_empty());
        }
    }
}
