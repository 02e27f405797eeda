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
        let Some(column) = cluster.columns.get(i).copied() else { break };
        backward(cluster, &column, hit, nodes, &mut frontier, scale);
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
    next.iter_mut().skip(layer.len()).for_each(|n| *n = T::ZERO);
    next.iter_mut().zip(layer.iter()).for_each(|(n, f)| *n = column.unused * *f);
    for k in bits(column.tracks & !column.opening) {
        let (weight, stride) = (cluster.weight(hit, k, column), frontier.stride(k));
        for ((without, _), (_, with)) in halves(layer, stride).zip(halves_mut(next, stride)) {
            with.iter_mut().zip(without).for_each(|(n, f)| *n += weight * *f);
        }
    }
    for (slot, k) in (frontier.open.count_ones()..).zip(bits(column.opening)) {
        let weight = cluster.weight(hit, k, column);
        let with = next.iter_mut().skip(1 << (slot & 31));
        with.zip(layer.iter()).for_each(|(n, f)| *n = weight * *f);
        frontier.slot[k % MASKED] = slot as u8;
    }
    frontier.open |= column.opening;
    frontier.at += frontier.size;
    frontier.size = width;

    for k in bits(column.closing) {
        let stride = frontier.stride(k);
        let vacant = cluster.vacant.get(k).copied().unwrap_or(T::ZERO);
        count(frontier.size);
        let Some((layer, next)) = split(nodes, frontier) else { return };
        let mut next = next.iter_mut();
        for (without, with) in halves(layer, stride) {
            without.iter().zip(with).zip(next.by_ref()).for_each(|((u, s), n)| *n = vacant * *u + *s);
        }
        frontier.close(k);
        frontier.at += frontier.size;
        frontier.size /= 2;
    }
}

/// From b behind `column`, closings included, which stands where its layer was, to b before it.
fn backward<T: Real, const TRACKS: usize, const DETS: usize>(
    cluster: &mut Cluster<T, TRACKS, DETS>,
    column: &Column<T>,
    hit: &mut [[T; DETS]; TRACKS],
    nodes: &mut [T],
    frontier: &mut Frontier,
    scale: T,
) {
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
        let mut sum = T::ZERO;
        count(frontier.size);
        let mut behind = behind.iter();
        for (without, with) in halves_mut(layer, stride) {
            for ((u, s), b) in without.iter_mut().zip(with).zip(behind.by_ref()) {
                sum += *u * *b;
                *u = *vacant * *b;
                *s = *b;
            }
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
        let mut sum = T::ZERO;
        if column.opening >> k & 1 == 1 {
            layer.iter().zip(behind.iter().skip(stride)).for_each(|(f, b)| sum += *f * *b);
        } else {
            for ((without, _), (_, with)) in halves(layer, stride).zip(halves(behind, stride)) {
                without.iter().zip(with).for_each(|(f, b)| sum += *f * *b);
            }
        }
        if let Some(slot) = cluster.sums.get_mut(k) {
            *slot = sum * scale;
        }
    }
    if cluster.turned {
        let sum = layer.iter().zip(behind.iter()).fold(T::ZERO, |sum, (f, b)| sum + *f * *b);
        cluster.columns.iter_mut().filter(|c| c.det == column.det).for_each(|c| c.unused *= sum * scale);
    }
    layer.iter_mut().zip(behind.iter()).for_each(|(f, b)| *f = column.unused * *b);
    for k in bits(column.tracks) {
        let stride = frontier.stride(k);
        let Some((row, sum)) = cluster.tracks.get(k).zip(cluster.sums.get(k)) else { return };
        let Some(weight) = hit.get_mut(usize::from(*row)).and_then(|row| row.get_mut(usize::from(column.det))) else { return };
        if column.opening >> k & 1 == 1 {
            layer.iter_mut().zip(behind.iter().skip(stride)).for_each(|(f, b)| *f += *weight * *b);
        } else {
            for ((without, _), (_, with)) in halves_mut(layer, stride).zip(halves(behind, stride)) {
                without.iter_mut().zip(with).for_each(|(f, b)| *f += *weight * *b);
            }
        }
        *weight *= *sum;
    }
}

/// Runs of the entries of `layer` whose index has the bit `stride` clear, each with the run where it is set.
#[inline(always)]
fn halves<T>(mut layer: &[T], stride: usize) -> impl Iterator<Item = (&[T], &[T])> {
    core::iter::from_fn(move || {
        let (without, rest) = layer.split_at_checked(stride)?;
        let (with, rest) = rest.split_at_checked(stride)?;
        layer = rest;
        Some((without, with))
    })
}

/// The same, to be written.
#[inline(always)]
fn halves_mut<T>(mut layer: &mut [T], stride: usize) -> impl Iterator<Item = (&mut [T], &mut [T])> {
    core::iter::from_fn(move || {
        let (without, rest) = core::mem::take(&mut layer).split_at_mut_checked(stride)?;
        let (with, rest) = rest.split_at_mut_checked(stride)?;
        layer = rest;
        Some((without, with))
    })
}
