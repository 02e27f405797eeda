//! Runs the library's trackers over a recording, in the association, state, modes and precision chosen at run time.
//!
//! Scan by scan, for the sensors that the tracker takes in:
//!
//! ```text
//! sensor at its place in this scan -> step -> estimates of all tracks
//! ```
//!
//! Everything generic ends here: a [`History`] holds plain f64.

use super::config::{AssociationKind, Config, InitiationRule, LifePolicy, StateKind, TrackerPlan};
use super::history::{Counts, History, Moment, Tracked};
use super::modes::{AccelerationMode, ModeKind, VelocityMode, prior};
use super::recording::{Component, Plot, Recording, ScanRecord};
use super::sensor::{Instrument, Look};
use crate::{Failure, Precision};
use boresight::association::{AssociationMatrix, Associator, Completeness, Gnn, Jpda, MergingJpda, UnresolvedPairs};
use boresight::initiation::{Initiation, Rule};
use boresight::mode::ModeSet;
use boresight::model::position::Position;
use boresight::model::{Layout, MeasurementModel, MotionModel};
use boresight::scalar::Real;
use boresight::scan::{Detection, Report, Scan};
use boresight::time::{Duration, Instant};
use boresight::track::{Existence, Logic, Track};
use boresight::tracker::{ImmJpda, ImmPdaf, Tracker};

/// Most tracks at a time.
const TRACKS: usize = 64;
/// Most detections of a scan.
const DETS: usize = 256;
/// Sets of served tracks that joint association may keep.
const NODES: usize = 16384;
/// Pairs of tracks that a sensor may not tell apart.
const PAIRS: usize = 16;

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
        let modes = modes.collect::<Result<Vec<M>, _>>()?;
        let places = Places::new(modes.len()).ok_or_else(|| Failure::at_field("tracker: modes", format!("{} of them", modes.len())))?;
        let jump = std::array::from_fn(|from| places.spread(self.plan.jump.get(places.mode[from]).map(Vec::as_slice).unwrap_or_default()));
        let initial = places.spread(&self.plan.initial);
        let modes = places.mode.map(|mode| modes[mode]);
        let logic = self.logic()?;
        let initiation = self.initiation(<[M; MODES] as ModeSet<T, NX, MODES>>::LAYOUT)?;
        let refused = |error| Failure::input(error).within("tracker");
        let joint = |association| ImmJpda::new(modes, jump, initial, logic, association).map_err(refused);
        match self.plan.association {
            AssociationKind::Pda => {
                let tracker: Single<T, M, NX> = ImmPdaf::new(modes, jump, initial, logic).map_err(refused)?;
                self.run::<T, _, NX, AXES, STRIDE>(tracker, tracker.with_initiation(initiation), &places)
            }
            kind => {
                let tracker: Together<T, M, NX> = joint(Association::of(kind))?;
                self.run::<T, _, NX, AXES, STRIDE>(tracker, tracker.with_initiation(initiation), &places)
            }
        }
    }

    fn run<T, K, const NX: usize, const AXES: usize, const STRIDE: usize>(
        &self,
        silent: K,
        initiating: K,
        places: &Places,
    ) -> Result<History, Failure>
    where
        T: Real + Into<f64>,
        K: Tracker<T, NX, MODES>,
    {
        let mut state = Box::new(K::State::default());
        let mut history = History { state: self.plan.state, moments: Vec::new(), counts: Counts::default() };
        for (number, scan) in self.recording.scans.iter().enumerate() {
            let Some(instrument) = self.instruments.iter().find(|instrument| instrument.name == scan.sensor) else { continue };
            let tracker = if instrument.initiates { &initiating } else { &silent };
            let report = take_in::<T, K, NX, AXES, STRIDE>(tracker, &mut state, instrument, scan)?;
            history.counts.add(&report);
            let tracks = tracker.tracks(&state).filter_map(|track| tracked(track, places)).collect();
            history.moments.push(Moment { scan: number, time_us: scan.time_us, tracks });
        }
        Ok(history)
    }

    fn logic<T: Real>(&self) -> Result<Logic<T>, Failure> {
        let refused = |error| Failure::input(error).within("tracker");
        let life = &self.plan.life;
        let logic = match life.policy {
            LifePolicy::Count => Logic::new(life.hits, life.window, life.misses),
            LifePolicy::Existence => Logic::existence(Existence {
                birth: T::lit(life.birth),
                lifetime: T::lit(life.lifetime),
                confirm: T::lit(life.confirm),
                delete: T::lit(life.delete),
            }),
        };
        let logic = logic.and_then(|logic| logic.with_position_limit(T::lit(life.position_limit)));
        logic.and_then(|logic| logic.with_duplicate_distance(T::lit(life.duplicate_distance))).map_err(refused)
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

/// Modes of every tracker here. Fewer modes are spread over as many: one that stands in several places has the same
/// state in all of them and its probability in shares, which is the same filter.
const MODES: usize = 3;

/// Where the modes of the description stand.
struct Places {
    /// The described mode in each place
    mode: [usize; MODES],
    count: usize,
}

impl Places {
    fn new(count: usize) -> Option<Self> {
        (1..=MODES).contains(&count).then(|| Self { mode: std::array::from_fn(|place| place.min(count - 1)), count })
    }

    /// Probabilities of described modes in equal shares for their places.
    fn spread<T: Real>(&self, described: &[f64]) -> [T; MODES] {
        let shares = |mode: usize| self.mode.iter().filter(|m| **m == mode).count().max(1) as f64;
        self.mode.map(|mode| T::lit(described.get(mode).copied().unwrap_or(0.0) / shares(mode)))
    }

    /// Probabilities of the described modes.
    fn gather<T: Into<f64> + Copy>(&self, prob: &[T; MODES]) -> Vec<f64> {
        let mut gathered = vec![0.0; self.count];
        self.mode.iter().zip(prob).for_each(|(mode, p)| gathered[*mode] += (*p).into());
        gathered
    }
}

type Joint = MergingJpda<NODES, PAIRS>;
type Memory<T, A> = <A as Associator<T, TRACKS, DETS>>::Memory;

/// Joint association, chosen at run time.
#[derive(Debug, Clone, Copy)]
enum Association {
    Jpda(Joint),
    Gnn(Gnn),
}

impl Association {
    fn of(kind: AssociationKind) -> Self {
        match kind {
            AssociationKind::Gnn => Self::Gnn(Gnn),
            AssociationKind::Jpda | AssociationKind::Pda => Self::Jpda(MergingJpda::new(Jpda::new())),
        }
    }
}

impl<T: Real> Associator<T, TRACKS, DETS> for Association {
    type Memory = (Memory<T, Joint>, Memory<T, Gnn>);
    const MEMORY: Self::Memory = (Joint::MEMORY, Gnn::MEMORY);

    fn pairs(memory: &mut Self::Memory) -> Option<&mut UnresolvedPairs<T, DETS>> {
        <Joint as Associator<T, TRACKS, DETS>>::pairs(&mut memory.0)
    }

    fn associate(&self, matrix: &mut AssociationMatrix<T, TRACKS, DETS>, memory: &mut Self::Memory) -> Completeness {
        match self {
            Self::Jpda(jpda) => jpda.associate(matrix, &mut memory.0),
            Self::Gnn(gnn) => {
                // One event knows no doubt of who is who.
                if let Some(pairs) = <Self as Associator<T, TRACKS, DETS>>::pairs(memory) {
                    pairs.clear();
                }
                gnn.associate(matrix, &mut memory.1)
            }
        }
    }
}

type Single<T, M, const NX: usize> = ImmPdaf<T, [M; MODES], NX, MODES, TRACKS, DETS>;
type Together<T, M, const NX: usize> = ImmJpda<T, [M; MODES], NX, MODES, TRACKS, DETS, Association>;

/// One scan into the tracker, as what its sensor measures.
fn take_in<T: Real, K: Tracker<T, NX, MODES>, const NX: usize, const AXES: usize, const STRIDE: usize>(
    tracker: &K,
    state: &mut K::State,
    instrument: &Instrument,
    scan: &ScanRecord,
) -> Result<Report, Failure> {
    let origin = instrument.origin(scan.own);
    if instrument.components.contains(&Component::X) {
        let look: Look<T, Position<T, AXES, STRIDE>, AXES> = instrument.position_sensor(origin)?;
        return step(tracker, state, instrument, &look, scan);
    }
    match instrument.components.len() {
        1 => step(tracker, state, instrument, &instrument.radar::<T, 1, AXES, STRIDE>(origin)?, scan),
        2 => step(tracker, state, instrument, &instrument.radar::<T, 2, AXES, STRIDE>(origin)?, scan),
        3 => step(tracker, state, instrument, &instrument.radar::<T, 3, AXES, STRIDE>(origin)?, scan),
        _ => step(tracker, state, instrument, &instrument.radar::<T, 4, AXES, STRIDE>(origin)?, scan),
    }
}

fn step<T: Real, K: Tracker<T, NX, MODES>, S: MeasurementModel<T, NX, NZ>, const NX: usize, const NZ: usize>(
    tracker: &K,
    state: &mut K::State,
    instrument: &Instrument,
    look: &Look<T, S, NZ>,
    scan: &ScanRecord,
) -> Result<Report, Failure> {
    let detections: Vec<Detection<T, NZ>> = scan.detections.iter().map(|plot: &Plot| instrument.detection(plot)).collect();
    let taken = tracker.step(state, look, &Scan::new(Instant::from_micros(scan.time_us), &detections));
    taken.map_err(|error| Failure::input(error).within(format!("sensor {}, t = {} us", scan.sensor, scan.time_us)))
}

/// A track in plain f64.
fn tracked<T: Real + Into<f64>, const NX: usize>(track: &Track<T, NX, MODES>, places: &Places) -> Option<Tracked> {
    let combined = track.bank().combined();
    let variance = |i: usize| combined.cov.get(i, i).map_or(f64::NAN, Into::into);
    Some(Tracked {
        id: track.id()?.number(),
        status: track.status(),
        moving: false,
        mean: combined.mean.iter().map(|x| (*x).into()).collect(),
        std: (0..NX).map(|i| variance(i).max(0.0).sqrt()).collect(),
        modes: places.gather(&track.bank().prob),
    })
}
