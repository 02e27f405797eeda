//! The trackers from outside: what they refuse, how tracks live, what they do when they are full, whether they track.
//!
//! | module | holds |
//! |---|---|
//! | [`refusal`] | a scan that is refused leaves every bit of the state as it was; a scan at the same time moves nothing |
//! | [`life`] | confirmation, coasting, deletion, duplicates, identities, cues |
//! | [`capacity`] | room for one: every detection and every birth is accounted for, the strongest are kept |
//! | [`tracking`] | targets in clutter are found and held: both initiations, sensors of several dimensions, the seam of azimuth |
//! | [`seam`] | targets that cross the seam of azimuth are found and held there, by folded range-rates as well |
//! | [`sectors`] | a rotating radar: detections with times of their own |
//! | [`precision`] | f32 beside f64 on the same scans |
//! | [`joint`] | tracks associated together: one alone, order, distance, identities at a crossing |
//! | [`listing`] | one scan of tracks associated together against everything that may have happened |
//! | [`existence`] | integrated existence: numbers by hand, false tracks and real ones, what a sensor that does not look tells |
//! | [`sensors`] | sensors of every dimension, rate and place feed one picture of several targets |
//! | [`overload`] | a crowd in one gate: everything finite, everything told |
//! | [`garbage`] | tens of thousands of absurd scans: no panic, nothing that is not finite, every account balanced |

mod capacity;
#[path = "../support/enumeration.rs"]
mod enumeration;
mod existence;
mod garbage;
mod joint;
mod life;
mod listing;
mod overload;
mod precision;
mod refusal;
mod seam;
mod sectors;
mod sensors;
mod tracking;

use boresight::association::{Associator, Gate};
use boresight::error::ConfigError;
use boresight::gaussian::Gaussian;
use boresight::initiation::{Initiation, Rule};
use boresight::mode::JumpMatrix;
use boresight::model::motion::{ConstantAcceleration, ConstantVelocity, ProcessNoise};
use boresight::model::position::Position;
use boresight::scalar::Real;
use boresight::scan::Report;
use boresight::sensor::{Clutter, UniformSensor};
use boresight::symmetric::Symmetric;
use boresight::time::Duration;
use boresight::track::Logic;
use boresight::tracker::{ImmJpda, ImmPdaf, JointState, State};
use enumeration::Enumeration;
use nalgebra::SVector;

/// Quiet motion and manoeuvre in the plane: (x, vx, ax, y, vy, ay).
type Modes<T> = (ConstantVelocity<T, 2, 3>, ConstantAcceleration<T, 2>);
/// The tracker of most tests.
type Tracker<T, const TRACKS: usize, const DETS: usize> = ImmPdaf<T, Modes<T>, 6, 2, TRACKS, DETS>;
type TrackerState<T, const TRACKS: usize, const DETS: usize> = State<T, 6, 2, TRACKS, DETS>;
/// The same with joint association.
type JointTracker<T, const TRACKS: usize, const DETS: usize, A = Enumeration> = ImmJpda<T, Modes<T>, 6, 2, TRACKS, DETS, A>;
type JointTrackerState<T, const TRACKS: usize, const DETS: usize, A = Enumeration> = JointState<T, 6, 2, TRACKS, DETS, A>;
/// A sensor of positions.
type Positions<T> = UniformSensor<Position<T, 2, 3>, T>;

/// Standard deviation of a position \[m\].
const SIGMA: f64 = 20.0;
/// False detections per m².
const CLUTTER: f64 = 1e-7;

/// The modes, their jumps and the mode probabilities of a new track.
type Motion<T> = (Modes<T>, JumpMatrix<T, 2>, [T; 2]);

fn modes<T: Real>() -> Result<Motion<T>, ConfigError> {
    let quiet = ConstantVelocity::new(ProcessNoise::Continuous(T::lit(0.1)))?;
    let manoeuvre = ConstantAcceleration::new(ProcessNoise::Continuous(T::lit(10.0)))?;
    Ok(((quiet, manoeuvre), [[0.95, 0.05], [0.1, 0.9]].map(|row| row.map(T::lit)), [0.9, 0.1].map(T::lit)))
}

/// Nothing is known of a new target but that it is slower than about 300 m/s.
fn initiation<T: Real>(rule: Rule<T>) -> Result<Initiation<T, 6>, ConfigError> {
    let variance = [0.0, 1e4, 25.0, 0.0, 1e4, 25.0].map(T::lit);
    Initiation::new(rule, Gaussian::new(SVector::zeros(), Symmetric::from_diagonal(variance)))
}

fn tracker<T: Real, const TRACKS: usize, const DETS: usize>(
    logic: Logic<T>,
    rule: Rule<T>,
) -> Result<Tracker<T, TRACKS, DETS>, ConfigError> {
    let (modes, jump, initial) = modes()?;
    Ok(ImmPdaf::new(modes, jump, initial, logic)?.with_initiation(initiation(rule)?))
}

fn joint_tracker<T: Real, A: Associator<T, TRACKS, DETS>, const TRACKS: usize, const DETS: usize>(
    logic: Logic<T>,
    rule: Rule<T>,
    associator: A,
) -> Result<JointTracker<T, TRACKS, DETS, A>, ConfigError> {
    let (modes, jump, initial) = modes()?;
    Ok(ImmJpda::new(modes, jump, initial, logic, associator)?.with_initiation(initiation(rule)?))
}

/// Every two detections at most five seconds and 300 m/s apart.
fn two_points<T: Real>() -> Rule<T> {
    Rule::TwoPoint { max_speed: T::lit(300.0), max_gap: Duration::from_millis(5000) }
}

fn positions<T: Real>(p_detect: f64) -> Result<Positions<T>, ConfigError> {
    let model = Position::new(Symmetric::from_diagonal([T::lit(SIGMA * SIGMA); 2]))?;
    UniformSensor::new(model, T::lit(p_detect), Clutter::Poisson(T::lit(CLUTTER)), Gate::new::<2>(T::lit(16.0))?)
}

/// Live tracks.
fn alive<T: Real, X, const NX: usize, const MODES: usize, const TRACKS: usize, const DETS: usize>(
    state: &State<T, NX, MODES, TRACKS, DETS, X>,
) -> usize {
    state.tracks().count()
}

/// What a report says about the number of tracks.
fn balance(before: usize, report: &Report) -> i64 {
    let count = |n: u16| i64::from(n);
    before as i64 + count(report.births) - count(report.tracks_evicted) - count(report.tracks_deleted) - count(report.duplicates_deleted)
}
