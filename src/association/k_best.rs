//! The K joint events of the greatest weight, in order.
//!
//! ```text
//! a node      events that begin with a_0 … a_{b−1}, with a_b outside a set F, and free from row b + 1 on
//! its best    one assignment;  the best event of all nodes is the next in order
//! children    of a node with best event a, for i ≥ b:  begin with a_0 … a_{i−1},  a_i barred (for i = b, F barred too)
//! ```
//!
//! Murty 1968. The children and a are the node, without overlap, so no event comes twice.
//!
//! A node need not be stored beside its best event. Of the events delivered before, b is the largest number of first rows in
//! which any of them agrees with it, and F is what those that agree so far have in row b: a node that begins like this one
//! came of delivering such an event, and barred what that event had there.
//!
//! Nor are the children solved anew. With the prices of the parent, row i and its column taken out, what remains is the
//! best assignment of what remains; the column and the row are then added again, by one shortest path each (Miller, Stone
//! and Cox 1997).
//!
//! # Cost
//! With n rows and C columns, d = log₂ K + 1:
//!
//! ```text
//! a row added to m       (C + 2)(m + 2)                        looks at pairs and misses, by the m + 1 steps of its path
//! a column added to m    m (m + 3) / 2                         at pairs, by a path among rows
//! an event delivered     (C + 2) n (n + 3) + n (n − 1)(n + 4) / 6 + n²      n rows added; one for each child and its column; its sum
//! events compared        n K² / 2                              entries, with those delivered before
//! events kept            n K² / 2 + (2 n + 1) K d + K² / 2     moves and comparisons of those that wait, and of all in the end
//! ```

use super::assignment::{Assignment, Search};
use super::work::count;
use crate::order::bring;
use crate::scalar::{Real, larger};

/// What one row may not take.
#[derive(Clone, Copy, Debug)]
struct Barred<const DETS: usize> {
    miss: bool,
    columns: [bool; DETS],
}

impl<const DETS: usize> Barred<DETS> {
    const NONE: Self = Self { miss: false, columns: [false; DETS] };

    fn add(&mut self, choice: u16) {
        match column(choice) {
            None => self.miss = true,
            Some(j) => self.columns.iter_mut().skip(j).take(1).for_each(|barred| *barred = true),
        }
    }

    fn has(&self, column: usize) -> bool {
        self.columns.get(column).copied().unwrap_or(true)
    }
}

/// The column of an entry of an event.
fn column(choice: u16) -> Option<usize> {
    choice.checked_sub(1).map(usize::from)
}

/// The entry of an event.
fn entry(column: Option<usize>) -> u16 {
    column.map_or(0, |j| j as u16 + 1)
}

/// Up to `K` joint events, best first. All zero bits when new.
///
/// It takes `K (2 TRACKS + 2 + size of T)` bytes besides two assignments. [`worst_case`](Self::worst_case) has the most work.
#[derive(Clone, Debug)]
pub struct KBest<T, const TRACKS: usize, const DETS: usize, const K: usize> {
    events: [[u16; TRACKS]; K],
    ln_weights: [T; K],
    /// Places in `events`, best first: those delivered, then those that wait
    order: [u16; K],
    count: usize,
    rows: usize,
    /// Events of a smaller weight are of no interest
    ln_least: T,
    /// Whether any event was not kept
    cut: bool,
    parent: Assignment<T, TRACKS, DETS>,
    child: Assignment<T, TRACKS, DETS>,
    over_rows: Search<T, TRACKS>,
}

impl<T: Real, const TRACKS: usize, const DETS: usize, const K: usize> Default for KBest<T, TRACKS, DETS, K> {
    fn default() -> Self {
        Self::new()
    }
}

impl<T: Real, const TRACKS: usize, const DETS: usize, const K: usize> KBest<T, TRACKS, DETS, K> {
    /// No events.
    #[must_use]
    pub const fn new() -> Self {
        const { assert!(K >= 1 && K <= u16::MAX as usize, "events are numbered by 16 bits") }
        Self {
            events: [[0; TRACKS]; K],
            ln_weights: [T::ZERO; K],
            order: [0; K],
            count: 0,
            rows: 0,
            ln_least: T::ZERO,
            cut: false,
            parent: Assignment::new(),
            child: Assignment::new(),
            over_rows: Search::new(),
        }
    }

    /// The most looks at pairs, misses and events of one ranking, by the formula of this file.
    #[must_use]
    pub const fn worst_case() -> u64 {
        let (n, c, k) = (TRACKS as u64, DETS as u64, K as u64);
        let delivered = (c + 2) * n * (n + 3) + n * n.saturating_sub(1) * (n + 4) / 6 + n * n;
        k * delivered + n * k * k + (2 * n + 1) * k * (k.ilog2() as u64 + 1) + k * k / 2
    }

    /// Ranks the joint events of the first `rows` rows and `columns` columns (at most `TRACKS` and `DETS`) by the sums of
    /// their logarithms `miss(row)` and `hit(row, column)`, and returns how many there are, at most `K`.
    ///
    /// A logarithm that is not finite, or not within ±1e30, forbids the miss or the pair. Events of exactly equal sums,
    /// added row by row, come in lexicographic order. Where more events tie for the last places than fit, the same ones
    /// are kept every time, but not necessarily the lexicographically first.
    pub fn rank(&mut self, rows: usize, columns: usize, miss: impl Fn(usize) -> T, hit: impl Fn(usize, usize) -> T) -> usize {
        let infinity = T::ONE / T::ZERO;
        self.rank_above(-infinity, infinity, rows, columns, miss, hit)
    }

    /// [`rank`](Self::rank) for events whose logarithm is at least `ln_least` and at most `ln_span` below that of the first: nothing
    /// is searched for behind the last of them.
    pub fn rank_above(
        &mut self,
        ln_least: T,
        ln_span: T,
        rows: usize,
        columns: usize,
        miss: impl Fn(usize) -> T,
        hit: impl Fn(usize, usize) -> T,
    ) -> usize {
        let miss = |row| {
            count(1);
            miss(row)
        };
        let hit = |row, column| {
            count(1);
            hit(row, column)
        };
        (self.rows, self.count, self.ln_least, self.cut) = (rows.min(TRACKS), 0, ln_least, false);
        if !self.parent.solve(rows, columns, &miss, &hit) {
            return 0;
        }
        self.keep(0, core::array::from_fn(|row| entry(self.parent.column(row))), &miss, &hit);
        let best = self.ln_weights.first().map_or(ln_least, |best| *best - ln_span);
        self.ln_least = larger(ln_least, best);
        for delivered in 1..K {
            if delivered > self.count {
                break;
            }
            self.split(delivered, columns, &miss, &hit);
        }
        // Ties were found in any order, and sums differ by rounding from what the searches went by.
        (1..self.count).for_each(|place| self.sort_in(0, place));
        self.count
    }

    /// Whether the events are all that there are.
    #[must_use]
    pub fn is_exhaustive(&self) -> bool {
        !self.cut && self.count < K
    }

    /// (logarithm of the weight, event) in order. An event has one entry a row: 0 is a miss, j + 1 is column j.
    pub fn events(&self) -> impl Iterator<Item = (T, &[u16])> {
        self.order.iter().take(self.count).filter_map(|&k| Some((self.ln_weight(k), self.event(k)?)))
    }

    fn event(&self, place: u16) -> Option<&[u16]> {
        self.events.get(usize::from(place))?.get(..self.rows)
    }

    fn ln_weight(&self, place: u16) -> T {
        self.ln_weights.get(usize::from(place)).copied().unwrap_or(T::ZERO)
    }

    /// Where among `order[first..end]`, itself in order, an event belongs.
    fn rank_among(&self, first: usize, end: usize, ln_weight: T, event: &[u16]) -> usize {
        let before = |&k: &u16| {
            count(1);
            let other = self.ln_weight(k);
            other > ln_weight || (other == ln_weight && self.event(k) < Some(event))
        };
        first + self.order.get(first..end).map_or(0, |ranked| ranked.partition_point(before))
    }

    /// Moves the event at `place` of the order to where it belongs from `first` on.
    fn sort_in(&mut self, first: usize, place: usize) {
        let Some(&k) = self.order.get(place) else { return };
        let rank = self.rank_among(first, place, self.ln_weight(k), self.event(k).unwrap_or(&[]));
        count(place.saturating_sub(rank));
        bring(&mut self.order, place, rank);
    }

    /// Delivers the last of the first `delivered` events: the best events of the children of its node wait behind it.
    fn split(&mut self, delivered: usize, columns: usize, miss: &impl Fn(usize) -> T, hit: &impl Fn(usize, usize) -> T) {
        let Some((&last, earlier)) = self.order.get(..delivered).and_then(<[u16]>::split_last) else { return };
        let Some(&event) = self.events.get(usize::from(last)) else { return };
        let (mut branch, mut barred) = (0, Barred::NONE);
        for other in earlier.iter().filter_map(|&k| self.event(k)) {
            let alike = event.iter().zip(other).take_while(|(a, b)| a == b).count();
            count(alike + 1);
            if alike > branch {
                (branch, barred) = (alike, Barred::NONE);
            }
            if alike == branch {
                other.get(branch).into_iter().for_each(|&choice| barred.add(choice));
            }
        }

        // The prices of the node. Rows before the branch are fixed: neither they nor their columns take part.
        self.parent.begin(self.rows, columns);
        event.iter().take(branch).filter_map(|&choice| column(choice)).for_each(|j| self.parent.remove_column(j));
        for row in branch..self.rows {
            if !add_row(&mut self.parent, row, branch, &barred, miss, hit) {
                return;
            }
        }
        let free = event.iter().enumerate().take(self.rows).skip(branch);
        self.parent.reassign(free.clone().map(|(row, &choice)| (row, column(choice))));

        for (row, &choice) in free {
            if row > branch {
                barred = Barred::NONE;
            }
            barred.add(choice);
            // The row and its column are gone for this child, and fixed for those after it.
            self.parent.remove_row(row);
            self.child.copy(&self.parent);
            if let Some(column) = column(choice) {
                self.child.add_column(column, hit, &mut self.over_rows);
            }
            if add_row(&mut self.child, row, row, &barred, miss, hit) {
                let mut best = event;
                best.iter_mut().enumerate().take(self.rows).skip(row).for_each(|(t, choice)| *choice = entry(self.child.column(t)));
                self.keep(delivered, best, miss, hit);
            }
        }
    }

    /// Lets `event` wait behind the first `delivered`, if it is one of the `K` best.
    fn keep(&mut self, delivered: usize, event: [u16; TRACKS], miss: &impl Fn(usize) -> T, hit: &impl Fn(usize, usize) -> T) {
        let choices = event.iter().enumerate().take(self.rows);
        let ln_weight = choices.fold(T::ZERO, |sum, (row, &choice)| sum + column(choice).map_or_else(|| miss(row), |j| hit(row, j)));
        if ln_weight < self.ln_least {
            self.cut = true;
            return;
        }
        if self.count < K {
            self.order.iter_mut().skip(self.count).take(1).for_each(|k| *k = self.count as u16);
            self.count += 1;
        } else {
            // This event or the last of the others.
            self.cut = true;
            if self.rank_among(delivered, K, ln_weight, event.get(..self.rows).unwrap_or(&[])) == K {
                return;
            }
        }
        let last = self.count - 1;
        let slot = self.order.get(last).map_or(K, |&k| usize::from(k));
        if let (Some(kept), Some(weight)) = (self.events.get_mut(slot), self.ln_weights.get_mut(slot)) {
            (*kept, *weight) = (event, ln_weight);
            self.sort_in(delivered, last);
        }
    }
}

/// Adds `row` to a problem in which row `branch` may not take what is barred.
fn add_row<T: Real, const TRACKS: usize, const DETS: usize>(
    problem: &mut Assignment<T, TRACKS, DETS>,
    row: usize,
    branch: usize,
    barred: &Barred<DETS>,
    miss: impl Fn(usize) -> T,
    hit: impl Fn(usize, usize) -> T,
) -> bool {
    let forbidden = -T::ONE / T::ZERO;
    let miss = |t| if t == branch && barred.miss { forbidden } else { miss(t) };
    let hit = |t, j| if t == branch && barred.has(j) { forbidden } else { hit(t, j) };
    problem.add_row(row, miss, hit)
}
