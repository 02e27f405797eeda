//! Densities and what is done to them, held against the textbook written out densely in double precision.
//!
//! | module | what | against what |
//! |---|---|---|
//! | [`gaussian`] | correction, Joseph's form, moment matching | the Kalman equations, raw moments; definiteness down to tiny R |
//! | [`bank`] | interaction and combination of modes | the mixture before is the mixture after; modes out of reach |
//! | [`evidence`] | gating, association, update by several detections | mixtures of Kalman updates over all hypotheses |
//! | [`update`] | updates by precise measurements, in single precision | definite, and rounding only |
//! | [`extremes`] | likelihoods that under- and overflow | nothing becomes NaN, nothing is reset that need not be |

#[path = "../support/mod.rs"]
mod support;

mod bank;
mod evidence;
mod extremes;
mod gaussian;
mod update;

use nalgebra::{SMatrix, SVector};

/// The standard deviations of `cov`, as a column.
fn deviations<const N: usize>(cov: &SMatrix<f64, N, N>) -> SVector<f64, N> {
    cov.diagonal().map(f64::sqrt)
}

/// The condition number of the correlation matrix of `s`: how much rounding an inverse magnifies, whatever the units.
fn condition<const N: usize>(s: &SMatrix<f64, N, N>) -> f64 {
    let d = deviations(s);
    let correlation = nalgebra::DMatrix::from_fn(N, N, |i, j| s[(i, j)] / (d[i] * d[j]));
    let eigenvalues = correlation.symmetric_eigenvalues();
    eigenvalues.max() / eigenvalues.min()
}

/// det S, of any size.
fn determinant<const N: usize>(s: &SMatrix<f64, N, N>) -> f64 {
    nalgebra::DMatrix::from_fn(N, N, |i, j| s[(i, j)]).determinant()
}

/// Mean and covariance of Σ w_i N(x_i, P_i), weights of any sum, about the first mean.
fn mixture<const N: usize>(components: &[(f64, SVector<f64, N>, SMatrix<f64, N, N>)]) -> (SVector<f64, N>, SMatrix<f64, N, N>) {
    let origin = components.first().map_or(SVector::zeros(), |c| c.1);
    let total: f64 = components.iter().map(|c| c.0).sum();
    let mean: SVector<f64, N> = components.iter().map(|(w, x, _)| (x - origin) * (w / total)).sum();
    let cov: SMatrix<f64, N, N> = components
        .iter()
        .map(|(w, x, p)| {
            let d = x - origin - mean;
            (p + d * d.transpose()) * (w / total)
        })
        .sum();
    (origin + mean, cov)
}
