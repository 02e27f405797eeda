//! The sets of pairs that are one, walked through cluster by cluster with one pair changing at a time.
//!
//! ```text
//! step n       the pair number k changes, 2^k the largest power that divides n: after 2^p − 1 steps all sets of p pairs were there
//! between      t empty, u as it is:         Z(S) β_t0 / m_t = Z(between),   Z(between) β_u0 / m_u = Z(t and u empty)
//! changed      t the row g, u empty, or both as they are:  the same from the other end
//! mixing       β ← β + w_n / (w_0 + … + w_n) (β_n − β),   w_n = Z(S_n) Π (1 − P_u) / that of the set without pairs
//! ```

use super::matrix::{AssociationMatrix, ClutterPrior};
use super::merging::{UnresolvedPair, UnresolvedPairs};
use super::partition::join;
use super::work::count;
use crate::scalar::{Real, exp, larger, ln};
use heapless::Vec;

/// The most pairs of one cluster.
pub(super) const TOGETHER: usize = 4;
/// Weights this small count for nothing but that the detection is somebody's, which diffuse clutter asks.
const TRACE: f64 = 1e-12;

/// The most associations with `pairs` pairs: two a step and one with all resolved.
pub(super) const fn associations(pairs: usize) -> u64 {
    (2 << if pairs < TOGETHER { pairs } else { TOGETHER }) - 1
}

/// Where a step stands.
#[derive(Clone, Copy, PartialEq, Eq)]
pub(super) enum Stage {
    /// The first track of the pair that changes is put aside.
    Between,
    /// The pair has joined or left.
    Changed,
}

/// The way through the sets of up to [`TOGETHER`] pairs of one cluster.
pub(super) struct Walk<T> {
    cluster: u16,
    /// Numbers of the pairs
    pairs: Vec<u16, TOGETHER>,
    /// Those that are one, a bit each
    as_one: usize,
    /// β_t0 of the pair that changes next
    none: T,
    /// ln w_n, and ln of the sum of all
    ln_weight: T,
    ln_sum: T,
}

impl<T: Real> Walk<T> {
    /// Whether there is a step number `step`.
    pub fn goes_on(&self, step: usize) -> bool {
        step < 1 << self.pairs.len()
    }

    /// The pair that changes in a step, its number in this walk, and whether it is one before.
    fn changing<'a, const DETS: usize>(
        &self,
        step: usize,
        pairs: &'a UnresolvedPairs<T, DETS>,
    ) -> Option<(&'a UnresolvedPair<T, DETS>, u32, bool)> {
        let k = step.trailing_zeros();
        let pair = pairs.get(usize::from(*self.pairs.get(k as usize)?))?;
        Some((pair, k, self.as_one >> k & 1 == 1))
    }

    /// From the set before to what is common with the one after: `other` is the association of the latter.
    pub fn leave<const TRACKS: usize, const DETS: usize>(
        &mut self,
        step: usize,
        other: &AssociationMatrix<T, TRACKS, DETS>,
        weights: &AssociationMatrix<T, TRACKS, DETS>,
        pairs: &UnresolvedPairs<T, DETS>,
    ) {
        let Some((pair, k, is_one)) = self.changing(step, pairs) else { return };
        let [_, second] = pair.rows;
        let emptied = logarithm(none(other, second)) - logarithm(none(weights, second)) - logarithm(pair.resolved);
        self.ln_weight += logarithm(self.none) - logarithm(empty(pair, weights, is_one)) + if is_one { -emptied } else { emptied };
        self.as_one ^= 1 << k;
    }

    /// On to the set after, of which `other` is the association; mixes it in.
    pub fn arrive<const TRACKS: usize, const DETS: usize>(
        &mut self,
        step: usize,
        other: &AssociationMatrix<T, TRACKS, DETS>,
        weights: &AssociationMatrix<T, TRACKS, DETS>,
        pairs: &mut UnresolvedPairs<T, DETS>,
        clusters: &[u16; TRACKS],
        matrix: &mut AssociationMatrix<T, TRACKS, DETS>,
    ) {
        let Some((pair, _, is_one)) = self.changing(step, pairs) else { return };
        self.ln_weight += logarithm(empty(pair, weights, is_one)) - logarithm(none(other, pair.rows[0]));
        if let Some((next, ..)) = self.changing(step + 1, pairs) {
            self.none = none(other, next.rows[0]);
        }
        self.ln_sum = sum_of(self.ln_sum, self.ln_weight);
        let share = exp(self.ln_weight - self.ln_sum);
        for row in (0..TRACKS).filter(|row| clusters[*row] == self.cluster) {
            count(other.columns());
            let part = if self.takes(row, pairs) { T::ZERO } else { T::ONE };
            if let Some(((beta_0, beta), (gamma_0, gamma))) = matrix.row_mut(row).zip(other.row(row)) {
                mix(beta_0, beta, (gamma_0, gamma), share, part);
            }
        }
        for (k, number) in self.pairs.iter().enumerate() {
            let Some(pair) = pairs.get_mut(usize::from(*number)) else { return };
            let part = if self.as_one >> k & 1 == 1 { T::ONE } else { T::ZERO };
            if let Some(gamma) = other.row(usize::from(pair.rows[0])) {
                mix(&mut pair.probability.miss, &mut pair.probability.hit, gamma, share, part);
            }
        }
    }

    /// Whether the track in `row` is of a pair that is one.
    fn takes<const DETS: usize>(&self, row: usize, pairs: &UnresolvedPairs<T, DETS>) -> bool {
        let one = self.pairs.iter().enumerate().filter(|(k, _)| self.as_one >> k & 1 == 1);
        one.filter_map(|(_, number)| pairs.get(usize::from(*number))).any(|pair| pair.rows.iter().any(|own| usize::from(*own) == row))
    }
}

/// Mixes `part` of probabilities into a row, by `share`.
fn mix<T: Real>(beta_0: &mut T, beta: &mut [T], (gamma_0, gamma): (T, &[T]), share: T, part: T) {
    *beta_0 += share * (part * gamma_0 - *beta_0);
    for (beta, gamma) in beta.iter_mut().zip(gamma) {
        *beta += share * (part * *gamma - *beta);
    }
}

/// The clusters of rows, those of two tracks of a pair made one, and those whose detections a pair may have.
pub(super) fn clusters<T: Real, const TRACKS: usize, const DETS: usize>(
    resolved: &[u16; TRACKS],
    weights: &AssociationMatrix<T, TRACKS, DETS>,
    pairs: &UnresolvedPairs<T, DETS>,
) -> [u16; TRACKS] {
    if weights.clutter == ClutterPrior::Diffuse {
        return [0; TRACKS];
    }
    let mut clusters = *resolved;
    for (number, pair) in pairs.iter().enumerate() {
        let [first, second] = pair.rows.map(usize::from);
        join(&mut clusters, first, second);
        let shares = |hit: &[T]| hit.iter().zip(&pair.weight.hit).any(|(h, g)| *h > T::ZERO && *g > T::ZERO);
        count((TRACKS + number) * weights.columns());
        for row in 0..TRACKS {
            if weights.row(row).is_some_and(|(_, hit)| shares(hit)) {
                join(&mut clusters, first, row);
            }
        }
        for earlier in pairs.iter().take(number).filter(|earlier| shares(&earlier.weight.hit)) {
            join(&mut clusters, first, usize::from(earlier.rows[0]));
        }
    }
    clusters
}

/// Leaves every cluster its first [`TOGETHER`] pairs. Returns how many are gone.
pub(super) fn thin_out<T: Real, const TRACKS: usize, const DETS: usize>(
    pairs: &mut UnresolvedPairs<T, DETS>,
    clusters: &[u16; TRACKS],
) -> u16 {
    let (mut counts, before) = ([0; TRACKS], pairs.len());
    pairs.retain(|pair| {
        let cluster = clusters.get(usize::from(pair.rows[0]));
        cluster.and_then(|cluster| counts.get_mut(usize::from(*cluster))).is_some_and(|count| {
            *count += 1;
            *count <= TOGETHER
        })
    });
    (before - pairs.len()) as u16
}

/// A walk for every cluster with pairs.
pub(super) fn walks<T: Real, const TRACKS: usize, const DETS: usize, const PAIRS: usize>(
    pairs: &UnresolvedPairs<T, DETS>,
    clusters: &[u16; TRACKS],
) -> Vec<Walk<T>, PAIRS> {
    let mut walks: Vec<Walk<T>, PAIRS> = Vec::new();
    for (number, pair) in (0..).zip(pairs) {
        let Some(cluster) = clusters.get(usize::from(pair.rows[0])).copied() else { continue };
        if let Some(walk) = walks.iter_mut().find(|walk| walk.cluster == cluster) {
            let _ = walk.pairs.push(number);
        } else {
            let (mut own, as_one, ln_weight, ln_sum) = (Vec::new(), 0, T::ZERO, T::ZERO);
            let _ = own.push(number);
            let _ = walks.push(Walk { cluster, pairs: own, as_one, none: pair.alone, ln_weight, ln_sum });
        }
    }
    walks
}

/// Makes of `other` the rows of the sets that the walks stand at; rows of others are empty.
#[inline(never)]
pub(super) fn compose<T: Real, const TRACKS: usize, const DETS: usize>(
    other: &mut AssociationMatrix<T, TRACKS, DETS>,
    weights: &AssociationMatrix<T, TRACKS, DETS>,
    pairs: &UnresolvedPairs<T, DETS>,
    walks: &[Walk<T>],
    clusters: &[u16; TRACKS],
    step: usize,
    stage: Stage,
) {
    count(TRACKS * weights.columns());
    other.copy_from(weights);
    let going = || walks.iter().filter(|walk| walk.goes_on(step));
    for (row, cluster) in (0u16..).zip(clusters) {
        if going().all(|walk| walk.cluster != *cluster) {
            clear(other, row);
        }
    }
    for walk in going() {
        for (k, number) in walk.pairs.iter().enumerate() {
            let Some(pair) = pairs.get(usize::from(*number)) else { return };
            let [first, second] = pair.rows;
            if stage == Stage::Between && k == step.trailing_zeros() as usize {
                clear(other, first);
            } else if walk.as_one >> k & 1 == 1 {
                clear(other, first);
                clear(other, second);
                if let Some((miss, hit)) = other.row_mut(usize::from(first)) {
                    *miss = pair.weight.miss;
                    hit.iter_mut().zip(&pair.weight.hit).for_each(|(h, g)| *h += *g);
                }
            }
        }
    }
}

/// Leaves a track nothing but no detection.
fn clear<T: Real, const TRACKS: usize, const DETS: usize>(matrix: &mut AssociationMatrix<T, TRACKS, DETS>, track: u16) {
    let share = if matrix.clutter == ClutterPrior::Diffuse { T::lit(TRACE) } else { T::ZERO };
    count(matrix.columns());
    if let Some((miss, hit)) = matrix.row_mut(usize::from(track)) {
        *miss = T::ONE;
        hit.iter_mut().for_each(|h| *h *= share);
    }
}

/// Of the track in `row`, that it has no detection: its weight, or after an association its probability.
pub(super) fn none<T: Real, const TRACKS: usize, const DETS: usize>(matrix: &AssociationMatrix<T, TRACKS, DETS>, row: u16) -> T {
    matrix.miss.get(usize::from(row)).copied().unwrap_or(T::ONE)
}

/// The weight of "no detection" in the row of the first track of a pair.
fn empty<T: Real, const TRACKS: usize, const DETS: usize>(
    pair: &UnresolvedPair<T, DETS>,
    weights: &AssociationMatrix<T, TRACKS, DETS>,
    is_one: bool,
) -> T {
    if is_one { pair.weight.miss } else { none(weights, pair.rows[0]) }
}

/// ln x, finite.
fn logarithm<T: Real>(x: T) -> T {
    ln(larger(T::LEAST, x))
}

/// ln (e^a + e^b)
fn sum_of<T: Real>(a: T, b: T) -> T {
    let (low, high) = if a > b { (b, a) } else { (a, b) };
    high + ln(T::ONE + exp(low - high))
}
