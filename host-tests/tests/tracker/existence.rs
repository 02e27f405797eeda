//! Integrated existence: numbers by hand, false tracks and real ones, and what a sensor that does not look tells.

use crate::enumeration::Enumeration;
use crate::tracking::{ON_TARGET, Target, first_on_target, normal, normalised_error};
use crate::{CLUTTER, SIGMA, Tracker, TrackerState, alive, initiation, joint_tracker, modes, positions, tracker};
use boresight::association::{Gate, Jpda, PrintedPda};
use boresight::error::ConfigError;
use boresight::gaussian::Gaussian;
use boresight::initiation::Rule;
use boresight::mode::ModeBank;
use boresight::model::position::Position;
use boresight::scalar::Real;
use boresight::scan::{Detection, Scan};
use boresight::sensor::{Clutter, Sensor};
use boresight::symmetric::Symmetric;
use boresight::time::Instant;
use boresight::track::{Existence, Logic, Status};
use boresight::tracker::{ImmPdaf, JointState};
use nalgebra::{Matrix2, SVector, Vector2};
use proptest::prelude::*;
use proptest::test_runner::{TestCaseError, TestCaseResult};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, Poisson};
use std::collections::BTreeSet;

const P_DETECT: f64 = 0.9;

fn seconds(k: u64) -> Instant {
    Instant::from_millis(1000 * k)
}

fn rules<T: Real>(birth: f64, lifetime: f64, confirm: f64, delete: f64) -> Existence<T> {
    let [birth, lifetime, confirm, delete] = [birth, lifetime, confirm, delete].map(T::lit);
    Existence { birth, lifetime, confirm, delete }
}

/// The existence of the only track.
fn existence<T: Real>(mut tracks: impl Iterator<Item = T>) -> Result<f64, TestCaseError> {
    tracks.next().map(Real::to_f64).ok_or_else(|| TestCaseError::fail("the track is gone"))
}

/// A track born with r = 0.2, missed twice, a second apart, by a sensor with P_D = 0.9 and P_G = 1 − e⁻⁸, where targets live
/// ten seconds: 0.2 e^{−0.1} (1 − q) / (1 − 0.2 e^{−0.1} q) with q = P_D P_G, and the same again.
const MISSED: [f64; 2] = [0.021_681_479_262_300_445, 0.002_003_100_087_837_229];

/// The same by every association; rounding of twenty operations near one.
fn missed_twice<T: Real>() -> TestCaseResult {
    let logic = Logic::existence(rules::<T>(0.2, 10.0, 0.9, 1e-4))?;
    let alone: Tracker<T, 1, 2> = tracker(logic, Rule::OnePoint)?;
    let printed = alone.with_associator(PrintedPda);
    let joint = joint_tracker::<T, _, 1, 2>(logic, Rule::OnePoint, Enumeration)?;
    let (mut a, mut b, mut c) = (TrackerState::new(), TrackerState::new(), JointState::new());
    let (plot, sensor) = ([Detection::new([T::lit(50.0); 2])], positions(P_DETECT)?);
    for (k, want) in [0.2, MISSED[0], MISSED[1]].into_iter().enumerate() {
        let scan = Scan::new(seconds(k as u64), if k == 0 { &plot[..] } else { &[] });
        alone.step(&mut a, &sensor, &scan)?;
        printed.step(&mut b, &sensor, &scan)?;
        joint.step(&mut c, &sensor, &scan)?;
        for got in [
            existence(a.tracks().map(|t| t.existence()))?,
            existence(b.estimates().map(|e| e.existence))?,
            existence(c.tracks().map(|t| t.existence()))?,
        ] {
            prop_assert!((got - want).abs() <= 20.0 * T::EPSILON.to_f64(), "{got} for {want}");
        }
    }
    Ok(())
}

#[test]
fn misses_lower_existence_as_calculated_by_hand() -> Result<(), TestCaseError> {
    missed_twice::<f32>()?;
    missed_twice::<f64>()
}

/// N(z; H x, H P H' + R), mixed over modes.
fn mixture(bank: &ModeBank<f64, 6, 2>, z: Vector2<f64>) -> f64 {
    let mode = |(c, g): (&f64, &Gaussian<f64, 6>)| {
        let p = g.cov.to_matrix();
        let s = Matrix2::from_fn(|i, j| p[(3 * i, 3 * j)]) + Matrix2::identity() * (SIGMA * SIGMA);
        let nu = z - Vector2::new(g.mean[0], g.mean[3]);
        let nis = s.try_inverse().map_or(f64::NAN, |inverse| nu.dot(&(inverse * nu)));
        c * (-0.5 * nis).exp() / (2.0 * std::f64::consts::PI * s.determinant().sqrt())
    };
    bank.prob.iter().zip(&bank.modes).map(mode).sum()
}

/// Odds of existence after a scan: those before times 1 − P_D P_G + Σ P_D L / λ.
#[test]
fn detections_raise_existence_by_their_likelihood_ratios() -> Result<(), TestCaseError> {
    let tracker: Tracker<f64, 1, 3> = tracker(Logic::existence(rules(0.2, 10.0, 0.9, 1e-4))?, Rule::OnePoint)?;
    let (modes, jump, _) = modes::<f64>()?;
    let sensor = positions(P_DETECT)?;
    for plots in [&[[60.0, 45.0]][..], &[[10.0, -5.0], [90.0, 200.0]], &[[300.0, 60.0], [0.0, 0.0], [40.0, 90.0]]] {
        let mut state = TrackerState::new();
        tracker.step(&mut state, &sensor, &Scan::new(seconds(0), &[Detection::new([50.0; 2])]))?;
        let mut bank = *state.tracks().next().ok_or_else(|| TestCaseError::fail("not born"))?.bank();
        bank.interact(&jump);
        bank.predict(&modes, 1.0);
        let before = 0.2 * (-0.1f64).exp();
        let ratio = |z: &[f64; 2]| P_DETECT * mixture(&bank, Vector2::from(*z)) / CLUTTER;
        let factor = 1.0 - P_DETECT * (1.0 - (-8f64).exp()) + plots.iter().map(ratio).sum::<f64>();
        let odds = before / (1.0 - before) * factor;
        let detections: Vec<_> = plots.iter().map(|z| Detection::new(*z)).collect();
        tracker.step(&mut state, &sensor, &Scan::new(seconds(1), &detections))?;
        let got = existence(state.tracks().map(|t| t.existence()))?;
        let want = odds / (1.0 + odds);
        prop_assert!(want < 1.0 - 1e-6, "saturated: tells nothing");
        prop_assert!((got - want).abs() <= 1000.0 * f64::EPSILON, "{got} for {want}");
    }
    Ok(())
}

const RUNS: u64 = 20;
const SCANS: u64 = 60;
/// Half the side of the square that clutter falls in \[m\].
const HALF: f64 = 10_000.0;
const BIRTH: f64 = 0.02;
const CONFIRM: f64 = 0.99;

/// What became of the tracks of all runs.
#[derive(Debug, Default)]
struct Fates {
    births: u32,
    false_confirmed: u32,
}

/// A target among some forty false detections a scan. A false track is one that is never on the target.
fn target_in_clutter<T: Real, K: boresight::tracker::Tracker<T, 6, 2>>(tracker: &K, seed: u64, fates: &mut Fates) -> TestCaseResult {
    let (sensor, mut state) = (positions::<T>(P_DETECT)?, Box::new(K::State::default()));
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let target = Target { start: Vector2::new(-6000.0, -2000.0), velocity: Vector2::new(120.0, 60.0) };
    let clutter = Poisson::new(CLUTTER * 4.0 * HALF * HALF).map_err(|e| TestCaseError::fail(e.to_string()))?;
    let (mut confirmed, mut on) = (BTreeSet::new(), BTreeSet::new());
    let mut births = vec![];
    for k in 0..SCANS {
        let mut plots = vec![];
        if rng.random_bool(P_DETECT) {
            let p = target.at(k as f64).map(|v| v + SIGMA * normal(&mut rng));
            plots.push(Detection::new([p.x, p.y].map(T::lit)));
        }
        for _ in 0..clutter.sample(&mut rng) as usize {
            plots.push(Detection::new([0; 2].map(|_| T::lit(rng.random_range(-HALF..HALF)))));
        }
        let report = tracker.step(&mut state, &sensor, &Scan::new(seconds(k), &plots))?;
        prop_assert!(report.is_complete(), "seed {seed}, scan {k}: {report:?}");
        births.push(u32::from(report.births));
        let held = first_on_target(tracker.estimates(&state), target.at(k as f64));
        prop_assert!(held.is_some() || k < 10, "seed {seed}: the target is not held in scan {k}");
        on.extend(tracker.estimates(&state).filter(|e| normalised_error(&e.state, target.at(k as f64)) < ON_TARGET).map(|e| e.id));
        confirmed.extend(tracker.estimates(&state).filter(|e| e.status != Status::Tentative).map(|e| e.id));
    }
    // Tracks are numbered in order of birth.
    let old: u32 = births.iter().rev().skip(20).sum();
    let lingering = tracker.tracks(&state).filter_map(|t| t.id()).filter(|id| id.number() <= old && !on.contains(id)).count();
    prop_assert_eq!(lingering, 0, "seed {}: false tracks outlive twenty scans", seed);
    fates.births += births.iter().sum::<u32>();
    fates.false_confirmed += confirmed.difference(&on).count() as u32;
    Ok(())
}

/// If r is the probability it claims to be, the odds of a false track are a martingale that starts at those of birth: it is
/// ever confirmed with probability at most odds(birth) / odds(confirm) (Ville's inequality).
fn false_tracks_go<T: Real>() -> TestCaseResult {
    let logic = Logic::existence(rules(BIRTH, 100.0, CONFIRM, 1e-3))?;
    let alone: Tracker<T, 192, 96> = tracker(logic, Rule::OnePoint)?;
    let joint = joint_tracker::<T, _, 192, 96>(logic, Rule::OnePoint, Jpda::<512>::new())?;
    let (mut single, mut together) = (Fates::default(), Fates::default());
    for seed in 0..RUNS {
        target_in_clutter(&alone, seed, &mut single)?;
        target_in_clutter(&joint, seed, &mut together)?;
    }
    for fates in [single, together] {
        let odds = |r: f64| r / (1.0 - r);
        let most = f64::from(fates.births) * odds(BIRTH) / odds(CONFIRM);
        // Three standard deviations more.
        prop_assert!(f64::from(fates.false_confirmed) <= most + 3.0 * most.sqrt(), "{fates:?}, expected at most {most}");
        prop_assert!(fates.births > 10_000);
    }
    Ok(())
}

#[test]
fn real_tracks_are_confirmed_and_false_ones_die() -> Result<(), TestCaseError> {
    false_tracks_go::<f32>()?;
    false_tracks_go::<f64>()
}

/// Of two tentative tracks the one that was missed gives way; where both were seen, the birth is refused.
#[test]
fn births_displace_what_has_lost_existence() -> Result<(), TestCaseError> {
    let tracker: Tracker<f64, 2, 3> = tracker(Logic::existence(rules(0.01, 1e3, 1.0 - 1e-5, 1e-6))?, Rule::OnePoint)?;
    let (sensor, mut state) = (positions(P_DETECT)?, TrackerState::new());
    let [here, there, elsewhere] = [0.0, 3e4, 6e4].map(|x| Detection::new([x, 0.0]));
    let mut step = |k: u64, plots: &[Detection<f64, 2>]| {
        let report = tracker.step(&mut state, &sensor, &Scan::new(seconds(k), plots));
        let ids: Vec<_> = state.tracks().filter_map(|t| t.id()).map(|id| id.number()).collect();
        report.map(|r| ((r.births, r.births_refused, r.tracks_evicted), ids))
    };
    prop_assert_eq!(step(0, &[here, there])?, ((2, 0, 0), vec![1, 2]));
    prop_assert_eq!(step(1, &[here, there, elsewhere])?, ((0, 1, 0), vec![1, 2]));
    prop_assert_eq!(step(2, &[here])?, ((0, 0, 0), vec![1, 2]));
    prop_assert_eq!(step(3, &[here])?, ((0, 0, 0), vec![1, 2]));
    prop_assert_eq!(step(4, &[here, elsewhere])?, ((1, 0, 1), vec![1, 3]));
    Ok(())
}

/// Positions, seen nowhere.
struct Blind(Position<f64, 2, 3>, Gate<f64>);

impl Sensor<f64, 6, 2> for Blind {
    type Model = Position<f64, 2, 3>;

    fn model(&self) -> &Self::Model {
        &self.0
    }
    fn p_detect(&self, _x: &SVector<f64, 6>) -> f64 {
        0.0
    }
    fn clutter(&self, _z: &SVector<f64, 2>) -> Clutter<f64> {
        Clutter::Diffuse
    }
    fn gate(&self) -> &Gate<f64> {
        &self.1
    }
}

/// Nobody looks, and targets live ten seconds on average: r is e^{−t/10}, and below 0.1 the track goes.
#[test]
fn without_a_look_only_time_tells() -> Result<(), TestCaseError> {
    let logic = Logic::existence(rules(0.2, 10.0, 0.9, 0.1))?;
    let (alone, joint) = (tracker::<f64, 1, 2>(logic, Rule::Off)?, joint_tracker::<f64, _, 1, 2>(logic, Rule::Off, Enumeration)?);
    let sensor = Blind(Position::new(Symmetric::from_diagonal([400.0; 2]))?, Gate::new::<2>(16.0)?);
    let (mut single, mut together) = (TrackerState::new(), JointState::new());
    let g = Gaussian::new(SVector::zeros(), Symmetric::from_diagonal([400.0, 25.0, 1.0, 400.0, 25.0, 1.0]));
    prop_assert!(alone.start(&mut single, g, seconds(0)).is_some() && joint.start(&mut together, g, seconds(0)).is_some());
    for k in 1..=30u64 {
        let plots = [Detection::new([5.0, 5.0])];
        let scan = Scan::new(seconds(k), &plots);
        alone.step(&mut single, &sensor, &scan)?;
        joint.step(&mut together, &sensor, &scan)?;
        let want = (1.0 - 1e-6) * (-0.1 * k as f64).exp();
        for got in [single.tracks().next().map(|t| t.existence()), together.tracks().next().map(|t| t.existence())] {
            prop_assert!(got.map_or(want < 0.1, |got| (got - want).abs() < 100.0 * f64::EPSILON && want >= 0.1), "{got:?} for {want}");
        }
    }
    prop_assert_eq!(alive(&single) + alive(&together), 0);
    Ok(())
}

/// However long a target was seen, a number of misses ends its track: odds of 10⁶, a tenth of them after every miss.
#[test]
fn nothing_is_so_certain_that_misses_could_not_end_it() -> Result<(), TestCaseError> {
    let tracker: Tracker<f32, 1, 1> = tracker(Logic::existence(rules(0.5, 1e30, 0.9, 1e-2))?, Rule::OnePoint)?;
    let (sensor, mut state) = (positions(P_DETECT)?, TrackerState::new());
    for k in 0..100 {
        tracker.step(&mut state, &sensor, &Scan::new(seconds(k), &[Detection::new([0.0, 0.0])]))?;
    }
    let misses = (100..).take_while(|k| {
        let report = tracker.step(&mut state, &sensor, &Scan::new(seconds(*k), &[]));
        report.is_ok_and(|r| r.tracks_deleted == 0) && *k < 200
    });
    // 10⁶ · 0.1003ⁿ < 0.01 from n = 9, that which deletes.
    prop_assert_eq!(misses.count(), 8);
    Ok(())
}

#[test]
fn counting_hits_takes_existence_for_certain() -> Result<(), TestCaseError> {
    let (modes, jump, initial) = modes::<f32>()?;
    let tracker =
        ImmPdaf::<_, _, 6, 2, 1, 1>::new(modes, jump, initial, Logic::new(1, 3, 3)?)?.with_initiation(initiation(Rule::OnePoint)?);
    let (sensor, mut state) = (positions(P_DETECT)?, TrackerState::new());
    for (k, plots) in [&[Detection::new([0.0, 0.0])][..], &[], &[], &[Detection::new([1.0, 0.0])]].into_iter().enumerate() {
        tracker.step(&mut state, &sensor, &Scan::new(seconds(k as u64), plots))?;
        prop_assert_eq!(state.estimates().map(|e| e.existence).collect::<Vec<_>>(), vec![1.0; alive(&state)]);
    }
    Ok(())
}

#[test]
fn thresholds_out_of_order_are_refused() {
    let refused = |birth, lifetime, confirm, delete| Logic::existence(Existence::<f64> { birth, lifetime, confirm, delete }).err();
    assert_eq!(refused(0.1, 10.0, 0.9, 0.01), None);
    assert_eq!(refused(0.95, 10.0, 0.9, 0.01), None);
    for (birth, lifetime, confirm, delete) in
        [(0.1, 10.0, 0.9, 0.1), (0.1, 10.0, 0.9, 0.0), (1.0, 10.0, 0.9, 0.01), (0.1, 10.0, 1.0, 0.01), (0.1, 10.0, 0.05, 0.06)]
    {
        assert_eq!(refused(birth, lifetime, confirm, delete), Some(ConfigError::BadThresholds));
    }
    assert_eq!(refused(0.1, 0.0, 0.9, 0.01), Some(ConfigError::NotPositive));
    assert_eq!(refused(f64::NAN, 10.0, 0.9, 0.01), Some(ConfigError::NotFinite));
    assert_eq!(refused(0.1, f64::INFINITY, 0.9, 0.01), Some(ConfigError::NotFinite));
}
