//! The tracks of one scan, and the hypotheses made of them.
//!
//! ```text
//! in the making   a track is a pair of a row and a choice in it: (label, history of detections) of the table before, and what
//!                 the scan adds to it.  One number for a pair, so hypotheses that mean the same compare equal
//! kept            every pair that a hypothesis needs gets a place; the density of its row absorbs the choice, once
//! ```

use super::Label;
use super::density::Density;
use super::look::Look;
use super::pool::Pool;
use super::row::{NO_TRACK, Row};
use super::work::COUNTED;
use crate::scalar::{Real, exp};
use crate::sensor::Sensor;
use rand_core::Rng;

/// A track: a label and a history of detections, which any number of hypotheses share.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Slot<T, D> {
    pub label: Label,
    /// The weights of the hypotheses that have it
    pub weight: T,
    /// The pair that it came of
    pub origin: u16,
    pub density: D,
}

/// Tracks and hypotheses.
#[derive(Clone, Debug)]
pub(crate) struct Generation<T, D, const SLOTS: usize, const HYPS: usize, const LABELS: usize> {
    pub slots: [Slot<T, D>; SLOTS],
    pub count: usize,
    pub pool: Pool<T, LABELS, HYPS>,
}

/// The number of a pair.
pub(crate) fn encode<const GATED: usize>(row: u16, choice: u16) -> u16 {
    row.wrapping_mul(GATED as u16 + 1).wrapping_add(choice.wrapping_sub(1))
}

/// The row and the choice behind a number.
pub(crate) fn decode<const GATED: usize>(number: u16) -> (usize, u16) {
    let number = usize::from(number);
    (number / (GATED + 1), (number % (GATED + 1)) as u16 + 1)
}

impl<T: Real, D, const SLOTS: usize, const HYPS: usize, const LABELS: usize> Generation<T, D, SLOTS, HYPS, LABELS> {
    /// The tracks.
    pub fn tracks(&self) -> &[Slot<T, D>] {
        self.slots.get(..self.count).unwrap_or_default()
    }

    pub fn tracks_mut(&mut self) -> &mut [Slot<T, D>] {
        self.slots.get_mut(..self.count).unwrap_or_default()
    }

    /// Gives a place to every track that a hypothesis has, the heaviest hypothesis first; where there is no room for all tracks of
    /// one, it is given up. `births` places and one more stay free.
    pub fn assign<const GATED: usize>(&mut self, rows: &mut [Row<T, GATED>], births: usize) {
        let Self { slots, count, pool } = self;
        *count = 0;
        let place = |rows: &[Row<T, GATED>], number: u16| {
            let (row, choice) = decode::<GATED>(number);
            rows.get(row).and_then(|row| row.outcome(choice)).map_or(NO_TRACK, |o| o.child)
        };
        pool.retain(|hypothesis| {
            COUNTED.looks.add(3 * hypothesis.tracks().len());
            let wanted = hypothesis.tracks().iter().filter(|number| place(rows, **number) == NO_TRACK).count();
            if *count + wanted + births >= SLOTS {
                return false;
            }
            for number in hypothesis.tracks() {
                let (row, choice) = decode::<GATED>(*number);
                if let Some(outcome) = rows.get_mut(row).and_then(|row| row.outcome_mut(choice))
                    && outcome.child == NO_TRACK
                    && let Some(slot) = slots.get_mut(*count)
                {
                    (outcome.child, slot.origin) = (*count as u16, *number);
                    *count += 1;
                }
            }
            let known = *hypothesis;
            hypothesis.replace(known.tracks().iter().map(|number| place(rows, *number)));
            true
        });
    }

    /// Lets every track absorb what it was chosen for, from its density in `parents`. Returns how many corrections were refused.
    pub fn absorb<S, R: Rng, const NX: usize, const NZ: usize, const MODES: usize, const GATED: usize>(
        &mut self,
        parents: &[Slot<T, D>],
        rows: &[Row<T, GATED>],
        look: &Look<'_, S, T, NZ, MODES>,
        rng: &mut R,
    ) -> u16
    where
        S: Sensor<T, NX, NZ>,
        D: Density<T, NX, MODES>,
    {
        let mut resets = 0u16;
        for child in self.tracks_mut() {
            let (row, choice) = decode::<GATED>(child.origin);
            let Some(parent) = parents.get(row) else { break };
            let number = rows.get(row).and_then(|row| row.outcome(choice)?.detection);
            let detection = number.and_then(|number| look.detections.get(usize::from(number)));
            child.label = parent.label;
            resets = resets.saturating_add(parent.density.absorb(&mut child.density, &look.sight, detection, rng));
        }
        resets
    }

    /// Adds up for every track the weights of the hypotheses that have it.
    pub fn weigh(&mut self) {
        let Self { slots, pool, .. } = self;
        slots.iter_mut().for_each(|slot| slot.weight = T::ZERO);
        for hypothesis in pool.all() {
            let weight = exp(hypothesis.ln_weight);
            COUNTED.looks.add(hypothesis.tracks().len());
            for track in hypothesis.tracks() {
                slots.iter_mut().skip(usize::from(*track)).take(1).for_each(|slot| slot.weight += weight);
            }
        }
    }
}
