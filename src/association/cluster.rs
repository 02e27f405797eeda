//! Clusters: groups of tracks that share detections. Clusters do not see each other, so each is associated alone.
//!
//! ```text
//! shared      a detection with positive weight for two tracks or more puts them into one cluster
//! order       next the shared detection that leaves the fewest tracks open: a track is open from its first to its last
//! private     vacant_t = miss_t + Σ of the track's unshared h_tj, split among them again in the end
//! turned      tracks and detections change places: h_jt,  vacant_j = q_j,  q_t = vacant_t
//! ```
//!
//! Reid, *IEEE Trans. AC* 24(6), 1979, for clusters. A joint event treats a private detection exactly as it treats no
//! detection at all (under Poisson clutter), so that folding changes no probability and leaves the sweep the shared
//! detections only. A cluster with more tracks than shared detections is swept turned, along its tracks with sets of
//! detections: events and weights are the same.

use super::matrix::AssociationMatrix;
use super::work::count;
use crate::scalar::Real;

/// Tracks of a cluster that a mask can name; beyond that only the approximation remains.
pub(super) const MASKED: usize = 32;
/// No track.
const NONE: u16 = u16::MAX;

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

/// One cluster, taken from the matrix.
#[derive(Clone, Debug)]
pub(super) struct Cluster<T, const TRACKS: usize, const DETS: usize> {
    /// Rows of the matrix; their order numbers the tracks of the cluster.
    pub tracks: heapless::Vec<u16, TRACKS>,
    /// In the order of the sweep
    pub columns: heapless::Vec<Column<T>, DETS>,
    /// The weight of each track, by its number in the cluster, when it has none of the columns
    pub vacant: [T; TRACKS],
    /// Whether private detections are part of the vacant weights
    pub folded: bool,
    /// The vacant weights as they were taken from the matrix
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
            folded: false,
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
        for (k, unused) in other.vacant.iter().enumerate().take(columns) {
            let mut tracks = 0;
            for (i, (column, row)) in other.columns.iter().zip(weights.iter_mut()).enumerate() {
                let weight = other.weight(hit, k, column);
                if let Some(entry) = row.get_mut(k) {
                    *entry = weight;
                }
                tracks |= u32::from(weight > T::ZERO) << (i & 31);
            }
            let _ = self.columns.push(Column { det: k as u16, tracks, opening: 0, closing: 0, unused: *unused });
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
                if let Some((h, beta)) = row.get_mut(usize::from(column.det)).zip(weights.get(k)) {
                    *h = *beta;
                }
            }
        }
    }

    /// Orders the columns so that few tracks are open at a time, and marks where tracks open and close.
    ///
    /// Cost: the square of the columns, times the tracks that gate one.
    pub fn order(&mut self) {
        // Once is enough: the first of ordered columns opens its tracks.
        if self.columns.first().is_none_or(|column| column.opening != 0) {
            return;
        }
        if self.tracks.len() > 4 {
            self.sort_by_frontier();
        }
        let (mut before, mut behind) = (0, 0);
        for column in &mut self.columns {
            column.opening = column.tracks & !before;
            before |= column.tracks;
        }
        for column in self.columns.iter_mut().rev() {
            column.closing = column.tracks & !behind;
            behind |= column.tracks;
        }
    }

    fn sort_by_frontier(&mut self) {
        // Columns that a track still has ahead.
        let mut ahead = [0u16; MASKED];
        for column in &self.columns {
            bits(column.tracks).for_each(|k| ahead[k % MASKED] += 1);
        }
        let mut open = 0u32;
        for i in 0..self.columns.len() {
            let Some(rest) = self.columns.get_mut(i..) else { return };
            let cost = |column: &Column<T>| {
                let during = (open | column.tracks).count_ones();
                count(1 + column.tracks.count_ones() as usize);
                (during - bits(column.tracks).filter(|k| ahead[*k % MASKED] == 1).count() as u32, during)
            };
            let best = rest.iter().map(cost).enumerate().min_by_key(|(_, cost)| *cost).map_or(0, |(j, _)| j);
            if let Some((first, others)) = rest.split_first_mut() {
                if let Some(chosen) = best.checked_sub(1).and_then(|j| others.get_mut(j)) {
                    core::mem::swap(first, chosen);
                }
                open |= first.tracks;
                for k in bits(first.tracks) {
                    ahead[k % MASKED] -= 1;
                    if ahead[k % MASKED] == 0 {
                        open &= !(1 << k);
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

/// Which tracks belong together, and which detections are shared.
#[derive(Clone, Debug)]
pub(super) struct Partition<const TRACKS: usize, const DETS: usize> {
    /// The cluster of every row, named by its first row
    label: [u16; TRACKS],
    /// The first row that gates a detection
    owner: [u16; DETS],
    /// Whether another gates it too
    shared: [bool; DETS],
    /// Of the cluster taken last: the tracks that gate a detection, by their number
    gating: [u32; DETS],
}

impl<const TRACKS: usize, const DETS: usize> Partition<TRACKS, DETS> {
    pub const fn new() -> Self {
        Self { label: [0; TRACKS], owner: [0; DETS], shared: [false; DETS], gating: [0; DETS] }
    }

    /// Groups the rows of `matrix` by shared detections; with `together` all rows that gate any are one cluster.
    ///
    /// Cost: one look at every weight, and TRACKS operations per union of two clusters.
    #[inline(always)]
    pub fn find<T: Real>(&mut self, matrix: &AssociationMatrix<T, TRACKS, DETS>, gated: impl Fn(T) -> bool, together: bool) {
        let columns = matrix.columns();
        let Self { label: labels, owner, shared, .. } = self;
        let (Some(owner), Some(shared)) = (owner.get_mut(..columns), shared.get_mut(..columns)) else { return };
        owner.fill(NONE);
        shared.fill(false);
        let mut first = NONE;
        for (t, hit) in (0u16..).zip(&matrix.hit) {
            let mut label = t;
            count(columns);
            let Some(hit) = hit.get(..columns) else { return };
            for ((h, owner), shared) in hit.iter().zip(owner.iter_mut()).zip(shared.iter_mut()) {
                if !gated(*h) {
                    continue;
                }
                let mut other = *owner;
                if other == NONE {
                    *owner = t;
                    other = if together { first } else { NONE };
                    first = first.min(t);
                } else {
                    *shared = true;
                }
                if other != NONE {
                    let theirs = labels.get(usize::from(other)).copied().unwrap_or(label);
                    if theirs != label && other != t {
                        count(usize::from(t));
                        let (keep, give) = (label.min(theirs), label.max(theirs));
                        labels.iter_mut().take(usize::from(t)).filter(|l| **l == give).for_each(|l| *l = keep);
                        label = keep;
                    }
                }
            }
            if let Some(l) = labels.get_mut(usize::from(t)) {
                *l = label;
            }
        }
    }

    /// Whether more than one row gates each detection
    pub fn shared(&self) -> &[bool] {
        &self.shared
    }

    /// How many of the first `columns` detections any row gates
    pub fn gated(&self, columns: usize) -> usize {
        self.owner.iter().take(columns).filter(|owner| **owner != NONE).count()
    }

    /// The cluster that begins with `row`: its tracks and their columns, shared or, unless `fold`, all. `false` where the
    /// row begins none.
    #[inline(always)]
    pub fn take<T: Real>(
        &mut self,
        row: usize,
        matrix: &AssociationMatrix<T, TRACKS, DETS>,
        gated: impl Fn(T) -> bool,
        fold: bool,
        cluster: &mut Cluster<T, TRACKS, DETS>,
    ) -> bool {
        if self.label.get(row).is_none_or(|label| usize::from(*label) != row) {
            return false;
        }
        cluster.tracks.clear();
        cluster.columns.clear();
        cluster.folded = fold;
        for (t, _) in (0u16..).zip(&self.label).skip(row).filter(|(_, label)| usize::from(**label) == row) {
            let _ = cluster.tracks.push(t);
        }
        if cluster.tracks.len() < 2 {
            return true;
        }
        let columns = matrix.columns();
        let (Some(gating), Some(shared)) = (self.gating.get_mut(..columns), self.shared.get(..columns)) else { return false };
        gating.fill(0);
        let mut bit = 1u32;
        for ((t, vacant), whole) in cluster.tracks.iter().zip(&mut cluster.vacant).zip(&mut cluster.whole) {
            let Some((miss, hit)) = matrix.row(usize::from(*t)) else { break };
            *vacant = miss;
            count(hit.len());
            for ((h, gating), shared) in hit.iter().zip(gating.iter_mut()).zip(shared) {
                if gated(*h) {
                    if *shared || !fold {
                        *gating |= bit;
                    } else {
                        *vacant += *h;
                    }
                }
            }
            *whole = *vacant;
            bit <<= 1;
        }
        // In a cluster too large for masks, columns of the tracks beyond them count too.
        let large = cluster.tracks.len() > MASKED;
        for ((det, tracks), shared) in (0u16..).zip(gating.iter()).zip(shared) {
            if *tracks != 0 || large && (*shared || !fold) {
                let _ = cluster.columns.push(Column { det, tracks: *tracks, opening: 0, closing: 0, unused: T::ONE });
            }
        }
        true
    }
}
