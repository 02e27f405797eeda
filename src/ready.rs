//! Ready configurations: trackers whose sizes are chosen and whose numbers are a flat structure, for code that cannot name
//! generic types: C, logs, settings in flash. All are IMM-JPDA with room for 16 tracks and 32 detections.
//!
//! ```text
//!             state                    modes                                          radar
//! Turning     x, vx, y, vy             constant velocity; turns to either side        NZ = 2: range, azimuth
//! Accelerating x, vx, ax, y, vy, ay    constant velocity; gentle, hard acceleration   NZ = 3: range, azimuth, range-rate
//! ```
//!
//! The numbers are single precision in every precision of the tracker, so that a tracker in double precision is the same one.

use crate::association::{Gate, Jpda};
use crate::error::ConfigError;
use crate::gaussian::Gaussian;
use crate::initiation::{Initiation, Rule};
use crate::mode::ModeSet;
use crate::model::motion::{ConstantAcceleration, ConstantVelocity, ProcessNoise};
use crate::model::radar::{Component, Mount, Radar};
use crate::model::turn::KnownTurn;
use crate::scalar::Real;
use crate::sensor::{Clutter, UniformSensor};
use crate::symmetric::Symmetric;
use crate::time::Duration;
use crate::track::Logic;
use crate::tracker::{ImmJpda, JointState};
use nalgebra::SVector;

/// Modes of all ready trackers
pub const MODES: usize = 3;
/// Room for tracks
pub const TRACKS: usize = 16;
/// Room for detections in a scan
pub const DETS: usize = 32;
/// Room for sets of served tracks in joint association
pub const NODES: usize = 128;

/// How many numbers [`Parameters`] has
pub const WORDS: usize = 41;

/// How a log names the trackers of targets that turn
pub const TURNING: [u8; 4] = *b"turn";
/// How a log names the trackers of targets that accelerate
pub const ACCELERATING: [u8; 4] = *b"accl";

/// Straight flight, and turns to the left and to the right.
pub type Turning<T> = (ConstantVelocity<T, 2>, KnownTurn<T, 2>, KnownTurn<T, 2>);
/// Straight flight, and accelerations in any direction.
pub type Accelerating<T> = (ConstantVelocity<T, 2, 3>, ConstantAcceleration<T, 2>, ConstantAcceleration<T, 2>);
/// A ready tracker of the modes `M`.
pub type Tracker<T, M, const NX: usize> = ImmJpda<T, M, NX, MODES, TRACKS, DETS, Jpda<NODES>>;
/// Its memory.
pub type State<T, const NX: usize> = JointState<T, NX, MODES, TRACKS, DETS, Jpda<NODES>>;
/// A radar that measures range, azimuth and, with `NZ` = 3, range-rate of targets with `STRIDE` states an axis.
pub type Sensor<T, const NZ: usize, const STRIDE: usize> = UniformSensor<Radar<T, NZ, 2, STRIDE>, T>;

/// All numbers of a ready configuration. SI units, radians.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Parameters {
    /// Where the radar is: x, y, z \[m\]
    pub position: [f32; 3],
    /// How it moves over the ground \[m/s\]
    pub velocity: [f32; 3],
    /// How it is turned: yaw (left), pitch (nose down), roll (right side down) \[rad\]
    pub attitude: [f32; 3],
    /// Standard deviation of the range \[m\]
    pub sigma_range: f32,
    /// Standard deviation of the azimuth \[rad\]
    pub sigma_azimuth: f32,
    /// Standard deviation of the range-rate \[m/s\]; unused by radars without
    pub sigma_range_rate: f32,
    /// V where range-rate is known modulo 2 V \[m/s\]; 0 where it is not folded
    pub unambiguous_speed: f32,
    /// Probability of detection
    pub p_detect: f32,
    /// Expected false detections per scan and unit of measurement volume, such as 1/(m rad); 0 where unknown: it is estimated
    pub clutter_density: f32,
    /// Gate: the largest normalised innovation squared
    pub gate: f32,
    /// Variance of the random acceleration of every mode, as one value a step \[(m/s²)²\]
    pub mode_noise: [f32; 3],
    /// Rate of the turning modes \[rad/s\]; unused by accelerating ones
    pub turn_rate: f32,
    /// Probability of a jump from mode (row) to mode (column) between two scans
    pub jump: [[f32; 3]; 3],
    /// Mode probabilities of a new track
    pub initial: [f32; 3],
    /// A track is confirmed by so many hits ..
    pub hits: u32,
    /// .. in so many scans, at most 32
    pub window: u32,
    /// It is deleted after so many misses in a row, at most 32
    pub misses: u32,
    /// It is deleted where its position has a larger standard deviation \[m\]; 0 for no limit
    pub position_limit: f32,
    /// It is deleted as a duplicate nearer than so many standard deviations to an older one; 0 never
    pub duplicate_distance: f32,
    /// The largest speed of a target: what may pair two detections \[m/s\]
    pub max_speed: f32,
    /// How long a detection waits for its partner \[µs\]
    pub max_gap_us: u32,
    /// Standard deviation of the speed of new tracks, an axis \[m/s\]
    pub sigma_speed: f32,
    /// Standard deviation of the acceleration of new tracks, an axis \[m/s²\]; unused by turning modes
    pub sigma_acceleration: f32,
}

impl Parameters {
    /// A radar for aircraft, one scan a second, targets that turn: what to start from.
    #[must_use]
    pub const fn turning() -> Self {
        Self {
            mode_noise: [1.0, 25.0, 25.0],
            jump: [[0.9, 0.05, 0.05], [0.1, 0.85, 0.05], [0.1, 0.05, 0.85]],
            initial: [0.8, 0.1, 0.1],
            ..Self::accelerating()
        }
    }

    /// A radar for aircraft, one scan a second, targets that accelerate: what to start from.
    #[must_use]
    pub const fn accelerating() -> Self {
        Self {
            position: [0.0; 3],
            velocity: [0.0; 3],
            attitude: [0.0; 3],
            sigma_range: 15.0,
            sigma_azimuth: 0.003,
            sigma_range_rate: 1.0,
            unambiguous_speed: 0.0,
            p_detect: 0.95,
            clutter_density: 1e-4,
            gate: 16.0,
            mode_noise: [0.1, 1.0, 64.0],
            turn_rate: 0.06,
            jump: [[0.92, 0.05, 0.03], [0.06, 0.9, 0.04], [0.1, 0.3, 0.6]],
            initial: [0.8, 0.15, 0.05],
            hits: 4,
            window: 6,
            misses: 5,
            position_limit: 1500.0,
            duplicate_distance: 1.0,
            max_speed: 350.0,
            max_gap_us: 2_500_000,
            sigma_speed: 100.0,
            sigma_acceleration: 5.0,
        }
    }

    /// The radar.
    ///
    /// # Errors
    /// Where a number is not finite, a standard deviation or the gate not positive, a probability none.
    pub fn sensor<T: Real, const NZ: usize, const STRIDE: usize>(&self) -> Result<Sensor<T, NZ, STRIDE>, ConfigError> {
        const { assert!(NZ == 2 || NZ == 3, "range and azimuth, and range-rate or not") }
        let part = |k: usize| match k {
            0 => (Component::Range, self.sigma_range),
            1 => (Component::Azimuth, self.sigma_azimuth),
            _ => (Component::RangeRate, self.sigma_range_rate),
        };
        let components = core::array::from_fn(|k| part(k).0);
        let noise = Symmetric::from_diagonal(core::array::from_fn(|k| square(part(k).1)));
        let [yaw, pitch, roll] = self.attitude.map(real);
        let mount = Mount::at(self.position.map(real)).moving(self.velocity.map(real)).turned(yaw, pitch, roll);
        let mut radar = Radar::<T, NZ, 2, STRIDE>::new(components, noise)?.on(mount);
        if NZ == 3 && self.unambiguous_speed != 0.0 {
            radar = radar.with_unambiguous_speed(real(self.unambiguous_speed))?;
        }
        let clutter = if self.clutter_density == 0.0 { Clutter::Diffuse } else { Clutter::Poisson(real(self.clutter_density)) };
        UniformSensor::new(radar, real(self.p_detect), clutter, Gate::new::<NZ>(real(self.gate))?)
    }

    /// The tracker of targets that turn.
    ///
    /// # Errors
    /// Where a number is not finite or not positive where it must be, probabilities do not sum to one, or the counts of hits
    /// and misses make no rule.
    pub fn turning_tracker<T: Real>(&self) -> Result<Tracker<T, Turning<T>, 4>, ConfigError> {
        let [quiet, left, right] = self.noise();
        let rate = real::<T>(self.turn_rate);
        let modes = (ConstantVelocity::new(quiet)?, KnownTurn::new(rate, left)?, KnownTurn::new(-rate, right)?);
        self.tracker(modes, [T::ONE, square(self.sigma_speed), T::ONE, square(self.sigma_speed)])
    }

    /// The tracker of targets that accelerate.
    ///
    /// # Errors
    /// As those of [`turning_tracker`](Self::turning_tracker).
    pub fn accelerating_tracker<T: Real>(&self) -> Result<Tracker<T, Accelerating<T>, 6>, ConfigError> {
        let [quiet, gentle, hard] = self.noise();
        let modes = (ConstantVelocity::new(quiet)?, ConstantAcceleration::new(gentle)?, ConstantAcceleration::new(hard)?);
        let (v, a) = (square(self.sigma_speed), square(self.sigma_acceleration));
        self.tracker(modes, [T::ONE, v, a, T::ONE, v, a])
    }

    fn noise<T: Real>(&self) -> [ProcessNoise<T>; MODES] {
        self.mode_noise.map(|variance| ProcessNoise::Discrete(real(variance)))
    }

    fn tracker<T: Real, M: ModeSet<T, NX, MODES>, const NX: usize>(
        &self,
        modes: M,
        prior: [T; NX],
    ) -> Result<Tracker<T, M, NX>, ConfigError> {
        let count = |n: u32| u8::try_from(n).map_err(|_| ConfigError::BadWindow);
        let mut logic = Logic::new(count(self.hits)?, count(self.window)?, count(self.misses)?)?
            .with_duplicate_distance(real(self.duplicate_distance))?;
        if self.position_limit != 0.0 {
            logic = logic.with_position_limit(real(self.position_limit))?;
        }
        let rule = Rule::TwoPoint { max_speed: real(self.max_speed), max_gap: Duration::from_micros(self.max_gap_us.into()) };
        let prior = Gaussian::new(SVector::zeros(), Symmetric::from_diagonal(prior));
        let (jump, initial) = (self.jump.map(|row| row.map(real)), self.initial.map(real));
        Ok(ImmJpda::new(modes, jump, initial, logic, Jpda::new())?.with_initiation(Initiation::new(rule, prior)?))
    }

    /// All numbers as words, in the order of the structure: for a log, or for settings in flash.
    #[must_use]
    pub fn words(&self) -> [u32; WORDS] {
        let Self { position, velocity, attitude, mode_noise, jump, initial, .. } = self;
        let radar = [self.sigma_range, self.sigma_azimuth, self.sigma_range_rate, self.unambiguous_speed];
        let radar = position.iter().chain(velocity).chain(attitude).copied().chain(radar);
        let seen = [self.p_detect, self.clutter_density, self.gate];
        let modes = mode_noise.iter().chain([&self.turn_rate]).chain(jump.as_flattened()).chain(initial).copied();
        let counts = [self.hits, self.window, self.misses];
        let limits = [self.position_limit, self.duplicate_distance, self.max_speed].map(f32::to_bits);
        let born = [self.max_gap_us, self.sigma_speed.to_bits(), self.sigma_acceleration.to_bits()];
        let mut all = radar.chain(seen).chain(modes).map(f32::to_bits).chain(counts).chain(limits).chain(born);
        core::array::from_fn(|_| all.next().unwrap_or_default())
    }

    /// The numbers that [`words`](Self::words) gave.
    #[must_use]
    pub fn from_words(words: &[u32; WORDS]) -> Self {
        let mut words = words.iter().copied();
        let mut count = || words.next().unwrap_or_default();
        let mut next = || f32::from_bits(count());
        let mut three = || [next(), next(), next()];
        // Fields are read in the order in which they stand here.
        let (position, velocity, attitude) = (three(), three(), three());
        let [sigma_range, sigma_azimuth, sigma_range_rate] = three();
        let [unambiguous_speed, p_detect, clutter_density] = three();
        let gate = next();
        let mode_noise = [next(), next(), next()];
        let turn_rate = next();
        let mut three = || [next(), next(), next()];
        let (jump, initial) = ([three(), three(), three()], three());
        let [hits, window, misses] = [count(), count(), count()];
        let mut next = || f32::from_bits(count());
        let [position_limit, duplicate_distance, max_speed] = [next(), next(), next()];
        let max_gap_us = count();
        let [sigma_speed, sigma_acceleration] = [count(), count()].map(f32::from_bits);
        Self {
            position,
            velocity,
            attitude,
            sigma_range,
            sigma_azimuth,
            sigma_range_rate,
            unambiguous_speed,
            p_detect,
            clutter_density,
            gate,
            mode_noise,
            turn_rate,
            jump,
            initial,
            hits,
            window,
            misses,
            position_limit,
            duplicate_distance,
            max_speed,
            max_gap_us,
            sigma_speed,
            sigma_acceleration,
        }
    }
}

fn real<T: Real>(x: f32) -> T {
    T::lit(f64::from(x))
}

fn square<T: Real>(sigma: f32) -> T {
    real::<T>(sigma) * real(sigma)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn words_are_all_numbers_in_order() {
        assert_eq!(size_of::<Parameters>(), 4 * WORDS);
        let words: [u32; WORDS] = core::array::from_fn(|k| 1000 + k as u32);
        assert_eq!(Parameters::from_words(&words).words(), words);
        let parameters = Parameters::from_words(&words);
        assert_eq!((parameters.hits, parameters.max_gap_us), (1000 + 32, 1000 + 38));
    }

    #[test]
    fn defaults_are_configurations_and_nonsense_is_refused() {
        let (turning, accelerating) = (Parameters::turning(), Parameters::accelerating());
        assert!(turning.turning_tracker::<f32>().is_ok() && accelerating.accelerating_tracker::<f64>().is_ok());
        assert!(turning.sensor::<f32, 2, 2>().is_ok() && accelerating.sensor::<f64, 3, 3>().is_ok());
        let refused = |p: Parameters| p.turning_tracker::<f32>().err().or(p.sensor::<f32, 3, 2>().err());
        assert_eq!(refused(Parameters { hits: 300, ..turning }), Some(ConfigError::BadWindow));
        assert_eq!(refused(Parameters { p_detect: 1.5, ..turning }), Some(ConfigError::NotAProbability));
        assert_eq!(refused(Parameters { initial: [0.5; 3], ..turning }), Some(ConfigError::NotNormalised));
        assert_eq!(refused(Parameters { sigma_azimuth: f32::NAN, ..turning }), Some(ConfigError::NotDefinite));
        assert_eq!(refused(Parameters { max_gap_us: 0, ..turning }), Some(ConfigError::NotPositive));
        assert_eq!(refused(Parameters { unambiguous_speed: -1.0, ..turning }), Some(ConfigError::NotPositive));
    }
}
