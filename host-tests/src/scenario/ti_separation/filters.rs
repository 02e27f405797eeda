//! The trackers of the separation test: two constant-velocity modes over (x, vx, y, vy), starting tracks by themselves.
//!
//! | name | the library's |
//! |---|---|
//! | `IMM-JPDA` | `ImmJpda` with `Jpda` |
//! | `IMM-JPDA merged` | the same with `MergingJpda`, and a sensor that states its resolution |

use super::data::{CELLS, CLUTTER, Data, FIELD, FRAME_MS, P_DETECT, SIGMAS};
use crate::Failure;
use crate::precision::Scalar;
use crate::scenario::filter::{Fault, detections, jump};
use boresight::association::{Associator, Gate, Jpda, MergingJpda};
use boresight::error::ConfigError;
use boresight::gaussian::Gaussian;
use boresight::initiation::{Initiation, Rule};
use boresight::model::motion::{ConstantVelocity, ProcessNoise};
use boresight::model::radar::{Component, Radar};
use boresight::model::resolution::Resolution;
use boresight::scan::Scan;
use boresight::sensor::{Clutter, Sensor, UniformSensor, Unresolving};
use boresight::symmetric::Symmetric;
use boresight::time::{Duration, Instant};
use boresight::track::{Logic, Status};
use boresight::tracker::{ImmJpda, JointState};
use nalgebra::SVector;

/// The names, in the order of the results.
pub const NAMES: &[&str] = &["IMM-JPDA", "IMM-JPDA merged"];

const NX: usize = 4;
const MODES: usize = 2;
const TRACKS: usize = 8;
const DETS: usize = 16;
const NODES: usize = 128;
const PAIRS: usize = 2;
/// Accelerations as white noise of this density: walking on, and changing speed \[m²/s³\].
const DENSITIES: [f64; MODES] = [0.05, 2.0];
const JUMP: [[f64; MODES]; MODES] = [[0.97, 0.03], [0.1, 0.9]];
const INITIAL: [f64; MODES] = [0.7, 0.3];
const THRESHOLD: f64 = 16.0;
/// Confirmed by 4 hits of 6, deleted after 10 misses.
const LOGIC: [u8; 3] = [4, 6, 10];
/// The fastest object \[m/s\], and its deviation in either axis.
const MAX_SPEED: f64 = 10.0;
const SPEED: f64 = 4.0;

/// The confirmed tracks of a frame: identity and position \[m\].
pub type Frame = Vec<(u32, [f64; 2])>;

/// Runs the filter `name` over a run.
pub fn run<T: Scalar>(name: &str, data: &Data) -> Result<Vec<Frame>, Failure> {
    let follow = || -> Result<Vec<Frame>, Fault> {
        let sensor = radar::<T>()?;
        match name {
            "IMM-JPDA" => follow::<T, _, Jpda<NODES>>(data, &sensor, Jpda::new()),
            _ => {
                let resolution = Resolution::new(CELLS.map(T::lit))?;
                follow::<T, _, MergingJpda<NODES, PAIRS>>(data, &Unresolving { sensor, resolution }, MergingJpda::new(Jpda::new()))
            }
        }
    };
    follow().map_err(|fault| fault.of(name))
}

fn radar<T: Scalar>() -> Result<UniformSensor<Radar<T, 3, 2, 2>, T>, ConfigError> {
    let noise = Symmetric::from_diagonal(SIGMAS.map(|sigma| T::lit(sigma * sigma)));
    let model = Radar::new([Component::Range, Component::Azimuth, Component::RangeRate], noise)?;
    let volume: f64 = FIELD.iter().map(|[from, to]| to - from).product();
    UniformSensor::new(model, T::lit(P_DETECT), Clutter::Poisson(T::lit(CLUTTER / volume)), Gate::new::<3>(T::lit(THRESHOLD))?)
}

fn follow<T: Scalar, S: Sensor<T, NX, 3>, A: Associator<T, TRACKS, DETS>>(
    data: &Data,
    sensor: &S,
    associator: A,
) -> Result<Vec<Frame>, Fault> {
    let noise = |density: f64| ConstantVelocity::<T, 2>::new(ProcessNoise::Continuous(T::lit(density)));
    let modes = [noise(DENSITIES[0])?, noise(DENSITIES[1])?];
    let variances = [1.0, SPEED * SPEED, 1.0, SPEED * SPEED].map(T::lit);
    let prior = Gaussian::new(SVector::zeros(), Symmetric::from_diagonal(variances));
    let pairs = Rule::TwoPoint { max_speed: T::lit(MAX_SPEED), max_gap: Duration::from_millis(250) };
    let [hits, window, misses] = LOGIC;
    let (jump, initial) = (jump(JUMP), INITIAL.map(T::lit));
    let tracker =
        ImmJpda::new(modes, jump, initial, Logic::new(hits, window, misses)?, associator)?.with_initiation(Initiation::new(pairs, prior)?);
    let mut state = Box::new(JointState::<T, NX, MODES, TRACKS, DETS, A>::new());
    let mut frames = Vec::with_capacity(data.plots.len());
    for (plots, time) in data.plots.iter().zip(1..) {
        tracker.step(&mut state, sensor, &Scan::new(Instant::from_millis(FRAME_MS * time), &detections(plots)))?;
        let confirmed = state.estimates().filter(|estimate| estimate.status != Status::Tentative);
        frames.push(confirmed.map(|e| (e.id.number(), [0, 2].map(|i| e.state.mean[i].into()))).collect());
    }
    Ok(frames)
}
