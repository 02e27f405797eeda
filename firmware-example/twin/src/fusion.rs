//! Two sensors with sixteen tracks each, the same sixteen targets: associated and fused to the same bits on desk and target.
//!
//! The second sensor stands elsewhere, looks back, and numbers its tracks the other way round. Its tracks differ from the first one's
//! by a few tenths of a deviation, and know more of the other axis: every weight has to be searched for.

use boresight::error::ConfigError;
use boresight::fusion::{Combiner, Frame, FusedPicture, FusionReport, FusionWork, Limits, ListError, Rule, Weight};
use boresight::gaussian::Gaussian;
use boresight::model::motion::{ConstantAcceleration, ConstantVelocity, ProcessNoise};
use boresight::symmetric::Symmetric;
use boresight::time::{Duration, Instant};
use boresight::track::Logic;
use boresight::tracker::{ImmPdaf, State};
use nalgebra::SVector;

/// Tracks of each sensor, and fused ones
pub const TRACKS: usize = 16;

/// How far the targets are from each other, and what is to be made of them.
#[derive(Clone, Copy, Debug)]
pub struct Case {
    /// Metres
    spacing: f32,
    /// What [`checksum`] is after both updates: found on the desk
    checksum: u32,
}
/// Only tracks of one target may join
pub const APART: Case = Case { spacing: 150.0, checksum: 0x19b2_b5eb };
/// Every track may join every other
pub const CROWD: Case = Case { spacing: 5.0, checksum: 0x1ebf_bc14 };

type Modes = (ConstantVelocity<f32, 2, 3>, ConstantAcceleration<f32, 2>);
/// The tracks of one sensor
pub type Memory = State<f32, 6, 2, TRACKS, 1>;
/// The fused tracks
pub type Picture = FusedPicture<f32, 6, 2, 2, TRACKS>;
type Fuser = Combiner<f32, Modes, 6, 2>;

/// The trackers of both sensors, and what makes one picture of their tracks.
#[derive(Clone, Copy, Debug)]
pub struct Fusion {
    tracker: ImmPdaf<f32, Modes, 6, 2, TRACKS, 1>,
    combiner: Fuser,
    frames: [Frame<f32>; 2],
}

impl Fusion {
    /// The most work of an [`update`](Self::update).
    pub const MOST: FusionWork = Fuser::worst_case::<2, TRACKS>();

    /// Two modes, covariance intersection by the least determinant.
    ///
    /// # Errors
    /// None, unless the constants here are wrong.
    pub fn new() -> Result<Self, ConfigError> {
        let modes = (ConstantVelocity::new(ProcessNoise::Discrete(0.1))?, ConstantAcceleration::new(ProcessNoise::Discrete(30.0))?);
        let jump = [[0.88, 0.12], [0.07, 0.93]];
        let limits = Limits { join: 25.0, part: 36.0, max_age: Duration::from_millis(5000) };
        Ok(Self {
            tracker: ImmPdaf::new(modes, jump, [0.9, 0.1], Logic::unmanaged())?,
            combiner: Combiner::new(modes, jump, Rule::Intersection(Weight::Determinant), limits)?,
            frames: [Frame::COMMON, Frame::new([1000.0, 1000.0, 0.0], core::f32::consts::PI)?],
        })
    }

    /// Starts the tracks of both sensors, `send`s both lists and `update`s the picture, all of which are new; then both once more.
    /// Whether first all tracks have joined and then all have stayed, and every bit is that of the desk.
    pub fn pass(
        &self,
        sensors: &mut [Memory; 2],
        picture: &mut Picture,
        case: Case,
        send: impl Fn(&Self, &mut Picture, usize, &Memory, u64) -> Result<(), ListError>,
        update: impl Fn(&Self, &mut Picture) -> FusionReport,
    ) -> bool {
        self.start(sensors, case);
        let mut passed = true;
        for (seconds, joined) in [(1, TRACKS), (2, 0)] {
            for (number, sensor) in sensors.iter().enumerate() {
                passed &= send(self, picture, number, sensor, seconds).is_ok();
            }
            let report = update(self, picture);
            passed &= usize::from(report.tracks) == TRACKS && usize::from(report.joined) == joined && report.is_complete();
        }
        passed && checksum(picture) == case.checksum
    }

    /// Starts the tracks of both sensors.
    pub fn start(&self, sensors: &mut [Memory; 2], Case { spacing, .. }: Case) {
        let [first, second] = sensors;
        for target in 0..TRACKS {
            self.tracker.start(first, track(target, spacing, 0.0), Instant::ZERO);
            let mut other = track(TRACKS - 1 - target, spacing, 1.0);
            // The frame of the second sensor is turned by half a circle, which no covariance notices.
            other.mean = SVector::from([1000.0, 0.0, 0.0, 1000.0, 0.0, 0.0]) - other.mean;
            self.tracker.start(second, other, Instant::ZERO);
        }
    }

    /// Sends the list of a sensor: the second one's a tenth of a second later.
    ///
    /// # Errors
    /// None, unless lists go back in time.
    pub fn send(&self, picture: &mut Picture, number: usize, sensor: &Memory, seconds: u64) -> Result<(), ListError> {
        let frame = self.frames.get(number).ok_or(ListError::UnknownSensor)?;
        let time = Instant::from_millis(1000 * seconds + 100 * number as u64);
        let tracks = sensor.tracks().filter_map(|track| Some((track.id()?, track.bank())));
        self.combiner.receive(picture, number, frame, time, tracks)
    }

    /// Associates and fuses.
    pub fn update(&self, picture: &mut Picture) -> FusionReport {
        self.combiner.update(picture)
    }
}

/// Target number `target`, on a grid, in its own direction; `apart` moves the estimate a little.
fn track(target: usize, spacing: f32, apart: f32) -> Gaussian<f32, 6> {
    let n = target as f32;
    let (column, row) = ((target % 4) as f32, (target / 4) as f32);
    let speeds = spacing / APART.spacing;
    let mean = [spacing * column + 2.0 * apart, 3.0 * speeds * row, 0.1, spacing * row - apart, speeds * (10.0 - n), -0.2 * apart];
    let variances = [9.0 + n + 60.0 * apart, 4.0 + 8.0 * apart, 1.0, 36.0 + n - 25.0 * apart, 5.0 - 3.0 * apart, 1.0];
    let within_axis = |i: usize, j: usize| if i / 3 == j / 3 { 0.5 } else { 0.1 };
    Gaussian::new(SVector::from(mean), Symmetric::from_fn(|i, j| if i == j { variances[i] } else { within_axis(i, j) }))
}

/// The bits of all fused states and probabilities, folded.
#[must_use]
pub fn checksum(picture: &Picture) -> u32 {
    let fold = |sum: u32, x: &f32| sum.rotate_left(5).wrapping_mul(0x9e37_79b1) ^ x.to_bits();
    picture.tracks().fold(0, |sum, fused| {
        let sum = fused.state.mean.iter().chain(&fused.prob).fold(sum, fold);
        fused.state.cov.upper().iter().enumerate().fold(sum, |sum, (i, row)| row.iter().skip(i).fold(sum, fold))
    })
}
