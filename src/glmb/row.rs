//! What may become of one target in one scan, and the events that a hypothesis has for all of its targets.
//!
//! ```text
//! gone      1 − P_S            for a target that may be born: 1 − r, it is not
//! missed    P_S m              r m
//! detection P_S M_j / κ(z_j)   r M_j / κ(z_j)
//! an event  chooses one of these for every target, and no detection twice;  its weight is the product
//! ```
//!
//! The weights of a row are divided by their sum, which is kept as a logarithm: products of any number of them stay in
//! range.

use super::work::COUNTED;
use crate::order::bring;
use crate::scalar::{Real, exp, is_finite, larger, ln};
use rand_core::Rng;

/// The target is gone, or was not born.
pub(crate) const GONE: u16 = 0;
/// It exists and was not detected.
pub(crate) const MISSED: u16 = 1;
/// It was detected by the first detection of its row; others follow.
pub(crate) const FIRST_HIT: u16 = 2;

/// A choice in every row of a [`Problem`].
pub type Event<'a> = &'a [u16];

/// What is in a place of a table where nothing is.
pub(crate) const NO_TRACK: u16 = u16::MAX;

/// One choice of a row.
#[derive(Clone, Copy, Debug)]
pub struct Outcome<T> {
    /// The detection by its number in the scan
    pub(crate) detection: Option<u16>,
    /// The track that comes of it, where a hypothesis has one
    pub(crate) child: u16,
    pub(crate) ln_weight: T,
    /// The share of the row
    pub(crate) share: T,
}

impl<T: Real> Outcome<T> {
    const fn new(detection: Option<u16>, ln_weight: T) -> Self {
        Self { detection, child: NO_TRACK, ln_weight, share: T::ZERO }
    }
}

/// What may become of one target.
#[derive(Clone, Debug)]
pub struct Row<T, const GATED: usize> {
    /// Gone, missed
    fates: [Outcome<T>; 2],
    /// The heaviest detections, heaviest first
    hits: heapless::Vec<Outcome<T>, GATED>,
    /// The share of those that there was no room for
    pub(super) rest: T,
    /// ln of the sum of all weights
    pub(crate) ln_total: T,
}

/// ln(e^a + e^b)
pub(crate) fn ln_add<T: Real>(a: T, b: T) -> T {
    let (high, low) = if a > b { (a, b) } else { (b, a) };
    if is_finite(low) { high + ln(T::ONE + exp(low - high)) } else { high }
}

impl<T: Real, const GATED: usize> Row<T, GATED> {
    /// All zero bits: no target.
    pub(crate) const ZERO: Self = Self {
        fates: [Outcome { detection: None, child: 0, ln_weight: T::ZERO, share: T::ZERO }; 2],
        hits: heapless::Vec::new(),
        rest: T::ZERO,
        ln_total: T::ZERO,
    };

    /// From the logarithms of the weights, and detections by number.
    pub(crate) fn fill(&mut self, ln_gone: T, ln_missed: T, ln_hits: impl Iterator<Item = (u16, T)>) {
        self.fates = [Outcome::new(None, ln_gone), Outcome::new(None, ln_missed)];
        self.hits.clear();
        let mut ln_rest = -T::ONE / T::ZERO;
        for (detection, ln_weight) in ln_hits {
            let place = self.hits.partition_point(|other| other.ln_weight >= ln_weight);
            COUNTED.looks.add(1 + self.hits.len() - place);
            if self.hits.is_full() {
                let lightest = if place < GATED { self.hits.pop().map_or(ln_weight, |hit| hit.ln_weight) } else { ln_weight };
                ln_rest = ln_add(ln_rest, lightest);
            }
            if self.hits.push(Outcome::new(Some(detection), ln_weight)).is_ok() {
                let last = self.hits.len() - 1;
                bring(&mut self.hits, last, place);
            }
        }
        let highest = self.outcomes().fold(ln_rest, |most, o| larger(most, o.ln_weight));
        let total = self.outcomes().fold(exp(ln_rest - highest), |sum, o| sum + exp(o.ln_weight - highest));
        let scale = T::ONE / total;
        self.ln_total = highest + ln(total);
        // Never nothing where there was something, however light.
        self.rest = if is_finite(ln_rest) { larger(T::LEAST, exp(ln_rest - highest) * scale) } else { T::ZERO };
        self.fates.iter_mut().chain(&mut self.hits).for_each(|o| o.share = exp(o.ln_weight - highest) * scale);
    }

    /// The choices in order: gone, missed, detections.
    pub(crate) fn outcomes(&self) -> impl Iterator<Item = &Outcome<T>> + Clone {
        self.fates.iter().chain(&self.hits)
    }

    pub(crate) fn outcome(&self, choice: u16) -> Option<&Outcome<T>> {
        match choice.checked_sub(FIRST_HIT) {
            None => self.fates.get(usize::from(choice)),
            Some(place) => self.hits.get(usize::from(place)),
        }
    }

    pub(crate) fn outcome_mut(&mut self, choice: u16) -> Option<&mut Outcome<T>> {
        match choice.checked_sub(FIRST_HIT) {
            None => self.fates.get_mut(usize::from(choice)),
            Some(place) => self.hits.get_mut(usize::from(place)),
        }
    }

    /// The detections of the row.
    pub(crate) fn hits(&self) -> &[Outcome<T>] {
        &self.hits
    }

    /// Whether there was no room for all detections.
    pub(crate) fn is_crowded(&self) -> bool {
        self.rest > T::ZERO
    }

    /// Whether the detection `number` is one of the row's.
    pub(crate) fn gates(&self, number: u16) -> bool {
        self.hits.iter().any(|hit| hit.detection == Some(number))
    }

    /// Whether any hypothesis goes on with a track of it.
    pub(crate) fn lives_on(&self) -> bool {
        self.outcomes().any(|o| o.child != NO_TRACK)
    }

    /// The share of all in which the target exists.
    pub(crate) fn alive(&self) -> T {
        T::ONE - self.fates[0].share
    }
}

/// The rows of one hypothesis.
#[derive(Clone, Copy, Debug)]
pub struct Problem<'a, T, const GATED: usize> {
    /// What may become of every target of the table
    pub(crate) rows: &'a [Row<T, GATED>],
    /// Those that the hypothesis has, and those that may be born
    pub(crate) chosen: &'a [u16],
}

impl<'a, T: Real, const GATED: usize> Problem<'a, T, GATED> {
    /// The rows in order.
    pub(crate) fn rows(&self) -> impl Iterator<Item = &'a Row<T, GATED>> + Clone + use<'a, T, GATED> {
        let rows = self.rows;
        self.chosen.iter().filter_map(move |row| rows.get(usize::from(*row)))
    }

    pub(crate) fn row(&self, place: usize) -> Option<&'a Row<T, GATED>> {
        self.rows.get(usize::from(*self.chosen.get(place)?))
    }

    /// The logarithm of the weight of an event.
    pub(crate) fn ln_weight(&self, event: Event<'_>) -> T {
        self.rows().zip(event).filter_map(|(row, choice)| row.outcome(*choice)).fold(T::ZERO, |sum, o| sum + o.ln_weight)
    }
}

/// Which events are worth the search.
#[derive(Clone, Copy, Debug)]
pub struct Limits<T> {
    /// The weight of the hypothesis
    pub(crate) share: T,
    /// The logarithm of the least weight that has room
    pub(crate) ln_least: T,
    /// How far events may be below the best of their hypothesis
    pub(crate) ln_span: T,
}

/// How the events of a hypothesis are found that are worth keeping.
pub trait Truncation<T: Real, const LABELS: usize> {
    /// What it needs. All zero bits when new.
    type Memory: Clone + core::fmt::Debug;
    /// New memory.
    const MEMORY: Self::Memory;

    /// Calls `found` with events of `problem`, each once, and the logarithms of their weights: none that `limits` excludes.
    /// Returns whether these were all events that there are.
    fn explore<R: Rng, const GATED: usize>(
        &self,
        problem: &Problem<'_, T, GATED>,
        limits: &Limits<T>,
        memory: &mut Self::Memory,
        rng: &mut R,
        found: impl FnMut(T, Event<'_>),
    ) -> bool;
}
