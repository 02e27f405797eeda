//! What the trackers of the JPDA family share: tracks with an identity each, their prediction, their life.
//!
//! ```text
//! predict    c_j = Σ π_ij μ_i, mix, predict every mode;  r ← r P(survives)    (mode, track)
//! conclude   hit or miss, confirm, delete                                     (track)
//! duplicates of two tracks on one target the younger goes                     (track)
//! initiate   from detections that no track gated                              (births.rs)
//! ```
//!
//! A tracker puts its association between the first two.

use crate::association::Gate;
use crate::error::{ConfigError, ScanError};
use crate::gaussian::Gaussian;
use crate::initiation::{Initiation, Seed};
use crate::mode::{JumpMatrix, ModeBank, ModeSet, check_distribution};
use crate::model::MeasurementModel;
use crate::scalar::Real;
use crate::scan::{Report, Scan, Selection};
use crate::sensor::{Clutter, Sensor};
use crate::time::{Duration, Instant};
use crate::track::{Change, Identities, Logic, Track, TrackId};
use nalgebra::SVector;

/// A sensor that detects less often than this does not look at the track: no hit then is no miss.
const LEAST_P_DETECT: f64 = 0.05;

/// What a tracker is told once: how targets move, and how tracks begin and end.
#[derive(Clone, Copy, Debug)]
pub(super) struct Setup<T, M, const NX: usize, const MODES: usize> {
    pub modes: M,
    pub jump: JumpMatrix<T, MODES>,
    pub initial: [T; MODES],
    pub logic: Logic<T>,
    pub initiation: Initiation<T, NX>,
}

impl<T: Real, M: ModeSet<T, NX, MODES>, const NX: usize, const MODES: usize> Setup<T, M, NX, MODES> {
    pub fn new(modes: M, jump: JumpMatrix<T, MODES>, initial: [T; MODES], logic: Logic<T>) -> Result<Self, ConfigError> {
        jump.iter().try_for_each(check_distribution)?;
        check_distribution(&initial)?;
        Ok(Self { modes, jump, initial, logic, initiation: Initiation::off() })
    }

    pub fn with_initiation(self, initiation: Initiation<T, NX>) -> Self {
        const { assert!(M::LAYOUT.axes >= 1, "these models do not tell where positions stand") }
        Self { initiation, ..self }
    }

    /// The modes of a new track at `g`; `None` where it is not sound, or too uncertain.
    pub fn bank(&self, g: Gaussian<T, NX>) -> Option<ModeBank<T, NX, MODES>> {
        let bank = ModeBank::new(self.initial, g);
        (bank.is_valid() && !self.logic.is_too_uncertain(&g, M::LAYOUT)).then_some(bank)
    }

    /// What a scan has made of a track that was updated.
    #[inline(never)]
    pub fn conclude(&self, track: &mut Track<T, NX, MODES>, outcome: Outcome, report: &mut Report) {
        // A prediction over an absurd time may overflow: that track goes, and nothing else notices.
        let resets = outcome.resets + u16::from(!track.bank.is_valid());
        report.numeric_resets = report.numeric_resets.saturating_add(resets);
        let mut change = if resets > 0 { track.reset() } else { Change::None };
        if change == Change::None {
            if outcome.looked || outcome.hit {
                track.observe(outcome.hit);
            }
            change = track.judge(&self.logic, M::LAYOUT);
        }
        report.count(change);
    }
}

/// What a scan says of one track.
#[derive(Clone, Copy, Debug)]
pub(super) struct Outcome {
    /// Whether the sensor looks there
    pub looked: bool,
    /// Whether a detection is more probably the target's than not, 1 − β_0 > ½
    pub hit: bool,
    /// Corrections refused
    pub resets: u16,
}

/// A sensor as a track meets it that exists with probability r: it is detected with r P_D.
#[derive(Clone, Copy, Debug)]
pub(super) struct Look<'a, S, T> {
    pub sensor: &'a S,
    /// r
    pub existence: T,
    /// What clutter of unknown density counts as
    pub diffuse: Clutter<T>,
}

impl<S, T: Real> Look<'_, S, T> {
    #[inline(always)]
    fn known(&self, clutter: Clutter<T>) -> Clutter<T> {
        match clutter {
            Clutter::Diffuse => self.diffuse,
            known => known,
        }
    }
}

impl<T: Real, S: Sensor<T, NX, NZ>, const NX: usize, const NZ: usize> Sensor<T, NX, NZ> for Look<'_, S, T> {
    type Model = S::Model;

    #[inline(always)]
    fn model(&self) -> &S::Model {
        self.sensor.model()
    }
    #[inline(always)]
    fn p_detect(&self, x: &SVector<T, NX>) -> T {
        self.existence * self.sensor.p_detect(x)
    }
    #[inline(always)]
    fn clutter(&self, z: &SVector<T, NZ>) -> Clutter<T> {
        self.known(self.sensor.clutter(z))
    }
    #[inline(always)]
    fn uniform_clutter(&self) -> Option<Clutter<T>> {
        self.sensor.uniform_clutter().map(|clutter| self.known(clutter))
    }
    #[inline(always)]
    fn gate(&self) -> &Gate<T> {
        self.sensor.gate()
    }
}

/// Whether a sensor that detects with `p_detect` looks there at all.
#[inline(always)]
pub(super) fn looks<T: Real>(p_detect: T) -> bool {
    p_detect > T::lit(LEAST_P_DETECT)
}

/// The tracks and what may become one.
#[derive(Clone, Debug)]
pub(super) struct Picture<T, const NX: usize, const MODES: usize, const TRACKS: usize, const DETS: usize> {
    pub time: Option<Instant>,
    pub ids: Identities,
    pub tracks: [Track<T, NX, MODES>; TRACKS],
    pub seeds: heapless::Vec<Seed<T>, DETS>,
    /// Which of the selected detections some track has gated.
    pub claimed: [bool; DETS],
}

impl<T: Real, const NX: usize, const MODES: usize, const TRACKS: usize, const DETS: usize> Picture<T, NX, MODES, TRACKS, DETS> {
    pub const fn new() -> Self {
        Self { time: None, ids: Identities::new(), tracks: [Track::FREE; TRACKS], seeds: heapless::Vec::new(), claimed: [false; DETS] }
    }

    /// A confirmed track from elsewhere, at the time of the last scan.
    pub fn start<M: ModeSet<T, NX, MODES>>(&mut self, setup: &Setup<T, M, NX, MODES>, g: Gaussian<T, NX>, at: Instant) -> Option<TrackId> {
        if self.time.is_some_and(|time| time != at) {
            return None;
        }
        let bank = setup.bank(g)?;
        let slot = self.tracks.iter_mut().find(|t| t.is_free())?;
        let id = self.ids.next()?;
        *slot = Track::cued(id, &setup.logic, bank);
        self.time = Some(at);
        Some(id)
    }

    /// Checks a scan, and brings all tracks to its time. The detections taken in, and the report to be filled in.
    #[inline(always)]
    pub fn open<S: Sensor<T, NX, NZ>, M: ModeSet<T, NX, MODES>, const NZ: usize>(
        &mut self,
        setup: &Setup<T, M, NX, MODES>,
        sensor: &S,
        scan: &Scan<'_, T, NZ>,
    ) -> Result<(Selection<DETS>, Report), ScanError> {
        self.open_by(setup, sensor, scan, Self::predict)
    }

    /// The same for tracks that `predict` brings to the time of the scan.
    #[inline(always)]
    pub fn open_by<S: Sensor<T, NX, NZ>, M: ModeSet<T, NX, MODES>, const NZ: usize>(
        &mut self,
        setup: &Setup<T, M, NX, MODES>,
        sensor: &S,
        scan: &Scan<'_, T, NZ>,
        predict: impl FnOnce(&mut Self, &Setup<T, M, NX, MODES>, Duration),
    ) -> Result<(Selection<DETS>, Report), ScanError> {
        const {
            assert!(
                M::LAYOUT.agrees(<S::Model as MeasurementModel<T, NX, NZ>>::LAYOUT),
                "sensor and modes disagree on where positions stand"
            );
        }
        const { assert!(NX >= 1 && NZ >= 1, "states and measurements need at least one entry") }
        scan.check(self.time)?;
        if !sensor.model().is_finite() {
            return Err(ScanError::SensorNotFinite);
        }
        if sensor.gate().dimension() != NZ {
            return Err(ScanError::GateDimension);
        }
        let gap = self.time.map_or(Duration::ZERO, |last| scan.time.since(last));
        self.time = Some(scan.time);
        self.claimed = [false; DETS];
        predict(self, setup, gap);
        let selection = Selection::new(scan.detections);
        let report = Report {
            detections: u16::try_from(selection.indices.len()).unwrap_or(u16::MAX),
            detections_dropped: selection.dropped,
            ..Report::default()
        };
        Ok((selection, report))
    }

    /// Between two scans at the same time nothing moves, no mode jumps and no target goes.
    // One copy for all sensors.
    #[inline(never)]
    fn predict<M: ModeSet<T, NX, MODES>>(&mut self, setup: &Setup<T, M, NX, MODES>, gap: Duration) {
        if gap == Duration::ZERO {
            return;
        }
        let dt = gap.as_secs::<T>();
        let (p_survive, steps) = (setup.logic.p_survive(dt), setup.modes.steps(dt));
        for track in self.tracks.iter_mut().filter(|t| !t.is_free()) {
            track.bank.interact(&setup.jump);
            track.bank.advance(&setup.modes, &steps);
            track.existence *= p_survive;
        }
    }

    /// What ends a scan: of two tracks on one target one goes, and detections that no track gated start others.
    #[inline(never)]
    pub fn close<S: Sensor<T, NX, NZ>, M: ModeSet<T, NX, MODES>, const NZ: usize>(
        &mut self,
        setup: &Setup<T, M, NX, MODES>,
        sensor: &S,
        scan: &Scan<'_, T, NZ>,
        selection: &Selection<DETS>,
        report: &mut Report,
    ) {
        self.delete_duplicates(setup, report);
        self.initiate(setup, sensor, scan, selection, report);
    }

    /// Of two tracks on one target, the younger goes.
    pub fn delete_duplicates<M: ModeSet<T, NX, MODES>>(&mut self, setup: &Setup<T, M, NX, MODES>, report: &mut Report) {
        if !setup.logic.deletes_duplicates() {
            return;
        }
        let likely: [usize; TRACKS] = core::array::from_fn(|i| self.tracks[i].bank.most_probable());
        for i in 1..TRACKS {
            let (before, from) = self.tracks.split_at_mut(i);
            let Some(track) = from.first_mut() else { break };
            for (other, mode) in before.iter_mut().zip(likely).filter(|(t, _)| !t.is_free()) {
                if track.is_free() {
                    break;
                }
                if track.is_duplicate_of(other, [likely[i], mode], &setup.logic, M::LAYOUT) {
                    let loser = if track.yields_to(other) { &mut *track } else { other };
                    *loser = Track::FREE;
                    report.duplicates_deleted = report.duplicates_deleted.saturating_add(1);
                }
            }
        }
    }
}
