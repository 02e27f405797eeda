//! One scan of tracks associated together, against a listing of everything that may have happened.
//!
//! The listing goes over existence, modes and detections of all tracks at once,
//!
//! ```text
//! not there 1 − r;   there, in mode j, not seen r c_j (1 − P_D P_G);   there, in mode j, detection i r c_j P_D N(z_i; x_j)
//! clutter   λ^φ,  or φ! / V^φ;   no detection twice
//! ```
//!
//! while the tracker associates mixtures of modes, and takes modes and existence out of the marginals afterwards.

use crate::enumeration::Enumeration;
use crate::joint::{P_DETECT, ROUNDINGS, THRESHOLD, cue, integrated, sensor, settled};
use crate::{JointTrackerState, SIGMA, alive, joint_tracker, modes};
use boresight::gaussian::Gaussian;
use boresight::initiation::Rule;
use boresight::mode::ModeBank;
use boresight::scalar::Real;
use boresight::scan::{Detection, Scan};
use boresight::sensor::Clutter;
use boresight::time::Instant;
use boresight::track::Logic;
use nalgebra::{Matrix2, SMatrix, SVector, Vector2};
use proptest::prelude::*;
use proptest::test_runner::{TestCaseError, TestCaseResult};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

/// How long targets stay on average \[s\]: not long, so that existence varies.
const LIFETIME: f64 = 4.0;

type Six = SVector<f64, 6>;
type SixBySix = SMatrix<f64, 6, 6>;

/// One target: r and a Gaussian per mode with its probability.
#[derive(Clone, Debug)]
struct Belief {
    existence: f64,
    modes: Vec<(f64, Six, SixBySix)>,
}

impl Belief {
    fn of<T: Real>(bank: &ModeBank<T, 6, 2>, existence: T) -> Self {
        let mode = |(p, g): (&T, &Gaussian<T, 6>)| (p.to_f64(), g.mean.map(Real::to_f64), g.cov.to_matrix().map(Real::to_f64));
        Self { existence: existence.to_f64(), modes: bank.prob.iter().zip(&bank.modes).map(mode).collect() }
    }
}

/// What one target may have done.
#[derive(Clone, Copy, Debug)]
struct Fate {
    mode: Option<usize>,
    detection: Option<usize>,
    weight: f64,
}

fn observed() -> SMatrix<f64, 2, 6> {
    SMatrix::from_fn(|k, i| f64::from(u8::from(i == 3 * k)))
}

fn innovation(p: &SixBySix) -> Matrix2<f64> {
    observed() * p * observed().transpose() + Matrix2::identity() * (SIGMA * SIGMA)
}

/// Whether the mode that sees worst gates `z`, and the volume of its gate.
fn gate(belief: &Belief, z: &Vector2<f64>) -> (bool, f64) {
    let widest = belief.modes.iter().max_by(|a, b| innovation(&a.2).determinant().total_cmp(&innovation(&b.2).determinant()));
    widest.map_or((false, 0.0), |(_, x, p)| {
        let (s, nu) = (innovation(p), z - observed() * x);
        let nis = s.try_inverse().map_or(f64::NAN, |inverse| nu.dot(&(inverse * nu)));
        (nis <= THRESHOLD, std::f64::consts::PI * THRESHOLD * s.determinant().sqrt())
    })
}

/// All that a target may have done, weighted, clutter aside.
fn fates(belief: &Belief, plots: &[Vector2<f64>]) -> Vec<Fate> {
    let (r, p_gate) = (belief.existence, 1.0 - (-0.5 * THRESHOLD).exp());
    let mut fates = vec![Fate { mode: None, detection: None, weight: 1.0 - r }];
    for (j, (c, x, p)) in belief.modes.iter().enumerate() {
        fates.push(Fate { mode: Some(j), detection: None, weight: r * c * (1.0 - P_DETECT * p_gate) });
        for (i, z) in plots.iter().enumerate().filter(|(_, z)| gate(belief, z).0) {
            let (s, nu) = (innovation(p), z - observed() * x);
            let nis = s.try_inverse().map_or(f64::NAN, |inverse| nu.dot(&(inverse * nu)));
            let likelihood = (-0.5 * nis).exp() / (2.0 * std::f64::consts::PI * s.determinant().sqrt());
            fates.push(Fate { mode: Some(j), detection: Some(i), weight: r * c * P_DETECT * likelihood });
        }
    }
    fates
}

/// Adds up, for every target, the weights of all events by what it does in them.
fn list(fates: &[Vec<Fate>], chosen: &mut Vec<usize>, weight: f64, clutter: &dyn Fn(usize) -> f64, sums: &mut [Vec<f64>]) {
    let (t, used) = (chosen.len(), |(t, k): (usize, &usize)| fates[t][*k].detection);
    if t == fates.len() {
        let served = chosen.iter().enumerate().filter_map(used).count();
        for (sums, k) in sums.iter_mut().zip(chosen.iter()) {
            sums[*k] += weight * clutter(served);
        }
        return;
    }
    for (k, fate) in fates[t].iter().enumerate() {
        if fate.detection.is_none_or(|i| !chosen.iter().enumerate().filter_map(used).any(|taken| taken == i)) {
            chosen.push(k);
            list(fates, chosen, weight * fate.weight, clutter, sums);
            chosen.pop();
        }
    }
}

/// The beliefs after a scan, by listing.
fn listed(beliefs: &[Belief], plots: &[Vector2<f64>], density: Option<f64>) -> Vec<Belief> {
    let fates: Vec<_> = beliefs.iter().map(|b| fates(b, plots)).collect();
    let gated = plots.iter().filter(|z| beliefs.iter().any(|b| gate(b, z).0)).count();
    let volume: f64 = beliefs.iter().map(|b| gate(b, &Vector2::zeros()).1).sum();
    let clutter = |served: usize| match density {
        Some(density) => density.powi(-(served as i32)),
        // φ! / V^φ over its value with none served.
        None => (0..served).map(|k| volume / (gated - k) as f64).product(),
    };
    let mut sums: Vec<_> = fates.iter().map(|f| vec![0.0; f.len()]).collect();
    list(&fates, &mut vec![], 1.0, &clutter, &mut sums);
    let after = |((belief, fates), sums): ((&Belief, &Vec<Fate>), &Vec<f64>)| {
        let total: f64 = sums.iter().sum();
        let there: f64 = sums.iter().skip(1).sum();
        let mode = |j: usize| {
            let (_, x, p) = &belief.modes[j];
            let gain = p * observed().transpose() * innovation(p).try_inverse().unwrap_or_else(Matrix2::zeros);
            let mut parts = vec![];
            for (fate, w) in fates.iter().zip(sums).filter(|(fate, _)| fate.mode == Some(j)) {
                parts.push(match fate.detection {
                    None => (*w, *x, *p),
                    Some(i) => (*w, x + gain * (plots[i] - observed() * x), p - gain * observed() * p),
                });
            }
            let sum: f64 = parts.iter().map(|part| part.0).sum();
            let mean: Six = parts.iter().map(|(w, x, _)| x * (w / sum)).sum();
            let spread = |(w, x, p): &(f64, Six, SixBySix)| (p + (x - mean) * (x - mean).transpose()) * (w / sum);
            (sum / there, mean, parts.iter().map(spread).sum())
        };
        Belief { existence: there / total, modes: (0..belief.modes.len()).map(mode).collect() }
    };
    beliefs.iter().zip(&fates).zip(&sums).map(after).collect()
}

/// What may differ by rounding: probabilities by that of an event, means and covariances by that times what detections in
/// a gate spread over.
fn agree<T: Real>(got: &Belief, want: &Belief) -> TestCaseResult {
    let bound = ROUNDINGS * T::EPSILON.to_f64();
    let spread = 500.0;
    prop_assert!((got.existence - want.existence).abs() <= bound, "existence {} for {}", got.existence, want.existence);
    for ((p, x, cov), (q, y, wanted)) in got.modes.iter().zip(&want.modes) {
        prop_assert!((p - q).abs() <= bound, "mode probability {p} for {q}");
        // An improbable mode is as well defined as its share of the events.
        prop_assert!((x - y).abs().max() <= bound * spread, "{x} for {y}");
        prop_assert!((cov - wanted).abs().max() <= bound * spread * spread, "{cov} for {wanted}");
    }
    Ok(())
}

/// Ten scans of up to three targets close to each other, each scan against the listing.
fn scans_are_the_listing<T: Real>(seed: u64) -> TestCaseResult {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let density = rng.random_bool(0.5).then_some(1e-5);
    let clutter = density.map_or(Clutter::Diffuse, |density| Clutter::Poisson(T::lit(density)));
    let integrates = rng.random_bool(0.5);
    let logic = if integrates { integrated(LIFETIME)? } else { Logic::unmanaged() };
    let tracker = joint_tracker::<T, _, 3, 4>(logic, Rule::Off, Enumeration)?;
    let (modes, jump, _) = modes::<T>()?;
    let mut state = JointTrackerState::new();
    for _ in 0..rng.random_range(1..=3) {
        let mut near = || rng.random_range(-60.0..60.0);
        cue(&tracker, &mut state, settled(near(), near() / 3.0, near(), near() / 3.0))?;
    }
    let mut time = 0;
    for scan in 0..10 {
        let gap = [0u32, 400, 1000][rng.random_range(0..3)];
        time += u64::from(gap);
        let predicted: Vec<_> = state
            .tracks()
            .map(|t| {
                let (mut bank, mut existence) = (*t.bank(), t.existence());
                if gap > 0 {
                    bank.interact(&jump);
                    bank.predict(&modes, T::lit(f64::from(gap) / 1000.0));
                    existence *= T::lit(if integrates { (-f64::from(gap) / 1000.0 / LIFETIME).exp() } else { 1.0 });
                }
                Belief::of(&bank, existence)
            })
            .collect();
        let plots: Vec<Vector2<f64>> = (0..rng.random_range(0..=4))
            .map(|_| {
                let at = predicted[rng.random_range(0..predicted.len())].modes[0].1;
                Vector2::new(at[0], at[3]).map(|v| T::lit(v + rng.random_range(-80.0..80.0)).to_f64())
            })
            .collect();
        let detections: Vec<_> = plots.iter().map(|z| Detection::new([z.x, z.y].map(T::lit))).collect();
        let mut want = listed(&predicted, &plots, density);
        tracker.step(&mut state, &sensor(clutter)?, &Scan::new(Instant::from_millis(time), &detections))?;
        prop_assert_eq!(alive(&state), predicted.len());
        for (track, want) in state.tracks().zip(&mut want) {
            want.existence = if integrates { want.existence.min(1.0 - 1e-6) } else { 1.0 };
            let within = agree::<T>(&Belief::of(track.bank(), track.existence()), want);
            within.map_err(|e| TestCaseError::fail(format!("seed {seed}, scan {scan}, density {density:?}: {e}")))?;
        }
    }
    Ok(())
}

#[test]
fn a_scan_is_the_sum_over_everything_that_may_have_happened() -> Result<(), TestCaseError> {
    for seed in 0..200 {
        scans_are_the_listing::<f64>(seed)?;
        scans_are_the_listing::<f32>(seed)?;
    }
    Ok(())
}
