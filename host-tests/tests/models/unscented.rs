//! The unscented transform where the answer is known: linear models (the Kalman filter), a square (exact moments), and
//! azimuths on both sides of the seam (the same scene turned by half a turn).
//!
//! With s = n + λ every point lies √s standard deviations out with weight 1/2s, so errors δ of the transformed points enter
//! a covariance as (n/s) (2 √s σ δ + δ²), and through the centre's weight, at most 4 + n/s, as (4 + n/s) δ².

use crate::support::{draws, gaussian, wide, wide_cov, within};
use boresight::error::ConfigError;
use boresight::gaussian::Gaussian;
use boresight::model::linear::{LinearMeasurement, LinearMotion};
use boresight::model::motion::{ConstantAcceleration, ProcessNoise};
use boresight::model::radar::Component::{Azimuth, Range, RangeRate};
use boresight::model::radar::Radar;
use boresight::model::unscented::{Scaling, SigmaPoints, Unscented};
use boresight::model::{MeasurementModel, MotionModel};
use boresight::scalar::Real;
use boresight::symmetric::Symmetric;
use nalgebra::{SMatrix, SVector};
use proptest::prelude::*;
use proptest::test_runner::{TestCaseError, TestCaseResult};
use std::f64::consts::PI;

/// (α, β, κ): the default of van der Merwe at two spreads, and Julier and Uhlmann's n + κ = 3, whose centre has a negative
/// weight for n > 3.
fn scalings(n: usize) -> [[f64; 3]; 3] {
    [[1.0, 2.0, 0.0], [0.1, 2.0, 0.0], [1.0, 0.0, 3.0 - n as f64]]
}

/// Errors of mean and covariance of transformed points that are each `delta` off, with deviations `sigma`.
struct Errors<const A: usize> {
    sigma: SVector<f64, A>,
    delta: SVector<f64, A>,
    /// n / s
    sides: f64,
}

impl<const A: usize> Errors<A> {
    /// Of the linear map `f`, applied by sums of `N` products to the points of a density.
    fn linear<T: Real, const N: usize>(f: &SMatrix<f64, A, N>, g: &Gaussian<T, N>, [alpha, _, kappa]: [f64; 3]) -> Self {
        let (n, spread) = (N as f64, alpha * alpha * (N as f64 + kappa));
        let deviation = SVector::<f64, N>::from_fn(|i, _| g.cov.upper()[i][i].to_f64().sqrt());
        let sigma = f.abs() * deviation;
        let sides = n / spread;
        // The points and the sums are rounded; so is the mean that is subtracted, sides times.
        let delta = (f.abs() * wide(&g.mean).abs() + sigma * spread.sqrt()) * (T::EPSILON.to_f64() * (n + 4.0) * (1.0 + sides));
        Self { sigma, delta, sides }
    }

    /// In the covariance of these points with others of the same density.
    fn with<const B: usize>(&self, other: &Errors<B>, n: f64) -> SMatrix<f64, A, B> {
        let root_spread = (n / self.sides).sqrt();
        let mixed = self.sigma * other.delta.transpose() + self.delta * other.sigma.transpose();
        mixed * (self.sides * root_spread) + self.delta * other.delta.transpose() * (2.0 * self.sides + 4.0)
    }
}

/// A linear system of six states seen by `NZ` numbers, filtered through sigma points and by the Kalman equations.
fn linear_system<T: Real, const NZ: usize>(draws: &[f64], scaling: [f64; 3]) -> TestCaseResult {
    const N: usize = 6;
    let entry = |k: usize| T::lit(2.0 * draws[k % draws.len()]);
    let g = gaussian::<T, N>(draws, 10.0, 3.0);
    let motion = LinearMotion {
        transition: SMatrix::<T, N, N>::from_fn(|i, j| entry(7 * i + 3 * j)),
        process_noise: gaussian::<T, N>(draws, 0.0, 1.0).cov,
    };
    let sensor = LinearMeasurement {
        matrix: SMatrix::<T, NZ, N>::from_fn(|i, j| entry(11 * i + 5 * j + 2)),
        noise: gaussian::<T, NZ>(draws, 0.0, 2.0).cov,
    };
    let [alpha, beta, kappa] = scaling;
    let unscented = |n: [f64; 3]| Scaling::new::<N>(T::lit(n[0]), T::lit(n[1]), T::lit(n[2]));
    let points = unscented([alpha, beta, kappa])?;
    let (f, h) = (wide(&motion.transition), wide(&sensor.matrix));
    // Besides the errors of the points: those of the factor of P and of the dense equations, 2 N products deep.
    let rounding = T::EPSILON.to_f64() * (4 * N + 8) as f64;
    let n = N as f64;

    let (mut kalman, mut sigma) = (g, g);
    motion.predict(&mut kalman, T::ONE);
    Unscented { model: motion, scaling: points }.predict(&mut sigma, T::ONE);
    let errors = Errors::linear(&f, &g, scaling);
    let size = f.abs() * wide_cov(&g.cov).abs() * f.abs().transpose() + wide_cov(&motion.process_noise).abs();
    within("x", &wide(&sigma.mean), &wide(&kalman.mean), &(errors.delta * 2.0))?;
    within("P", &wide_cov(&sigma.cov), &wide_cov(&kalman.cov), &(errors.with(&errors, n) + size * rounding))?;

    // Drawn anew from a prediction, and propagated points used again, which do not know Q.
    let anew = Unscented { model: sensor, scaling: points }.innovation(&g);
    let whole = sensor.innovation(&g);
    compare(&anew, &whole, &Errors::linear(&SMatrix::identity(), &g, scaling), &Errors::linear(&h, &g, scaling), rounding)?;
    let drawn = SigmaPoints::draw(&g, points).ok_or_else(|| TestCaseError::fail("no factor"))?;
    let (moved, predicted) = drawn.propagate(&motion, T::ONE);
    let again = moved.observe(&sensor, &predicted.mean);
    let noiseless = LinearMotion { process_noise: Symmetric::zeros(), ..motion };
    let mut without = g;
    noiseless.predict(&mut without, T::ONE);
    // H F in two steps: the error of F x through H, and that of H.
    let errors_z = Errors::linear(&(h.abs() * f.abs()), &g, scaling);
    compare(&again, &sensor.innovation(&without), &errors, &Errors { delta: errors_z.delta * 2.0, ..errors_z }, rounding)
}

/// ẑ, G, H P H' of sigma points beside those of the equations.
fn compare<T: Real, const NX: usize, const NZ: usize>(
    got: &boresight::gaussian::Innovation<T, NX, NZ>,
    want: &boresight::gaussian::Innovation<T, NX, NZ>,
    x: &Errors<NX>,
    z: &Errors<NZ>,
    rounding: f64,
) -> TestCaseResult {
    let n = NX as f64;
    within("ẑ", &wide(&got.z_hat), &wide(&want.z_hat), &(z.delta * 2.0))?;
    within("G", &wide(&got.cross), &wide(&want.cross), &(x.with(z, n) + x.sigma * z.sigma.transpose() * rounding))?;
    let spread = z.with(z, n) + z.sigma * z.sigma.transpose() * rounding;
    within("H P H'", &wide_cov(&got.spread), &wide_cov(&want.spread), &spread)
}

/// z = x²: a model of a user, without a Jacobian worth the name.
struct Square;

impl<T: Real> MeasurementModel<T, 1, 1> for Square {
    fn observe(&self, x: &SVector<T, 1>) -> SVector<T, 1> {
        x.component_mul(x)
    }
    fn jacobian(&self, x: &SVector<T, 1>) -> SMatrix<T, 1, 1> {
        x * T::lit(2.0)
    }
    fn noise(&self, _x: &SVector<T, 1>) -> Symmetric<T, 1> {
        Symmetric::from_diagonal([T::ONE])
    }
}

/// E[x²] = m² + P, var x² = 4 m² P + 2 P², cov(x, x²) = 2 m P: points at √3 σ know the fourth moment.
fn square<T: Real>(mean: f64, deviation: f64) -> TestCaseResult {
    let (m, p) = (T::lit(mean), T::lit(deviation * deviation));
    let model = Unscented { model: Square, scaling: Scaling::new::<1>(T::ONE, T::ZERO, T::lit(2.0))? };
    let got = model.innovation(&Gaussian::new(SVector::from([m]), Symmetric::from_diagonal([p])));
    let (m, p) = (m.to_f64(), p.to_f64());
    let largest = (m.abs() + 3f64.sqrt() * p.sqrt()).powi(2);
    // Each value is good to eight ε of the largest, and so are the deviations, which are not larger.
    let delta = 8.0 * T::EPSILON.to_f64() * largest;
    let [z_hat, cross, spread] = [got.z_hat[0], got.cross[(0, 0)], got.spread.upper()[0][0]].map(Real::to_f64);
    prop_assert!((z_hat - (m * m + p)).abs() <= delta, "mean {z_hat}");
    prop_assert!((cross - 2.0 * m * p).abs() <= 4.0 * delta * p.sqrt(), "cross {cross}");
    prop_assert!((spread - (4.0 * m * m * p + 2.0 * p * p)).abs() <= 4.0 * delta * largest, "variance {spread}");
    Ok(())
}

/// East and west of a radar: x, ẑ, G and H P H' are the same but for signs and half a turn.
fn across_the_seam<T: Real>(draws: &[f64], azimuth: f64) -> TestCaseResult {
    let radar = Radar::<T, 3, 2, 2>::new([Range, Azimuth, RangeRate], Symmetric::from_diagonal([400.0, 4e-6, 1.0].map(T::lit)))?;
    let model = Unscented { model: radar, scaling: Scaling::new::<4>(T::ONE, T::lit(2.0), T::ZERO)? };
    // A degree or two of azimuth: some points are on one side of the seam, some on the other.
    let cov = gaussian::<T, 4>(draws, 0.0, 40.0).cov;
    let mean = SVector::from([3e3 * azimuth.cos(), 40.0, 3e3 * azimuth.sin(), -100.0]).map(T::lit);
    let east = model.innovation(&Gaussian::new(mean, cov));
    let west = model.innovation(&Gaussian::new(-mean, cov));
    // Ranges below 4 km and speeds below 1 km/s to eight roundings, azimuths as in the module `sensors`.
    let delta = SVector::from([8.0 * 4e3, 8.0, 8.0 * 1e3]) * T::EPSILON.to_f64();
    let (z_east, z_west) = (wide(&east.z_hat), wide(&west.z_hat));
    prop_assert!(z_west[1].abs() <= PI + T::EPSILON.to_f64() && z_west[1].abs() > 3.0, "azimuth {}", z_west[1]);
    let turn = if z_west[1] > 0.0 { PI } else { -PI };
    within("ẑ", &(z_west - SVector::from([0.0, turn, 0.0])), &z_east, &(delta * 2.0))?;
    // Σ |W| = 3, so that Σ |W d| ≤ √3 σ by Cauchy's inequality.
    let deviation = |p: &SMatrix<f64, 3, 3>| p.diagonal().map(f64::sqrt);
    let sigma_z = deviation(&wide_cov(&east.spread));
    let sigma_x = wide_cov(&cov).diagonal().map(f64::sqrt);
    let bound = |sigma: f64, delta: f64, other: f64, delta_other: f64| 3f64.sqrt() * (sigma * delta_other + other * delta);
    let delta_x = wide(&mean).abs() * T::EPSILON.to_f64();
    let cross = SMatrix::from_fn(|i, k| bound(sigma_x[i], delta_x[i], sigma_z[k], 2.0 * delta[k]));
    let spread = SMatrix::from_fn(|k, l| bound(sigma_z[k], 2.0 * delta[k], sigma_z[l], 2.0 * delta[l]));
    within("G", &-wide(&west.cross), &wide(&east.cross), &cross)?;
    within("H P H'", &wide_cov(&west.spread), &wide_cov(&east.spread), &spread)
}

fn linear_systems<T: Real>(draws: &[f64]) -> TestCaseResult {
    for scaling in scalings(6) {
        linear_system::<T, 1>(draws, scaling)?;
        linear_system::<T, 2>(draws, scaling)?;
        linear_system::<T, 4>(draws, scaling)?;
    }
    Ok(())
}

/// Sigma points that lie whole intervals of a folded range-rate apart look alike to the radar: the prediction must not take
/// them for one, and knows that it cannot unfold.
#[test]
fn whole_folds_apart_is_not_together() -> Result<(), TestCaseError> {
    let (v, deviation) = (20.0, 40.0);
    let noise = Symmetric::from_diagonal([400.0, 1.0]);
    let model = Radar::<f64, 2, 2, 2>::new([Range, RangeRate], noise)?.with_unambiguous_speed(v)?;
    // n + λ = 1: the points are one deviation, one interval of 2 V, from the mean.
    let scaling = Scaling::new::<4>(0.5, 2.0, 0.0)?;
    let cov = Symmetric::from_diagonal([25.0, deviation * deviation, 25.0, deviation * deviation]);
    let g = Gaussian::new(SVector::from([5e3, 0.0, 0.0, 0.0]), cov);
    let innovation = Unscented { model, scaling }.innovation(&g);
    prop_assert!(innovation.cross.column(1).iter().all(|g| *g == 0.0));
    prop_assert!((innovation.spread.upper()[1][1] - v * v / 3.0).abs() < 1e-9, "{:?}", innovation.spread);
    Ok(())
}

proptest! {
    #[test]
    fn on_linear_models_it_is_the_kalman_filter(draws in draws()) {
        linear_systems::<f32>(&draws)?;
        linear_systems::<f64>(&draws)?;
    }

    #[test]
    fn a_square_keeps_its_moments(mean in -10.0..10.0f64, deviation in 0.1..5.0f64) {
        square::<f32>(mean, deviation)?;
        square::<f64>(mean, deviation)?;
    }

    #[test]
    fn sigma_points_cross_the_seam(draws in draws(), azimuth in -0.02..0.02f64) {
        across_the_seam::<f32>(&draws, azimuth)?;
        across_the_seam::<f64>(&draws, azimuth)?;
    }
}

#[test]
fn a_covariance_without_factor_is_left_to_the_model() -> Result<(), TestCaseError> {
    let model = ConstantAcceleration::<f64, 1>::new(ProcessNoise::Continuous(1.0))?;
    let scaling = Scaling::new::<3>(1.0, 2.0, 0.0)?;
    let broken = Gaussian::new(SVector::from([1.0, 2.0, 3.0]), Symmetric::from_fn(|i, j| if i == j { 1.0 } else { 2.0 }));
    prop_assert!(SigmaPoints::draw(&broken, scaling).is_none());
    let (mut got, mut want) = (broken, broken);
    Unscented { model, scaling }.predict(&mut got, 0.5);
    model.predict(&mut want, 0.5);
    prop_assert_eq!(got, want);
    Ok(())
}

#[test]
fn impossible_scalings_are_refused() {
    for (alpha, kappa, error) in
        [(0.0, 0.0, ConfigError::NotPositive), (1.0, -4.0, ConfigError::NotPositive), (f64::NAN, 0.0, ConfigError::NotFinite)]
    {
        assert_eq!(Scaling::new::<4>(alpha, 2.0, kappa).err(), Some(error));
    }
}
