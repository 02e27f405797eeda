//! The weight of all events of a hypothesis together, found or not: what is left to truncation is this less what was kept.
//!
//! ```text
//! no detection shared   Π_t Σ_choices w_t                                   rows are independent
//! shared detections     Z(row by row, U): the weight of what uses the set U of shared detections
//!                       Z(U) ← Z(U) · free_t + Σ_{j ∈ U} Z(U \ j) w_tj
//! ```
//!
//! U has room for a few detections. Others that rows share count as if each row had its own: that counts events which are none,
//! and the sum is an upper bound.

use super::row::Problem;
use super::work::COUNTED;
use crate::mode::LEAST_PROBABILITY;
use crate::scalar::{Real, larger, ln};

/// Shared detections that are told apart.
const SHARED: usize = 6;

/// The logarithm of an upper bound on the weight of all events of `problem`; their weight itself, up to rounding, where rows share
/// no more than six detections.
///
/// Cost: every detection of a row is looked for in the rows behind it, until six are shared, and 64 sums of 7 terms a row follow.
pub(crate) fn ln_total<T: Real, const GATED: usize>(problem: &Problem<'_, T, GATED>) -> T {
    let mut shared = heapless::Vec::<u16, SHARED>::new();
    for (place, row) in problem.rows().enumerate() {
        for detection in row.hits().iter().filter_map(|hit| hit.detection) {
            COUNTED.sums.add(shared.len());
            let again = || {
                problem.rows().skip(place + 1).any(|other| {
                    COUNTED.sums.add(other.hits().len());
                    other.gates(detection)
                })
            };
            if !shared.is_full() && !shared.contains(&detection) && again() {
                let _ = shared.push(detection);
            }
        }
    }
    let mut sums = [T::ZERO; 1 << SHARED];
    sums[0] = T::ONE;
    let sets = sums.len().min(1 << shared.len());
    let mut ln_scale = T::ZERO;
    for row in problem.rows() {
        ln_scale += row.ln_total;
        // Added up: what the shared ones leave of one would be rounding where they take nearly all.
        let (mut own, mut free) = ([T::ZERO; SHARED], row.rest);
        for outcome in row.outcomes() {
            COUNTED.sums.add(shared.len());
            match shared.iter().position(|detection| Some(*detection) == outcome.detection) {
                Some(place) => own.iter_mut().skip(place).take(1).for_each(|w| *w = outcome.share),
                None => free += outcome.share,
            }
        }
        for set in (0..sets).rev() {
            COUNTED.sums.add(1 + shared.len());
            let without = own.iter().enumerate().take(shared.len()).filter(|(bit, _)| set >> bit & 1 == 1);
            let taken = without.fold(T::ZERO, |sum, (bit, w)| sum + sums.get(set ^ 1 << bit).map_or(T::ZERO, |z| *z * *w));
            sums.iter_mut().skip(set).take(1).for_each(|z| *z = *z * free + taken);
        }
    }
    let sum = sums.iter().take(sets).fold(T::ZERO, |sum, z| sum + *z);
    // Terms below this may have been lost in single precision: the bound stays one.
    ln_scale + ln(larger(T::lit(LEAST_PROBABILITY), sum))
}
