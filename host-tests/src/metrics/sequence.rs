//! Tracking judged over a sequence of scans: error, identity, coverage.
//!
//! In each scan the true points and the estimates are paired optimally (least sum of
//! `min(c, d)^2`, pairs with d < c only; see [`super::matching`]). Over all scans, per target or in all:
//!
//! ```text
//! RMSE             = sqrt(mean of d^2 over the pairs)                                       [m]
//! identity changes = number of times a target's pair carries another track label than its
//!                    previous pair did (scans without a pair in between do not count)
//! coverage         = (scans with any estimate closer than c) / (scans with the target)     0..1
//! ```
//!
//! Coverage asks for an estimate nearby, not for one of its own: two targets that share one merged track
//! are both covered, while only one of them has a pair.

use super::{distance, match_points};
use std::collections::BTreeMap;

/// A point with an identity: a target's number or a track's label.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Labelled<P> {
    /// Who it is.
    pub label: u64,
    /// Where it is \[m\].
    pub position: P,
}

impl<P: AsRef<[f64]>> AsRef<[f64]> for Labelled<P> {
    fn as_ref(&self) -> &[f64] {
        self.position.as_ref()
    }
}

/// What a sequence of scans says about one target.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct TruthScore {
    /// Scans in which the target exists.
    pub scans: usize,
    /// Scans in which some estimate is closer than the cut-off.
    pub covered: usize,
    /// Scans in which it has an estimate of its own.
    pub pairs: usize,
    /// Times that estimate came from another track than before.
    pub identity_changes: usize,
    squared_error: f64,
    last_label: Option<u64>,
}

impl TruthScore {
    /// Root mean square distance of the pairs \[m\]; `None` without a pair.
    #[must_use]
    pub fn rmse(&self) -> Option<f64> {
        (self.pairs > 0).then(|| (self.squared_error / self.pairs as f64).sqrt())
    }

    /// Fraction of the scans with an estimate closer than the cut-off; `None` without scans.
    #[must_use]
    pub fn coverage(&self) -> Option<f64> {
        (self.scans > 0).then(|| self.covered as f64 / self.scans as f64)
    }

    fn add(&mut self, other: &Self) {
        self.scans += other.scans;
        self.covered += other.covered;
        self.pairs += other.pairs;
        self.identity_changes += other.identity_changes;
        self.squared_error += other.squared_error;
    }
}

/// Accumulates scans; [`Sequence::total`] and [`Sequence::per_target`] give the scores at any time.
#[derive(Debug, Clone)]
pub struct Sequence {
    cutoff: f64,
    targets: BTreeMap<u64, TruthScore>,
}

impl Sequence {
    /// An empty sequence; `cutoff` \[m\] is the distance at which an estimate stops being one of the target.
    #[must_use]
    pub fn new(cutoff: f64) -> Self {
        Self { cutoff, targets: BTreeMap::new() }
    }

    /// Adds one scan. Labels are unique within `truth` and within `estimates`.
    pub fn push<X: AsRef<[f64]>, Y: AsRef<[f64]>>(&mut self, truth: &[Labelled<X>], estimates: &[Labelled<Y>]) {
        for target in truth {
            let near = |estimate: &Labelled<Y>| distance(target.as_ref(), estimate.as_ref()) < self.cutoff;
            let score = self.targets.entry(target.label).or_default();
            score.scans += 1;
            score.covered += usize::from(estimates.iter().any(near));
        }
        for pair in match_points(truth, estimates, self.cutoff, 2.0).pairs {
            let score = self.targets.entry(truth[pair.truth].label).or_default();
            let label = estimates[pair.estimate].label;
            let before = score.last_label.replace(label);
            score.identity_changes += usize::from(before.is_some_and(|before| before != label));
            score.pairs += 1;
            score.squared_error += pair.distance.powi(2);
        }
    }

    /// The score of each target, by its label.
    pub fn per_target(&self) -> impl Iterator<Item = (u64, &TruthScore)> {
        self.targets.iter().map(|(label, score)| (*label, score))
    }

    /// All targets together.
    #[must_use]
    pub fn total(&self) -> TruthScore {
        let mut total = TruthScore::default();
        self.targets.values().for_each(|score| total.add(score));
        total
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn at(label: u64, x: f64, y: f64) -> Labelled<[f64; 2]> {
        Labelled { label, position: [x, y] }
    }

    #[test]
    fn swap_at_a_crossing_is_two_identity_changes() {
        let mut sequence = Sequence::new(10.0);
        sequence.push(&[at(1, 0.0, 0.0), at(2, 0.0, 50.0)], &[at(7, 3.0, 0.0), at(8, 0.0, 54.0)]);
        sequence.push(&[at(1, 0.0, 0.0), at(2, 0.0, 50.0)], &[at(8, 3.0, 0.0), at(7, 0.0, 54.0)]);
        let total = sequence.total();
        assert_eq!((total.scans, total.pairs, total.identity_changes), (4, 4, 2));
        assert_eq!(total.rmse(), Some(12.5_f64.sqrt()));
        assert_eq!(total.coverage(), Some(1.0));
    }

    #[test]
    fn identity_survives_a_gap_but_not_a_new_track() {
        let mut sequence = Sequence::new(10.0);
        let none: [Labelled<[f64; 2]>; 0] = [];
        let target = [at(1, 0.0, 0.0)];
        sequence.push(&target, &[at(5, 1.0, 0.0)]);
        sequence.push(&target, &none);
        sequence.push(&target, &[at(5, 1.0, 0.0)]);
        assert_eq!(sequence.total().identity_changes, 0);
        sequence.push(&target, &[at(6, 1.0, 0.0)]);
        assert_eq!(sequence.total().identity_changes, 1);
        assert_eq!(sequence.total().coverage(), Some(0.75));
    }

    #[test]
    fn merged_track_covers_both_targets_and_pairs_with_one() {
        let mut sequence = Sequence::new(10.0);
        sequence.push(&[at(1, 0.0, 0.0), at(2, 4.0, 0.0)], &[at(9, 1.0, 0.0)]);
        let scores: Vec<_> = sequence.per_target().map(|(id, s)| (id, s.covered, s.pairs)).collect();
        assert_eq!(scores, [(1, 1, 1), (2, 1, 0)]);
    }

    #[test]
    fn nothing_seen_is_undefined() {
        let sequence = Sequence::new(10.0);
        assert_eq!((sequence.total().rmse(), sequence.total().coverage()), (None, None));
    }

    proptest! {
        #[test]
        fn renaming_tracks_once_and_for_all_changes_nothing(
            scans in prop::collection::vec(
                prop::collection::vec([-20.0..20.0, -20.0..20.0_f64], 0..4), 1..8),
        ) {
            let truth = [at(1, -5.0, 0.0), at(2, 5.0, 0.0)];
            let mut original = Sequence::new(15.0);
            let mut renamed = Sequence::new(15.0);
            for scan in &scans {
                let label = |offset: u64| -> Vec<_> { scan.iter().zip(offset..)
                    .map(|(&position, label)| Labelled { label, position }).collect() };
                original.push(&truth, &label(0));
                renamed.push(&truth, &label(100));
            }
            let (original, renamed) = (original.total(), renamed.total());
            prop_assert_eq!(original.identity_changes, renamed.identity_changes);
            prop_assert_eq!(original.rmse(), renamed.rmse());
        }
    }
}
