//! Random numbers from the caller's generator, to the same bits on every machine.
//!
//! ```text
//! uniform   the upper 24 bits of a word, times 2⁻²⁴: every value is exact in single precision
//! normal    √(−2 ln u) (cos, sin)(2π v),  u in (0, 1], v in [0, 1)        Box and Muller 1958
//! ```

use crate::scalar::{Real, ln, sin_cos, sqrt};
use nalgebra::SVector;
use rand_core::Rng;

const SCALE: f64 = 1.0 / 16_777_216.0;

/// Uniform in [0, 1).
#[inline(always)]
pub(super) fn uniform<T: Real, R: Rng>(rng: &mut R) -> T {
    T::from_count((rng.next_u32() >> 8) as usize) * T::lit(SCALE)
}

/// An index by its probability; `weights` need not sum to one. None where all are zero.
#[inline]
pub(super) fn index<T: Real, R: Rng>(weights: impl Iterator<Item = T> + Clone, rng: &mut R) -> Option<usize> {
    let mut rest = uniform::<T, R>(rng) * weights.clone().fold(T::ZERO, |sum, w| sum + w);
    let mut last = None;
    for (i, w) in weights.enumerate().filter(|(_, w)| *w > T::ZERO) {
        last = Some(i);
        rest -= w;
        if rest < T::ZERO {
            break;
        }
    }
    last
}

/// Independent standard normal numbers.
#[inline]
pub(super) fn normal<T: Real, R: Rng, const N: usize>(rng: &mut R) -> SVector<T, N> {
    let mut spare = None;
    SVector::from_fn(|_, _| {
        if let Some(second) = spare.take() {
            return second;
        }
        let radius = sqrt(T::lit(-2.0) * ln(T::ONE - uniform::<T, R>(rng)));
        let (sin, cos) = sin_cos((T::PI + T::PI) * uniform::<T, R>(rng));
        spare = Some(radius * sin);
        radius * cos
    })
}
