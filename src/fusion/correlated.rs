//! Two estimates of one target made one where the correlation of their errors is known, and the test whether they are of one.
//!
//! ```text
//! recursion  P12 ← (I − K_1 H_1) (F P12 F' + Q) (I − K_2 H_2)',   K = 0 where a filter saw nothing
//! fusion     A = P_1 − P12,  B = P_2 − P12',  S = A + B,  K = A S⁻,
//!            x = x_1 + K (x_2 − x_1),  P = [I−K  K] [P_1 P12; P12' P_2] [I−K  K]'
//! test       d² = (x_1 − x_2)' S⁻ (x_1 − x_2),  χ² with as many degrees of freedom as S has rank
//! ```
//!
//! Two filters that track one target share its process noise: their errors are correlated though their sensors are not
//! (Bar-Shalom, *IEEE Trans. AC* 26(2), 1981; Bar-Shalom and Campo, *IEEE Trans. AES* 22(6), 1986). Who knows both filters' gains
//! can carry P12 along and fuse at the least covariance that two estimates allow; P is written as what the gain K makes of the
//! joint covariance, true for any K, so that rounding in K costs P nothing to first order. With filters of several modes the
//! gains are those of one mode of each; there is no such recursion for their combination, and
//! [`Rule::Intersection`](super::Rule::Intersection) is the safe choice.
//!
//! With P12 = 0 the test takes S for larger than it is (P12 of two tracks of one target is positive), so d² comes out small: it
//! accepts more of what belongs together than its level says, and more of what does not.

use super::inverse::generalised_inverse;
use super::work::COUNTED;
use crate::gaussian::Gaussian;
use crate::model::Layout;
use crate::scalar::Real;
use crate::symmetric::Symmetric;
use nalgebra::SMatrix;

/// P12, the covariance between the errors of two filters that track one target: rows the first's, columns the second's.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CrossCovariance<T, const NX: usize>(pub SMatrix<T, NX, NX>);

impl<T: Real, const NX: usize> CrossCovariance<T, NX> {
    /// Independent errors: what two filters start with that were started by measurements of their own.
    #[must_use]
    pub fn zeros() -> Self {
        Self(SMatrix::zeros())
    }

    /// F P12 F' + Q, for one step of the motion that both filters assume.
    pub fn predict(&mut self, transition: &SMatrix<T, NX, NX>, process_noise: &Symmetric<T, NX>) {
        self.0 = transition * self.0 * transition.transpose() + process_noise.to_matrix();
    }

    /// The first filter has taken in a measurement with the gain K_1, seen through H_1. Of a probabilistic data association
    /// K_1 is (1 − β₀) times the gain.
    pub fn first_updated<const NZ: usize>(&mut self, gain: &SMatrix<T, NX, NZ>, h: &SMatrix<T, NZ, NX>) {
        self.0 -= gain * (h * self.0);
    }

    /// As [`first_updated`](Self::first_updated), by the second filter.
    pub fn second_updated<const NZ: usize>(&mut self, gain: &SMatrix<T, NX, NZ>, h: &SMatrix<T, NZ, NX>) {
        self.0 -= (self.0 * h.transpose()) * gain.transpose();
    }

    /// Bar-Shalom and Campo's estimate made of `a`, the first filter's, and `b`; `None` where the joint covariance is none, or
    /// the result not finite. Where both filters know an entry exactly, the first's stays.
    ///
    /// Cost: about 8 NX³ multiply-adds.
    #[must_use]
    pub fn fuse(&self, a: &Gaussian<T, NX>, b: &Gaussian<T, NX>) -> Option<Gaussian<T, NX>> {
        let (inverse, _) = generalised_inverse(&self.of_difference(a, b), |_| true)?;
        let (p1, p2) = (a.cov.to_matrix(), b.cov.to_matrix());
        let gain = (p1 - self.0) * inverse.to_matrix();
        let keep = SMatrix::identity() - gain;
        let shared = keep * self.0 * gain.transpose();
        let cov = keep * p1 * keep.transpose() + gain * p2 * gain.transpose() + shared + shared.transpose();
        let mut fused = *a;
        fused.replace(a.mean + gain * (b.mean - a.mean), &cov).then_some(fused)
    }

    /// The test of `a` and `b` by what is known of their correlation; otherwise as [`distance`].
    #[must_use]
    pub fn distance(&self, a: &Gaussian<T, NX>, b: &Gaussian<T, NX>, layout: Layout) -> Option<Distance<T>> {
        Distance::new(a, b, &self.of_difference(a, b), layout)
    }

    /// S = P_1 + P_2 − P12 − P12'
    fn of_difference(&self, a: &Gaussian<T, NX>, b: &Gaussian<T, NX>) -> Symmetric<T, NX> {
        let p12 = &self.0.data.0;
        Symmetric::from_fn(|i, j| a.cov.upper()[i][j] + b.cov.upper()[i][j] - p12[j][i] - p12[i][j])
    }
}

/// How far two estimates are from being one target's.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Distance<T> {
    /// d²
    pub square: T,
    /// The degrees of freedom of its distribution, for estimates of one target
    pub dimension: usize,
}

impl<T: Real> Distance<T> {
    fn new<const NX: usize>(a: &Gaussian<T, NX>, b: &Gaussian<T, NX>, s: &Symmetric<T, NX>, layout: Layout) -> Option<Self> {
        let (inverse, dimension) = generalised_inverse(s, |i| is_compared(layout, i))?;
        let d = (a.mean - b.mean).data.0[0];
        let square = crate::gaussian::dot(&d, &inverse.times(&d));
        square.is_finite().then_some(Self { square, dimension })
    }
}

/// The test of `a` and `b` as if their errors were independent: on position and velocity in the axes of `layout`, on all
/// entries where it is unknown. Entries that neither leaves any doubt of count for nothing. `None` where a covariance is none.
#[must_use]
pub fn distance<T: Real, const NX: usize>(a: &Gaussian<T, NX>, b: &Gaussian<T, NX>, layout: Layout) -> Option<Distance<T>> {
    COUNTED.tests.add(1);
    Distance::new(a, b, &a.cov.plus(&b.cov), layout)
}

/// Whether d² of independent `a` and `b` is beyond `limit` by a single entry: d² is at least the square of every compared
/// difference over its variance, so that far pairs cost a few operations.
pub(super) fn is_beyond<T: Real, const NX: usize>(a: &Gaussian<T, NX>, b: &Gaussian<T, NX>, layout: Layout, limit: T) -> bool {
    (0..NX).filter(|i| is_compared(layout, *i)).any(|i| {
        let d = a.mean.data.0[0][i] - b.mean.data.0[0][i];
        let variance = a.cov.upper()[i][i] + b.cov.upper()[i][i];
        variance > T::ZERO && d * d > limit * variance
    })
}

/// Whether entry `i` is a position or a velocity, or nothing is known of the layout.
fn is_compared(layout: Layout, i: usize) -> bool {
    layout.axes == 0 || (i < layout.states() && i % layout.stride.max(1) < 2)
}
