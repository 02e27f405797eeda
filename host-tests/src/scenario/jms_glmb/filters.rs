//! The filters of both examples.
//!
//! | name | what it is |
//! |---|---|
//! | `GLMB 100`, `GLMB 5` | r = 0.02, at most so many hypotheses; the rest as the others where nothing else is said |
//! | `GLMB tuned` | process noise 1 m/s², probability 0.95 to stay in a mode |
//! | `CV GLMB` | one mode, constant velocity with 1 m/s² |
//! | `IMM-JPDA` | no labelled sets: tracks from pairs of plots, confirmed by 4 hits in 5 scans, with the same modes |
//! | `GLMB UKF`, `GLMB EKF`, `GLMB SMC` | sigma points, linearised, points with random numbers |
//! | `GLMB paper birth` | r = 0.2 |
//! | stress cases | `GLMB r 0.002`, `GLMB P_D 0.9`, `GLMB 300`, `GLMB Gibbs`, `GLMB plots` (births from plots); `GLMB 1 deg`, `GLMB 0.1 deg` |
//!
//! All have room for 128 detections, which no scan of sixty clutter points exceeds.

use super::data::{self, Data, Motion, SCANS, Sensor};
use crate::Failure;
use crate::precision::Scalar;
use crate::scenario::filter::{Fault, detections};
use boresight::association::{Gate, Jpda};
use boresight::error::ConfigError;
use boresight::gaussian::Gaussian;
use boresight::glmb::{Density, Gibbs, Mixture, Particles, Ranked, Region, Truncation};
use boresight::initiation::{Initiation, Rule};
use boresight::mode::{JumpMatrix, ModeSet};
use boresight::model::motion::{ConstantVelocity, ProcessNoise};
use boresight::model::position::Position;
use boresight::model::radar::{Component, Radar};
use boresight::model::turn::{KnownTurn, UnknownTurn};
use boresight::model::unscented::{Scaling, Unscented};
use boresight::scan::Scan;
use boresight::sensor::{Clutter, UniformSensor};
use boresight::symmetric::Symmetric;
use boresight::time::{Duration, Instant};
use boresight::track::{Logic, Status};
use boresight::tracker::{GlmbState, ImmJpda, JmsGlmb, JointState};
use nalgebra::SVector;
use rand_chacha::ChaCha8Rng;

/// Names of the linear example, and those that run only when named.
pub const LINEAR: &[&str] = &["GLMB 100", "GLMB 5", "GLMB tuned", "CV GLMB", "IMM-JPDA"];
pub const LINEAR_ON_REQUEST: &[&str] = &["GLMB paper birth", "GLMB r 0.002", "GLMB P_D 0.9", "GLMB 300", "GLMB Gibbs", "GLMB plots"];
/// Names of the nonlinear example, and those that run only when named.
pub const NONLINEAR: &[&str] = &["GLMB UKF", "GLMB EKF", "GLMB SMC", "GLMB paper birth"];
pub const NONLINEAR_ON_REQUEST: &[&str] = &["GLMB 1 deg", "GLMB 0.1 deg"];

/// Capacities: tracks, hypotheses in the making, targets of one, detections of a track, detections.
const SLOTS: usize = 512;
const HYPS: usize = 1024;
const LABELS: usize = 16;
const GATED: usize = 8;
const DETS: usize = 128;
/// Points of a track.
pub const POINTS: usize = 2000;
/// Tracks of points: they are large.
const POINT_SLOTS: usize = 128;
/// Births in a scan.
const BIRTHS: usize = 8;

type Murty = Ranked<100, 64>;
type Memory<T, D, A, const SLOTS: usize> = GlmbState<T, D, A, SLOTS, HYPS, LABELS, GATED, DETS>;

/// Hypotheses lighter than e^{−11.5} of the heaviest go.
const LEAST_SHARE: f64 = 1.01e-5;
pub(crate) const P_SURVIVE: f64 = 0.99;
pub(crate) const P_DETECT: f64 = 0.97;
/// Deviations of a new target's position \[m\], velocity \[m/s\] and turn rate \[rad/s\].
const BIRTH_SIGMA: [f64; 3] = [1000.0, 300.0, 0.01];
/// Deviation of the position sensor in each axis \[m\].
pub(crate) const SIGMA: f64 = 40.0;
/// Deviations of the polar sensor \[degrees, m\].
const POLAR: [f64; 2] = [0.2, 50.0];

/// One estimate at one scan.
#[derive(Debug, Clone)]
pub struct Point {
    /// Which track
    pub label: u64,
    /// (x, y) \[m\]
    pub position: [f64; 2],
    /// The mode probabilities
    pub modes: Vec<f64>,
}

impl Point {
    /// Whether its most probable mode is the one of `motion`; with two modes both turns are the second.
    pub fn is_in(&self, motion: Motion) -> Option<bool> {
        let mode = (motion as usize).min(self.modes.len() - 1);
        let likely = self.modes.iter().enumerate().max_by(|a, b| a.1.total_cmp(b.1))?.0;
        (self.modes.len() > 1).then_some(likely == mode)
    }
}

/// The estimates by scan, and the worst that was given up.
#[derive(Debug, Clone, Default)]
pub struct Estimates {
    /// By scan
    pub points: Vec<Vec<Point>>,
    /// The largest truncated mass of a scan
    pub truncated: f32,
    /// The most tracks in the table
    pub tracks: usize,
}

/// What distinguishes a GLMB filter.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Setting {
    pub(crate) births: f64,
    most: usize,
    /// Process noise \[m/s²\]
    acceleration: f64,
    /// Probability to stay in a mode
    pub(crate) stay: f64,
    p_detect: f64,
}

pub(crate) const LINEAR_SETTING: Setting = Setting { births: 0.02, most: 100, acceleration: 5.0, stay: 0.8, p_detect: P_DETECT };
const NONLINEAR_SETTING: Setting = Setting { stay: 0.9, ..LINEAR_SETTING };

/// Runs a filter of the linear example over the data of a run.
pub fn linear<T: Scalar>(name: &str, data: &Data, rng: &mut ChaCha8Rng) -> Result<Estimates, Failure> {
    let setting = match name {
        "GLMB 5" => Setting { most: 5, ..LINEAR_SETTING },
        "GLMB 300" => Setting { most: 300, ..LINEAR_SETTING },
        "GLMB tuned" => Setting { acceleration: 1.0, stay: 0.95, ..LINEAR_SETTING },
        "CV GLMB" => Setting { acceleration: 1.0, ..LINEAR_SETTING },
        "GLMB paper birth" => Setting { births: 0.2, ..LINEAR_SETTING },
        "GLMB r 0.002" => Setting { births: 0.002, ..LINEAR_SETTING },
        "GLMB P_D 0.9" => Setting { p_detect: 0.9, ..LINEAR_SETTING },
        _ => LINEAR_SETTING,
    };
    let plots = data.plots(Sensor::Position(SIGMA), setting.p_detect);
    let mut run = || -> Result<Estimates, Fault> {
        let sensor = plane::<T>(setting.p_detect)?;
        match name {
            "IMM-JPDA" => imm_jpda(&sensor, &plots),
            "CV GLMB" => {
                let modes = (ConstantVelocity::<T, 2>::new(noise(setting.acceleration))?,);
                let tracker = regions(JmsGlmb::new(modes, [[T::ONE]], T::lit(P_SURVIVE), Murty {})?, setting)?;
                glmb::<T, _, Mixture<T, 4, 1, 1>, _, _, 4, 1, SLOTS>(&tracker, &sensor, &plots, rng)
            }
            "GLMB Gibbs" => {
                let tracker = regions(JmsGlmb::new(three(setting)?, jump(setting.stay), T::lit(P_SURVIVE), Gibbs::<100>)?, setting)?;
                glmb::<T, _, Mixture<T, 4, 3, 1>, _, _, 4, 3, SLOTS>(&tracker, &sensor, &plots, rng)
            }
            "GLMB plots" => {
                let tracker = JmsGlmb::<T, _, _, 4, 3, BIRTHS>::new(three(setting)?, jump(setting.stay), T::lit(P_SURVIVE), Murty {})?;
                let tracker = tracker.with_limits(setting.most, T::lit(LEAST_SHARE))?;
                let initial = [T::ONE, T::ZERO, T::ZERO];
                let tracker =
                    tracker.with_initiation(Initiation::new(Rule::OnePoint, birth([0.0; 2]))?, T::lit(0.06), T::lit(0.02), initial)?;
                glmb::<T, _, Mixture<T, 4, 3, 1>, _, _, 4, 3, SLOTS>(&tracker, &sensor, &plots, rng)
            }
            _ => {
                let tracker = regions(JmsGlmb::new(three(setting)?, jump(setting.stay), T::lit(P_SURVIVE), Murty {})?, setting)?;
                glmb::<T, _, Mixture<T, 4, 3, 1>, _, _, 4, 3, SLOTS>(&tracker, &sensor, &plots, rng)
            }
        }
    };
    run().map_err(|fault| fault.of(name))
}

/// Runs a filter of the nonlinear example over the data of a run.
pub fn nonlinear<T: Scalar>(name: &str, data: &Data, rng: &mut ChaCha8Rng) -> Result<Estimates, Failure> {
    let setting = match name {
        "GLMB paper birth" => Setting { births: 0.2, ..NONLINEAR_SETTING },
        _ => NONLINEAR_SETTING,
    };
    let [degrees, range] = match name {
        "GLMB 1 deg" => [1.0, 50.0],
        "GLMB 0.1 deg" => [0.1, 20.0],
        _ => POLAR,
    };
    let sigma = [degrees.to_radians(), range];
    let plots = data.plots(Sensor::Polar(sigma), setting.p_detect);
    let mut run = || -> Result<Estimates, Fault> {
        let sensor = polar::<T>(sigma, setting.p_detect)?;
        let rate_noise = ProcessNoise::Discrete(T::lit(0.03 * 0.03));
        let cv = ConstantVelocity::<T, 2>::new(noise(setting.acceleration))?;
        let turn = UnknownTurn::<T, 2>::new(noise(setting.acceleration), rate_noise)?;
        // n + κ = n + 2
        let scaling = Scaling::new::<5>(T::ONE, T::ZERO, T::lit(2.0))?;
        let (p_survive, jump) = (T::lit(P_SURVIVE), jump(setting.stay));
        match name {
            "GLMB EKF" => {
                let tracker = regions(JmsGlmb::new((cv, turn), jump, p_survive, Murty {})?, setting)?;
                glmb::<T, _, Mixture<T, 5, 2, 1>, _, _, 5, 2, SLOTS>(&tracker, &sensor, &plots, rng)
            }
            "GLMB SMC" => {
                let tracker = regions(JmsGlmb::new((cv, turn), jump, p_survive, Murty {})?, setting)?;
                glmb::<T, _, Particles<T, 5, 2, POINTS>, _, _, 5, 2, POINT_SLOTS>(&tracker, &sensor, &plots, rng)
            }
            _ => {
                let sensor = sensor.with_model(Unscented { model: sensor.model, scaling });
                let tracker = regions(JmsGlmb::new((cv, Unscented { model: turn, scaling }), jump, p_survive, Murty {})?, setting)?;
                glmb::<T, _, Mixture<T, 5, 2, 1>, _, _, 5, 2, SLOTS>(&tracker, &sensor, &plots, rng)
            }
        }
    };
    run().map_err(|fault| fault.of(name))
}

fn noise<T: Scalar>(acceleration: f64) -> ProcessNoise<T> {
    ProcessNoise::Discrete(T::lit(acceleration * acceleration))
}

/// Straight on, right and left.
pub(crate) type Three<T> = (ConstantVelocity<T, 2>, KnownTurn<T, 2>, KnownTurn<T, 2>);

pub(crate) fn three<T: Scalar>(setting: Setting) -> Result<Three<T>, ConfigError> {
    let (noise, rate) = (noise(setting.acceleration), T::lit(data::TURN_RATE));
    Ok((ConstantVelocity::new(noise)?, KnownTurn::new(-rate, noise)?, KnownTurn::new(rate, noise)?))
}

/// The same probability for all jumps.
pub(crate) fn jump<T: Scalar, const MODES: usize>(stay: f64) -> JumpMatrix<T, MODES> {
    let other = (1.0 - stay) / (MODES - 1) as f64;
    std::array::from_fn(|i| std::array::from_fn(|j| T::lit(if i == j { stay } else { other })))
}

fn gate<T: Scalar>() -> Result<Gate<T>, ConfigError> {
    Gate::new::<2>(T::lit(25.0))
}

pub(crate) fn plane<T: Scalar>(p_detect: f64) -> Result<UniformSensor<Position<T, 2, 2>, T>, ConfigError> {
    let area = (2.0 * data::HALF_SIDE).powi(2);
    let model = Position::new(Symmetric::from_diagonal([T::lit(SIGMA * SIGMA); 2]))?;
    UniformSensor::new(model, T::lit(p_detect), Clutter::Poisson(T::lit(data::CLUTTER / area)), gate()?)
}

fn polar<T: Scalar>(sigma: [f64; 2], p_detect: f64) -> Result<UniformSensor<Radar<T, 2, 2, 2>, T>, ConfigError> {
    let area = 2.0 * std::f64::consts::PI * data::MOST_RANGE;
    let model = Radar::new([Component::Azimuth, Component::Range], Symmetric::from_diagonal(sigma.map(|s| T::lit(s * s))))?;
    UniformSensor::new(model, T::lit(p_detect), Clutter::Poisson(T::lit(data::CLUTTER / area)), gate()?)
}

/// A new target about `place`.
pub(crate) fn birth<T: Scalar, const NX: usize>(place: [f64; 2]) -> Gaussian<T, NX> {
    let mean = SVector::from_fn(|i, _| T::lit(if i % 2 == 0 && i < 4 { place[i / 2] } else { 0.0 }));
    let sigma = |i: usize| BIRTH_SIGMA[if i == 4 { 2 } else { i % 2 }];
    Gaussian::new(mean, Symmetric::from_diagonal(std::array::from_fn(|i| T::lit(sigma(i) * sigma(i)))))
}

type Tracker<T, M, A, const NX: usize, const MODES: usize> = JmsGlmb<T, M, A, NX, MODES, BIRTHS>;

fn regions<T: Scalar, M: ModeSet<T, NX, MODES>, A, const NX: usize, const MODES: usize>(
    tracker: Tracker<T, M, A, NX, MODES>,
    setting: Setting,
) -> Result<Tracker<T, M, A, NX, MODES>, ConfigError> {
    let initial = std::array::from_fn(|mode| if mode == 0 { T::ONE } else { T::ZERO });
    let tracker = tracker.with_limits(setting.most, T::lit(LEAST_SHARE))?;
    data::BIRTHS
        .iter()
        .try_fold(tracker, |tracker, place| tracker.with_region(Region::new(T::lit(setting.births), birth(*place), initial)?))
}

fn time(k: usize) -> Instant {
    Instant::from_millis(data::STEP_MS * (k as u64 + 1))
}

fn glmb<T, M, D, A, S, const NX: usize, const MODES: usize, const SLOTS: usize>(
    tracker: &Tracker<T, M, A, NX, MODES>,
    sensor: &S,
    plots: &[Vec<[f64; 2]>],
    rng: &mut ChaCha8Rng,
) -> Result<Estimates, Fault>
where
    T: Scalar,
    M: ModeSet<T, NX, MODES>,
    D: Density<T, NX, MODES>,
    A: Truncation<T, LABELS>,
    S: boresight::sensor::Sensor<T, NX, 2>,
{
    let mut memory = Box::new(Memory::<T, D, A, SLOTS>::new());
    let mut estimates = Estimates::default();
    for k in 0..SCANS {
        let report = tracker.step_with(&mut memory, sensor, &Scan::new(time(k), &detections(&plots[k])), rng)?;
        if report.detections_dropped > 0 {
            return Err(Fault::Dropped(report));
        }
        estimates.truncated = estimates.truncated.max(report.truncated_mass);
        estimates.tracks = estimates.tracks.max(memory.tracks());
        let points = memory.estimates().map(|e| Point {
            label: u64::from(e.label.birth_scan) << 16 | u64::from(e.label.index),
            position: [0, 2].map(|i| e.state.mean[i].into()),
            modes: e.modes.map(Into::into).to_vec(),
        });
        estimates.points.push(points.collect());
    }
    Ok(estimates)
}

/// Room for tracks, and nodes of a layer in joint association.
const TRACKS: usize = 64;
const NODES: usize = 256;

fn imm_jpda<T: Scalar>(sensor: &UniformSensor<Position<T, 2, 2>, T>, plots: &[Vec<[f64; 2]>]) -> Result<Estimates, Fault> {
    let logic = Logic::new(4, 5, 4)?.with_duplicate_distance(T::lit(2.0))?;
    let initial = [T::ONE, T::ZERO, T::ZERO];
    let pairs = Rule::TwoPoint { max_speed: T::lit(300.0), max_gap: Duration::from_millis(data::STEP_MS as i64) };
    let tracker = ImmJpda::<T, _, 4, 3, TRACKS, DETS, Jpda<NODES>>::new(three(LINEAR_SETTING)?, jump(0.8), initial, logic, Jpda::new())?
        .with_initiation(Initiation::new(pairs, birth([0.0; 2]))?);
    let mut state = Box::new(JointState::<T, 4, 3, TRACKS, DETS, Jpda<NODES>>::new());
    let mut estimates = Estimates::default();
    for k in 0..SCANS {
        let report = tracker.step(&mut state, sensor, &Scan::new(time(k), &detections(&plots[k])))?;
        if report.detections_dropped > 0 {
            return Err(Fault::Dropped(report));
        }
        let confirmed = state.tracks().filter(|track| track.status() != Status::Tentative);
        let points = confirmed.filter_map(|track| {
            let g = track.bank().combined();
            Some(Point {
                label: u64::from(track.id()?.number()),
                position: [0, 2].map(|i| g.mean[i].into()),
                modes: track.bank().prob.map(Into::into).to_vec(),
            })
        });
        estimates.points.push(points.collect());
    }
    Ok(estimates)
}
