//! Cross-covariance, Bar-Shalom and Campo's fusion, and the test of two tracks.

use crate::least;
use crate::support::{draws, gaussian};
use boresight::fusion::{CrossCovariance, Rule, Weight, distance};
use boresight::gaussian::Gaussian;
use boresight::model::linear::{LinearMeasurement, LinearMotion};
use boresight::model::motion::{ConstantVelocity, ProcessNoise};
use boresight::model::{Layout, MeasurementModel, MotionModel};
use boresight::symmetric::Symmetric;
use host_tests::metrics::{chi_square_quantile, consistency, nees};
use nalgebra::{SMatrix, SVector};
use proptest::prelude::*;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};

const PLANE: Layout = Layout { axes: 2, stride: 2 };

type Covariance = SMatrix<f64, 4, 4>;

/// Two estimates and the covariance of their errors, all three from one definite 8 × 8 matrix.
fn correlated(draws: &[f64]) -> (Gaussian<f64, 4>, Gaussian<f64, 4>, Covariance) {
    let root = SMatrix::<f64, 8, 8>::from_fn(|i, j| draws[8 * i + j]);
    let joint = root * root.transpose() + SMatrix::identity() * 0.25;
    let of = |row: usize, column: usize| joint.fixed_view::<4, 4>(row, column).into_owned();
    let mean = |first: usize| SVector::from_fn(|i, _| 10.0 * draws[64 + first + i]);
    let estimate = |first: usize| Gaussian::new(mean(first), Symmetric::from_matrix(&of(first, first)));
    (estimate(0), estimate(4), of(0, 4))
}

proptest! {
    /// The least that any x = x_1 + K (x_2 − x_1) can have: every other gain has more.
    #[test]
    fn the_fused_covariance_is_the_least_of_all_gains(draws in draws(), change in prop::collection::vec(-0.2..0.2f64, 16)) {
        let (a, b, p12) = correlated(&draws);
        let fused = CrossCovariance(p12).fuse(&a, &b).ok_or_else(|| TestCaseError::fail("refused"))?;
        let (p1, p2) = (a.cov.to_matrix(), b.cov.to_matrix());
        let s = p1 + p2 - p12 - p12.transpose();
        let inverse = s.try_inverse().ok_or_else(|| TestCaseError::fail("singular"))?;
        let best = (p1 - p12) * inverse;
        let of_gain = |k: Covariance| {
            let (keep, shared) = (Covariance::identity() - k, (Covariance::identity() - k) * p12 * k.transpose());
            keep * p1 * keep.transpose() + k * p2 * k.transpose() + shared + shared.transpose()
        };
        let p = fused.cov.to_matrix();
        prop_assert!((p - (p1 - best * (p1 - p12).transpose())).norm() < 1e-9 * p1.norm());
        prop_assert!((fused.mean - (a.mean + best * (b.mean - a.mean))).norm() < 1e-8);
        prop_assert!(least(&(of_gain(best + Covariance::from_row_slice(&change)) - p)) > -1e-9 * p.trace());
        prop_assert!(least(&(p1 - p)) > -1e-9 * p1.trace() && least(&(p2 - p)) > -1e-9 * p2.trace());
    }

    #[test]
    fn independent_estimates_are_fused_as_by_the_convex_rule(one in draws(), other in draws()) {
        let (a, b) = (gaussian::<f64, 4>(&one, 10.0, 1.0), gaussian::<f64, 4>(&other, 10.0, 2.0));
        let (known, naive) = CrossCovariance::zeros().fuse(&a, &b).zip(Rule::NaiveConvex.fuse(&a, &b)).ok_or_else(|| TestCaseError::fail("refused"))?;
        prop_assert!((known.mean - naive.mean).norm() < 1e-9 * (1.0 + known.mean.norm()));
        prop_assert!((known.cov.to_matrix() - naive.cov.to_matrix()).norm() < 1e-9 * known.cov.to_matrix().norm());
    }

    #[test]
    fn the_test_measures_positions_and_velocities_only(one in draws(), other in draws()) {
        let (a, b) = (gaussian::<f64, 6>(&one, 10.0, 1.0), gaussian::<f64, 6>(&other, 10.0, 1.0));
        let got = distance(&a, &b, Layout { axes: 2, stride: 3 }).ok_or_else(|| TestCaseError::fail("refused"))?;
        let place = [0, 1, 3, 4];
        let s = Covariance::from_fn(|i, j| (a.cov.to_matrix() + b.cov.to_matrix())[(place[i], place[j])]);
        let d = SVector::<f64, 4>::from_fn(|i, _| (a.mean - b.mean)[place[i]]);
        let want = d.dot(&(s.try_inverse().ok_or_else(|| TestCaseError::fail("singular"))? * d));
        prop_assert!((got.square - want).abs() < 1e-9 * (1.0 + want) && got.dimension == 4);
        prop_assert_eq!(distance(&a, &b, Layout::UNKNOWN).map(|d| d.dimension), Some(6));
    }
}

/// One target and two Kalman filters that see it by sensors of their own, each with the other's process noise.
struct Pair {
    motion: LinearMotion<f64, 4>,
    sensors: [LinearMeasurement<f64, 4, 2>; 2],
    truth: SVector<f64, 4>,
    filters: [Gaussian<f64, 4>; 2],
    cross: CrossCovariance<f64, 4>,
    rng: ChaCha8Rng,
}

impl Pair {
    fn new(seed: u64) -> Result<Self, Box<dyn std::error::Error>> {
        let cv = ConstantVelocity::<f64, 2, 2>::new(ProcessNoise::Continuous(4.0))?;
        let zero = SVector::zeros();
        let motion =
            LinearMotion { transition: cv.jacobian(&zero, 1.0), process_noise: MotionModel::<f64, 4>::process_noise(&cv, &zero, 1.0) };
        let matrix = SMatrix::from_row_slice(&[1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0]);
        let sensors = [[100.0, 36.0], [25.0, 81.0]].map(|r| LinearMeasurement { matrix, noise: Symmetric::from_diagonal(r) });
        let prior = Symmetric::from_diagonal([100.0, 25.0, 100.0, 25.0]);
        let mut pair = Self {
            motion,
            sensors,
            truth: zero,
            filters: [Gaussian::new(zero, prior); 2],
            cross: CrossCovariance::zeros(),
            rng: ChaCha8Rng::seed_from_u64(seed),
        };
        // Errors at the start are independent, and such as the prior says.
        for filter in 0..2 {
            pair.filters[filter].mean = pair.normal(&prior);
        }
        Ok(pair)
    }

    fn normal<const N: usize>(&mut self, cov: &Symmetric<f64, N>) -> SVector<f64, N> {
        let root = cov.cholesky().unwrap_or([[0.0; N]; N]);
        let w = SVector::<f64, N>::from_fn(|_, _| StandardNormal.sample(&mut self.rng));
        SMatrix::from_fn(|i, j| root[i][j]) * w
    }

    fn step(&mut self) {
        let q = self.motion.process_noise;
        self.truth = self.motion.transition * self.truth + self.normal(&q);
        self.cross.predict(&self.motion.transition, &q);
        for filter in 0..2 {
            self.motion.predict(&mut self.filters[filter], 1.0);
            if self.rng.random_bool(0.1) {
                continue;
            }
            let sensor = self.sensors[filter];
            let z = sensor.matrix * self.truth + self.normal(&sensor.noise);
            let innovation = sensor.innovation(&self.filters[filter]);
            let gain = innovation.gain();
            let _ = self.filters[filter].update(&innovation, &(z - innovation.z_hat));
            match filter {
                0 => self.cross.first_updated(&gain, &sensor.matrix),
                _ => self.cross.second_updated(&gain, &sensor.matrix),
            }
        }
    }

    fn nees(&self, g: Option<Gaussian<f64, 4>>) -> Option<f64> {
        g.and_then(|g| nees((g.mean - self.truth).as_slice(), g.cov.to_matrix().as_slice()))
    }
}

/// 400 runs of 40 scans each, one NEES a run: by the rules of statistics that they then are.
#[test]
fn the_convex_rule_is_overconfident_and_the_others_are_not() -> Result<(), Box<dyn std::error::Error>> {
    let mut of = [const { Vec::<f64>::new() }; 3];
    let mut sample = Covariance::zeros();
    let mut cross = Covariance::zeros();
    for seed in 0..400 {
        let mut pair = Pair::new(3_000_000 + seed)?;
        (0..40).for_each(|_| pair.step());
        let [a, b] = &pair.filters;
        let fused = [pair.cross.fuse(a, b), Rule::NaiveConvex.fuse(a, b), Rule::Intersection(Weight::Determinant).fuse(a, b)];
        for (list, g) in of.iter_mut().zip(fused) {
            list.push(pair.nees(g).ok_or("no NEES")?);
        }
        sample += (a.mean - pair.truth) * (b.mean - pair.truth).transpose() / 400.0;
        cross += pair.cross.0 / 400.0;
    }
    let [known, naive, intersection] = of.map(|list| consistency(&list, 4));
    let (known, naive, intersection) = known.zip(naive).zip(intersection).map(|((a, b), c)| (a, b, c)).ok_or("no figures")?;
    println!(
        "NEES(4): known correlation {:.2}, convex {:.2}, intersection {:.2}; 95 % {:?}",
        known.mean_nees, naive.mean_nees, intersection.mean_nees, known.interval
    );
    assert!(known.consistent(), "{known:?}");
    assert!(naive.mean_nees > naive.interval[1], "{naive:?}");
    assert!(intersection.mean_nees <= intersection.interval[1], "{intersection:?}");
    // The sample of P12 against the recursion: its entries scatter by √((P_1 P_2 + P12²) / 400), four times that.
    let pair = Pair::new(0)?;
    let p = pair.filters[0].cov.to_matrix().diagonal();
    for i in 0..4 {
        for j in 0..4 {
            assert!(
                (sample[(i, j)] - cross[(i, j)]).abs() < 4.0 * (p[i] * p[j] * 2.0 / 400.0).sqrt(),
                "P12 ({i}, {j}): {} for {}",
                sample[(i, j)],
                cross[(i, j)]
            );
        }
    }
    Ok(())
}

/// The level of the test is what it says only with the correlation; without it more pass, as the module warns.
#[test]
fn the_test_with_the_correlation_keeps_its_level() -> Result<(), Box<dyn std::error::Error>> {
    let threshold = chi_square_quantile(4.0, 0.9).ok_or("no quantile")?;
    let (mut with, mut without) = (0, 0);
    for seed in 0..1000 {
        let mut pair = Pair::new(4_000_000 + seed)?;
        (0..30).for_each(|_| pair.step());
        let [a, b] = &pair.filters;
        with += u32::from(pair.cross.distance(a, b, PLANE).ok_or("refused")?.square > threshold);
        without += u32::from(distance(a, b, PLANE).ok_or("refused")?.square > threshold);
    }
    println!("beyond the 90 % quantile, of 1000 pairs: {with} with the correlation, {without} without");
    // 100 of 1000, and four binomial deviations of 9.5 either way.
    assert!((62..=138).contains(&with), "{with}");
    assert!(without < with, "{without} of {with}");
    Ok(())
}

#[test]
fn a_miss_changes_nothing_and_equal_gains_act_from_both_sides() {
    let (_, _, p12) = correlated(&[0.37; 90]);
    let h = SMatrix::<f64, 1, 4>::from_row_slice(&[1.0, 0.0, 0.0, 0.0]);
    let gain = SVector::<f64, 4>::from([0.5, 0.2, 0.0, 0.1]);
    let mut cross = CrossCovariance(p12);
    cross.first_updated(&gain, &h);
    cross.second_updated(&gain, &h);
    let keep = Covariance::identity() - gain * h;
    assert!((cross.0 - keep * p12 * keep.transpose()).norm() < 1e-12);
}
