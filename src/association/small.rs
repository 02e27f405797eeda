//! The dense sweep of a small cluster: two, three or four tracks, with every layer an array of all 2^N sets.
//!
//! ```text
//! whole_t     miss_t + Σ of the track's private h_tj
//! column i    f(s) ← f(s) + Σ_{t ∈ s} h_ti f(s \ t)
//! end         b(s) = Π_{t ∉ s} whole_t,   Z = Σ_s f(s) b(s),   β_t0 = Σ_{s ∌ t} f(s) b(s) / Z, split as whole_t is
//! backward    β_ti = h_ti Σ_{s ∌ t} f_i(s) b(s ∪ t) / Z,   b(s) ← b(s) + Σ_{t ∉ s} h_ti b(s ∪ t)
//! ```
//!
//! What `sweep.rs` does for any number of open tracks, without opening and closing: the index of a set is the set, and all
//! loops over sets unroll. A layer is brought on from a copy of itself, by one track after the other, and by none that does not gate
//! the detection. Most clusters in practice are of this size, so they are swept straight from the masks of their rows.

use super::cluster::bits;
use super::matrix::AssociationMatrix;
use super::work::count;
use crate::scalar::{Real, is_finite};
use core::array::from_fn;

/// Replaces the weights of N `rows` by marginals, in layers from `nodes`. Of the detections, 32 at most, `masks` names those
/// that each row gates and `shared` those that others gate, too. `false`, and nothing replaced, where Z is not above `least`;
/// `None` where the layers do not fit.
#[inline(never)]
pub(super) fn marginals<T: Real, const TRACKS: usize, const DETS: usize, const N: usize, const SETS: usize>(
    matrix: &mut AssociationMatrix<T, TRACKS, DETS>,
    rows: [usize; N],
    masks: [u32; N],
    shared: u32,
    nodes: &mut [T],
    least: T,
) -> Option<bool> {
    let miss = matrix.miss.get_disjoint_mut(rows).ok()?;
    let hit = matrix.hit.get_disjoint_mut(rows).ok()?;
    let columns = masks.iter().fold(0, |all, mask| all | mask) & shared;
    let later = columns & columns.wrapping_sub(1);
    let layers = nodes.as_chunks_mut::<SETS>().0.get_mut(..later.count_ones() as usize)?;
    count(3 * SETS * N * (layers.len() + 2));

    let mut whole = [T::ZERO; N];
    let mut f = [T::ZERO; SETS];
    f[0] = T::ONE;
    for t in 0..N {
        whole[t] = bits(masks[t] & !shared).filter_map(|j| hit[t].get(j)).fold(*miss[t], |sum, h| sum + *h);
        f[with::<SETS>(0, t)] = *hit[t].get(columns.trailing_zeros() as usize)?;
    }
    for (j, layer) in bits(later).zip(layers.iter_mut()) {
        *layer = f;
        let h: [T; N] = from_fn(|t| hit[t].get(j).copied().unwrap_or(T::ZERO));
        each!(t in N {
            if h[t] > T::ZERO {
                for k in 0..SETS / 2 {
                    let s = without::<SETS>(k, t);
                    f[with::<SETS>(s, t)] += h[t] * layer[s];
                }
            }
        });
    }

    let mut b = [T::ONE; SETS];
    for (t, whole) in whole.iter().enumerate() {
        for s in 0..SETS {
            if s >> t & 1 == 0 {
                b[s] *= *whole;
            }
        }
    }
    // Summed over one track after the other.
    let mut sums: [T; SETS] = from_fn(|s| f[s] * b[s]);
    let mut missed = [T::ZERO; N];
    for (t, missed) in missed.iter_mut().enumerate().rev() {
        for s in 0..SETS {
            if s < 1 << t {
                *missed += sums[s];
                sums[s] += sums[with::<SETS>(s, t)];
            }
        }
    }
    let z = sums[0];
    if z <= least || !is_finite(z) {
        return Some(false);
    }
    let scale = T::ONE / z;

    let mut left = columns;
    for layer in layers.iter().rev() {
        let j = 31 - left.leading_zeros().min(31) as usize;
        left ^= 1 << j;
        let h: [T; N] = from_fn(|t| hit[t].get(j).copied().unwrap_or(T::ZERO));
        let old = b;
        each!(t in N {
            if h[t] > T::ZERO {
                let mut sum = T::ZERO;
                for k in 0..SETS / 2 {
                    let s = without::<SETS>(k, t);
                    let ending = old[with::<SETS>(s, t)];
                    sum += layer[s] * ending;
                    b[s] += h[t] * ending;
                }
                *hit[t].get_mut(j)? = h[t] * sum * scale;
            }
        });
    }
    for t in 0..N {
        *hit[t].get_mut(left.trailing_zeros() as usize)? *= b[with::<SETS>(0, t)] * scale;
        let (beta, private) = (missed[t] * scale, masks[t] & !shared);
        if private == 0 {
            *miss[t] = beta;
        } else {
            let scale = beta / whole[t];
            *miss[t] *= scale;
            for j in bits(private) {
                *hit[t].get_mut(j)? *= scale;
            }
        }
    }
    Some(true)
}

/// The set `s` and the track `t`.
#[inline(always)]
const fn with<const SETS: usize>(s: usize, t: usize) -> usize {
    (s | 1 << t) & (SETS - 1)
}

/// The set number `k` of those without the track `t`.
#[inline(always)]
const fn without<const SETS: usize>(k: usize, t: usize) -> usize {
    let behind = (1 << t) - 1;
    ((k & !behind) << 1 | k & behind) & (SETS - 1)
}
