//! Registration: tracks of a sensor's own frame brought to the common one.
//!
//! With the sensor's frame at t, turned by ψ about the vertical, and R = \[cos ψ −sin ψ; sin ψ cos ψ\] on the first two axes:
//!
//! ```text
//! position      p ← R p + t
//! rates         v ← R v,  a ← R a            (every further entry of an axis)
//! covariance    P ← T P T' + E C E' + σ_ψ² j j',   T = R on every derivative,  E: place enters positions
//!               j = ∂x / ∂ψ = (−x_2, x_1) of every pair R p, R v, R a
//! ```
//!
//! C and σ_ψ² say how well place and heading are known. They are the same for all tracks of the sensor and from scan to scan: it
//! keeps the covariance honest, but no averaging over scans will take it out. A state beyond its axes (a turn rate) is the same
//! in both frames. A state of one axis can be moved but not turned.

use crate::error::ConfigError;
use crate::gaussian::Gaussian;
use crate::mode::ModeBank;
use crate::model::Layout;
use crate::scalar::{Real, sin_cos};
use crate::symmetric::Symmetric;
use nalgebra::{SMatrix, SVector};

/// Where a sensor's frame stands in the common frame.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Frame<T> {
    origin: [T; 3],
    sin: T,
    cos: T,
    place: Symmetric<T, 3>,
    heading_variance: T,
}

impl<T: Real> Frame<T> {
    /// The common frame itself.
    pub const COMMON: Self = Self { origin: [T::ZERO; 3], sin: T::ZERO, cos: T::ONE, place: Symmetric::zeros(), heading_variance: T::ZERO };

    /// A frame at `origin` \[m\], its first axis turned to the left of the common one by `heading` \[rad\].
    ///
    /// # Errors
    /// Where a number is not finite.
    pub fn new(origin: [T; 3], heading: T) -> Result<Self, ConfigError> {
        let (sin, cos) = sin_cos(heading);
        if !(origin.iter().all(|v| v.is_finite()) && sin.is_finite() && cos.is_finite()) {
            return Err(ConfigError::NotFinite);
        }
        Ok(Self { origin, sin, cos, ..Self::COMMON })
    }

    /// The same, its place known with the covariance `place` \[m²\] and its heading with the variance `heading` \[rad²\].
    ///
    /// # Errors
    /// Where `place` is not positive semi-definite, or the variance negative or not finite.
    pub fn with_uncertainty(self, place: Symmetric<T, 3>, heading: T) -> Result<Self, ConfigError> {
        if !heading.is_finite() || !place.is_finite() {
            return Err(ConfigError::NotFinite);
        }
        if heading < T::ZERO || place.cholesky().is_none() {
            return Err(ConfigError::NotDefinite);
        }
        Ok(Self { place, heading_variance: heading, ..self })
    }

    /// Brings `g` from this frame to the common one. Cost: about 2 NX³ multiply-adds.
    pub fn register<const NX: usize>(&self, g: &mut Gaussian<T, NX>, layout: Layout) {
        // The axis that an entry belongs to, and of which derivative it is.
        let place = |i: usize| (i < layout.states()).then(|| (i / layout.stride, i % layout.stride));
        let rotation = [[self.cos, -self.sin], [self.sin, self.cos]];
        let turn = SMatrix::<T, NX, NX>::from_fn(|i, j| match (place(i), place(j)) {
            (Some((a @ 0..2, k)), Some((b @ 0..2, l))) if k == l && layout.axes >= 2 => rotation[a][b],
            _ => T::from_count(usize::from(i == j)),
        });
        g.mean = turn * g.mean;
        let x = |i: usize| g.mean.get(i).copied().unwrap_or(T::ZERO);
        let lever = SVector::<T, NX>::from_fn(|i, _| match place(i) {
            Some((0, _)) if layout.axes >= 2 => -x(i.saturating_add(layout.stride)),
            Some((1, _)) => x(i - layout.stride),
            _ => T::ZERO,
        });
        let cov = turn * g.cov.to_matrix() * turn.transpose() + lever * lever.transpose() * self.heading_variance;
        g.cov = Symmetric::from_fn(|i, j| match (place(i), place(j)) {
            (Some((a, 0)), Some((b, 0))) => cov.data.0[j][i] + self.place.get(a, b).unwrap_or(T::ZERO),
            _ => cov.data.0[j][i],
        });
        for (i, x) in g.mean.iter_mut().enumerate() {
            if let Some((axis, 0)) = place(i) {
                *x += self.origin.get(axis).copied().unwrap_or(T::ZERO);
            }
        }
    }

    /// Brings every mode of `bank` to the common frame; mode probabilities know no frame.
    pub fn register_bank<const NX: usize, const MODES: usize>(&self, bank: &mut ModeBank<T, NX, MODES>, layout: Layout) {
        bank.modes.iter_mut().for_each(|g| self.register(g, layout));
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_layout_beyond_all_states_overflows_nothing() {
        for (axes, stride) in [(usize::MAX, 2), (2, usize::MAX), (usize::MAX, usize::MAX), (3, 0)] {
            let layout = Layout { axes, stride };
            assert!(!layout.fits(4));
            let mut g = Gaussian::new(SVector::from([1.0f32, 2.0, 3.0, 4.0]), Symmetric::from_diagonal([1.0; 4]));
            let frame = Frame::new([10.0, 20.0, 0.0], 0.5).and_then(|frame| frame.with_uncertainty(Symmetric::zeros(), 0.01));
            assert!(frame.is_ok_and(|frame| {
                frame.register(&mut g, layout);
                g.mean.iter().all(|x| x.is_finite()) && super::super::distance(&g, &g, layout).is_some()
            }));
        }
    }
}
