//! The filters of scenario b.
//!
//! | name | sensors | association | combination |
//! |---|---|---|---|
//! | `paper fused` | an `ImmPdaf` each, in its own frame | PDA as printed | convex |
//! | `proper fused convex` | the same | PDA | convex |
//! | `proper fused CI` | the same | PDA | covariance intersection, weight ½ |
//! | `centralised` | one `ImmJpda` takes in the plots of both, one scan after the other | joint | none needed |
//!
//! All of them CV 0.1 and CA 30 (case 1), two-point initiation, confirmed by 3 hits of 4 scans and deleted after 5 misses. The
//! centralised tracker sees targets 3 and 4 in every other of its scans only: 3 hits of 8, 10 misses. In quiet flight it errs a
//! little more than the fused tracks: all filters assume ten times the process noise that there is, and twice the data then
//! make it follow the noise, where the average of two filters does not.

use super::data::{Data, P_DETECT, R, SCANS, SENSORS};
use crate::Failure;
use crate::precision::Scalar;
use crate::scenario::filter::{Fault, detections, jump};
use boresight::association::{Gate, Jpda, Pda, PrintedPda, SingleAssociator};
use boresight::error::ConfigError;
use boresight::fusion::{Combiner, Frame, FusedPicture, Limits, Rule, Weight};
use boresight::gaussian::Gaussian;
use boresight::initiation::{self, Initiation};
use boresight::mode::{JumpMatrix, ModeBank};
use boresight::model::motion::{ConstantAcceleration, ConstantVelocity, ProcessNoise};
use boresight::model::position::Position;
use boresight::scan::Scan;
use boresight::sensor::{Clutter, UniformSensor};
use boresight::symmetric::Symmetric;
use boresight::time::{Duration, Instant};
use boresight::track::{Logic, Status, Track, TrackId};
use boresight::tracker::{ImmJpda, ImmPdaf, JointState, State};
use nalgebra::SVector;

/// The names, in the order of the results.
pub const NAMES: &[&str] = &["paper fused", "proper fused convex", "proper fused CI", "centralised"];

/// Room for tracks, one list's and fused ones, and for the largest scan in a million.
const TRACKS: usize = 16;
const DETS: usize = 48;
/// Nodes of a layer in joint association: more than clusters of this scenario need.
const NODES: usize = 64;

const JUMP: JumpMatrix<f64, 2> = [[0.88, 0.12], [1.0 / 15.0, 1.0 - 1.0 / 15.0]];

type Modes<T> = (ConstantVelocity<T, 2, 3>, ConstantAcceleration<T, 2>);
type Sensor<T> = UniformSensor<Position<T, 2, 3>, T>;

/// One track at one scan.
#[derive(Debug, Clone)]
pub struct Point {
    /// Which track
    pub id: u32,
    /// (x, vx, y, vy) \[m, m/s\]
    pub state: [f64; 4],
    /// Its covariance, 4 × 4
    pub cov: Vec<f64>,
    /// Probability of the second mode
    pub p_manoeuvre: f64,
}

/// All confirmed tracks by scan.
pub type Tracks = Vec<Vec<Point>>;

/// Runs the filter `name` over the data of a run.
pub fn run<T: Scalar>(name: &str, data: &Data) -> Result<Tracks, Failure> {
    let half = Rule::Intersection(Weight::Fixed(T::lit(0.5)));
    let tracks = match name {
        "paper fused" => fused::<T, _>(PrintedPda, Rule::NaiveConvex, data),
        "proper fused convex" => fused::<T, _>(Pda, Rule::NaiveConvex, data),
        "proper fused CI" => fused::<T, _>(Pda, half, data),
        _ => centralised::<T>(data),
    };
    tracks.map_err(|fault| fault.of(name))
}

fn modes<T: Scalar>() -> Result<Modes<T>, ConfigError> {
    let noise = |variance: f64| ProcessNoise::Discrete(T::lit(variance));
    Ok((ConstantVelocity::new(noise(0.1))?, ConstantAcceleration::new(noise(30.0))?))
}

fn initial<T: Scalar>() -> [T; 2] {
    [T::lit(0.9), T::lit(0.1)]
}

/// Pairs of plots of two successive scans that a target of 40 m/s could have caused.
fn initiation<T: Scalar>() -> Result<Initiation<T, 6>, ConfigError> {
    let variances = [1.0, 1e4, 1.0, 1.0, 1e4, 1.0].map(T::lit);
    let rule = initiation::Rule::TwoPoint { max_speed: T::lit(40.0), max_gap: Duration::from_millis(1000) };
    Initiation::new(rule, Gaussian::new(SVector::zeros(), Symmetric::from_diagonal(variances)))
}

/// Tracks closer than four deviations in all are one; beyond √1e5 m of uncertainty they are none.
fn logic<T: Scalar>(window: u8, misses: u8) -> Result<Logic<T>, ConfigError> {
    Logic::new(3, window, misses)?.with_position_limit(T::lit(316.0))?.with_duplicate_distance(T::lit(2.0))
}

/// A sensor at `origin` of the frame that its tracker works in.
fn sensor<T: Scalar>(origin: [f64; 2]) -> Result<Sensor<T>, ConfigError> {
    let gate = Gate::new::<2>(T::lit(25.0))?.with_probability(T::lit(0.99998))?;
    let model = Position::new(Symmetric::from_diagonal([T::lit(R); 2]))?.at(SVector::from(origin.map(T::lit)));
    UniformSensor::new(model, T::lit(P_DETECT), Clutter::Diffuse, gate)
}

fn point<T: Scalar>(id: TrackId, g: &Gaussian<T, 6>, prob: &[T; 2]) -> Point {
    let place = [0, 1, 3, 4];
    let cov = (0..16).map(|k| g.cov.get(place[k / 4], place[k % 4]).map_or(f64::NAN, Into::into)).collect();
    Point { id: id.number(), state: place.map(|i| g.mean[i].into()), cov, p_manoeuvre: prob[1].into() }
}

/// Identity and density of a track that is confirmed.
fn confirmed<T: Scalar>(track: &Track<T, 6, 2>) -> Option<(TrackId, &ModeBank<T, 6, 2>)> {
    (track.status() != Status::Tentative).then_some((track.id()?, track.bank()))
}

/// Every sensor its own tracker in its own frame; their confirmed tracks are combined scan by scan.
fn fused<T: Scalar, A: SingleAssociator<T>>(associator: A, rule: Rule<T>, data: &Data) -> Result<Tracks, Fault> {
    let tracker = ImmPdaf::<T, _, 6, 2, TRACKS, DETS>::new(modes()?, jump(JUMP), initial(), logic(4, 5)?)?
        .with_initiation(initiation()?)
        .with_associator(associator);
    let limits = Limits { join: T::lit(25.0), part: T::lit(36.0), max_age: Duration::from_millis(5000) };
    let combiner = Combiner::new(modes()?, jump(JUMP), rule, limits)?;
    let sensor = sensor([0.0; 2])?;
    let frames = SENSORS.map(|[x, y]| Frame::new([x, y, 0.0].map(T::lit), T::ZERO));
    let mut states: [Box<State<T, 6, 2, TRACKS, DETS>>; 2] = Default::default();
    let mut picture = Box::new(FusedPicture::<T, 6, 2, 2, TRACKS>::new());
    let mut tracks = Tracks::new();
    for k in 0..SCANS {
        let time = Instant::from_millis(1000 * k as u64);
        for (number, (state, frame)) in states.iter_mut().zip(frames).enumerate() {
            tracker.step(state, &sensor, &Scan::new(time, &detections(&data.plots[number][k])))?;
            combiner.receive(&mut picture, number, &frame?, time, state.tracks().filter_map(confirmed))?;
        }
        let report = combiner.update(&mut picture);
        if !report.is_complete() {
            return Err(Fault::Full(report));
        }
        tracks.push(picture.tracks().filter_map(|fused| Some(point(fused.id()?, &fused.state, &fused.prob))).collect());
    }
    Ok(tracks)
}

/// One tracker for the plots of both sensors.
fn centralised<T: Scalar>(data: &Data) -> Result<Tracks, Fault> {
    let tracker = ImmJpda::<T, _, 6, 2, TRACKS, DETS, Jpda<NODES>>::new(modes()?, jump(JUMP), initial(), logic(8, 10)?, Jpda::new())?
        .with_initiation(initiation()?);
    let sensors = [sensor(SENSORS[0])?, sensor(SENSORS[1])?];
    let mut state = Box::new(JointState::<T, 6, 2, TRACKS, DETS, Jpda<NODES>>::new());
    let mut tracks = Tracks::new();
    for k in 0..SCANS {
        for (number, sensor) in sensors.iter().enumerate() {
            tracker.step(&mut state, sensor, &Scan::new(Instant::from_millis(1000 * k as u64), &detections(&data.plots[number][k])))?;
        }
        let known = state.tracks().filter_map(confirmed);
        tracks.push(known.map(|(id, bank)| point(id, &bank.combined(), &bank.prob)).collect());
    }
    Ok(tracks)
}
