//! How accurate a measurement the subtractive update P − G E G' can take in single precision.
//!
//! ```text
//! R = ratio · diag(H P H')        what is measured before, against the noise it is measured with
//! |P⁺ − exact| ≤ 12 ε (|P| + |G| B |G|'),   B_kl = per |S^kl| per |S| / det² S      S^kl: S without row k and column l
//! ```
//!
//! The update takes nearly all of P away and leaves something of the size of R, with an absolute error of some ε P. So it is
//! definite while R stays well above ε P, and how far depends on what magnifies ε: measured axes that are correlated, as S⁻¹
//! is formed by minors that cancel, and directions of H in which the terms of H P H' cancel. The bound is of rounding alone:
//! permanents (determinants with all signs positive) stand for what the minors were before they cancelled. Of the 12, 7 are the
//! roundings of S, its minors and its determinant, 4 those of G E G' and of the difference; a rounding is half an ε.
//!
//! The priors are random: of mild correlations, chains along every axis as tracks have them (up to 0.999 between position and
//! velocity), and nearly singular in any direction, with units over three decades. Twenty updates follow one another without
//! any prediction between. Definite means that Cholesky's factors exist in double precision, of the single-precision result
//! exactly as it is: their own errors are eight orders below those that are tested here.

use boresight::association::Gate;
use boresight::evidence::{Evidence, innovations};
use boresight::gaussian::{Correction, Gaussian, Innovation};
use boresight::mode::ModeBank;
use boresight::model::MeasurementModel;
use boresight::model::linear::LinearMeasurement;
use boresight::scan::{Candidates, Detection};
use boresight::sensor::{Clutter, UniformSensor};
use boresight::symmetric::Symmetric;
use nalgebra::{DMatrix, SMatrix, SVector};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

const SEED: u64 = 20_261;
/// Priors of every shape and kind.
const PRIORS: usize = 150;
/// Updates in a row.
const UPDATES: usize = 20;
/// The largest correlation of a prior.
const MOST_CORRELATED: f64 = 0.9991;

/// How a prior is correlated.
#[derive(Clone, Copy, Debug)]
enum Prior {
    Mild,
    Chains,
    NearlySingular,
}

const KINDS: [Prior; 3] = [Prior::Mild, Prior::Chains, Prior::NearlySingular];

/// What of a state is measured: `Positions` at every third, second, … state, or random `Mixtures` of all.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Seen {
    Positions { stride: usize },
    Mixtures,
}

fn wide<const R: usize, const C: usize>(m: &SMatrix<f32, R, C>) -> SMatrix<f64, R, C> {
    m.map(f64::from)
}

fn wide_cov<const N: usize>(s: &Symmetric<f32, N>) -> SMatrix<f64, N, N> {
    wide(&s.to_matrix())
}

fn correlations<const N: usize>(rng: &mut ChaCha8Rng, kind: Prior) -> SMatrix<f64, N, N> {
    let mut u = || rng.random_range(-1.0..1.0f64);
    match kind {
        Prior::Mild => {
            let a = SMatrix::<f64, N, N>::from_fn(|_, _| u());
            a * a.transpose() + SMatrix::identity() * 0.25
        }
        Prior::Chains => {
            let stride = if N == 9 { 3 } else { 2 };
            let (along, between) = (1.0 - 10f64.powf(-0.5 - 2.5 * u().abs()), u() * 0.5);
            let power = |base: f64, i: usize, j: usize| base.powi(i.abs_diff(j) as i32);
            SMatrix::from_fn(|i, j| power(along, i % stride, j % stride) * power(between, i / stride, j / stride))
        }
        Prior::NearlySingular => {
            let a = SMatrix::<f64, N, N>::from_fn(|_, j| u() * 10f64.powf(-0.25 * j as f64));
            let (p, ridge) = (a * a.transpose(), 10f64.powf(-3.0 * u().abs()));
            p + SMatrix::from_diagonal(&(p.diagonal() * ridge))
        }
    }
}

/// A density that single precision holds, in units from 0.03 to 30.
fn prior<const N: usize>(rng: &mut ChaCha8Rng, kind: Prior) -> Gaussian<f32, N> {
    loop {
        let c = correlations::<N>(rng, kind);
        let units: [f64; N] = std::array::from_fn(|_| 10f64.powf(rng.random_range(-1.5..1.5)));
        let c = DMatrix::from_fn(N, N, |i, j| c[(i, j)] / (c[(i, i)] * c[(j, j)]).sqrt());
        let cov = Symmetric::from_fn(|i, j| (c[(i, j)] * units[i] * units[j]) as f32);
        let correlated = (0..N).any(|i| (0..i).any(|j| c[(i, j)].abs() > MOST_CORRELATED));
        // A hundred roundings from being singular as it stands.
        if !correlated && c.symmetric_eigenvalues().min() > 1e-5 {
            return Gaussian::new(SVector::zeros(), cov);
        }
    }
}

/// The sensor of `seen` whose noise is `ratio` times what it predicts of `g`.
fn sensor<const N: usize, const NZ: usize>(
    rng: &mut ChaCha8Rng,
    seen: Seen,
    g: &Gaussian<f32, N>,
    ratio: f64,
) -> LinearMeasurement<f32, N, NZ> {
    let p = wide_cov(&g.cov);
    let matrix = SMatrix::<f32, NZ, N>::from_fn(|k, i| match seen {
        Seen::Positions { stride } => f32::from(u8::from(i == k * stride)),
        Seen::Mixtures => (rng.random_range(-1.0..1.0) / p[(i, i)].sqrt()) as f32,
    });
    let spread = wide(&matrix) * p * wide(&matrix).transpose();
    LinearMeasurement { matrix, noise: Symmetric::from_diagonal(std::array::from_fn(|k| (spread[(k, k)] * ratio) as f32)) }
}

fn is_definite<const N: usize>(g: &Gaussian<f32, N>) -> bool {
    DMatrix::from_iterator(N, N, wide_cov(&g.cov).iter().copied()).cholesky().is_some()
}

/// Whether every prior stays definite through all updates with R = `ratio` · diag(H P H') of the first.
fn stay_definite<const N: usize, const NZ: usize>(
    seen: Seen,
    ratio: f64,
    mut update: impl FnMut(&mut ChaCha8Rng, &mut Gaussian<f32, N>, &LinearMeasurement<f32, N, NZ>) -> bool,
) {
    let mut rng = ChaCha8Rng::seed_from_u64(SEED);
    for kind in KINDS {
        for number in 0..PRIORS {
            let mut g = prior::<N>(&mut rng, kind);
            let sensor = sensor::<N, NZ>(&mut rng, seen, &g, ratio);
            for k in 0..UPDATES {
                let taken = update(&mut rng, &mut g, &sensor);
                assert!(
                    taken && is_definite(&g),
                    "{N} states, {NZ} of {seen:?}, R = {ratio:e} P: {kind:?} {number}, update {k}, taken {taken}"
                );
            }
        }
    }
}

fn subtractive<const N: usize, const NZ: usize>(
    _: &mut ChaCha8Rng,
    g: &mut Gaussian<f32, N>,
    sensor: &LinearMeasurement<f32, N, NZ>,
) -> bool {
    g.update(&sensor.innovation(g), &SVector::zeros())
}

fn joseph<const N: usize, const NZ: usize>(_: &mut ChaCha8Rng, g: &mut Gaussian<f32, N>, sensor: &LinearMeasurement<f32, N, NZ>) -> bool {
    g.update_joseph(&sensor.innovation(g), &sensor.matrix, &sensor.noise, &SVector::zeros())
}

/// Four detections of the target within two standard deviations, of random probabilities, no detection one of them.
fn associated<const N: usize, const NZ: usize>(
    rng: &mut ChaCha8Rng,
    g: &mut Gaussian<f32, N>,
    sensor: &LinearMeasurement<f32, N, NZ>,
) -> bool {
    let Innovation { cross, density, .. } = sensor.innovation(g);
    let mut weights: [f32; 5] = std::array::from_fn(|_| rng.random_range(0.0..1.0));
    let sum: f32 = weights.iter().sum();
    weights.iter_mut().for_each(|w| *w /= sum);
    let (mut w, mut e) = (SVector::<f32, NZ>::zeros(), SMatrix::<f32, NZ, NZ>::zeros());
    for p in &weights[1..] {
        let nu: [f32; NZ] = std::array::from_fn(|k| rng.random_range(-2.0..2.0) / density.s_inv.upper()[k][k].sqrt());
        let u = SVector::from(density.s_inv.times(&nu));
        w += u * *p;
        e += density.s_inv.to_matrix() * *p - u * u.transpose() * *p;
    }
    g.correct(&cross, &Correction { w: w.data.0[0], e: Symmetric::from_matrix(&(e + w * w.transpose())) })
}

/// The update of a tracker: four detections about the target, every other with a noise of its own, associated by PDA.
fn tracked<const N: usize, const NZ: usize>(
    rng: &mut ChaCha8Rng,
    g: &mut Gaussian<f32, N>,
    sensor: &LinearMeasurement<f32, N, NZ>,
) -> bool {
    let (Ok(gate), mut bank) = (Gate::new::<NZ>(25.0), ModeBank::new([1.0], *g)) else { return false };
    let Ok(sensor) = UniformSensor::new(*sensor, 0.9, Clutter::Diffuse, gate) else { return false };
    let predicted = innovations(&bank, &sensor.model);
    let s_inv = predicted[0].density.s_inv;
    let detections: [Detection<f32, NZ>; 4] = std::array::from_fn(|number| {
        let z = std::array::from_fn(|k| predicted[0].z_hat[k] + rng.random_range(-1.0..1.0) / s_inv.upper()[k][k].sqrt());
        if number % 2 == 0 { Detection::new(z) } else { Detection::new(z).with_noise(sensor.model.noise) }
    });
    let mut evidence = Evidence::<f32, 4>::new();
    evidence.gate(&bank, &predicted, &sensor, &detections, Candidates::new(&detections, &[0, 1, 2, 3]));
    let found = evidence.pda(&mut bank, &predicted, &sensor, &detections, 1.0);
    *g = bank.modes[0];
    found.resets == 0
}

#[test]
fn trackers_stay_definite_down_to_a_millionth_of_the_prediction() {
    for ratio in [1.0, 1e-2, 1e-3, 1e-4, 1e-5, 1e-6] {
        stay_definite::<4, 2>(Seen::Positions { stride: 2 }, ratio, tracked);
        stay_definite::<6, 2>(Seen::Positions { stride: 3 }, ratio, tracked);
        stay_definite::<6, 3>(Seen::Positions { stride: 2 }, ratio, tracked);
        stay_definite::<9, 3>(Seen::Positions { stride: 3 }, ratio, tracked);
    }
}

#[test]
fn subtractive_updates_stay_definite_down_to_a_thousandth_of_the_prediction() {
    for ratio in [1.0, 1e-1, 1e-2, 1e-3] {
        stay_definite::<4, 1>(Seen::Positions { stride: 2 }, ratio, subtractive);
        stay_definite::<4, 2>(Seen::Positions { stride: 2 }, ratio, subtractive);
        stay_definite::<6, 2>(Seen::Positions { stride: 3 }, ratio, subtractive);
        stay_definite::<6, 3>(Seen::Positions { stride: 2 }, ratio, subtractive);
        stay_definite::<9, 3>(Seen::Positions { stride: 3 }, ratio, subtractive);
        stay_definite::<4, 2>(Seen::Mixtures, ratio, subtractive);
        stay_definite::<6, 2>(Seen::Mixtures, ratio, subtractive);
        stay_definite::<9, 4>(Seen::Mixtures, ratio, subtractive);
    }
}

#[test]
fn one_position_may_be_a_millionth_of_its_prediction() {
    stay_definite::<4, 1>(Seen::Positions { stride: 2 }, 1e-6, subtractive);
    stay_definite::<6, 1>(Seen::Positions { stride: 3 }, 1e-6, subtractive);
    stay_definite::<9, 1>(Seen::Positions { stride: 3 }, 1e-6, subtractive);
}

#[test]
fn association_updates_stay_definite_down_to_a_thousandth_of_the_prediction() {
    for ratio in [1.0, 1e-1, 1e-2, 1e-3] {
        stay_definite::<4, 2>(Seen::Positions { stride: 2 }, ratio, associated);
        stay_definite::<9, 3>(Seen::Positions { stride: 3 }, ratio, associated);
        stay_definite::<9, 4>(Seen::Mixtures, ratio, associated);
    }
}

#[test]
fn the_form_of_joseph_takes_positions_of_a_millionth_of_their_prediction() {
    for ratio in [1e-3, 1e-6] {
        stay_definite::<4, 2>(Seen::Positions { stride: 2 }, ratio, joseph);
        stay_definite::<6, 3>(Seen::Positions { stride: 2 }, ratio, joseph);
        stay_definite::<9, 3>(Seen::Positions { stride: 3 }, ratio, joseph);
    }
}

/// The determinant with every sign positive, of the absolute values of `s`.
fn permanent(s: &DMatrix<f64>) -> f64 {
    if s.is_empty() { 1.0 } else { (0..s.ncols()).map(|l| s[(0, l)].abs() * permanent(&s.clone().remove_row(0).remove_column(l))).sum() }
}

fn is_exact_but_for_rounding<const N: usize, const NZ: usize>(stride: usize, ratio: f64) {
    let mut rng = ChaCha8Rng::seed_from_u64(SEED);
    for kind in KINDS {
        for number in 0..PRIORS {
            let mut g = prior::<N>(&mut rng, kind);
            let sensor = sensor::<N, NZ>(&mut rng, Seen::Positions { stride }, &g, ratio);
            let (p, h) = (wide_cov(&g.cov), wide(&sensor.matrix));
            let cross = p * h.transpose();
            let s = h * cross + wide_cov(&sensor.noise);
            let s = DMatrix::from_iterator(NZ, NZ, s.iter().copied());
            let (s_inv, det) = (s.clone().try_inverse().unwrap_or_default(), s.determinant());
            let minors = DMatrix::from_fn(NZ, NZ, |k, l| permanent(&s.clone().remove_row(k).remove_column(l)));
            let magnified = minors * (permanent(&s) / (det * det));
            assert!(g.update(&sensor.innovation(&g), &SVector::zeros()));
            let got = wide_cov(&g.cov);
            for i in 0..N {
                for j in 0..N {
                    let (a, b) = (cross.row(i), cross.row(j));
                    let sum = |m: &DMatrix<f64>, size: fn(f64) -> f64| -> f64 {
                        (0..NZ).map(|k| (0..NZ).map(|l| size(a[k]) * m[(k, l)] * size(b[l])).sum::<f64>()).sum()
                    };
                    let want = p[(i, j)] - sum(&s_inv, |v| v);
                    let bound = 12.0 * f64::from(f32::EPSILON) * (p[(i, j)].abs() + sum(&magnified, f64::abs));
                    let off = (got[(i, j)] - want).abs();
                    assert!(
                        off <= bound,
                        "{N} states, {NZ} positions, R = {ratio:e} P: {kind:?} {number} ({i}, {j}) off by {off:e} > {bound:e}"
                    );
                }
            }
        }
    }
}

#[test]
fn subtractive_updates_are_exact_but_for_rounding() {
    for ratio in [1.0, 1e-1, 1e-2, 1e-3] {
        is_exact_but_for_rounding::<4, 1>(2, ratio);
        is_exact_but_for_rounding::<4, 2>(2, ratio);
        is_exact_but_for_rounding::<6, 3>(2, ratio);
        is_exact_but_for_rounding::<9, 3>(3, ratio);
    }
}
