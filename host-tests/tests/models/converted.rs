//! Polar measurements converted to Cartesian: one by one against the geometry, on average against Monte Carlo.
//!
//! ```text
//! locate      returns to the position that was observed, and H C H' = R carries its covariance back
//! debiased    E[converted | truth] = truth            exactly, for Gaussian errors of any size
//!             R = cov(truth | measurement)            likewise
//! ```
//!
//! Monte Carlo runs have fixed seeds; a mean may be five standard errors off, which happens to one in two million, and
//! the standard error of a covariance is taken from the sample's fourth moments.

use crate::scene::{Law, Scene, every_radar, scenes};
use crate::support::{wide, wide_cov, within};
use boresight::model::MeasurementModel;
use boresight::model::converted::Polar;
use boresight::model::radar::Component::{self, Azimuth, Elevation, Range, RangeRate};
use boresight::model::radar::Radar;
use boresight::scalar::Real;
use boresight::symmetric::Symmetric;
use nalgebra::{Matrix3, SVector, Vector3};
use proptest::prelude::*;
use proptest::test_runner::{TestCaseError, TestCaseResult};
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};
use std::f64::consts::PI;

/// Standard deviation of an angle in [`Located`] \[rad\]: small, so that the debias is.
const ANGLE: f64 = 1e-4;
/// And of the range \[m\].
const LENGTH: f64 = 10.0;

/// locate ∘ observe = identity, but for the debias.
struct Located;

impl<T: Real> Law<T> for Located {
    fn hold<const NX: usize, const NZ: usize, const AXES: usize, const STRIDE: usize>(
        &self,
        radar: &Radar<T, NZ, AXES, STRIDE>,
        components: &[Component; NZ],
        scene: &Scene,
    ) -> TestCaseResult {
        let has = |c: Component| components.contains(&c);
        // In the plane a sensor that measures no elevation must stand in it and upright.
        let scene = if AXES == 3 || has(Elevation) { scene.clone() } else { flat(scene) };
        let radar = radar.on(scene.mount());
        let x = scene.target::<T, NX>(AXES, STRIDE).mean;
        let variance = components.map(|c| T::lit(if c == Range { LENGTH * LENGTH } else { ANGLE * ANGLE }));
        let noise = Symmetric::<T, NZ>::from_diagonal(variance);
        let fix = MeasurementModel::<T, NX, NZ>::locate(&radar, &radar.observe(&x), &noise);
        prop_assert_eq!(fix.is_some(), has(Range) && has(Azimuth) && (AXES == 2 || has(Elevation)));
        let Some(fix) = fix else { return Ok(()) };

        let [d, delta, closing] = scene.relative(&x, AXES, STRIDE);
        // The debias lengthens by e^{σ²/2} an angle; angles and mounting are rounded, to sixteen ε in all.
        let relative = (ANGLE * ANGLE).exp_m1() + 16.0 * T::EPSILON.to_f64();
        for a in 0..AXES {
            let (got, want) = (fix.position[a].to_f64(), x[a * STRIDE].to_f64());
            let bound = relative * d.norm() + T::EPSILON.to_f64() * (want.abs() + scene.place[a].abs());
            prop_assert!((got - want).abs() <= bound, "axis {a}: {got} for {want}, bound {bound:e}");
        }
        prop_assert_eq!(fix.radial.is_some(), has(RangeRate));
        if let Some(radial) = fix.radial {
            let own = scene.velocity.map(|v| T::lit(v).to_f64());
            let want = (closing + own).dot(&delta) / delta.norm();
            let bound = (relative + 16.0 * T::EPSILON.to_f64()) * (closing.abs().sum() + own.abs().sum());
            prop_assert!((radial.speed.to_f64() - want).abs() <= bound, "radial speed {} for {want}", radial.speed);
            prop_assert_eq!(Some(radial.variance), components.iter().position(|c| *c == RangeRate).and_then(|k| noise.get(k, k)));
        }
        Ok(())
    }
}

/// Sensor and target in the plane, the sensor upright.
fn flat(scene: &Scene) -> Scene {
    let [place, velocity, sight] = [scene.place, scene.velocity, scene.sight].map(|v| Vector3::new(v.x, v.y, 0.0));
    Scene { place, velocity, sight, turned: [scene.turned[0], 0.0, 0.0], ..scene.clone() }
}

/// The Jacobian of the measurement carries the covariance of the fix back to R, up to terms of second order.
fn covariance_is_carried_back(scene: &Scene) -> TestCaseResult {
    let noise = Symmetric::<f64, 3>::from_diagonal([LENGTH * LENGTH, ANGLE * ANGLE, ANGLE * ANGLE]);
    let radar = Radar::<f64, 3, 3, 2>::new([Range, Azimuth, Elevation], noise)?.on(scene.mount());
    let x = scene.target::<f64, 6>(3, 2).mean;
    let fix = MeasurementModel::<f64, 6, 3>::locate(&radar, &radar.observe(&x), &noise);
    let fix = fix.ok_or_else(|| TestCaseError::fail("not located"))?;
    let h = radar.jacobian(&x);
    let by_position = Matrix3::from_fn(|i, j| h[(i, 2 * j)]);
    let r = by_position * wide_cov(&fix.cov) * by_position.transpose();
    let (d, rho) = (scene.sight.norm(), scene.sight.xy().norm());
    // The equations of the conversion beside the linear ones: factors of 1 ± 2σ² and 1 ± (σ_r / r)², a range variance grown
    // by r² (σ_a⁴ + σ_e⁴) / 2, and an azimuth that steepens towards the vertical, by σ_e² r² / ρ².
    let second_order = 4.0 * (ANGLE * d / rho).powi(2) + (LENGTH / d).powi(2) + (d * ANGLE * ANGLE / LENGTH).powi(2);
    let deviation = [LENGTH, ANGLE, ANGLE];
    let bound = Matrix3::from_fn(|i, j| 2.0 * second_order * deviation[i] * deviation[j]);
    within("H C H'", &r, &wide_cov(&noise), &bound)
}

/// A target and the errors of the sensor.
#[derive(Clone, Copy, Debug)]
struct Case {
    truth: [f64; 3],
    deviation: [f64; 3],
}

/// From errors that a linear conversion serves to those that wrap around a good part of the circle.
const CASES: [Case; 5] = [
    Case { truth: [30_000.0, 2.0, 0.0], deviation: [20.0, 2e-4, 0.0] },
    Case { truth: [10_000.0, -0.7, 0.0], deviation: [30.0, 0.05, 0.0] },
    Case { truth: [1_000.0, 3.0, 0.4], deviation: [50.0, 0.1, 0.05] },
    Case { truth: [5_000.0, -2.0, -0.9], deviation: [100.0, 0.3, 0.2] },
    Case { truth: [2_000.0, 0.3, 1.2], deviation: [5.0, 0.02, 0.4] },
];
const RUNS: usize = 100_000;

impl Case {
    /// The truth with `RUNS` sets of errors.
    fn disturbed(self, seed: u64) -> impl Iterator<Item = [f64; 3]> {
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        (0..RUNS).map(move |_| {
            std::array::from_fn(|k| {
                let n: f64 = StandardNormal.sample(&mut rng);
                self.truth[k] + self.deviation[k] * n
            })
        })
    }

    fn polar<T: Real>(self, [range, azimuth, elevation]: [f64; 3]) -> Polar<T> {
        let [range_variance, azimuth_variance, elevation_variance] = self.deviation.map(|s| T::lit(s * s));
        let [range, azimuth, elevation] = [range, azimuth, elevation].map(T::lit);
        Polar { range, azimuth, elevation, range_variance, azimuth_variance, elevation_variance }
    }
}

fn cartesian([range, azimuth, elevation]: [f64; 3]) -> Vector3<f64> {
    let (s, c) = elevation.sin_cos();
    Vector3::new(range * c * azimuth.cos(), range * c * azimuth.sin(), range * s)
}

/// The mean of the samples and its standard error.
fn mean<const N: usize>(samples: impl Iterator<Item = SVector<f64, N>>) -> (SVector<f64, N>, SVector<f64, N>) {
    let samples: Vec<_> = samples.collect();
    let n = samples.len() as f64;
    let mean = samples.iter().sum::<SVector<f64, N>>() / n;
    let squares: SVector<f64, N> = samples.iter().map(|x| (x - mean).map(|d| d * d)).sum();
    (mean, squares.map(|s| (s / (n - 1.0) / n).sqrt()))
}

/// The converted position is the truth on average.
fn unbiased<T: Real>() -> TestCaseResult {
    for (seed, case) in CASES.into_iter().enumerate() {
        let converted = case.disturbed(seed as u64).map(|z| Vector3::from(case.polar::<T>(z).debiased().position.map(Real::to_f64)));
        let (mean, error) = mean(converted);
        // Rounding of a range in the converted position.
        let rounding = Vector3::repeat(16.0 * T::EPSILON.to_f64() * case.truth[0]);
        within(&format!("{case:?}"), &mean, &cartesian(case.truth), &(error * 5.0 + rounding))?;
    }
    Ok(())
}

/// Given the measurement, the truth scatters by the covariance of the conversion.
fn covariance_is_that_of_the_truth<T: Real>() -> TestCaseResult {
    for (seed, case) in CASES.into_iter().enumerate() {
        let truths: Vec<_> = case.disturbed(100 + seed as u64).map(cartesian).collect();
        let (centre, _) = mean(truths.iter().copied());
        let products = truths.iter().map(|x| SVector::<f64, 9>::from_fn(|k, _| (x - centre)[k / 3] * (x - centre)[k % 3]));
        let (cov, error) = mean(products);
        let got = wide_cov(&case.polar::<T>(case.truth).debiased().cov);
        let got = SVector::<f64, 9>::from_fn(|k, _| got[(k / 3, k % 3)]);
        // Rotated by an angle good to sixteen ε, the larger axis leaks into the smaller.
        let rounding = SVector::repeat(16.0 * T::EPSILON.to_f64() * cov.max());
        within(&format!("{case:?}"), &got, &cov, &(error * 5.0 + rounding))?;
    }
    Ok(())
}

/// Errors of no size leave the plain geometry, in both forms.
fn exact_without_errors<T: Real>(z: [f64; 3]) -> TestCaseResult {
    let case = Case { truth: z, deviation: [0.0; 3] };
    let polar = case.polar::<T>(z);
    let want = cartesian([polar.range, polar.azimuth, polar.elevation].map(Real::to_f64));
    for converted in [polar.linear(), polar.debiased()] {
        let got = wide(&SVector::from(converted.position));
        // Sines and cosines to one ε and their products.
        within("position", &got, &want, &Vector3::repeat(4.0 * T::EPSILON.to_f64() * z[0]))?;
        prop_assert_eq!(converted.cov, Symmetric::zeros());
    }
    Ok(())
}

/// π + x and −π + x are one azimuth, in position and covariance, whatever side of the seam it was reported on.
fn one_across_the_seam<T: Real>(case: &Case, x: f64) -> TestCaseResult {
    let [range, _, elevation] = case.truth;
    let at = |azimuth: f64| case.polar::<T>([range, azimuth, elevation]);
    let (a, b) = (at(x + PI), at(x - PI));
    for (a, b) in [(a.linear(), b.linear()), (a.debiased(), b.debiased())] {
        // Either azimuth is rounded at π, and its sine and cosine to one ε; the covariance holds products of these.
        let rounding = 16.0 * T::EPSILON.to_f64();
        let [p, q] = [a, b].map(|c| wide(&SVector::from(c.position)));
        within("position", &p, &q, &Vector3::repeat(rounding * p.norm()))?;
        let [c, d] = [a, b].map(|c| wide_cov(&c.cov));
        within("covariance", &c, &d, &Matrix3::repeat(rounding * c.trace()))?;
    }
    Ok(())
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(64))]

    #[test]
    fn locating_inverts_observing(scene in scenes()) {
        every_radar::<f32>(&scene, &Located)?;
        every_radar::<f64>(&scene, &Located)?;
    }

    #[test]
    fn the_seam_of_azimuth_is_nowhere(x in -0.1..0.1f64, case in prop::sample::select(CASES.to_vec())) {
        one_across_the_seam::<f32>(&case, x)?;
        one_across_the_seam::<f64>(&case, x)?;
    }

    #[test]
    fn the_noise_of_a_fix_is_that_of_the_sensor(scene in scenes()) {
        covariance_is_carried_back(&scene)?;
    }

    #[test]
    fn without_errors_the_conversion_is_plain(z in (1.0..1e5f64, -3.0..3.0f64, -1.5..1.5f64)) {
        exact_without_errors::<f32>(z.into())?;
        exact_without_errors::<f64>(z.into())?;
    }
}

#[test]
fn debiased_positions_are_unbiased() -> Result<(), TestCaseError> {
    unbiased::<f32>()?;
    unbiased::<f64>()
}

#[test]
fn debiased_covariances_are_those_of_the_truth() -> Result<(), TestCaseError> {
    covariance_is_that_of_the_truth::<f32>()?;
    covariance_is_that_of_the_truth::<f64>()
}
