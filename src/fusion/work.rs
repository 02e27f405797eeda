//! The most work that one update of a picture can make, by kinds of operation.
//!
//! With S sensors, t = TRACKS in every list and in the picture, and r modes:
//!
//! ```text
//! predictions    (S − 1) t r                of one mode, mixing included: lists older than the latest
//! combinations   t (S (S + 3) / 2 + 1)      of the modes of a track: to be tested, and as a member
//! tests          (S − 1) t (t + 1)          d² of two estimates: members that are kept, and pairs that may join
//! fusions        t S (S − 1) / 2            of two estimates
//! slopes         14 a fusion                where a weight is searched for; 29 in double precision
//! pairs          S t² (t + 3)               looked at by the assignments
//! looks          S t² (S + 7)               at tracks of a list and fused tracks, for an identity or for room
//! ```
//!
//! A fused track is made anew for every member that joins, at worst of 1, 2, … S members in turn; one slot may hold two tracks in
//! an update, the first of a single member. Pairs are tested in S passes, but for each slot not in that of a sensor that it has a
//! member of. At most (S − 1) t tracks join: those of one sensor never share a fused track.

use crate::counter::Counter;

/// Numbers of operations.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct FusionWork {
    /// Predictions of one mode, mixing included
    pub predictions: u64,
    /// Combinations of all modes of a track
    pub combinations: u64,
    /// Tests whether two estimates are of one target
    pub tests: u64,
    /// Fusions of two estimates, but for the search of a weight
    pub fusions: u64,
    /// Steps of that search
    pub slopes: u64,
    /// Pairs that the assignments look at
    pub pairs: u64,
    /// Looks at tracks
    pub looks: u64,
}

impl FusionWork {
    /// The most of an update of `tracks` fused tracks from the lists of `sensors` sensors in scalars of `T`, by the formula of
    /// this file.
    #[must_use]
    pub const fn worst_case<T>(sensors: usize, tracks: usize, modes: usize) -> Self {
        let (s, t, r) = (sensors as u64, tracks as u64, modes as u64);
        let others = s.saturating_sub(1);
        let fusions = t * s * others / 2;
        // Halvings of 0..=1 down to 2 √ε, one more, and both ends.
        let search = if size_of::<T>() > 4 { 29 } else { 14 };
        Self {
            predictions: others * t * r,
            combinations: t * (s * (s + 3) / 2 + 1),
            tests: others * t * (t + 1),
            fusions,
            slopes: search * fusions,
            pairs: s * t * t * (t + 3),
            looks: s * t * t * (s + 7),
        }
    }

    /// All operations.
    #[must_use]
    pub const fn steps(&self) -> u64 {
        let Self { predictions, combinations, tests, fusions, slopes, pairs, looks } = *self;
        predictions + combinations + tests + fusions + slopes + pairs + looks
    }
}

/// What is counted in a build with the feature `count`.
pub(super) struct Counters {
    pub predictions: Counter,
    pub combinations: Counter,
    pub tests: Counter,
    pub fusions: Counter,
    pub slopes: Counter,
    pub pairs: Counter,
    pub looks: Counter,
}

pub(super) static COUNTED: Counters = Counters {
    predictions: Counter::new(),
    combinations: Counter::new(),
    tests: Counter::new(),
    fusions: Counter::new(),
    slopes: Counter::new(),
    pairs: Counter::new(),
    looks: Counter::new(),
};

/// Takes the operations that were counted since the last call, in all threads.
#[cfg(feature = "count")]
pub fn take_work() -> FusionWork {
    let Counters { predictions, combinations, tests, fusions, slopes, pairs, looks } = &COUNTED;
    let [predictions, combinations, tests, fusions, slopes, pairs, looks] =
        [predictions, combinations, tests, fusions, slopes, pairs, looks].map(|counter| counter.take() as u64);
    FusionWork { predictions, combinations, tests, fusions, slopes, pairs, looks }
}
