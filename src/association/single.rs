//! Association of one track on its own: each takes likelihood ratios and gives probabilities.
//!
//! ```text
//! PDA                β_0 = m / (m + Σ h),  β_i = h_i / (m + Σ h)
//! nearest neighbour  β_i = 1 for the largest h_i, β_0 = 1 where there is none
//! ```
//!
//! m is the weight of "no detection is the target's" (1 − P_D P_G), h_i that of detection i (P_D L_i / λ_i); a common
//! factor does not matter. Bar-Shalom, Willett and Tian 2011, section 3.4.

use crate::scalar::Real;

/// Turns the weights of one track into association probabilities.
pub trait SingleAssociator<T: Real> {
    /// Whether the tracker associates by the combined prediction and corrects all modes by one combined innovation,
    /// the printed form of the IMM-PDAF, instead of every mode by its own residuals.
    const COMBINED_INNOVATION: bool = false;

    /// Whether β are proportional to the weights: scoring, association and update can then be one pass.
    const PROPORTIONAL: bool = false;

    /// Replaces `hit` by probabilities β_1… and returns β_0. All weights zero, or with a sum that is not finite, give β_0 = 1.
    fn associate(&self, miss: T, hit: &mut [T]) -> T;
}

/// Probabilistic data association: every detection counts by its probability.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Pda;

/// The most likely detection is taken for the target's. A baseline: it knows no doubt.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct NearestNeighbour;

/// PDA in the form that Kashyap et al. (2006) print: one combined innovation for all modes. A baseline that loses
/// tracks; see `tracker/printed.rs` for its equations.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct PrintedPda;

impl<T: Real> SingleAssociator<T> for PrintedPda {
    const COMBINED_INNOVATION: bool = true;

    fn associate(&self, miss: T, hit: &mut [T]) -> T {
        Pda.associate(miss, hit)
    }
}

impl<T: Real> SingleAssociator<T> for Pda {
    const PROPORTIONAL: bool = true;

    #[inline(always)]
    fn associate(&self, miss: T, hit: &mut [T]) -> T {
        let mut sum = miss;
        for h in hit.iter() {
            sum += *h;
        }
        let scale = T::ONE / sum;
        if !(scale > T::ZERO && scale.is_finite()) {
            hit.fill(T::ZERO);
            return T::ONE;
        }
        for h in hit.iter_mut() {
            *h *= scale;
        }
        miss * scale
    }
}

impl<T: Real> SingleAssociator<T> for NearestNeighbour {
    #[inline]
    fn associate(&self, _miss: T, hit: &mut [T]) -> T {
        let mut best = T::ZERO;
        for h in hit.iter() {
            if *h > best {
                best = *h;
            }
        }
        let mut beta_0 = T::ONE;
        for h in hit.iter_mut() {
            // The first of equals.
            let chosen = *h == best && best > T::ZERO && beta_0 == T::ONE;
            *h = if chosen { T::ONE } else { T::ZERO };
            if chosen {
                beta_0 = T::ZERO;
            }
        }
        beta_0
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn weights_that_make_no_sum_leave_the_track_undetected() {
        for (miss, hits) in
            [(0.0, [0.0; 2]), (0.5, [f32::INFINITY, 1.0]), (0.5, [f32::MAX; 2]), (0.5, [f32::NAN, 1.0]), (f32::NAN, [1.0; 2])]
        {
            let mut beta = hits;
            assert_eq!((Pda.associate(miss, &mut beta), beta), (1.0, [0.0; 2]), "{miss}, {hits:?}");
        }
    }
}
