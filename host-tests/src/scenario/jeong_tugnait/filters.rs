//! The filters of the scenario after Jeong and Tugnait: three models over (x, vx, ax, y, vy, ay, z, vz, az).
//!
//! | name | the library's |
//! |---|---|
//! | `CF` | `ImmCoupled`, sensors that say nothing of their resolution |
//! | `MCF` | the same with the sensors' resolution |
//! | `MCF-D` | the same without the covariance between the targets |
//! | `MCF parametric` | `MCF` told the density of clutter |
//! | `IMM-JPDA merged` | `ImmJpda` that pairs tracks which the sensors may not tell apart |
//! | `IMM-JPDA`, `IMM-PDA`, `IMM-NN` | `ImmJpda`, `ImmPdaf`, `ImmPdaf` with the nearest neighbour |
//!
//! All start from the same two densities and take in the radar's scan first, then the infrared sensor's of the same time.

use super::data::{Data, INFRARED, P_DETECT, RADAR, SCANS, START, Sensor as Specified};
use crate::Failure;
use crate::precision::Scalar;
use crate::scenario::filter::{Fault, detections, jump};
use boresight::association::{Gate, Jpda, MergingJpda, NearestNeighbour};
use boresight::coupled::{Coupling, Cross, NoCross};
use boresight::error::{ConfigError, ScanError};
use boresight::gaussian::Gaussian;
use boresight::model::motion::{ConstantAcceleration, ConstantVelocity, ProcessNoise};
use boresight::model::radar::{Component, Radar};
use boresight::model::resolution::Resolution;
use boresight::scan::{Detection, Report, Scan};
use boresight::sensor::{Clutter, Sensor, UniformSensor, Unresolving};
use boresight::symmetric::Symmetric;
use boresight::time::Instant;
use boresight::track::{Logic, TrackId};
use boresight::tracker::{CoupledState, ImmCoupled, ImmJpda, ImmPdaf, Tracker};
use nalgebra::SVector;

/// A filter that runs only when named.
pub const ON_REQUEST: &[&str] = &["IMM-JPDA merged"];
/// The names, in the order of the results.
pub const NAMES: &[&str] = &["CF", "MCF", "MCF-D", "MCF parametric", "IMM-JPDA", "IMM-PDA", "IMM-NN"];

const NX: usize = 9;
/// Models of either target.
pub const MODES: usize = 3;
const DETS: usize = 64;
const THRESHOLD: f64 = 16.0;
pub(crate) const JUMP: [[f64; MODES]; MODES] = [[0.8, 0.1, 0.1], [0.1, 0.8, 0.1], [0.1, 0.1, 0.8]];
pub(crate) const INITIAL: [f64; MODES] = [0.8, 0.1, 0.1];
/// Standard deviations of the models' accelerations, or of their increments \[m/s²\].
const NOISE: [f64; MODES] = [5.0, 7.5, 40.0];

pub(crate) type Modes<T> = (ConstantVelocity<T, 3, 3>, ConstantAcceleration<T, 3>, ConstantAcceleration<T, 3>);
pub(crate) type Seeing<T> = UniformSensor<Radar<T, 2, 3, 3>, T>;

/// What is known of a target after a scan of both sensors.
#[derive(Debug, Clone, Copy)]
pub struct Point {
    /// \[m\]; NaN where the track is gone
    pub position: [f64; 3],
    /// Mode probabilities
    pub prob: [f64; MODES],
    /// Of the coupled filters, that the radar and the infrared sensor saw both as one
    pub unresolved: [f64; 2],
}

/// The points of both targets at scans 1..=87.
pub type Tracks = [Vec<Point>; 2];

/// Runs the filter `name` over a run.
pub fn run<T: Scalar>(name: &str, data: &Data) -> Result<Tracks, Failure> {
    follow_by::<T>(name, data).map_err(|fault| fault.of(name))
}

fn follow_by<T: Scalar>(name: &str, data: &Data) -> Result<Tracks, Fault> {
    let known = name == "MCF parametric";
    let (jump, initial) = (jump(JUMP), INITIAL.map(T::lit));
    let sensors = [seeing::<T>(&RADAR, known)?, seeing(&INFRARED, known)?];
    let unresolving = || -> Result<_, Fault> {
        let cells = |of: &Specified| Resolution::new(of.cells.map(T::lit));
        let [radar, infrared] = sensors;
        Ok([Unresolving { sensor: radar, resolution: cells(&RADAR)? }, Unresolving { sensor: infrared, resolution: cells(&INFRARED)? }])
    };
    match name {
        "CF" => coupled::<T, Cross<T, NX>, _>(data, &sensors),
        "MCF-D" => coupled::<T, NoCross, _>(data, &unresolving()?),
        "MCF" | "MCF parametric" => coupled::<T, Cross<T, NX>, _>(data, &unresolving()?),
        "IMM-JPDA merged" => {
            let joint = MergingJpda::new(Jpda::new());
            let tracker =
                ImmJpda::<T, Modes<T>, NX, MODES, 2, DETS, MergingJpda<96, 1>>::new(modes()?, jump, initial, Logic::unmanaged(), joint)?;
            apart(&tracker, data, &unresolving()?, ImmJpda::start, ImmJpda::step)
        }
        "IMM-JPDA" => {
            let tracker =
                ImmJpda::<T, Modes<T>, NX, MODES, 2, DETS, Jpda<96>>::new(modes()?, jump, initial, Logic::unmanaged(), Jpda::new())?;
            apart(&tracker, data, &sensors, ImmJpda::start, ImmJpda::step)
        }
        _ => {
            let tracker = ImmPdaf::<T, Modes<T>, NX, MODES, 2, DETS>::new(modes()?, jump, initial, Logic::unmanaged())?;
            match name {
                "IMM-NN" => apart(&tracker.with_associator(NearestNeighbour), data, &sensors, ImmPdaf::start, ImmPdaf::step),
                _ => apart(&tracker, data, &sensors, ImmPdaf::start, ImmPdaf::step),
            }
        }
    }
}

pub(crate) fn modes<T: Scalar>() -> Result<Modes<T>, ConfigError> {
    let [quiet, turning, hard] = NOISE.map(|sigma| ProcessNoise::Discrete(T::lit(sigma * sigma)));
    Ok((ConstantVelocity::new(quiet)?, ConstantAcceleration::new(turning)?, ConstantAcceleration::new(hard)?))
}

pub(crate) fn seeing<T: Scalar>(of: &Specified, known: bool) -> Result<Seeing<T>, ConfigError> {
    let components =
        if of.cells == RADAR.cells { [Component::Range, Component::Azimuth] } else { [Component::Azimuth, Component::Elevation] };
    let radar = Radar::new(components, Symmetric::from_diagonal(of.sigmas.map(|sigma| T::lit(sigma * sigma))))?;
    let clutter = if known { Clutter::Poisson(T::lit(of.density)) } else { Clutter::Diffuse };
    // The scenario's weights know no P_G.
    UniformSensor::new(radar, T::lit(P_DETECT), clutter, Gate::new::<2>(T::lit(THRESHOLD))?.with_probability(T::ONE)?)
}

pub(crate) fn start<T: Scalar>(data: &Data) -> [Gaussian<T, NX>; 2] {
    let cov = Symmetric::from_diagonal(std::array::from_fn(|i| T::lit(START[i % 3] * START[i % 3])));
    data.start.map(|at| Gaussian::new(SVector::from(at.map(T::lit)), cov))
}

/// The scans of both sensors in order: when, of which sensor, and what.
pub(crate) fn scans<T: Scalar>(data: &Data) -> impl Iterator<Item = (Instant, [Vec<Detection<T, 2>>; 2])> {
    let [radar, infrared] = &data.plots;
    (1..=SCANS)
        .zip(radar.iter().zip(infrared))
        .map(|(k, (radar, infrared))| (Instant::from_millis(1000 * k as u64), [detections(radar), detections(infrared)]))
}

fn coupled<T: Scalar, C: Coupling<T, NX>, S: Sensor<T, NX, 2>>(data: &Data, sensors: &[S; 2]) -> Result<Tracks, Fault> {
    let filter = ImmCoupled::<T, Modes<T>, NX, MODES, C>::new(modes()?, jump(JUMP), INITIAL.map(T::lit))?;
    let mut state = CoupledState::<T, NX, MODES, DETS, C>::new();
    filter.start(&mut state, start(data), Instant::ZERO).ok_or(Fault::Start)?;
    let mut tracks: Tracks = Default::default();
    for (time, scans) in scans(data) {
        let mut unresolved = [0.0; 2];
        for ((sensor, detections), unresolved) in sensors.iter().zip(&scans).zip(&mut unresolved) {
            filter.step(&mut state, sensor, &Scan::new(time, detections))?;
            *unresolved = state.unresolved_probability().into();
        }
        let targets = state.bank().map(|bank| (bank.combined().targets, [0, 1].map(|target| bank.mode_probabilities(target))));
        for (target, points) in tracks.iter_mut().enumerate() {
            points.push(targets.map_or(NOWHERE, |(states, prob)| point(&states[target], prob[target], unresolved)));
        }
    }
    Ok(tracks)
}

fn apart<T: Scalar, K: Tracker<T, NX, MODES>, S: Sensor<T, NX, 2>>(
    tracker: &K,
    data: &Data,
    sensors: &[S; 2],
    begin: impl Fn(&K, &mut K::State, Gaussian<T, NX>, Instant) -> Option<TrackId>,
    step: impl Fn(&K, &mut K::State, &S, &Scan<'_, T, 2>) -> Result<Report, ScanError>,
) -> Result<Tracks, Fault> {
    let mut state = K::State::default();
    let ids = start(data).map(|g| begin(tracker, &mut state, g, Instant::ZERO));
    let mut tracks: Tracks = Default::default();
    for (time, scans) in scans(data) {
        for (sensor, detections) in sensors.iter().zip(&scans) {
            step(tracker, &mut state, sensor, &Scan::new(time, detections))?;
        }
        for (id, points) in ids.iter().zip(&mut tracks) {
            let id = id.ok_or(Fault::Start)?;
            let track = tracker.tracks(&state).find(|track| track.id() == Some(id));
            points.push(track.map_or(NOWHERE, |track| point(&track.bank().combined(), track.bank().prob, [f64::NAN; 2])));
        }
    }
    Ok(tracks)
}

const NOWHERE: Point = Point { position: [f64::NAN; 3], prob: [f64::NAN; MODES], unresolved: [f64::NAN; 2] };

fn point<T: Scalar>(state: &Gaussian<T, NX>, prob: [T; MODES], unresolved: [f64; 2]) -> Point {
    Point { position: [0, 3, 6].map(|i| state.mean[i].into()), prob: prob.map(Into::into), unresolved }
}
