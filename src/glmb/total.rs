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
use crate::scalar::{Real, ln};

/// Shared detections that are told apart.
const SHARED: usize = 6;

/// The logarithm of an upper bound on the weight of all events of `problem`; their weight itself, up to rounding, where rows share
/// no more than six detections.
///
/// Cost: rows² detections² comparisons at most, and 64 sums of 7 products a row where six detections are shared.
pub(crate) fn ln_total<T: Real, const GATED: usize>(problem: &Problem<'_, T, GATED>) -> T {
    let mut shared = heapless::Vec::<u16, SHARED>::new();
    for (place, row) in problem.rows().enumerate() {
        for detection in row.hits().iter().filter_map(|hit| hit.detection) {
            let again = || problem.rows().skip(place + 1).any(|other| other.gates(detection));
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
        let mut own = [T::ZERO; SHARED];
        let mut free = T::ONE;
        for hit in row.hits() {
            if let Some(place) = shared.iter().position(|detection| Some(*detection) == hit.detection) {
                own.iter_mut().skip(place).take(1).for_each(|w| *w = hit.share);
                free -= hit.share;
            }
        }
        for set in (0..sets).rev() {
            let without = own.iter().enumerate().filter(|(bit, _)| set >> bit & 1 == 1);
            let taken = without.fold(T::ZERO, |sum, (bit, w)| sum + sums.get(set ^ 1 << bit).map_or(T::ZERO, |z| *z * *w));
            sums.iter_mut().skip(set).take(1).for_each(|z| *z = *z * free + taken);
        }
    }
    ln_scale + ln(sums.iter().take(sets).fold(T::ZERO, |sum, z| sum + *z))
}
