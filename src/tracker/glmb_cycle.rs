//! The stages of a scan of [`JmsGlmb`]: prediction, births, events, and what the next scan's births may come from.

use super::jms_glmb::JmsGlmb;
use crate::gaussian::Gaussian;
use crate::glmb::{
    COUNTED, Density, GONE, Hypothesis, Label, Limits, Look, Pool, Problem, Row, Slot, Truncation, Unexplained, decode, encode, ln_add,
    ln_total,
};
use crate::initiation::locate;
use crate::mode::{LEAST_PROBABILITY, ModeSet};
use crate::order::sort;
use crate::scalar::{Real, exp, larger, ln};
use crate::sensor::Sensor;
use crate::time::Duration;
use rand_core::Rng;

/// What the births of a scan depend on.
pub(super) struct Arrivals<'a, T> {
    pub unexplained: &'a [Unexplained<T>],
    pub birth_scan: u32,
    /// Since the last scan
    pub gap: Option<Duration>,
}

/// Those that may be born in a scan.
pub(super) struct Births<T, const BIRTHS: usize> {
    /// Their rows, the most probable first
    pub places: heapless::Vec<u16, BIRTHS>,
    /// By how much the logarithm of the weight of all events is larger with those that there was no room for
    pub ln_given_up: T,
    /// Those whose density is not sound
    pub refused: u16,
}

impl<T: Real, const BIRTHS: usize> Births<T, BIRTHS> {
    pub const NONE: Self = Self { places: heapless::Vec::new(), ln_given_up: T::ZERO, refused: 0 };
}

fn alive<T: Real, const GATED: usize>(rows: &[Row<T, GATED>], place: u16) -> T {
    rows.get(usize::from(place)).map_or(T::ZERO, Row::alive)
}

impl<T: Real, M: ModeSet<T, NX, MODES>, A, const NX: usize, const MODES: usize, const BIRTHS: usize> JmsGlmb<T, M, A, NX, MODES, BIRTHS> {
    /// Between two scans at the same time nothing moves and no mode jumps.
    pub(super) fn predict<D: Density<T, NX, MODES>, R: Rng>(&self, tracks: &mut [Slot<T, D>], gap: Option<Duration>, rng: &mut R) {
        let Some(gap) = gap.filter(|gap| *gap != Duration::ZERO) else { return };
        let steps = self.modes.steps(gap.as_secs());
        for slot in tracks {
            slot.density.predict(&self.modes, &self.jump, &steps, rng);
        }
    }

    /// Writes the rows of all tracks. Returns how many tracks are gone because they are not sound.
    pub(super) fn write_rows<S, D, const NZ: usize, const GATED: usize>(
        &self,
        tracks: &[Slot<T, D>],
        rows: &mut [Row<T, GATED>],
        look: &mut Look<'_, S, T, NZ, MODES>,
        gap: Option<Duration>,
    ) -> u16
    where
        S: Sensor<T, NX, NZ>,
        D: Density<T, NX, MODES>,
    {
        let p_survive = if gap == Some(Duration::ZERO) { T::ONE } else { self.p_survive };
        let mut lost = 0u16;
        for (slot, row) in tracks.iter().zip(rows) {
            lost = lost.saturating_add(u16::from(!look.write(row, &slot.density, p_survive)));
        }
        lost
    }

    /// Writes slots and rows of those that may be born, from the place `first` on.
    pub(super) fn bear<S, D, R: Rng, const NZ: usize, const GATED: usize>(
        &self,
        slots: &mut [Slot<T, D>],
        rows: &mut [Row<T, GATED>],
        first: usize,
        arrivals: &Arrivals<'_, T>,
        look: &mut Look<'_, S, T, NZ, MODES>,
        rng: &mut R,
    ) -> Births<T, BIRTHS>
    where
        S: Sensor<T, NX, NZ>,
        D: Density<T, NX, MODES>,
    {
        let mut births = Births::<T, BIRTHS>::NONE;
        let mut bear = |index: usize, existence: T, g: &Gaussian<T, NX>, modes: &[T; MODES], dt: T| {
            let place = first + births.places.len();
            let Some((slot, row)) = slots.get_mut(place).zip(rows.get_mut(place)) else { return };
            slot.label = Label { birth_scan: arrivals.birth_scan, index: index as u16 };
            slot.density.bear(g, modes, rng);
            if dt > T::ZERO {
                slot.density.predict(&self.modes, &self.jump, &self.modes.steps(dt), rng);
            }
            if !look.write(row, &slot.density, existence) {
                births.refused = births.refused.saturating_add(1);
                return;
            }
            if births.places.push(place as u16).is_ok() {
                return;
            }
            // The least probable of those from detections gives way, or this one.
            COUNTED.looks.add(3 * births.places.len());
            let others = births.places.iter().copied().skip(self.regions.len());
            let weakest = others.reduce(|a, b| if alive(rows, b) < alive(rows, a) { b } else { a });
            let loser = weakest.filter(|weakest| alive(rows, *weakest) < alive(rows, place as u16)).map_or(place, usize::from);
            if let Some(row) = rows.get(loser) {
                births.ln_given_up += row.ln_total - row.outcome(GONE).map_or(T::ZERO, |o| o.ln_weight);
            }
            if let (Some((to, [from, ..])), true) = (rows.split_at_mut_checked(place), loser < place) {
                to.iter_mut().skip(loser).take(1).for_each(|to| to.clone_from(from));
            }
            if let (Some((to, [from, ..])), true) = (slots.split_at_mut_checked(place), loser < place) {
                to.iter_mut().skip(loser).take(1).for_each(|to| *to = *from);
            }
        };
        for (index, region) in self.regions.iter().enumerate() {
            bear(index, region.existence, &region.density, &region.modes, T::ZERO);
        }
        if let (Some(adaptive), Some(gap)) = (&self.adaptive, arrivals.gap) {
            let doubts = arrivals.unexplained.iter().fold(T::ZERO, |sum, seed| sum + seed.doubt);
            for seed in arrivals.unexplained.iter().filter(|seed| seed.doubt > T::ZERO) {
                let share = adaptive.expected * seed.doubt / doubts;
                let existence = if share < adaptive.most { share } else { adaptive.most };
                let g = adaptive.initiation.one_point(M::LAYOUT, &seed.fix);
                bear(self.regions.len() + usize::from(seed.place), existence, &g, &adaptive.modes, gap.as_secs());
            }
        }
        sort(&mut births.places, |a, b| alive(rows, *a) > alive(rows, *b) || alive(rows, *a) == alive(rows, *b) && a < b);
        births
    }

    /// Offers the events of all hypotheses to `pool`. Returns the logarithm of a bound on the weight of all that there are, and
    /// whether all were offered.
    pub(super) fn explore<R: Rng, const HYPS: usize, const LABELS: usize, const GATED: usize>(
        &self,
        parents: &Pool<T, LABELS, HYPS>,
        pool: &mut Pool<T, LABELS, HYPS>,
        rows: &[Row<T, GATED>],
        births: &[u16],
        memory: &mut A::Memory,
        rng: &mut R,
    ) -> (T, bool)
    where
        A: Truncation<T, LABELS>,
    {
        pool.clear();
        let none = -T::ONE / T::ZERO;
        let (mut ln_all, mut best, mut complete) = (none, none, true);
        let nothing_yet = [Hypothesis::EMPTY];
        for parent in if parents.all().is_empty() { &nothing_yet } else { parents.all() } {
            let mut chosen = heapless::Vec::<u16, LABELS>::from_slice(parent.tracks()).unwrap_or_default();
            let (mut ln_unborn, mut ln_base) = (T::ZERO, parent.ln_weight);
            for place in births {
                if chosen.push(*place).is_err()
                    && let Some(row) = rows.get(usize::from(*place))
                {
                    ln_unborn += row.ln_total;
                    // One that is born for certain goes all the same: some event must remain.
                    ln_base += larger(ln(T::lit(LEAST_PROBABILITY)), row.outcome(GONE).map_or(none, |o| o.ln_weight));
                    complete &= row.alive() <= T::ZERO;
                }
            }
            let problem = Problem { rows, chosen: &chosen };
            ln_all = ln_add(ln_all, parent.ln_weight + ln_unborn + ln_total(&problem));
            let ln_least = larger(pool.least(), best + self.ln_share) - ln_base;
            let limits = Limits { share: exp(parent.ln_weight), ln_least, ln_span: -self.ln_share };
            complete &= self.truncation.explore(&problem, &limits, memory, rng, |ln_weight, event| {
                let ln_weight = ln_base + ln_weight;
                best = larger(best, ln_weight);
                let alive = chosen.iter().zip(event).filter(|(_, choice)| **choice != GONE);
                pool.offer(Hypothesis::new(ln_weight, alive.map(|(row, choice)| encode::<GATED>(*row, *choice))));
            });
        }
        (ln_all, complete)
    }

    /// Keeps the detections that the next scan's births may come from.
    pub(super) fn remember<S, D, const NZ: usize, const GATED: usize, const DETS: usize>(
        &self,
        tracks: &[Slot<T, D>],
        rows: &[Row<T, GATED>],
        look: &Look<'_, S, T, NZ, MODES>,
        unexplained: &mut heapless::Vec<Unexplained<T>, DETS>,
    ) where
        S: Sensor<T, NX, NZ>,
    {
        unexplained.clear();
        if self.adaptive.is_none() {
            return;
        }
        for (place, number) in look.candidates.iter().enumerate() {
            let Some(detection) = look.detections.get(usize::from(*number)) else { break };
            let Some(fix) = locate(look.sight.sensor.model(), detection) else { continue };
            COUNTED.looks.add(tracks.len());
            let uses = tracks.iter().filter(|slot| {
                let (row, choice) = decode::<GATED>(slot.origin);
                rows.get(row).and_then(|row| row.outcome(choice)?.detection) == Some(*number)
            });
            let doubt = larger(T::ZERO, T::ONE - uses.fold(T::ZERO, |sum, slot| sum + slot.weight));
            let _ = unexplained.push(Unexplained { place: place as u16, fix, doubt });
        }
    }
}
