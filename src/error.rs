//! The two flat errors: what is wrong with a configuration, and what is wrong with a scan.
//!
//! Load is never an error: a scan with too many detections or too many births returns a
//! [`Report`](crate::scan::Report) that says what was given up.

use core::fmt;

/// A configuration that no tracker can run with.
#[non_exhaustive]
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum ConfigError {
    /// A number is NaN or infinite.
    NotFinite,
    /// A variance, density, speed or threshold that must be positive is not.
    NotPositive,
    /// A probability lies outside 0..=1.
    NotAProbability,
    /// A row of the mode jump matrix, or the initial mode probabilities, do not sum to one.
    NotNormalised,
    /// A covariance is not positive definite.
    NotDefinite,
    /// M-of-N logic with M = 0, M > N or N > 32.
    BadWindow,
    /// Thresholds of existence out of order: 0 < delete < birth < 1 and delete < confirm < 1 − 1e-6 are needed.
    BadThresholds,
    /// Likely modes with thresholds out of order or an impossible minimum: 0 ≤ t₁ < t₂ ≤ 1 and 1 ≤ K ≤ modes are needed.
    BadLikelyModes,
    /// More birth regions than there is room for.
    TooManyRegions,
    /// An unambiguous speed for a radar that does not measure range-rate.
    NoRangeRate,
}

/// A scan that is refused; the state of the tracker is untouched.
#[non_exhaustive]
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum ScanError {
    /// The scan is older than the last one accepted.
    TimeReversed,
    /// A coordinate, amplitude or noise of a detection is NaN or infinite.
    DetectionNotFinite,
    /// The noise covariance that a detection brings is not positive definite.
    NoiseNotDefinite,
    /// A detection is more than a minute from the time of its scan.
    OffsetTooLarge,
    /// The place, mounting or noise of the sensor is NaN or infinite.
    SensorNotFinite,
    /// The gate was made for measurements of another dimension.
    GateDimension,
    /// The sensor states no density of clutter, and the tracker cannot do without.
    ClutterUnknown,
}

impl fmt::Display for ConfigError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            ConfigError::NotFinite => "a number is not finite",
            ConfigError::NotPositive => "a number that must be positive is not",
            ConfigError::NotAProbability => "a probability lies outside 0 to 1",
            ConfigError::NotNormalised => "probabilities do not sum to one",
            ConfigError::NotDefinite => "a covariance is not positive definite",
            ConfigError::BadWindow => "M-of-N logic needs 1 <= M <= N <= 32",
            ConfigError::BadThresholds => "existence needs 0 < delete < birth < 1 and delete < confirm < 1",
            ConfigError::BadLikelyModes => "likely modes need 0 <= t1 < t2 <= 1 and 1 <= K <= the number of modes",
            ConfigError::TooManyRegions => "more birth regions than there is room for",
            ConfigError::NoRangeRate => "the radar does not measure range-rate",
        })
    }
}

impl fmt::Display for ScanError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            ScanError::TimeReversed => "the scan is older than the last one",
            ScanError::DetectionNotFinite => "a detection is not finite",
            ScanError::NoiseNotDefinite => "the noise of a detection is not positive definite",
            ScanError::OffsetTooLarge => "a detection is more than a minute from its scan",
            ScanError::SensorNotFinite => "the place, mounting or noise of the sensor is not finite",
            ScanError::GateDimension => "the gate was made for measurements of another dimension",
            ScanError::ClutterUnknown => "the sensor states no clutter density",
        })
    }
}

impl core::error::Error for ConfigError {}
impl core::error::Error for ScanError {}
