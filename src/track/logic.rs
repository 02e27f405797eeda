//! The rules of a track's life, by either of two ways to tell a target from clutter.
//!
//! ```text
//! M-of-N
//! tentative → confirmed   M hits in the last N scans that looked at it
//! tentative → deleted     M hits in its first N scans have become impossible, or M of the last N are lost
//! any       → deleted     K misses in a row
//!
//! integrated existence, r = P(the target exists | all scans)
//! prediction     r⁻ = r e^{−dt / lifetime}
//! weights        h_j = r⁻ P_D L_j / λ,  m = 1 − r⁻ P_D P_G      (it is detected with probability r⁻ P_D)
//! after β        r = Σ β_j + β_0 e,  e = r⁻ (1 − P_D P_G) / (1 − r⁻ P_D P_G)
//! given that it exists   β_j / r,  β_0 e / r
//! tentative → confirmed   r > confirm
//! any       → deleted     r < delete
//!
//! both
//! confirmed ⇄ coasting    the last scan missed / saw it
//! any       → deleted     a position standard deviation beyond the limit; a duplicate of another track
//! ```
//!
//! Musicki, Evans and Stankovic, *IEEE Trans. AC* 39(6), 1994 (IPDA, one track); Musicki and Evans, *IEEE Trans. AES*
//! 40(3), 2004 (joint IPDA). The association alone tells the two apart. e needs only probabilities, never the scale of
//! the weights.

use crate::error::ConfigError;
use crate::gaussian::Gaussian;
use crate::model::Layout;
use crate::scalar::{Real, exp, is_finite};

/// r is kept at or below this, so that misses can always end a track.
const MOST_CERTAIN: f64 = 1.0 - 1e-6;

/// The rules of a track's life.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Logic<T> {
    pub(super) policy: Policy<T>,
    pub(super) position_variance: T,
    pub(super) duplicate_distance: T,
}

/// How a target is told from clutter.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub(super) enum Policy<T> {
    Count { hits: u8, window: u8, misses: u8 },
    Existence(Existence<T>),
}

/// The rules of integrated existence, for [`Logic::existence`]. r is at most 1 − 1e-6.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Existence<T> {
    /// r of a track that initiation has started; a cue from elsewhere counts as certain
    pub birth: T,
    /// How long targets stay on average \[s\]: one survives dt with probability e^{−dt / lifetime}
    pub lifetime: T,
    /// A track is confirmed once r is above this
    pub confirm: T,
    /// A track is deleted once r is below this
    pub delete: T,
}

impl<T: Real> Logic<T> {
    /// Confirmed by `hits` (M) within `window` (N) scans, deleted after `misses` scans in a row without a hit. The
    /// existence of every track counts as certain.
    ///
    /// # Errors
    /// Unless 1 ≤ M ≤ N ≤ 32 and 1 ≤ `misses` ≤ 32.
    pub fn new(hits: u8, window: u8, misses: u8) -> Result<Self, ConfigError> {
        if hits == 0 || hits > window || window > 32 || misses == 0 || misses > 32 {
            return Err(ConfigError::BadWindow);
        }
        Ok(Self { policy: Policy::Count { hits, window, misses }, duplicate_distance: T::ONE, ..Self::unmanaged() })
    }

    /// Confirmed and deleted by the probability that the target exists. With
    /// [`NearestNeighbour`](crate::association::NearestNeighbour) and other associations that know no doubt, one gated
    /// detection makes it certain.
    ///
    /// # Errors
    /// Unless all are finite, `lifetime` is positive, 0 < `delete` < `birth` < 1 and `delete` < `confirm` < 1 − 1e-6.
    pub fn existence(rules: Existence<T>) -> Result<Self, ConfigError> {
        let Existence { birth, lifetime, confirm, delete } = rules;
        if ![birth, lifetime, confirm, delete].into_iter().all(is_finite) {
            return Err(ConfigError::NotFinite);
        }
        if lifetime <= T::ZERO {
            return Err(ConfigError::NotPositive);
        }
        let ordered = T::ZERO < delete && delete < birth && birth < T::ONE && delete < confirm && confirm < T::lit(MOST_CERTAIN);
        if !ordered {
            return Err(ConfigError::BadThresholds);
        }
        Ok(Self { policy: Policy::Existence(rules), duplicate_distance: T::ONE, ..Self::unmanaged() })
    }

    /// Tracks are confirmed at once and live until the caller [`remove`](crate::tracker::State::remove)s them.
    #[must_use]
    pub fn unmanaged() -> Self {
        let policy = Policy::Count { hits: 1, window: 1, misses: u8::MAX };
        Self { policy, position_variance: T::ONE / T::ZERO, duplicate_distance: T::ZERO }
    }

    /// Also deletes tracks whose position standard deviation, in any axis, exceeds `limit` \[m\].
    ///
    /// # Errors
    /// Where the limit is not positive and finite.
    pub fn with_position_limit(self, limit: T) -> Result<Self, ConfigError> {
        if !limit.is_finite() {
            return Err(ConfigError::NotFinite);
        }
        if limit <= T::ZERO {
            return Err(ConfigError::NotPositive);
        }
        Ok(Self { position_variance: limit * limit, ..self })
    }

    /// Also deletes the younger of two tracks whose positions and velocities differ by less than `distance` on
    /// average, in standard deviations. One is the default; zero never does.
    ///
    /// # Errors
    /// Where the distance is negative or not finite.
    pub fn with_duplicate_distance(self, distance: T) -> Result<Self, ConfigError> {
        if !distance.is_finite() {
            return Err(ConfigError::NotFinite);
        }
        if distance < T::ZERO {
            return Err(ConfigError::NotPositive);
        }
        Ok(Self { duplicate_distance: distance, ..self })
    }
}

impl<T: Real> Logic<T> {
    pub(crate) fn deletes_duplicates(&self) -> bool {
        self.duplicate_distance > T::ZERO
    }

    /// Whether a position variance of `g` exceeds the limit.
    pub(crate) fn is_too_uncertain<const NX: usize>(&self, g: &Gaussian<T, NX>, layout: Layout) -> bool {
        let variance = |axis: usize| g.cov.get(axis * layout.stride, axis * layout.stride);
        (0..layout.axes).any(|axis| variance(axis).is_some_and(|v| v > self.position_variance))
    }

    /// The probability that a target is still there after `dt` \[s\].
    pub(crate) fn p_survive(&self, dt: T) -> T {
        match self.policy {
            Policy::Count { .. } => T::ONE,
            Policy::Existence(rules) => exp(-dt / rules.lifetime),
        }
    }

    /// r of a track that initiation starts.
    pub(super) fn at_birth(&self) -> T {
        match self.policy {
            Policy::Count { .. } => T::ONE,
            Policy::Existence(rules) => rules.birth,
        }
    }

    /// r of a cue.
    pub(super) fn at_cue(&self) -> T {
        match self.policy {
            Policy::Count { .. } => T::ONE,
            Policy::Existence(_) => T::lit(MOST_CERTAIN),
        }
    }

    /// The share of "no detection is the target's" in which the target exists, r (1 − P_D P_G) / (1 − r P_D P_G): all of it
    /// under M-of-N. `p_seen` is P_D P_G.
    #[inline(always)]
    pub(crate) fn doubt(&self, existence: T, p_seen: T) -> T {
        match self.policy {
            Policy::Count { .. } => T::ONE,
            Policy::Existence(_) => existence * (T::ONE - p_seen) / (T::ONE - existence * p_seen),
        }
    }

    /// Takes what a scan says into `existence`: r ← (m d + h) / (m + h), where a miss weighs m, all hits together h, and d is
    /// the [`doubt`](Self::doubt).
    #[inline(always)]
    pub(crate) fn believe(&self, existence: &mut T, doubt: T, miss: T, hits: T) {
        if let Policy::Count { .. } = self.policy {
            return;
        }
        let r = (miss * doubt + hits) / (miss + hits);
        let most = T::lit(MOST_CERTAIN);
        *existence = if r > most {
            most
        } else if r > T::ZERO {
            r
        } else {
            T::ZERO
        };
    }
}
