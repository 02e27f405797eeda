//! What all trackers see on a stage: the same motion models, sensors and scans, and where their tracks may begin.
//!
//! ```text
//! kashyap-a         two targets manoeuvre apart from each other, 20 clutter points a scan; cued
//! gomes             two targets cross at 12 degrees, seven turn rates, no clutter; cued
//! jeong-tugnait     two targets within one plot of radar and infrared sensor, clutter; cued
//! jms-glmb-linear   three targets come, turn and go in 60 clutter points a scan; found by the trackers themselves
//! ```
//!
//! Data and models are those of the published scenarios. What differs there from filter to filter is the same here: everybody is told
//! the density of clutter and the detection probability. A cue starts a track of the JPDA family and of the coupled filter; to the labelled sets, which
//! know no cue, it is a region of birth, one step on.

use crate::Failure;
use crate::metrics::Labelled;
use crate::monte_carlo::Streams;
use crate::scenario::filter::jump;
use crate::scenario::{gomes, jeong_tugnait, jms_glmb, kashyap};
use boresight::association::Gate;
use boresight::error::ConfigError;
use boresight::gaussian::Gaussian;
use boresight::initiation::{Initiation, Rule};
use boresight::mode::{JumpMatrix, ModeSet};
use boresight::model::position::Position;
use boresight::model::radar::Radar;
use boresight::model::resolution::Resolution;
use boresight::model::turn::KnownTurn;
use boresight::scan::Detection;
use boresight::sensor::{Clutter, UniformSensor, Unresolving};
use boresight::symmetric::Symmetric;
use boresight::time::{Duration, Instant};
use boresight::track::Logic;

/// One scan of one sensor.
#[derive(Debug, Clone)]
pub struct Dwell<S> {
    /// When
    pub time: Instant,
    /// Who looked
    pub sensor: S,
    /// What it saw
    pub plots: Vec<Detection<f32, 2>>,
}

/// The true targets at one time, planar ones at height 0 \[m\].
pub type Truth = Vec<Labelled<[f64; 3]>>;

/// One run of a scenario, as every tracker meets it.
#[derive(Debug, Clone)]
pub struct Stage<M, S, const NX: usize, const MODES: usize> {
    /// The motion models
    pub modes: M,
    /// Probabilities of jumps between them
    pub jump: JumpMatrix<f32, MODES>,
    /// Their probabilities in a new track
    pub initial: [f32; MODES],
    /// Tracks that are given, and at what time; none where the trackers find them
    pub cues: Vec<Gaussian<f32, NX>>,
    /// See there
    pub cued_at: Instant,
    /// How the JPDA family starts tracks from plots
    pub initiation: Initiation<f32, NX>,
    /// How its tracks live
    pub logic: Logic<f32>,
    /// Where the labelled sets may begin, in every scan, and how probably
    pub regions: Vec<Gaussian<f32, NX>>,
    /// See there
    pub birth: f32,
    /// The probability that a target survives from scan to scan
    pub survival: f32,
    /// By time, what every sensor saw
    pub scans: Vec<Vec<Dwell<S>>>,
    /// By time, where the targets were
    pub truth: Vec<Truth>,
}

/// A region as good as a cue.
const CUED_BIRTH: f32 = 0.1;
/// Of targets that stay: not one, so that a labelled set can still give one up.
const STAYS: f32 = 0.99999;

/// Positions measured in the plane, `STRIDE` states an axis.
pub type Plane<const STRIDE: usize> = UniformSensor<Position<f32, 2, STRIDE>, f32>;
type Seeing = Unresolving<UniformSensor<Radar<f32, 2, 3, 3>, f32>, f32, 2>;
type Turns = [KnownTurn<f32, 2>; gomes::filters::MODES];

/// Scenario `kashyap-a`, with the three models of its best filter and the P_D that it assumes.
pub fn kashyap_a(streams: &mut Streams) -> Result<Stage<kashyap::filters::Three<f32>, Plane<3>, 6, 3>, Failure> {
    let data = kashyap::data::draw(streams);
    let make = || -> Result<_, ConfigError> {
        let (modes, jump, initial) = kashyap::filters::three_models::<f32>()?;
        let variance = (kashyap::data::SIGMA * kashyap::data::SIGMA) as f32;
        let model = Position::new(Symmetric::from_diagonal([variance; 2]))?;
        let clutter = Clutter::Poisson(kashyap::data::CLUTTER_DENSITY as f32);
        let sensor = UniformSensor::new(model, kashyap::filters::ASSUMED_P_DETECT as f32, clutter, Gate::new::<2>(25.0)?)?;
        let cues: Vec<_> = data.start.iter().map(|start| kashyap::filters::two_points(start, variance)).collect();
        let scans = data.plots.iter().enumerate().skip(2).map(|(k, plots)| vec![dwell(k as u64 * 1000, sensor, plots)]).collect();
        let truth = (2..kashyap::data::SCANS).map(|k| numbered(data.truth.iter().map(|path| [path[k][0], path[k][1], 0.0]))).collect();
        cued(modes, jump.map(|row| row.map(|p| p as f32)), initial.map(|p| p as f32), cues, 1000, scans, truth)
    };
    make().map_err(Failure::input)
}

/// Scenario `gomes`. There is no clutter: what the trackers are told is one point in a scan of the whole region.
pub fn gomes(streams: &mut Streams) -> Result<Stage<Turns, Plane<2>, 4, { gomes::filters::MODES }>, Failure> {
    const NEXT_TO_NO_CLUTTER: f32 = 1e-9;
    let data = gomes::data::draw(&gomes::CROSSING_12, streams);
    let make = || -> Result<_, ConfigError> {
        let cov = Symmetric::from_diagonal(gomes::data::START.map(|sigma| (sigma * sigma) as f32));
        let cues = data.start.iter().map(|at| Gaussian::new(at.map(|x| x as f32).into(), cov)).collect();
        let scan = |(k, plots): (usize, &[[f64; 2]; 2])| -> Result<_, ConfigError> {
            let converted = plots.map(gomes::filters::convert::<f32>);
            let mean = Symmetric::from_fn(|i, j| 0.5 * (converted[0].1.upper()[i][j] + converted[1].1.upper()[i][j]));
            let gate = Gate::new::<2>(25.0)?;
            let sensor = UniformSensor::new(Position::new(mean)?, 0.99, Clutter::Poisson(NEXT_TO_NO_CLUTTER), gate)?;
            let plots = converted.iter().map(|(position, noise)| Detection::new(*position).with_noise(*noise)).collect();
            Ok(vec![Dwell { time: Instant::from_millis(1000 * (k as u64 + 1)), sensor, plots }])
        };
        let scans = data.plots.iter().enumerate().map(scan).collect::<Result<_, _>>()?;
        let truth = (1..=gomes::data::SCANS).map(|k| numbered(data.truth.iter().map(|path| [path[k][0], path[k][2], 0.0]))).collect();
        cued(gomes::filters::turns()?, gomes::filters::jump(), gomes::filters::straight(), cues, 0, scans, truth)
    };
    make().map_err(Failure::input)
}

/// Scenario `jeong-tugnait`. The sensors state their resolution, which trackers heed that can.
pub fn jeong_tugnait(streams: &mut Streams) -> Result<Stage<jeong_tugnait::filters::Modes<f32>, Seeing, 9, 3>, Failure> {
    use jeong_tugnait::{data, filters};
    let drawn = data::draw(streams);
    let make = || -> Result<_, ConfigError> {
        let seeing = |of: &data::Sensor| -> Result<Seeing, ConfigError> {
            let resolution = Resolution::new(of.cells.map(|cell| cell as f32))?;
            Ok(Unresolving { sensor: filters::seeing(of, true)?, resolution })
        };
        let sensors = [seeing(&data::RADAR)?, seeing(&data::INFRARED)?];
        let at_once = |(time, plots): (Instant, [Vec<Detection<f32, 2>>; 2])| {
            sensors.into_iter().zip(plots).map(|(sensor, plots)| Dwell { time, sensor, plots }).collect()
        };
        let truth = (1..=data::SCANS).map(|k| numbered(drawn.truth.iter().map(|path| path[k]))).collect();
        let scans = filters::scans(&drawn).map(at_once).collect();
        cued(filters::modes()?, jump(filters::JUMP), filters::INITIAL.map(|p| p as f32), filters::start(&drawn).into(), 0, scans, truth)
    };
    make().map_err(Failure::input)
}

/// Scenario `jms-glmb-linear`.
pub fn jms_glmb_linear(streams: &mut Streams) -> Result<Stage<jms_glmb::filters::Three<f32>, Plane<2>, 4, 3>, Failure> {
    use jms_glmb::{data, filters};
    let drawn = data::draw(streams);
    let make = || -> Result<_, ConfigError> {
        let sensor = filters::plane(filters::P_DETECT)?;
        let plots = drawn.plots(data::Sensor::Position(filters::SIGMA), filters::P_DETECT);
        let pairs = Rule::TwoPoint { max_speed: 300.0, max_gap: Duration::from_millis(data::STEP_MS as i64) };
        let truth = |targets: &Vec<data::Target>| {
            let of = |t: &data::Target| Labelled { label: t.number as u64, position: [t.position[0], t.position[1], 0.0] };
            targets.iter().map(of).collect()
        };
        Ok(Stage {
            modes: filters::three(filters::LINEAR_SETTING)?,
            jump: filters::jump(filters::LINEAR_SETTING.stay),
            initial: [1.0, 0.0, 0.0],
            cues: Vec::new(),
            cued_at: Instant::ZERO,
            initiation: Initiation::new(pairs, filters::birth([0.0; 2]))?,
            logic: Logic::new(4, 5, 4)?.with_duplicate_distance(2.0)?,
            regions: data::BIRTHS.map(filters::birth).into(),
            birth: filters::LINEAR_SETTING.births as f32,
            survival: filters::P_SURVIVE as f32,
            scans: plots.iter().enumerate().map(|(k, plots)| vec![dwell(data::STEP_MS * (k as u64 + 1), sensor, plots)]).collect(),
            truth: drawn.truth.iter().map(truth).collect(),
        })
    };
    make().map_err(Failure::input)
}

/// A stage whose tracks are given at `at_ms`, one second before the first scan, and stay.
fn cued<M: ModeSet<f32, NX, MODES>, S, const NX: usize, const MODES: usize>(
    modes: M,
    jump: JumpMatrix<f32, MODES>,
    initial: [f32; MODES],
    cues: Vec<Gaussian<f32, NX>>,
    at_ms: u64,
    scans: Vec<Vec<Dwell<S>>>,
    truth: Vec<Truth>,
) -> Result<Stage<M, S, NX, MODES>, ConfigError> {
    let steps = modes.steps(1.0);
    let straight = initial.iter().enumerate().max_by(|a, b| a.1.total_cmp(b.1)).map_or(0, |(mode, _)| mode);
    let mut regions = cues.clone();
    regions.iter_mut().for_each(|g| modes.advance(straight, g, &steps));
    let none = Gaussian::new(nalgebra::SVector::zeros(), Symmetric::from_diagonal([1.0; NX]));
    Ok(Stage {
        modes,
        jump,
        initial,
        cues,
        cued_at: Instant::from_millis(at_ms),
        initiation: Initiation::new(Rule::Off, none)?,
        logic: Logic::unmanaged(),
        regions,
        birth: CUED_BIRTH,
        survival: STAYS,
        scans,
        truth,
    })
}

fn dwell<S>(millis: u64, sensor: S, plots: &[[f64; 2]]) -> Dwell<S> {
    let plots = plots.iter().map(|plot| Detection::new(plot.map(|v| v as f32))).collect();
    Dwell { time: Instant::from_millis(millis), sensor, plots }
}

fn numbered(positions: impl Iterator<Item = [f64; 3]>) -> Truth {
    positions.enumerate().map(|(number, position)| Labelled { label: number as u64, position }).collect()
}
