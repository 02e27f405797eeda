//! Labelled random finite sets on the target: three forms of the jump-Markov GLMB, to the same bits on desk and target.
//!
//! ```text
//! linear      positions with 40 m, three modes: the published scenario of three targets that come, turn and go in 60 clutter points;
//!             at most 20 hypotheses
//! unscented   azimuth and range, constant velocity and unknown turns, by sigma points
//! particles   the same by points with random numbers
//! ```
//!
//! The generator's seed is fixed and its arithmetic is the library's and `core`'s: the same scans everywhere, 100 of them, 5 s
//! apart. Each form keeps its estimates in a checksum; the first scans are told value by value.

use crate::{Fault, Label, Sink, tell};
use boresight::association::Gate;
use boresight::error::ConfigError;
use boresight::gaussian::Gaussian;
use boresight::glmb::{Density, Mixture, Particles, Ranked, Region, Truncation};
use boresight::mode::{JumpMatrix, ModeSet};
use boresight::model::MotionModel;
use boresight::model::motion::{ConstantVelocity, ProcessNoise};
use boresight::model::position::Position;
use boresight::model::radar::{Component, Radar};
use boresight::model::turn::{KnownTurn, UnknownTurn};
use boresight::model::unscented::{Scaling, Unscented};
use boresight::scalar::{atan2, exp, ln, sin_cos, sqrt};
use boresight::scan::{Detection, Report, Scan};
use boresight::sensor::{Clutter, UniformSensor};
use boresight::symmetric::Symmetric;
use boresight::time::Instant;
use boresight::tracker::{GlmbState, JmsGlmb};
use core::convert::Infallible;
use nalgebra::SVector;
use oorandom::Rand32;
use rand_core::TryRng;

/// Scans of the scenario
pub const SCANS: usize = 100;
/// Room for detections
pub const DETS: usize = 128;
/// Points of a track
pub const POINTS: usize = 64;

/// What each form's estimates come to: found on the desk
pub const CHECKSUMS: [Checksum; 3] = [
    Checksum { bits: 0xcd15_58e3, estimates: 260 },
    Checksum { bits: 0x3984_2b66, estimates: 265 },
    Checksum { bits: 0xe1c9_2253, estimates: 263 },
];

/// Room for targets of a hypothesis, and of births in a scan.
const LABELS: usize = 10;
const BIRTHS: usize = 3;
/// Detections of a track
const GATED: usize = 6;
/// Hypotheses in the making
const HYPS: usize = 64;
/// Hypotheses kept
pub const MOST: usize = 20;
const LEAST_SHARE: f32 = 1e-5;

type Events = Ranked<20, 24>;
/// State of a form with densities `D` and room for `SLOTS` of them
pub type Memory<D, const SLOTS: usize> = GlmbState<f32, D, Events, SLOTS, HYPS, LABELS, GATED, DETS>;
/// Of the linear form
pub type Linear = Memory<Mixture<f32, 4, 3, 1>, 48>;
/// Of the unscented form
pub type Sigma = Memory<Mixture<f32, 5, 2, 1>, 48>;
/// Of the form of particles
pub type Points = Memory<Particles<f32, 5, 2, POINTS>, 20>;

/// States, by scan and target: where targets are born, when, and how they move.
const REGIONS: [[f32; 2]; 3] = [[40e3, -50e3], [-50e3, 40e3], [-10e3, -40e3]];
const STARTS: [[f32; 4]; 3] =
    [[-50e3 + 200.0, 180.0, 40e3 - 150.0, -60.0], [40e3 - 300.0, -120.0, -50e3, 200.0], [-10e3, 150.0, -40e3 + 250.0, 150.0]];
const LIVES: [[usize; 2]; 3] = [[1, 100], [10, 90], [20, 100]];
/// From scan to scan, and to the left or not
const TURNS: [[(usize, usize, bool); 2]; 3] =
    [[(30, 38, false), (60, 70, true)], [(40, 46, true), (70, 80, false)], [(45, 57, true), (80, 86, false)]];
/// 3 degrees a second
const RATE: f32 = core::f32::consts::PI / 60.0;
const STEP: f32 = 5.0;
const HALF_SIDE: f32 = 60e3;
const MOST_RANGE: f32 = 85e3;
const CLUTTER: f32 = 60.0;
const P_DETECT: f32 = 0.97;
const SIGMA: f32 = 40.0;
/// Of azimuth and range
const POLAR: [f32; 2] = [0.2 * core::f32::consts::PI / 180.0, 50.0];

/// Random numbers for densities that draw.
#[derive(Debug)]
pub struct Generator(Rand32);

impl TryRng for Generator {
    type Error = Infallible;
    fn try_next_u32(&mut self) -> Result<u32, Infallible> {
        Ok(self.0.rand_u32())
    }
    fn try_next_u64(&mut self) -> Result<u64, Infallible> {
        Ok(u64::from(self.0.rand_u32()) << 32 | u64::from(self.0.rand_u32()))
    }
    fn try_fill_bytes(&mut self, dst: &mut [u8]) -> Result<(), Infallible> {
        dst.fill_with(|| self.0.rand_u32() as u8);
        Ok(())
    }
}

/// A tracker with its sensor, ready to take scans.
#[derive(Debug)]
pub struct Form<M, S, const NX: usize, const MODES: usize> {
    tracker: JmsGlmb<f32, M, Events, NX, MODES, BIRTHS>,
    sensor: S,
    random: Generator,
}

type Straight = ConstantVelocity<f32, 2>;
/// Positions, three modes
pub type LinearForm = Form<(Straight, KnownTurn<f32, 2>, KnownTurn<f32, 2>), UniformSensor<Position<f32, 2, 2>, f32>, 4, 3>;
/// Sigma points
pub type SigmaForm = Form<(Straight, Unscented<UnknownTurn<f32, 2>, f32>), UniformSensor<Unscented<Radar<f32, 2, 2, 2>, f32>, f32>, 5, 2>;
/// Particles
pub type PointsForm = Form<(Straight, UnknownTurn<f32, 2>), UniformSensor<Radar<f32, 2, 2, 2>, f32>, 5, 2>;

/// The linear form.
///
/// # Errors
/// None, unless the constants here are wrong.
pub fn linear() -> Result<LinearForm, ConfigError> {
    let area = 4.0 * HALF_SIDE * HALF_SIDE;
    let sensor = UniformSensor::new(
        Position::new(Symmetric::from_diagonal([SIGMA * SIGMA; 2]))?,
        P_DETECT,
        Clutter::Poisson(CLUTTER / area),
        Gate::new::<2>(25.0)?,
    )?;
    let noise = noise();
    let modes = (Straight::new(noise)?, KnownTurn::new(-RATE, noise)?, KnownTurn::new(RATE, noise)?);
    form(modes, [[0.8, 0.1, 0.1], [0.1, 0.8, 0.1], [0.1, 0.1, 0.8]], sensor)
}

/// The form of sigma points.
///
/// # Errors
/// None, unless the constants here are wrong.
pub fn unscented() -> Result<SigmaForm, ConfigError> {
    let scaling = Scaling::new::<5>(1.0, 0.0, 2.0)?;
    let sensor = polar()?;
    let sensor = sensor.with_model(Unscented { model: sensor.model, scaling });
    form((Straight::new(noise())?, Unscented { model: turn()?, scaling }), [[0.9, 0.1], [0.1, 0.9]], sensor)
}

/// The form of particles.
///
/// # Errors
/// None, unless the constants here are wrong.
pub fn particles() -> Result<PointsForm, ConfigError> {
    form((Straight::new(noise())?, turn()?), [[0.9, 0.1], [0.1, 0.9]], polar()?)
}

fn noise() -> ProcessNoise<f32> {
    ProcessNoise::Discrete(25.0)
}

fn turn() -> Result<UnknownTurn<f32, 2>, ConfigError> {
    UnknownTurn::new(noise(), ProcessNoise::Discrete(0.03 * 0.03))
}

fn polar() -> Result<UniformSensor<Radar<f32, 2, 2, 2>, f32>, ConfigError> {
    let model = Radar::new([Component::Azimuth, Component::Range], Symmetric::from_diagonal(POLAR.map(|s| s * s)))?;
    let area = 2.0 * core::f32::consts::PI * MOST_RANGE;
    UniformSensor::new(model, P_DETECT, Clutter::Poisson(CLUTTER / area), Gate::new::<2>(25.0)?)
}

fn form<M: ModeSet<f32, NX, MODES>, S, const NX: usize, const MODES: usize>(
    modes: M,
    jump: JumpMatrix<f32, MODES>,
    sensor: S,
) -> Result<Form<M, S, NX, MODES>, ConfigError> {
    let mut tracker = JmsGlmb::new(modes, jump, 0.99, Ranked)?.with_limits(MOST, LEAST_SHARE)?;
    let initial = core::array::from_fn(|mode| if mode == 0 { 1.0 } else { 0.0 });
    let variance = |i: usize| if i == 4 { 1e-4 } else { [1e6, 9e4][i % 2] };
    for [x, y] in REGIONS {
        let mean = SVector::from_fn(|i, _| [x, 0.0, y, 0.0, 0.0][i % 5]);
        let density = Gaussian::new(mean, Symmetric::from_diagonal(core::array::from_fn(variance)));
        tracker = tracker.with_region(Region::new(0.02, density, initial)?)?;
    }
    Ok(Form { tracker, sensor, random: Generator(Rand32::new(7)) })
}

impl<M, S, const NX: usize, const MODES: usize> Form<M, S, NX, MODES>
where
    M: ModeSet<f32, NX, MODES>,
    S: boresight::sensor::Sensor<f32, NX, 2>,
    Events: Truncation<f32, LABELS>,
{
    /// Takes in one scan: what is counted. Whether it was taken, and nothing beyond truncation went wrong.
    pub fn step<D: Density<f32, NX, MODES>, const SLOTS: usize>(&mut self, state: &mut Memory<D, SLOTS>, scan: &Scan<'_, f32, 2>) -> bool {
        let report = self.tracker.step_with(state, &self.sensor, scan, &mut self.random);
        matches!(report, Ok(Report { detections_dropped: 0, numeric_resets: 0, .. }))
    }
}

/// What [`run`] works in.
#[derive(Clone, Debug)]
pub struct Forms {
    linear: Linear,
    sigma: Sigma,
    points: Points,
}

impl Forms {
    /// No targets.
    #[must_use]
    pub const fn new() -> Self {
        Self { linear: Linear::new(), sigma: Sigma::new(), points: Points::new() }
    }
}

impl Default for Forms {
    fn default() -> Self {
        Self::new()
    }
}

/// Scans that are told: two targets are born in them.
const TOLD: usize = 16;

/// The first scans through all forms; tells the estimates after each.
///
/// # Errors
/// Where a configuration here is wrong.
pub fn run<K: Sink>(sink: &mut K, Forms { linear: positions, sigma, points }: &mut Forms) -> Result<(), Fault> {
    follow(sink, "GLMB", linear()?, positions, false);
    follow(sink, "GLMB of sigma points", unscented()?, sigma, true);
    follow(sink, "GLMB of particles", particles()?, points, true);
    Ok(())
}

fn follow<K: Sink, M, S, D: Density<f32, NX, MODES>, const NX: usize, const MODES: usize, const SLOTS: usize>(
    sink: &mut K,
    part: &'static str,
    mut form: Form<M, S, NX, MODES>,
    state: &mut Memory<D, SLOTS>,
    polar: bool,
) where
    M: ModeSet<f32, NX, MODES>,
    S: boresight::sensor::Sensor<f32, NX, 2>,
{
    let mut scans = Scans::new();
    for scan in 0..TOLD {
        let taken = scans.next(polar).is_some_and(|plots| form.step(state, &plots));
        let label = Label { part, scan, track: 0, field: "taken" };
        sink.take(label, f32::from(u8::from(taken)));
        for target in state.estimates() {
            let label = Label { track: target.label.birth_scan, ..label };
            sink.take(Label { field: "region", ..label }, f32::from(target.label.index));
            sink.take(Label { field: "existence", ..label }, target.existence);
            for p in target.modes {
                sink.take(Label { field: "mode probability", ..label }, p);
            }
            tell(sink, label, &target.state);
        }
    }
}

/// The bits of all estimates, folded, and how many there were.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Checksum {
    /// The bits
    pub bits: u32,
    /// Estimates of all scans
    pub estimates: u32,
}

impl Checksum {
    /// Adds what a state holds after a scan.
    pub fn add<D: Density<f32, NX, MODES>, const NX: usize, const MODES: usize, const SLOTS: usize>(&mut self, state: &Memory<D, SLOTS>) {
        for estimate in state.estimates() {
            let numbers = estimate.state.mean.iter().chain(&estimate.modes).chain([&estimate.existence]);
            self.bits = numbers.fold(self.bits, |sum, x| sum.rotate_left(5).wrapping_mul(0x9e37_79b1) ^ x.to_bits());
            self.estimates += 1;
        }
    }
}

/// The scans of the scenario, one after the other.
#[derive(Debug)]
pub struct Scans {
    random: Rand32,
    targets: [SVector<f32, 4>; 3],
    plots: [Detection<f32, 2>; DETS],
    count: usize,
    k: usize,
}

impl Default for Scans {
    fn default() -> Self {
        Self::new()
    }
}

impl Scans {
    /// Before the first.
    #[must_use]
    pub fn new() -> Self {
        Self { random: Rand32::new(3), targets: STARTS.map(SVector::from), plots: [Detection::new([0.0; 2]); DETS], count: 0, k: 0 }
    }

    /// The next scan: positions, or azimuth and range. `None` after the last.
    pub fn next(&mut self, polar: bool) -> Option<Scan<'_, f32, 2>> {
        if self.k == SCANS {
            return None;
        }
        self.k += 1;
        self.count = 0;
        for (target, [first, last]) in LIVES.into_iter().enumerate() {
            if !(first..=last).contains(&self.k) {
                continue;
            }
            if self.k > first {
                self.targets[target] = moved(target, self.k - 1, &self.targets[target]);
            }
            let x = self.targets[target];
            let (e, f) = self.normal();
            if self.random.rand_float() < P_DETECT {
                self.add(if polar {
                    [atan2(x[2], x[0]) + POLAR[0] * e, sqrt(x[0] * x[0] + x[2] * x[2]) + POLAR[1] * f]
                } else {
                    [x[0] + SIGMA * e, x[2] + SIGMA * f]
                });
            }
        }
        // Poisson: uniform numbers are multiplied until the product is below e^{−mean}.
        let (mut product, least) = (self.random.rand_float(), exp(-CLUTTER));
        while product > least {
            let (u, v) = (self.random.rand_float(), self.random.rand_float());
            let angle = core::f32::consts::PI * (1.0 - 2.0 * u);
            self.add(if polar { [angle, MOST_RANGE * v] } else { [u, v].map(|u| HALF_SIDE * (2.0 * u - 1.0)) });
            product *= self.random.rand_float();
        }
        Some(Scan::new(Instant::from_millis(5000 * self.k as u64), self.plots.get(..self.count)?))
    }

    fn add(&mut self, z: [f32; 2]) {
        if let Some(slot) = self.plots.get_mut(self.count) {
            *slot = Detection::new(z);
            self.count += 1;
        }
    }

    fn normal(&mut self) -> (f32, f32) {
        let radius = sqrt(-2.0 * ln(1.0 - self.random.rand_float()));
        let (sin, cos) = sin_cos(2.0 * core::f32::consts::PI * self.random.rand_float());
        (radius * cos, radius * sin)
    }
}

/// A target one scan after scan `k`.
fn moved(target: usize, k: usize, x: &SVector<f32, 4>) -> SVector<f32, 4> {
    let turn = TURNS[target].iter().find(|(from, to, _)| (*from..*to).contains(&k));
    let rate = turn.map_or(0.0, |(_, _, left)| if *left { RATE } else { -RATE });
    KnownTurn::<f32, 2>::new(rate, noise()).map_or(*x, |motion| motion.transition(x, STEP))
}
