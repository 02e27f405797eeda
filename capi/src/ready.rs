//! The configurations that come with the library, and the pattern for one's own.

use crate::kind::Kind;
use crate::tracking::Configuration;
use boresight::error::ConfigError;
use boresight::log::{Header, Recorder};
use boresight::ready::{ACCELERATING, Accelerating, DETS, MODES, Parameters, Sensor, TRACKS, TURNING, Tracker, Turning, WORDS};

/// Targets that turn: 4 states.
pub struct Turns;
/// Targets that accelerate: 6 states.
pub struct Accelerates;

impl<const NZ: usize> Configuration<4, 3, NZ> for Turns {
    type Tracker = Tracker<f32, Turning<f32>, 4>;
    type Sensor = Sensor<f32, NZ, 2>;
    const LOG: [u8; 4] = TURNING;

    fn defaults() -> Parameters {
        Parameters::turning()
    }
    fn build(parameters: &Parameters) -> Result<(Self::Tracker, Self::Sensor), ConfigError> {
        Ok((parameters.turning_tracker()?, parameters.sensor()?))
    }
}

impl<const NZ: usize> Configuration<6, 3, NZ> for Accelerates {
    type Tracker = Tracker<f32, Accelerating<f32>, 6>;
    type Sensor = Sensor<f32, NZ, 3>;
    const LOG: [u8; 4] = ACCELERATING;

    fn defaults() -> Parameters {
        Parameters::accelerating()
    }
    fn build(parameters: &Parameters) -> Result<(Self::Tracker, Self::Sensor), ConfigError> {
        Ok((parameters.accelerating_tracker()?, parameters.sensor()?))
    }
}

/// Bytes of a `boresight_turning_ra`
pub const BORESIGHT_TURNING_RA_SIZE: usize = 17_536;
/// Bytes of a `boresight_turning_rar`
pub const BORESIGHT_TURNING_RAR_SIZE: usize = 18_328;
/// Bytes of a `boresight_accelerating_ra`
pub const BORESIGHT_ACCELERATING_RA_SIZE: usize = 21_840;
/// Bytes of a `boresight_accelerating_rar`
pub const BORESIGHT_ACCELERATING_RAR_SIZE: usize = 22_632;

/// Bytes of what a log begins with
pub const BORESIGHT_LOG_HEADER: usize = 196;
/// Bytes of the largest record of a log
pub const BORESIGHT_LOG_RECORD: usize = 2256;
const _: () = assert!(BORESIGHT_LOG_HEADER == Header::size(WORDS));
const _: () = assert!(BORESIGHT_LOG_RECORD == Recorder::<6, MODES, 3, TRACKS, DETS>::MOST);

/// IMM-JPDA, states (x, vx, y, vy); range, azimuth
#[unsafe(no_mangle)]
pub static boresight_turning_ra: Kind = Kind::of::<Turns, 4, 3, 2, TRACKS, DETS>();
/// IMM-JPDA, states (x, vx, y, vy); range, azimuth, range-rate
#[unsafe(no_mangle)]
pub static boresight_turning_rar: Kind = Kind::of::<Turns, 4, 3, 3, TRACKS, DETS>();
/// IMM-JPDA, states (x, vx, ax, y, vy, ay); range, azimuth
#[unsafe(no_mangle)]
pub static boresight_accelerating_ra: Kind = Kind::of::<Accelerates, 6, 3, 2, TRACKS, DETS>();
/// IMM-JPDA, states (x, vx, ax, y, vy, ay); range, azimuth, range-rate
#[unsafe(no_mangle)]
pub static boresight_accelerating_rar: Kind = Kind::of::<Accelerates, 6, 3, 3, TRACKS, DETS>();

// A compiler that lays memory out otherwise does not get past this. On the microcontroller addresses are shorter: a few bytes are
// left over.
const fn fits(kind: &Kind, size: usize) -> bool {
    kind.size() <= size && size - kind.size() <= 64
}
const _: () = assert!(fits(&boresight_turning_ra, BORESIGHT_TURNING_RA_SIZE));
const _: () = assert!(fits(&boresight_turning_rar, BORESIGHT_TURNING_RAR_SIZE));
const _: () = assert!(fits(&boresight_accelerating_ra, BORESIGHT_ACCELERATING_RA_SIZE));
const _: () = assert!(fits(&boresight_accelerating_rar, BORESIGHT_ACCELERATING_RAR_SIZE));
