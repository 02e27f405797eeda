//! Tracks associated together: one scan against a listing of everything that may have happened, and what must not matter.
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
use crate::{JointTracker, JointTrackerState, SIGMA, TrackerState, alive, joint_tracker, modes, positions, tracker};
use boresight::association::{AssociationMatrix, Associator, Completeness, Gate};
use boresight::gaussian::Gaussian;
use boresight::initiation::Rule;
use boresight::mode::ModeBank;
use boresight::model::position::Position;
use boresight::scalar::Real;
use boresight::scan::{Detection, Scan};
use boresight::sensor::{Clutter, UniformSensor};
use boresight::symmetric::Symmetric;
use boresight::time::Instant;
use boresight::track::{Existence, Logic};
use nalgebra::{Matrix2, SMatrix, SVector, Vector2};
use proptest::prelude::*;
use proptest::test_runner::{TestCaseError, TestCaseResult};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};

const P_DETECT: f64 = 0.9;
const THRESHOLD: f64 = 16.0;
const LIFETIME: f64 = 4.0;
/// Coordinates stay below this \[m\].
const SIZE: f64 = 1000.0;
/// ln of an event: three likelihoods, each off by √γ |δν| / σ with ν rounded ten times in coordinates up to [`SIZE`].
const ROUNDINGS: f64 = 3.0 * 4.0 * 10.0 * SIZE / SIGMA;

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

fn sensor<T: Real>(clutter: Clutter<T>) -> Result<UniformSensor<Position<T, 2, 3>, T>, TestCaseError> {
    let model = Position::new(Symmetric::from_diagonal([T::lit(SIGMA * SIGMA); 2]))?;
    Ok(UniformSensor::new(model, T::lit(P_DETECT), clutter, Gate::new::<2>(T::lit(THRESHOLD))?)?)
}

fn integrated<T: Real>(lifetime: f64) -> Result<Logic<T>, TestCaseError> {
    let [birth, lifetime, confirm, delete] = [0.2, lifetime, 0.95, 1e-9].map(T::lit);
    Ok(Logic::existence(Existence { birth, lifetime, confirm, delete })?.with_duplicate_distance(T::ZERO)?)
}

/// A density at (x, y) with velocity (vx, vy) and the variances of a settled track.
fn settled<T: Real>(x: f64, vx: f64, y: f64, vy: f64) -> Gaussian<T, 6> {
    let mean = [x, vx, 0.0, y, vy, 0.0].map(T::lit);
    Gaussian::new(SVector::from(mean), Symmetric::from_diagonal([400.0, 25.0, 1.0, 400.0, 25.0, 1.0].map(T::lit)))
}

fn cue<T: Real, A: Associator<T, TRACKS, DETS>, const TRACKS: usize, const DETS: usize>(
    tracker: &JointTracker<T, TRACKS, DETS, A>,
    state: &mut JointTrackerState<T, TRACKS, DETS, A>,
    g: Gaussian<T, 6>,
) -> TestCaseResult {
    tracker.start(state, g, Instant::ZERO).map(|_| ()).ok_or_else(|| TestCaseError::fail("not started"))
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

fn normal(rng: &mut ChaCha8Rng) -> f64 {
    StandardNormal.sample(rng)
}

/// Plots of targets that fly straight from where they were cued, and of clutter around them.
fn plots(targets: &[[f64; 4]], seconds: f64, rng: &mut ChaCha8Rng) -> Vec<[f64; 2]> {
    let mut plots = vec![];
    for [x, vx, y, vy] in targets {
        let at = [x + vx * seconds, y + vy * seconds];
        if rng.random_bool(P_DETECT) {
            plots.push(at.map(|v| v + SIGMA * normal(rng)));
        }
        if rng.random_bool(0.3) {
            plots.push(at.map(|v| v + rng.random_range(-150.0..150.0)));
        }
    }
    plots
}

fn detections<T: Real>(plots: &[[f64; 2]]) -> Vec<Detection<T, 2>> {
    plots.iter().map(|z| Detection::new(z.map(T::lit))).collect()
}

/// The largest difference between two pictures, in position or velocity, and in existence.
fn difference<'a, T: Real>(
    one: impl Iterator<Item = &'a boresight::track::Track<T, 6, 2>>,
    other: impl Iterator<Item = &'a boresight::track::Track<T, 6, 2>>,
) -> (f64, f64) {
    one.zip(other).fold((0.0, 0.0), |(x, r), (a, b)| {
        let d = (a.bank().combined().mean - b.bank().combined().mean).map(|v| v.to_f64().abs());
        (f64::max(x, d.max()), f64::max(r, (a.existence() - b.existence()).to_f64().abs()))
    })
}

/// Rounding that sixty scans leave: the filter forgets, so that of a few steps counts.
fn rounding<T: Real>(size: f64) -> f64 {
    10.0 * ROUNDINGS * size / SIZE * T::EPSILON.to_f64() * SIGMA
}

fn one_alone<T: Real>(clutter: Clutter<T>, logic: Logic<T>, seed: u64) -> TestCaseResult {
    let (joint, alone) = (joint_tracker::<T, _, 1, 4>(logic, Rule::Off, Enumeration)?, tracker::<T, 1, 4>(logic, Rule::Off)?);
    let (mut together, mut single) = (JointTrackerState::new(), TrackerState::new());
    let target = [100.0, 8.0, -300.0, 5.0];
    let [x, vx, y, vy] = target;
    cue(&joint, &mut together, settled(x, vx, y, vy))?;
    alone.start(&mut single, settled(x, vx, y, vy), Instant::ZERO);
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    for k in 1..60u64 {
        let detections = detections(&plots(&[target], k as f64, &mut rng));
        let scan = Scan::new(Instant::from_millis(1000 * k), &detections);
        let reports = (joint.step(&mut together, &sensor(clutter)?, &scan)?, alone.step(&mut single, &sensor(clutter)?, &scan)?);
        prop_assert_eq!(reports.0, reports.1);
        let (x, r) = difference(together.tracks(), single.tracks());
        prop_assert!(x <= rounding::<T>(SIZE) && r <= rounding::<T>(SIZE) / SIGMA, "seed {seed}, scan {k}: {x} m, {r}");
    }
    prop_assert_eq!((alive(&together), alive(&single)), (1, 1));
    Ok(())
}

fn alone_in_every_way<T: Real>() -> TestCaseResult {
    for seed in 0..10 {
        for clutter in [Clutter::Diffuse, Clutter::Poisson(T::lit(1e-5))] {
            one_alone(clutter, Logic::unmanaged(), seed)?;
            one_alone(clutter, Logic::new(2, 3, 30)?, seed)?;
            one_alone(clutter, integrated(100.0)?, seed)?;
        }
    }
    Ok(())
}

#[test]
fn one_track_is_associated_as_if_it_were_alone() -> Result<(), TestCaseError> {
    alone_in_every_way::<f32>()?;
    alone_in_every_way::<f64>()
}

/// Three targets that meet, with the plots in order and shuffled: what a track is told does not depend on their order.
fn order_is_nothing<T: Real>(seed: u64) -> TestCaseResult {
    let tracker = joint_tracker::<T, _, 4, 16>(integrated(100.0)?, Rule::Off, Enumeration)?;
    let targets = [[0.0, 10.0, 0.0, 0.0], [600.0, -10.0, 20.0, 0.0], [300.0, 0.0, -300.0, 10.0]];
    let mut states = [JointTrackerState::new(), JointTrackerState::new()];
    for state in &mut states {
        for [x, vx, y, vy] in targets {
            cue(&tracker, state, settled(x, vx, y, vy))?;
        }
    }
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    for k in 1..60u64 {
        let mut plots = plots(&targets, k as f64, &mut rng);
        for state in &mut states {
            let detections = detections(&plots);
            tracker.step(state, &sensor(Clutter::Poisson(T::lit(1e-5)))?, &Scan::new(Instant::from_millis(1000 * k), &detections))?;
            // For the second state only.
            for i in (1..plots.len()).rev() {
                plots.swap(i, rng.random_range(0..=i));
            }
        }
        let (x, r) = difference(states[0].tracks(), states[1].tracks());
        prop_assert!(x <= rounding::<T>(SIZE) && r <= rounding::<T>(SIZE) / SIGMA, "seed {seed}, scan {k}: {x} m, {r}");
    }
    Ok(())
}

#[test]
fn the_order_of_detections_does_not_matter() -> Result<(), TestCaseError> {
    for seed in 0..20 {
        order_is_nothing::<f32>(seed)?;
        order_is_nothing::<f64>(seed)?;
    }
    Ok(())
}

/// Two targets side by side, alone and with a third far away: what they are told is the same. (Not so in diffuse clutter,
/// where every detection tells of its density.)
fn distance_is_nothing<T: Real>(seed: u64) -> TestCaseResult {
    let tracker = joint_tracker::<T, _, 3, 16>(integrated(100.0)?, Rule::Off, Enumeration)?;
    let (near, far) = ([[0.0, 5.0, 0.0, 0.0], [0.0, 5.0, 60.0, 0.0]], [9e4, -5.0, 0.0, 0.0]);
    let mut states = [JointTrackerState::new(), JointTrackerState::new()];
    for (state, targets) in states.iter_mut().zip([vec![near[0], near[1]], vec![near[0], near[1], far]]) {
        for [x, vx, y, vy] in targets {
            cue(&tracker, state, settled(x, vx, y, vy))?;
        }
    }
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let sensor = sensor(Clutter::Poisson(T::lit(1e-5)))?;
    for k in 1..40u64 {
        let (time, close) = (Instant::from_millis(1000 * k), plots(&near, k as f64, &mut rng));
        let all = [plots(&[far], k as f64, &mut rng), close.clone()].concat();
        tracker.step(&mut states[0], &sensor, &Scan::new(time, &detections(&close)))?;
        tracker.step(&mut states[1], &sensor, &Scan::new(time, &detections(&all)))?;
        let (x, r) = difference(states[0].tracks(), states[1].tracks());
        prop_assert!(x <= rounding::<T>(SIZE) && r <= rounding::<T>(SIZE) / SIGMA, "seed {seed}, scan {k}: {x} m, {r}");
    }
    prop_assert_eq!((alive(&states[0]), alive(&states[1])), (2, 3));
    Ok(())
}

#[test]
fn a_distant_target_changes_nothing() -> Result<(), TestCaseError> {
    for seed in 0..20 {
        distance_is_nothing::<f32>(seed)?;
        distance_is_nothing::<f64>(seed)?;
    }
    Ok(())
}

/// A track whose prediction overflows goes, and the one beside it is told the same as without it.
#[test]
fn a_track_that_overflows_takes_no_other_with_it() -> Result<(), TestCaseError> {
    let tracker = joint_tracker::<f32, _, 2, 4>(Logic::unmanaged(), Rule::Off, Enumeration)?;
    let mut states = [JointTrackerState::new(), JointTrackerState::new()];
    let mut wild = settled(0.0, 9e14, 0.0, 9e14);
    wild.cov = Symmetric::from_diagonal([9e29; 6]);
    cue(&tracker, &mut states[0], wild)?;
    for state in &mut states {
        cue(&tracker, state, settled(0.0, 0.0, 0.0, 0.0))?;
    }
    let detections = detections(&[[10.0, 5.0], [-50.0, 30.0]]);
    for (state, resets) in states.iter_mut().zip([1, 0]) {
        let report = tracker.step(state, &positions(0.9)?, &Scan::new(Instant::from_millis(3000), &detections))?;
        prop_assert_eq!((report.numeric_resets, alive(state)), (resets, 1));
    }
    let banks = states.each_ref().map(|state| state.tracks().next().map(|t| *t.bank()));
    prop_assert_eq!(banks[0], banks[1]);
    Ok(())
}

/// Gives nothing away but its shortcomings.
struct Sorry;

impl Associator<f32, 2, 4> for Sorry {
    type Memory = ();
    const MEMORY: () = ();

    fn associate(&self, matrix: &mut AssociationMatrix<f32, 2, 4>, (): &mut ()) -> Completeness {
        Enumeration.associate(matrix, &mut ());
        let mut completeness = Completeness::default();
        (completeness.bounded, completeness.approximated, completeness.error_bound) = (3, 2, 0.125);
        completeness
    }
}

#[test]
fn the_report_tells_what_association_gave_up() -> Result<(), TestCaseError> {
    let exact = joint_tracker::<f32, _, 2, 4>(Logic::unmanaged(), Rule::Off, Enumeration)?;
    let report = exact.step(&mut JointTrackerState::new(), &positions(0.9)?, &Scan::new(Instant::ZERO, &[]))?;
    prop_assert!(report.is_complete());
    let sorry = joint_tracker::<f32, _, 2, 4>(Logic::unmanaged(), Rule::Off, Sorry)?;
    let report = sorry.step(&mut JointTrackerState::new(), &positions(0.9)?, &Scan::new(Instant::ZERO, &[]))?;
    prop_assert_eq!((report.clusters_bounded, report.clusters_approximated, report.clusters_infeasible), (3, 2, 0));
    prop_assert!(report.association_error_bound == 0.125 && !report.is_complete());
    Ok(())
}

/// Two targets cross at a small angle: 240 m apart, abreast, and 240 m apart again.
const CROSSING: [[f64; 4]; 2] = [[0.0, 100.0, -120.0, 6.0], [0.0, 100.0, 120.0, -6.0]];

/// Whether both tracks end nearer to their own target than to the other, and within 100 m of it.
fn keeps_identities<'a, T: Real>(tracks: impl Iterator<Item = &'a boresight::track::Track<T, 6, 2>>, seconds: f64) -> bool {
    let at = CROSSING.map(|[x, vx, y, vy]| Vector2::new(x + vx * seconds, y + vy * seconds));
    let places = tracks.map(|t| t.bank().combined().mean).map(|m| Vector2::new(m[0], m[3]).map(Real::to_f64));
    places.zip([(at[0], at[1]), (at[1], at[0])]).filter(|(x, (own, other))| (x - own).norm() < (x - other).norm().min(100.0)).count() == 2
}

/// Of so many crossings, those in which identities were lost: together, and each for itself.
fn crossings<T: Real>(runs: u64) -> Result<[u32; 2], TestCaseError> {
    let logic = Logic::unmanaged();
    let (joint, alone) = (joint_tracker::<T, _, 2, 8>(logic, Rule::Off, Enumeration)?, tracker::<T, 2, 8>(logic, Rule::Off)?);
    let mut lost = [0; 2];
    for seed in 0..runs {
        let (mut together, mut single) = (JointTrackerState::new(), TrackerState::new());
        for [x, vx, y, vy] in CROSSING {
            cue(&joint, &mut together, settled(x, vx, y, vy))?;
            alone.start(&mut single, settled(x, vx, y, vy), Instant::ZERO);
        }
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        for k in 1..=40u64 {
            let detections = detections(&plots(&CROSSING, k as f64, &mut rng));
            let scan = Scan::new(Instant::from_millis(1000 * k), &detections);
            joint.step(&mut together, &sensor(Clutter::Poisson(T::lit(1e-6)))?, &scan)?;
            alone.step(&mut single, &sensor(Clutter::Poisson(T::lit(1e-6)))?, &scan)?;
        }
        lost[0] += u32::from(!keeps_identities(together.tracks(), 40.0));
        lost[1] += u32::from(!keeps_identities(single.tracks(), 40.0));
    }
    Ok(lost)
}

#[test]
fn crossing_targets_keep_their_identities_better_together() -> Result<(), TestCaseError> {
    for [together, alone] in [crossings::<f32>(200)?, crossings::<f64>(200)?] {
        prop_assert!(2 * together < alone, "lost {together} of 200 crossings together, {alone} alone");
    }
    Ok(())
}
