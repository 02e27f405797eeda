//! Random densities, and comparisons whose bounds are rounding errors counted in advance.
//!
//! Two evaluations of one sum of n products differ by at most n ε Σ|products|, each by half of it. So a bound is a
//! count of operations times ε times the same formula on absolute values; it is written beside every comparison.

use boresight::gaussian::Gaussian;
use boresight::scalar::Real;
use boresight::symmetric::Symmetric;
use nalgebra::{SMatrix, SVector};
use proptest::prelude::*;
use proptest::test_runner::TestCaseResult;

/// Enough random numbers for the largest state, nine entries, and the factor of its covariance.
pub const DRAWS: usize = 9 + 81;

/// Random numbers in −1..1 of which [`gaussian`] makes densities.
pub fn draws() -> impl Strategy<Value = Vec<f64>> {
    prop::collection::vec(-1.0..1.0f64, DRAWS)
}

/// A density with mean entries up to `mean` and a covariance A A' + I/4 in units of `deviation`²: its condition number
/// is at most 4 N² + 1.
pub fn gaussian<T: Real, const N: usize>(draws: &[f64], mean: f64, deviation: f64) -> Gaussian<T, N> {
    let (m, a) = draws.split_at(9);
    let a = SMatrix::<f64, N, N>::from_fn(|i, j| a[i * 9 + j]);
    let cov = (a * a.transpose() + SMatrix::identity() * 0.25) * (deviation * deviation);
    Gaussian::new(SVector::from_fn(|i, _| T::lit(m[i] * mean)), Symmetric::from_fn(|i, j| T::lit(cov[(i, j)])))
}

/// The same matrix in double precision.
pub fn wide<T: Real, const R: usize, const C: usize>(m: &SMatrix<T, R, C>) -> SMatrix<f64, R, C> {
    m.map(Real::to_f64)
}

/// The same covariance in double precision, both triangles.
pub fn wide_cov<T: Real, const N: usize>(s: &Symmetric<T, N>) -> SMatrix<f64, N, N> {
    wide(&s.to_matrix())
}

/// Entry by entry |`got` − `want`| ≤ `bound`; NaN is never within.
pub fn within<const R: usize, const C: usize>(
    what: &str,
    got: &SMatrix<f64, R, C>,
    want: &SMatrix<f64, R, C>,
    bound: &SMatrix<f64, R, C>,
) -> TestCaseResult {
    for (i, ((got, want), bound)) in got.iter().zip(want).zip(bound).enumerate() {
        let (row, column) = (i % R, i / R);
        prop_assert!((got - want).abs() <= *bound, "{what} ({row}, {column}): {got:e} for {want:e}, bound {bound:e}");
    }
    Ok(())
}

/// The smallest eigenvalue of the correlation matrix of `cov`; zero variances, whose covariances must be zero, count
/// as uncorrelated.
pub fn least_eigenvalue<T: Real, const N: usize>(cov: &Symmetric<T, N>) -> f64 {
    let p = wide_cov(cov);
    let mut correlation = nalgebra::DMatrix::<f64>::identity(N, N);
    for i in 0..N {
        for j in (0..N).filter(|j| *j != i) {
            let scale = (p[(i, i)] * p[(j, j)]).sqrt();
            correlation[(i, j)] = if p[(i, j)] == 0.0 { 0.0 } else { p[(i, j)] / scale };
        }
    }
    if correlation.iter().all(|v| v.is_finite()) && (0..N).all(|i| p[(i, i)] >= 0.0) {
        correlation.symmetric_eigenvalues().min()
    } else {
        f64::NEG_INFINITY
    }
}
