//! What one run of one tracker is worth.
//!
//! ```text
//! own label   the label of the track that a target is first paired with
//! end         of every target, over its last five scans:  lost where most have no pair, exchanged where most pairs have another
//!             label than its own;  a run ends as its worst target does
//! OSPA, GOSPA by scan with the stage's cut-off, order 1, mean over scans
//! NEES        e' P⁻¹ e / axes of the position, mean over all pairs of kept targets with their own tracks:  1 where P is honest
//! ```
//!
//! Pairs are the optimal ones below the cut-off, scan by scan.

use super::follow::Seen;
use super::stage::Truth;
use crate::metrics::{gospa, match_points, nees, ospa};
use crate::statistics::mean;
use std::collections::BTreeMap;

/// How a run ends, the worst last.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum End {
    /// Every target with its own track
    Kept,
    /// One with another's, or with one that began later
    Exchanged,
    /// One without
    Lost,
}

/// The figures of a run.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Score {
    /// How it ends
    pub end: End,
    /// \[m\]
    pub ospa: f64,
    /// \[m\]
    pub gospa: f64,
    /// `None` where no target was kept
    pub nees: Option<f64>,
}

/// The last scans of a target, which say how its track ends.
const LAST: usize = 5;

/// One target paired with a track, or not.
#[derive(Clone, Copy)]
struct Pairing {
    label: Option<u64>,
    nees: Option<f64>,
}

impl Score {
    /// Of the estimates `seen` where `truth` was.
    pub fn new(truth: &[Truth], seen: &[Vec<Seen>], cutoff: f64) -> Self {
        let mut lives: BTreeMap<u64, Vec<Pairing>> = BTreeMap::new();
        let (mut of_ospa, mut of_gospa) = (Vec::new(), Vec::new());
        for (truth, seen) in truth.iter().zip(seen) {
            let positions: Vec<[f64; 3]> = seen.iter().map(|seen| seen.position).collect();
            of_ospa.push(ospa(truth, &positions, cutoff, 1.0).ospa);
            of_gospa.push(gospa(truth, &positions, cutoff, 1.0).gospa);
            let pairs = match_points(truth, &positions, cutoff, 1.0).pairs;
            for (number, target) in truth.iter().enumerate() {
                let found = pairs.iter().find(|pair| pair.truth == number).map(|pair| &seen[pair.estimate]);
                let pairing = Pairing { label: found.map(|s| s.label), nees: found.and_then(|s| normalised(s, &target.position)) };
                lives.entry(target.label).or_default().push(pairing);
            }
        }
        let ends: Vec<(End, &Vec<Pairing>, Option<u64>)> = lives
            .values()
            .map(|life| {
                let own = life.iter().find_map(|pairing| pairing.label);
                (end(life, own), life, own)
            })
            .collect();
        let kept = ends.iter().filter(|(end, ..)| *end == End::Kept);
        let own = kept.flat_map(|(_, life, own)| life.iter().filter(|pairing| pairing.label == *own).filter_map(|pairing| pairing.nees));
        let average = |values: Vec<f64>| mean(values).map_or(f64::NAN, |m| m.mean);
        Self {
            nees: mean(own).map(|m| m.mean),
            end: ends.iter().map(|(end, ..)| *end).max().unwrap_or(End::Kept),
            ospa: average(of_ospa),
            gospa: average(of_gospa),
        }
    }
}

/// e' P⁻¹ e a component.
fn normalised(seen: &Seen, truth: &[f64; 3]) -> Option<f64> {
    let axes = seen.cov.len().isqrt();
    let error: Vec<f64> = seen.position.iter().zip(truth).take(axes).map(|(x, t)| x - t).collect();
    nees(&error, &seen.cov).map(|nees| nees / axes as f64)
}

fn end(life: &[Pairing], own: Option<u64>) -> End {
    let last = &life[life.len().saturating_sub(LAST)..];
    let count = |of: &dyn Fn(&&Pairing) -> bool| last.iter().filter(of).count();
    let (paired, with_own) = (count(&|p| p.label.is_some()), count(&|p| p.label.is_some() && p.label == own));
    match (2 * paired > last.len(), 2 * with_own > paired) {
        (false, _) => End::Lost,
        (true, false) => End::Exchanged,
        (true, true) => End::Kept,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::metrics::Labelled;

    fn at(label: u64, x: f64) -> Labelled<[f64; 3]> {
        Labelled { label, position: [x, 0.0, 0.0] }
    }

    fn seen(label: u64, x: f64) -> Seen {
        Seen { label, position: [x, 0.0, 0.0], cov: vec![4.0, 0.0, 0.0, 1.0] }
    }

    /// Ten scans of two targets at 0 and 100 m; `tracks` by scan.
    fn score(tracks: impl Fn(usize) -> Vec<Seen>) -> Score {
        let truth = vec![vec![at(0, 0.0), at(1, 100.0)]; 10];
        Score::new(&truth, &(0..10).map(tracks).collect::<Vec<_>>(), 20.0)
    }

    #[test]
    fn a_run_is_worth_what_it_is_by_hand() {
        // Errors of 2 and 0 m: NEES 4/4 and 0 over two axes.
        let kept = score(|_| vec![seen(7, 2.0), seen(8, 100.0)]);
        assert_eq!((kept.end, kept.ospa, kept.gospa, kept.nees), (End::Kept, 1.0, 2.0, Some(0.25)));
        // One is lost for the last five scans, half a cut-off to GOSPA, a whole one of two to OSPA; the other's NEES is left.
        let lost = score(|k| if k < 5 { vec![seen(7, 2.0), seen(8, 100.0)] } else { vec![seen(7, 2.0)] });
        assert_eq!((lost.end, lost.ospa, lost.gospa, lost.nees), (End::Lost, 6.0, 7.0, Some(0.5)));
    }

    #[test]
    fn labels_that_change_places_are_an_exchange_and_those_that_return_are_not() {
        let swapped = |from: usize, to: usize| {
            score(move |k| if (from..to).contains(&k) { vec![seen(8, 0.0), seen(7, 100.0)] } else { vec![seen(7, 0.0), seen(8, 100.0)] })
                .end
        };
        assert_eq!([swapped(4, 10), swapped(7, 10), swapped(8, 10), swapped(2, 6)], [End::Exchanged, End::Exchanged, End::Kept, End::Kept]);
        assert_eq!(score(|_| Vec::new()).end, End::Lost);
        assert_eq!(score(|_| Vec::new()).nees, None);
        assert_eq!(score(|_| vec![seen(1, f64::NAN), seen(2, 100.0)]).end, End::Lost);
    }
}
