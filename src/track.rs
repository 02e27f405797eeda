//! A track and its life: tentative, confirmed, coasting, gone.
//!
//! ```text
//! tentative → confirmed   M hits in the last N scans that looked at it
//! tentative → deleted     M hits in its first N scans have become impossible, or M of the last N are lost
//! confirmed ⇄ coasting    the last scan missed / saw it
//! any       → deleted     K misses in a row, or a position standard deviation beyond the limit
//! ```
//!
//! A scan is a hit when the detections it gated are more probably the target's than not, 1 − β₀ > ½. A scan whose
//! sensor does not look at the track (P_D below 0.05) counts neither way. Identities are given once: when all 2³² − 1 are used up,
//! births are refused.

use crate::error::ConfigError;
use crate::gaussian::Gaussian;
use crate::mode::ModeBank;
use crate::model::Layout;
use crate::scalar::Real;
use core::num::NonZeroU32;

/// The identity of a track, never used for another.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct TrackId(NonZeroU32);

impl TrackId {
    /// The identity of the first track.
    pub(crate) const FIRST: Self = Self(NonZeroU32::MIN);

    /// The number of the identity, from 1 in order of birth.
    #[must_use]
    pub const fn number(self) -> u32 {
        self.0.get()
    }
}

/// How far a track is trusted.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Status {
    /// Started, not yet seen often enough
    Tentative,
    /// Seen often enough, and in its last scan
    Confirmed,
    /// Confirmed before, not seen in its last scan
    Coasting,
}

/// The rules of a track's life.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Logic<T> {
    hits: u8,
    window: u8,
    misses: u8,
    position_variance: T,
    duplicate_distance: T,
}

impl<T: Real> Logic<T> {
    /// Confirmed by `hits` (M) within `window` (N) scans, deleted after `misses` scans in a row without a hit.
    ///
    /// # Errors
    /// Unless 1 ≤ M ≤ N ≤ 32 and `misses` ≥ 1.
    pub fn new(hits: u8, window: u8, misses: u8) -> Result<Self, ConfigError> {
        if hits == 0 || hits > window || window > 32 || misses == 0 || misses > 32 {
            return Err(ConfigError::BadWindow);
        }
        Ok(Self { hits, window, misses, duplicate_distance: T::ONE, ..Self::unmanaged() })
    }

    /// Tracks are confirmed at once and live until the caller [`remove`](crate::tracker::State::remove)s them.
    #[must_use]
    pub fn unmanaged() -> Self {
        Self { hits: 1, window: 1, misses: u8::MAX, position_variance: T::ONE / T::ZERO, duplicate_distance: T::ZERO }
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
}

/// What a scan did to a track's life.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Change {
    None,
    Confirmed,
    Deleted,
}

/// One slot: a track, or all zero bits.
#[derive(Clone, Copy, Debug)]
pub struct Track<T, const NX: usize, const MODES: usize> {
    id: u32,
    confirmed: bool,
    /// One bit per scan that looked, the latest lowest: 1 for a hit.
    history: u32,
    /// Scans that looked, up to 255.
    age: u8,
    resets: u8,
    pub(crate) bank: ModeBank<T, NX, MODES>,
}

impl<T: Real, const NX: usize, const MODES: usize> Track<T, NX, MODES> {
    /// A free slot.
    pub(crate) const FREE: Self = Self { id: 0, confirmed: false, history: 0, age: 0, resets: 0, bank: ModeBank::ZERO };

    /// Born with `hits` hits behind it.
    pub(crate) fn born(id: TrackId, hits: u8, bank: ModeBank<T, NX, MODES>) -> Self {
        let history = (1u32 << hits.min(31)) - 1;
        Self { id: id.number(), confirmed: false, history, age: hits, resets: 0, bank }
    }

    /// Confirmed from the start: a cue from elsewhere.
    pub(crate) fn cued(id: TrackId, bank: ModeBank<T, NX, MODES>) -> Self {
        Self { confirmed: true, history: u32::MAX, age: u8::MAX, ..Self::born(id, 0, bank) }
    }

    /// Which track this is; `None` for a free slot.
    #[must_use]
    pub fn id(&self) -> Option<TrackId> {
        NonZeroU32::new(self.id).map(TrackId)
    }

    /// How far it is trusted.
    #[must_use]
    pub fn status(&self) -> Status {
        match (self.confirmed, self.history & 1) {
            (false, _) => Status::Tentative,
            (true, 1) => Status::Confirmed,
            (true, _) => Status::Coasting,
        }
    }

    /// The density over all modes.
    #[must_use]
    pub fn bank(&self) -> &ModeBank<T, NX, MODES> {
        &self.bank
    }

    /// Scans in a row without a hit.
    #[must_use]
    pub fn misses(&self) -> u32 {
        self.history.trailing_zeros().min(u32::from(self.age))
    }

    pub(crate) fn is_free(&self) -> bool {
        self.id == 0
    }

    /// Takes in whether the last scan saw the track.
    pub(crate) fn observe(&mut self, hit: bool, logic: &Logic<T>, layout: Layout) -> Change {
        self.history = self.history << 1 | u32::from(hit);
        self.age = self.age.saturating_add(1);
        self.judge(logic, layout)
    }

    /// Applies the rules to what has been seen.
    pub(crate) fn judge(&mut self, logic: &Logic<T>, layout: Layout) -> Change {
        let window = u32::MAX >> (32 - u32::from(logic.window));
        let hits = (self.history & window).count_ones();
        let looked = u32::from(self.age.min(logic.window));
        let hopeless = !self.confirmed && looked - hits.min(looked) > u32::from(logic.window - logic.hits);
        if hopeless || self.misses() >= u32::from(logic.misses) || self.is_too_uncertain(logic, layout) {
            *self = Self::FREE;
            return Change::Deleted;
        }
        if !self.confirmed && hits >= u32::from(logic.hits) {
            self.confirmed = true;
            return Change::Confirmed;
        }
        Change::None
    }

    /// Whether a position variance exceeds the logic's limit.
    pub(crate) fn is_too_uncertain(&self, logic: &Logic<T>, layout: Layout) -> bool {
        let likely = self.likely();
        (0..layout.axes).any(|a| {
            let i = a * layout.stride;
            likely.cov.get(i, i).is_some_and(|v| v > logic.position_variance)
        })
    }

    /// Counts a correction that was taken back. The second one deletes the track.
    pub(crate) fn reset(&mut self) -> Change {
        self.resets = self.resets.saturating_add(1);
        if self.resets < 2 && self.bank.is_valid() {
            return Change::None;
        }
        *self = Self::FREE;
        Change::Deleted
    }

    /// The density of the most probable mode.
    fn likely(&self) -> &Gaussian<T, NX> {
        self.bank.modes.get(self.bank.most_probable()).unwrap_or(&self.bank.modes[0])
    }

    /// Whether `other` follows the same target, by the logic's distance: the mean of the squared differences of
    /// position and velocity in all axes, each over the sum of its variances.
    pub(crate) fn is_duplicate_of(&self, other: &Self, logic: &Logic<T>, layout: Layout) -> bool {
        let (a, b) = (self.likely(), other.likely());
        let (mut sum, mut terms) = (T::ZERO, 0);
        for i in (0..layout.axes).flat_map(|axis| [axis * layout.stride, axis * layout.stride + 1]) {
            if let (Some(x), Some(y), Some(p), Some(q)) = (a.mean.get(i), b.mean.get(i), a.cov.get(i, i), b.cov.get(i, i)) {
                let d = *x - *y;
                sum += d * d / (p + q);
                terms += 1;
            }
        }
        terms > 0 && sum < logic.duplicate_distance * logic.duplicate_distance * T::from_count(terms)
    }

    /// Whether this track goes rather than `other`, if they are one: the tentative before the confirmed, then the younger.
    pub(crate) fn yields_to(&self, other: &Self) -> bool {
        (self.confirmed, other.id) < (other.confirmed, self.id)
    }
}

/// Gives out identities, each once. All zero bits at the start.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Identities {
    last: u32,
}

impl Identities {
    pub const fn new() -> Self {
        Self { last: 0 }
    }

    pub fn next(&mut self) -> Option<TrackId> {
        let id = NonZeroU32::new(self.last.checked_add(1)?)?;
        self.last = id.get();
        Some(TrackId(id))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const LAYOUT: Layout = Layout { axes: 1, stride: 2 };

    fn life(pattern: &str) -> Result<(Status, Change), ConfigError> {
        let logic = Logic::<f64>::new(3, 4, 2)?;
        let id = Identities::new().next().ok_or(ConfigError::BadWindow)?;
        let mut track = Track::<f64, 2, 1>::born(id, 1, ModeBank::ZERO);
        let mut last = Change::None;
        for c in pattern.chars() {
            last = track.observe(c == '1', &logic, LAYOUT);
        }
        Ok((track.status(), last))
    }

    #[test]
    fn tracks_are_confirmed_coast_and_go() {
        assert_eq!(life("1"), Ok((Status::Tentative, Change::None)));
        assert_eq!(life("11"), Ok((Status::Confirmed, Change::Confirmed)));
        assert_eq!(life("011"), Ok((Status::Confirmed, Change::Confirmed)));
        assert_eq!(life("110"), Ok((Status::Coasting, Change::None)));
        assert_eq!(life("1101"), Ok((Status::Confirmed, Change::None)));
        assert_eq!(life("00").map(|r| r.1), Ok(Change::Deleted));
        assert_eq!(life("1100").map(|r| r.1), Ok(Change::Deleted));
        assert_eq!(life("010").map(|r| r.1), Ok(Change::Deleted));
    }

    #[test]
    fn identities_are_never_given_twice() {
        let mut ids = Identities { last: u32::MAX - 1 };
        assert_eq!(ids.next().map(TrackId::number), Some(u32::MAX));
        assert_eq!(ids.next(), None);
        assert_eq!(ids.next(), None);
    }
}
