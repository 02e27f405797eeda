//! One run of a setting: the scenario's targets, thinned plots, and a tracker that is told what the setting says.

use super::lesson::Setting;
use crate::Failure;
use crate::compare::follow::{self, Seen};
use crate::compare::stage::{self, Plane, Stage, Truth};
use crate::metrics::{match_points, nees};
use crate::monte_carlo::Streams;
use crate::scenario::filter::Fault;
use crate::scenario::kashyap::data::{Phase, SIGMA, phase};
use boresight::association::{Gate, Jpda};
use boresight::error::ConfigError;
use boresight::gaussian::Gaussian;
use boresight::initiation::{Initiation, Rule};
use boresight::model::motion::{ConstantAcceleration, ProcessNoise};
use boresight::model::position::Position;
use boresight::sensor::{Clutter, UniformSensor};
use boresight::symmetric::Symmetric;
use boresight::time::Duration;
use boresight::track::{Existence, Logic};
use nalgebra::SVector;
use rand::RngExt;
use std::collections::BTreeSet;
use std::ops::Range;

/// Plots that are left.
const LEFT: f64 = 0.91;
/// Farther from a target a track is none of it \[m\].
const CUTOFF: f64 = 100.0;
/// What the map shows of a run.
const TURN: Range<usize> = 20..42;
/// The first scan of the stage is the scenario's third.
const FIRST: usize = 2;

/// What came of one scan of one target.
#[derive(Debug, Clone, Copy)]
pub struct Look {
    /// Error of its track \[m\]; `None` where it has none
    pub error: Option<f64>,
    /// NEES of its position, a component
    pub nees: Option<f64>,
    /// Whether it manoeuvres; `None` about the beginning of the run and the end of a manoeuvre
    pub manoeuvres: Option<bool>,
}

/// One run.
#[derive(Debug, Clone, Default)]
pub struct Watched {
    /// By scan, both targets
    pub looks: Vec<Vec<Look>>,
    /// By scan, tracks of no target
    pub false_tracks: Vec<usize>,
    /// The paths of the targets
    pub paths: Vec<Vec<[f64; 2]>>,
    seen: Vec<Vec<Seen>>,
}

impl Watched {
    /// The first target's path through its first manoeuvre.
    pub fn turn(&self) -> Vec<[f64; 2]> {
        self.paths.first().into_iter().flatten().skip(TURN.start).take(TURN.len()).copied().collect()
    }

    /// The tracks about it, as one line with gaps.
    pub fn tracks(&self) -> Vec<[f64; 2]> {
        let near = |seen: &Seen, at: &[f64; 2]| (seen.position[0] - at[0]).hypot(seen.position[1] - at[1]) < 4.0 * CUTOFF;
        let turn = self.turn();
        let scans = self.seen.iter().skip(TURN.start).zip(&turn);
        let seen: Vec<&Seen> = scans.flat_map(|(seen, at)| seen.iter().filter(move |seen| near(seen, at))).collect();
        let labels: BTreeSet<u64> = seen.iter().map(|seen| seen.label).collect();
        let of = |label: u64| seen.iter().filter(move |seen| seen.label == label).map(|seen| [seen.position[0], seen.position[1]]);
        labels.into_iter().flat_map(|label| of(label).chain([[f64::NAN; 2]])).collect()
    }
}

/// Runs `setting` on the data of a run.
pub fn watch(setting: &Setting, streams: &mut Streams) -> Result<Watched, Failure> {
    let mut stage = stage::kashyap_a(streams)?;
    for dwell in stage.scans.iter_mut().flatten() {
        dwell.plots.retain(|_| streams.data.random_bool(LEFT));
    }
    tell(setting, &mut stage).map_err(|error| Failure::input(error).within(setting.label))?;
    let seen = match setting.noise {
        None => follow::joint(&stage, Jpda::<{ follow::NODES }>::new()),
        Some(variance) => one_model(stage.clone(), variance)
            .map_err(Fault::from)
            .and_then(|stage| follow::joint(&stage, Jpda::<{ follow::NODES }>::new())),
    };
    let seen = seen.map_err(|fault| Failure::input(fault).within(setting.label))?;
    let mut watched = Watched { paths: paths(&stage.truth), ..Watched::default() };
    for (k, (truth, seen)) in stage.truth.iter().zip(&seen).enumerate() {
        let (looks, false_tracks) = compare(k + FIRST, truth, seen);
        watched.looks.push(looks);
        watched.false_tracks.push(false_tracks);
    }
    Ok(Watched { seen, ..watched })
}

/// Tracks are found, and live, by what the setting says.
fn tell<M, const MODES: usize>(setting: &Setting, stage: &mut Stage<M, Plane<3>, 6, MODES>) -> Result<(), ConfigError> {
    let Setting { stay, p_detect, clutter, gate, life, .. } = *setting;
    let model = Position::new(Symmetric::from_diagonal([(SIGMA * SIGMA) as f32; 2]))?;
    let sensor = UniformSensor::new(model, p_detect, Clutter::Poisson(clutter), Gate::new::<2>(gate)?)?;
    stage.scans.iter_mut().flatten().for_each(|dwell| dwell.sensor = sensor);
    stage.cues.clear();
    let prior = Gaussian::new(SVector::zeros(), Symmetric::from_diagonal([1.0, 2500.0, 100.0, 1.0, 2500.0, 100.0]));
    stage.initiation = Initiation::new(Rule::TwoPoint { max_speed: 60.0, max_gap: Duration::from_millis(2000) }, prior)?;
    stage.logic = match life {
        Some([hits, window, misses]) => Logic::new(hits, window, misses)?,
        None => Logic::existence(Existence { birth: 0.05, lifetime: 500.0, confirm: 0.98, delete: 0.01 })?,
    };
    if let Some(stay) = stay {
        let other = (1.0 - stay) / (MODES - 1) as f32;
        stage.jump = std::array::from_fn(|i| std::array::from_fn(|j| if i == j { stay } else { other }));
    }
    Ok(())
}

/// The same with one model of constant acceleration.
fn one_model<M>(
    stage: Stage<M, Plane<3>, 6, 3>,
    variance: f32,
) -> Result<Stage<(ConstantAcceleration<f32, 2>,), Plane<3>, 6, 1>, ConfigError> {
    let Stage { cues, cued_at, initiation, logic, regions, birth, survival, scans, truth, .. } = stage;
    let modes = (ConstantAcceleration::new(ProcessNoise::Discrete(variance))?,);
    Ok(Stage { modes, jump: [[1.0]], initial: [1.0], cues, cued_at, initiation, logic, regions, birth, survival, scans, truth })
}

/// Pairs the targets of scan `k` with the tracks.
fn compare(k: usize, truth: &Truth, seen: &[Seen]) -> (Vec<Look>, usize) {
    let positions: Vec<[f64; 3]> = seen.iter().map(|seen| seen.position).collect();
    let pairs = match_points(truth, &positions, CUTOFF, 2.0).pairs;
    let look = |number: usize| {
        let pair = pairs.iter().find(|pair| pair.truth == number);
        let of = pair.and_then(|pair| {
            let (seen, at) = (&seen[pair.estimate], truth[number].position);
            nees(&[seen.position[0] - at[0], seen.position[1] - at[1]], &seen.cov)
        });
        let manoeuvres = match phase(number, k) {
            Phase::Manoeuvre => Some(true),
            Phase::Quiet => Some(false),
            Phase::Between => None,
        };
        Look { error: pair.map(|pair| pair.distance), nees: of.map(|nees| nees / 2.0), manoeuvres }
    };
    ((0..truth.len()).map(look).collect(), seen.len() - pairs.len())
}

fn paths(truth: &[Truth]) -> Vec<Vec<[f64; 2]>> {
    let of = |number: usize| truth.iter().filter_map(|scan| scan.get(number)).map(|t| [t.position[0], t.position[1]]).collect();
    (0..truth.first().map_or(0, Vec::len)).map(of).collect()
}
