//! Likelihoods beyond what a number holds: outliers of a thousand and a million standard deviations that a wide gate lets
//! in, modes that explain nothing, covariances of every size. A track may learn nothing from these, but it must come out
//! finite, with probabilities that sum to one, and without a correction taken back that was good.

use crate::support::{draws, gaussian};
use boresight::association::{Gate, NearestNeighbour, Pda, SingleAssociator};
use boresight::evidence::{Evidence, innovations, update_by_one};
use boresight::gaussian::Gaussian;
use boresight::mode::ModeBank;
use boresight::model::MeasurementModel;
use boresight::model::position::Position;
use boresight::scalar::Real;
use boresight::scan::{Candidates, Detection};
use boresight::sensor::{Clutter, UniformSensor};
use boresight::symmetric::Symmetric;
use nalgebra::SVector;
use proptest::prelude::*;
use proptest::test_runner::{TestCaseError, TestCaseResult};

const DETS: usize = 12;

/// One update; returns β₀, the probabilities of the gated detections, and the number of corrections taken back.
fn update<T: Real, A: SingleAssociator<T>, const NX: usize, const NZ: usize, const MODES: usize>(
    bank: &mut ModeBank<T, NX, MODES>,
    sensor: &UniformSensor<Position<T, NZ, 2>, T>,
    associator: A,
    detections: &[Detection<T, NZ>],
) -> (T, Vec<T>, u16) {
    let candidates: Vec<u16> = (0..detections.len() as u16).collect();
    let predicted = innovations(bank, &sensor.model);
    let mut evidence = Evidence::<T, DETS>::new();
    evidence.collect(bank, &predicted, sensor, detections, Candidates::new(detections, &candidates));
    let (miss, weights) = evidence.weights();
    let beta_0 = associator.associate(miss, weights);
    let beta = weights.to_vec();
    (beta_0, beta, evidence.absorb(beta_0, bank, &predicted, &sensor.model, detections))
}

/// Finite, and probabilities that sum to one.
fn sound<T: Real, const NX: usize, const MODES: usize>(bank: &ModeBank<T, NX, MODES>) -> TestCaseResult {
    let sum = bank.prob.iter().fold(T::ZERO, |sum, p| sum + *p);
    let bound = T::EPSILON * T::from_count(MODES + 2);
    prop_assert!((sum - T::ONE).abs() <= bound && bank.prob.iter().all(|p| *p >= T::ZERO), "{:?}", bank.prob);
    prop_assert!(bank.is_valid(), "{bank:?}");
    Ok(())
}

/// A track, its modes apart or not, and detections up to 10^`decades` standard deviations off.
#[derive(Clone, Debug)]
struct Case {
    draws: Vec<Vec<f64>>,
    prob: [f64; 4],
    /// Decimal logarithms of the standard deviations of the modes, the distances of detections, the clutter density
    deviations: [f64; 4],
    decades: Vec<f64>,
    clutter: Option<f64>,
    certain: bool,
    explicit: bool,
}

fn cases() -> impl Strategy<Value = Case> {
    let prob = prop::array::uniform4(prop_oneof![Just(0.0), 0.0..1.0f64, (-45.0..0.0f64).prop_map(|d| 10f64.powf(d))]);
    let numbers = (prop::array::uniform4(-2.0..3.0f64), prop::collection::vec(-3.0..6.0f64, 1..8), prop::option::of(-25.0..6.0f64));
    (prop::collection::vec(draws(), 4), prob, numbers, any::<bool>(), any::<bool>()).prop_map(
        |(draws, prob, (deviations, decades, clutter), certain, explicit)| Case {
            draws,
            prob,
            deviations,
            decades,
            clutter,
            certain,
            explicit,
        },
    )
}

impl Case {
    fn bank<T: Real, const NX: usize, const MODES: usize>(&self) -> ModeBank<T, NX, MODES> {
        let sum: f64 = self.prob.iter().take(MODES).sum();
        let prob = std::array::from_fn(|r| if sum > 0.0 { T::lit(self.prob[r] / sum) } else { T::lit(1.0 / MODES as f64) });
        ModeBank { prob, modes: std::array::from_fn(|r| gaussian(&self.draws[r], 10.0, 10f64.powf(self.deviations[r]))) }
    }

    /// Position sensors whose deviation is that of the first mode.
    fn noise<T: Real, const NZ: usize>(&self) -> Symmetric<T, NZ> {
        gaussian::<T, NZ>(&self.draws[1], 0.0, 10f64.powf(self.deviations[0])).cov
    }

    fn detections<T: Real, const NZ: usize>(&self) -> Vec<Detection<T, NZ>> {
        let detection = |(k, decades): (usize, &f64)| {
            let distance = 10f64.powf(decades + self.deviations[0]);
            let plain = Detection::new(std::array::from_fn(|i| T::lit(distance * self.draws[2][NZ * k + i])));
            if self.explicit { plain.with_noise(self.noise()) } else { plain }
        };
        self.decades.iter().enumerate().map(detection).collect()
    }
}

fn survives<T: Real, const NX: usize, const NZ: usize, const MODES: usize>(case: &Case) -> TestCaseResult {
    let gate = Gate::new::<NZ>(T::lit(1e13))?.with_probability(T::ONE)?;
    let p_detect = T::lit(if case.certain { 1.0 } else { 0.9 });
    let clutter = case.clutter.map_or(Clutter::Diffuse, |decades| Clutter::Poisson(T::lit(10f64.powf(decades))));
    let sensor = UniformSensor::new(Position::new(case.noise())?, p_detect, clutter, gate)?;
    let detections = case.detections::<T, NZ>();
    let before = case.bank::<T, NX, MODES>();

    let mut bank = before;
    let (beta_0, beta, _) = update(&mut bank, &sensor, Pda, &detections);
    let sum = beta.iter().fold(beta_0, |sum, b| sum + *b);
    prop_assert!((sum - T::ONE).abs() <= T::EPSILON * T::from_count(beta.len() + 2), "{beta_0} {beta:?}");
    sound(&bank)?;

    let mut bank = before;
    let (beta_0, beta, _) = update(&mut bank, &sensor, NearestNeighbour, &detections);
    let chosen = beta.iter().filter(|b| **b == T::ONE).count();
    prop_assert!(chosen <= 1 && beta.iter().all(|b| *b == T::ZERO || *b == T::ONE), "{beta:?}");
    prop_assert_eq!(beta_0, if chosen == 1 { T::ZERO } else { T::ONE });
    sound(&bank)?;

    for detection in &detections {
        let mut bank = before;
        update_by_one(&mut bank, &sensor.model, &detection.z);
        sound(&bank)?;
    }
    Ok(())
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(2000))]

    #[test]
    fn outliers_leave_a_track_sound(case in cases()) {
        survives::<f32, 2, 1, 1>(&case)?;
        survives::<f32, 4, 2, 2>(&case)?;
        survives::<f32, 6, 3, 4>(&case)?;
        survives::<f64, 4, 2, 2>(&case)?;
        survives::<f64, 6, 3, 4>(&case)?;
    }
}

/// A detection at the track and eleven about a standard deviation beside it, certainly detected, and a second mode so far off
/// that its likelihoods are as small as numbers get. The update of such a mode is worth nothing, but it is not a numeric
/// failure: the second one would delete the track.
fn hopeless<T: Real>(farthest: f64) -> TestCaseResult {
    let gate = Gate::new::<1>(T::lit(1e6))?.with_probability(T::ONE)?;
    let model = Position::<T, 1, 2>::new(Symmetric::from_diagonal([T::ONE]))?;
    let sensor = UniformSensor::new(model, T::ONE, Clutter::Poisson(T::ONE), gate)?;
    let mut detections = vec![Detection::new([T::ZERO])];
    detections.extend([-1.0; 11].map(|z| Detection::new([T::lit(z)])));
    let mode = |x: f64| Gaussian::new(SVector::from([x, 0.0].map(T::lit)), Symmetric::from_diagonal([T::ONE; 2]));
    let mut fading = 0;
    for step in 0..2000 {
        let x = farthest * f64::from(step) / 2000.0;
        let mut bank = ModeBank { prob: [T::lit(0.99), T::lit(0.01)], modes: [mode(0.0), mode(x)] };
        let (_, _, resets) = update(&mut bank, &sensor, Pda, &detections);
        prop_assert_eq!(resets, 0, "a mode at {} with probability {} afterwards", x, bank.prob[1].to_f64());
        sound(&bank)?;
        fading += usize::from(bank.prob[1] > T::ZERO && bank.prob[1].to_f64().ln() < 0.98 * T::LN_FLOOR.to_f64());
    }
    prop_assert!(fading > 0, "no mode came close to the least probability: this test tests nothing");
    Ok(())
}

#[test]
fn a_hopeless_mode_is_no_numeric_failure() -> Result<(), TestCaseError> {
    hopeless::<f32>(25.0)?;
    hopeless::<f64>(60.0)
}

/// The one mode that explains a scan has nearly vanished: its weight in the mixture is no normal number, and the quotients
/// by which it would win are none at all.
fn vanished<T: Real>(least: T) -> TestCaseResult {
    let gate = Gate::new::<1>(T::lit(1e6))?.with_probability(T::ONE)?;
    let model = Position::<T, 1, 2>::new(Symmetric::from_diagonal([T::ONE]))?;
    let sensor = UniformSensor::new(model, T::ONE, Clutter::Poisson(T::ONE), gate)?;
    let detections = [Detection::new([T::ZERO]); 4];
    let mode = |x: f64, p: f64| Gaussian::new(SVector::from([x, 0.0].map(T::lit)), Symmetric::from_diagonal([T::lit(p); 2]));
    let mut vanishing = least;
    for _ in 0..200 {
        // The mode that vanishes is the wider one, so that it opens the gate.
        let mut bank = ModeBank { prob: [T::ONE, vanishing], modes: [mode(80.0, 1.0), mode(0.0, 2.0)] };
        update(&mut bank, &sensor, Pda, &detections);
        sound(&bank)?;
        vanishing *= T::lit(0.5);
    }
    prop_assert_eq!(vanishing, T::ZERO);
    Ok(())
}

#[test]
fn a_vanished_mode_may_be_the_only_one_that_fits() -> Result<(), TestCaseError> {
    vanished::<f32>(f32::MIN_POSITIVE * 1e3)?;
    vanished::<f64>(f64::MIN_POSITIVE * 1e3)
}

/// A scan in which no mode that is possible has a density worth a number, and certain detection: nothing is known, nothing
/// changes.
fn impossible<T: Real>() -> TestCaseResult {
    let gate = Gate::new::<1>(T::lit(1e30))?.with_probability(T::ONE)?;
    let tiny = T::lit(1e-15);
    let model = Position::<T, 1, 2>::new(Symmetric::from_diagonal([tiny]))?;
    let sensor = UniformSensor::new(model, T::ONE, Clutter::Poisson(T::ONE), gate)?;
    let narrow = Gaussian::new(SVector::zeros(), Symmetric::from_diagonal([tiny; 2]));
    let wide = Gaussian::new(SVector::zeros(), Symmetric::from_diagonal([T::ONE; 2]));
    // The wide mode opens the gate but is impossible; the narrow one sees 10³⁰ standard deviations.
    let before = ModeBank { prob: [T::ONE, T::ZERO], modes: [narrow, wide] };
    let mut bank = before;
    let (beta_0, beta, resets) = update(&mut bank, &sensor, Pda, &[Detection::new([T::lit(1e14)])]);
    prop_assert_eq!(beta.len(), 1);
    prop_assert!(bank.is_valid() && resets == 0);
    // In double precision the one detection is the target's, certainly and by 10⁴³ standard deviations; single precision
    // holds no such number.
    prop_assert!((beta_0 == T::ONE && bank == before) || (beta_0 == T::ZERO && bank.prob == before.prob));
    Ok(())
}

#[test]
fn an_impossible_scan_changes_nothing() -> Result<(), TestCaseError> {
    impossible::<f32>()?;
    impossible::<f64>()
}

/// Positions measured a million times better than predicted, at every size a number has room for.
#[test]
fn sizes_do_not_matter() -> Result<(), TestCaseError> {
    for decades in -8..=8 {
        let p = 10f32.powi(decades);
        let model = Position::<f32, 2, 2>::new(Symmetric::from_diagonal([p * 1e-5; 2]))?;
        let mut g = Gaussian::new(SVector::<f32, 4>::zeros(), Symmetric::from_diagonal([p; 4]));
        let innovation = model.innovation(&g);
        prop_assert!(innovation.density.is_proper(), "P = {p}");
        prop_assert!(g.update(&innovation, &SVector::repeat(p.sqrt())), "P = {p}");
        let posterior = g.cov.upper()[0][0] / p;
        // R P / (R + P), to an ε of P.
        prop_assert!((posterior - 1e-5 / (1.0 + 1e-5)).abs() < 2.0 * f32::EPSILON, "P = {p}: {posterior}");
    }
    Ok(())
}
