//! The update of one track by several detections, against its definition: the moment match of a Kalman update by every
//! detection and of none, mode by mode, each hypothesis weighed by its probability. Written out densely with gains and
//! inverses in double precision; for one mode also in the gain form of the textbook (Bar-Shalom, Willett and Tian 2011,
//! equation 3.4.2-10). Detections with times of their own are measured through H (I + δ N) of a state at the scan's time.
//!
//! Probabilities are exponentials of ν' S⁻¹ ν, so that their relative error is that of the exponent; `Bounds` has the sizes.

use crate::support::{draws, gaussian, wide, wide_cov, within};
use crate::{condition, determinant, deviations, mixture};
use boresight::association::{Gate, Pda, SingleAssociator};
use boresight::evidence::{Evidence, innovations, update_by_one};
use boresight::gaussian::Gaussian;
use boresight::mode::ModeBank;
use boresight::model::linear::LinearMeasurement;
use boresight::model::{Layout, MeasurementModel};
use boresight::scalar::Real;
use boresight::scan::{Candidates, Detection};
use boresight::sensor::{Clutter, UniformSensor};
use boresight::symmetric::Symmetric;
use boresight::time::Duration;
use nalgebra::{SMatrix, SVector};
use proptest::prelude::*;
use proptest::test_runner::{TestCaseError, TestCaseResult};
use std::f64::consts::TAU;

/// Room for detections; the tests bring fewer, so that none is dropped.
const DETS: usize = 12;
/// γ
const THRESHOLD: f64 = 16.0;

type Linear<T, const NX: usize, const NZ: usize> = UniformSensor<LinearMeasurement<T, NX, NZ>, T>;

/// A linear sensor of states that are laid out axis by axis, two axes where there is room.
#[derive(Clone, Copy, Debug)]
struct Laid<T, const NX: usize, const NZ: usize>(LinearMeasurement<T, NX, NZ>);

const fn layout(states: usize) -> Layout {
    let axes = if states == 2 { 1 } else { 2 };
    Layout { axes, stride: states / axes }
}

impl<T: Real, const NX: usize, const NZ: usize> MeasurementModel<T, NX, NZ> for Laid<T, NX, NZ> {
    const LAYOUT: Layout = layout(NX);

    fn observe(&self, x: &SVector<T, NX>) -> SVector<T, NZ> {
        self.0.observe(x)
    }
    fn jacobian(&self, x: &SVector<T, NX>) -> SMatrix<T, NZ, NX> {
        self.0.jacobian(x)
    }
    fn noise(&self, x: &SVector<T, NX>) -> Symmetric<T, NZ> {
        self.0.noise(x)
    }
}

/// I + δ N: within an axis every entry grows by the next.
fn moved<const NX: usize>(offset: Duration) -> SMatrix<f64, NX, NX> {
    let stride = layout(NX).stride;
    let mut f = SMatrix::identity();
    for i in (0..NX - 1).filter(|i| (i + 1) % stride != 0) {
        f[(i, i + 1)] = offset.as_secs();
    }
    f
}

/// A track and a scan, as numbers.
#[derive(Clone, Debug)]
struct Case {
    modes: Vec<Vec<f64>>,
    prob: [f64; 3],
    sensor: Vec<f64>,
    p_detect: f64,
    /// ln of the expected number of false detections per unit of volume, or nothing known
    ln_clutter: Option<f64>,
    /// Detections about the first mode's prediction, in standard deviations, and whether each brings its own noise
    detections: Vec<([f64; 3], bool)>,
    order: Vec<usize>,
    /// Microseconds between each detection and its scan, where a test uses them
    offsets: [i64; 8],
}

fn cases() -> impl Strategy<Value = Case> {
    let detection = (prop::array::uniform3(-4.0..4.0f64), any::<bool>());
    let detections = prop::collection::vec(detection, 0..8);
    let track = (prop::collection::vec(draws(), 3), prop::array::uniform3(0.01..1.0f64), draws());
    let offsets = prop::array::uniform8(prop_oneof![Just(0), -1_000_000..1_000_000i64]);
    let environment = (0.05..=1.0f64, prop::option::of(-12.0..0.0f64));
    (track, environment, detections, offsets).prop_flat_map(|((modes, prob, sensor), (p_detect, ln_clutter), detections, offsets)| {
        let order = Just((0..detections.len()).collect::<Vec<_>>()).prop_shuffle();
        order.prop_map(move |order| Case {
            modes: modes.clone(),
            prob,
            sensor: sensor.clone(),
            p_detect,
            ln_clutter,
            detections: detections.clone(),
            order,
            offsets,
        })
    })
}

impl Case {
    /// Modes some standard deviations apart.
    fn bank<T: Real, const NX: usize, const MODES: usize>(&self) -> ModeBank<T, NX, MODES> {
        let sum: f64 = self.prob.iter().take(MODES).sum();
        ModeBank {
            prob: std::array::from_fn(|r| T::lit(self.prob[r] / sum)),
            modes: std::array::from_fn(|r| gaussian(&self.modes[r], 4.0, 3.0)),
        }
    }

    fn model<T: Real, const NX: usize, const NZ: usize>(&self) -> LinearMeasurement<T, NX, NZ> {
        let matrix = SMatrix::from_fn(|i, j| T::lit(if i == j { 1.0 } else { 0.5 * self.sensor[9 * i + j] }));
        LinearMeasurement { matrix, noise: gaussian::<T, NZ>(&self.sensor, 0.0, 2.0).cov }
    }

    fn sensor<T: Real, const NX: usize, const NZ: usize>(&self) -> Result<Linear<T, NX, NZ>, TestCaseError> {
        let clutter = self.ln_clutter.map_or(Clutter::Diffuse, |ln| Clutter::Poisson(T::lit(ln.exp())));
        Ok(UniformSensor::new(self.model(), T::lit(self.p_detect), clutter, Gate::new::<NZ>(T::lit(THRESHOLD))?)?)
    }

    fn scan<T: Real, const NX: usize, const NZ: usize>(&self) -> Vec<Detection<T, NZ>> {
        let model = self.model::<T, NX, NZ>();
        let predicted = model.observe(&gaussian::<T, NX>(&self.modes[0], 4.0, 3.0).mean);
        let detection = |(offset, own_noise): &([f64; 3], bool)| {
            let z: [T; NZ] = std::array::from_fn(|k| predicted[k] + T::lit(4.0 * offset[k]));
            let detection = Detection::new(z);
            let scale = T::lit(1.5 + offset[0].abs());
            if *own_noise { detection.with_noise(Symmetric::from_fn(|i, j| model.noise.upper()[i][j] * scale)) } else { detection }
        };
        self.detections.iter().map(detection).collect()
    }

    /// The same detections, each at its own time.
    fn sectors<T: Real, const NX: usize, const NZ: usize>(&self) -> Vec<Detection<T, NZ>> {
        let offsets = self.offsets.iter().map(|micros| Duration::from_micros(*micros));
        self.scan::<T, NX, NZ>().into_iter().zip(offsets).map(|(d, offset)| d.with_offset(offset)).collect()
    }
}

/// What an update made: which detections were gated, their probabilities, that of none, and the bank.
#[derive(Clone, Debug)]
struct Outcome<T, const NX: usize, const MODES: usize> {
    gated: Vec<u16>,
    beta: Vec<T>,
    beta_0: T,
    bank: ModeBank<T, NX, MODES>,
}

fn update<T: Real, M: MeasurementModel<T, NX, NZ>, const NX: usize, const NZ: usize, const MODES: usize>(
    mut bank: ModeBank<T, NX, MODES>,
    sensor: &UniformSensor<M, T>,
    detections: &[Detection<T, NZ>],
) -> Result<Outcome<T, NX, MODES>, TestCaseError> {
    let candidates: Vec<u16> = (0..detections.len() as u16).collect();
    let predicted = innovations(&bank, &sensor.model);
    let mut evidence = Evidence::<T, DETS>::new();
    evidence.collect(&bank, &predicted, sensor, detections, Candidates::new(detections, &candidates));
    let gated = evidence.gated().to_vec();
    let (miss, weights) = evidence.weights();
    let beta_0 = Pda.associate(miss, weights);
    let beta = weights.to_vec();
    let resets = evidence.absorb(beta_0, &mut bank, &predicted, &sensor.model, detections);
    prop_assert_eq!((resets, bank.is_valid()), (0, true));
    Ok(Outcome { gated, beta, beta_0, bank })
}

/// The same with the update by PDA in one pass.
fn update_at_once<T: Real, M: MeasurementModel<T, NX, NZ>, const NX: usize, const NZ: usize, const MODES: usize>(
    mut bank: ModeBank<T, NX, MODES>,
    sensor: &UniformSensor<M, T>,
    detections: &[Detection<T, NZ>],
) -> Result<Outcome<T, NX, MODES>, TestCaseError> {
    let step_by_step = update(bank, sensor, detections)?;
    let candidates: Vec<u16> = (0..detections.len() as u16).collect();
    let predicted = innovations(&bank, &sensor.model);
    let mut evidence = Evidence::<T, DETS>::new();
    evidence.gate(&bank, &predicted, sensor, detections, Candidates::new(detections, &candidates));
    let found = evidence.pda(&mut bank, &predicted, sensor, detections, T::ONE);
    prop_assert_eq!((found.resets, bank.is_valid()), (0, true));
    Ok(Outcome { beta_0: found.miss / (found.miss + found.hits), bank, ..step_by_step })
}

/// The same by the definition, in double precision.
struct Truth<const NX: usize, const MODES: usize> {
    beta: Vec<f64>,
    beta_0: f64,
    prob: [f64; MODES],
    modes: [(SVector<f64, NX>, SMatrix<f64, NX, NX>); MODES],
    /// The relative error of a likelihood per ε: its exponent's
    exponents: f64,
    condition: f64,
}

fn by_definition<T: Real, const NX: usize, const NZ: usize, const MODES: usize>(
    bank: &ModeBank<T, NX, MODES>,
    case: &Case,
    detections: &[Detection<T, NZ>],
    gated: &[u16],
) -> Result<Truth<NX, MODES>, TestCaseError> {
    let model = case.model::<T, NX, NZ>();
    let h = wide(&model.matrix);
    let inverse = |m: &SMatrix<f64, NZ, NZ>| m.try_inverse().ok_or_else(|| TestCaseError::fail("singular"));
    let noise = |d: &Detection<T, NZ>| wide_cov(d.noise.as_ref().unwrap_or(&model.noise));
    let seen = |d: &Detection<T, NZ>| h * moved::<NX>(d.offset);
    let spread = |r: usize, h: SMatrix<f64, NZ, NX>| h * wide_cov(&bank.modes[r].cov) * h.transpose();
    let residual = |r: usize, d: &Detection<T, NZ>| wide(&d.z) - seen(d) * wide(&bank.modes[r].mean);

    // The gate: by the mode whose S, with the sensor's noise, has the largest determinant.
    let volume = |r: usize| determinant(&(spread(r, h) + wide_cov(&model.noise)));
    let widest = (0..MODES).max_by(|a, b| volume(*a).total_cmp(&volume(*b))).unwrap_or(0);
    let (mut exponents, mut worst) = (0f64, 1f64);
    for (number, d) in detections.iter().enumerate() {
        let s = spread(widest, seen(d)) + noise(d);
        let nis = residual(widest, d).dot(&(inverse(&s)? * residual(widest, d)));
        // Within the rounding of the form either answer is right.
        prop_assume!((nis - THRESHOLD).abs() > 32.0 * T::EPSILON.to_f64() * THRESHOLD * condition(&s));
        prop_assert_eq!(gated.contains(&(number as u16)), nis < THRESHOLD, "ν' S⁻¹ ν = {}", nis);
    }
    let unit_ball = [2.0, std::f64::consts::PI, 4.0 / 3.0 * std::f64::consts::PI][NZ - 1];
    let gate_volume = unit_ball * THRESHOLD.powf(NZ as f64 / 2.0) * volume(widest).sqrt();
    let density = case.ln_clutter.map_or(gated.len() as f64 / gate_volume, |ln| T::lit(ln.exp()).to_f64());
    // The library's own P_G: what it is worth is tested where it is computed.
    let p_gate = Gate::<f64>::new::<NZ>(THRESHOLD)?.p_gate();

    // Every mode by every hypothesis: its weight, and the Kalman update.
    let p_detect = T::lit(case.p_detect).to_f64();
    let mut total = 1.0 - p_detect * p_gate;
    let mut beta = vec![0.0; gated.len()];
    let mut hypotheses: [Vec<_>; MODES] = std::array::from_fn(|r| {
        vec![((1.0 - p_detect * p_gate) * bank.prob[r].to_f64(), wide(&bank.modes[r].mean), wide_cov(&bank.modes[r].cov))]
    });
    for (slot, number) in gated.iter().enumerate() {
        let d = &detections[usize::from(*number)];
        for r in 0..MODES {
            let (s, nu, p) = (spread(r, seen(d)) + noise(d), residual(r, d), wide_cov(&bank.modes[r].cov));
            let s_inv = inverse(&s)?;
            let nis = nu.dot(&(s_inv * nu));
            let ln_norm = -0.5 * (NZ as f64 * TAU.ln() + determinant(&s).ln());
            exponents = exponents.max(nis + ln_norm.abs());
            worst = worst.max(condition(&s));
            let weight = bank.prob[r].to_f64() * p_detect / density * (ln_norm - 0.5 * nis).exp();
            total += weight;
            beta[slot] += weight;
            let gain = p * seen(d).transpose() * s_inv;
            hypotheses[r].push((weight, wide(&bank.modes[r].mean) + gain * nu, p - gain * s * gain.transpose()));
        }
    }
    Ok(Truth {
        beta: beta.into_iter().map(|b| b / total).collect(),
        beta_0: (1.0 - p_detect * p_gate) / total,
        prob: std::array::from_fn(|r| hypotheses[r].iter().map(|h| h.0).sum::<f64>() / total),
        modes: hypotheses.map(|h| mixture(&h)),
        exponents,
        condition: worst,
    })
}

/// How far two evaluations of one update may be apart.
struct Bounds<const NX: usize> {
    probability: f64,
    mean: SVector<f64, NX>,
    cov: SMatrix<f64, NX, NX>,
}

impl<const NX: usize> Bounds<NX> {
    /// S is a sum of some 2 NX products and magnified by its condition; the weights move by the error of their exponents,
    /// and with them mean and covariance by the distance, and its square, of the hypotheses: √(ν' S⁻¹ ν) standard
    /// deviations of the prior at most.
    fn new<T: Real>(exponents: f64, condition: f64, prior: &Gaussian<T, NX>, detections: usize) -> Self {
        let relative = T::EPSILON.to_f64() * 4.0 * (2 * NX + detections + 4) as f64 * condition;
        let probability = relative * (4.0 + exponents);
        let sigma = deviations(&wide_cov(&prior.cov));
        let coordinates = wide(&prior.mean).abs() * (4.0 * T::EPSILON.to_f64());
        Self {
            probability,
            mean: sigma * (probability * exponents.max(1.0).sqrt()) + coordinates,
            cov: sigma * sigma.transpose() * (probability * exponents.max(1.0)),
        }
    }
}

fn is_the_definition<const NX: usize, const NZ: usize, const MODES: usize>(case: &Case) -> TestCaseResult {
    let (bank, detections) = (case.bank::<f64, NX, MODES>(), case.scan::<f64, NX, NZ>());
    let sensor = case.sensor::<f64, NX, NZ>()?;
    agree(case, &bank, &detections, &update(bank, &sensor, &detections)?)?;
    agree(case, &bank, &detections, &update_at_once(bank, &sensor, &detections)?)
}

/// Detections at times of their own; in single precision as well, for they have a correction of their own.
fn is_the_definition_in_sectors<T: Real, const NX: usize, const NZ: usize, const MODES: usize>(case: &Case) -> TestCaseResult {
    let (bank, detections) = (case.bank::<T, NX, MODES>(), case.sectors::<T, NX, NZ>());
    let sensor = case.sensor::<T, NX, NZ>()?;
    let sensor = sensor.with_model(Laid(sensor.model));
    agree(case, &bank, &detections, &update(bank, &sensor, &detections)?)?;
    agree(case, &bank, &detections, &update_at_once(bank, &sensor, &detections)?)
}

/// An update and the definition.
fn agree<T: Real, const NX: usize, const NZ: usize, const MODES: usize>(
    case: &Case,
    bank: &ModeBank<T, NX, MODES>,
    detections: &[Detection<T, NZ>],
    got: &Outcome<T, NX, MODES>,
) -> TestCaseResult {
    let truth = by_definition(bank, case, detections, &got.gated)?;
    if got.gated.is_empty() {
        prop_assert_eq!(&got.bank, bank);
        return Ok(());
    }
    for r in 0..MODES {
        let bounds = Bounds::new(truth.exponents, truth.condition, &bank.modes[r], got.gated.len());
        for (got, want) in got.beta.iter().chain([&got.beta_0]).zip(truth.beta.iter().chain([&truth.beta_0])) {
            prop_assert!((got.to_f64() - want).abs() <= bounds.probability, "β {got} for {want}");
        }
        let (p, want) = (got.bank.prob[r].to_f64(), truth.prob[r]);
        prop_assert!((p - want).abs() <= bounds.probability, "μ_{r} {p} for {want}");
        within("mean", &wide(&got.bank.modes[r].mean), &truth.modes[r].0, &bounds.mean)?;
        within("covariance", &wide_cov(&got.bank.modes[r].cov), &truth.modes[r].1, &bounds.cov)?;
    }
    Ok(())
}

/// One mode, one noise: x + K Σ β ν,  P − (1 − β₀) K S K' + K (Σ β ν ν' − ν̄ ν̄') K'.
fn is_the_textbook<const NX: usize, const NZ: usize>(case: &Case) -> TestCaseResult {
    let bank = case.bank::<f64, NX, 1>();
    let mut detections = case.scan::<f64, NX, NZ>();
    detections.iter_mut().for_each(|d| d.noise = None);
    let got = update(bank, &case.sensor::<f64, NX, NZ>()?, &detections)?;
    let truth = by_definition(&bank, case, &detections, &got.gated)?;
    let (h, p) = (wide(&case.model::<f64, NX, NZ>().matrix), wide_cov(&bank.modes[0].cov));
    let s = h * p * h.transpose() + wide_cov(&case.model::<f64, NX, NZ>().noise);
    let gain = p * h.transpose() * s.try_inverse().ok_or_else(|| TestCaseError::fail("singular"))?;
    let nu = |number: &u16| detections[usize::from(*number)].z - h * bank.modes[0].mean;
    let combined: SVector<f64, NZ> = got.gated.iter().zip(&truth.beta).map(|(n, beta)| nu(n) * *beta).sum();
    let spread: SMatrix<f64, NZ, NZ> = got.gated.iter().zip(&truth.beta).map(|(n, beta)| nu(n) * nu(n).transpose() * *beta).sum();
    let cov = p - gain * (s * (1.0 - truth.beta_0) - spread + combined * combined.transpose()) * gain.transpose();
    let bounds = Bounds::new(truth.exponents, condition(&s), &bank.modes[0], got.gated.len());
    within("mean", &got.bank.modes[0].mean, &(bank.modes[0].mean + gain * combined), &bounds.mean)?;
    within("covariance", &wide_cov(&got.bank.modes[0].cov), &cov, &bounds.cov)
}

/// Two runs of the library on what is one problem, in units that differ by `ln_units`.
fn same<T: Real, const NX: usize, const NZ: usize, const MODES: usize>(
    case: &Case,
    bank: &ModeBank<T, NX, MODES>,
    [a, b]: [&Outcome<T, NX, MODES>; 2],
    ln_units: f64,
) -> TestCaseResult {
    let detections = case.scan::<T, NX, NZ>();
    let truth = by_definition(bank, case, &detections, &a.gated)?;
    for r in 0..MODES {
        let bounds = Bounds::new(truth.exponents + ln_units, truth.condition, &bank.modes[r], detections.len());
        prop_assert!((a.beta_0 - b.beta_0).abs().to_f64() <= bounds.probability, "β₀ {} and {}", a.beta_0, b.beta_0);
        prop_assert!((a.bank.prob[r] - b.bank.prob[r]).abs().to_f64() <= bounds.probability);
        within("mean", &wide(&a.bank.modes[r].mean), &wide(&b.bank.modes[r].mean), &bounds.mean)?;
        within("covariance", &wide_cov(&a.bank.modes[r].cov), &wide_cov(&b.bank.modes[r].cov), &bounds.cov)?;
    }
    Ok(())
}

/// Probabilities are such; the order of detections does not matter; what is outside the gate does not exist.
fn invariances<T: Real, const NX: usize, const NZ: usize, const MODES: usize>(case: &Case) -> TestCaseResult {
    let (bank, sensor, detections) = (case.bank::<T, NX, MODES>(), case.sensor::<T, NX, NZ>()?, case.scan::<T, NX, NZ>());
    let got = update(bank, &sensor, &detections)?;
    // A sum of so many terms, each and the divisor rounded.
    let bound = T::EPSILON * T::from_count(got.beta.len() + MODES + 2);
    let sum = got.beta.iter().fold(got.beta_0, |sum, beta| sum + *beta);
    prop_assert!((sum - T::ONE).abs() <= bound && got.beta.iter().all(|b| *b >= T::ZERO), "{:?}", got.beta);
    let sum = got.bank.prob.iter().fold(T::ZERO, |sum, p| sum + *p);
    prop_assert!((sum - T::ONE).abs() <= bound, "{:?}", got.bank.prob);

    let shuffled: Vec<_> = case.order.iter().map(|i| detections[*i]).collect();
    let other = update(bank, &sensor, &shuffled)?;
    let back: Vec<u16> = other.gated.iter().map(|n| case.order[usize::from(*n)] as u16).collect();
    let truth = by_definition(&bank, case, &detections, &got.gated)?;
    let bounds = Bounds::new(truth.exponents, truth.condition, &bank.modes[0], detections.len());
    prop_assert_eq!(back.len(), got.gated.len());
    for (number, beta) in back.iter().zip(&other.beta) {
        let slot = got.gated.iter().position(|n| n == number).ok_or_else(|| TestCaseError::fail("gated only when shuffled"))?;
        prop_assert!((got.beta[slot] - *beta).abs().to_f64() <= bounds.probability);
    }
    same::<T, NX, NZ, MODES>(case, &bank, [&got, &other], 0.0)?;

    // Far detections at the head, in the middle and at the end.
    let mut crowded = detections.clone();
    for (place, factor) in [(0, 1e3), (crowded.len() / 2 + 1, -1e4), (crowded.len() + 2, 1e6)] {
        crowded.insert(place, Detection::new([T::lit(factor); NZ]));
    }
    let crowded = update(bank, &sensor, &crowded)?;
    prop_assert_eq!((crowded.beta, crowded.beta_0, crowded.bank), (got.beta, got.beta_0, got.bank));
    Ok(())
}

/// The sensor's noise brought by the detections, and other units: millimetres here, leagues there.
fn equivalences<T: Real, const NX: usize, const NZ: usize, const MODES: usize>(case: &Case, decades: &[f64; 3]) -> TestCaseResult {
    let plain = Case { detections: case.detections.iter().map(|d| (d.0, false)).collect(), ..case.clone() };
    let (bank, sensor, detections) = (plain.bank::<T, NX, MODES>(), plain.sensor::<T, NX, NZ>()?, plain.scan::<T, NX, NZ>());
    let got = update(bank, &sensor, &detections)?;
    let explicit: Vec<_> = detections.iter().map(|d| d.with_noise(sensor.model.noise)).collect();
    let other = update(bank, &sensor, &explicit)?;
    prop_assert_eq!(&other.gated, &got.gated);
    same::<T, NX, NZ, MODES>(&plain, &bank, [&got, &other], 0.0)?;

    let unit: [T; NZ] = std::array::from_fn(|k| T::lit(10f64.powf(decades[k])));
    let volume = unit.iter().fold(T::ONE, |v, u| v * *u);
    let model = LinearMeasurement {
        matrix: SMatrix::<T, NZ, NX>::from_fn(|i, j| sensor.model.matrix[(i, j)] * unit[i]),
        noise: Symmetric::from_fn(|i, j| sensor.model.noise.upper()[i][j] * unit[i] * unit[j]),
    };
    let clutter = plain.ln_clutter.map_or(Clutter::Diffuse, |ln| Clutter::Poisson(T::lit(ln.exp()) / volume));
    let scaled = UniformSensor::new(model, T::lit(case.p_detect), clutter, Gate::new::<NZ>(T::lit(THRESHOLD))?)?;
    let rescaled: Vec<_> = detections.iter().map(|d| Detection::new(std::array::from_fn(|k| d.z[k] * unit[k]))).collect();
    let other = update(bank, &scaled, &rescaled)?;
    prop_assert_eq!(&other.gated, &got.gated);
    // The logarithm of √det S is in other units too.
    same::<T, NX, NZ, MODES>(&plain, &bank, [&got, &other], volume.to_f64().ln().abs())
}

/// One measurement that is certainly the target's: every mode takes its Kalman update, μ_r ∝ c_r N(ν_r; 0, S_r).
fn certain<const NX: usize, const NZ: usize, const MODES: usize>(case: &Case) -> TestCaseResult {
    let before = case.bank::<f64, NX, MODES>();
    let model = case.model::<f64, NX, NZ>();
    let z = model.observe(&before.modes[0].mean) + SVector::from_fn(|k, _| 4.0 * case.prob[k]);
    let mut bank = before;
    prop_assert_eq!(update_by_one(&mut bank, &model, &z), 0);

    let (mut weights, mut exponents, mut worst) = ([0.0; MODES], 0f64, 1f64);
    for (r, g) in before.modes.iter().enumerate() {
        let s = model.matrix * wide_cov(&g.cov) * model.matrix.transpose() + wide_cov(&model.noise);
        let nu = z - model.matrix * g.mean;
        let nis = nu.dot(&(s.try_inverse().ok_or_else(|| TestCaseError::fail("singular"))? * nu));
        let ln_norm = -0.5 * (NZ as f64 * TAU.ln() + determinant(&s).ln());
        weights[r] = before.prob[r] * (ln_norm - 0.5 * nis).exp();
        (exponents, worst) = (exponents.max(nis + ln_norm.abs()), worst.max(condition(&s)));
    }
    let total: f64 = weights.iter().sum();
    for r in 0..MODES {
        let bounds = Bounds::new(exponents, worst, &before.modes[r], 1);
        prop_assert!((bank.prob[r] - weights[r] / total).abs() <= bounds.probability, "μ_{r} {} for {}", bank.prob[r], weights[r] / total);
        let (mut kalman, innovation) = (before.modes[r], model.innovation(&before.modes[r]));
        prop_assert!(kalman.update(&innovation, &(z - innovation.z_hat)));
        within("mean", &bank.modes[r].mean, &kalman.mean, &bounds.mean)?;
        within("covariance", &wide_cov(&bank.modes[r].cov), &wide_cov(&kalman.cov), &bounds.cov)?;
    }
    Ok(())
}

proptest! {
    #[test]
    fn updates_are_mixtures_of_kalman_updates(case in cases()) {
        is_the_definition::<4, 2, 1>(&case)?;
        is_the_definition::<4, 2, 2>(&case)?;
        is_the_definition::<6, 3, 3>(&case)?;
        is_the_definition::<2, 1, 3>(&case)?;
    }

    #[test]
    fn so_they_are_where_detections_have_times_of_their_own(case in cases()) {
        is_the_definition_in_sectors::<f64, 4, 2, 1>(&case)?;
        is_the_definition_in_sectors::<f64, 4, 2, 2>(&case)?;
        is_the_definition_in_sectors::<f64, 6, 3, 3>(&case)?;
        is_the_definition_in_sectors::<f64, 2, 1, 3>(&case)?;
        is_the_definition_in_sectors::<f32, 4, 2, 2>(&case)?;
        is_the_definition_in_sectors::<f32, 6, 3, 3>(&case)?;
    }

    #[test]
    fn one_mode_is_the_textbook_filter(case in cases()) {
        is_the_textbook::<2, 1>(&case)?;
        is_the_textbook::<4, 2>(&case)?;
        is_the_textbook::<6, 3>(&case)?;
    }

    #[test]
    fn probabilities_add_up_whatever_the_order_and_the_neighbourhood(case in cases()) {
        invariances::<f32, 4, 2, 2>(&case)?;
        invariances::<f32, 6, 3, 3>(&case)?;
        invariances::<f64, 4, 2, 2>(&case)?;
        invariances::<f64, 2, 1, 3>(&case)?;
    }

    #[test]
    fn neither_explicit_noise_nor_units_change_anything(case in cases(), decades in prop::array::uniform3(-3.0..3.0f64)) {
        equivalences::<f32, 4, 2, 2>(&case, &decades)?;
        equivalences::<f32, 6, 3, 3>(&case, &decades)?;
        equivalences::<f64, 4, 2, 2>(&case, &decades)?;
        equivalences::<f64, 2, 1, 3>(&case, &decades)?;
    }

    #[test]
    fn a_certain_measurement_is_the_plain_update(case in cases()) {
        certain::<4, 2, 2>(&case)?;
        certain::<6, 3, 3>(&case)?;
    }
}
