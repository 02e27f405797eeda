//! The trackers of the demo: an air-surveillance radar (range, azimuth) at the origin, targets that fly straight, turn,
//! accelerate and cross each other, three modes. IMM-JPDAF, and IMM-PDAF on the same scans for the self-test; both start,
//! confirm and delete their tracks by themselves.

use crate::{Fault, Label, Sink, data, tell};
use boresight::association::{Gate, Jpda};
use boresight::error::ConfigError;
use boresight::gaussian::Gaussian;
use boresight::initiation::{Initiation, Rule};
use boresight::model::motion::{ConstantAcceleration, ConstantVelocity, ProcessNoise};
use boresight::model::radar::{Component, Radar};
use boresight::scan::{Detection, Report, Scan};
use boresight::sensor::{Clutter, UniformSensor};
use boresight::symmetric::Symmetric;
use boresight::time::{Duration, Instant};
use boresight::track::Logic;
use boresight::tracker::{self, ImmJpda, ImmPdaf, JointState};
use nalgebra::SVector;

/// States: (x, vx, ax, y, vy, ay)
pub const NX: usize = 6;
/// Quiet flight, gentle and hard manoeuvres
pub const MODES: usize = 3;
/// Room for tracks
pub const TRACKS: usize = 12;
/// Room for detections in a scan
pub const DETS: usize = 32;
/// Room for sets of served tracks
pub const NODES: usize = 128;

/// Standard deviation of the range \[m\]
pub const SIGMA_RANGE: f32 = 15.0;
/// Standard deviation of the azimuth \[rad\]
pub const SIGMA_AZIMUTH: f32 = 0.003;
/// Probability of detection
pub const P_DETECT: f32 = 0.95;
/// Clutter density \[1/(m rad)\]
pub const CLUTTER_DENSITY: f32 = 1e-4;

type Modes = (ConstantVelocity<f32, 2, 3>, ConstantAcceleration<f32, 2>, ConstantAcceleration<f32, 2>);

/// The tracker
pub type Tracker = ImmJpda<f32, Modes, NX, MODES, TRACKS, DETS, Jpda<NODES>>;
/// Its state
pub type State = JointState<f32, NX, MODES, TRACKS, DETS, Jpda<NODES>>;
/// The tracker that associates each track alone
pub type SingleTracker = ImmPdaf<f32, Modes, NX, MODES, TRACKS, DETS>;
/// Its state
pub type SingleState = tracker::State<f32, NX, MODES, TRACKS, DETS>;
/// The radar
pub type Sensor = UniformSensor<Radar<f32, 2, 2, 3>, f32>;

/// Modes, jump matrix, initial mode probabilities, track life and initiation
type Setup = (Modes, [[f32; MODES]; MODES], [f32; MODES], Logic<f32>, Initiation<f32, NX>);

fn setup() -> Result<Setup, ConfigError> {
    let modes = (
        ConstantVelocity::new(ProcessNoise::Discrete(0.1))?,
        ConstantAcceleration::new(ProcessNoise::Discrete(1.0))?,
        ConstantAcceleration::new(ProcessNoise::Discrete(64.0))?,
    );
    let jump = [[0.92, 0.05, 0.03], [0.06, 0.9, 0.04], [0.1, 0.3, 0.6]];
    let logic = Logic::new(4, 6, 5)?.with_position_limit(1500.0)?.with_duplicate_distance(1.0)?;
    let prior = Gaussian::new(SVector::zeros(), Symmetric::from_diagonal([1.0, 1e4, 25.0, 1.0, 1e4, 25.0]));
    let rule = Rule::TwoPoint { max_speed: 350.0, max_gap: Duration::from_millis(2500) };
    Ok((modes, jump, [0.8, 0.15, 0.05], logic, Initiation::new(rule, prior)?))
}

/// The tracker's configuration.
///
/// # Errors
/// None: the constants here are valid.
pub fn tracker() -> Result<Tracker, ConfigError> {
    let (modes, jump, initial, logic, initiation) = setup()?;
    Ok(ImmJpda::new(modes, jump, initial, logic, Jpda::new())?.with_initiation(initiation))
}

/// The configuration of the tracker that associates each track alone.
///
/// # Errors
/// None: the constants here are valid.
pub fn single_tracker() -> Result<SingleTracker, ConfigError> {
    let (modes, jump, initial, logic, initiation) = setup()?;
    Ok(ImmPdaf::new(modes, jump, initial, logic)?.with_initiation(initiation))
}

/// The radar.
///
/// # Errors
/// None: the constants here are valid.
pub fn sensor() -> Result<Sensor, ConfigError> {
    let noise = Symmetric::from_diagonal([SIGMA_RANGE * SIGMA_RANGE, SIGMA_AZIMUTH * SIGMA_AZIMUTH]);
    let radar = Radar::new([Component::Range, Component::Azimuth], noise)?;
    UniformSensor::new(radar, P_DETECT, Clutter::Poisson(CLUTTER_DENSITY), Gate::new::<2>(16.0)?)
}

/// Number of recorded scans.
#[must_use]
pub fn scans() -> usize {
    data::SCANS.len()
}

/// Takes in the recorded scan number `k`. A number beyond the last is an empty scan at its time.
///
/// # Errors
/// None: the recorded scans are in order and finite.
pub fn step<K: tracker::Tracker<f32, NX, MODES>>(tracker: &K, sensor: &Sensor, state: &mut K::State, k: usize) -> Result<Report, Fault> {
    let plots = data::SCANS.get(k).copied().unwrap_or_default();
    let mut detections = [Detection::new([0.0f32; 2]); DETS];
    let mut count = 0;
    for (slot, plot) in detections.iter_mut().zip(plots) {
        *slot = Detection::new(*plot);
        count += 1;
    }
    let time = Instant::from_millis(data::PERIOD_MILLIS * k as u64);
    let detections = detections.get(..count).unwrap_or_default();
    Ok(tracker.step(state, sensor, &Scan::new(time, detections))?)
}

/// All scans; tells every track's density and mode probabilities after each.
fn follow<K: tracker::Tracker<f32, NX, MODES>, S: Sink>(
    tracker: &K,
    part: &'static str,
    sink: &mut S,
    state: &mut K::State,
) -> Result<(), Fault> {
    let sensor = sensor()?;
    for k in 0..scans() {
        step(tracker, &sensor, state, k)?;
        for track in tracker.tracks(state) {
            let label = Label { part, scan: k, track: track.id().map_or(0, |id| id.number()), field: "mode probability" };
            sink.take(Label { field: "identity", ..label }, label.track as f32);
            for p in track.bank().prob {
                sink.take(label, p);
            }
            tell(sink, label, &track.bank().combined());
        }
    }
    Ok(())
}

/// All scans through both trackers.
///
/// # Errors
/// Where a configuration here is wrong.
pub fn run<S: Sink>(sink: &mut S, state: &mut State, single: &mut SingleState) -> Result<(), Fault> {
    follow(&tracker()?, "IMM-JPDAF", sink, state)?;
    follow(&single_tracker()?, "IMM-PDAF", sink, single)
}
