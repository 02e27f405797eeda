//! Where targets appear: in regions known beforehand, and optionally wherever the last scan saw what no track explains.
//!
//! ```text
//! region       born with probability r, N(m, P) and the given mode probabilities; no motion in the scan of birth
//! detection    z of the last scan, used by tracks with the probability u(z):  r = min(r_most, B (1 − u(z)) / Σ_z (1 − u(z)))
//!              at z, the rest of the state from a prior; then it moves up to this scan
//! ```
//!
//! B is the number of targets expected to be born in a scan (Reuter, Vo, Vo and Dietmayer 2014, section IV-D). Of the births from
//! detections those are kept that most probably exist after this scan.

use crate::error::ConfigError;
use crate::gaussian::Gaussian;
use crate::initiation::Initiation;
use crate::mode::check_distribution;
use crate::model::Fix;
use crate::scalar::Real;

/// A place where targets appear.
#[derive(Clone, Copy, Debug)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Region<T, const NX: usize, const MODES: usize> {
    pub(crate) existence: T,
    pub(crate) density: Gaussian<T, NX>,
    pub(crate) modes: [T; MODES],
}

impl<T: Real, const NX: usize, const MODES: usize> Region<T, NX, MODES> {
    /// At every scan one target is born here with probability `existence`, its state from `density` and its mode from `modes`.
    ///
    /// # Errors
    /// Where `existence` is no probability, `density` no density, or `modes` do not sum to one.
    pub fn new(existence: T, density: Gaussian<T, NX>, modes: [T; MODES]) -> Result<Self, ConfigError> {
        if !(existence >= T::ZERO && existence <= T::ONE) {
            return Err(ConfigError::NotAProbability);
        }
        if !density.mean.iter().all(|v| v.is_finite()) {
            return Err(ConfigError::NotFinite);
        }
        if density.cov.cholesky().is_none() {
            return Err(ConfigError::NotDefinite);
        }
        check_distribution(&modes)?;
        Ok(Self { existence, density, modes })
    }
}

/// Births from detections.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Adaptive<T, const NX: usize, const MODES: usize> {
    pub initiation: Initiation<T, NX>,
    /// B
    pub expected: T,
    /// r_most
    pub most: T,
    pub modes: [T; MODES],
}

/// A detection that may have been a target's first.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Unexplained<T> {
    /// Its place among those that were taken in
    pub place: u16,
    pub fix: Fix<T>,
    /// 1 − u
    pub doubt: T,
}
