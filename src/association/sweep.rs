//! The dense sweep: exact marginals of a cluster without listing its events.
//!
//! ```text
//! layer i     f_i(s) = Σ weights of all ways to serve just the set s of the open tracks by the columns before i
//! column i    f(s) ← q_i f(s) + Σ_{t ∈ s} h_ti f(s \ t)       q_i the weight of the column unused
//! closing t   f(s) ← vacant_t f(s) + f(s ∪ t)                 after the last column of t
//! backward    b the same from the end, b = 1 there;  Z = f_0 b_0
//! marginal    β_ti = h_ti Σ_{s ∌ t} f_i(s) b_{i+1}(s ∪ t) / Z,   β_t0 = vacant_t Σ_{s ∌ t} f(s) b(s) / Z at its closing
//! ```
//!
//! The same positive terms as enumeration, added where they meet. A layer is an array indexed by the set, 2^(open
//! tracks) long: a new track takes the highest bit, a closing one is taken out of the index. Forward layers are kept one
//! behind the other; the backward pass overwrites them.
//!
//! Fortmann, Bar-Shalom and Scheffe 1983 for the events; the merging of equal sets is Maskell, Briers and Wright's
//! efficient hypothesis management (2004), swept along the detections instead of the tracks.

use super::cluster::{Cluster, Column, MASKED, bits};
use super::work::count;
use crate::scalar::{Real, is_finite};

/// Layers of more tracks than this are not tried.
const MOST_OPEN: u32 = 24;

/// Where the sweep stands.
struct Frontier {
    open: u32,
    /// The bit of every open track in the index of a layer; of a closed track, the bit it had.
    slot: [u8; MASKED],
    /// The current layer: where it begins, and its size.
    at: usize,
    size: usize,
}

impl Frontier {
    /// 2^slot of an open track
    #[inline(always)]
    fn stride(&self, k: usize) -> usize {
        1usize << (self.slot[k % MASKED] & 31)
    }

    /// Takes track `k` out of the index.
    #[inline(always)]
    fn close(&mut self, k: usize) {
        self.open &= !(1 << k);
        let gap = self.slot[k % MASKED];
        for other in bits(self.open) {
            let slot = &mut self.slot[other % MASKED];
            *slot -= u8::from(*slot > gap);
        }
    }

    /// Undoes [`close`](Self::close).
    #[inline(always)]
    fn reopen(&mut self, k: usize) {
        let gap = self.slot[k % MASKED];
        for other in bits(self.open) {
            let slot = &mut self.slot[other % MASKED];
            *slot += u8::from(*slot >= gap);
        }
        self.open |= 1 << k;
    }
}

/// The size of all layers of the dense sweep together; more than any room where a layer is not tried.
#[inline(never)]
pub(super) fn size<T: Real, const TRACKS: usize, const DETS: usize>(cluster: &Cluster<T, TRACKS, DETS>) -> usize {
    let (mut open, mut total) = (0u32, 1usize);
    for column in &cluster.columns {
        open |= column.tracks;
        let mut width = open.count_ones();
        if width > MOST_OPEN {
            return usize::MAX;
        }
        // After the column, and after every closing.
        total = total.saturating_add(1 << width);
        for _ in bits(column.closing) {
            width -= 1;
            total = total.saturating_add(1 << width);
        }
        open &= !column.closing;
    }
    total
}

/// Replaces the weights of `cluster` in `hit` and `cluster.vacant` by marginals. Returns Z; where it is not above `least`
/// nothing is replaced. The layers must fit.
pub(super) fn marginals<T: Real, const TRACKS: usize, const DETS: usize>(
    cluster: &mut Cluster<T, TRACKS, DETS>,
    hit: &mut [[T; DETS]; TRACKS],
    nodes: &mut [T],
    least: T,
) -> T {
    let mut frontier = Frontier { open: 0, slot: [0; MASKED], at: 0, size: 1 };
    if let Some(first) = nodes.first_mut() {
        *first = T::ONE;
    }
    for column in &cluster.columns {
        forward(cluster, column, hit, nodes, &mut frontier);
    }
    let z = nodes.get(frontier.at).copied().unwrap_or(T::ZERO);
    if z <= least || !is_finite(z) {
        return z;
    }
    if let Some(last) = nodes.get_mut(frontier.at) {
        *last = T::ONE;
    }
    let scale = T::ONE / z;
    for i in (0..cluster.columns.len()).rev() {
        backward(cluster, i, hit, nodes, &mut frontier, scale);
    }
    z
}

/// The current layer, and the room behind it.
#[inline(always)]
fn split<'a, T>(nodes: &'a mut [T], frontier: &Frontier) -> Option<(&'a mut [T], &'a mut [T])> {
    nodes.get_mut(frontier.at..)?.split_at_mut_checked(frontier.size)
}

fn forward<T: Real, const TRACKS: usize, const DETS: usize>(
    cluster: &Cluster<T, TRACKS, DETS>,
    column: &Column<T>,
    hit: &[[T; DETS]; TRACKS],
    nodes: &mut [T],
    frontier: &mut Frontier,
) {
    let Some((layer, room)) = split(nodes, frontier) else { return };
    let width = frontier.size << (column.opening.count_ones() & 31);
    let Some(next) = room.get_mut(..width) else { return };
    count(width + layer.len() * column.tracks.count_ones() as usize);
    scaled(next, layer, column.unused);
    next.iter_mut().skip(layer.len()).for_each(|n| *n = T::ZERO);
    for (slot, k) in (frontier.open.count_ones()..).zip(bits(column.opening)) {
        frontier.slot[k % MASKED] = slot as u8;
    }
    for k in bits(column.tracks) {
        let stride = frontier.stride(k);
        let weight = cluster.weight(hit, k, column);
        each_pair(layer, next, stride, |f, n| *n += weight * *f);
    }
    frontier.open |= column.opening;
    frontier.at += frontier.size;
    frontier.size = width;

    for k in bits(column.closing) {
        let stride = frontier.stride(k);
        let vacant = cluster.vacant.get(k).copied().unwrap_or(T::ZERO);
        count(frontier.size);
        let Some((layer, next)) = split(nodes, frontier) else { return };
        let mut s = 0;
        for n in next {
            let Some((f, with)) = layer.get(s).zip(layer.get(s + stride)) else { break };
            *n = vacant * *f + *with;
            s = after(s, stride);
        }
        frontier.close(k);
        frontier.at += frontier.size;
        frontier.size /= 2;
    }
}

/// From b behind column `i`, closings included, which stands where its layer was, to b before it.
fn backward<T: Real, const TRACKS: usize, const DETS: usize>(
    cluster: &mut Cluster<T, TRACKS, DETS>,
    i: usize,
    hit: &mut [[T; DETS]; TRACKS],
    nodes: &mut [T],
    frontier: &mut Frontier,
    scale: T,
) {
    let Some(column) = cluster.columns.get(i).copied() else { return };
    let mut closing = column.closing;
    while closing != 0 {
        let k = 31 - closing.leading_zeros().min(31) as usize;
        closing &= !(1 << k);
        frontier.reopen(k);
        frontier.size *= 2;
        frontier.at -= frontier.size.min(frontier.at);
        let stride = frontier.stride(k);
        let Some(vacant) = cluster.vacant.get_mut(k) else { return };
        let Some((layer, behind)) = split(nodes, frontier) else { return };
        let (mut sum, mut s) = (T::ZERO, 0);
        count(frontier.size);
        for b in behind {
            let Some(f) = layer.get_mut(s) else { break };
            sum += *f * *b;
            *f = *vacant * *b;
            let Some(with) = layer.get_mut(s + stride) else { break };
            *with = *b;
            s = after(s, stride);
        }
        *vacant *= sum * scale;
    }

    frontier.open &= !column.opening;
    frontier.size = 1usize << (frontier.open.count_ones() & 31);
    frontier.at -= frontier.size.min(frontier.at);
    let Some((layer, behind)) = split(nodes, frontier) else { return };
    count(layer.len() * (1 + 2 * column.tracks.count_ones() as usize));
    // All sums first: b overwrites f.
    for k in bits(column.tracks) {
        let stride = frontier.stride(k);
        if let Some(slot) = cluster.sums.get_mut(k) {
            *slot = sum_of_products(layer, behind, stride) * scale;
        }
    }
    if cluster.turned {
        let sum = sum_of_products(layer, behind, 0) * scale;
        if let Some(column) = cluster.columns.get_mut(i) {
            column.unused *= sum;
        }
    }
    scaled(layer, behind, column.unused);
    for k in bits(column.tracks) {
        let stride = frontier.stride(k);
        let Some((row, sum)) = cluster.tracks.get(k).zip(cluster.sums.get(k)) else { return };
        let Some(weight) = hit.get_mut(usize::from(*row)).and_then(|row| row.get_mut(usize::from(column.det))) else { return };
        each_pair(layer, behind, stride, |n, b| *n += *weight * *b);
        *weight *= *sum;
    }
}

/// `into` = `weight` × `from`, as far as both go.
#[inline(never)]
fn scaled<T: Real>(into: &mut [T], from: &[T], weight: T) {
    let mut from = from.iter();
    for n in into {
        let Some(f) = from.next() else { break };
        *n = weight * *f;
    }
}

/// Σ f(s) b(s ∪ t)
#[inline(never)]
fn sum_of_products<T: Real>(layer: &mut [T], wide: &mut [T], stride: usize) -> T {
    let mut sum = T::ZERO;
    each_pair(layer, wide, stride, |f, b| sum += *f * *b);
    sum
}

/// Calls `each` with f(s) of `layer` and f(s ∪ t) of `wide` for every s without t, whose bit is `stride`; without a stride with
/// both of every s. As layers have 2^k entries, four at a time where they can be.
#[inline(always)]
fn each_pair<T>(layer: &mut [T], wide: &mut [T], stride: usize, mut each: impl FnMut(&mut T, &mut T)) {
    if stride.is_multiple_of(4) && layer.len().min(wide.len()) >= 4 {
        walk(layer.as_chunks_mut::<4>().0, wide.as_chunks_mut::<4>().0, stride / 4, |fours, others| {
            fours.iter_mut().zip(others).for_each(|(s, with)| each(s, with));
        });
    } else {
        walk(layer, wide, stride, each);
    }
}

/// The same for entries of any kind.
#[inline(always)]
fn walk<E>(layer: &mut [E], wide: &mut [E], stride: usize, mut each: impl FnMut(&mut E, &mut E)) {
    let mut s = 0;
    while let Some((without, with)) = layer.get_mut(s).zip(wide.get_mut(s + stride)) {
        each(without, with);
        s = after(s, stride);
    }
}

/// The next index after `s` without the bit `stride`.
#[inline(always)]
fn after(s: usize, stride: usize) -> usize {
    let next = s + 1;
    next + (next & stride)
}
