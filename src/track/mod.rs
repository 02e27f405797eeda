//! A track and its life: tentative, confirmed, coasting, gone.
//!
//! The rules are in `track/logic.rs`: M-of-N, or integrated existence.
//!
//! A scan is a hit when the detections it gated are more probably the target's than not, 1 − β₀ > ½. A scan whose
//! sensor does not look at the track (P_D below 0.05) counts neither way. Identities are given once: when all 2³² − 1 are
//! used up, births are refused.

mod logic;

pub use logic::{Existence, Logic};

use crate::bytes::Digest;
use crate::gaussian::Gaussian;
use crate::mode::{ActiveSet, ModeBank};
use crate::model::Layout;
use crate::scalar::Real;
use crate::scan::Estimate;
use core::num::NonZeroU32;
use logic::Policy;

/// The identity of a track, never used for another.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct TrackId(pub(crate) NonZeroU32);

impl TrackId {
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

impl Status {
    /// As logs and messages write it; `None` for a byte that they never write.
    pub(crate) const fn from_byte(byte: u8) -> Option<Self> {
        match byte {
            0 => Some(Self::Tentative),
            1 => Some(Self::Confirmed),
            2 => Some(Self::Coasting),
            _ => None,
        }
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
    /// Whether the last scan may have seen it as one with another track.
    pub(crate) unresolved: bool,
    /// r, the probability that the target exists: 1 unless the logic integrates it.
    pub(crate) existence: T,
    pub(crate) bank: ModeBank<T, NX, MODES>,
}

impl<T: Real, const NX: usize, const MODES: usize> Track<T, NX, MODES> {
    /// A free slot.
    pub(crate) const FREE: Self =
        Self { id: 0, confirmed: false, history: 0, age: 0, resets: 0, unresolved: false, existence: T::ZERO, bank: ModeBank::ZERO };

    /// Born with `hits` hits behind it.
    pub(crate) fn born(id: TrackId, hits: u8, logic: &Logic<T>, bank: ModeBank<T, NX, MODES>) -> Self {
        let history = (1u32 << hits.min(31)) - 1;
        Self { id: id.number(), confirmed: false, history, age: hits, resets: 0, unresolved: false, existence: logic.at_birth(), bank }
    }

    /// Confirmed from the start: a cue from elsewhere.
    pub(crate) fn cued(id: TrackId, logic: &Logic<T>, bank: ModeBank<T, NX, MODES>) -> Self {
        let born = Self::born(id, 0, logic, bank);
        Self { confirmed: true, history: u32::MAX, age: u8::MAX, existence: logic.at_cue(), ..born }
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

    /// The modes that ran in the last scan: all, unless the tracker adapts them.
    #[must_use]
    pub fn active(&self) -> ActiveSet {
        self.bank.active()
    }

    /// Scans in a row without a hit.
    #[must_use]
    pub fn misses(&self) -> u32 {
        self.history.trailing_zeros().min(u32::from(self.age))
    }

    /// r, the probability that the target exists; 1 under M-of-N.
    #[must_use]
    pub fn existence(&self) -> T {
        self.existence
    }

    /// Whether the last scan may have seen the target as one with that of another track, by a sensor that states its
    /// [resolution](crate::sensor::Sensor::resolution).
    #[must_use]
    pub fn is_unresolved(&self) -> bool {
        self.unresolved
    }

    /// What is known of the target, all modes combined; `None` for a free slot.
    #[must_use]
    pub fn estimate(&self) -> Option<Estimate<T, NX>> {
        Some(Estimate { id: self.id()?, status: self.status(), existence: self.existence, state: self.bank.combined() })
    }

    /// Adds all of the track to `digest`.
    pub(crate) fn fold_into(&self, digest: &mut Digest) {
        let Self { id, confirmed, history, age, resets, existence, bank, unresolved } = self;
        digest.word(*id);
        digest.word(*history);
        digest.word(u32::from_le_bytes([(*confirmed).into(), *age, *resets, (*unresolved).into()]));
        digest.real(*existence);
        bank.prob.iter().for_each(|p| digest.real(*p));
        for g in &bank.modes {
            g.mean.iter().for_each(|x| digest.real(*x));
            digest.upper(&g.cov);
        }
    }

    pub(crate) fn is_free(&self) -> bool {
        self.id == 0
    }

    /// Takes in whether a scan that looked at the track saw it.
    pub(crate) fn observe(&mut self, hit: bool) {
        self.history = self.history << 1 | u32::from(hit);
        self.age = self.age.saturating_add(1);
    }

    /// Applies the rules to what is known.
    pub(crate) fn judge(&mut self, logic: &Logic<T>, layout: Layout) -> Change {
        let (lost, sure) = match logic.policy {
            Policy::Count { hits, window, misses } => {
                let seen = (self.history & u32::MAX >> (32 - u32::from(window))).count_ones();
                let looked = u32::from(self.age.min(window));
                let hopeless = !self.confirmed && looked - seen.min(looked) > u32::from(window - hits);
                (hopeless || self.misses() >= u32::from(misses), seen >= u32::from(hits))
            }
            Policy::Existence(rules) => (self.existence < rules.delete, self.existence > rules.confirm),
        };
        if lost || logic.is_too_uncertain(self.likely(), layout) {
            *self = Self::FREE;
            return Change::Deleted;
        }
        if !self.confirmed && sure {
            self.confirmed = true;
            return Change::Confirmed;
        }
        Change::None
    }

    /// How much a tentative track has lost since its birth: misses in a row, or existence. One that has lost nothing does
    /// not give way to another birth, nor does a confirmed one.
    pub(crate) fn loss(&self, logic: &Logic<T>) -> Option<T> {
        let loss = match logic.policy {
            Policy::Count { .. } => T::from_count(self.misses() as usize),
            Policy::Existence(rules) => rules.birth - self.existence,
        };
        (!self.confirmed && loss > T::ZERO).then_some(loss)
    }

    /// Counts a correction that was refused. The second one deletes the track.
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
        self.mode(self.bank.most_probable())
    }

    fn mode(&self, number: usize) -> &Gaussian<T, NX> {
        self.bank.modes.get(number).unwrap_or(&self.bank.modes[0])
    }

    /// Whether `other` follows the same target, by the logic's distance between their most probable modes, whose numbers `likely`
    /// tells: the mean of the squared differences of position and velocity in all axes, each over the sum of its variances. Two
    /// confirmed tracks that a sensor may not tell apart are close for that reason.
    pub(crate) fn is_duplicate_of(&self, other: &Self, likely: [usize; 2], logic: &Logic<T>, layout: Layout) -> bool {
        let (a, b) = (self.mode(likely[0]), other.mode(likely[1]));
        let most = logic.duplicate_distance * logic.duplicate_distance * T::from_count(2 * layout.axes);
        let mut sum = T::ZERO;
        for i in (0..layout.axes).flat_map(|axis| [axis * layout.stride, axis * layout.stride + 1]) {
            let (Some(x), Some(y), Some(p), Some(q)) = (a.mean.get(i), b.mean.get(i), a.cov.get(i, i), b.cov.get(i, i)) else {
                return false;
            };
            let (d, variance) = (*x - *y, p + q);
            // One entry tells most tracks apart, without a division.
            if d * d >= most * variance {
                return false;
            }
            sum += d * d / variance;
        }
        let two = || self.unresolved && other.unresolved && self.confirmed && other.confirmed;
        sum < most && !two()
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

    /// As if `last` had been given out.
    #[cfg(test)]
    pub const fn after(last: u32) -> Self {
        Self { last }
    }

    /// The number given out last.
    pub const fn last(&self) -> u32 {
        self.last
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
    use crate::error::ConfigError;

    const LAYOUT: Layout = Layout { axes: 1, stride: 2 };

    fn life(pattern: &str) -> Result<(Status, Change), ConfigError> {
        let logic = Logic::<f64>::new(3, 4, 2)?;
        let id = Identities::new().next().ok_or(ConfigError::BadWindow)?;
        let mut track = Track::<f64, 2, 1>::born(id, 1, &logic, ModeBank::ZERO);
        let mut last = Change::None;
        for c in pattern.chars() {
            track.observe(c == '1');
            last = track.judge(&logic, LAYOUT);
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
        let mut ids = Identities::after(u32::MAX - 1);
        assert_eq!(ids.next().map(TrackId::number), Some(u32::MAX));
        assert_eq!(ids.next(), None);
        assert_eq!(ids.next(), None);
    }
}
