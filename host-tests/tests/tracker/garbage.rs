//! Absurd input, tens of thousands of scans of it in single precision: coordinates of 10³⁰, noise from 10⁻¹² to 10¹²,
//! detections by the dozen on top of a track, gaps from microseconds to centuries, sensors that take turns.
//!
//! A scan is refused or taken in. If it is taken in, the report balances and everything that can be read from the state is
//! finite: densities with non-negative variances, probabilities that sum to one, identities that are given once.

use crate::balance;
use boresight::association::{Gate, Jpda};
use boresight::error::{ConfigError, ScanError};
use boresight::gaussian::Gaussian;
use boresight::initiation::{Initiation, Rule};
use boresight::model::MeasurementModel;
use boresight::model::motion::{ConstantAcceleration, ConstantVelocity, ProcessNoise, Singer};
use boresight::model::position::Position;
use boresight::model::radar::Component::{Azimuth, Elevation, Range, RangeRate};
use boresight::model::radar::{Component, Mount, Radar};
use boresight::model::turn::{KnownTurn, UnknownTurn};
use boresight::scan::{Detection, Scan};
use boresight::sensor::{Clutter, UniformSensor};
use boresight::symmetric::Symmetric;
use boresight::time::{Duration, Instant};
use boresight::track::{Existence, Logic};
use boresight::tracker::{ImmJpda, ImmPdaf, Tracker};
use nalgebra::SVector;
use proptest::prelude::*;
use proptest::test_runner::{TestCaseError, TestCaseResult};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

const TRACKS: usize = 5;
const DETS: usize = 6;
/// Of each tracker, so many states are thrown so many scans: 25,000 in all.
const LIVES: u64 = 250;
const SCANS: usize = 100;

/// A number of any size and sign.
fn number(rng: &mut ChaCha8Rng) -> f32 {
    let size: f32 = match rng.random_range(0..12) {
        0 => 0.0,
        1 => 1e30,
        2 => 10f32.powf(rng.random_range(-30.0..30.0)),
        3 => 3.0,
        _ => 10f32.powf(rng.random_range(0.0..5.0)),
    };
    size * rng.random_range(-1.0..1.0)
}

/// Mostly seconds, sometimes nothing, a microsecond, a day, decades \[μs\].
fn gap(rng: &mut ChaCha8Rng) -> u64 {
    const SECOND: u64 = 1_000_000;
    match rng.random_range(0..40) {
        0..4 => 0,
        4 => 1,
        5 => 86_400 * SECOND,
        6 => rng.random_range(1..100) * 365 * 86_400 * SECOND,
        _ => rng.random_range(1..10 * SECOND),
    }
}

/// Correlated variances from tiny to huge; in single precision some are not definite, and a detection with such is refused.
fn noise<const NZ: usize>(rng: &mut ChaCha8Rng) -> Symmetric<f32, NZ> {
    let deviation = [0; NZ].map(|_| 10f32.powf(rng.random_range(-6.0..6.0)));
    let correlation = rng.random_range(-0.9..0.9f32);
    Symmetric::from_fn(|i, j| deviation[i] * deviation[j] * if i == j { 1.0 } else { correlation })
}

/// The noise of a sensor, which is definite or there is none.
fn definite<const NZ: usize>(rng: &mut ChaCha8Rng) -> Symmetric<f32, NZ> {
    loop {
        let noise = noise(rng);
        if noise.is_definite() {
            return noise;
        }
    }
}

fn sensor<S, const NZ: usize>(rng: &mut ChaCha8Rng, model: S) -> Result<UniformSensor<S, f32>, TestCaseError> {
    let clutter = match rng.random_range(0..3) {
        0 => Clutter::Diffuse,
        1 => Clutter::Poisson(10f32.powf(rng.random_range(-30.0..10.0))),
        _ => Clutter::Poisson(0.0),
    };
    let p_detect = if rng.random_bool(0.2) { 1.0 } else { rng.random_range(0.0..1.0) };
    let gate = Gate::new::<NZ>(10f32.powf(rng.random_range(0.0..6.0)))?;
    let gate = if rng.random_bool(0.3) { gate.with_probability(1.0)? } else { gate };
    Ok(UniformSensor::new(model, p_detect, clutter, gate)?)
}

/// What happened, so that a test which tests nothing is found out.
#[derive(Debug, Default)]
struct Tally {
    taken_in: u32,
    births: u32,
    confirmed: u32,
    resets: u32,
}

/// A tracker, its state, and the world it lives in.
struct Life<K: Tracker<f32, NX, MODES>, const NX: usize, const MODES: usize> {
    tracker: K,
    state: K::State,
    rng: ChaCha8Rng,
    time: u64,
    last_id: u32,
    tally: Tally,
}

impl<K: Tracker<f32, NX, MODES>, const NX: usize, const MODES: usize> Life<K, NX, MODES> {
    /// Detections of nothing, of anything, and on top of the first track.
    fn plots<S: MeasurementModel<f32, NX, NZ>, const NZ: usize>(&mut self, model: &S) -> Vec<Detection<f32, NZ>> {
        let target = self.tracker.tracks(&self.state).next().map(|t| model.observe(&t.bank().modes[0].mean));
        let rng = &mut self.rng;
        let mut plot = || {
            let z = match target {
                Some(z) if rng.random_bool(0.6) => {
                    let size = 10f32.powf(rng.random_range(-5.0..3.0));
                    std::array::from_fn(|k| z[k] + rng.random_range(-size..size))
                }
                _ => [0; NZ].map(|_| number(rng)),
            };
            let noise = rng.random_bool(0.3).then(|| noise(rng));
            let amplitude = rng.random_bool(0.5).then(|| number(rng));
            Detection { noise, amplitude, ..Detection::new(z) }
        };
        let plots: Vec<_> = (0..2 * DETS).map(|_| plot()).collect();
        let count = rng.random_range(0..2 * DETS);
        plots.into_iter().take(count).collect()
    }

    /// A look at positions.
    fn positions<const NZ: usize, const STRIDE: usize>(&mut self) -> TestCaseResult {
        let model = Position::<f32, NZ, STRIDE>::new(definite(&mut self.rng))?;
        self.scan(model)
    }

    /// A look by a radar anywhere, moving and turned anyhow.
    fn radar<const NZ: usize, const AXES: usize, const STRIDE: usize>(&mut self, components: [Component; NZ]) -> TestCaseResult {
        let rng = &mut self.rng;
        let [place, velocity] = [1e4, 1e3].map(|size| [0; 3].map(|_| rng.random_range(-size..size)));
        let [yaw, pitch, roll] = [0; 3].map(|_| rng.random_range(-3.0..3.0));
        let mount = Mount::at(place).moving(velocity).turned(yaw, pitch, roll);
        let model = Radar::<f32, NZ, AXES, STRIDE>::new(components, definite(rng))?.on(mount);
        self.scan(model)
    }

    /// One scan by a sensor of this model, and everything that must hold after it.
    fn scan<S: MeasurementModel<f32, NX, NZ>, const NZ: usize>(&mut self, model: S) -> TestCaseResult {
        let plots = self.plots(&model);
        let sensor = sensor::<S, NZ>(&mut self.rng, model)?;
        let before = self.tracker.tracks(&self.state).count();
        let scan = Scan::new(Instant::from_micros(self.time), &plots);
        let report = match self.tracker.step(&mut self.state, &sensor, &scan) {
            Ok(report) => report,
            Err(error) => {
                let broken = plots.iter().any(|d| !d.z.iter().all(|v| v.is_finite()));
                let flat = plots.iter().any(|d| d.noise.is_some_and(|r| !r.is_definite()));
                prop_assert!(matches!(
                    (error, broken, flat),
                    (ScanError::DetectionNotFinite, true, _) | (ScanError::NoiseNotDefinite, _, true)
                ));
                return Ok(());
            }
        };
        prop_assert_eq!(usize::from(report.detections) + usize::from(report.detections_dropped), plots.len());
        prop_assert_eq!(self.tracker.tracks(&self.state).count() as i64, balance(before, &report), "{:?}", report);
        self.last_id += u32::from(report.births);
        let mut ids: Vec<_> = self.tracker.tracks(&self.state).filter_map(|t| t.id()).map(|id| id.number()).collect();
        ids.sort_unstable();
        prop_assert!(ids.windows(2).all(|pair| pair[0] < pair[1]) && ids.last().is_none_or(|id| *id <= self.last_id), "{ids:?}");
        for track in self.tracker.tracks(&self.state) {
            let bank = track.bank();
            prop_assert!(bank.is_valid(), "{bank:?}\nafter {report:?}");
            let sum: f32 = bank.prob.iter().sum();
            // Normalised in every update: MODES products and their sum.
            prop_assert!((sum - 1.0).abs() <= 2.0 * MODES as f32 * f32::EPSILON, "{:?}", bank.prob);
            prop_assert!((0.0..=1.0).contains(&track.existence()), "existence {}", track.existence());
        }
        for estimate in self.tracker.estimates(&self.state) {
            let finite = estimate.state.mean.iter().all(|v| v.is_finite()) && estimate.state.cov.is_finite();
            prop_assert!(finite, "{estimate:?}\nafter {report:?}");
        }
        self.tally.taken_in += 1;
        self.tally.births += u32::from(report.births);
        self.tally.confirmed += u32::from(report.tracks_confirmed);
        self.tally.resets += u32::from(report.numeric_resets);
        Ok(())
    }
}

/// Many lives of a tracker made by `make`, under all kinds of rules; `look` makes one scan by a sensor of its choice.
fn survives<K: Tracker<f32, NX, MODES>, const NX: usize, const MODES: usize>(
    make: impl Fn(Logic<f32>, Initiation<f32, NX>) -> Result<K, ConfigError>,
    look: impl Fn(&mut Life<K, NX, MODES>) -> TestCaseResult,
) -> TestCaseResult {
    let mut tally = Tally::default();
    for seed in 0..LIVES {
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        let logic = match seed % 5 {
            0 => Logic::unmanaged(),
            1 => Logic::new(2, 3, 3)?,
            2 => Logic::new(1, 1, 32)?.with_position_limit(1e4)?.with_duplicate_distance(0.0)?,
            3 => Logic::new(20, 32, 10)?,
            _ => Logic::existence(Existence { birth: 0.1, lifetime: 10f32.powf(rng.random_range(-3.0..9.0)), confirm: 0.9, delete: 1e-6 })?,
        };
        let pairs = Rule::TwoPoint { max_speed: 1e4, max_gap: Duration::from_millis(20_000) };
        let rule = if seed % 3 == 0 { Rule::OnePoint } else { pairs };
        let variance = [0; NX].map(|_| 10f32.powf(rng.random_range(-6.0..6.0)));
        let prior = Gaussian::new(SVector::zeros(), Symmetric::from_diagonal(variance));
        let tracker = make(logic, Initiation::new(rule, prior)?)?;
        let mut life = Life { tracker, state: K::State::default(), rng, time: 0, last_id: 0, tally };
        for k in 0..SCANS {
            life.time = life.time.saturating_add(gap(&mut life.rng));
            look(&mut life).map_err(|e| TestCaseError::fail(format!("life {seed}, scan {k}: {e}")))?;
        }
        tally = life.tally;
    }
    // Most scans are taken in, tracks live and die, and some of what they are told is more than single precision bears.
    let Tally { taken_in, births, confirmed, resets } = tally;
    prop_assert!(taken_in > 15_000 && births > 2000 && confirmed > 200 && resets > 100, "{tally:?}");
    Ok(())
}

/// In the plane: what both trackers are thrown.
fn any_sensor<K: Tracker<f32, 6, 2>>(life: &mut Life<K, 6, 2>) -> TestCaseResult {
    match life.rng.random_range(0..4) {
        0 => life.positions::<2, 3>(),
        1 => life.radar::<1, 2, 3>([Azimuth]),
        2 => life.radar::<2, 2, 3>([Range, Azimuth]),
        _ => life.radar::<3, 2, 3>([RangeRate, Range, Azimuth]),
    }
}

#[test]
fn straight_motion_in_the_plane() -> Result<(), TestCaseError> {
    let quiet = ConstantVelocity::<f32, 2, 3>::new(ProcessNoise::Continuous(1.0))?;
    let manoeuvre = ConstantAcceleration::<f32, 2>::new(ProcessNoise::Discrete(30.0))?;
    let (modes, jump, initial) = ((quiet, manoeuvre), [[0.9, 0.1], [0.1, 0.9]], [0.5; 2]);
    let alone = |logic, initiation| Ok(ImmPdaf::<_, _, 6, 2, TRACKS, DETS>::new(modes, jump, initial, logic)?.with_initiation(initiation));
    survives(alone, any_sensor)?;
    let jpda = Jpda::<64>::new();
    let joint =
        |logic, initiation| Ok(ImmJpda::<_, _, 6, 2, TRACKS, DETS, _>::new(modes, jump, initial, logic, jpda)?.with_initiation(initiation));
    survives(joint, any_sensor)
}

#[test]
fn turns_that_never_jump() -> Result<(), TestCaseError> {
    let turn = |rate: f32| KnownTurn::<f32, 2>::new(rate, ProcessNoise::Continuous(0.5));
    let turns = [turn(-0.1)?, turn(0.0)?, turn(0.3)?];
    let stay = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
    let make =
        |logic, initiation| Ok(ImmPdaf::<_, _, 4, 3, TRACKS, DETS>::new(turns, stay, [1.0 / 3.0; 3], logic)?.with_initiation(initiation));
    survives(make, |life| match life.rng.random_range(0..2) {
        0 => life.positions::<2, 2>(),
        _ => life.radar::<4, 2, 2>([Range, Azimuth, RangeRate, Elevation]),
    })
}

#[test]
fn turns_of_unknown_rate() -> Result<(), TestCaseError> {
    let quiet = ConstantVelocity::<f32, 2>::new(ProcessNoise::Continuous(0.0))?;
    let turn = UnknownTurn::<f32, 2>::new(ProcessNoise::Continuous(1.0), ProcessNoise::Continuous(1e-2))?;
    let jump = [[0.95, 0.05], [0.05, 0.95]];
    let make =
        |logic, initiation| Ok(ImmPdaf::<_, _, 5, 2, TRACKS, DETS>::new((quiet, turn), jump, [0.5; 2], logic)?.with_initiation(initiation));
    survives(make, |life| match life.rng.random_range(0..3) {
        0 => life.positions::<2, 2>(),
        1 => life.radar::<2, 2, 2>([Azimuth, Range]),
        _ => life.radar::<1, 2, 2>([RangeRate]),
    })
}

#[test]
fn manoeuvres_in_space() -> Result<(), TestCaseError> {
    let singer = Singer::<f32, 3>::new(20.0, 10.0)?;
    let jerk = ConstantAcceleration::<f32, 3>::new(ProcessNoise::Continuous(100.0))?;
    let jump = [[1.0, 0.0], [0.2, 0.8]];
    let make = |logic, initiation| {
        Ok(ImmPdaf::<_, _, 9, 2, TRACKS, DETS>::new((singer, jerk), jump, [0.5; 2], logic)?.with_initiation(initiation))
    };
    survives(make, |life| match life.rng.random_range(0..4) {
        0 => life.positions::<3, 3>(),
        1 => life.radar::<2, 3, 3>([Azimuth, Elevation]),
        2 => life.radar::<3, 3, 3>([Range, Azimuth, Elevation]),
        _ => life.radar::<4, 3, 3>([Range, Azimuth, Elevation, RangeRate]),
    })
}
