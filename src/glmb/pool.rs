//! Hypotheses: the heaviest that there is room for, every set of tracks once.
//!
//! ```text
//! full     a heap by weight, the lightest on top: it gives way to any that is heavier
//! once     sorted by their tracks, equal sets stand together and their weights add up
//! ```
//!
//! What is kept depends on weights alone, never on the order of arrival, unless weights are exactly equal.

use super::row::ln_add;
use super::work::COUNTED;
use crate::order::{sink, sort, swap};
use crate::scalar::{Real, exp, ln};

/// A set of targets, and how probable it is.
#[derive(Clone, Copy, Debug)]
pub struct Hypothesis<T, const LABELS: usize> {
    pub(crate) ln_weight: T,
    count: u16,
    tracks: [u16; LABELS],
}

impl<T: Real, const LABELS: usize> Hypothesis<T, LABELS> {
    const ZERO: Self = Self { ln_weight: T::ZERO, count: 0, tracks: [0; LABELS] };

    /// The empty set, for certain.
    pub(crate) const EMPTY: Self = Self::ZERO;

    /// Of tracks in any order; what is beyond the room is left out.
    pub(crate) fn new(ln_weight: T, tracks: impl Iterator<Item = u16>) -> Self {
        let mut new = Self { ln_weight, ..Self::ZERO };
        new.replace(tracks);
        new
    }

    /// The same weight for other tracks.
    pub(crate) fn replace(&mut self, tracks: impl Iterator<Item = u16>) {
        self.count = 0;
        for (place, track) in self.tracks.iter_mut().zip(tracks) {
            *place = track;
            self.count += 1;
        }
        if let Some(tracks) = self.tracks.get_mut(..usize::from(self.count)) {
            sort(tracks, |a, b| a < b);
        }
    }

    /// In ascending order.
    pub(crate) fn tracks(&self) -> &[u16] {
        self.tracks.get(..usize::from(self.count)).unwrap_or_default()
    }
}

/// Up to `HYPS` hypotheses.
#[derive(Clone, Debug)]
pub struct Pool<T, const LABELS: usize, const HYPS: usize> {
    hypotheses: [Hypothesis<T, LABELS>; HYPS],
    count: usize,
    /// Whether merging gains too little room to be tried again
    sealed: bool,
    /// Whether any was given up
    pub(crate) dropped: bool,
}

impl<T: Real, const LABELS: usize, const HYPS: usize> Pool<T, LABELS, HYPS> {
    /// None. All zero bits.
    pub(crate) const NEW: Self = Self { hypotheses: [Hypothesis::ZERO; HYPS], count: 0, sealed: false, dropped: false };

    pub(crate) fn clear(&mut self) {
        (self.count, self.sealed, self.dropped) = (0, false, false);
    }

    pub(crate) fn all(&self) -> &[Hypothesis<T, LABELS>] {
        self.hypotheses.get(..self.count).unwrap_or_default()
    }

    pub(crate) fn all_mut(&mut self) -> &mut [Hypothesis<T, LABELS>] {
        self.hypotheses.get_mut(..self.count).unwrap_or_default()
    }

    /// What is not heavier than this has no room; −∞ while there is some.
    pub(crate) fn least(&self) -> T {
        match self.all().first() {
            Some(lightest) if self.count == HYPS => lightest.ln_weight,
            _ => -T::ONE / T::ZERO,
        }
    }

    /// Takes `new`, or the lightest gives way to it, or it is given up. The pool is a heap until it is sorted. A full one is
    /// merged first, as long as that frees an eighth of it.
    pub(crate) fn offer(&mut self, new: Hypothesis<T, LABELS>) {
        if self.count == HYPS && !self.sealed {
            self.merge();
            self.sealed = HYPS - self.count <= HYPS / 8;
            for place in (0..self.count / 2).rev() {
                sink(self.all_mut(), place, &heavier);
            }
        }
        if self.count < HYPS {
            let mut place = self.count;
            self.count += 1;
            let heap = self.all_mut();
            heap.iter_mut().skip(place).take(1).for_each(|last| *last = new);
            while let Some(parent) = place.checked_sub(1).map(|child| child / 2)
                && heap.get(parent).is_some_and(|p| heavier(p, &new))
            {
                swap(heap, place, parent);
                place = parent;
            }
        } else {
            self.dropped = true;
            if let Some(lightest) = self.all_mut().first_mut()
                && heavier(&new, lightest)
            {
                *lightest = new;
                sink(self.all_mut(), 0, &heavier);
            }
        }
    }

    /// Adds up the weights of equal sets.
    pub(crate) fn merge(&mut self) {
        let all = self.all_mut();
        sort(all, |a, b| {
            COUNTED.comparisons.add(1);
            a.tracks() < b.tracks() || a.tracks() == b.tracks() && a.ln_weight > b.ln_weight
        });
        COUNTED.comparisons.add(all.len());
        let mut kept = 0;
        for place in 1..all.len() {
            let Some((before, &[next, ..])) = all.split_at_mut_checked(place).map(|(before, rest)| (before, &*rest)) else { break };
            if let Some(last) = before.get_mut(kept)
                && last.tracks() == next.tracks()
            {
                last.ln_weight = ln_add(last.ln_weight, next.ln_weight);
            } else {
                kept += 1;
                all.iter_mut().skip(kept).take(1).for_each(|free| *free = next);
            }
        }
        self.count = self.count.min(kept + 1);
    }

    /// Sorts by weight, heaviest first, and keeps `most` at most, and none below `ln_share` of the heaviest.
    pub(crate) fn cut(&mut self, most: usize, ln_share: T) {
        let all = self.all_mut();
        sort(all, |a, b| {
            COUNTED.comparisons.add(1);
            a.ln_weight > b.ln_weight || a.ln_weight == b.ln_weight && a.tracks() < b.tracks()
        });
        let least = all.first().map_or(T::ZERO, |best| best.ln_weight + ln_share);
        let heavy = all.partition_point(|h| h.ln_weight >= least).min(most);
        self.dropped |= heavy < self.count;
        self.count = heavy;
    }

    /// Keeps those for which `fits`, in order.
    pub(crate) fn retain(&mut self, mut fits: impl FnMut(&mut Hypothesis<T, LABELS>) -> bool) {
        let mut kept = 0;
        for place in 0..self.count {
            let Some(mut hypothesis) = self.all().get(place).copied() else { break };
            if fits(&mut hypothesis) {
                self.all_mut().iter_mut().skip(kept).take(1).for_each(|free| *free = hypothesis);
                kept += 1;
            }
        }
        self.dropped |= kept < self.count;
        self.count = kept;
    }

    /// Lets all weights sum to one. Returns ln of what they summed to.
    pub(crate) fn normalise(&mut self) -> T {
        let highest = self.all().iter().fold(-T::ONE / T::ZERO, |most, h| if h.ln_weight > most { h.ln_weight } else { most });
        let ln_sum = ln(self.all().iter().fold(T::ZERO, |sum, h| sum + exp(h.ln_weight - highest)));
        // In two steps: the heaviest may be far from one, and its logarithm coarse.
        self.all_mut().iter_mut().for_each(|h| h.ln_weight = h.ln_weight - highest - ln_sum);
        highest + ln_sum
    }
}

fn heavier<T: Real, const LABELS: usize>(a: &Hypothesis<T, LABELS>, b: &Hypothesis<T, LABELS>) -> bool {
    COUNTED.comparisons.add(1);
    a.ln_weight > b.ln_weight
}
