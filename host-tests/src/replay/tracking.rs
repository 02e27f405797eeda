//! Runs the library's IMM-PDAF over a recording, in the state, modes and precision chosen at run time.
//!
//! Scan by scan, for the sensors that the tracker takes in:
//!
//! ```text
//! sensor at its place in this scan -> step -> estimates of all tracks
//! ```
//!
//! Everything generic ends here: a [`History`] holds plain f64.

use super::config::{Config, InitiationRule, StateKind, TrackerPlan};
use super::history::{Counts, History, Moment, Tracked};
use super::modes::{AccelerationMode, ModeKind, VelocityMode, prior};
use super::recording::{Component, Plot, Recording, ScanRecord};
use super::sensor::{Instrument, Look};
use crate::{Failure, Precision};
use boresight::initiation::{Initiation, Rule};
use boresight::mode::ModeSet;
use boresight::model::position::Position;
use boresight::model::{Layout, MeasurementModel, MotionModel};
use boresight::scalar::Real;
use boresight::scan::{Detection, Report, Scan};
use boresight::time::{Duration, Instant};
use boresight::track::{Logic, Track};
use boresight::tracker::{ImmPdaf, State};

/// Most tracks at a time.
const TRACKS: usize = 64;
/// Most detections of a scan.
const DETS: usize = 256;

/// Runs the tracker of `plan`, with the sensors of `config`, over `recording`.
pub fn track(recording: &Recording, config: &Config, plan: &TrackerPlan, precision: Precision) -> Result<History, Failure> {
    let (axes, _) = plan.state.shape();
    let instrument = |name: &String| Instrument::new(name, recording, &config.sensor(name), plan.gate, axes);
    let instruments = plan.sensors.iter().map(instrument).collect::<Result<Vec<_>, _>>()?;
    let task = Task { recording, plan, instruments };
    let mut history = match precision {
        Precision::F32 => task.by_state::<f32>(),
        Precision::F64 => task.by_state::<f64>(),
    }?;
    history.tell_moving(plan.life.min_travel);
    Ok(history)
}

/// All that a run needs, before its types are chosen.
struct Task<'a> {
    recording: &'a Recording,
    plan: &'a TrackerPlan,
    instruments: Vec<Instrument>,
}

impl Task<'_> {
    fn by_state<T: Real + Into<f64>>(&self) -> Result<History, Failure> {
        match self.plan.state {
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
        let numbered = self.plan.modes.iter().enumerate();
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
        let mut history = History { state: self.plan.state, moments: Vec::new(), counts: Counts::default() };
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
        let (plan, life) = (self.plan, &self.plan.life);
        let logic = Logic::new(life.hits, life.window, life.misses).map_err(refused)?;
        let logic = logic.with_position_limit(T::lit(life.position_limit)).map_err(refused)?;
        let logic = logic.with_duplicate_distance(T::lit(life.duplicate_distance)).map_err(refused)?;
        let entry = |row: &[f64], to: usize| T::lit(row.get(to).copied().unwrap_or(0.0));
        let row = |from: usize| plan.jump.get(from).map(Vec::as_slice).unwrap_or_default();
        let jump = std::array::from_fn(|from| std::array::from_fn(|to| entry(row(from), to)));
        ImmPdaf::new(modes, jump, std::array::from_fn(|mode| entry(&plan.initial, mode)), logic).map_err(refused)
    }

    fn initiation<T: Real, const NX: usize>(&self, layout: Layout) -> Result<Initiation<T, NX>, Failure> {
        let plan = &self.plan.initiation;
        let rule = match plan.rule {
            InitiationRule::OnePoint => Rule::OnePoint,
            InitiationRule::TwoPoint => {
                Rule::TwoPoint { max_speed: T::lit(plan.max_speed), max_gap: Duration::from_micros((plan.max_gap * 1e6) as i64) }
            }
        };
        Initiation::new(rule, prior(layout, plan)).map_err(|error| Failure::input(error).within("tracker: initiation"))
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
    let estimate = |track: &Track<T, NX, MODES>| {
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
