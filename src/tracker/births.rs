//! Tracks begin: from detections that no track has gated, into a free slot or that of a doubtful track.
//!
//! ```text
//! one point    every unclaimed detection
//! two points   every unclaimed detection with every remembered one that a target could have caused as well
//! full         the tentative track goes that has lost most since its birth: misses in a row, or existence
//! ```

use super::picture::{Picture, Setup};
use crate::initiation::{Rule, Seed, locate};
use crate::mode::ModeSet;
use crate::model::Fix;
use crate::scalar::Real;
use crate::scan::{Report, Scan, Selection};
use crate::sensor::Sensor;
use crate::track::{Identities, Track};

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
        let Self { tracks, ids, seeds, claimed, .. } = self;
        if let Rule::TwoPoint { max_gap, .. } = initiation.rule {
            seeds.retain(|seed| scan.time.since(seed.time) <= max_gap);
        }
        let fix = |number: &u16| match initiation.rule {
            Rule::Off => None,
            _ => locate(sensor.model(), scan.detections.get(usize::from(*number))?),
        };
        let mut cradle = Cradle::new(tracks, ids, setup);
        for (number, claimed) in selection.indices.iter().zip(&mut *claimed).filter(|(_, claimed)| !**claimed) {
            report.detections_unclaimed = report.detections_unclaimed.saturating_add(1);
            let Some(fix) = fix(number) else { continue };
            match initiation.rule {
                Rule::Off => {}
                Rule::OnePoint => cradle.bear(&fix, None, report),
                Rule::TwoPoint { max_speed, max_gap } => {
                    for seed in seeds.iter() {
                        if let Some(dt) = seed.pairs_with(&fix, scan.time, M::LAYOUT, max_speed, max_gap) {
                            cradle.bear(&fix, Some((&seed.fix, dt)), report);
                            *claimed = true;
                        }
                    }
                }
            }
        }
        // Remembered only now: the order of the detections in a scan must not matter.
        if let Rule::TwoPoint { .. } = initiation.rule {
            for (number, claimed) in selection.indices.iter().zip(claimed) {
                if !*claimed && let Some(fix) = fix(number) {
                    remember(seeds, Seed { time: scan.time, fix }, report);
                }
            }
        }
    }
}

/// Where tracks are born: the slots, and which of them the next one takes.
struct Cradle<'a, T, M, const NX: usize, const MODES: usize> {
    tracks: &'a mut [Track<T, NX, MODES>],
    ids: &'a mut Identities,
    setup: &'a Setup<T, M, NX, MODES>,
    room: Option<usize>,
}

impl<'a, T: Real, M: ModeSet<T, NX, MODES>, const NX: usize, const MODES: usize> Cradle<'a, T, M, NX, MODES> {
    fn new(tracks: &'a mut [Track<T, NX, MODES>], ids: &'a mut Identities, setup: &'a Setup<T, M, NX, MODES>) -> Self {
        let mut cradle = Self { tracks, ids, setup, room: None };
        cradle.look_for_room();
        cradle
    }

    /// A tentative track of the detection `fix`, and of the `first` so many seconds before it. It is refused where there is no
    /// room, or where it is not finite or too uncertain.
    fn bear(&mut self, fix: &Fix<T>, first: Option<(&Fix<T>, T)>, report: &mut Report) {
        // In a crowded scan most pairs find no room: no density is made for them.
        if self.room.and_then(|slot| self.fill(slot, fix, first, report)).is_none() {
            report.births_refused = report.births_refused.saturating_add(1);
        }
    }

    // Out of line: one copy for both rules.
    #[inline(never)]
    fn fill(&mut self, slot: usize, fix: &Fix<T>, first: Option<(&Fix<T>, T)>, report: &mut Report) -> Option<()> {
        let Setup { initiation, logic, .. } = self.setup;
        let (hits, g) = match first {
            None => (1, initiation.one_point(M::LAYOUT, fix)),
            Some((first, dt)) => (2, initiation.two_points(M::LAYOUT, first, fix, dt)),
        };
        let bank = self.setup.bank(g)?;
        let (track, id) = (self.tracks.get_mut(slot)?, self.ids.next()?);
        if !track.is_free() {
            report.tracks_evicted = report.tracks_evicted.saturating_add(1);
        }
        report.births = report.births.saturating_add(1);
        *track = Track::born(id, hits, logic, bank);
        report.count(track.judge(logic, M::LAYOUT));
        self.look_for_room();
        Some(())
    }

    /// A free slot, or that of the tentative track that has lost most since its birth, of equals the last; none where none has
    /// lost anything. Only a birth changes it.
    #[inline(never)]
    fn look_for_room(&mut self) {
        self.room = self.tracks.iter().position(|t| t.is_free()).or_else(|| {
            let losses = self.tracks.iter().enumerate().filter_map(|(slot, t)| Some((slot, t.loss(&self.setup.logic)?)));
            losses.reduce(|a, b| if b.1 >= a.1 { b } else { a }).map(|(slot, _)| slot)
        });
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
