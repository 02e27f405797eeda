//! The filters of the scenarios after Gomes: seven turn rates, known, over (x, vx, y, vy).
//!
//! | name | the library's |
//! |---|---|
//! | `IMM-JPDAF paper`, `LMS-JPDAF paper` | `LmsJpda::step_printed`, with all modes and with the likely ones |
//! | `IMM-JPDAF proper` | `ImmJpda` |
//! | `LMS-JPDAF proper`, `LMS-JPDAF fallback` | `LmsJpda` without and with recall |
//! | `IMM-NN` | `ImmPdaf` with the nearest neighbour |
//!
//! Positions are converted from polar to Cartesian and bring their own covariance. The radar's nominal noise, which the volume of
//! the gate is computed by, is the mean of those of a scan.

use super::data::{Data, SIGMAS, START};
use crate::Failure;
use crate::precision::Scalar;
use crate::scenario::filter::Fault;
use boresight::association::{AssociationMatrix, Gate, Jpda, NearestNeighbour};
use boresight::error::{ConfigError, ScanError};
use boresight::gaussian::Gaussian;
use boresight::mode::{JumpMatrix, LikelyModes};
use boresight::model::converted::{Converted, Polar};
use boresight::model::motion::ProcessNoise;
use boresight::model::position::Position;
use boresight::model::turn::KnownTurn;
use boresight::scan::{Detection, Report, Scan};
use boresight::sensor::{Clutter, UniformSensor};
use boresight::symmetric::Symmetric;
use boresight::time::Instant;
use boresight::track::{Logic, TrackId};
use boresight::tracker::{ImmJpda, ImmPdaf, LmsJpda, State, Tracker};
use nalgebra::SVector;

/// The names, in the order of the results.
pub const NAMES: &[&str] = &["IMM-JPDAF paper", "LMS-JPDAF paper", "IMM-JPDAF proper", "LMS-JPDAF proper", "LMS-JPDAF fallback", "IMM-NN"];

/// Modes.
pub const MODES: usize = 7;
/// Their turn rates \[rad/s\].
pub const RATES: [f64; MODES] = [-0.06, -0.04, -0.02, 0.0, 0.02, 0.04, 0.06];

const STAY: f64 = 0.9;
const P_DETECT: f64 = 0.99;
const THRESHOLD: f64 = 25.0;
const UNLIKELY: f64 = 0.005;
const PRINCIPAL: f64 = 0.3;
const LEAST: usize = 3;

pub(crate) type Turns<T> = [KnownTurn<T, 2>; MODES];
type Joint = Jpda<16>;
type Imm<T> = ImmJpda<T, Turns<T>, 4, MODES, 2, 2, Joint>;
type Lms<T> = LmsJpda<T, Turns<T>, 4, MODES, 2, 2, Joint>;
type Radar<T> = UniformSensor<Position<T, 2, 2>, T>;

/// What is known of one target after a scan.
#[derive(Debug, Clone, Copy)]
pub struct Point {
    /// (x, vx, y, vy); NaN where the track is gone
    pub state: [f64; 4],
    /// Mode probabilities
    pub prob: [f64; MODES],
    /// Modes that ran
    pub active: usize,
    /// Probabilities that the plot of target 1, and that of target 2, is the track's; NaN where tracks are associated alone
    pub beta: [f64; 2],
}

/// The points of both targets at scans 1..=60.
pub type Tracks = [Vec<Point>; 2];

/// Runs the filter `name` over the data of a run.
pub fn run<T: Scalar>(name: &str, data: &Data) -> Result<Tracks, Failure> {
    tracks::<T>(name, data).map_err(|fault| fault.of(name))
}

fn tracks<T: Scalar>(name: &str, data: &Data) -> Result<Tracks, Fault> {
    let published = likely::<T>()?.without_recall();
    match name {
        "IMM-JPDAF paper" => {
            let all = LikelyModes::<T, MODES>::new(&jump(), T::ZERO, T::ONE, MODES)?.without_recall();
            follow(&lms(all, even())?, data, Lms::start, joint, Lms::step_printed)
        }
        "LMS-JPDAF paper" => follow(&lms(published, straight())?, data, Lms::start, joint, Lms::step_printed),
        "LMS-JPDAF proper" => follow(&lms(published, straight())?, data, Lms::start, joint, Lms::step),
        "LMS-JPDAF fallback" => follow(&lms(likely::<T>()?, straight())?, data, Lms::start, joint, Lms::step),
        "IMM-NN" => {
            let tracker = ImmPdaf::<T, Turns<T>, 4, MODES, 2, 2>::new(turns()?, jump(), even(), Logic::unmanaged())?;
            let tracker = tracker.with_associator(NearestNeighbour);
            follow(&tracker, data, ImmPdaf::start, |_, _, _| None, ImmPdaf::step)
        }
        _ => {
            let tracker = Imm::<T>::new(turns()?, jump(), even(), Logic::unmanaged(), Jpda::new())?;
            follow(&tracker, data, Imm::start, joint, Imm::step)
        }
    }
}

pub(crate) fn turns<T: Scalar>() -> Result<Turns<T>, ConfigError> {
    let noise = ProcessNoise::Discrete(T::ONE);
    let mut turns = [KnownTurn::new(T::ZERO, noise)?; MODES];
    for (turn, rate) in turns.iter_mut().zip(RATES) {
        *turn = KnownTurn::new(T::lit(rate), noise)?;
    }
    Ok(turns)
}

/// Every rate stays, or changes to one of its neighbours.
pub(crate) fn jump<T: Scalar>() -> JumpMatrix<T, MODES> {
    let neighbours = |i: usize| if i == 0 || i == MODES - 1 { 1.0 } else { 2.0 };
    std::array::from_fn(|i| {
        std::array::from_fn(|j| match i.abs_diff(j) {
            0 => T::lit(STAY),
            1 => T::lit((1.0 - STAY) / neighbours(i)),
            _ => T::ZERO,
        })
    })
}

fn even<T: Scalar>() -> [T; MODES] {
    [T::ONE / T::from_count(MODES); MODES]
}

/// The three rates about zero.
pub(crate) fn straight<T: Scalar>() -> [T; MODES] {
    std::array::from_fn(|r| if r.abs_diff(MODES / 2) <= 1 { T::lit(1.0 / 3.0) } else { T::ZERO })
}

fn likely<T: Scalar>() -> Result<LikelyModes<T, MODES>, ConfigError> {
    LikelyModes::new(&jump(), T::lit(UNLIKELY), T::lit(PRINCIPAL), LEAST)
}

fn lms<T: Scalar>(likely: LikelyModes<T, MODES>, initial: [T; MODES]) -> Result<Lms<T>, ConfigError> {
    Lms::new(turns()?, jump(), initial, likely, Logic::unmanaged(), Jpda::new())
}

fn follow<T: Scalar, K: Tracker<T, 4, MODES>>(
    tracker: &K,
    data: &Data,
    start: impl Fn(&K, &mut K::State, Gaussian<T, 4>, Instant) -> Option<TrackId>,
    beta: impl Fn(&K::State, TrackId, usize) -> Option<T>,
    step: impl Fn(&K, &mut K::State, &Radar<T>, &Scan<'_, T, 2>) -> Result<Report, ScanError>,
) -> Result<Tracks, Fault> {
    let mut state = K::State::default();
    let cov = Symmetric::from_diagonal(START.map(|sigma| T::lit(sigma * sigma)));
    let mut ids = Vec::new();
    for at in &data.start {
        let g = Gaussian::new(SVector::from(at.map(T::lit)), cov);
        ids.push(start(tracker, &mut state, g, Instant::from_millis(0)).ok_or(Fault::Start)?);
    }
    let mut tracks: Tracks = Default::default();
    for (k, (plots, first)) in data.plots.iter().zip(&data.first).enumerate() {
        let converted = plots.map(convert::<T>);
        let detections = converted.each_ref().map(|(position, noise)| Detection::new(*position).with_noise(*noise));
        let mean = Symmetric::from_fn(|i, j| (converted[0].1.upper()[i][j] + converted[1].1.upper()[i][j]) * T::lit(0.5));
        let gate = Gate::new::<2>(T::lit(THRESHOLD))?;
        let radar = UniformSensor::new(Position::new(mean)?, T::lit(P_DETECT), Clutter::Diffuse, gate)?;
        step(tracker, &mut state, &radar, &Scan::new(Instant::from_millis(1000 * (k as u64 + 1)), &detections))?;
        for (id, points) in ids.iter().zip(&mut tracks) {
            let track = tracker.tracks(&state).find(|track| track.id() == Some(*id));
            points.push(track.map_or(NOWHERE, |track| Point {
                state: track.bank().combined().mean.data.0[0].map(Into::into),
                prob: track.bank().prob.map(Into::into),
                active: track.active().len(),
                beta: [*first, 1 - *first].map(|plot| beta(&state, *id, plot).map_or(f64::NAN, Into::into)),
            }));
        }
    }
    Ok(tracks)
}

/// β of a plot, where tracks are associated together.
fn joint<T: Scalar, X: AsRef<AssociationMatrix<T, 2, 2>>>(state: &State<T, 4, MODES, 2, 2, X>, id: TrackId, plot: usize) -> Option<T> {
    state.association(id)?.1.get(plot).copied()
}

const NOWHERE: Point = Point { state: [f64::NAN; 4], prob: [f64::NAN; MODES], active: 0, beta: [f64::NAN; 2] };

/// Position and covariance of a plot.
pub(crate) fn convert<T: Scalar>([range, azimuth]: [f64; 2]) -> ([T; 2], Symmetric<T, 2>) {
    let [range_variance, azimuth_variance] = SIGMAS.map(|sigma| T::lit(sigma * sigma));
    let Converted { position: [x, y, _], cov } = Polar::in_plane(T::lit(range), T::lit(azimuth), range_variance, azimuth_variance).linear();
    ([x, y], Symmetric::from_fn(|i, j| cov.upper()[i][j]))
}
