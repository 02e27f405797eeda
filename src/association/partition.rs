//! Who gates what: a mask of every row, and from the masks clusters, shared detections and private ones.
//!
//! ```text
//! mask        bit j of row t: h_tj > 0, or ln h_tj > −∞; a word names 32 detections
//! shared      bits that two masks have, or more
//! private     bits of a mask that are not shared: whole_t = miss_t + Σ h_tj over them, split among them again in the end
//! cluster     rows with shared bits in common, directly or by way of other rows
//! ```
//!
//! A joint event treats a private detection exactly as it treats no detection at all (under Poisson clutter), so that folding
//! changes no probability and leaves the sweeps the shared detections only.
//!
//! The pass that sums the rows finds the first word of every mask, and a cluster of few tracks needs nothing else. Other words
//! are made where they are needed.

use super::cluster::{Cluster, Column, bits};
use super::matrix::{AssociationMatrix, Domain};
use super::scaling::{least, normalise, to_logarithms, weigh};
use super::small;
use super::work::count;
use crate::scalar::Real;

/// Detections that a word names.
const WORD: usize = 32;

/// Which rows belong together, and which detections they share.
#[derive(Clone, Debug)]
pub(super) struct Partition<T, const TRACKS: usize, const DETS: usize> {
    /// The cluster of every row, named by its first row
    pub label: [u16; TRACKS],
    /// One word of every row's mask: the first, if there is no other
    mask: [u32; TRACKS],
    /// The sum of every row, 1 where they are logarithms
    sum: [T; TRACKS],
    /// What is shared, word by word
    shared: [u32; DETS],
    /// How many detections any row gates, if all of them make one cluster
    pub gated: usize,
    /// What is not gated: 0, or −∞
    none: T,
}

impl<T: Real, const TRACKS: usize, const DETS: usize> Partition<T, TRACKS, DETS> {
    pub const fn new() -> Self {
        let (mask, sum, shared) = ([0; TRACKS], [T::ZERO; TRACKS], [0; DETS]);
        Self { label: [0; TRACKS], mask, sum, shared, gated: 0, none: T::ZERO }
    }

    /// Sums the rows of `matrix`, or takes logarithms where the precision asks for them, and groups the rows by shared
    /// detections; with `together` all rows that gate any are one cluster.
    ///
    /// Cost: some looks at every weight, and for every word one at half of the pairs of rows.
    #[inline(always)]
    pub fn find(&mut self, matrix: &mut AssociationMatrix<T, TRACKS, DETS>, together: bool) {
        let columns = matrix.columns();
        let mut rows = self.mask.iter_mut().zip(&mut self.sum).zip(matrix.miss.iter_mut().zip(&mut matrix.hit));
        let linear = matrix.domain == Domain::Linear
            && rows.all(|((mask, sum), (miss, hit))| {
                let weighed = hit.get_mut(..columns).and_then(|hit| weigh(miss, hit));
                (*mask, *sum) = weighed.unwrap_or((0, T::ONE));
                weighed.is_some()
            });
        self.none = T::ZERO;
        if !linear {
            to_logarithms(matrix);
            (self.none, self.sum) = (-T::ONE / T::ZERO, [T::ONE; TRACKS]);
        }
        self.gated = 0;
        self.label.iter_mut().enumerate().for_each(|(t, label)| *label = t as u16);
        for word in 0..columns.div_ceil(WORD) {
            if !linear || word > 0 {
                for (mask, hit) in self.mask.iter_mut().zip(&matrix.hit) {
                    *mask = word_of(hit, word * WORD, columns, self.none);
                }
            }
            let (mut seen, mut twice) = (0, 0);
            for t in 0..TRACKS {
                let mut common = self.mask[t] & seen;
                seen |= self.mask[t];
                twice |= common;
                if common == 0 {
                    continue;
                }
                count(t);
                for s in 0..t {
                    if self.mask[s] & common != 0 {
                        common &= !self.mask[s];
                        join(&mut self.label, s, t);
                    }
                }
            }
            if let Some(shared) = self.shared.get_mut(word) {
                *shared = twice;
            }
            if together {
                self.gated += seen.count_ones() as usize;
            }
        }
        if together {
            self.join_all(matrix);
        }
    }

    /// Makes one cluster of all rows that gate any detection.
    #[inline(never)]
    fn join_all(&mut self, matrix: &AssociationMatrix<T, TRACKS, DETS>) {
        let mut first = None;
        for (t, hit) in (0u16..).zip(&matrix.hit) {
            if self.words(matrix.columns()).any(|(start, _)| word_of(hit, start, matrix.columns(), self.none) != 0) {
                let first = *first.get_or_insert(t);
                self.label.iter_mut().skip(usize::from(t)).take(1).for_each(|label| *label = first);
            }
        }
    }

    /// How many tracks are in the cluster that begins with `row`, and the first four of them. `None` where none begins.
    #[inline(always)]
    pub fn members(&self, row: usize) -> Option<(usize, [usize; 4])> {
        self.label.get(row).filter(|label| usize::from(**label) == row)?;
        let (mut members, mut rows) = (0, [0; 4]);
        for (t, label) in self.label.iter().enumerate() {
            if usize::from(*label) == row {
                if let Some(slot) = rows.get_mut(members) {
                    *slot = t;
                }
                members += 1;
            }
        }
        Some((members, rows))
    }

    /// Replaces the weights of a cluster of two to four `rows` by marginals, straight from the masks. `false` where Z is too
    /// small for the precision; `None` where there are more tracks, detections or sets than that is made for.
    #[inline(always)]
    pub fn few(&self, members: usize, rows: [usize; 4], matrix: &mut AssociationMatrix<T, TRACKS, DETS>, nodes: &mut [T]) -> Option<bool> {
        let [shared] = self.shared.first_chunk()?;
        if matrix.columns() > WORD {
            return None;
        }
        let masks = rows.map(|row| self.mask.get(row).copied().unwrap_or(0));
        let least = rows.iter().take(members).filter_map(|row| self.sum.get(*row)).fold(least(), |least: T, sum| least * *sum);
        let ([a, b, c, _], [p, q, r, _]) = (rows, masks);
        match members {
            2 => small::marginals::<T, TRACKS, DETS, 2, 4>(matrix, [a, b], [p, q], *shared, nodes, least),
            3 => small::marginals::<T, TRACKS, DETS, 3, 8>(matrix, [a, b, c], [p, q, r], *shared, nodes, least),
            4 => small::marginals::<T, TRACKS, DETS, 4, 16>(matrix, rows, masks, *shared, nodes, least),
            _ => None,
        }
    }

    /// Scales a row to the sum one, if it is linear.
    #[inline(always)]
    pub fn normalise(&self, row: usize, matrix: &mut AssociationMatrix<T, TRACKS, DETS>) {
        if let Some(((miss, hit), sum)) = matrix.row_mut(row).zip(self.sum.get(row).filter(|sum| **sum != T::ONE)) {
            normalise(miss, hit, *sum);
        }
    }

    /// The cluster that begins with `row`: its tracks, their rows scaled, and their detections, the shared ones or, unless
    /// `fold`, all.
    #[inline(never)]
    pub fn take(&self, row: usize, matrix: &mut AssociationMatrix<T, TRACKS, DETS>, fold: bool, cluster: &mut Cluster<T, TRACKS, DETS>) {
        let Cluster { tracks, columns, vacant, whole, .. } = cluster;
        tracks.clear();
        columns.clear();
        let members = (0u16..).zip(&self.label).filter(|(_, label)| usize::from(**label) == row);
        for ((t, _), whole) in members.zip(whole.iter_mut()) {
            let _ = tracks.push(t);
            self.normalise(usize::from(t), matrix);
            *whole = matrix.miss.get(usize::from(t)).copied().unwrap_or(T::ZERO);
        }
        for (start, shared) in self.words(matrix.columns()) {
            let (shared, mut any) = (if fold { shared } else { u32::MAX }, 0);
            for (hit, whole) in tracks.iter().filter_map(|t| matrix.hit.get(usize::from(*t))).zip(whole.iter_mut()) {
                let mask = word_of(hit, start, matrix.columns(), self.none);
                any |= mask;
                bits(mask & !shared).filter_map(|j| hit.get(start + j)).for_each(|h| *whole += *h);
            }
            for j in bits(any & shared) {
                let _ = columns.push(Column::new(start + j, T::ONE));
            }
        }
        *vacant = *whole;
    }

    /// Gives the tracks of a cluster their rows back: what is left of each is split between its private detections and none.
    #[inline(never)]
    pub fn hand_out(&self, matrix: &mut AssociationMatrix<T, TRACKS, DETS>, cluster: &Cluster<T, TRACKS, DETS>) {
        let columns = matrix.columns();
        for ((row, beta), whole) in cluster.tracks.iter().map(|row| usize::from(*row)).zip(&cluster.vacant).zip(&cluster.whole) {
            let Some((miss, hit)) = matrix.miss.get_mut(row).zip(matrix.hit.get_mut(row)) else { return };
            if *whole == *miss {
                *miss = *beta;
                continue;
            }
            let scale = *beta / *whole;
            *miss *= scale;
            for (start, shared) in self.words(columns) {
                for j in bits(word_of(hit, start, columns, self.none) & !shared) {
                    if let Some(h) = hit.get_mut(start + j) {
                        *h *= scale;
                    }
                }
            }
        }
    }

    /// Where every word begins, and what is shared of it.
    fn words(&self, columns: usize) -> impl Iterator<Item = (usize, u32)> {
        self.shared.iter().take(columns.div_ceil(WORD)).enumerate().map(|(word, shared)| (word * WORD, *shared))
    }
}

/// Makes one cluster of those of two rows.
#[inline(always)]
pub(super) fn join<const TRACKS: usize>(label: &mut [u16; TRACKS], s: usize, t: usize) {
    let (Some(a), Some(b)) = (label.get(s).copied(), label.get(t).copied()) else { return };
    if a != b {
        count(TRACKS);
        label.iter_mut().filter(|label| **label == a.max(b)).for_each(|label| *label = a.min(b));
    }
}

/// The word of a row's mask that begins at `start`: what is above `none` of its first `columns` weights.
#[inline(never)]
fn word_of<T: Real>(hit: &[T], start: usize, columns: usize, none: T) -> u32 {
    count(WORD.min(columns - start));
    let word = hit.get(start..columns.min(start + WORD)).unwrap_or_default();
    word.iter().rev().fold(0, |mask, h| mask << 1 | u32::from(*h > none))
}
