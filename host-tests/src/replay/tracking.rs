//! Runs the library's IMM-PDAF over a recording, in the state, modes and precision chosen at run time.
//!
//! Scan by scan, for the sensors that the tracker takes in:
//!
//! ```text
//! sensor at its place in this scan -> step -> estimates of all tracks
//! ```
//!
//! A track counts as moving from the first scan on in which it is confirmed and has been `min_travel` or farther from
//! where it was born, |p - p_birth| >= min_travel: what stands still (land, moorings, the own ship's structure) is
//! tracked like anything else, so that its plots start nothing new, and told apart. Once moving, always moving.
//!
//! Everything generic ends here: a [`History`] holds plain f64.

use super::config::{Config, InitiationRule, StateKind};
use super::modes::{AccelerationMode, ModeKind, VelocityMode, prior};
use super::recording::{Component, Plot, Recording, ScanRecord};
use super::sensor::{Instrument, Look};
use crate::metrics::distance;
use crate::{Failure, Precision};
use boresight::initiation::{Initiation, Rule};
use boresight::mode::ModeSet;
use boresight::model::position::Position;
use boresight::model::{MeasurementModel, MotionModel};
use boresight::scalar::Real;
use boresight::scan::{Detection, Report, Scan};
use boresight::time::{Duration, Instant};
use boresight::track::{Logic, Status};
use boresight::tracker::{ImmPdaf, State};
use serde::Serialize;
use std::collections::BTreeMap;

/// Most tracks at a time.
const TRACKS: usize = 64;
/// Most detections of a scan.
const DETS: usize = 256;

/// What a tracker made of a recording.
#[derive(Debug, Clone, PartialEq)]
pub struct History {
    /// What the states of its tracks are.
    pub state: StateKind,
    /// The tracks after every scan that it took in.
    pub moments: Vec<Moment>,
    /// What all its steps did and gave up.
    pub counts: Counts,
}

/// The tracks after one scan.
#[derive(Debug, Clone, PartialEq)]
pub struct Moment {
    /// The scan's place in the recording.
    pub scan: usize,
    /// The scan's time \[us\].
    pub time_us: u64,
    /// All tracks, tentative ones too.
    pub tracks: Vec<Tracked>,
}

/// One track after one scan.
#[derive(Debug, Clone, PartialEq)]
pub struct Tracked {
    /// Its identity.
    pub id: u32,
    /// How far it is trusted.
    pub status: Status,
    /// Whether it is confirmed and has moved.
    pub moving: bool,
    /// x, the combined mean over all modes.
    pub mean: Vec<f64>,
    /// √P_ii.
    pub std: Vec<f64>,
    /// μ, the mode probabilities.
    pub modes: Vec<f64>,
}

/// The library's [`Report`], summed over all scans.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize)]
#[expect(missing_docs, reason = "the names are the library's")]
pub struct Counts {
    pub detections: u64,
    pub detections_dropped: u64,
    pub detections_unclaimed: u64,
    pub seeds_dropped: u64,
    pub births: u64,
    pub births_refused: u64,
    pub tracks_evicted: u64,
    pub tracks_confirmed: u64,
    pub tracks_deleted: u64,
    pub duplicates_deleted: u64,
    pub numeric_resets: u64,
}

impl StateKind {
    /// (number of axes, states per axis)
    #[must_use]
    pub fn shape(self) -> (usize, usize) {
        match self {
            Self::Velocity2d => (2, 2),
            Self::Acceleration2d => (2, 3),
            Self::Velocity3d => (3, 2),
        }
    }

    /// The names of the states, in order.
    #[must_use]
    pub fn names(self) -> Vec<String> {
        let (axes, stride) = self.shape();
        let axis = |a: usize| ["x", "y", "z"][a];
        (0..axes).flat_map(|a| ["", "v", "a"].into_iter().take(stride).map(move |rate| format!("{rate}{}", axis(a)))).collect()
    }

    /// What sensors of these components can see: space where all measure it, else the plane.
    fn seen_by(sensors: &[Vec<Component>]) -> Self {
        let in_space = |c: &Vec<Component>| c.contains(&Component::Z) || (c.contains(&Component::Elevation) && c.contains(&Component::Range));
        if !sensors.is_empty() && sensors.iter().all(in_space) { Self::Velocity3d } else { Self::Velocity2d }
    }
}

impl Tracked {
    /// The position \[m\], two or three coordinates.
    #[must_use]
    pub fn position(&self, state: StateKind) -> Vec<f64> {
        let (axes, stride) = state.shape();
        self.mean.iter().step_by(stride).take(axes).copied().collect()
    }
}

/// Runs the tracker of `config` over `recording`.
pub fn track(recording: &Recording, config: &Config, precision: Precision) -> Result<History, Failure> {
    let used = config.used_sensors(recording);
    let state = match config.tracker.state {
        Some(state) => state,
        None => StateKind::seen_by(&used.iter().map(|name| recording.components(name)).collect::<Result<Vec<_>, _>>()?),
    };
    let (axes, _) = state.shape();
    let instrument = |name: &&str| Instrument::new(name, recording, &config.sensor(name), config.tracker.gate, axes);
    let instruments = used.iter().map(instrument).collect::<Result<Vec<_>, _>>()?;
    let task = Task { recording, config, state, instruments };
    let mut history = match precision {
        Precision::F32 => task.by_state::<f32>(),
        Precision::F64 => task.by_state::<f64>(),
    }?;
    history.tell_moving(config.tracker.life.min_travel);
    Ok(history)
}

/// All that a run needs, before its types are chosen.
struct Task<'a> {
    recording: &'a Recording,
    config: &'a Config,
    state: StateKind,
    instruments: Vec<Instrument>,
}

impl Task<'_> {
    fn by_state<T: Real + Into<f64>>(&self) -> Result<History, Failure> {
        match self.state {
            StateKind::Velocity2d => self.by_modes::<T, VelocityMode<T, 2>, 4, 2, 2>(),
            StateKind::Acceleration2d => self.by_modes::<T, AccelerationMode<T>, 6, 2, 3>(),
            StateKind::Velocity3d => self.by_modes::<T, VelocityMode<T, 3>, 6, 3, 2>(),
        }
    }

    fn by_modes<T, M, const NX: usize, const AXES: usize, const STRIDE: usize>(&self) -> Result<History, Failure>
    where
        T: Real + Into<f64>,
        M: ModeKind + MotionModel<T, NX>,
    {
        let numbered = self.config.tracker.modes.iter().enumerate();
        let modes = numbered.map(|(i, mode)| M::build(mode).map_err(|failure| failure.within(format!("tracker: modes[{i}]"))));
        match modes.collect::<Result<Vec<M>, _>>()?.as_slice() {
            &[a] => self.run::<T, M, NX, AXES, STRIDE, 1>([a]),
            &[a, b] => self.run::<T, M, NX, AXES, STRIDE, 2>([a, b]),
            &[a, b, c] => self.run::<T, M, NX, AXES, STRIDE, 3>([a, b, c]),
            other => Err(Failure::at_field("tracker: modes", format!("{} of them", other.len()))),
        }
    }

    fn run<T, M, const NX: usize, const AXES: usize, const STRIDE: usize, const MODES: usize>(
        &self,
        modes: [M; MODES],
    ) -> Result<History, Failure>
    where
        T: Real + Into<f64>,
        M: ModeKind + MotionModel<T, NX>,
    {
        let silent = self.tracker(modes)?;
        let initiating = silent.with_initiation(self.initiation(<[M; MODES] as ModeSet<T, NX, MODES>>::LAYOUT)?);
        let mut state = Box::new(State::new());
        let mut history = History { state: self.state, moments: Vec::new(), counts: Counts::default() };
        for (number, scan) in self.recording.scans.iter().enumerate() {
            let Some(instrument) = self.instruments.iter().find(|instrument| instrument.name == scan.sensor) else { continue };
            let tracker = if instrument.initiates { &initiating } else { &silent };
            let report = take_in::<T, M, NX, AXES, STRIDE, MODES>(tracker, &mut state, instrument, scan)?;
            history.counts.add(&report);
            history.moments.push(Moment { scan: number, time_us: scan.time_us, tracks: tracks(&state) });
        }
        Ok(history)
    }

    fn tracker<T: Real, M: MotionModel<T, NX>, const NX: usize, const MODES: usize>(
        &self,
        modes: [M; MODES],
    ) -> Result<Tracker<T, M, NX, MODES>, Failure> {
        let refused = |error| Failure::input(error).within("tracker");
        let (tracker, life) = (&self.config.tracker, &self.config.tracker.life);
        let logic = Logic::new(life.hits, life.window, life.misses).map_err(refused)?;
        let logic = logic.with_position_limit(T::lit(life.position_limit)).map_err(refused)?;
        let logic = logic.with_duplicate_distance(T::lit(life.duplicate_distance)).map_err(refused)?;
        let (jump, initial) = (tracker.jump(), tracker.initial());
        let entry = |row: &[f64], to: usize| T::lit(row.get(to).copied().unwrap_or(0.0));
        let row = |from: usize| jump.get(from).map(Vec::as_slice).unwrap_or_default();
        let jump = std::array::from_fn(|from| std::array::from_fn(|to| entry(row(from), to)));
        ImmPdaf::new(modes, jump, std::array::from_fn(|mode| entry(&initial, mode)), logic).map_err(refused)
    }

    fn initiation<T: Real, const NX: usize>(&self, layout: boresight::model::Layout) -> Result<Initiation<T, NX>, Failure> {
        let config = &self.config.tracker.initiation;
        let rule = match config.rule {
            InitiationRule::OnePoint => Rule::OnePoint,
            InitiationRule::TwoPoint => {
                Rule::TwoPoint { max_speed: T::lit(config.max_speed), max_gap: Duration::from_micros((config.max_gap * 1e6) as i64) }
            }
        };
        Initiation::new(rule, prior(layout, config)).map_err(|error| Failure::input(error).within("tracker: initiation"))
    }
}

type Tracker<T, M, const NX: usize, const MODES: usize> = ImmPdaf<T, [M; MODES], NX, MODES, TRACKS, DETS>;
type Tracks<T, const NX: usize, const MODES: usize> = State<T, NX, MODES, TRACKS, DETS>;

/// One scan into the tracker, as what its sensor measures.
fn take_in<T: Real, M: MotionModel<T, NX>, const NX: usize, const AXES: usize, const STRIDE: usize, const MODES: usize>(
    tracker: &Tracker<T, M, NX, MODES>,
    state: &mut Tracks<T, NX, MODES>,
    instrument: &Instrument,
    scan: &ScanRecord,
) -> Result<Report, Failure> {
    let origin = instrument.origin(scan.own);
    if instrument.components.contains(&Component::X) {
        let look: Look<T, Position<T, AXES, STRIDE>> = instrument.position_sensor(origin)?;
        return step(tracker, state, instrument, &look, scan);
    }
    match instrument.components.len() {
        1 => step(tracker, state, instrument, &instrument.radar::<T, 1, AXES, STRIDE>(origin)?, scan),
        2 => step(tracker, state, instrument, &instrument.radar::<T, 2, AXES, STRIDE>(origin)?, scan),
        3 => step(tracker, state, instrument, &instrument.radar::<T, 3, AXES, STRIDE>(origin)?, scan),
        _ => step(tracker, state, instrument, &instrument.radar::<T, 4, AXES, STRIDE>(origin)?, scan),
    }
}

fn step<T: Real, M, S, const NX: usize, const NZ: usize, const MODES: usize>(
    tracker: &Tracker<T, M, NX, MODES>,
    state: &mut Tracks<T, NX, MODES>,
    instrument: &Instrument,
    look: &Look<T, S>,
    scan: &ScanRecord,
) -> Result<Report, Failure>
where
    M: MotionModel<T, NX>,
    S: MeasurementModel<T, NX, NZ>,
{
    let detections: Vec<Detection<T, NZ>> = scan.detections.iter().map(|plot: &Plot| instrument.detection(plot)).collect();
    let taken = tracker.step(state, look, &Scan::new(Instant::from_micros(scan.time_us), &detections));
    taken.map_err(|error| Failure::input(error).within(format!("sensor {}, t = {} us", scan.sensor, scan.time_us)))
}

/// All tracks of `state`, in plain f64.
fn tracks<T: Real + Into<f64>, const NX: usize, const MODES: usize>(state: &Tracks<T, NX, MODES>) -> Vec<Tracked> {
    let estimate = |track: &boresight::track::Track<T, NX, MODES>| {
        let combined = track.bank().combined();
        let variance = |i: usize| combined.cov.get(i, i).map_or(f64::NAN, Into::into);
        Some(Tracked {
            id: track.id()?.number(),
            status: track.status(),
            moving: false,
            mean: combined.mean.iter().map(|x| (*x).into()).collect(),
            std: (0..NX).map(|i| variance(i).max(0.0).sqrt()).collect(),
            modes: track.bank().prob.iter().map(|p| (*p).into()).collect(),
        })
    };
    state.tracks().filter_map(estimate).collect()
}

impl History {
    /// Marks the tracks that are confirmed and have moved.
    fn tell_moving(&mut self, min_travel: f64) {
        // Where a track was born, and whether it has moved since.
        let mut lives: BTreeMap<u32, (Vec<f64>, bool)> = BTreeMap::new();
        for track in self.moments.iter_mut().flat_map(|moment| &mut moment.tracks) {
            let place = track.position(self.state);
            let (birth, moved) = lives.entry(track.id).or_insert_with(|| (place.clone(), false));
            *moved |= distance(birth, &place) >= min_travel;
            track.moving = *moved && track.status != Status::Tentative;
        }
    }
}

impl Counts {
    fn add(&mut self, report: &Report) {
        self.detections += u64::from(report.detections);
        self.detections_dropped += u64::from(report.detections_dropped);
        self.detections_unclaimed += u64::from(report.detections_unclaimed);
        self.seeds_dropped += u64::from(report.seeds_dropped);
        self.births += u64::from(report.births);
        self.births_refused += u64::from(report.births_refused);
        self.tracks_evicted += u64::from(report.tracks_evicted);
        self.tracks_confirmed += u64::from(report.tracks_confirmed);
        self.tracks_deleted += u64::from(report.tracks_deleted);
        self.duplicates_deleted += u64::from(report.duplicates_deleted);
        self.numeric_resets += u64::from(report.numeric_resets);
    }
}
