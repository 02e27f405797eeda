//! Whole trackers on the desk: the recorded scans of the firmware example, in single and double precision.
//!
//! ```text
//! cargo bench -p host-tests --bench trackers                    all, in a quarter of a minute
//! PYTHON=venv/bin/python cargo bench ...                        beside Python: `pip install stonesoup pyehm` there
//!
//! IMM-PDAF, IMM-JPDAF    those of `twin::radar`: six states, three modes; they start, confirm and delete tracks themselves
//! JPDAF                  four states, one mode; the four targets are given at the first scan, and that is all there is
//! ```
//!
//! Four targets and six false plots a scan, 60 scans of range and azimuth. Times are of one scan, all in: prediction, gating,
//! association, update, life of the tracks.
//!
//! Stone Soup, in Python with numpy, runs the JPDAF: the same model, noise, clutter, gate and tracks, an extended Kalman filter,
//! joint hypotheses by its own JPDA and by PyEHM's EHM2, mixtures reduced by their moments. It has to end with our tracks to a
//! thousandth of a standard deviation, and so has our single precision to a hundredth; otherwise the run fails.
//!
//! Criterion times and compares with its last run; the table in the end takes the shortest batch of each and divides within this
//! run.

#[path = "../support/mod.rs"]
mod support;

use boresight::association::{Gate, Jpda};
use boresight::error::ConfigError;
use boresight::gaussian::Gaussian;
use boresight::initiation::{Initiation, Rule};
use boresight::model::motion::{ConstantAcceleration, ConstantVelocity, ProcessNoise};
use boresight::model::radar::{Component, Radar};
use boresight::scalar::Real;
use boresight::scan::{Detection, Scan};
use boresight::sensor::{Clutter, UniformSensor};
use boresight::symmetric::Symmetric;
use boresight::time::{Duration, Instant};
use boresight::track::Logic;
use boresight::tracker::{ImmJpda, ImmPdaf, JointState, State, Tracker};
use criterion::measurement::WallTime;
use criterion::{BenchmarkGroup, Criterion};
use nalgebra::SVector;
use serde::{Deserialize, Serialize};
use std::error::Error;
use std::hint::black_box;
use support::{ask, shortest, times};
use twin::data::{PERIOD_MILLIS, SCANS};
use twin::radar::{CLUTTER_DENSITY, DETS, NODES, P_DETECT, SIGMA_AZIMUTH, SIGMA_RANGE, TRACKS};

/// γ
const THRESHOLD: f64 = 16.0;
/// White acceleration of the JPDAF [m²/s³]
const NOISE: f64 = 60.0;
/// Standard deviations of the given tracks [m, m/s]
const SIGMA: [f64; 2] = [30.0, 10.0];
/// Where the targets are at the first scan: (x, vx, y, vy)
const TARGETS: [[f64; 4]; 4] = [[9e3, -200.0, 3e3, 60.0], [-4e3, 150.0, 8e3, -120.0], [-6e3, 200.0, 6e3, 0.0], [-6e3, 200.0, 6.6e3, -20.0]];
/// How far tracks may end from ours in double precision, in standard deviations.
const AGREEMENT: f64 = 1e-3;
const SINGLE: f64 = 1e-2;

type Sensor<T, const STRIDE: usize> = UniformSensor<Radar<T, 2, 2, STRIDE>, T>;
type Modes<T> = (ConstantVelocity<T, 2, 3>, ConstantAcceleration<T, 2>, ConstantAcceleration<T, 2>);
type Single<T> = ImmPdaf<T, Modes<T>, 6, 3, TRACKS, DETS>;
type Joint<T> = ImmJpda<T, Modes<T>, 6, 3, TRACKS, DETS, Jpda<NODES>>;
type Given<T> = ImmJpda<T, (ConstantVelocity<T, 2>,), 4, 1, TRACKS, DETS, Jpda<NODES>>;
type GivenState<T> = JointState<T, 4, 1, TRACKS, DETS, Jpda<NODES>>;

/// Seconds of a scan.
struct Row {
    name: &'static str,
    single: f64,
    double: f64,
}

/// What `time_stonesoup.py` is to compute, and where it must end.
#[derive(Serialize)]
struct Question {
    scans: Vec<Vec<[f32; 2]>>,
    period: f64,
    sigma_range: f32,
    sigma_azimuth: f32,
    p_detect: f32,
    clutter_density: f32,
    threshold: f64,
    noise: f64,
    targets: [[f64; 4]; 4],
    sigma: [f64; 2],
    means: Vec<Vec<f64>>,
    covs: Vec<Vec<f64>>,
}

/// What it found.
#[derive(Deserialize)]
struct Answer {
    version: String,
    /// Seconds of a scan, JPDA and EHM2
    jpda: f64,
    ehm2: f64,
    /// The largest difference from our tracks in standard deviations
    difference: f64,
}

fn lit<T: Real>(x: f32) -> T {
    T::lit(f64::from(x))
}

fn sensor<T: Real, const STRIDE: usize>() -> Result<Sensor<T, STRIDE>, ConfigError> {
    let variances = [SIGMA_RANGE, SIGMA_AZIMUTH].map(|s| lit::<T>(s) * lit(s));
    let radar = Radar::new([Component::Range, Component::Azimuth], Symmetric::from_diagonal(variances))?;
    UniformSensor::new(radar, lit(P_DETECT), Clutter::Poisson(lit(CLUTTER_DENSITY)), Gate::new::<2>(T::lit(THRESHOLD))?)
}

/// The parts of `twin::radar::tracker` in either precision.
fn managed<T: Real>() -> Result<(Single<T>, Joint<T>), ConfigError> {
    let acceleration = |variance: f64| ProcessNoise::Discrete(T::lit(variance));
    let modes = (
        ConstantVelocity::new(acceleration(0.1))?,
        ConstantAcceleration::new(acceleration(1.0))?,
        ConstantAcceleration::new(acceleration(64.0))?,
    );
    let jump = [[0.92, 0.05, 0.03], [0.06, 0.9, 0.04], [0.1, 0.3, 0.6]].map(|row: [f64; 3]| row.map(T::lit));
    let initial = [0.8, 0.15, 0.05].map(T::lit);
    let logic = Logic::new(4, 6, 5)?.with_position_limit(T::lit(1500.0))?.with_duplicate_distance(T::ONE)?;
    let prior = Gaussian::new(SVector::zeros(), Symmetric::from_diagonal([1.0, 1e4, 25.0, 1.0, 1e4, 25.0].map(T::lit)));
    let rule = Rule::TwoPoint { max_speed: T::lit(350.0), max_gap: Duration::from_millis(2500) };
    let initiation = Initiation::new(rule, prior)?;
    let single = ImmPdaf::new(modes, jump, initial, logic)?.with_initiation(initiation);
    Ok((single, ImmJpda::new(modes, jump, initial, logic, Jpda::new())?.with_initiation(initiation)))
}

fn given<T: Real>() -> Result<Given<T>, ConfigError> {
    let modes = (ConstantVelocity::new(ProcessNoise::Continuous(T::lit(NOISE)))?,);
    ImmJpda::new(modes, [[T::ONE]], [T::ONE], Logic::unmanaged(), Jpda::new())
}

/// The state with the four targets.
fn started<T: Real>(tracker: &Given<T>) -> GivenState<T> {
    let mut state = GivenState::new();
    let variances = [SIGMA[0], SIGMA[1], SIGMA[0], SIGMA[1]].map(|s| T::lit(s * s));
    for target in TARGETS {
        let g = Gaussian::new(SVector::from(target.map(T::lit)), Symmetric::from_diagonal(variances));
        tracker.start(&mut state, g, Instant::from_millis(0));
    }
    state
}

/// The scans in the precision of `T`.
fn scans<T: Real>() -> Vec<Vec<Detection<T, 2>>> {
    SCANS.iter().map(|plots| plots.iter().map(|z| Detection::new(z.map(lit))).collect()).collect()
}

/// Takes in all scans.
fn follow<T: Real, K: Tracker<T, NX, MODES>, const NX: usize, const MODES: usize, const STRIDE: usize>(
    tracker: &K,
    state: &mut K::State,
    sensor: &Sensor<T, STRIDE>,
    scans: &[Vec<Detection<T, 2>>],
) {
    for (k, plots) in (0..).zip(scans) {
        let scan = Scan::new(Instant::from_millis(PERIOD_MILLIS * k), plots);
        black_box(tracker.step(state, sensor, &scan)).expect("recorded scans are in order and finite");
    }
}

/// Times `tracker` in one precision, from a state that `start` makes; seconds of a scan.
fn time<T: Real, K: Tracker<T, NX, MODES>, const NX: usize, const MODES: usize, const STRIDE: usize>(
    group: &mut BenchmarkGroup<'_, WallTime>,
    name: &str,
    tracker: &K,
    start: impl Fn() -> K::State,
) -> Result<Option<f64>, ConfigError> {
    let (sensor, scans) = (sensor::<T, STRIDE>()?, scans::<T>());
    let seconds = shortest(group, name, || {
        let mut state = start();
        follow(black_box(tracker), &mut state, &sensor, &scans);
        black_box(&state);
    });
    Ok(seconds.map(|seconds| seconds / scans.len() as f64))
}

/// The four given tracks after the last scan.
fn ends<T: Real>() -> Result<Vec<Gaussian<f64, 4>>, ConfigError> {
    let tracker = given::<T>()?;
    let mut state = started(&tracker);
    follow(&tracker, &mut state, &sensor::<T, 2>()?, &scans());
    let wide =
        |g: Gaussian<T, 4>| Gaussian::new(g.mean.map(|v| v.to_f64()), Symmetric::from_matrix(&g.cov.to_matrix().map(|v| v.to_f64())));
    Ok(state.estimates().map(|e| wide(e.state)).collect())
}

/// The largest difference of a mean in standard deviations.
fn apart(a: &[Gaussian<f64, 4>], b: &[Gaussian<f64, 4>]) -> f64 {
    let entries = |(a, b): (&Gaussian<f64, 4>, &Gaussian<f64, 4>)| {
        let sigma = b.cov.to_matrix().diagonal().map(f64::sqrt);
        (a.mean - b.mean).component_div(&sigma).abs().max()
    };
    if a.len() == b.len() { a.iter().zip(b).map(entries).fold(0.0, f64::max) } else { f64::INFINITY }
}

fn measure(criterion: &mut Criterion) -> Result<Vec<Row>, ConfigError> {
    let mut group = criterion.benchmark_group("trackers");
    let ((single, joint), (single64, joint64)) = (managed::<f32>()?, managed::<f64>()?);
    let (given, given64) = (given::<f32>()?, given::<f64>()?);
    let g = &mut group;
    let found = [
        (
            "IMM-PDAF",
            time::<f32, _, 6, 3, 3>(g, "IMM-PDAF, f32", &single, State::new)?,
            time::<f64, _, 6, 3, 3>(g, "IMM-PDAF, f64", &single64, State::new)?,
        ),
        (
            "IMM-JPDAF",
            time::<f32, _, 6, 3, 3>(g, "IMM-JPDAF, f32", &joint, JointState::new)?,
            time::<f64, _, 6, 3, 3>(g, "IMM-JPDAF, f64", &joint64, JointState::new)?,
        ),
        (
            "JPDAF",
            time::<f32, _, 4, 1, 2>(g, "JPDAF, f32", &given, || started(&given))?,
            time::<f64, _, 4, 1, 2>(g, "JPDAF, f64", &given64, || started(&given64))?,
        ),
    ];
    group.finish();
    Ok(found.into_iter().filter_map(|(name, single, double)| Some(Row { name, single: single?, double: double? })).collect())
}

fn main() -> Result<(), Box<dyn Error>> {
    let brief = |c: Criterion| c.warm_up_time(std::time::Duration::from_millis(200)).measurement_time(std::time::Duration::from_secs(1));
    let mut criterion = brief(Criterion::default().without_plots().sample_size(20).nresamples(5_000)).configure_from_args();
    let found = measure(&mut criterion)?;
    if found.is_empty() {
        return Ok(());
    }
    let tracks = ends::<f64>()?;
    let off = apart(&ends::<f32>()?, &tracks);
    if off > SINGLE {
        return Err(format!("single precision is off by {off} standard deviations").into());
    }
    let question = Question {
        scans: SCANS.iter().map(|plots| plots.to_vec()).collect(),
        period: PERIOD_MILLIS as f64 / 1e3,
        sigma_range: SIGMA_RANGE,
        sigma_azimuth: SIGMA_AZIMUTH,
        p_detect: P_DETECT,
        clutter_density: CLUTTER_DENSITY,
        threshold: THRESHOLD,
        noise: NOISE,
        targets: TARGETS,
        sigma: SIGMA,
        means: tracks.iter().map(|g| g.mean.iter().copied().collect()).collect(),
        covs: tracks.iter().map(|g| g.cov.to_matrix().iter().copied().collect()).collect(),
    };
    let answer: Option<Answer> = ask("trackers/time_stonesoup.py", &question)?;
    println!("\n| tracker | f32 [us a scan] | f64 [us a scan] | f64 / f32 |\n|---|--:|--:|--:|");
    for Row { name, single, double } in &found {
        println!("| {name} | {:.2} | {:.2} | {} |", single * 1e6, double * 1e6, times(double / single));
    }
    if let (Some(answer), Some(ours)) = (answer, found.iter().find(|row| row.name == "JPDAF")) {
        if answer.difference.is_nan() || answer.difference > AGREEMENT {
            return Err(format!("Stone Soup ends {} standard deviations from here", answer.difference).into());
        }
        for (name, seconds) in [("JPDA", answer.jpda), ("EHM2 of PyEHM", answer.ehm2)] {
            let ratio = times(seconds / ours.double);
            println!("Stone Soup {}, JPDAF by {name}: {:.1} ms a scan, {ratio} the time of ours in f64.", answer.version, seconds * 1e3);
        }
    }
    Ok(())
}
