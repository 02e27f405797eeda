//! The scale of weights before joint association: rows that sum to one, or rows and columns balanced by prices.
//!
//! ```text
//! plain      hit_tj / Σ, miss_t / Σ over the row: PDA, and all there is to do for a track that shares nothing
//! balanced   hit_tj e^{−u_t − v_j},  vacant_t e^{−u_t},  q_j = e^{−v_j}       u, v: prices of the best event (assignment.rs)
//! ```
//!
//! Every event pays u_t for every track and v_j for every detection, used or not: balancing multiplies all of them by the
//! same factor, after which no weight is above 1 and the best event is 1. The exponents are formed from logarithms, whose
//! rounding bounds what it does to a marginal.

use super::assignment::{Assignment, allowed};
use super::cluster::Cluster;
use super::matrix::{AssociationMatrix, Domain};
use super::work::count;
use crate::scalar::{Real, exp, is_finite, larger, ln};

/// Below this Z, what underflowed could matter.
#[inline(always)]
pub(super) fn least<T: Real>() -> T {
    T::EPSILON * T::EPSILON * T::EPSILON * T::EPSILON
}

/// Scales a row to the sum one: PDA. What is no weight (NaN, negative) counts as zero. `false` where the row spans more
/// than the precision can, unless a miss is likely: an event with a hit that underflows is then nothing beside the same
/// event with a miss in its place.
#[inline(always)]
pub(super) fn normalise<T: Real, const TRACKS: usize, const DETS: usize>(
    matrix: &mut AssociationMatrix<T, TRACKS, DETS>,
    row: usize,
) -> bool {
    let Some((miss, hit)) = matrix.row_mut(row) else { return true };
    let (mut sum, mut smallest) = (T::ZERO, T::ONE / T::ZERO);
    count(2 * hit.len() + 1);
    for w in hit.iter_mut() {
        if *w > T::ZERO {
            sum += *w;
            if *w < smallest {
                smallest = *w;
            }
        } else {
            *w = T::ZERO;
        }
    }
    if sum == T::ZERO && *miss > T::ZERO && is_finite(*miss) {
        *miss = T::ONE;
        return true;
    }
    if *miss > T::ZERO {
        sum += *miss;
        if *miss < smallest {
            smallest = *miss;
        }
    } else {
        *miss = T::ZERO;
    }
    let scale = T::ONE / sum;
    if !(is_finite(sum) && is_finite(scale)) || (smallest * scale < least() && *miss * scale < T::EPSILON) {
        return sum == T::ZERO;
    }
    *miss *= scale;
    hit.iter_mut().for_each(|h| *h *= scale);
    true
}

/// Whether a logarithm is that of a weight.
pub(super) fn is_possible<T: Real>(ln_weight: T) -> bool {
    is_finite(allowed(ln_weight))
}

/// Takes the logarithm of every weight; −∞ of what is none.
// Out of line: rare, and long beside what is not.
#[inline(never)]
pub(super) fn to_logarithms<T: Real, const TRACKS: usize, const DETS: usize>(matrix: &mut AssociationMatrix<T, TRACKS, DETS>) {
    for row in 0..TRACKS {
        if let Some((miss, hit)) = matrix.row_mut(row) {
            core::iter::once(miss).chain(hit).for_each(|w| *w = allowed(ln(*w)));
        }
    }
    matrix.domain = Domain::Logarithmic;
}

/// Scales rows and columns by the prices of the best event. `None` where no event is possible; otherwise a bound on what the
/// rounding of logarithms does to a marginal.
pub(super) fn balance<T: Real, const TRACKS: usize, const DETS: usize>(
    cluster: &mut Cluster<T, TRACKS, DETS>,
    hit: &mut [[T; DETS]; TRACKS],
    ln_hit: &mut [[T; DETS]; TRACKS],
    assignment: &mut Assignment<T, TRACKS, DETS>,
    logarithmic: bool,
) -> Option<T> {
    let to_ln = |w: T| allowed(if logarithmic { w } else { ln(w) });
    let Cluster { tracks, columns, vacant, .. } = cluster;
    let rows = || tracks.iter().map(|row| usize::from(*row));
    for row in rows() {
        count(2 * columns.len());
        for (ln_hit, hit) in ln_hit.get_mut(row)?.iter_mut().zip(hit.get(row)?) {
            *ln_hit = to_ln(*hit);
        }
    }
    vacant.iter_mut().take(tracks.len()).for_each(|v| *v = to_ln(*v));
    let none = -T::ONE / T::ZERO;
    let ln_of = |k: usize, c: usize| {
        count(1);
        let (row, column) = tracks.get(k).zip(columns.get(c))?;
        ln_hit.get(usize::from(*row))?.get(usize::from(column.det)).copied()
    };
    let ln_vacant = |k: usize| vacant.get(k).copied().unwrap_or(none);
    if !assignment.solve(tracks.len(), columns.len(), ln_vacant, |k, c| ln_of(k, c).unwrap_or(none)) {
        return None;
    }
    // e^x with a rounding error of x, of u and of v in x.
    let mut largest = T::ONE;
    let mut scaled = |ln_w: T, price: T| {
        if !is_finite(ln_w) {
            return T::ZERO;
        }
        largest = larger(largest, larger(ln_w.abs(), price.abs()));
        exp(ln_w - price)
    };
    for ((row, vacant), u) in rows().zip(vacant.iter_mut()).zip(assignment.row_prices()) {
        *vacant = scaled(*vacant, *u);
        let (hit, ln_hit) = (hit.get_mut(row)?, ln_hit.get(row)?);
        for (column, v) in columns.iter().zip(assignment.column_prices()) {
            let det = usize::from(column.det);
            if let Some((hit, ln_hit)) = hit.get_mut(det).zip(ln_hit.get(det)) {
                *hit = scaled(*ln_hit, *u + *v);
            }
        }
        if logarithmic {
            hit.iter_mut().zip(ln_hit).filter(|(_, ln_hit)| !is_finite(**ln_hit)).for_each(|(hit, _)| *hit = T::ZERO);
        }
    }
    for (column, v) in columns.iter_mut().zip(assignment.column_prices()) {
        column.unused = exp(-*v);
    }
    Some(largest * T::EPSILON * T::from_count(4 * tracks.len()))
}
