//! Position sensors, and radars measuring every subset of range, azimuth, elevation and range-rate in every order.
//!
//! | function | against |
//! |---|---|
//! | `observe` | the geometry with nalgebra's rotation, in double precision |
//! | `jacobian` | central differences |
//! | `innovation` | `innovation_dense` |
//! | `residual` | sine and cosine of the difference; the same scene turned by half a turn |
//! | folded range-rate | the phase of the difference; where the fold is uncertain, Monte Carlo with fixed seeds |
//! | all of them | finite at the sensor itself and on its vertical axis |

use crate::derivative;
use crate::scene::{Law, Scene, every_radar, scenes};
use crate::support::{draws, gaussian, wide, wide_cov, within};
use boresight::error::ConfigError;
use boresight::gaussian::{Gaussian, ResidualDensity};
use boresight::model::position::Position;
use boresight::model::radar::Component::{self, Azimuth, Elevation, Range, RangeRate};
use boresight::model::radar::Radar;
use boresight::model::{MeasurementModel, innovation_dense};
use boresight::scalar::Real;
use boresight::symmetric::Symmetric;
use nalgebra::{SVector, Vector3};
use proptest::prelude::*;
use proptest::test_runner::{TestCaseError, TestCaseResult};
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};
use std::f64::consts::PI;

/// The error of each measured coordinate, in ε: the matrix of the mounting is good to about four, and with it d to eight
/// of |d|; an angle moves by that over its distance.
fn rounding<const NZ: usize>(components: &[Component; NZ], d: &Vector3<f64>, closing: &Vector3<f64>) -> SVector<f64, NZ> {
    SVector::from(components.map(|c| match c {
        Range => 16.0 * d.norm(),
        Azimuth => 16.0 * d.norm() / d.xy().norm(),
        Elevation => 16.0,
        RangeRate => 16.0 * closing.abs().sum(),
    }))
}

/// observe = the geometry.
struct Geometry;

impl<T: Real> Law<T> for Geometry {
    fn hold<const NX: usize, const NZ: usize, const AXES: usize, const STRIDE: usize>(
        &self,
        radar: &Radar<T, NZ, AXES, STRIDE>,
        components: &[Component; NZ],
        scene: &Scene,
    ) -> TestCaseResult {
        let x = scene.target::<T, NX>(AXES, STRIDE).mean;
        let [d, delta, closing] = scene.relative(&x, AXES, STRIDE);
        let want = SVector::from(components.map(|c| match c {
            Range => d.norm(),
            Azimuth => d.y.atan2(d.x),
            Elevation => (d.z / d.norm()).asin(),
            RangeRate => closing.dot(&delta) / delta.norm(),
        }));
        // The arc sine of the definition loses digits near the poles: √ε at the worst, here r/ρ ≤ 200.
        let loss = rounding(components, &d, &closing) * T::EPSILON.to_f64() + SVector::repeat(200.0 * 16.0 * f64::EPSILON);
        within("observe", &wide(&radar.observe(&x)), &want, &loss)
    }
}

/// jacobian = ∂ observe / ∂x.
struct Derivative;

impl Law<f64> for Derivative {
    fn hold<const NX: usize, const NZ: usize, const AXES: usize, const STRIDE: usize>(
        &self,
        radar: &Radar<f64, NZ, AXES, STRIDE>,
        components: &[Component; NZ],
        scene: &Scene,
    ) -> TestCaseResult {
        let x = scene.target::<f64, NX>(AXES, STRIDE).mean;
        let [d, _, closing] = scene.relative(&x, AXES, STRIDE);
        // A thousandth of the distance within which azimuth turns; velocities enter linearly.
        let steps = SVector::from_fn(|i, _| if i % STRIDE == 0 { 1e-3 * d.xy().norm() } else { 1.0 });
        let rounding = rounding(components, &d, &closing) * f64::EPSILON;
        let (estimate, bound) = derivative(|x| radar.observe(x), |a, b| residual(radar, a, b), &x, &steps, &rounding);
        within("H", &radar.jacobian(&x), &estimate, &bound)
    }
}

/// The residual, which does not depend on the state.
fn residual<T: Real, const NZ: usize, const AXES: usize, const STRIDE: usize>(
    radar: &Radar<T, NZ, AXES, STRIDE>,
    z: &SVector<T, NZ>,
    z_hat: &SVector<T, NZ>,
) -> SVector<T, NZ> {
    MeasurementModel::<T, 9, NZ>::residual(radar, z, z_hat)
}

/// innovation = innovation_dense.
fn dense_form<T: Real, M: MeasurementModel<T, NX, NZ>, const NX: usize, const NZ: usize>(model: &M, g: &Gaussian<T, NX>) -> TestCaseResult {
    let (fast, dense) = (model.innovation(g), innovation_dense(model, g));
    let (h, p) = (wide(&model.jacobian(&g.mean)).abs(), wide_cov(&g.cov).abs());
    // Sums of NX products, and sums of those.
    let (epsilon, n) = (T::EPSILON.to_f64(), NX as f64);
    prop_assert_eq!(fast.z_hat, dense.z_hat);
    within("G", &wide(&fast.cross), &wide(&dense.cross), &(p * h.transpose() * (epsilon * (n + 1.0))))?;
    within("H P H'", &wide_cov(&fast.spread), &wide_cov(&dense.spread), &(h * p * h.transpose() * (epsilon * (2.0 * n + 2.0))))?;
    let density = ResidualDensity::new(&fast.spread.plus(&model.noise(&g.mean)));
    prop_assert!(fast.density.is_proper());
    prop_assert_eq!((fast.density.s_inv, fast.density.peak), (density.s_inv, density.peak));
    Ok(())
}

struct DenseForm;

impl<T: Real> Law<T> for DenseForm {
    fn hold<const NX: usize, const NZ: usize, const AXES: usize, const STRIDE: usize>(
        &self,
        radar: &Radar<T, NZ, AXES, STRIDE>,
        components: &[Component; NZ],
        scene: &Scene,
    ) -> TestCaseResult {
        dense_form(radar, &scene.target::<T, NX>(AXES, STRIDE))?;
        // An uncertain fold, and a certain one: the spread is some 100 m/s.
        for speed in [30.0, 3e4] {
            match radar.with_unambiguous_speed(T::lit(speed)) {
                Ok(radar) => dense_form(&radar, &scene.target::<T, NX>(AXES, STRIDE))?,
                Err(error) => prop_assert_eq!((error, components.contains(&RangeRate)), (ConfigError::NoRangeRate, false)),
            }
        }
        Ok(())
    }
}

/// Nothing is infinite or NaN close to the vertical axis, at `height` above the sensor and `aside`.
struct Finite {
    height: f64,
    aside: f64,
}

impl<T: Real> Law<T> for Finite {
    fn hold<const NX: usize, const NZ: usize, const AXES: usize, const STRIDE: usize>(
        &self,
        radar: &Radar<T, NZ, AXES, STRIDE>,
        components: &[Component; NZ],
        scene: &Scene,
    ) -> TestCaseResult {
        let near = Scene { place: Vector3::zeros(), sight: Vector3::new(self.aside, 0.0, self.height), ..scene.clone() };
        let radar = radar.on(near.mount());
        let mut g = near.target::<T, NX>(AXES, STRIDE);
        let innovation = radar.innovation(&g);
        let finite = radar.jacobian(&g.mean).iter().chain(innovation.z_hat.iter()).chain(innovation.cross.iter()).all(|v| v.is_finite());
        prop_assert!(finite, "{components:?}: {innovation:?}");
        prop_assert!(innovation.spread.is_finite() && innovation.density.s_inv.is_finite(), "{components:?}: {innovation:?}");
        // Whether the update is taken or taken back, the density stays one.
        let _ = g.update(&innovation, &SVector::repeat(T::lit(1e-3)));
        prop_assert!(g.mean.iter().all(|v| v.is_finite()) && g.cov.has_valid_variances(), "{components:?}: {g:?}");
        Ok(())
    }
}

/// Position sensors: H picks entries, so that every product of the dense form is exact.
fn position<T: Real, const NX: usize, const NZ: usize, const STRIDE: usize>(draws: &[f64]) -> TestCaseResult {
    let g = gaussian::<T, NX>(draws, 1e4, 30.0);
    let noise = gaussian::<T, NZ>(draws, 0.0, 5.0).cov;
    let origin = SVector::<T, NZ>::from_fn(|k, _| T::lit(3e3 * draws[k + 20]));
    let sensor = Position::<T, NZ, STRIDE>::new(noise)?.at(origin);
    let (fast, dense) = (sensor.innovation(&g), innovation_dense(&sensor, &g));
    prop_assert_eq!((fast.z_hat, fast.cross, fast.spread), (dense.z_hat, dense.cross, dense.spread));
    prop_assert_eq!((fast.density.s_inv, fast.density.peak), (dense.density.s_inv, dense.density.peak));
    let fix = MeasurementModel::<T, NX, NZ>::locate(&sensor, &fast.z_hat, &noise);
    let fix = fix.ok_or_else(|| TestCaseError::fail("a position was not located"))?;
    for k in 0..NZ {
        let x = g.mean[k * STRIDE];
        prop_assert_eq!(fast.z_hat[k], x - origin[k]);
        // One rounding of the difference and one of the sum.
        prop_assert!((fix.position[k] - x).abs() <= T::EPSILON * (x.abs() + origin[k].abs()));
        prop_assert!((0..NZ).all(|l| fix.cov.get(k, l) == noise.get(k, l)));
    }
    prop_assert!(fix.radial.is_none());
    Ok(())
}

fn every_position<T: Real>(draws: &[f64]) -> TestCaseResult {
    position::<T, 2, 1, 2>(draws)?;
    position::<T, 4, 2, 2>(draws)?;
    position::<T, 5, 2, 2>(draws)?;
    position::<T, 6, 2, 3>(draws)?;
    position::<T, 6, 3, 2>(draws)?;
    position::<T, 9, 3, 3>(draws)
}

/// All four components: range and range-rate subtract, angles wrap into (−π, π] and stay the same angles.
fn wrapped<T: Real>(a: f64, b: f64) -> TestCaseResult {
    let radar = Radar::<T, 4, 3, 2>::new([Range, Azimuth, Elevation, RangeRate], Symmetric::from_diagonal([T::ONE; 4]))?;
    let [z, z_hat] = [a, b].map(|v| SVector::<T, 4>::repeat(T::lit(v)));
    let nu = residual(&radar, &z, &z_hat);
    prop_assert_eq!((nu[0], nu[3]), (z[0] - z_hat[0], z[3] - z_hat[3]));
    for angle in [nu[1], nu[2]] {
        prop_assert!(angle > -T::PI && angle <= T::PI, "{angle}");
        let (error, exact) = (angle.to_f64(), z[0].to_f64() - z_hat[0].to_f64());
        // The difference and the turns taken off are rounded to about 2π ε each.
        let bound = 16.0 * T::EPSILON.to_f64();
        prop_assert!((error.sin() - exact.sin()).abs() <= bound && (error.cos() - exact.cos()).abs() <= bound, "{a} − {b}: {angle}");
    }
    Ok(())
}

/// A target west of the sensor, where azimuth jumps from π to −π, is corrected as one east of it: the scene turned by half
/// a turn is the scene with every sign changed, exactly, but for the azimuth.
fn across_the_seam<T: Real>(draws: &[f64], azimuth: f64, nu: f64) -> TestCaseResult {
    let (range, rate) = (T::lit(5e3), T::lit(10.0));
    let radar = Radar::<T, 3, 2, 2>::new([Range, Azimuth, RangeRate], Symmetric::from_diagonal([400.0, 4e-6, 1.0].map(T::lit)))?;
    let g = gaussian::<T, 4>(draws, 0.0, 30.0);
    let mean = SVector::from([5e3 * azimuth.cos(), 40.0, 5e3 * azimuth.sin(), -100.0]).map(T::lit);
    let (mut east, mut west) = (Gaussian::new(mean, g.cov), Gaussian::new(-mean, g.cov));
    let behind = if azimuth + nu > 0.0 { azimuth + nu - PI } else { azimuth + nu + PI };
    let [ahead, behind] = [azimuth + nu, behind].map(|a| SVector::from([range, T::lit(a), rate]));
    let correct = |g: &mut Gaussian<T, 4>, z: &SVector<T, 3>| {
        let innovation = radar.innovation(g);
        let nu = residual(&radar, z, &innovation.z_hat);
        (g.update(&innovation, &nu), innovation, nu)
    };
    let ((taken, innovation, nu), (taken_too, ..)) = (correct(&mut east, &ahead), correct(&mut west, &behind));
    prop_assert!(taken && taken_too);
    prop_assert_eq!(east.cov, west.cov);
    // Measured azimuth ε, predicted 2 ε, the turn taken off 1.5 ε and their difference ε, at angles about π; then two sums of
    // three products, S⁻¹ ν and G w, and the sum with x.
    let (cross, s_inv) = (wide(&innovation.cross).abs(), wide_cov(&innovation.density.s_inv).abs());
    let angle = SVector::from([0.0, 4.0, 0.0]);
    let bound = (cross * s_inv * (angle + wide(&nu).abs() * 8.0) + wide(&mean).abs()) * (2.0 * T::EPSILON.to_f64());
    within("turned", &wide(&west.mean), &-wide(&east.mean), &bound)
}

/// A radar that measures range-rate modulo 2 `speed`, and range.
fn pulse_doppler<T: Real>(speed: f64) -> Result<Radar<T, 2, 2, 2>, ConfigError> {
    let noise = Symmetric::from_diagonal([400.0, 1.0].map(T::lit));
    Radar::new([Range, RangeRate], noise)?.with_unambiguous_speed(T::lit(speed))
}

/// Range-rate in (−V, V] and of the same phase; the range as ever; predictions are not folded.
fn folded<T: Real>(a: f64, b: f64, speed: f64) -> TestCaseResult {
    let (radar, v) = (pulse_doppler::<T>(speed)?, T::lit(speed));
    let [z, z_hat] = [a, b].map(|v| SVector::<T, 2>::repeat(T::lit(v)));
    let nu = MeasurementModel::<T, 4, 2>::residual(&radar, &z, &z_hat);
    prop_assert!(nu[1] > -v && nu[1] <= v, "{}", nu[1]);
    prop_assert_eq!(nu[0], z[0] - z_hat[0]);
    prop_assert_eq!(MeasurementModel::<T, 4, 2>::difference(&radar, &z, &z_hat), z - z_hat);
    let [phase, exact] = [nu[1].to_f64(), z[1].to_f64() - z_hat[1].to_f64()].map(|rate| PI * rate / v.to_f64());
    // The difference, the intervals taken off and the sum are rounded, all of the size of the difference or of V.
    let bound = 4.0 * T::EPSILON.to_f64() * PI * (1.0 + exact.abs() / PI) + 4.0 * f64::EPSILON * exact.abs();
    prop_assert!((phase.sin() - exact.sin()).abs() <= bound && (phase.cos() - exact.cos()).abs() <= bound, "{a} − {b}: {}", nu[1]);
    Ok(())
}

/// As long as the fold is certain a folded measurement corrects as the whole one does; else it leaves all but the range alone.
fn unfolded_by_prediction<T: Real>(draws: &[f64], speed: f64, folds: i32, nu: f64) -> TestCaseResult {
    let radar = pulse_doppler::<T>(speed)?;
    let whole = Radar::<T, 2, 2, 2>::new([Range, RangeRate], Symmetric::from_diagonal([400.0, 1.0].map(T::lit)))?;
    let scattered = gaussian::<T, 4>(draws, 0.0, 10.0);
    let g = Gaussian::new(SVector::from([3e3, 40.0, 4e3, -100.0]).map(T::lit), scattered.cov);
    let (folded, plain) = (radar.innovation(&g), whole.innovation(&g));
    prop_assert_eq!(folded.z_hat, plain.z_hat);
    prop_assert_eq!(folded.cross.column(0), plain.cross.column(0));
    let variance = plain.spread.upper()[1][1] + T::ONE;
    if T::lit(9.0) * variance > T::lit(speed * speed) {
        prop_assert!(folded.cross.column(1).iter().all(|g| *g == T::ZERO));
        let spread = folded.spread.upper();
        let rounding = 4.0 * T::EPSILON.to_f64() * speed * speed;
        prop_assert!((spread[1][1].to_f64() - speed * speed / 3.0).abs() <= rounding, "{}", spread[1][1]);
        prop_assert_eq!((spread[0][0], spread[0][1]), (plain.spread.upper()[0][0], T::ZERO));
        return Ok(());
    }
    prop_assert_eq!((folded.cross, folded.spread, folded.density.s_inv), (plain.cross, plain.spread, plain.density.s_inv));
    let true_rate = plain.z_hat[1] + T::lit(nu * speed);
    let measured = true_rate + T::lit(2.0 * speed * f64::from(folds));
    let [got, want] = [measured, true_rate].map(|rate| SVector::from([plain.z_hat[0], rate]));
    let got = MeasurementModel::<T, 4, 2>::residual(&radar, &got, &folded.z_hat);
    let want = MeasurementModel::<T, 4, 2>::residual(&whole, &want, &plain.z_hat);
    let size = plain.z_hat[1].to_f64().abs() + 2.0 * speed * f64::from(folds.abs() + 1);
    within("ν", &wide(&got), &wide(&want), &SVector::from([0.0, 4.0 * T::EPSILON.to_f64() * size]))
}

/// A range-rate folded more than once is uniform over its interval and tells nothing of the state: the moments that a radar
/// predicts are those of a sample.
#[test]
fn an_uncertain_fold_is_predicted_by_its_moments() -> Result<(), TestCaseError> {
    const RUNS: usize = 100_000;
    let radar = pulse_doppler::<f64>(20.0)?;
    let deviation = SVector::from([50.0, 40.0, 50.0, 40.0]);
    let g = Gaussian::new(SVector::from([3e3, 40.0, 4e3, -100.0]), Symmetric::from_diagonal(deviation.map(|s| s * s).into()));
    let innovation = radar.innovation(&g);
    let mut rng = ChaCha8Rng::seed_from_u64(1);
    let mut normal = || -> f64 { StandardNormal.sample(&mut rng) };
    let samples: Vec<(SVector<f64, 4>, f64)> = (0..RUNS)
        .map(|_| {
            let x = g.mean + SVector::from_fn(|i, _| deviation[i] * normal());
            let z = MeasurementModel::<f64, 4, 2>::observe(&radar, &x) + SVector::from([20.0 * normal(), normal()]);
            (x, MeasurementModel::<f64, 4, 2>::residual(&radar, &z, &innovation.z_hat)[1])
        })
        .collect();
    let n = RUNS as f64;
    let variance = samples.iter().map(|(_, nu)| nu * nu).sum::<f64>() / n;
    // The sensor's own noise of 1 m²/s² is counted beside the interval. ν² of a uniform ν has variance 4 V⁴ / 45.
    let error = (4.0 / 45.0f64).sqrt() * 400.0 / n.sqrt();
    let predicted = innovation.spread.upper()[1][1];
    prop_assert!((variance - predicted).abs() < 5.0 * error, "{variance} for {predicted} ± {error}");
    for i in 0..4 {
        let correlation = samples.iter().map(|(x, nu)| (x[i] - g.mean[i]) / deviation[i] * nu).sum::<f64>() / n / variance.sqrt();
        prop_assert!(correlation.abs() < 5.0 / n.sqrt(), "{i}: {correlation}");
        prop_assert_eq!(innovation.cross[(i, 1)], 0.0);
    }
    Ok(())
}

#[test]
fn an_unambiguous_speed_is_positive_and_of_a_range_rate() {
    let error = |speed: f32| pulse_doppler::<f32>(f64::from(speed)).err();
    assert_eq!(error(20.0), None);
    for speed in [0.0, -0.0, -1.0] {
        assert_eq!(error(speed), Some(ConfigError::NotPositive));
    }
    for speed in [f32::NAN, f32::INFINITY, f32::MAX] {
        assert_eq!(error(speed), Some(ConfigError::NotFinite));
    }
    let radar = Radar::<f32, 1, 2, 2>::new([Range], Symmetric::from_diagonal([1.0]));
    assert_eq!(radar.and_then(|r| r.with_unambiguous_speed(20.0)).err(), Some(ConfigError::NoRangeRate));
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(64))]

    #[test]
    fn radars_measure_the_geometry(scene in scenes()) {
        every_radar::<f32>(&scene, &Geometry)?;
        every_radar::<f64>(&scene, &Geometry)?;
    }

    #[test]
    fn jacobians_are_derivatives(scene in scenes()) {
        every_radar::<f64>(&scene, &Derivative)?;
    }

    #[test]
    fn innovations_equal_the_dense_form(scene in scenes()) {
        every_radar::<f32>(&scene, &DenseForm)?;
        every_radar::<f64>(&scene, &DenseForm)?;
    }

    #[test]
    fn nothing_breaks_at_the_sensor_and_above_it(
        scene in scenes(),
        height in prop::sample::select(vec![0.0, 1e-30, 1e-6, 1.0, -1e3, 1e5]),
        aside in prop::sample::select(vec![0.0, 1e-30, -1e-20, 1e-6, 1e-3]),
    ) {
        every_radar::<f32>(&scene, &Finite { height, aside })?;
        every_radar::<f64>(&scene, &Finite { height, aside })?;
    }

    #[test]
    fn positions_are_picked(draws in draws()) {
        every_position::<f32>(&draws)?;
        every_position::<f64>(&draws)?;
    }

    #[test]
    fn angles_wrap(a in -PI..=PI, b in -PI..=PI, seam in any::<bool>()) {
        // Half of the pairs within a thousandth of the seam.
        let near = |v: f64| if seam { (PI - 1e-3 * v.abs()).copysign(v) } else { v };
        wrapped::<f32>(near(a), near(b))?;
        wrapped::<f64>(near(a), near(b))?;
    }

    #[test]
    fn range_rates_fold(a in -2e3..2e3f64, b in -300.0..300.0f64, speed in 5.0..200.0f64) {
        folded::<f32>(a, b, speed)?;
        folded::<f64>(a, b, speed)?;
    }

    #[test]
    fn the_prediction_unfolds_what_it_can(draws in draws(), speed in 10.0..150.0f64, folds in -3..4i32, nu in -0.99..0.99f64) {
        unfolded_by_prediction::<f32>(&draws, speed, folds, nu)?;
        unfolded_by_prediction::<f64>(&draws, speed, folds, nu)?;
    }

    #[test]
    fn targets_cross_the_seam_unharmed(draws in draws(), azimuth in -0.02..0.02f64, nu in -0.02..0.02f64) {
        across_the_seam::<f32>(&draws, azimuth, nu)?;
        across_the_seam::<f64>(&draws, azimuth, nu)?;
    }
}

#[test]
fn the_ends_of_the_turn_are_one_angle() -> Result<(), TestCaseError> {
    for (a, b) in [(PI, -PI), (-PI, PI), (PI, PI), (0.0, PI), (PI, 0.0), (-PI, 0.0)] {
        wrapped::<f32>(a, b)?;
        wrapped::<f64>(a, b)?;
    }
    // The least numbers beyond: their quotients by 2π must not be rounded to ½.
    wrapped::<f32>(f64::from(std::f32::consts::PI.next_up()), 0.0)?;
    wrapped::<f32>(0.0, f64::from(std::f32::consts::PI.next_up()))?;
    wrapped::<f64>(PI.next_up(), 0.0)?;
    wrapped::<f64>(0.0, PI.next_up())
}

#[test]
fn noise_must_be_definite() {
    let flat = Symmetric::<f32, 2>::from_diagonal([1.0, 0.0]);
    assert_eq!(Position::<f32, 2, 2>::new(flat).err(), Some(ConfigError::NotDefinite));
    assert_eq!(Radar::<f32, 2, 2, 2>::new([Range, Azimuth], flat).err(), Some(ConfigError::NotDefinite));
}
