//! Scans that load a tracker: a recorded scenario, and an adversarial one.
//!
//! ```text
//! recorded      SCANS scans a second apart, as many targets as the tracker has room for, in pairs that cross within 60 m
//!               at scan 20; they appear one after another during scans 0 to 9, every fourth is gone from scan 30 on, and one
//!               of each pair accelerates across its path from scan 25 on
//! detections    P_D = 0.9, and clutter uniform in range 6..26 km, azimuth 0.5..2.6 rad: together half of the detections that
//!               the tracker has room for, on average
//! unresolved    the same, by a sensor with cells of CELLS: where both of a pair are detected, at the distance d, they are one
//!               detection between them with probability exp(−½ d' R_d⁻¹ d)
//! adversarial   ROUNDS times three scans
//!               crowd     all tracks cued around one point, as many detections as there is room for, in the gates of all; every
//!                         other time at their edge, where no mode expects them
//!               swarm     as many far from all tracks, close enough to each other that every one of them
//!               swarm     pairs with every one of the next scan
//! ```
//!
//! The generator's seed is fixed and its arithmetic is the library's and `core`'s: the same scans everywhere.

use boresight::association::Gate;
use boresight::error::ConfigError;
use boresight::gaussian::Gaussian;
use boresight::model::radar::{Component, Radar};
use boresight::model::resolution::Resolution;
use boresight::scalar::{atan2, exp, sqrt};
use boresight::scan::{Detection, Scan};
use boresight::sensor::{Clutter, UniformSensor, Unresolving};
use boresight::symmetric::Symmetric;
use boresight::time::Instant;
use nalgebra::SVector;
use oorandom::Rand32;

/// Recorded scans.
pub const SCANS: usize = 40;
/// Repetitions of the adversarial scans.
pub const ROUNDS: usize = 4;
/// The most detections in a scan.
pub const MOST: usize = 64;

const SEED: u64 = 4;
const P_DETECT: f32 = 0.9;
const SIGMA_RANGE: f32 = 15.0;
const SIGMA_AZIMUTH: f32 = 0.002;
/// Of three deviations, in range and azimuth
const CELLS: [f32; 2] = [3.0 * SIGMA_RANGE, 3.0 * SIGMA_AZIMUTH];
const RANGES: [f32; 2] = [6_000.0, 26_000.0];
const AZIMUTHS: [f32; 2] = [0.5, 2.6];
/// Where the crowd is, x and y \[m\].
const CROWD: [f32; 2] = [0.0, 12_000.0];
/// Beyond 2.8 deviations of every cue there and within 4.
const EDGE: [f32; 2] = [0.0, 12_905.0];

/// The radar at the origin: range and azimuth, `STRIDE` states an axis.
pub type Sensor<const STRIDE: usize> = UniformSensor<Radar<f32, 2, 2, STRIDE>, f32>;
/// The same radar, saying what it cannot tell apart.
pub type Coarse<const STRIDE: usize> = Unresolving<Sensor<STRIDE>, f32, 2>;

/// How many tracks and detections the tracker under load has room for.
#[derive(Clone, Copy, Debug)]
pub struct Room {
    /// TRACKS
    pub tracks: usize,
    /// DETS, at most [`MOST`]
    pub detections: usize,
}

impl Room {
    /// Expected false detections a scan.
    fn clutter(self) -> f32 {
        (self.detections as f32 / 2.0 - P_DETECT * self.tracks as f32).max(0.1)
    }

    /// The radar, with P_D and the density of clutter of the recorded scenario.
    ///
    /// # Errors
    /// None: the constants here are valid.
    pub fn sensor<const STRIDE: usize>(self) -> Result<Sensor<STRIDE>, ConfigError> {
        let noise = Symmetric::from_diagonal([SIGMA_RANGE * SIGMA_RANGE, SIGMA_AZIMUTH * SIGMA_AZIMUTH]);
        let radar = Radar::new([Component::Range, Component::Azimuth], noise)?;
        let area = (RANGES[1] - RANGES[0]) * (AZIMUTHS[1] - AZIMUTHS[0]);
        UniformSensor::new(radar, P_DETECT, Clutter::Poisson(self.clutter() / area), Gate::new::<2>(16.0)?)
    }

    /// The radar of the unresolved scenario.
    ///
    /// # Errors
    /// None: the constants here are valid.
    pub fn coarse<const STRIDE: usize>(self) -> Result<Coarse<STRIDE>, ConfigError> {
        Ok(Unresolving { sensor: self.sensor()?, resolution: Resolution::new(CELLS)? })
    }
}

/// What is under load: a tracker, or nothing, to see what the load itself costs.
pub trait Subject {
    /// Replaces all tracks by as many as there is room for, each at a [`cue`], at the time of the last scan.
    fn crowd(&mut self, at: Instant);
    /// Takes in a scan; whether it was taken.
    fn step(&mut self, scan: &Scan<'_, f32, 2>) -> bool;
    /// Confirmed tracks.
    fn confirmed(&self) -> usize;
    /// Whether the recorded scenario is the unresolved one.
    fn unresolving(&self) -> bool {
        false
    }
}

/// Both scenarios, one after the other. Whether no scan was refused, and at scan 24 at least half of the targets had a
/// confirmed track.
pub fn run(subject: &mut impl Subject, room: Room) -> bool {
    let mut load = Generator { random: Rand32::new(SEED), plots: [Detection::new([0.0; 2]); MOST], count: 0 };
    let mut passed = true;
    for k in 0..SCANS {
        load.recorded(k, room, subject.unresolving());
        passed &= subject.step(&load.scan(k)) && (k != 24 || subject.confirmed() >= room.tracks.div_ceil(2));
    }
    for (round, k) in (SCANS..).step_by(3).take(ROUNDS).enumerate() {
        subject.crowd(time(k - 1));
        let (crowd, width) = [(CROWD, 400.0), (EDGE, 50.0)][round % 2];
        for (k, around, spread) in [(k, crowd, width), (k + 1, [14_000.0; 2], 30.0), (k + 2, [14_000.0; 2], 30.0)] {
            load.around(around, spread, room);
            passed &= subject.step(&load.scan(k));
        }
    }
    passed
}

/// The density at which the adversarial scenario cues track number `number`, `STRIDE` states an axis: all gates hold the crowd.
#[must_use]
pub fn cue<const NX: usize>(number: usize) -> Gaussian<f32, NX> {
    let stride = NX / 2;
    let offset = [(number % 8) as f32 * 60.0 - 210.0, (number / 8) as f32 * 60.0 - 210.0];
    let mean = SVector::from_fn(|i, _| if i % stride == 0 { CROWD[i / stride % 2] + offset[i / stride % 2] } else { 0.0 });
    Gaussian::new(mean, Symmetric::from_diagonal(core::array::from_fn(|i| [300.0f32 * 300.0, 50.0 * 50.0, 5.0 * 5.0][i % stride % 3])))
}

fn time(k: usize) -> Instant {
    Instant::from_millis(1000 * k as u64)
}

/// Makes scans.
struct Generator {
    random: Rand32,
    plots: [Detection<f32, 2>; MOST],
    count: usize,
}

impl Generator {
    /// The scan made last, as number `k`.
    fn scan(&self, k: usize) -> Scan<'_, f32, 2> {
        Scan::new(time(k), self.plots.get(..self.count).unwrap_or_default())
    }

    fn add(&mut self, range: f32, azimuth: f32, room: Room) {
        if self.count < room.detections
            && let Some(slot) = self.plots.get_mut(self.count)
        {
            *slot = Detection::new([range, azimuth]);
            self.count += 1;
        }
    }

    fn within(&mut self, [low, high]: [f32; 2]) -> f32 {
        low + (high - low) * self.random.rand_float()
    }

    /// A sum of twelve uniform numbers: close to a standard normal one.
    fn normal(&mut self) -> f32 {
        (0..12).fold(-6.0, |sum, _| sum + self.random.rand_float())
    }

    fn recorded(&mut self, k: usize, room: Room, unresolving: bool) {
        self.count = 0;
        // Where the other of the pair was added, if it was.
        let mut other = None;
        for (number, [x, y]) in (0..room.tracks).filter_map(|number| Some((number, target(number, k)?))) {
            let noise = [SIGMA_RANGE * self.normal(), SIGMA_AZIMUTH * self.normal()];
            if number.is_multiple_of(2) {
                other = None;
            }
            if self.random.rand_float() < P_DETECT {
                let plot = [sqrt(x * x + y * y) + noise[0], atan2(y, x) + noise[1]];
                if !(unresolving && other.is_some_and(|other| self.merge(other, plot))) {
                    other = Some(self.count);
                    self.add(plot[0], plot[1], room);
                }
            }
        }
        // Binomial, with the mean of the clutter.
        let trials = room.detections / 2;
        for _ in 0..trials {
            let (range, azimuth) = (self.within(RANGES), self.within(AZIMUTHS));
            if self.random.rand_float() * (trials as f32) < room.clutter() {
                self.add(range, azimuth, room);
            }
        }
    }

    /// Makes detection number `other` one of both, if chance has it; whether it has.
    fn merge(&mut self, other: usize, plot: [f32; 2]) -> bool {
        let chance = self.random.rand_float();
        let Some(other) = self.plots.get_mut(other) else { return false };
        let z = other.z.data.0[0];
        let distance = (0..2).map(|k| (z[k] - plot[k]) / CELLS[k]).fold(0.0, |sum, d| sum + d * d);
        let as_one = chance < exp(-0.5 * distance);
        if as_one {
            *other = Detection::new(core::array::from_fn(|k| 0.5 * (z[k] + plot[k])));
        }
        as_one
    }

    /// As many detections as there is room for, within `spread` metres of a point along range and across.
    fn around(&mut self, [x, y]: [f32; 2], spread: f32, room: Room) {
        self.count = 0;
        let (range, azimuth) = (sqrt(x * x + y * y), atan2(y, x));
        for _ in 0..room.detections {
            let (along, across) = (self.within([-spread, spread]), self.within([-spread, spread]));
            self.add(range + along, azimuth + across / range, room);
        }
    }
}

/// Where a target is at scan `k`, x and y \[m\], while it is there.
fn target(number: usize, k: usize) -> Option<[f32; 2]> {
    let there = k >= number % 10 && (k < 30 || number % 4 != 3);
    let pair = number / 2;
    let meeting = [(pair % 4) as f32 * 4000.0 - 6000.0, 9000.0 + (pair / 4) as f32 * 4000.0];
    let since = k as f32 - 20.0;
    let turning = (k as f32 - 25.0).max(0.0);
    there.then_some(if number.is_multiple_of(2) {
        [meeting[0] + 150.0 * since, meeting[1] + 20.0 * since + 4.0 * turning * turning]
    } else {
        [meeting[0] + 120.0 * since, meeting[1] - 90.0 * since + 60.0]
    })
}
