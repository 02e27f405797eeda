//! Two sensors with sixteen tracks each, the same sixteen targets: associated and fused to the same bits on desk and target.
//!
//! The second sensor stands elsewhere, is turned, and numbers its tracks the other way round. Its tracks differ from the first one's
//! by a few tenths of a deviation, and know more of the other axis: every weight has to be searched for.

use boresight::error::ConfigError;
use boresight::fusion::{Combiner, Frame, FusedPicture, FusionReport, Limits, ListError, Rule, Weight};
use boresight::gaussian::Gaussian;
use boresight::model::motion::{ConstantAcceleration, ConstantVelocity, ProcessNoise};
use boresight::symmetric::Symmetric;
use boresight::time::{Duration, Instant};
use boresight::track::Logic;
use boresight::tracker::{ImmPdaf, State};
use nalgebra::SVector;

/// Tracks of each sensor, and fused ones
pub const TRACKS: usize = 16;
/// What [`checksum`] is after two updates: found on the desk
pub const CHECKSUM: u32 = 0xdfc2_f3cd;

type Modes = (ConstantVelocity<f32, 2, 3>, ConstantAcceleration<f32, 2>);
/// The tracks of one sensor
pub type Memory = State<f32, 6, 2, TRACKS, 1>;
/// The fused tracks
pub type Picture = FusedPicture<f32, 6, 2, 2, TRACKS>;

/// The trackers of both sensors, and what makes one picture of their tracks.
#[derive(Clone, Copy, Debug)]
pub struct Fusion {
    tracker: ImmPdaf<f32, Modes, 6, 2, TRACKS, 1>,
    combiner: Combiner<f32, Modes, 6, 2>,
    frames: [Frame<f32>; 2],
}

impl Fusion {
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
            frames: [Frame::COMMON, Frame::new([1000.0, 1000.0, 0.0], 0.5)?],
        })
    }

    /// Starts the tracks of both sensors.
    pub fn start(&self, sensors: &mut [Memory; 2]) {
        let [first, second] = sensors;
        for target in 0..TRACKS {
            self.tracker.start(first, track(target, 0.0), Instant::ZERO);
            let mut other = track(TRACKS - 1 - target, 1.0);
            // From the common frame to the second one: half a radian back, for which a frame in its place is turned the other way.
            other.mean -= SVector::from([1000.0, 0.0, 0.0, 1000.0, 0.0, 0.0]);
            if let Ok(back) = Frame::new([0.0; 3], -0.5) {
                back.register(&mut other, self.tracker.layout());
            }
            self.tracker.start(second, other, Instant::ZERO);
        }
    }

    /// Sends the lists of both sensors: the second one's a tenth of a second later.
    ///
    /// # Errors
    /// None, unless lists go back in time.
    pub fn send(&self, picture: &mut Picture, sensors: &[Memory; 2], seconds: u64) -> Result<(), ListError> {
        for (number, (sensor, frame)) in sensors.iter().zip(&self.frames).enumerate() {
            let time = Instant::from_millis(1000 * seconds + 100 * number as u64);
            let tracks = sensor.tracks().filter_map(|track| Some((track.id()?, track.bank())));
            self.combiner.receive(picture, number, frame, time, tracks)?;
        }
        Ok(())
    }

    /// Associates and fuses: what is counted.
    pub fn update(&self, picture: &mut Picture) -> FusionReport {
        self.combiner.update(picture)
    }
}

/// Target number `target`, on a grid of 150 m, in its own direction; `apart` moves the estimate a little.
fn track(target: usize, apart: f32) -> Gaussian<f32, 6> {
    let n = target as f32;
    let (column, row) = ((target % 4) as f32, (target / 4) as f32);
    let mean = [150.0 * column + 2.0 * apart, 3.0 * row, 0.1, 150.0 * row - apart, 10.0 - n, -0.2 * apart];
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
