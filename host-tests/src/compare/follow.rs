//! Every tracker on any stage, with the same room: what it says of the targets after every scan.

use super::stage::{Dwell, Stage};
use crate::scenario::filter::Fault;
use boresight::association::{Associator, Gnn, Jpda, MergingJpda};
use boresight::coupled::Cross;
use boresight::error::ScanError;
use boresight::gaussian::Gaussian;
use boresight::glmb::{Mixture, Ranked, Region};
use boresight::mode::{LikelyModes, ModeSet};
use boresight::scan::{Report, Scan};
use boresight::sensor::Sensor;
use boresight::time::Instant;
use boresight::track::{Status, TrackId};
use boresight::tracker::{CoupledState, GlmbState, ImmCoupled, ImmJpda, ImmPdaf, JmsGlmb, JointState, LmsJpda, LmsState, State, Tracker};

/// The trackers, in the order of the page.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Which {
    /// `ImmJpda` that takes the best joint event for certain
    Gnn,
    /// Every track for itself
    ImmPdaf,
    /// All together
    ImmJpda,
    /// All together, of whose modes the likely ones run
    LmsJpda,
    /// All together, two of which may have one plot
    MergingJpda,
    /// Two targets as one density
    ImmCoupled,
    /// A labelled set
    JmsGlmb,
}

impl Which {
    /// All of them.
    pub const ALL: [Self; 7] = [Self::Gnn, Self::ImmPdaf, Self::ImmJpda, Self::LmsJpda, Self::MergingJpda, Self::ImmCoupled, Self::JmsGlmb];

    /// As the page calls it.
    pub fn name(self) -> &'static str {
        match self {
            Self::Gnn => "`ImmJpda`, `Gnn`",
            Self::ImmPdaf => "`ImmPdaf`",
            Self::ImmJpda => "`ImmJpda`",
            Self::LmsJpda => "`LmsJpda`",
            Self::MergingJpda => "`ImmJpda`, `MergingJpda`",
            Self::ImmCoupled => "`ImmCoupled`",
            Self::JmsGlmb => "`JmsGlmb`",
        }
    }
}

/// One target as a tracker sees it.
#[derive(Debug, Clone)]
pub struct Seen {
    /// Which track
    pub label: u64,
    /// \[m\], height 0 where the tracker has none
    pub position: [f64; 3],
    /// Covariance of the position, as many rows as axes \[m²\]
    pub cov: Vec<f64>,
}

impl Seen {
    fn new<M: ModeSet<f32, NX, MODES>, const NX: usize, const MODES: usize>(label: u64, g: &Gaussian<f32, NX>) -> Self {
        let at = |axis: usize| axis * M::LAYOUT.stride;
        let axes = 0..M::LAYOUT.axes;
        let entry = |(a, b): (usize, usize)| g.cov.get(at(a), at(b)).map_or(f64::NAN, f64::from);
        let position = std::array::from_fn(|axis| g.mean.get(at(axis)).filter(|_| axis < axes.end).map_or(0.0, |x| f64::from(*x)));
        Self { label, position, cov: axes.clone().flat_map(|a| axes.clone().map(move |b| (a, b))).map(entry).collect() }
    }
}

/// Room for tracks, plots and nodes; more than any stage needs.
const TRACKS: usize = 64;
const DETS: usize = 128;
/// See there.
pub const NODES: usize = 256;
/// Modes of which a track runs no fewer, and how unlikely the others are.
const LEAST: usize = 3;
const UNLIKELY: f32 = 0.005;
const PRINCIPAL: f32 = 0.3;

/// The labelled sets' room, and their events.
type Events = Ranked<100, 64>;
type Sets<const NX: usize, const MODES: usize> = GlmbState<f32, Mixture<f32, NX, MODES, 1>, Events, 512, 1024, 16, 8, DETS>;
const HYPOTHESES: usize = 100;
const LEAST_SHARE: f32 = 1e-5;

/// Bytes that `which` remembers with room for 16 tracks, 32 plots and 64 nodes, of joint pairs for 4, of targets of the coupled filter for 2;
/// a labelled set as the budget counts it, with 48 tracks and 128 plots.
pub fn ram<const NX: usize, const MODES: usize>(which: Which) -> usize {
    type Room<const NX: usize, const MODES: usize, A> = JointState<f32, NX, MODES, 16, 32, A>;
    match which {
        Which::Gnn => size_of::<Room<NX, MODES, Gnn>>(),
        Which::ImmPdaf => size_of::<State<f32, NX, MODES, 16, 32>>(),
        Which::ImmJpda => size_of::<Room<NX, MODES, Jpda<64>>>(),
        Which::LmsJpda => size_of::<LmsState<f32, NX, MODES, 16, 32, Jpda<64>>>(),
        Which::MergingJpda => size_of::<Room<NX, MODES, MergingJpda<64, 4>>>(),
        Which::ImmCoupled => size_of::<CoupledState<f32, NX, MODES, 32>>(),
        Which::JmsGlmb => size_of::<twin::glmb::Memory<Mixture<f32, NX, MODES, 1>, 48>>(),
    }
}

type Joint<M, A, const NX: usize, const MODES: usize> = ImmJpda<f32, M, NX, MODES, TRACKS, DETS, A>;

/// What `which` says of the targets of `stage`, by time.
pub fn follow<M, S, const NX: usize, const MODES: usize>(which: Which, stage: &Stage<M, S, NX, MODES>) -> Result<Vec<Vec<Seen>>, Fault>
where
    M: ModeSet<f32, NX, MODES> + Copy,
    S: Sensor<f32, NX, 2>,
{
    let Stage { modes, jump, initial, logic, initiation, .. } = stage;
    match which {
        Which::Gnn => joint(stage, Gnn),
        Which::ImmJpda => joint(stage, Jpda::<NODES>::new()),
        Which::MergingJpda => joint(stage, MergingJpda::<NODES, 4>::new(Jpda::new())),
        Which::ImmPdaf => {
            type Tracks<M, const NX: usize, const MODES: usize> = ImmPdaf<f32, M, NX, MODES, TRACKS, DETS>;
            let tracker = Tracks::new(*modes, *jump, *initial, *logic)?.with_initiation(*initiation);
            tracks(stage, &tracker, |t, state: &mut State<_, NX, MODES, TRACKS, DETS>, g, at| t.start(state, g, at))
        }
        Which::LmsJpda => {
            let likely = LikelyModes::new(jump, UNLIKELY, PRINCIPAL, LEAST)?;
            let tracker = LmsJpda::<_, M, NX, MODES, TRACKS, DETS, _>::new(*modes, *jump, *initial, likely, *logic, Jpda::<NODES>::new())?;
            let tracker = tracker.with_initiation(*initiation);
            tracks(stage, &tracker, |t, state: &mut LmsState<_, NX, MODES, TRACKS, DETS, _>, g, at| t.start(state, g, at))
        }
        Which::ImmCoupled => coupled(stage),
        Which::JmsGlmb => labelled(stage),
    }
}

/// The same by any joint association.
pub fn joint<M, S, A, const NX: usize, const MODES: usize>(stage: &Stage<M, S, NX, MODES>, associator: A) -> Result<Vec<Vec<Seen>>, Fault>
where
    M: ModeSet<f32, NX, MODES> + Copy,
    S: Sensor<f32, NX, 2>,
    A: Associator<f32, TRACKS, DETS>,
{
    let tracker = Joint::<M, A, NX, MODES>::new(stage.modes, stage.jump, stage.initial, stage.logic, associator)?;
    let tracker = tracker.with_initiation(stage.initiation);
    tracks(stage, &tracker, |t, state: &mut JointState<_, NX, MODES, TRACKS, DETS, A>, g, at| t.start(state, g, at))
}

fn tracks<M, S, K, const NX: usize, const MODES: usize>(
    stage: &Stage<M, S, NX, MODES>,
    tracker: &K,
    start: impl Fn(&K, &mut K::State, Gaussian<f32, NX>, Instant) -> Option<TrackId>,
) -> Result<Vec<Vec<Seen>>, Fault>
where
    M: ModeSet<f32, NX, MODES>,
    S: Sensor<f32, NX, 2>,
    K: Tracker<f32, NX, MODES>,
{
    let mut state = Box::<K::State>::default();
    for cue in &stage.cues {
        start(tracker, &mut state, *cue, stage.cued_at).ok_or(Fault::Start)?;
    }
    let step = |state: &mut K::State, dwell: &Dwell<S>| tracker.step(state, &dwell.sensor, &Scan::new(dwell.time, &dwell.plots));
    let seen = |state: &K::State| {
        let confirmed = tracker.estimates(state).filter(|estimate| estimate.status != Status::Tentative);
        confirmed.map(|estimate| Seen::new::<M, NX, MODES>(estimate.id.number().into(), &estimate.state)).collect()
    };
    by_time(stage, state, step, seen)
}

fn coupled<M, S, const NX: usize, const MODES: usize>(stage: &Stage<M, S, NX, MODES>) -> Result<Vec<Vec<Seen>>, Fault>
where
    M: ModeSet<f32, NX, MODES> + Copy,
    S: Sensor<f32, NX, 2>,
{
    type Pair<const NX: usize, const MODES: usize> = CoupledState<f32, NX, MODES, DETS, Cross<f32, NX>>;
    let filter = ImmCoupled::<f32, M, NX, MODES>::new(stage.modes, stage.jump, stage.initial)?;
    let mut state = Box::new(Pair::new());
    let [first, second] = stage.cues.as_slice() else { return Err(Fault::Start) };
    filter.start(&mut state, [*first, *second], stage.cued_at).ok_or(Fault::Start)?;
    let step = |state: &mut Pair<NX, MODES>, dwell: &Dwell<S>| filter.step(state, &dwell.sensor, &Scan::new(dwell.time, &dwell.plots));
    let seen = |state: &Pair<NX, MODES>| {
        state.estimates().map(|estimate| Seen::new::<M, NX, MODES>(estimate.id.number().into(), &estimate.state)).collect()
    };
    by_time(stage, state, step, seen)
}

fn labelled<M, S, const NX: usize, const MODES: usize>(stage: &Stage<M, S, NX, MODES>) -> Result<Vec<Vec<Seen>>, Fault>
where
    M: ModeSet<f32, NX, MODES> + Copy,
    S: Sensor<f32, NX, 2>,
{
    let tracker = JmsGlmb::<f32, M, Events, NX, MODES, 4>::new(stage.modes, stage.jump, stage.survival, Events {})?;
    let tracker = tracker.with_limits(HYPOTHESES, LEAST_SHARE)?;
    let with = |tracker: JmsGlmb<_, _, _, NX, MODES, 4>, place| tracker.with_region(Region::new(stage.birth, place, stage.initial)?);
    let tracker = stage.regions.iter().copied().try_fold(tracker, with)?;
    let state = Box::new(Sets::<NX, MODES>::new());
    let step = |state: &mut Sets<NX, MODES>, dwell: &Dwell<S>| tracker.step(state, &dwell.sensor, &Scan::new(dwell.time, &dwell.plots));
    let seen = |state: &Sets<NX, MODES>| {
        let label = |label: boresight::glmb::Label| u64::from(label.birth_scan) << 16 | u64::from(label.index);
        state.estimates().map(|estimate| Seen::new::<M, NX, MODES>(label(estimate.label), &estimate.state)).collect()
    };
    by_time(stage, state, step, seen)
}

/// All scans, and what is seen after those of one time.
fn by_time<M, S, X, const NX: usize, const MODES: usize>(
    stage: &Stage<M, S, NX, MODES>,
    mut state: Box<X>,
    step: impl Fn(&mut X, &Dwell<S>) -> Result<Report, ScanError>,
    seen: impl Fn(&X) -> Vec<Seen>,
) -> Result<Vec<Vec<Seen>>, Fault> {
    let mut at = |dwells: &Vec<Dwell<S>>| -> Result<Vec<Seen>, Fault> {
        for dwell in dwells {
            let report = step(&mut state, dwell)?;
            if report.detections_dropped > 0 {
                return Err(Fault::Dropped(report));
            }
        }
        Ok(seen(&state))
    };
    stage.scans.iter().map(&mut at).collect()
}
