//! The bounded sweep: the heaviest sets only, with the weight of all events given up.
//!
//! ```text
//! rows        every row is scaled to the sum one: h_ti, and vacant_t
//! after_ti    what is left of the row of t behind column i;  before = after + h_ti
//! take, pass  h_ti / before,  after / before
//! node        the set s of open tracks served, and with diffuse clutter the number of tracks served k
//! weight      f(s) = the weight of all ways to reach s, times what the open and later rows can still add at most
//! column i    f(s ∪ t) += f(s) take_ti Π_{r ≠ t} pass_ri,    f(s) += f(s) q_i Π_r pass_ri      r, t unserved, gating i
//! end         f *= Π_{k ≤ i < n} (m − i) / m under diffuse clutter: never more than 1
//! ```
//!
//! Scaled this way f(s) is an upper bound of the weight of all events through s. When a layer holds more nodes than it
//! may, the lightest are given up, and D adds up their f: the weight of the events given up is at most D. The same nodes
//! are heaviest by the best known bound on what they can become.
//!
//! **Theorem.** With Z the weight of the events kept, every marginal is within D / (Z + D) of the exact one. *Proof.* Let
//! A ≤ Z be the weight of the kept events that agree with a choice, d ≤ D that of the events given up and a ≤ d the
//! part of it that agrees. Then |(A + a) / (Z + d) − A / Z| = |a Z − A d| / (Z (Z + d)) ≤ d / (Z + d) ≤ D / (Z + D). ∎
//!
//! Every term is positive, so that rounding adds at most u Σ_i (6 n_i + 8 + 2 a_i) to first order, with the unit roundoff u,
//! n_i tracks at column i and a_i additions into one node; D is a sum of K terms and at most K u too small. The bound that
//! is returned includes both.
//!
//! Σ_s f(s) of a layer is an upper bound of Z: once D over it exceeds what is tolerated, the sweep need not go on.

use super::cluster::{Cluster, Column, MASKED, bits};
use super::work::count;
use crate::scalar::Real;
use core::mem::swap;

/// Bits of a node's key that name open tracks; those above count the tracks served.
const SLOTS: u32 = 26;
/// One track served
const SERVED: u32 = 1 << SLOTS;
/// Tracks that may gate one column
const MOVES: usize = SLOTS as usize;

/// What a track can do at a column.
#[derive(Clone, Copy)]
struct Move<T> {
    k: usize,
    bit: u32,
    take: T,
    pass: T,
}

/// What the tracks that gate a column can do, and the bits of those that close behind it.
struct Moves<T> {
    list: heapless::Vec<Move<T>, MOVES>,
    closing: u32,
    unused: T,
    /// What serving adds to a key besides the bit of the track
    served: u32,
}

/// Where a node can go: keys behind the column with the closing tracks still in them, and the share of the weight each gets.
type Choices<T> = heapless::Vec<(u32, T), { MOVES + 1 }>;

impl<T: Real> Moves<T> {
    const fn new() -> Self {
        Self { list: heapless::Vec::new(), closing: 0, unused: T::ONE, served: 0 }
    }

    /// Lists the choices of the node `key`.
    #[inline(never)]
    fn choices(&self, key: u32, choices: &mut Choices<T>) {
        count(2 * self.list.len() + 1);
        choices.clear();
        let mut rest = [T::ONE; MOVES];
        let mut product = T::ONE;
        for (i, step) in self.list.iter().enumerate().rev() {
            let Some(rest) = rest.get_mut(i) else { return };
            *rest = product;
            if key & step.bit == 0 {
                product *= step.pass;
            }
        }
        let _ = choices.push((key, product * self.unused));
        product = T::ONE;
        for (rest, step) in rest.iter().zip(&self.list) {
            if key & step.bit == 0 {
                if choices.push(((key | step.bit) + self.served, product * step.take * *rest)).is_err() {
                    return;
                }
                product *= step.pass;
            }
        }
    }
}

/// One layer of nodes, ascending by key.
#[derive(Clone, Copy)]
struct Layer {
    start: usize,
    len: usize,
}

impl Layer {
    fn end(self) -> usize {
        self.start + self.len
    }
}

/// Room for nodes: all layers, one behind the other.
pub(super) struct Nodes<'a, T> {
    pub weight: &'a mut [T],
    pub key: &'a mut [u32],
}

impl<T: Real> Nodes<'_, T> {
    /// Key and weight of the node at `n`.
    #[inline(always)]
    fn at(&self, n: usize) -> (u32, T) {
        self.key.get(n).copied().zip(self.weight.get(n).copied()).unwrap_or((0, T::ZERO))
    }

    /// Where `key` stands in `layer`, or where it would.
    #[inline(never)]
    fn find(&self, layer: Layer, key: u32) -> Result<usize, usize> {
        let keys = self.key.get(layer.start..layer.end()).unwrap_or_default();
        count(1 + keys.len().checked_ilog2().map_or(0, |steps| steps as usize + 1));
        keys.binary_search(&key).map(|n| layer.start + n).map_err(|n| layer.start + n)
    }

    /// Adds `weight` to the node `key`. A full layer lets its lightest node go, or turns the newcomer away; then `false`.
    fn add(&mut self, layer: &mut Layer, limit: usize, key: u32, weight: T) -> bool {
        let at = match self.find(*layer, key) {
            Ok(n) => {
                if let Some(sum) = self.weight.get_mut(n) {
                    *sum += weight;
                }
                return true;
            }
            Err(at) => at,
        };
        count(layer.len);
        if layer.len < limit && layer.end() < self.key.len() {
            layer.len += 1;
            self.shift(at..layer.end(), key, weight);
            return true;
        }
        let weights = self.weight.get(layer.start..layer.end()).unwrap_or_default();
        count(layer.len);
        let (mut lightest, mut least) = (0, weight);
        for (n, w) in weights.iter().enumerate() {
            if *w < least {
                (lightest, least) = (layer.start + n, *w);
            }
        }
        if least < weight {
            // The newcomer takes the place of the lightest, and is moved to its own.
            if lightest < at {
                self.shift((lightest..at).rev(), key, weight);
            } else {
                self.shift(at..lightest + 1, key, weight);
            }
        }
        false
    }

    /// Puts a node in the first place of `run`: each goes to the next, the last one goes for good.
    #[inline(never)]
    fn shift(&mut self, run: impl Iterator<Item = usize>, mut key: u32, mut weight: T) {
        for n in run {
            let Some((k, w)) = self.key.get_mut(n).zip(self.weight.get_mut(n)) else { return };
            swap(k, &mut key);
            swap(w, &mut weight);
        }
    }

    /// The layer behind a column, of at most `limit` nodes, and the weight given up for it.
    fn advance(&mut self, layer: Layer, moves: &Moves<T>, limit: usize) -> (Layer, T) {
        let mut next = Layer { start: layer.end(), len: 0 };
        let (mut complete, mut choices) = (true, Choices::new());
        for n in layer.start..layer.end() {
            let (key, f) = self.at(n);
            moves.choices(key, &mut choices);
            for (child, share) in &choices {
                if f * *share > T::ZERO {
                    complete &= self.add(&mut next, limit, child & !moves.closing, f * *share);
                }
            }
        }
        let mut given_up = T::ZERO;
        if !complete {
            // Who stays is known now; a node may have come and gone and come again, so all is added up afresh.
            self.weight.iter_mut().skip(next.start).take(next.len).for_each(|w| *w = T::ZERO);
            for n in layer.start..layer.end() {
                let (key, f) = self.at(n);
                moves.choices(key, &mut choices);
                for (child, share) in &choices {
                    match self.find(next, child & !moves.closing).ok().and_then(|n| self.weight.get_mut(n)) {
                        Some(w) => *w += f * *share,
                        None => given_up += f * *share,
                    }
                }
            }
        }
        (next, given_up)
    }
}

/// What the forward sweep found.
#[derive(Clone, Copy, Debug)]
pub(super) struct Kept<T> {
    /// The weight of the events kept, as a share of the product of the row sums
    pub z: T,
    /// An upper bound of the weight of the others
    pub given_up: T,
    /// A bound on the relative error of every sum
    rounding: T,
}

impl<T: Real> Kept<T> {
    /// A bound on the error of every marginal.
    pub fn error_bound(&self) -> T {
        self.given_up / (self.z + self.given_up) + self.rounding
    }
}

/// The bounded sweep over one cluster.
pub(super) struct Beam<'a, T, const TRACKS: usize, const DETS: usize> {
    pub nodes: Nodes<'a, T>,
    pub cluster: &'a mut Cluster<T, TRACKS, DETS>,
    pub hit: &'a mut [[T; DETS]; TRACKS],
    /// Scratch: what is left of every row behind a column
    pub after: &'a mut [[T; DETS]; TRACKS],
    /// Scratch: where the layer before each column begins
    pub starts: &'a mut [u32; DETS],
    /// m, the number of detections gated, if clutter is diffuse
    pub diffuse: Option<usize>,
    /// The largest error bound that is of use
    pub tolerance: T,
}

impl<T: Real, const TRACKS: usize, const DETS: usize> Beam<'_, T, TRACKS, DETS> {
    /// Replaces the weights of the cluster by marginals, unless what was given up is too much by `accept`. `None` where more
    /// tracks are open at a time than a key can name, or the bound exceeds the tolerance on the way.
    pub fn marginals(&mut self, accept: impl FnOnce(&Kept<T>) -> bool) -> Option<Kept<T>> {
        if self.diffuse.is_some() && self.cluster.tracks.len() >= MASKED {
            return None;
        }
        let slots = self.assign_slots()?;
        self.sum_rows();
        let (kept, last) = self.forward(&slots)?;
        if accept(&kept) {
            self.backward(&slots, last, T::ONE / kept.z);
        }
        Some(kept)
    }

    /// A bit of the key for every track, used again when its track has closed.
    fn assign_slots(&self) -> Option<[u8; MASKED]> {
        let mut slots = [0; MASKED];
        let mut taken = 0u32;
        for column in &self.cluster.columns {
            for k in bits(column.opening) {
                let free = (!taken).trailing_zeros();
                if free >= SLOTS {
                    return None;
                }
                taken |= 1 << free;
                slots[k % MASKED] = free as u8;
            }
            for k in bits(column.closing) {
                taken &= !(1 << slots[k % MASKED]);
            }
        }
        Some(slots)
    }

    fn sum_rows(&mut self) {
        let Cluster { tracks, columns, vacant, sums, .. } = &mut *self.cluster;
        sums.copy_from_slice(vacant);
        for column in columns.iter().rev() {
            let det = usize::from(column.det);
            for ((row, sum), k) in tracks.iter().zip(sums.iter_mut()).zip(0u32..) {
                let row = usize::from(*row);
                let Some(after) = self.after.get_mut(row).and_then(|r| r.get_mut(det)) else { return };
                let Some(h) = self.hit.get(row).and_then(|r| r.get(det)) else { return };
                if column.tracks.unbounded_shr(k) & 1 == 1 {
                    *after = *sum;
                    *sum += *h;
                }
            }
        }
    }

    /// Writes what the tracks of `column` can do.
    #[inline(never)]
    fn list_moves(&self, column: &Column<T>, slots: &[u8; MASKED], moves: &mut Moves<T>) {
        moves.list.clear();
        (moves.closing, moves.unused) = (0, column.unused);
        moves.served = if self.diffuse.is_some() { SERVED } else { 0 };
        for k in bits(column.tracks) {
            let h = self.cluster.weight(self.hit, k, column);
            let after = self.cluster.weight(self.after, k, column);
            let scale = T::ONE / (h + after);
            let bit = 1 << (slots[k % MASKED] & 31);
            let _ = moves.list.push(Move { k, bit, take: h * scale, pass: after * scale });
            if column.closing >> k & 1 == 1 {
                moves.closing |= bit;
            }
        }
    }

    /// From the first column to the last; in the end the weights of the last layer are its b.
    fn forward(&mut self, slots: &[u8; MASKED]) -> Option<(Kept<T>, Layer)> {
        *self.nodes.key.first_mut()? = 0;
        *self.nodes.weight.first_mut()? = T::ONE;
        let (mut layer, mut moves) = (Layer { start: 0, len: 1 }, Moves::new());
        let (mut given_up, mut roundings, mut terms) = (T::ZERO, 0, 0);
        let columns = self.cluster.columns.len();
        for i in 0..columns {
            *self.starts.get_mut(i)? = layer.start as u32;
            self.list_moves(self.cluster.columns.get(i)?, slots, &mut moves);
            let additions = (moves.list.len() + 1) << moves.closing.count_ones().min(8);
            let choices = moves.list.len() + 1;
            roundings += 6 * choices + 8 + 2 * additions.min(layer.len) * choices;
            terms += layer.len * choices;
            // Every layer to come has the same claim to the room that is left.
            let limit = self.nodes.key.len().saturating_sub(layer.end()) / (columns - i).max(1);
            let (next, lost) = self.nodes.advance(layer, &moves, limit);
            given_up += lost;
            layer = next;
            if given_up > T::ZERO {
                let weights = self.nodes.weight.get(layer.start..layer.end()).unwrap_or_default();
                let most = weights.iter().fold(T::ZERO, |sum, f| sum + *f);
                if given_up > self.tolerance * (most + given_up) {
                    return None;
                }
            }
        }
        given_up *= T::ONE + T::from_count(terms) * T::EPSILON;
        let mut z = T::ZERO;
        for n in layer.start..layer.end() {
            let prior = self.clutter_prior((self.nodes.at(n).0 >> SLOTS) as usize);
            if let Some(weight) = self.nodes.weight.get_mut(n) {
                z += *weight * prior;
                *weight = prior;
            }
        }
        Some((Kept { z, given_up, rounding: T::from_count(roundings) * T::EPSILON * T::lit(0.5) }, layer))
    }

    /// Π_{k ≤ i < n} (m − i) / m, where n tracks could be served
    fn clutter_prior(&self, served: usize) -> T {
        let Some(m) = self.diffuse else { return T::ONE };
        let most = self.cluster.tracks.len().min(m);
        let left = (served..most).map_while(|i| m.checked_sub(i));
        left.fold(T::ONE, |product, left| product * T::from_count(left) / T::from_count(m))
    }

    /// From the last column to the first: b takes the place of f, marginals that of weights.
    fn backward(&mut self, slots: &[u8; MASKED], mut next: Layer, scale: T) {
        let (mut moves, mut choices) = (Moves::new(), Choices::new());
        for i in (0..self.cluster.columns.len()).rev() {
            let (Some(column), Some(start)) = (self.cluster.columns.get(i).copied(), self.starts.get(i)) else { return };
            let start = *start as usize;
            let layer = Layer { start, len: next.start.saturating_sub(start) };
            self.list_moves(&column, slots, &mut moves);
            let (mut served, mut vacant) = ([T::ZERO; MOVES], [T::ZERO; MOVES]);
            for n in layer.start..layer.end() {
                let (key, f) = self.nodes.at(n);
                let mut b = T::ZERO;
                moves.choices(key, &mut choices);
                for (child, share) in &choices {
                    let Ok(behind) = self.nodes.find(next, child & !moves.closing) else { continue };
                    let onward = *share * self.nodes.at(behind).1;
                    b += onward;
                    count(moves.list.len());
                    for (step, (served, vacant)) in moves.list.iter().zip(served.iter_mut().zip(&mut vacant)) {
                        if (child ^ key) & step.bit != 0 {
                            *served += f * onward;
                        } else if moves.closing & !child & step.bit != 0 {
                            *vacant += f * onward;
                        }
                    }
                }
                if let Some(weight) = self.nodes.weight.get_mut(n) {
                    *weight = b;
                }
            }
            for ((step, served), unserved) in moves.list.iter().zip(served).zip(vacant) {
                let row = self.cluster.tracks.get(step.k).and_then(|row| self.hit.get_mut(usize::from(*row)));
                if let Some(h) = row.and_then(|row| row.get_mut(usize::from(column.det))) {
                    *h = served * scale;
                }
                if moves.closing & step.bit != 0
                    && let Some(vacant) = self.cluster.vacant.get_mut(step.k)
                {
                    *vacant = unserved * scale;
                }
            }
            next = layer;
        }
    }
}
