//! Corrections and moment matching of one Gaussian.
//!
//! Definiteness: the fast correction subtracts G E G' from P and so keeps an absolute error of some ε P in a posterior as
//! small as R. With process noise between updates it stays positive definite in f32 while the least eigenvalue of R is at
//! least 10⁻⁶ of P (measured: none of 200,000 updates fails at 10⁻⁶·⁵, one in 1000 at 10⁻⁷, one in 20 at 10⁻⁸); Joseph's
//! form is tested down to 10⁻⁸. Without process noise neither is definite for long: P shrinks below its own rounding.

use crate::support::{draws, gaussian, least_eigenvalue, wide, wide_cov, within};
use crate::{condition, determinant, deviations};
use boresight::gaussian::{Correction, Gaussian, Innovation, ResidualDensity};
use boresight::model::linear::LinearMeasurement;
use boresight::model::motion::{ConstantAcceleration, ConstantVelocity, ProcessNoise};
use boresight::model::position::Position;
use boresight::model::{MeasurementModel, MotionModel};
use boresight::scalar::Real;
use boresight::symmetric::Symmetric;
use nalgebra::{SMatrix, SVector};
use proptest::prelude::*;
use proptest::test_runner::{TestCaseError, TestCaseResult};

/// x + K ν and P − K S K', K = P H' S⁻¹, by both forms.
fn kalman<T: Real, const NX: usize, const NZ: usize>(draws: &[f64]) -> TestCaseResult {
    let g = gaussian::<T, NX>(draws, 10.0, 3.0);
    let sensor = LinearMeasurement {
        matrix: SMatrix::<T, NZ, NX>::from_fn(|i, j| T::lit(2.0 * draws[(11 * i + 5 * j) % 90])),
        noise: gaussian::<T, NZ>(draws, 0.0, 3.0).cov,
    };
    let nu = SVector::<T, NZ>::from_fn(|i, _| T::lit(10.0 * draws[80 + i]));
    let innovation = sensor.innovation(&g);

    let (p, h, r) = (wide_cov(&g.cov), wide(&sensor.matrix), wide_cov(&sensor.noise));
    let s = h * p * h.transpose() + r;
    let s_inv = s.try_inverse().ok_or_else(|| TestCaseError::fail("singular"))?;
    let gain = p * h.transpose() * s_inv;
    let shift = gain * wide(&nu);
    let (x, cov) = (wide(&g.mean) + shift, p - gain * s * gain.transpose());

    let (mut fast, mut joseph) = (g, g);
    prop_assert!(fast.update(&innovation, &nu));
    prop_assert!(joseph.update_joseph(&innovation, &sensor.matrix, &sensor.noise, &nu));
    // S is a sum of sums of NX products; its inverse magnifies that by the condition; K S K' is never larger than P, while
    // the terms of a product with K may be, by the condition again at most, of the number NX + NZ.
    let relative = T::EPSILON.to_f64() * 4.0 * (NX + NZ) as f64 * condition(&s);
    let sigma = deviations(&p);
    let nis = wide(&nu).dot(&(s_inv * wide(&nu)));
    for (name, got) in [("subtractive", fast), ("Joseph", joseph)] {
        within(name, &wide(&got.mean), &x, &(sigma * (relative * nis.sqrt()) + x.abs() * T::EPSILON.to_f64()))?;
        within(name, &wide_cov(&got.cov), &cov, &(sigma * sigma.transpose() * relative))?;
        prop_assert!(least_eigenvalue(&got.cov) > 0.0);
    }
    let gain_error = sigma * SVector::<f64, NZ>::from_fn(|i, _| s_inv[(i, i)].sqrt()).transpose() * relative;
    within("gain", &wide(&innovation.gain()), &gain, &gain_error)?;

    // ln N(ν; 0, S) = −½ (NZ ln 2π + ln det S + ν' S⁻¹ ν)
    let got = innovation.density.ln_at(&nu).to_f64();
    let want = -0.5 * (NZ as f64 * (2.0 * std::f64::consts::PI).ln() + determinant(&s).ln() + nis);
    prop_assert!((got - want).abs() <= relative * (NZ as f64 + nis) + 4.0 * T::EPSILON.to_f64() * want.abs(), "{got} for {want}");
    let root = innovation.density.root_det().to_f64();
    let bound = relative * NZ as f64 + T::EPSILON.to_f64() * (4.0 + 4.0 * want.abs() + 4.0 * nis);
    prop_assert!((root / determinant(&s).sqrt() - 1.0).abs() <= bound, "√det S {root}");
    Ok(())
}

/// Fifty predictions and updates with noise between 1 and `least` of the predicted variances, and correlated.
fn stays_definite<M: MotionModel<f32, NX>, const NX: usize, const STRIDE: usize>(
    model: &M,
    steps: &[(f64, [f64; 2], f64)],
    least: f64,
    joseph: bool,
) -> TestCaseResult {
    let variance: [f32; NX] = std::array::from_fn(|i| [1e4, 1e3, 1e2][i % STRIDE]);
    let mut g = Gaussian::new(SVector::zeros(), Symmetric::from_diagonal(variance));
    for (k, (dt, decades, correlation)) in steps.iter().enumerate() {
        model.predict(&mut g, *dt as f32);
        let p = wide_cov(&g.cov);
        // The correlation takes up to 1 − |correlation| off the least eigenvalue.
        let ratio = decades.map(|d| least.powf(d) / (1.0 - correlation.abs()));
        let (x, y) = (p[(0, 0)] * ratio[0], p[(STRIDE, STRIDE)] * ratio[1]);
        let noise = [[x, correlation * (x * y).sqrt()], [0.0, y]];
        let sensor = Position::<f32, 2, STRIDE>::new(Symmetric::from_fn(|i, j| noise[i][j] as f32))?;
        let (innovation, nu) = (sensor.innovation(&g), SVector::zeros());
        let taken = if joseph {
            let h = sensor.jacobian(&g.mean);
            g.update_joseph(&innovation, &h, &MeasurementModel::<f32, NX, 2>::noise(&sensor, &g.mean), &nu)
        } else {
            g.update(&innovation, &nu)
        };
        let least = least_eigenvalue(&g.cov);
        prop_assert!(taken && least > 0.0, "step {k}: least eigenvalue {least:e} with R = {ratio:?} P");
    }
    Ok(())
}

/// Weights, not all zero, normalised in the precision of `T`.
fn weights<T: Real, const N: usize>(draws: &[f64]) -> [T; N] {
    let raw: [f64; N] = std::array::from_fn(|i| draws[i].abs() + 1e-3);
    let sum: f64 = raw.iter().sum();
    raw.map(|w| T::lit(w / sum))
}

/// Moment matching at `distance` from the origin, of components some ten to a hundred apart.
fn matches_moments<T: Real, const NX: usize>(draws: &[f64], distance: f64) -> TestCaseResult {
    const N: usize = 4;
    let weights = weights::<T, N>(draws);
    let components: [Gaussian<T, NX>; N] = std::array::from_fn(|i| {
        let mut g = gaussian::<T, NX>(&draws.iter().cycle().skip(7 * i).take(90).copied().collect::<Vec<_>>(), 50.0, 20.0);
        g.mean = g.mean.map(|v| T::lit(v.to_f64() + distance));
        g
    });
    let got = Gaussian::moment_match(weights.iter().copied().zip(&components));
    let wide: Vec<_> = weights.iter().zip(&components).map(|(w, g)| (w.to_f64(), wide(&g.mean), wide_cov(&g.cov))).collect();
    let total: f64 = wide.iter().map(|c| c.0).sum();
    let mean: SVector<f64, NX> = wide.iter().map(|(w, x, _)| x * (w / total)).sum();
    let raw: SMatrix<f64, NX, NX> = wide.iter().map(|(w, x, p)| (p + x * x.transpose()) * (w / total)).sum();
    let cov = raw - mean * mean.transpose();
    // The mean is a sum of N products and weights that sum to 1 + N ε / 2. Its error enters the covariance squared, since
    // the deviations sum to zero; the rest are N products and the deviations themselves.
    let (epsilon, n) = (T::EPSILON.to_f64(), N as f64);
    let shift = SVector::<f64, NX>::repeat((n + 2.0) * epsilon * (distance + 50.0));
    let sizes = deviations(&cov);
    let rounding = sizes * sizes.transpose() * ((n + 6.0) * epsilon);
    // And the raw moments in double precision lose this much themselves.
    let of_raw = SMatrix::repeat(4.0 * n * f64::EPSILON * (distance + 50.0).powi(2));
    within("mean", &self::wide(&got.mean), &mean, &shift)?;
    within("covariance", &wide_cov(&got.cov), &cov, &(shift * shift.transpose() + rounding + of_raw))?;
    // No component is less definite than 1 / (4 NX² + 1), relatively, and deviations only add.
    prop_assert!(least_eigenvalue(&got.cov) > 0.0);
    Ok(())
}

proptest! {
    #[test]
    fn both_forms_are_the_kalman_update(draws in draws()) {
        kalman::<f32, 2, 1>(&draws)?;
        kalman::<f32, 4, 2>(&draws)?;
        kalman::<f32, 6, 3>(&draws)?;
        kalman::<f32, 9, 4>(&draws)?;
        kalman::<f64, 2, 1>(&draws)?;
        kalman::<f64, 4, 2>(&draws)?;
        kalman::<f64, 6, 3>(&draws)?;
        kalman::<f64, 9, 4>(&draws)?;
    }

    #[test]
    fn covariances_stay_definite(
        steps in prop::collection::vec((0.1..2.0f64, prop::array::uniform2(0.0..1.0f64), -0.9..0.9f64), 50),
        noise in 0.1..100.0f32,
    ) {
        let cv = ConstantVelocity::<f32, 2>::new(ProcessNoise::Continuous(noise))?;
        let ca = ConstantAcceleration::<f32, 2>::new(ProcessNoise::Continuous(noise))?;
        stays_definite::<_, 4, 2>(&cv, &steps, 1e-6, false)?;
        stays_definite::<_, 6, 3>(&ca, &steps, 1e-6, false)?;
        stays_definite::<_, 4, 2>(&cv, &steps, 1e-8, true)?;
        stays_definite::<_, 6, 3>(&ca, &steps, 1e-8, true)?;
    }

    #[test]
    fn mixtures_keep_their_moments(draws in draws(), decades in 0.0..5.0f64) {
        matches_moments::<f32, 2>(&draws, 10f64.powf(decades))?;
        matches_moments::<f32, 6>(&draws, 10f64.powf(decades))?;
        matches_moments::<f64, 2>(&draws, 10f64.powf(decades))?;
        matches_moments::<f64, 6>(&draws, 10f64.powf(decades))?;
    }
}

#[test]
fn far_from_the_origin_deviations_hold_what_raw_moments_lose() {
    let components = [99_950.0f32, 100_010.0].map(|x| Gaussian::new(SVector::from([x]), Symmetric::from_diagonal([25.0])));
    let got = Gaussian::moment_match([0.5, 0.5].into_iter().zip(&components));
    // 25 + 30², exact in single precision.
    assert_eq!((got.mean[0], got.cov.get(0, 0)), (99_980.0, Some(925.0)));
    let second: f32 = components.iter().map(|g| 0.5 * (25.0 + g.mean[0] * g.mean[0])).sum();
    let raw = second - got.mean[0] * got.mean[0];
    // A number of 10¹⁰ is kept to 1024 or 512.
    assert!((raw - 925.0).abs() > 50.0, "raw moments give {raw}: this test needs a worse case");
}

fn broken_corrections_are_taken_back<T: Real>() -> TestCaseResult {
    let before = Gaussian::new(SVector::from([10.0, -3.0].map(T::lit)), Symmetric::from_diagonal([4.0, 9.0].map(T::lit)));
    let cross = SMatrix::<T, 2, 1>::new(T::lit(4.0), T::ZERO);
    for broken in [T::lit(f64::INFINITY), T::lit(f64::NAN)] {
        for (w, e) in [(broken, T::ONE), (T::ONE, broken)] {
            let (mut g, correction) = (before, Correction { w: [w], e: Symmetric::from_diagonal([e]) });
            prop_assert!(!g.correct(&cross, &correction));
            prop_assert_eq!(g, before);
        }
    }
    // P − G E G' = 4 − 16: refused, and everything back to where it was, here without any rounding.
    let (mut g, correction) = (before, Correction { w: [T::ONE], e: Symmetric::from_diagonal([T::ONE]) });
    prop_assert!(!g.correct(&cross, &correction));
    prop_assert_eq!(g, before);
    // An innovation without a density corrects nothing.
    let flat = Symmetric::<T, 1>::from_diagonal([-T::lit(20.0)]);
    let innovation = Innovation::new(SVector::zeros(), cross, Symmetric::from_diagonal([T::lit(4.0)]), &flat);
    prop_assert!(!innovation.density.is_proper());
    prop_assert_eq!(innovation.density.ln_at(&SVector::from([T::ONE])), -T::ONE / T::ZERO);
    prop_assert!(g.update(&innovation, &SVector::from([T::ONE])));
    prop_assert_eq!(g, before);
    Ok(())
}

#[test]
fn what_would_break_a_covariance_is_taken_back() -> Result<(), TestCaseError> {
    broken_corrections_are_taken_back::<f32>()?;
    broken_corrections_are_taken_back::<f64>()
}

#[test]
fn densities_integrate_to_one() {
    // ∫ N(ν; 0, S) dν by the trapezium rule on ten standard deviations, exact to rounding for a Gaussian.
    let s = Symmetric::<f64, 2>::from_fn(|i, j| [[4.0, 1.0], [0.0, 9.0]][i][j]);
    let density = ResidualDensity::new(&s);
    let step = 0.25;
    let grid = || (-120..=120).map(|k| f64::from(k) * step);
    let sum: f64 = grid().flat_map(|x| grid().map(move |y| SVector::from([x, y]))).map(|nu| density.ln_at(&nu).exp()).sum();
    assert!((sum * step * step - 1.0).abs() < 1e-12, "{sum}");
}
