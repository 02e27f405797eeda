//! Tracks begin: from detections that no track has gated, into a free slot or that of a doubtful track.
//!
//! ```text
//! one point    every unclaimed detection
//! two points   every unclaimed detection with every remembered one that a target could have caused as well
//! full         the tentative track goes that has lost most since its birth: misses in a row, or existence
//! ```

use super::picture::{Picture, Setup};
use crate::gaussian::Gaussian;
use crate::initiation::{Rule, Seed, locate};
use crate::mode::ModeSet;
use crate::scalar::Real;
use crate::scan::{Report, Scan, Selection};
use crate::sensor::Sensor;
use crate::track::Track;

impl<T: Real, const NX: usize, const MODES: usize, const TRACKS: usize, const DETS: usize> Picture<T, NX, MODES, TRACKS, DETS> {
    /// Starts tracks from what no track gated.
    pub fn initiate<S: Sensor<T, NX, NZ>, M: ModeSet<T, NX, MODES>, const NZ: usize>(
        &mut self,
        setup: &Setup<T, M, NX, MODES>,
        sensor: &S,
        scan: &Scan<'_, T, NZ>,
        selection: &Selection<DETS>,
        report: &mut Report,
    ) {
        let initiation = &setup.initiation;
        if let Rule::TwoPoint { max_gap, .. } = initiation.rule {
            self.seeds.retain(|seed| scan.time.since(seed.time) <= max_gap);
        }
        let fix = |number: &u16| match initiation.rule {
            Rule::Off => None,
            _ => locate(sensor.model(), scan.detections.get(usize::from(*number))?),
        };
        for (slot, number) in selection.indices.iter().enumerate() {
            if self.claimed.get(slot).copied().unwrap_or(true) {
                continue;
            }
            report.detections_unclaimed = report.detections_unclaimed.saturating_add(1);
            let Some(fix) = fix(number) else { continue };
            match initiation.rule {
                Rule::Off => {}
                Rule::OnePoint => self.bear(setup, 1, initiation.one_point(M::LAYOUT, &fix), report),
                Rule::TwoPoint { max_speed, max_gap } => {
                    for k in 0..self.seeds.len() {
                        let Some(seed) = self.seeds.get(k) else { continue };
                        if let Some(dt) = seed.pairs_with(&fix, scan.time, M::LAYOUT, max_speed, max_gap) {
                            let g = initiation.two_points(M::LAYOUT, &seed.fix, &fix, dt);
                            self.bear(setup, 2, g, report);
                            if let Some(claimed) = self.claimed.get_mut(slot) {
                                *claimed = true;
                            }
                        }
                    }
                }
            }
        }
        // Remembered only now: the order of the detections in a scan must not matter.
        if let Rule::TwoPoint { .. } = initiation.rule {
            for (number, claimed) in selection.indices.iter().zip(&self.claimed) {
                if !claimed && let Some(fix) = fix(number) {
                    remember(&mut self.seeds, Seed { time: scan.time, fix }, report);
                }
            }
        }
    }

    /// A tentative track with `hits` detections behind it takes a free slot, or that of the tentative track that has lost
    /// most; where none has lost anything it is refused, as it is where it is not finite or too uncertain.
    fn bear<M: ModeSet<T, NX, MODES>>(&mut self, setup: &Setup<T, M, NX, MODES>, hits: u8, g: Gaussian<T, NX>, report: &mut Report) {
        let Some((slot, mut newborn)) = self.birth(setup, hits, g) else {
            report.births_refused = report.births_refused.saturating_add(1);
            return;
        };
        let Some(track) = self.tracks.get_mut(slot) else { return };
        if !track.is_free() {
            report.tracks_evicted = report.tracks_evicted.saturating_add(1);
        }
        report.births = report.births.saturating_add(1);
        report.count(newborn.judge(&setup.logic, M::LAYOUT));
        *track = newborn;
    }

    /// The slot and the track of a birth, if there is room, an identity and a sound density.
    fn birth<M: ModeSet<T, NX, MODES>>(
        &mut self,
        setup: &Setup<T, M, NX, MODES>,
        hits: u8,
        g: Gaussian<T, NX>,
    ) -> Option<(usize, Track<T, NX, MODES>)> {
        let slot = self.tracks.iter().position(|t| t.is_free()).or_else(|| self.most_doubtful(setup))?;
        let bank = setup.bank(g)?;
        Some((slot, Track::born(self.ids.next()?, hits, &setup.logic, bank)))
    }

    /// The tentative track that has lost most since its birth; of equals the last.
    fn most_doubtful<M: ModeSet<T, NX, MODES>>(&self, setup: &Setup<T, M, NX, MODES>) -> Option<usize> {
        let losses = self.tracks.iter().enumerate().filter_map(|(slot, t)| Some((slot, t.loss(&setup.logic)?)));
        losses.reduce(|a, b| if b.1 >= a.1 { b } else { a }).map(|(slot, _)| slot)
    }
}

/// Keeps a detection that may become half of a track; the oldest gives way.
fn remember<T: Real, const DETS: usize>(seeds: &mut heapless::Vec<Seed<T>, DETS>, seed: Seed<T>, report: &mut Report) {
    let Err(seed) = seeds.push(seed) else { return };
    report.seeds_dropped = report.seeds_dropped.saturating_add(1);
    if let Some(oldest) = seeds.iter_mut().min_by_key(|s| s.time)
        && oldest.time < seed.time
    {
        *oldest = seed;
    }
}
