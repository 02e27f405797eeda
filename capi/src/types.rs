//! What crosses the border: flat structures of plain numbers, filled in by either side. SI units, radians.

use boresight::error::{ConfigError, ScanError};
use boresight::log::LogError;
use core::ffi::{CStr, c_char};

/// Most components of a measurement
pub const BORESIGHT_COMPONENTS: usize = 4;
/// Most states of a target
pub const BORESIGHT_STATES: usize = 9;
/// Most entries of the upper triangle of a covariance
pub const BORESIGHT_COVARIANCE: usize = 45;
/// Most modes
pub const BORESIGHT_MODES: usize = 8;
/// Alignment of a tracker's memory \[bytes\]
pub const BORESIGHT_ALIGN: usize = 8;

/// In `given` of a detection: `sigma` is this detection's own, not the radar's
pub const BORESIGHT_SIGMA: u32 = 1;
/// In `given` of a detection: `amplitude` says how strong it is
pub const BORESIGHT_AMPLITUDE: u32 = 2;

/// One plot. All zero but `z`: made at the time of the scan, with the noise of the radar.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Detection {
    /// The measurement, in the order of the configuration's components \[m, rad, m/s\]
    pub z: [f32; BORESIGHT_COMPONENTS],
    /// Standard deviations of the components, where given
    pub sigma: [f32; BORESIGHT_COMPONENTS],
    /// Strength, where given: decides what is kept of a scan that is too large
    pub amplitude: f32,
    /// How long after the time of its scan it was made \[µs\], at most a minute either way
    pub offset_us: i32,
    /// BORESIGHT_SIGMA, BORESIGHT_AMPLITUDE, both or none
    pub given: u32,
}

/// What a scan did, and what was given up for want of room.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Report {
    /// Detections taken in
    pub detections: u16,
    /// Detections beyond the capacity, given up by amplitude or by arrival
    pub detections_dropped: u16,
    /// Detections that no track gated
    pub detections_unclaimed: u16,
    /// Detections that could have become half of a track, forgotten for want of room
    pub seeds_dropped: u16,
    /// Tracks started
    pub births: u16,
    /// Tracks not started for want of a slot
    pub births_refused: u16,
    /// Tentative tracks that gave their slot to a birth
    pub tracks_evicted: u16,
    /// Tracks confirmed
    pub tracks_confirmed: u16,
    /// Tracks deleted because they were no longer seen, or too uncertain
    pub tracks_deleted: u16,
    /// Tracks deleted because an older one follows the same target
    pub duplicates_deleted: u16,
    /// Corrections refused because they would have broken a covariance
    pub numeric_resets: u16,
    /// Clusters whose lightest joint events were given up
    pub clusters_bounded: u16,
    /// Clusters for which joint probabilities could only be approximated
    pub clusters_approximated: u16,
    /// Clusters without any possible joint event
    pub clusters_infeasible: u16,
    /// Pairs of tracks that the sensor may not tell apart, beyond the room for them
    pub pairs_refused: u16,
    /// Every association probability of a bounded cluster is within this of the exact one
    pub association_error_bound: f32,
    /// A bound on the share of probability that hypotheses given up had
    pub truncated_mass: f32,
}

impl From<boresight::scan::Report> for Report {
    fn from(r: boresight::scan::Report) -> Self {
        Self {
            detections: r.detections,
            detections_dropped: r.detections_dropped,
            detections_unclaimed: r.detections_unclaimed,
            seeds_dropped: r.seeds_dropped,
            births: r.births,
            births_refused: r.births_refused,
            tracks_evicted: r.tracks_evicted,
            tracks_confirmed: r.tracks_confirmed,
            tracks_deleted: r.tracks_deleted,
            duplicates_deleted: r.duplicates_deleted,
            numeric_resets: r.numeric_resets,
            clusters_bounded: r.clusters_bounded,
            clusters_approximated: r.clusters_approximated,
            clusters_infeasible: r.clusters_infeasible,
            pairs_refused: r.pairs_refused,
            association_error_bound: r.association_error_bound,
            truncated_mass: r.truncated_mass,
        }
    }
}

/// How far a track is trusted.
#[repr(u32)]
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Trust {
    /// Started, not yet seen often enough
    Tentative = 0,
    /// Seen often enough, and in its last scan
    Confirmed = 1,
    /// Confirmed before, not seen in its last scan
    Coasting = 2,
}

/// A track at the time of the last scan.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Track {
    /// Its identity, never given to another
    pub id: u32,
    /// How far it is trusted
    pub trust: Trust,
    /// The probability that the target exists
    pub existence: f32,
    /// x, y, z \[m\]; 0 in axes that the tracker does not have
    pub position: [f32; 3],
    /// The velocity \[m/s\]
    pub velocity: [f32; 3],
    /// Covariance of the position: xx, xy, xz, yy, yz, zz \[m²\]
    pub covariance: [f32; 6],
}

/// All that is known of one track.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Density {
    /// How many states there are: the first ones of `mean`
    pub states: u32,
    /// How many modes there are: the first ones of `mode_probability`
    pub modes: u32,
    /// The states, in the order of the configuration
    pub mean: [f32; BORESIGHT_STATES],
    /// Upper triangle of the covariance, by rows
    pub covariance: [f32; BORESIGHT_COVARIANCE],
    /// The probabilities of the modes
    pub mode_probability: [f32; BORESIGHT_MODES],
}

/// What came of a call. Anything but BORESIGHT_STATUS_OK has changed nothing.
#[repr(u32)]
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Status {
    /// Done
    Ok = 0,
    /// A pointer that must not be is NULL
    Null = 1,
    /// The memory is too small or not aligned
    Memory = 2,
    /// This is no tracker: it has not been created, or was overwritten
    NoTracker = 3,
    /// No track has this identity
    NoTrack = 4,
    /// More detections than memory can hold
    Count = 5,
    /// No scan without a record: none has been offered yet, or the last one has its record
    NoScan = 6,
    /// Configuration: a number is not finite
    ConfigNotFinite = 16,
    /// Configuration: a number that must be positive is not
    ConfigNotPositive = 17,
    /// Configuration: a probability lies outside 0 to 1
    ConfigNotAProbability = 18,
    /// Configuration: probabilities do not sum to one
    ConfigNotNormalised = 19,
    /// Configuration: a covariance is not positive definite
    ConfigNotDefinite = 20,
    /// Configuration: hits and window need 1 <= hits <= window <= 32 and 1 <= misses <= 32
    ConfigBadWindow = 21,
    /// Configuration: wrong in another way
    ConfigOther = 31,
    /// Scan: older than the last one
    ScanTimeReversed = 32,
    /// Scan: a detection is not finite
    ScanDetectionNotFinite = 33,
    /// Scan: the noise of a detection is not positive definite
    ScanNoiseNotDefinite = 34,
    /// Scan: a detection is more than a minute from its scan
    ScanOffsetTooLarge = 35,
    /// Scan: the place or motion of the radar is not finite
    ScanSensorNotFinite = 36,
    /// Scan: wrong in another way
    ScanOther = 47,
}

impl From<ConfigError> for Status {
    fn from(error: ConfigError) -> Self {
        match error {
            ConfigError::NotFinite => Self::ConfigNotFinite,
            ConfigError::NotPositive => Self::ConfigNotPositive,
            ConfigError::NotAProbability => Self::ConfigNotAProbability,
            ConfigError::NotNormalised => Self::ConfigNotNormalised,
            ConfigError::NotDefinite => Self::ConfigNotDefinite,
            ConfigError::BadWindow => Self::ConfigBadWindow,
            _ => Self::ConfigOther,
        }
    }
}

impl From<ScanError> for Status {
    fn from(error: ScanError) -> Self {
        match error {
            ScanError::TimeReversed => Self::ScanTimeReversed,
            ScanError::DetectionNotFinite => Self::ScanDetectionNotFinite,
            ScanError::NoiseNotDefinite => Self::ScanNoiseNotDefinite,
            ScanError::OffsetTooLarge => Self::ScanOffsetTooLarge,
            ScanError::SensorNotFinite => Self::ScanSensorNotFinite,
            _ => Self::ScanOther,
        }
    }
}

impl From<LogError> for Status {
    /// What a log asks for here is room.
    fn from(_: LogError) -> Self {
        Self::Memory
    }
}

/// The meaning of a status in words, for a log; it lives for ever.
#[unsafe(no_mangle)]
pub extern "C" fn boresight_text(status: u32) -> *const c_char {
    const TEXTS: [(Status, &CStr); 20] = [
        (Status::Ok, c"done"),
        (Status::Null, c"a pointer is NULL"),
        (Status::Memory, c"the memory is too small or not aligned"),
        (Status::NoTracker, c"this is no tracker"),
        (Status::NoTrack, c"no track has this identity"),
        (Status::Count, c"more detections than memory can hold"),
        (Status::NoScan, c"no scan is without a record"),
        (Status::ConfigNotFinite, c"a number is not finite"),
        (Status::ConfigNotPositive, c"a number that must be positive is not"),
        (Status::ConfigNotAProbability, c"a probability lies outside 0 to 1"),
        (Status::ConfigNotNormalised, c"probabilities do not sum to one"),
        (Status::ConfigNotDefinite, c"a covariance is not positive definite"),
        (Status::ConfigBadWindow, c"1 <= hits <= window <= 32 and 1 <= misses <= 32 are needed"),
        (Status::ConfigOther, c"the configuration is wrong"),
        (Status::ScanTimeReversed, c"the scan is older than the last one"),
        (Status::ScanDetectionNotFinite, c"a detection is not finite"),
        (Status::ScanNoiseNotDefinite, c"the noise of a detection is not positive definite"),
        (Status::ScanOffsetTooLarge, c"a detection is more than a minute from its scan"),
        (Status::ScanSensorNotFinite, c"the place or motion of the radar is not finite"),
        (Status::ScanOther, c"the scan is wrong"),
    ];
    TEXTS.iter().find(|(known, _)| *known as u32 == status).map_or(c"unknown status", |(_, text)| text).as_ptr()
}
