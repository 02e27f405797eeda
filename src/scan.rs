//! Everything that goes into a tracker and comes out of it.

use crate::association::Completeness;
use crate::error::ScanError;
use crate::gaussian::{Gaussian, zero_vector};
use crate::scalar::Real;
use crate::symmetric::Symmetric;
use crate::time::{Duration, Instant};
use crate::track::{Change, Status, TrackId};
use nalgebra::SVector;

/// The largest offset of a detection from its scan, either way.
const MOST_OFFSET: u64 = 60_000_000;

/// One plot: a measurement of `NZ` coordinates.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Detection<T, const NZ: usize> {
    /// z, in the coordinates and units of its sensor
    pub z: SVector<T, NZ>,
    /// R of this detection, where it differs from the sensor's
    pub noise: Option<Symmetric<T, NZ>>,
    /// Strength, in any unit in which more is better: decides what is kept when a scan is too large
    pub amplitude: Option<T>,
    /// How long after the time of its scan it was made, at most a minute either way; negative is before
    pub offset: Duration,
}

impl<T: Real, const NZ: usize> Detection<T, NZ> {
    /// A measurement at the time of its scan, with its sensor's noise and no amplitude.
    #[must_use]
    pub const fn new(z: [T; NZ]) -> Self {
        let mut v = zero_vector();
        v.data.0[0] = z;
        Self { z: v, noise: None, amplitude: None, offset: Duration::ZERO }
    }

    /// The same with its own noise covariance.
    #[must_use]
    pub const fn with_noise(self, noise: Symmetric<T, NZ>) -> Self {
        Self { noise: Some(noise), ..self }
    }

    /// The same with its amplitude.
    #[must_use]
    pub const fn with_amplitude(self, amplitude: T) -> Self {
        Self { amplitude: Some(amplitude), ..self }
    }

    /// The same, made `offset` after the time of its scan: what a rotating radar saw in one of its sectors. The tracks stay
    /// at the time of the scan.
    ///
    /// Needs a sensor that tells where velocities stand ([`Layout`](crate::model::Layout)); with others it counts for
    /// nothing.
    #[must_use]
    pub const fn with_offset(self, offset: Duration) -> Self {
        Self { offset, ..self }
    }

    /// Whether it has its sensor's noise and the time of its scan.
    #[inline(always)]
    pub(crate) fn is_plain(&self) -> bool {
        self.noise.is_none() && self.offset == Duration::ZERO
    }

    fn check(&self) -> Result<(), ScanError> {
        if !(self.z.iter().all(|v| v.is_finite()) && self.amplitude.is_none_or(|a| a.is_finite())) {
            return Err(ScanError::DetectionNotFinite);
        }
        if self.offset.as_micros().unsigned_abs() > MOST_OFFSET {
            return Err(ScanError::OffsetTooLarge);
        }
        match &self.noise {
            Some(noise) if !noise.is_finite() => Err(ScanError::DetectionNotFinite),
            Some(noise) if !noise.is_definite() => Err(ScanError::NoiseNotDefinite),
            _ => Ok(()),
        }
    }
}

#[cfg(feature = "defmt")]
impl<T: Real + defmt::Format, const NZ: usize> defmt::Format for Detection<T, NZ> {
    fn format(&self, f: defmt::Formatter<'_>) {
        let Self { z, noise, amplitude, offset } = self;
        defmt::write!(f, "Detection {{ z: {}, noise: {}, amplitude: {}, offset: {} }}", z.data.0[0], noise, amplitude, offset);
    }
}

/// What one sensor saw at one time. An empty scan says that it looked and saw nothing.
#[derive(Clone, Copy, Debug)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Scan<'a, T, const NZ: usize> {
    /// When
    pub time: Instant,
    /// The plots, in any order
    pub detections: &'a [Detection<T, NZ>],
}

impl<'a, T: Real, const NZ: usize> Scan<'a, T, NZ> {
    /// The plots `detections` at `time`.
    #[must_use]
    pub const fn new(time: Instant, detections: &'a [Detection<T, NZ>]) -> Self {
        Self { time, detections }
    }

    /// Refuses what no tracker may take in.
    ///
    /// # Errors
    /// Time before `last`; coordinates, amplitudes or noise that are not finite; noise that is not definite; detections more
    /// than a minute from the time of the scan.
    pub fn check(&self, last: Option<Instant>) -> Result<(), ScanError> {
        if last.is_some_and(|last| self.time < last) {
            return Err(ScanError::TimeReversed);
        }
        self.detections.iter().try_for_each(Detection::check)
    }
}

/// Whether `a` gives way to `b`: by amplitude, none being the weakest.
#[inline(always)]
pub(crate) fn weaker<T: Real, const NZ: usize>(a: &Detection<T, NZ>, b: &Detection<T, NZ>) -> bool {
    match (a.amplitude, b.amplitude) {
        (Some(a), Some(b)) => a < b,
        (None, Some(_)) => true,
        (_, None) => false,
    }
}

/// The detections of a scan that a tracker with room for `DETS` takes: all, or the strongest, or the first.
#[derive(Clone, Debug)]
pub(crate) struct Selection<const DETS: usize> {
    /// Their numbers in the scan, ascending
    pub indices: heapless::Vec<u16, DETS>,
    pub dropped: u16,
    /// Whether none has a noise or a time of its own
    plain: bool,
}

impl<const DETS: usize> Selection<DETS> {
    /// Keeps by amplitude where given (none counts as the weakest), else by arrival; order of arrival is preserved.
    #[inline]
    pub fn new<T: Real, const NZ: usize>(detections: &[Detection<T, NZ>]) -> Self {
        let mut indices = heapless::Vec::<u16, DETS>::new();
        for (i, d) in detections.iter().enumerate().take(usize::from(u16::MAX)) {
            if indices.push(i as u16).is_ok() {
                continue;
            }
            let kept = indices.iter().filter_map(|k| Some((*k, detections.get(usize::from(*k))?)));
            // Of equals the last to arrive.
            let weakest = kept.reduce(|a, b| if weaker(a.1, b.1) { a } else { b });
            if let Some((k, kept)) = weakest
                && weaker(kept, d)
            {
                indices.retain(|index| *index != k);
                let _ = indices.push(i as u16);
            }
        }
        let dropped = detections.len() - indices.len();
        let plain = Candidates::new(detections, &indices).plain;
        Self { indices, dropped: u16::try_from(dropped).unwrap_or(u16::MAX), plain }
    }

    /// All of them.
    #[inline(always)]
    pub fn candidates(&self) -> Candidates<'_> {
        Candidates { numbers: &self.indices, plain: self.plain }
    }

    /// Finds the entries of `row`, one for each kept detection, by the number of the detection. Numbers must ascend from
    /// call to call, so that all calls together walk the row once.
    #[inline(always)]
    pub fn walk<'a, E>(&'a self, row: &'a mut [E]) -> impl FnMut(u16) -> Option<&'a mut E> {
        let mut entries = self.indices.iter().zip(row);
        move |number| entries.find(|(index, _)| **index == number).map(|(_, entry)| entry)
    }
}

/// The detections of a scan that may be a target's.
#[derive(Clone, Copy, Debug)]
pub struct Candidates<'a> {
    pub(crate) numbers: &'a [u16],
    /// Whether none has a noise or a time of its own: looked up once a scan, for all tracks
    pub(crate) plain: bool,
}

impl<'a> Candidates<'a> {
    /// Those of `detections` with the numbers `numbers`, which ascend. Numbers beyond the last are ignored.
    #[must_use]
    pub fn new<T: Real, const NZ: usize>(detections: &[Detection<T, NZ>], numbers: &'a [u16]) -> Self {
        let plain = |number: &u16| detections.get(usize::from(*number)).is_none_or(Detection::is_plain);
        Self { numbers, plain: numbers.iter().all(plain) }
    }
}

/// What is known of one target.
#[derive(Clone, Copy, Debug)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Estimate<T, const NX: usize> {
    /// Which track
    pub id: TrackId,
    /// How far it is trusted
    pub status: Status,
    /// The probability that the target exists; 1 unless the logic integrates it
    pub existence: T,
    /// The combined density over all modes
    pub state: Gaussian<T, NX>,
}

/// What a step did, and what it gave up for want of room. Nothing is lost that is not counted here.
#[non_exhaustive]
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Report {
    /// Detections taken in
    pub detections: u16,
    /// Detections beyond the capacity, given up by amplitude or by arrival
    pub detections_dropped: u16,
    /// Detections that no track gated
    pub detections_unclaimed: u16,
    /// Detections that could have become half of a two-point track, forgotten for want of room
    pub seeds_dropped: u16,
    /// Tracks started
    pub births: u16,
    /// Tracks not started for want of a slot or of an identity, or because they were not finite or too uncertain
    pub births_refused: u16,
    /// Tentative tracks that gave their slot to a birth
    pub tracks_evicted: u16,
    /// Tracks confirmed in this step
    pub tracks_confirmed: u16,
    /// Tracks deleted because they were no longer seen, or too uncertain
    pub tracks_deleted: u16,
    /// Tracks deleted because an older one follows the same target
    pub duplicates_deleted: u16,
    /// Corrections refused because they would have broken a covariance
    pub numeric_resets: u16,
    /// Clusters whose lightest joint events were given up
    pub clusters_bounded: u16,
    /// Clusters for which joint probabilities could only be approximated
    pub clusters_approximated: u16,
    /// Clusters without any possible joint event: their tracks count as not detected
    pub clusters_infeasible: u16,
    /// Pairs of tracks that the sensor may not tell apart, beyond the room for them: they count as resolved
    pub pairs_refused: u16,
    /// Every association probability of a bounded cluster is within this of the exact one
    pub association_error_bound: f32,
    /// A bound on the share of probability that hypotheses given up had; their L1 error is at most twice as large
    pub truncated_mass: f32,
}

impl Report {
    pub(crate) fn count(&mut self, change: Change) {
        let counter = match change {
            Change::None => return,
            Change::Confirmed => &mut self.tracks_confirmed,
            Change::Deleted => &mut self.tracks_deleted,
        };
        *counter = counter.saturating_add(1);
    }

    pub(crate) fn add(&mut self, completeness: Completeness) {
        self.clusters_bounded = completeness.bounded;
        self.clusters_approximated = completeness.approximated;
        self.clusters_infeasible = completeness.infeasible;
        self.association_error_bound = completeness.error_bound;
        self.pairs_refused = self.pairs_refused.saturating_add(completeness.pairs_refused);
    }

    /// Whether nothing was given up for want of room or precision.
    #[must_use]
    pub fn is_complete(&self) -> bool {
        self.detections_dropped == 0
            && self.seeds_dropped == 0
            && self.births_refused == 0
            && self.tracks_evicted == 0
            && self.numeric_resets == 0
            && self.clusters_bounded == 0
            && self.clusters_approximated == 0
            && self.clusters_infeasible == 0
            && self.truncated_mass == 0.0
            && self.pairs_refused == 0
    }
}
