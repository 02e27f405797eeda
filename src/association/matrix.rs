//! What joint association works on: weights of tracks against detections going in, probabilities coming out.
//!
//! ```text
//! an event gives every track one detection or none, and no detection to two tracks
//! weight of an event = Π_t (miss_t where track t has none, hit_tj where it has detection j)
//! Poisson clutter      miss = 1 − P_D P_G,  hit = P_D L / λ
//! diffuse clutter      the same with λ = m / V, times φ! V^−φ as a multiple of its value with no track served: with
//!                      k served Π_{i<k} m / (m − i);  m detections are gated by any track, φ = m − k are clutter
//! ```
//!
//! A factor common to a row changes nothing. Association sees these numbers and never a state.

use super::merging::UnresolvedPairs;
use crate::scalar::{Real, larger};

/// What is known of clutter, as far as joint events care.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum ClutterPrior {
    /// Its density is in the weights.
    Poisson,
    /// φ! / V^φ over the detections gated by any track; the weights are those of λ = m / V.
    Diffuse,
}

/// The scale of the weights.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Domain {
    /// Weights as they are
    Linear,
    /// Natural logarithms of the weights, −∞ for zero
    Logarithmic,
}

/// The weights of `TRACKS` rows and up to `DETS` columns; an [`Associator`] replaces them by probabilities.
#[derive(Clone, Debug)]
pub struct AssociationMatrix<T, const TRACKS: usize, const DETS: usize> {
    /// The weight, then the probability β_t0, of "none of the detections is that of track t"
    pub miss: [T; TRACKS],
    /// The weight, then the probability β_tj, of "detection j is that of track t"; zero weight outside the gate
    pub hit: [[T; DETS]; TRACKS],
    /// What joint events pay for clutter
    pub clutter: ClutterPrior,
    /// Of the weights; probabilities are always linear.
    pub domain: Domain,
    columns: usize,
}

impl<T: Real, const TRACKS: usize, const DETS: usize> Default for AssociationMatrix<T, TRACKS, DETS> {
    fn default() -> Self {
        Self::new()
    }
}

impl<T: Real, const TRACKS: usize, const DETS: usize> AssociationMatrix<T, TRACKS, DETS> {
    /// No columns, all zero bits.
    #[must_use]
    pub const fn new() -> Self {
        Self { miss: [T::ZERO; TRACKS], hit: [[T::ZERO; DETS]; TRACKS], clutter: ClutterPrior::Poisson, domain: Domain::Linear, columns: 0 }
    }

    /// Starts a scan of `columns` detections (at most `DETS`): every row has no detection, for certain.
    pub fn reset(&mut self, columns: usize, clutter: ClutterPrior, domain: Domain) {
        (self.columns, self.clutter, self.domain) = (columns.min(DETS), clutter, domain);
        let (one, zero) = match domain {
            Domain::Linear => (T::ONE, T::ZERO),
            Domain::Logarithmic => (T::ZERO, -T::ONE / T::ZERO),
        };
        for (miss, hit) in self.miss.iter_mut().zip(&mut self.hit) {
            *miss = one;
            hit.iter_mut().take(columns).for_each(|h| *h = zero);
        }
    }

    /// Becomes `other`, in place.
    pub(super) fn copy_from(&mut self, other: &Self) {
        (self.clutter, self.domain, self.columns) = (other.clutter, other.domain, other.columns);
        (self.miss, self.hit) = (other.miss, other.hit);
    }

    /// Detections in this scan.
    #[must_use]
    pub fn columns(&self) -> usize {
        self.columns
    }

    /// The row of `track`: miss, and one entry per detection.
    #[must_use]
    pub fn row(&self, track: usize) -> Option<(T, &[T])> {
        Some((*self.miss.get(track)?, self.hit.get(track)?.get(..self.columns)?))
    }

    /// The row of `track`, to be written.
    pub fn row_mut(&mut self, track: usize) -> Option<(&mut T, &mut [T])> {
        Some((self.miss.get_mut(track)?, self.hit.get_mut(track)?.get_mut(..self.columns)?))
    }

    /// Makes it certain that `track` has the detection of the column `chosen`, or none.
    pub(super) fn decide(&mut self, track: usize, chosen: Option<usize>) {
        let Some((miss, hit)) = self.row_mut(track) else { return };
        *miss = if chosen.is_none() { T::ONE } else { T::ZERO };
        hit.fill(T::ZERO);
        if let Some(hit) = chosen.and_then(|column| hit.get_mut(column)) {
            *hit = T::ONE;
        }
    }
}

/// Joint association: from weights to probabilities, in memory of its own.
pub trait Associator<T: Real, const TRACKS: usize, const DETS: usize> {
    /// What it needs besides the matrix. All zero bits when new.
    type Memory: Clone + core::fmt::Debug;
    /// New memory.
    const MEMORY: Self::Memory;

    /// The pairs of tracks that may have one detection between them, if it weighs such: those of the last scan, to be replaced.
    #[inline(always)]
    fn pairs(_memory: &mut Self::Memory) -> Option<&mut UnresolvedPairs<T, DETS>> {
        None
    }

    /// Replaces the weights of every row by probabilities that sum to one; where pairs are one, less what they have together.
    fn associate(&self, matrix: &mut AssociationMatrix<T, TRACKS, DETS>, memory: &mut Self::Memory) -> Completeness;
}

/// How far the probabilities of a scan can be trusted. A cluster is a group of tracks that share detections.
#[non_exhaustive]
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Completeness {
    /// Clusters whose lightest events were given up: every probability is within `error_bound` of the exact one
    pub bounded: u16,
    /// Clusters for which only an approximation could be had
    pub approximated: u16,
    /// Clusters without any possible event: their tracks count as not detected
    pub infeasible: u16,
    /// The largest error bound of a bounded cluster, rounding included; 0 if there is none
    pub error_bound: f32,
    /// Pairs of tracks that count as resolved because their cluster has too many, or because the weights are logarithms
    pub pairs_refused: u16,
}

impl Completeness {
    /// What holds of two associations that one answer is made of: the worse of each.
    pub(super) fn join(&mut self, other: Self) {
        self.bounded = self.bounded.max(other.bounded);
        self.approximated = self.approximated.max(other.approximated);
        self.infeasible = self.infeasible.max(other.infeasible);
        self.error_bound = larger(self.error_bound, other.error_bound);
        self.pairs_refused = self.pairs_refused.max(other.pairs_refused);
    }

    /// Whether all probabilities are those of all joint events.
    #[must_use]
    pub fn is_exact(&self) -> bool {
        self.bounded == 0 && self.approximated == 0 && self.infeasible == 0 && self.pairs_refused == 0
    }
}
