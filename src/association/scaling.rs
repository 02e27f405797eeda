//! The scale of weights before joint association: as they are, rows that sum to one, or rows and columns balanced by prices.
//!
//! ```text
//! as given   1 ≤ Σ = miss_t + Σ_j h_tj ≤ 2²⁰: what four such rows multiply to stays in range
//! plain      hit_tj / Σ, miss_t / Σ: PDA, and all there is to do for a track that shares nothing
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

/// Four rows of no larger sum are associated as they are.
const LARGEST_SUM: f64 = 1_048_576.0;

/// Below this Z, what underflowed could matter.
#[inline(always)]
pub(super) fn least<T: Real>() -> T {
    T::EPSILON * T::EPSILON * T::EPSILON * T::EPSILON
}

/// Sums a row. What is no weight (NaN, negative) becomes zero. Returns which of the first 32 hits are above zero, and the sum,
/// which is from 1 to 2²⁰: another row is scaled to one at once. `None`, and nothing is scaled, where the row spans more than
/// the precision can, unless a miss is likely: an event with a hit that underflows is then nothing beside the same event with
/// a miss in its place.
#[inline(always)]
pub(super) fn weigh<T: Real>(miss: &mut T, hit: &mut [T]) -> Option<(u32, T)> {
    count(hit.len());
    let (mut mask, mut bit, mut sum) = (0, 1u32, T::ZERO);
    for h in hit.iter_mut() {
        if *h > T::ZERO {
            sum += *h;
            mask |= bit;
        } else {
            *h = T::ZERO;
        }
        bit <<= 1;
    }
    sum += *miss;
    if sum >= T::ONE && sum <= T::lit(LARGEST_SUM) && *miss >= sum * T::EPSILON {
        return Some((mask, sum));
    }
    tame(miss, hit).then_some((mask, T::ONE))
}

/// Scales a row to the sum one, unless it spans too much.
#[cold]
#[inline(never)]
fn tame<T: Real>(miss: &mut T, hit: &mut [T]) -> bool {
    count(hit.len());
    *miss = larger(T::ZERO, *miss);
    let hits = hit.iter().fold(T::ZERO, |sum, h| sum + *h);
    let sum = hits + *miss;
    let scale = T::ONE / sum;
    let lost = |w: T| w > T::ZERO && w * scale < least();
    if !is_finite(sum * scale) || *miss * scale < T::EPSILON && (lost(*miss) || hit.iter().any(|h| lost(*h))) {
        // A row of zeros is no event's, whatever its scale.
        return sum == T::ZERO;
    }
    normalise(miss, hit, sum);
    true
}

/// Scales a row to the sum one: PDA.
pub(super) fn normalise<T: Real>(miss: &mut T, hit: &mut [T], sum: T) {
    count(hit.len());
    let scale = T::ONE / sum;
    // Divided, so that it becomes exactly one where it is all there is.
    *miss /= sum;
    hit.iter_mut().for_each(|h| *h *= scale);
}

/// Whether a logarithm is that of a weight.
pub(super) fn is_possible<T: Real>(ln_weight: T) -> bool {
    is_finite(allowed(ln_weight))
}

/// Takes the logarithm of every weight, if it is not one already; −∞ of what is none.
// Out of line: rare, and long beside what is not.
#[inline(never)]
pub(super) fn to_logarithms<T: Real, const TRACKS: usize, const DETS: usize>(matrix: &mut AssociationMatrix<T, TRACKS, DETS>) {
    let linear = matrix.domain == Domain::Linear;
    for row in 0..TRACKS {
        if let Some((miss, hit)) = matrix.row_mut(row) {
            count(hit.len());
            *miss = to_logarithm(*miss, linear);
            hit.iter_mut().for_each(|h| *h = to_logarithm(*h, linear));
        }
    }
    matrix.domain = Domain::Logarithmic;
}

/// The logarithm of a weight, or of what is one already; −∞ of what is none.
// Out of line, as above.
#[inline(never)]
pub(super) fn to_logarithm<T: Real>(weight: T, linear: bool) -> T {
    allowed(if linear { ln(weight) } else { weight })
}

/// e^x, or 0 of what is not finite.
#[inline(never)]
fn from_logarithm<T: Real>(x: T) -> T {
    if is_finite(x) { exp(x) } else { T::ZERO }
}

/// Replaces the logarithms of a row by what they are those of, scaled to the sum one.
// Out of line, as above.
#[inline(never)]
pub(super) fn exponentiate<T: Real>(miss: &mut T, hit: &mut [T]) {
    let largest = hit.iter().fold(*miss, |largest, h| larger(largest, *h));
    let mut sum = T::ZERO;
    for w in core::iter::once(&mut *miss).chain(hit.iter_mut()) {
        *w = from_logarithm(*w - largest);
        sum += *w;
    }
    if sum > T::ZERO {
        core::iter::once(miss).chain(hit).for_each(|w| *w /= sum);
    }
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
    for row in cluster.tracks.iter().map(|row| usize::from(*row)) {
        count(2 * cluster.columns.len());
        for (ln_hit, hit) in ln_hit.get_mut(row)?.iter_mut().zip(hit.get(row)?) {
            *ln_hit = to_logarithm(*hit, !logarithmic);
        }
    }
    cluster.vacant.iter_mut().take(cluster.tracks.len()).for_each(|v| *v = to_logarithm(*v, !logarithmic));
    let pair = |k, c| {
        count(1);
        cluster.ln_weight(ln_hit, k, c)
    };
    if !assignment.solve(cluster.tracks.len(), cluster.columns.len(), |k| cluster.ln_vacant(k), pair) {
        return None;
    }
    let Cluster { tracks, columns, vacant, .. } = cluster;
    // e^x with a rounding error of x, of u and of v in x.
    let mut largest = T::ONE;
    let mut scaled = |ln_w: T, price: T| {
        if is_finite(ln_w) {
            largest = larger(largest, larger(ln_w.abs(), price.abs()));
        }
        from_logarithm(ln_w - price)
    };
    for ((row, vacant), u) in tracks.iter().map(|row| usize::from(*row)).zip(vacant.iter_mut()).zip(assignment.row_prices()) {
        *vacant = scaled(*vacant, *u);
        let (hit, ln_hit) = (hit.get_mut(row)?, ln_hit.get(row)?);
        for (column, v) in columns.iter().zip(assignment.column_prices()) {
            let det = usize::from(column.det);
            *hit.get_mut(det)? = scaled(*ln_hit.get(det)?, *u + *v);
        }
        if logarithmic {
            let mut ln_hit = ln_hit.iter();
            for h in hit {
                if !is_finite(*ln_hit.next()?) {
                    *h = T::ZERO;
                }
            }
        }
    }
    for (column, v) in columns.iter_mut().zip(assignment.column_prices()) {
        column.unused = from_logarithm(-*v);
    }
    Some(largest * T::EPSILON * T::from_count(4 * tracks.len()))
}
