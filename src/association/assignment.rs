//! The joint event of the greatest weight, and the prices that prove it so.
//!
//! ```text
//! maximise   Σ_t ln w(t, a_t)      every row t has a column a_t of its own, or misses
//! prices     minimise Σ_t u_t + Σ_j v_j  where  u_t + v_j ≥ ln hit_tj,  u_t ≥ ln miss_t,  v_j ≥ 0
//! optimal    both sums are equal:  equality on what is assigned,  v_j = 0 on columns left over
//! slack      u_t + v_j − ln hit_tj of a pair,  u_t − ln miss_t of a miss,  v_j of a column left over
//! path       the new row takes a column, whose row takes another, … until one takes a column left over, or misses
//! step       u_t −= D − d_t,  v_j += D − d_j  for rows and columns at distance d < D, the length of the shortest path
//! ```
//!
//! Rows come one at a time, each along the shortest path of slacks. To miss and to be left over are the same thing seen
//! from the two sides, so one search serves to add a row and to add a column. Every search settles each node of the
//! opposite side once at most, whatever the rounding: there is no loop that a tie or an error could keep alive. Slacks
//! below zero, rounding errors all, count as zero.
//!
//! Jonker and Volgenant 1987 (shortest augmenting paths); Crouse 2016 (rectangular and sparse problems).

use crate::scalar::{Real, is_finite, larger};

/// Takes no part in the problem.
const ABSENT: u16 = 0;
/// A row that misses, a column left over.
const IDLE: u16 = 1;
/// The code of partner 0; others follow.
const PARTNER: u16 = 2;

/// Logarithms beyond this are no weights: sums of them would not stay finite in single precision.
const LARGEST: f64 = 1e30;

/// The rows, or the columns.
#[derive(Clone, Copy, Debug)]
struct Side<T, const N: usize> {
    /// u_t or v_j
    price: [T; N],
    place: [u16; N],
    count: usize,
}

impl<T: Real, const N: usize> Side<T, N> {
    const fn new() -> Self {
        const { assert!(N < u16::MAX as usize - PARTNER as usize, "indices are 16 bits") }
        Self { price: [T::ZERO; N], place: [ABSENT; N], count: 0 }
    }

    fn begin(&mut self, count: usize, place: u16) {
        (self.price, self.place, self.count) = ([T::ZERO; N], [ABSENT; N], count.min(N));
        self.place.iter_mut().take(count).for_each(|p| *p = place);
    }

    /// (price, place) of every node.
    fn nodes(&self) -> impl Iterator<Item = (T, u16)> {
        (0..self.count).map_while(|node| self.price.get(node).copied().zip(self.place.get(node).copied()))
    }

    fn price(&self, node: usize) -> T {
        self.price.get(node).copied().unwrap_or(T::ZERO)
    }

    fn set_price(&mut self, node: usize, price: T) {
        self.price.iter_mut().skip(node).take(1).for_each(|p| *p = price);
    }

    fn partner(&self, node: usize) -> Option<usize> {
        self.place.get(node)?.checked_sub(PARTNER).map(usize::from)
    }

    /// Sets the place of `node` and returns the partner that it leaves.
    fn put(&mut self, node: usize, place: u16) -> Option<usize> {
        let left = self.partner(node);
        self.place.iter_mut().skip(node).take(1).for_each(|p| *p = place);
        left
    }
}

/// The place of who has `node` as a partner.
fn with(node: usize) -> u16 {
    node as u16 + PARTNER
}

/// Shortest paths to the nodes of one side. Scratch.
#[derive(Clone, Copy, Debug)]
pub(super) struct Search<T, const N: usize> {
    distance: [T; N],
    /// The node of the other side that the path comes from
    from: [u16; N],
    settled: [bool; N],
}

impl<T: Real, const N: usize> Search<T, N> {
    pub(super) const fn new() -> Self {
        Self { distance: [T::ZERO; N], from: [0; N], settled: [false; N] }
    }

    /// Finds room for `start`, a node of `ours` without a place: the shortest path of slacks to an idle node of
    /// `theirs`, or to one of ours that becomes idle. False, and nothing done, where no path leads anywhere.
    fn augment<const M: usize>(
        &mut self,
        start: usize,
        ours: &mut Side<T, M>,
        theirs: &mut Side<T, N>,
        idle: impl Fn(usize) -> T,
        pair: impl Fn(usize, usize) -> T,
    ) -> bool {
        // The price at which the best there is for the newcomer has no slack.
        let best = |best, (node, (price, place))| if place == ABSENT { best } else { larger(best, pair(start, node) - price) };
        let price = theirs.nodes().enumerate().fold(idle(start), best);
        if !is_finite(price) {
            return false;
        }
        ours.set_price(start, price);

        let infinity = T::ONE / T::ZERO;
        (self.distance, self.settled) = ([infinity; N], [false; N]);
        let (mut node, mut reached) = (start, T::ZERO);
        // The cheapest end so far: how far, and who becomes idle there.
        let (mut length, mut idler) = (infinity, start);
        let mut last = None;
        for _ in 0..=N {
            let price = ours.price(node);
            let stop = reached + larger(price - idle(node), T::ZERO);
            if stop < length {
                (length, idler) = (stop, node);
            }
            let (mut nearest, mut closest) = (0, infinity);
            let paths = self.distance.iter_mut().zip(&mut self.from).zip(&self.settled);
            for (other, (((distance, from), settled), (their_price, place))) in paths.zip(theirs.nodes()).enumerate() {
                if *settled || place == ABSENT {
                    continue;
                }
                let through = reached + larger(price + their_price - pair(node, other), T::ZERO);
                if through < *distance {
                    (*distance, *from) = (through, node as u16);
                }
                if *distance < closest {
                    (nearest, closest) = (other, *distance);
                }
            }
            // A miss goes before a column of the same worth.
            if closest >= length {
                break;
            }
            let Some(partner) = theirs.partner(nearest) else {
                (length, last) = (closest, Some(nearest));
                break;
            };
            self.settled.iter_mut().skip(nearest).take(1).for_each(|s| *s = true);
            (node, reached) = (partner, closest);
        }
        if !is_finite(length) {
            return false;
        }

        // u −= D − d and v += D − d, never below what being idle is worth.
        let lowered = |price: T, step: T, node| larger(price - step, idle(node));
        ours.set_price(start, lowered(price, length, start));
        for (other, (distance, _)) in self.distance.iter().zip(&self.settled).enumerate().filter(|(_, (_, settled))| **settled) {
            let step = length - *distance;
            theirs.set_price(other, theirs.price(other) + step);
            if let Some(node) = theirs.partner(other) {
                ours.set_price(node, lowered(ours.price(node), step, node));
            }
        }

        // From its end back to the start, each node of the path takes what the one after it has left.
        let mut left = last;
        if last.is_none() {
            ours.set_price(idler, idle(idler));
            left = ours.put(idler, IDLE);
        }
        for _ in 0..=N {
            let Some(other) = left else { break };
            let node = usize::from(self.from.get(other).copied().unwrap_or(0));
            left = ours.put(node, with(other));
            theirs.put(other, with(node));
        }
        true
    }
}

/// One assignment of up to `TRACKS` rows to up to `DETS` columns: memory, result and proof. All zero bits when new.
///
/// It takes `(TRACKS + 2 DETS) (size of T + 2) + DETS` bytes and a few more.
#[derive(Clone, Copy, Debug)]
pub struct Assignment<T, const TRACKS: usize, const DETS: usize> {
    rows: Side<T, TRACKS>,
    columns: Side<T, DETS>,
    search: Search<T, DETS>,
}

impl<T: Real, const TRACKS: usize, const DETS: usize> Default for Assignment<T, TRACKS, DETS> {
    fn default() -> Self {
        Self::new()
    }
}

impl<T: Real, const TRACKS: usize, const DETS: usize> Assignment<T, TRACKS, DETS> {
    /// No rows, no columns.
    #[must_use]
    pub const fn new() -> Self {
        Self { rows: Side::new(), columns: Side::new(), search: Search::new() }
    }

    /// Finds the assignment with the greatest sum of logarithms `miss(row)` and `hit(row, column)` of the first `rows`
    /// rows and `columns` columns (at most `TRACKS` and `DETS`).
    ///
    /// A logarithm that is not finite, or not within ±1e30, forbids the miss or the pair. Returns false where no
    /// assignment is allowed: then all rows count as missed and all prices as zero.
    ///
    /// Of equal assignments it finds the same every time. At most rows · (min(rows, columns) + 3) · columns pairs are
    /// looked at.
    #[must_use = "there may be no assignment"]
    pub fn solve(&mut self, rows: usize, columns: usize, miss: impl Fn(usize) -> T, hit: impl Fn(usize, usize) -> T) -> bool {
        self.begin(rows, columns);
        for row in 0..rows.min(TRACKS) {
            if !self.add_row(row, &miss, &hit) {
                self.begin(0, 0);
                return false;
            }
        }
        // The prices of rows once more, from those of columns: then u + v ≥ ln hit to one rounding, however many rows.
        for (row, price) in self.rows.price.iter_mut().enumerate().take(rows) {
            let offers = self.columns.nodes().enumerate().map(|(column, (v, _))| allowed(hit(row, column)) - v);
            *price = offers.fold(allowed(miss(row)), larger);
        }
        true
    }

    /// The column of `row`; none where it misses.
    #[must_use]
    pub fn column(&self, row: usize) -> Option<usize> {
        self.rows.partner(row)
    }

    /// u_t of the rows of the problem. hit_tj e^{−u_t − v_j} and miss_t e^{−u_t} are at most 1, up to rounding, and 1
    /// where assigned: the prices balance a matrix of any range.
    #[must_use]
    pub fn row_prices(&self) -> &[T] {
        self.rows.price.get(..self.rows.count).unwrap_or(&[])
    }

    /// v_j of the columns of the problem: none below zero, zero where no row has the column.
    #[must_use]
    pub fn column_prices(&self) -> &[T] {
        self.columns.price.get(..self.columns.count).unwrap_or(&[])
    }

    /// A problem of all columns and no row yet.
    pub(super) fn begin(&mut self, rows: usize, columns: usize) {
        self.rows.begin(rows, ABSENT);
        self.columns.begin(columns, IDLE);
    }

    /// Adds `row` to the problem; false, and the row left out, where no assignment is allowed with it.
    pub(super) fn add_row(&mut self, row: usize, miss: impl Fn(usize) -> T, hit: impl Fn(usize, usize) -> T) -> bool {
        let (idle, pair) = (|t| allowed(miss(t)), |t, j| allowed(hit(t, j)));
        self.search.augment(row, &mut self.rows, &mut self.columns, idle, pair)
    }

    /// Adds `column`, which has been removed, to the problem.
    pub(super) fn add_column(&mut self, column: usize, hit: impl Fn(usize, usize) -> T, search: &mut Search<T, TRACKS>) {
        let (idle, pair) = (|_| T::ZERO, |j, t| allowed(hit(t, j)));
        search.augment(column, &mut self.columns, &mut self.rows, idle, pair);
    }

    /// Takes `row` out of the problem, and the column that it has.
    pub(super) fn remove_row(&mut self, row: usize) {
        if let Some(column) = self.rows.put(row, ABSENT) {
            self.remove_column(column);
        }
    }

    /// Takes `column` out of the problem. No row may have it.
    pub(super) fn remove_column(&mut self, column: usize) {
        self.columns.put(column, ABSENT);
    }

    /// Replaces the assignment by another one of equal weight, to which the same prices belong: `choices` are rows with
    /// their columns or none, all rows of the problem.
    pub(super) fn reassign(&mut self, choices: impl Iterator<Item = (usize, Option<usize>)>) {
        self.columns.place.iter_mut().filter(|place| **place != ABSENT).for_each(|place| *place = IDLE);
        for (row, column) in choices {
            self.rows.put(row, column.map_or(IDLE, with));
            if let Some(column) = column {
                self.columns.put(column, with(row));
            }
        }
    }

    /// The same problem, assignment and prices as `other`.
    pub(super) fn copy(&mut self, other: &Self) {
        (self.rows, self.columns) = (other.rows, other.columns);
    }
}

/// `ln_weight`, or −∞ if it is none.
pub(super) fn allowed<T: Real>(ln_weight: T) -> T {
    let largest = T::lit(LARGEST);
    if ln_weight > -largest && ln_weight < largest { ln_weight } else { -T::ONE / T::ZERO }
}
