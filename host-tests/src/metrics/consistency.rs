//! Is the filter's covariance honest? NEES over Monte Carlo runs, with its chi-square interval.
//!
//! ```text
//! nees      = e' P^-1 e             e = estimate - truth, n components
//! mean_nees = (1/N) sum nees        over N independent runs
//! anees     = mean_nees / n         about 1 for an honest filter
//! interval  = [q(0.025), q(0.975)] / N     q: quantiles of chi-square with n N degrees of freedom
//! ```
//!
//! If errors are Gaussian with covariance P, N mean_nees is chi-square with n N degrees of freedom, so
//! mean_nees lies in the interval with probability 95 %: above it the filter is too sure of itself,
//! below it too cautious. Reference: Y. Bar-Shalom, X. R. Li, T. Kirubarajan, Estimation with
//! Applications to Tracking and Navigation, 2001, section 5.4.

use nalgebra::{DMatrix, DVector};
use statrs::distribution::{ChiSquared, ContinuousCDF};

/// Normalised estimation error squared of one run.
///
/// `cov` holds the n x n entries of the (symmetric) covariance, in either order: `as_slice()` of a
/// matrix will do. `None` when the sizes differ or `cov` is not positive definite and finite.
#[must_use]
pub fn nees(error: &[f64], cov: &[f64]) -> Option<f64> {
    let n = error.len();
    let finite = error.iter().chain(cov).all(|x| x.is_finite());
    if n == 0 || cov.len() != n * n || !finite {
        return None;
    }
    let factor = DMatrix::from_column_slice(n, n, cov).cholesky()?;
    let error = DVector::from_column_slice(error);
    let nees = error.dot(&factor.solve(&error));
    nees.is_finite().then_some(nees)
}

/// NEES averaged over runs, against its 95 % interval.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Consistency {
    /// Mean over the runs; n for an honest filter.
    pub mean_nees: f64,
    /// `mean_nees` / n; 1 for an honest filter.
    pub anees: f64,
    /// Two-sided 95 % interval of `mean_nees` \[lower, upper\].
    pub interval: [f64; 2],
}

impl Consistency {
    /// Whether `mean_nees` lies in the interval.
    #[must_use]
    pub fn consistent(&self) -> bool {
        (self.interval[0]..=self.interval[1]).contains(&self.mean_nees)
    }
}

/// Averages the NEES of independent runs of an error with `dimension` components.
///
/// `None` without runs or with dimension 0.
#[must_use]
pub fn consistency(nees: &[f64], dimension: usize) -> Option<Consistency> {
    let runs = nees.len() as f64;
    let n = dimension as f64;
    let bound = |p: f64| chi_square_quantile(n * runs, p).map(|quantile| quantile / runs);
    let interval = [bound(0.025)?, bound(0.975)?];
    let mean_nees = nees.iter().sum::<f64>() / runs;
    Some(Consistency { mean_nees, anees: mean_nees / n, interval })
}

/// The x with P(chi-square with `dof` degrees of freedom <= x) = `p`.
///
/// `None` unless `dof` > 0 and 0 < p < 1. Relative accuracy better than 1e-10.
#[must_use]
pub fn chi_square_quantile(dof: f64, p: f64) -> Option<f64> {
    if !(p > 0.0 && p < 1.0 && dof.is_finite()) {
        return None;
    }
    ChiSquared::new(dof).ok().map(|chi_square| chi_square.inverse_cdf(p))
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    #[test]
    fn nees_worked_by_hand() {
        // P = [[2, 1], [1, 2]], P^-1 = [[2, -1], [-1, 2]] / 3.
        let value = nees(&[1.0, 2.0], &[2.0, 1.0, 1.0, 2.0]);
        assert!(value.is_some_and(|v| (v - 2.0).abs() < 1e-14), "{value:?}");
    }

    #[test]
    fn nees_of_a_bad_covariance_is_undefined() {
        assert_eq!(nees(&[1.0, 2.0], &[1.0, 2.0, 2.0, 1.0]), None);
        assert_eq!(nees(&[1.0], &[f64::NAN]), None);
        assert_eq!(nees(&[1.0], &[f64::INFINITY]), None);
        assert_eq!(nees(&[1.0, 2.0], &[1.0]), None);
        assert_eq!(nees(&[], &[]), None);
    }

    #[test]
    fn quantiles_with_a_closed_form() {
        // Two degrees of freedom: q(p) = -2 ln(1 - p).
        for p in [1e-6, 0.025, 0.5, 0.9, 0.999_999] {
            let exact = -2.0 * f64::ln_1p(-p);
            let value = chi_square_quantile(2.0, p);
            assert!(value.is_some_and(|v| (v / exact - 1.0).abs() < 1e-10), "{p}: {value:?}");
        }
    }

    #[test]
    fn quantile_outside_its_domain_is_undefined() {
        for (dof, p) in [(0.0, 0.5), (-1.0, 0.5), (f64::NAN, 0.5), (2.0, 0.0), (2.0, 1.0), (2.0, f64::NAN)] {
            assert_eq!(chi_square_quantile(dof, p), None);
        }
        assert_eq!(consistency(&[], 2), None);
        assert_eq!(consistency(&[1.0], 0), None);
    }

    proptest! {
        #[test]
        fn interval_holds_an_honest_mean_and_narrows(n in 1_usize..10, runs in 1_usize..300) {
            let honest = consistency(&vec![n as f64; runs], n);
            prop_assert!(honest.is_some_and(|c| c.consistent() && c.anees == 1.0), "{honest:?}");
            let width = |runs: usize| consistency(&vec![1.0; runs], n)
                .map_or(f64::NAN, |c| c.interval[1] - c.interval[0]);
            prop_assert!(width(2 * runs) < width(runs));
        }

        #[test]
        fn nees_does_not_depend_on_units(
            e in [-5.0..5.0, -5.0..5.0_f64], a in 0.1..9.0_f64, b in 0.1..9.0_f64, r in -0.9..0.9_f64,
            scale in 1e-3..1e3_f64,
        ) {
            let c = r * (a * b).sqrt();
            let metres = nees(&e, &[a, c, c, b]);
            let s2 = scale * scale;
            let other = nees(&e.map(|x| x * scale), &[a * s2, c * s2, c * s2, b * s2]);
            let agree = metres.zip(other).is_some_and(|(m, o)| (m - o).abs() <= 1e-9 * (1.0 + m));
            prop_assert!(agree, "{metres:?} against {other:?}");
        }
    }
}
