//! The trackers of the demo: an air-surveillance radar (range, azimuth) at the origin, targets that fly straight, turn,
//! accelerate and cross each other. IMM-JPDAF with three modes, and LMS-JPDAF with seven; for the self-test IMM-PDAF on the same
//! scans, too, and one picture of its tracks and those of the first. All start, confirm and delete their tracks by themselves.

use crate::{Fault, Label, Sink, data, tell};
use boresight::association::{Gate, Jpda};
use boresight::error::ConfigError;
use boresight::fusion::{Combiner, Frame, FusedPicture, Limits, Rule, TrackMessage, Weight};
use boresight::gaussian::Gaussian;
use boresight::initiation::{self, Initiation};
use boresight::mode::{JumpMatrix, LikelyModes};
use boresight::model::motion::{ConstantAcceleration, ConstantVelocity, ProcessNoise};
use boresight::model::radar::{Component, Radar};
use boresight::model::turn::KnownTurn;
use boresight::scan::{Detection, Report, Scan};
use boresight::sensor::{self, Clutter, UniformSensor};
use boresight::symmetric::Symmetric;
use boresight::time::{Duration, Instant};
use boresight::track::{Logic, Track};
use boresight::tracker::{self, ImmJpda, ImmPdaf, JointState, LmsJpda, LmsState, Tracker};
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
pub type JointTracker = ImmJpda<f32, Modes, NX, MODES, TRACKS, DETS, Jpda<NODES>>;
/// Its state
pub type State = JointState<f32, NX, MODES, TRACKS, DETS, Jpda<NODES>>;
/// The tracker that associates each track alone
pub type SingleTracker = ImmPdaf<f32, Modes, NX, MODES, TRACKS, DETS>;
/// Its state
pub type SingleState = tracker::State<f32, NX, MODES, TRACKS, DETS>;
/// The tracker of many modes, over (x, vx, y, vy): turns, of which each track runs the likely ones
pub type LikelyTracker = LmsJpda<f32, [KnownTurn<f32, 2>; 7], 4, 7, TRACKS, DETS, Jpda<NODES>>;
/// Its state
pub type LikelyState = LmsState<f32, 4, 7, TRACKS, DETS, Jpda<NODES>>;
/// The radar, for `STRIDE` states an axis
pub type Sensor<const STRIDE: usize> = UniformSensor<Radar<f32, 2, 2, STRIDE>, f32>;
type Picture = FusedPicture<f32, NX, MODES, 2, TRACKS>;
type Message = TrackMessage<f32, NX, MODES>;

/// What [`run`] works in.
#[derive(Clone, Debug)]
pub struct Memory {
    joint: State,
    single: SingleState,
    likely: LikelyState,
    picture: Picture,
}

impl Memory {
    /// No tracks.
    #[must_use]
    pub const fn new() -> Self {
        Self { joint: State::new(), single: SingleState::new(), likely: LikelyState::new(), picture: Picture::new() }
    }
}

impl Default for Memory {
    fn default() -> Self {
        Self::new()
    }
}

/// Modes, jump matrix, initial mode probabilities, track life and initiation
type Setup = (Modes, JumpMatrix<f32, MODES>, [f32; MODES], Logic<f32>, Initiation<f32, NX>);

fn setup() -> Result<Setup, ConfigError> {
    let modes = (
        ConstantVelocity::new(ProcessNoise::Discrete(0.1))?,
        ConstantAcceleration::new(ProcessNoise::Discrete(1.0))?,
        ConstantAcceleration::new(ProcessNoise::Discrete(64.0))?,
    );
    let jump = [[0.92, 0.05, 0.03], [0.06, 0.9, 0.04], [0.1, 0.3, 0.6]];
    Ok((modes, jump, [0.8, 0.15, 0.05], logic()?, initiation([1.0, 1e4, 25.0, 1.0, 1e4, 25.0])?))
}

fn logic() -> Result<Logic<f32>, ConfigError> {
    Logic::new(4, 6, 5)?.with_position_limit(1500.0)?.with_duplicate_distance(1.0)
}

fn initiation<const N: usize>(variances: [f32; N]) -> Result<Initiation<f32, N>, ConfigError> {
    let rule = initiation::Rule::TwoPoint { max_speed: 350.0, max_gap: Duration::from_millis(2500) };
    Initiation::new(rule, Gaussian::new(SVector::zeros(), Symmetric::from_diagonal(variances)))
}

/// The tracker's configuration.
///
/// # Errors
/// None: the constants here are valid.
pub fn tracker() -> Result<JointTracker, ConfigError> {
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

/// The configuration of the tracker of many modes: turns of −0.09 to 0.09 rad/s, each of which may change to the next.
///
/// # Errors
/// None: the constants here are valid.
pub fn likely_tracker() -> Result<LikelyTracker, ConfigError> {
    let mut turns = [KnownTurn::new(0.0, ProcessNoise::Discrete(9.0))?; 7];
    for (number, turn) in turns.iter_mut().enumerate() {
        *turn = KnownTurn::new(0.03 * (number as f32 - 3.0), ProcessNoise::Discrete(9.0))?;
    }
    let chance = |from: usize, to: usize| match from.abs_diff(to) {
        0 => 0.9,
        1 if from == 0 || from == 6 => 0.1,
        1 => 0.05,
        _ => 0.0,
    };
    let jump = core::array::from_fn(|from| core::array::from_fn(|to| chance(from, to)));
    let likely = LikelyModes::new(&jump, 0.005, 0.3, 3)?;
    let initial = [0.0, 0.0, 0.1, 0.8, 0.1, 0.0, 0.0];
    Ok(LmsJpda::new(turns, jump, initial, likely, logic()?, Jpda::new())?.with_initiation(initiation([1.0, 1e4, 1.0, 1e4])?))
}

/// The radar.
///
/// # Errors
/// None: the constants here are valid.
pub fn sensor<const STRIDE: usize>() -> Result<Sensor<STRIDE>, ConfigError> {
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
pub fn step<K: Tracker<f32, N, R>, S: sensor::Sensor<f32, N, 2>, const N: usize, const R: usize>(
    tracker: &K,
    sensor: &S,
    state: &mut K::State,
    k: usize,
) -> Result<Report, Fault> {
    let plots = data::SCANS.get(k).copied().unwrap_or_default();
    let mut detections = [Detection::new([0.0f32; 2]); DETS];
    let mut count = 0;
    for (slot, plot) in detections.iter_mut().zip(plots) {
        *slot = Detection::new(*plot);
        count += 1;
    }
    let detections = detections.get(..count).unwrap_or_default();
    Ok(tracker.step(state, sensor, &Scan::new(time(k, 0), detections))?)
}

/// That of scan number `k`, and some milliseconds more.
fn time(k: usize, late: u64) -> Instant {
    Instant::from_millis(data::PERIOD_MILLIS * k as u64 + late)
}

/// One scan; tells every track's density and mode probabilities after it.
fn follow<K: Tracker<f32, N, R>, S: sensor::Sensor<f32, N, 2>, T: Sink, const N: usize, const R: usize>(
    (tracker, sensor): (&K, &S),
    part: &'static str,
    sink: &mut T,
    state: &mut K::State,
    k: usize,
) -> Result<(), Fault> {
    step(tracker, sensor, state, k)?;
    for track in tracker.tracks(state) {
        let label = Label { part, scan: k, track: track.id().map_or(0, |id| id.number()), field: "mode probability" };
        sink.take(Label { field: "identity", ..label }, label.track as f32);
        for p in track.bank().prob {
            sink.take(label, p);
        }
        tell(sink, label, &track.bank().combined());
    }
    Ok(())
}

/// All scans through all trackers, and those of six states made one picture, scan by scan.
///
/// # Errors
/// Where a configuration here is wrong.
pub fn run<T: Sink>(sink: &mut T, memory: &mut Memory) -> Result<(), Fault> {
    let Memory { joint, single, likely, picture } = memory;
    let trackers = (tracker()?, single_tracker()?, likely_tracker()?);
    let (sensor, plane) = (sensor::<3>()?, sensor::<2>()?);
    let link = Link::new()?;
    for k in 0..scans() {
        follow((&trackers.0, &sensor), "IMM-JPDAF", sink, joint, k)?;
        follow((&trackers.1, &sensor), "IMM-PDAF", sink, single, k)?;
        follow((&trackers.2, &plane), "LMS-JPDAF", sink, likely, k)?;
        link.send(sink, picture, 0, joint.tracks(), k)?;
        link.send(sink, picture, 1, single.tracks(), k)?;
        link.fuse(sink, picture, k);
    }
    Ok(())
}

/// Makes one picture of the tracks of two trackers.
struct Link {
    combiner: Combiner<f32, Modes, NX, MODES>,
    /// That of the second one is known but roughly.
    frames: [Frame<f32>; 2],
}

impl Link {
    fn new() -> Result<Self, ConfigError> {
        let (modes, jump, ..) = setup()?;
        let limits = Limits { join: 13.3, part: 18.5, max_age: Duration::from_millis(5000) };
        let place = Symmetric::from_diagonal([400.0, 100.0, 0.0]);
        let rough = Frame::new([10.0, -15.0, 0.0], 0.002)?.with_uncertainty(place, 1e-6)?;
        let combiner = Combiner::new(modes, jump, Rule::Intersection(Weight::Trace), limits)?;
        Ok(Self { combiner, frames: [Frame::COMMON, rough] })
    }

    /// Sends all tracks of a tracker as messages, those of the second one a little late; tells their bytes.
    fn send<'a, T: Sink>(
        &self,
        sink: &mut T,
        picture: &mut Picture,
        sensor: u16,
        tracks: impl Iterator<Item = &'a Track<f32, NX, MODES>>,
        k: usize,
    ) -> Result<(), Fault> {
        let time = time(k, 200 * u64::from(sensor));
        let mut told = [None; TRACKS];
        for (told, track) in told.iter_mut().zip(tracks) {
            let mut bytes = [0; Message::SIZE];
            if let Some(message) = Message::new(sensor, time, track) {
                message.encode(&mut bytes)?;
            }
            // The last four bytes are a checksum of the rest; a number of 16 bits is exact.
            for pair in bytes.as_chunks::<2>().0.iter().rev().take(2) {
                let label = Label { part: "message", scan: k, track: 0, field: "checksum" };
                sink.take(label, f32::from(u16::from_le_bytes(*pair)));
            }
            *told = Some(Message::decode(&bytes)?);
        }
        let tracks = told.iter().flatten().map(|message| (message.id, &message.bank));
        let frame = self.frames.get(usize::from(sensor)).unwrap_or(&Frame::COMMON);
        Ok(self.combiner.receive(picture, sensor.into(), frame, time, tracks)?)
    }

    /// Fuses the lists that were sent; tells the fused tracks.
    fn fuse<T: Sink>(&self, sink: &mut T, picture: &mut Picture, k: usize) {
        let label = Label { part: "fusion", scan: k, track: 0, field: "" };
        let report = self.combiner.update(picture);
        for (field, count) in [("joined", report.joined), ("parted", report.parted), ("ended", report.ended)] {
            sink.take(Label { field, ..label }, f32::from(count));
        }
        for fused in picture.tracks() {
            let label = Label { track: fused.id().map_or(0, |id| id.number()), field: "mode probability", ..label };
            sink.take(Label { field: "identity", ..label }, label.track as f32);
            for (sensor, id) in fused.members() {
                sink.take(Label { field: "member", ..label }, (1000 * sensor + id.number() as usize) as f32);
            }
            for p in fused.prob {
                sink.take(label, p);
            }
            tell(sink, label, &fused.state);
        }
    }
}
