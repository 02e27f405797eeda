//! A cluster: tracks that share detections, and the detections. Clusters do not see each other, so each is associated alone.
//!
//! ```text
//! order       next the shared detection that leaves the fewest tracks open: a track is open from its first to its last
//! turned      tracks and detections change places: h_jt,  vacant_j = q_j,  q_t = vacant_t
//! ```
//!
//! Reid, *IEEE Trans. AC* 24(6), 1979, for clusters. A cluster with more tracks than shared detections is swept turned, along
//! its tracks with sets of detections: events and weights are the same.

use super::work::count;
use crate::scalar::Real;

/// Tracks of a cluster that a mask can name; beyond that only the approximation remains.
pub(super) const MASKED: usize = 32;

/// A shared detection.
#[derive(Clone, Copy, Debug)]
pub(super) struct Column<T> {
    /// Its column in the matrix
    pub det: u16,
    /// The tracks that gate it, a bit each by their number in the cluster
    pub tracks: u32,
    /// Those of them that no earlier column has
    pub opening: u32,
    /// Those of them that no later column has
    pub closing: u32,
    /// Its weight when no track takes it: 1 unless balanced
    pub unused: T,
}

impl<T: Real> Column<T> {
    /// The column of detection `det`, not yet ordered.
    pub fn new(det: usize, unused: T) -> Self {
        Self { det: det as u16, tracks: 0, opening: 0, closing: 0, unused }
    }
}

/// One cluster, taken from the matrix.
#[derive(Clone, Debug)]
pub(super) struct Cluster<T, const TRACKS: usize, const DETS: usize> {
    /// Rows of the matrix; their order numbers the tracks of the cluster.
    pub tracks: heapless::Vec<u16, TRACKS>,
    /// In the order of the sweep
    pub columns: heapless::Vec<Column<T>, DETS>,
    /// The weight of each track, by its number in the cluster, when it has none of the columns
    pub vacant: [T; TRACKS],
    /// The vacant weights as they were taken from the matrix: of a miss, or of that and all private detections
    pub whole: [T; TRACKS],
    /// Whether tracks and detections have changed places; sweeps then replace the unused weights by marginals, too.
    pub turned: bool,
    /// Scratch of the sweeps, by the number of the track
    pub sums: [T; TRACKS],
}

impl<T: Real, const TRACKS: usize, const DETS: usize> Cluster<T, TRACKS, DETS> {
    pub const fn new() -> Self {
        Self {
            tracks: heapless::Vec::new(),
            columns: heapless::Vec::new(),
            vacant: [T::ZERO; TRACKS],
            whole: [T::ZERO; TRACKS],
            turned: false,
            sums: [T::ZERO; TRACKS],
        }
    }

    /// The weight of track number `k` and `column`.
    #[inline(always)]
    pub fn weight(&self, hit: &[[T; DETS]; TRACKS], k: usize, column: &Column<T>) -> T {
        let row = self.tracks.get(k).and_then(|row| hit.get(usize::from(*row)));
        row.and_then(|row| row.get(usize::from(column.det))).copied().unwrap_or(T::ZERO)
    }

    /// The weight of the tracks and columns of these numbers where all are logarithms; −∞ beyond the cluster.
    #[inline(always)]
    pub fn ln_weight(&self, ln_hit: &[[T; DETS]; TRACKS], k: usize, c: usize) -> T {
        let found = self.tracks.get(k).zip(self.columns.get(c));
        let weight = found.and_then(|(row, column)| ln_hit.get(usize::from(*row))?.get(usize::from(column.det)));
        weight.copied().unwrap_or(-T::ONE / T::ZERO)
    }

    /// The vacant weight of track number `k` where it is a logarithm; −∞ beyond the cluster.
    #[inline(always)]
    pub fn ln_vacant(&self, k: usize) -> T {
        self.vacant.get(k).copied().unwrap_or(-T::ONE / T::ZERO)
    }

    /// Becomes `other` with tracks and detections in each other's places; its weights go to `weights`. `false` where it does
    /// not fit.
    pub fn turn(&mut self, other: &Self, hit: &[[T; DETS]; TRACKS], weights: &mut [[T; DETS]; TRACKS]) -> bool {
        let (rows, columns) = (other.columns.len(), other.tracks.len());
        if rows > MASKED.min(TRACKS) || columns > DETS {
            return false;
        }
        self.tracks.clear();
        self.columns.clear();
        self.turned = true;
        for (i, (column, vacant)) in other.columns.iter().zip(&mut self.vacant).enumerate() {
            let _ = self.tracks.push(i as u16);
            *vacant = column.unused;
        }
        for (k, (row, unused)) in other.tracks.iter().zip(&other.vacant).enumerate() {
            let Some(hit) = hit.get(usize::from(*row)) else { return false };
            for (column, weights) in other.columns.iter().zip(weights.iter_mut()) {
                let Some((weight, h)) = weights.get_mut(k).zip(hit.get(usize::from(column.det))) else { return false };
                *weight = *h;
            }
            let _ = self.columns.push(Column::new(k, *unused));
        }
        true
    }

    /// Hands the marginals of a turned cluster back to the one it was made of.
    pub fn turn_back(&self, other: &mut Self, hit: &mut [[T; DETS]; TRACKS], weights: &[[T; DETS]; TRACKS]) {
        for turned in &self.columns {
            let k = usize::from(turned.det);
            let Some((row, vacant)) = other.tracks.get(k).zip(other.vacant.get_mut(k)) else { return };
            *vacant = turned.unused;
            let Some(row) = hit.get_mut(usize::from(*row)) else { return };
            for (column, weights) in other.columns.iter().zip(weights) {
                let Some((h, beta)) = row.get_mut(usize::from(column.det)).zip(weights.get(k)) else { return };
                *h = *beta;
            }
        }
    }

    /// Orders the columns so that few tracks are open at a time, and marks which tracks each has, opens and closes.
    ///
    /// Cost: a look at every weight, and the square of the columns times the tracks that gate one.
    pub fn order(&mut self, hit: &[[T; DETS]; TRACKS]) {
        // Once is enough: the first of ordered columns opens its tracks.
        if self.columns.first().is_none_or(|column| column.opening != 0) {
            return;
        }
        for (k, row) in self.tracks.iter().enumerate().take(MASKED) {
            let Some(hit) = hit.get(usize::from(*row)) else { return };
            count(self.columns.len());
            for column in &mut self.columns {
                let Some(h) = hit.get(usize::from(column.det)) else { return };
                column.tracks |= u32::from(*h > T::ZERO) << (k & 31);
            }
        }
        if self.tracks.len() > 4 {
            self.sort_by_frontier();
        }
        let (mut before, mut behind) = (0, 0);
        for (i, j) in (0..self.columns.len()).rev().enumerate() {
            let Some(column) = self.columns.get_mut(i) else { return };
            column.opening = column.tracks & !before;
            before |= column.tracks;
            let Some(column) = self.columns.get_mut(j) else { return };
            column.closing = column.tracks & !behind;
            behind |= column.tracks;
        }
    }

    fn sort_by_frontier(&mut self) {
        // Columns that a track still has ahead, and which tracks have one only.
        let mut ahead = [0u16; MASKED];
        let (mut open, mut last) = (0u32, 0u32);
        for k in self.columns.iter().flat_map(|column| bits(column.tracks)) {
            ahead[k % MASKED] += 1;
            last = if ahead[k % MASKED] == 1 { last | 1 << k } else { last & !(1 << k) };
        }
        for i in 0..self.columns.len() {
            let Some(rest) = self.columns.get_mut(i..) else { return };
            let cost = |column: &Column<T>| {
                let during = (open | column.tracks).count_ones();
                count(1 + column.tracks.count_ones() as usize);
                (during - (column.tracks & last).count_ones(), during)
            };
            let best = rest.iter().map(cost).enumerate().min_by_key(|(_, cost)| *cost).map_or(0, |(j, _)| j);
            if let Some((first, others)) = rest.split_first_mut() {
                if let Some(chosen) = best.checked_sub(1).and_then(|j| others.get_mut(j)) {
                    core::mem::swap(first, chosen);
                }
                open |= first.tracks;
                for k in bits(first.tracks) {
                    ahead[k % MASKED] -= 1;
                    match ahead[k % MASKED] {
                        0 => open &= !(1 << k),
                        1 => last |= 1 << k,
                        _ => {}
                    }
                }
            }
        }
    }
}

/// The positions of the bits that are set.
#[inline(always)]
pub(super) fn bits(mut mask: u32) -> impl Iterator<Item = usize> {
    core::iter::from_fn(move || {
        let bit = mask.trailing_zeros() as usize;
        mask &= mask.wrapping_sub(1);
        (bit < 32).then_some(bit)
    })
}
