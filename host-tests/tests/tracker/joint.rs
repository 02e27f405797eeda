//! Tracks associated together: alone it is as if alone; what must not matter does not; identities at a crossing.
//!
//! That a scan is exact is tested in `listing.rs`.

use crate::enumeration::Enumeration;
use crate::{JointTracker, JointTrackerState, SIGMA, TrackerState, alive, joint_tracker, positions, tracker};
use boresight::association::{AssociationMatrix, Associator, Completeness, Gate};
use boresight::gaussian::Gaussian;
use boresight::initiation::Rule;
use boresight::model::position::Position;
use boresight::scalar::Real;
use boresight::scan::{Detection, Scan};
use boresight::sensor::{Clutter, Sensor, UniformSensor};
use boresight::symmetric::Symmetric;
use boresight::time::Instant;
use boresight::track::{Existence, Logic, Track};
use nalgebra::{SVector, Vector2};
use proptest::prelude::*;
use proptest::test_runner::{TestCaseError, TestCaseResult};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};

pub const P_DETECT: f64 = 0.9;
pub const THRESHOLD: f64 = 16.0;
/// Coordinates stay below this \[m\].
const SIZE: f64 = 1000.0;
/// ln of an event: three likelihoods, each off by √γ |δν| / σ with ν rounded ten times in coordinates up to [`SIZE`].
pub const ROUNDINGS: f64 = 3.0 * 4.0 * 10.0 * SIZE / SIGMA;

pub fn sensor<T: Real>(clutter: Clutter<T>) -> Result<UniformSensor<Position<T, 2, 3>, T>, TestCaseError> {
    let model = Position::new(Symmetric::from_diagonal([T::lit(SIGMA * SIGMA); 2]))?;
    Ok(UniformSensor::new(model, T::lit(P_DETECT), clutter, Gate::new::<2>(T::lit(THRESHOLD))?)?)
}

pub fn integrated<T: Real>(lifetime: f64) -> Result<Logic<T>, TestCaseError> {
    let [birth, lifetime, confirm, delete] = [0.2, lifetime, 0.95, 1e-9].map(T::lit);
    Ok(Logic::existence(Existence { birth, lifetime, confirm, delete })?.with_duplicate_distance(T::ZERO)?)
}

/// A density at (x, y) with velocity (vx, vy) and the variances of a settled track.
pub fn settled<T: Real>(x: f64, vx: f64, y: f64, vy: f64) -> Gaussian<T, 6> {
    let mean = [x, vx, 0.0, y, vy, 0.0].map(T::lit);
    Gaussian::new(SVector::from(mean), Symmetric::from_diagonal([400.0, 25.0, 1.0, 400.0, 25.0, 1.0].map(T::lit)))
}

pub fn cue<T: Real, A: Associator<T, TRACKS, DETS>, const TRACKS: usize, const DETS: usize>(
    tracker: &JointTracker<T, TRACKS, DETS, A>,
    state: &mut JointTrackerState<T, TRACKS, DETS, A>,
    g: Gaussian<T, 6>,
) -> TestCaseResult {
    tracker.start(state, g, Instant::ZERO).map(|_| ()).ok_or_else(|| TestCaseError::fail("not started"))
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
fn difference<'a, T: Real>(one: impl Iterator<Item = &'a Track<T, 6, 2>>, other: impl Iterator<Item = &'a Track<T, 6, 2>>) -> (f64, f64) {
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
fn distance_is_nothing<T: Real>(seed: u64, sensor: &impl Sensor<T, 6, 2>) -> TestCaseResult {
    let tracker = joint_tracker::<T, _, 3, 16>(integrated(100.0)?, Rule::Off, Enumeration)?;
    let (near, far) = ([[0.0, 5.0, 0.0, 0.0], [0.0, 5.0, 60.0, 0.0]], [9e4, -5.0, 0.0, 0.0]);
    let mut states = [JointTrackerState::new(), JointTrackerState::new()];
    for (state, targets) in states.iter_mut().zip([vec![near[0], near[1]], vec![near[0], near[1], far]]) {
        for [x, vx, y, vy] in targets {
            cue(&tracker, state, settled(x, vx, y, vy))?;
        }
    }
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    for k in 1..40u64 {
        let (time, close) = (Instant::from_millis(1000 * k), plots(&near, k as f64, &mut rng));
        let all = [plots(&[far], k as f64, &mut rng), close.clone()].concat();
        tracker.step(&mut states[0], sensor, &Scan::new(time, &detections(&close)))?;
        tracker.step(&mut states[1], sensor, &Scan::new(time, &detections(&all)))?;
        let (x, r) = difference(states[0].tracks(), states[1].tracks());
        prop_assert!(x <= rounding::<T>(SIZE) && r <= rounding::<T>(SIZE) / SIGMA, "seed {seed}, scan {k}: {x} m, {r}");
    }
    prop_assert_eq!((alive(&states[0]), alive(&states[1])), (2, 3));
    Ok(())
}

/// Clutter of a density that is known within reach of [`SIZE`] and not beyond.
struct Charted(UniformSensor<Position<f64, 2, 3>, f64>);

impl Sensor<f64, 6, 2> for Charted {
    type Model = Position<f64, 2, 3>;

    fn model(&self) -> &Self::Model {
        &self.0.model
    }
    fn p_detect(&self, _x: &SVector<f64, 6>) -> f64 {
        P_DETECT
    }
    fn clutter(&self, z: &SVector<f64, 2>) -> Clutter<f64> {
        if z.norm() < 10.0 * SIZE { Clutter::Poisson(1e-5) } else { Clutter::Diffuse }
    }
    fn gate(&self) -> &Gate<f64> {
        Sensor::<f64, 6, 2>::gate(&self.0)
    }
}

#[test]
fn a_distant_target_changes_nothing() -> Result<(), TestCaseError> {
    for seed in 0..20 {
        distance_is_nothing::<f32>(seed, &sensor(Clutter::Poisson(1e-5))?)?;
        distance_is_nothing::<f64>(seed, &sensor(Clutter::Poisson(1e-5))?)?;
        distance_is_nothing::<f64>(seed, &Charted(sensor(Clutter::Poisson(1e-5))?))?;
    }
    Ok(())
}

/// A track whose prediction overflows goes, and the one beside it is told the same as without it.
#[test]
fn a_track_that_overflows_takes_no_other_with_it() -> Result<(), TestCaseError> {
    let tracker = joint_tracker::<f32, _, 2, 4>(Logic::unmanaged(), Rule::Off, Enumeration)?;
    let mut states = [JointTrackerState::new(), JointTrackerState::new()];
    // As large as a cue may be: 1e15 for the means of a mode together, 1e30 for its variances.
    let mut wild = settled(0.0, 4.5e14, 0.0, 4.5e14);
    wild.cov = Symmetric::from_diagonal([1.5e29; 6]);
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
fn keeps_identities<'a, T: Real>(tracks: impl Iterator<Item = &'a Track<T, 6, 2>>, seconds: f64) -> bool {
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
