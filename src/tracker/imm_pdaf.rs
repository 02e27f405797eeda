//! IMM-PDAF: every track an interacting multiple model filter with probabilistic data association of its own.
//!
//! One scan, track by track:
//!
//! ```text
//! predict    c_j = Σ π_ij μ_i, mix, predict every mode          (mode)
//! gate       by the mode with the largest det S                 (evidence)
//! score      h_j = P_D Σ_r c_r L_jr / λ,  m = 1 − P_D P_G        (evidence)
//! associate  β from m and h: PDA, or nearest neighbour          (association)
//! absorb     modes and their probabilities by β                 (evidence)
//! manage     hit or miss, confirm, delete, duplicates           (track)
//! initiate   from detections that no track gated                (initiation)
//! ```
//!
//! Houles and Bar-Shalom, *IEEE Trans. AES* 25(2), 1989; Kashyap et al., *J. Aerospace Sciences and Technologies*
//! 58(2), 2006, corrected. Each target is associated as if it were alone: targets that share detections for long want
//! a joint association.
//!
//! # Cost
//! With t tracks, n detections offered and m = min(n, DETS) taken in, operations a scan are at most
//!
//! ```text
//! n DETS comparisons of amplitude  (only where n > DETS)
//! t (mixing, prediction, MODES innovations, m (1 + MODES) residual forms, MODES corrections, m² claims)
//! t m (1 + 2 MODES) factorisations of S  (only for detections with a noise of their own)
//! t² / 2 duplicate tests,  m DETS pairings, each of which may look through t slots
//! ```
//!
//! Memory: [`State`] is all there is, and its size is a constant.

use super::printed::{self, Outcome};
use crate::association::{Pda, SingleAssociator};
use crate::error::{ConfigError, ScanError};
use crate::evidence::{Evidence, innovations};
use crate::gaussian::Gaussian;
use crate::initiation::{Initiation, Rule, Seed};
use crate::mode::{JumpMatrix, ModeBank, ModeSet, check_distribution};
use crate::model::{Fix, Layout, MeasurementModel};
use crate::scalar::Real;
use crate::scan::{Detection, Estimate, Report, Scan, Selection};
use crate::sensor::Sensor;
use crate::time::{Duration, Instant};
use crate::track::{Change, Identities, Logic, Status, Track, TrackId};

/// A sensor that detects less often than this does not look at the track: no hit then is no miss.
const LEAST_P_DETECT: f64 = 0.05;

/// The configuration of an IMM-PDAF tracker, which no step changes.
///
/// `M` is a [`ModeSet`] of `MODES` models over `NX` states; `TRACKS` and `DETS` are the capacities; `A` associates.
/// With one mode it is the PDAF, with [`NearestNeighbour`](crate::association::NearestNeighbour) the nearest-neighbour
/// filter.
#[derive(Clone, Copy, Debug)]
pub struct ImmPdaf<T, M, const NX: usize, const MODES: usize, const TRACKS: usize, const DETS: usize, A = Pda> {
    modes: M,
    jump: JumpMatrix<T, MODES>,
    initial: [T; MODES],
    associator: A,
    logic: Logic<T>,
    initiation: Initiation<T, NX>,
}

/// All that an IMM-PDAF tracker remembers, and its scratch. All zero bits when new: a `static` costs no flash.
#[derive(Clone, Debug)]
pub struct State<T, const NX: usize, const MODES: usize, const TRACKS: usize, const DETS: usize> {
    time: Option<Instant>,
    ids: Identities,
    tracks: [Track<T, NX, MODES>; TRACKS],
    seeds: heapless::Vec<Seed<T>, DETS>,
    evidence: Evidence<T, MODES, DETS>,
    claimed: [bool; DETS],
}

impl<T: Real, const NX: usize, const MODES: usize, const TRACKS: usize, const DETS: usize> State<T, NX, MODES, TRACKS, DETS> {
    /// No tracks.
    #[must_use]
    pub const fn new() -> Self {
        Self {
            time: None,
            ids: Identities::new(),
            tracks: [Track::FREE; TRACKS],
            seeds: heapless::Vec::new(),
            evidence: Evidence::new(),
            claimed: [false; DETS],
        }
    }

    /// The live tracks, in slot order.
    pub fn tracks(&self) -> impl Iterator<Item = &Track<T, NX, MODES>> {
        self.tracks.iter().filter(|t| !t.is_free())
    }

    /// The track `id`, if it lives.
    #[must_use]
    pub fn track(&self, id: TrackId) -> Option<&Track<T, NX, MODES>> {
        self.tracks.iter().find(|t| t.id() == Some(id))
    }

    /// Deletes the track `id`. Returns whether it lived.
    pub fn remove(&mut self, id: TrackId) -> bool {
        match self.tracks.iter_mut().find(|t| t.id() == Some(id)) {
            Some(track) => {
                *track = Track::FREE;
                true
            }
            None => false,
        }
    }

    /// The combined estimates of all live tracks, computed as they are asked for.
    pub fn estimates(&self) -> impl Iterator<Item = Estimate<T, NX>> {
        self.tracks.iter().filter_map(|t| Some(Estimate { id: t.id()?, status: t.status(), state: t.bank().combined() }))
    }

    /// The time of the last scan.
    #[must_use]
    pub fn time(&self) -> Option<Instant> {
        self.time
    }
}

impl<T: Real, const NX: usize, const MODES: usize, const TRACKS: usize, const DETS: usize> Default for State<T, NX, MODES, TRACKS, DETS> {
    fn default() -> Self {
        Self::new()
    }
}

impl<T: Real, M: ModeSet<T, NX, MODES>, const NX: usize, const MODES: usize, const TRACKS: usize, const DETS: usize>
    ImmPdaf<T, M, NX, MODES, TRACKS, DETS>
{
    /// Modes, their jump matrix π (rows sum to one) and the mode probabilities of a new track. Tracks are started by
    /// the caller, see [`start`](Self::start), unless [`with_initiation`](Self::with_initiation) says otherwise.
    ///
    /// # Errors
    /// Where probabilities are none or do not sum to one.
    pub fn new(modes: M, jump: JumpMatrix<T, MODES>, initial: [T; MODES], logic: Logic<T>) -> Result<Self, ConfigError> {
        const { assert!(MODES >= 1 && TRACKS >= 1 && DETS >= 1 && DETS <= 65535, "every capacity must be at least one") }
        jump.iter().try_for_each(check_distribution)?;
        check_distribution(&initial)?;
        Ok(Self { modes, jump, initial, associator: Pda, logic, initiation: Initiation::off() })
    }
}

impl<T, M, A, const NX: usize, const MODES: usize, const TRACKS: usize, const DETS: usize> ImmPdaf<T, M, NX, MODES, TRACKS, DETS, A>
where
    T: Real,
    M: ModeSet<T, NX, MODES>,
    A: SingleAssociator<T>,
{
    /// The same tracker, starting tracks by itself.
    #[must_use]
    pub fn with_initiation(self, initiation: Initiation<T, NX>) -> Self {
        const { assert!(M::LAYOUT.axes >= 1, "these models do not tell where positions stand") }
        Self { initiation, ..self }
    }

    /// The same tracker with another association.
    #[must_use]
    pub fn with_associator<B: SingleAssociator<T>>(self, associator: B) -> ImmPdaf<T, M, NX, MODES, TRACKS, DETS, B> {
        let Self { modes, jump, initial, logic, initiation, .. } = self;
        ImmPdaf { modes, jump, initial, associator, logic, initiation }
    }

    /// Starts a confirmed track at `at`: a cue from elsewhere. `at` is the time of the last scan, or any before the first.
    /// `None` where all slots are taken (a cue does not evict), `at` is another time, or `g` is not finite or beyond the
    /// logic's position limit.
    pub fn start(&self, state: &mut State<T, NX, MODES, TRACKS, DETS>, g: Gaussian<T, NX>, at: Instant) -> Option<TrackId> {
        let bank = ModeBank::new(self.initial, g);
        if !bank.is_valid() || state.time.is_some_and(|time| time != at) {
            return None;
        }
        let slot = state.tracks.iter_mut().find(|t| t.is_free())?;
        let id = state.ids.next()?;
        let track = Track::cued(id, bank);
        if track.is_too_uncertain(&self.logic, M::LAYOUT) {
            return None;
        }
        *slot = track;
        state.time = Some(at);
        Some(id)
    }

    /// Takes in one scan of `sensor`. The tracks are then at the time of the scan.
    ///
    /// # Errors
    /// A scan that is older than the last or not finite, a sensor whose place or noise is not finite or whose gate was made
    /// for another dimension, is refused and the state stays as it was. Load is not an
    /// error: see [`Report`].
    pub fn step<S: Sensor<T, NX, NZ>, const NZ: usize>(
        &self,
        state: &mut State<T, NX, MODES, TRACKS, DETS>,
        sensor: &S,
        scan: &Scan<'_, T, NZ>,
    ) -> Result<Report, ScanError> {
        const {
            assert!(
                M::LAYOUT.agrees(<S::Model as MeasurementModel<T, NX, NZ>>::LAYOUT),
                "sensor and modes disagree on where positions stand"
            );
        }
        const { assert!(NX >= 1 && NZ >= 1, "states and measurements need at least one entry") }
        scan.check(state.time)?;
        if !sensor.model().is_finite() {
            return Err(ScanError::SensorNotFinite);
        }
        if sensor.gate().dimension() != NZ {
            return Err(ScanError::GateDimension);
        }
        let gap = state.time.map_or(Duration::ZERO, |last| scan.time.since(last));
        state.time = Some(scan.time);
        let selection = Selection::<DETS>::new(scan.detections);
        let mut report = Report {
            detections: u16::try_from(selection.indices.len()).unwrap_or(u16::MAX),
            detections_dropped: selection.dropped,
            ..Report::default()
        };
        self.predict(state, gap);
        state.claimed = [false; DETS];
        self.update(state, sensor, scan.detections, &selection, &mut report);
        self.delete_duplicates(state, &mut report);
        self.initiate(state, sensor, scan, &selection, &mut report);
        Ok(report)
    }

    /// Between two scans at the same time nothing moves and no mode jumps.
    #[inline(always)]
    fn predict(&self, state: &mut State<T, NX, MODES, TRACKS, DETS>, gap: Duration) {
        if gap == Duration::ZERO {
            return;
        }
        let dt = gap.as_secs::<T>();
        for track in state.tracks.iter_mut().filter(|t| !t.is_free()) {
            track.bank.interact(&self.jump);
            track.bank.predict(&self.modes, dt);
        }
    }

    #[inline(always)]
    fn update<S: Sensor<T, NX, NZ>, const NZ: usize>(
        &self,
        state: &mut State<T, NX, MODES, TRACKS, DETS>,
        sensor: &S,
        detections: &[Detection<T, NZ>],
        selection: &Selection<DETS>,
        report: &mut Report,
    ) {
        let State { tracks, evidence, claimed, .. } = state;
        let mut claim = |number: u16| {
            if let Some(slot) = selection.indices.iter().position(|i| *i == number)
                && let Some(claimed) = claimed.get_mut(slot)
            {
                *claimed = true;
            }
        };
        for track in tracks.iter_mut().filter(|t| !t.is_free()) {
            let candidates = &selection.indices;
            let looked = sensor.p_detect(&track.bank.modes[0].mean) > T::lit(LEAST_P_DETECT);
            let outcome = if A::COMBINED_INNOVATION {
                let update = printed::update::<T, S, A, NX, NZ, MODES, DETS>;
                update(&mut track.bank, sensor, &self.associator, detections, candidates, &mut claim)
            } else {
                let innovations = innovations(&track.bank, sensor.model());
                evidence.collect(&track.bank, &innovations, sensor, detections, candidates);
                evidence.gated().iter().copied().for_each(&mut claim);
                let (miss, weights) = evidence.weights();
                let beta_0 = self.associator.associate(miss, weights);
                let resets = evidence.absorb(beta_0, &mut track.bank, &innovations, sensor.model(), detections);
                Outcome { hit: beta_0 < T::lit(0.5), resets }
            };
            // A prediction over an absurd time may overflow: that track goes, and nothing else notices.
            let resets = outcome.resets + u16::from(!track.bank.is_valid());
            report.numeric_resets = report.numeric_resets.saturating_add(resets);
            let mut change = if resets > 0 { track.reset() } else { Change::None };
            if change == Change::None && (looked || outcome.hit) {
                change = track.observe(outcome.hit, &self.logic, M::LAYOUT);
            }
            report.count(change);
        }
    }

    /// Of two tracks on one target, the younger goes.
    fn delete_duplicates(&self, state: &mut State<T, NX, MODES, TRACKS, DETS>, report: &mut Report) {
        if !self.logic.deletes_duplicates() {
            return;
        }
        for i in 1..TRACKS {
            let (before, from) = state.tracks.split_at_mut(i);
            let Some(track) = from.first_mut() else { break };
            for other in before.iter_mut().filter(|t| !t.is_free()) {
                if track.is_free() {
                    break;
                }
                if track.is_duplicate_of(other, &self.logic, M::LAYOUT) {
                    let loser = if track.yields_to(other) { &mut *track } else { other };
                    *loser = Track::FREE;
                    report.duplicates_deleted = report.duplicates_deleted.saturating_add(1);
                }
            }
        }
    }

    /// Starts tracks from what no track gated.
    fn initiate<S: Sensor<T, NX, NZ>, const NZ: usize>(
        &self,
        state: &mut State<T, NX, MODES, TRACKS, DETS>,
        sensor: &S,
        scan: &Scan<'_, T, NZ>,
        selection: &Selection<DETS>,
        report: &mut Report,
    ) {
        if let Rule::TwoPoint { max_gap, .. } = self.initiation.rule {
            state.seeds.retain(|seed| scan.time.since(seed.time) <= max_gap);
        }
        for (slot, number) in selection.indices.iter().enumerate() {
            if state.claimed.get(slot).copied().unwrap_or(true) {
                continue;
            }
            report.detections_unclaimed = report.detections_unclaimed.saturating_add(1);
            let Some(fix) = self.locate(sensor, scan.detections.get(usize::from(*number))) else { continue };
            match self.initiation.rule {
                Rule::Off => {}
                Rule::OnePoint => self.bear(state, 1, self.initiation.one_point(M::LAYOUT, &fix), report),
                Rule::TwoPoint { max_speed, max_gap } => {
                    for k in 0..state.seeds.len() {
                        let Some(seed) = state.seeds.get(k) else { continue };
                        if let Some(dt) = seed.pairs_with(&fix, scan.time, M::LAYOUT, max_speed, max_gap) {
                            let g = self.initiation.two_points(M::LAYOUT, &seed.fix, &fix, dt);
                            self.bear(state, 2, g, report);
                            if let Some(claimed) = state.claimed.get_mut(slot) {
                                *claimed = true;
                            }
                        }
                    }
                }
            }
        }
        // Remembered only now: the order of the detections in a scan must not matter.
        if let Rule::TwoPoint { .. } = self.initiation.rule {
            for (slot, number) in selection.indices.iter().enumerate() {
                if state.claimed.get(slot) == Some(&false)
                    && let Some(fix) = self.locate(sensor, scan.detections.get(usize::from(*number)))
                {
                    remember(&mut state.seeds, Seed { time: scan.time, fix }, report);
                }
            }
        }
    }

    /// Where a detection stands, if it tells and somebody wants to know.
    fn locate<S: Sensor<T, NX, NZ>, const NZ: usize>(&self, sensor: &S, detection: Option<&Detection<T, NZ>>) -> Option<Fix<T>> {
        if self.initiation.rule == Rule::Off {
            return None;
        }
        let detection = detection?;
        let noise = detection.noise.unwrap_or_else(|| sensor.model().nominal_noise());
        sensor.model().locate(&detection.z, &noise)
    }

    /// A tentative track with `hits` detections behind it takes a free slot, or that of the tentative track that was missed
    /// most often in a row; where none was missed it is refused, as it is where it is not finite or too uncertain.
    fn bear(&self, state: &mut State<T, NX, MODES, TRACKS, DETS>, hits: u8, g: Gaussian<T, NX>, report: &mut Report) {
        let Some(born) = self.birth(state, hits, g) else {
            report.births_refused = report.births_refused.saturating_add(1);
            return;
        };
        let (slot, mut newborn) = born;
        let Some(track) = state.tracks.get_mut(slot) else { return };
        if !track.is_free() {
            report.tracks_evicted = report.tracks_evicted.saturating_add(1);
        }
        report.births = report.births.saturating_add(1);
        report.count(newborn.judge(&self.logic, M::LAYOUT));
        *track = newborn;
    }

    /// The slot and the track of a birth, if there is room, an identity and a sound density.
    fn birth(&self, state: &mut State<T, NX, MODES, TRACKS, DETS>, hits: u8, g: Gaussian<T, NX>) -> Option<(usize, Track<T, NX, MODES>)> {
        let bank = ModeBank::new(self.initial, g);
        let free = state.tracks.iter().position(|t| t.is_free());
        let slot = free.or_else(|| {
            let missed = state.tracks.iter().enumerate().filter(|(_, t)| t.status() == Status::Tentative && t.misses() > 0);
            missed.max_by_key(|(_, t)| t.misses()).map(|(slot, _)| slot)
        })?;
        if !bank.is_valid() || Track::cued(TrackId::FIRST, bank).is_too_uncertain(&self.logic, M::LAYOUT) {
            return None;
        }
        Some((slot, Track::born(state.ids.next()?, hits, bank)))
    }

    /// Where positions and velocities stand in the state.
    #[must_use]
    pub const fn layout(&self) -> Layout {
        M::LAYOUT
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
