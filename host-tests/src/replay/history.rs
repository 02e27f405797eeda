//! What a tracker made of a recording: its tracks after every scan, in plain f64.
//!
//! A track counts as moving from the first scan on in which it is confirmed and has been `min_travel` or farther from
//! where it was born, |p - p_birth| >= min_travel: what stands still (land, moorings, the own ship's structure) is
//! tracked like anything else, so that its plots start nothing new, and told apart. Once moving, always moving.

use super::config::StateKind;
use crate::metrics::distance;
use boresight::scan::Report;
use boresight::track::Status;
use serde::Serialize;
use std::collections::BTreeMap;

/// What a tracker made of a recording.
#[derive(Debug, Clone, PartialEq)]
pub struct History {
    /// What the states of its tracks are.
    pub state: StateKind,
    /// The tracks after every scan that it took in.
    pub moments: Vec<Moment>,
    /// What all its steps did and gave up.
    pub counts: Counts,
}

/// The tracks after one scan.
#[derive(Debug, Clone, PartialEq)]
pub struct Moment {
    /// The scan's place in the recording.
    pub scan: usize,
    /// The scan's time \[us\].
    pub time_us: u64,
    /// All tracks, tentative ones too.
    pub tracks: Vec<Tracked>,
}

/// One track after one scan.
#[derive(Debug, Clone, PartialEq)]
pub struct Tracked {
    /// Its identity.
    pub id: u32,
    /// How far it is trusted.
    pub status: Status,
    /// Whether it is confirmed and has moved.
    pub moving: bool,
    /// x, the combined mean over all modes.
    pub mean: Vec<f64>,
    /// √P_ii.
    pub std: Vec<f64>,
    /// μ, the mode probabilities.
    pub modes: Vec<f64>,
}

/// The library's [`Report`], summed over all scans; of error bounds the largest.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize)]
#[expect(missing_docs, reason = "the names are the library's")]
pub struct Counts {
    pub detections: u64,
    pub detections_dropped: u64,
    pub detections_unclaimed: u64,
    pub seeds_dropped: u64,
    pub births: u64,
    pub births_refused: u64,
    pub tracks_evicted: u64,
    pub tracks_confirmed: u64,
    pub tracks_deleted: u64,
    pub duplicates_deleted: u64,
    pub numeric_resets: u64,
    pub clusters_bounded: u64,
    pub clusters_approximated: u64,
    pub clusters_infeasible: u64,
    pub association_error_bound: f32,
}

impl StateKind {
    /// (number of axes, states per axis)
    #[must_use]
    pub fn shape(self) -> (usize, usize) {
        match self {
            Self::Velocity2d => (2, 2),
            Self::Acceleration2d => (2, 3),
            Self::Velocity3d => (3, 2),
        }
    }

    /// The names of the states, in order.
    #[must_use]
    pub fn names(self) -> &'static [&'static str] {
        match self {
            Self::Velocity2d => &["x", "vx", "y", "vy"],
            Self::Acceleration2d => &["x", "vx", "ax", "y", "vy", "ay"],
            Self::Velocity3d => &["x", "vx", "y", "vy", "z", "vz"],
        }
    }
}

impl Tracked {
    /// The position \[m\], two or three coordinates.
    #[must_use]
    pub fn position(&self, state: StateKind) -> Vec<f64> {
        let (axes, stride) = state.shape();
        self.mean.iter().step_by(stride).take(axes).copied().collect()
    }

    /// Whether it is confirmed; one that coasts is.
    #[must_use]
    pub fn is_confirmed(&self) -> bool {
        self.status != Status::Tentative
    }
}

impl History {
    /// All tracks at all times.
    pub fn tracks(&self) -> impl Iterator<Item = &Tracked> {
        self.moments.iter().flat_map(|moment| &moment.tracks)
    }

    /// Marks the tracks that are confirmed and have moved.
    pub(super) fn tell_moving(&mut self, min_travel: f64) {
        // Where a track was born, and whether it has moved since.
        let mut lives: BTreeMap<u32, (Vec<f64>, bool)> = BTreeMap::new();
        for track in self.moments.iter_mut().flat_map(|moment| &mut moment.tracks) {
            let place = track.position(self.state);
            let (birth, moved) = lives.entry(track.id).or_insert_with(|| (place.clone(), false));
            *moved |= distance(birth, &place) >= min_travel;
            track.moving = *moved && track.is_confirmed();
        }
    }
}

impl Counts {
    /// Adds what one step reported.
    pub(super) fn add(&mut self, report: &Report) {
        self.detections += u64::from(report.detections);
        self.detections_dropped += u64::from(report.detections_dropped);
        self.detections_unclaimed += u64::from(report.detections_unclaimed);
        self.seeds_dropped += u64::from(report.seeds_dropped);
        self.births += u64::from(report.births);
        self.births_refused += u64::from(report.births_refused);
        self.tracks_evicted += u64::from(report.tracks_evicted);
        self.tracks_confirmed += u64::from(report.tracks_confirmed);
        self.tracks_deleted += u64::from(report.tracks_deleted);
        self.duplicates_deleted += u64::from(report.duplicates_deleted);
        self.numeric_resets += u64::from(report.numeric_resets);
        self.clusters_bounded += u64::from(report.clusters_bounded);
        self.clusters_approximated += u64::from(report.clusters_approximated);
        self.clusters_infeasible += u64::from(report.clusters_infeasible);
        self.association_error_bound = self.association_error_bound.max(report.association_error_bound);
    }
}

#[cfg(test)]
pub(super) mod tests {
    use super::*;

    /// A scan (number, time in s) with its tracks as (id, status, x, y).
    pub type Listed<'a> = (usize, u64, &'a [(u32, Status, f64, f64)]);

    /// A history of planar tracks.
    pub fn history(moments: &[Listed<'_>], min_travel: f64) -> History {
        let track = |&(id, status, x, y): &(u32, Status, f64, f64)| Tracked {
            id,
            status,
            moving: false,
            mean: vec![x, 1.0, y, 2.0],
            std: vec![0.5; 4],
            modes: vec![0.25, 0.75],
        };
        let moment =
            |&(scan, time_s, tracks): &Listed<'_>| Moment { scan, time_us: time_s * 1_000_000, tracks: tracks.iter().map(track).collect() };
        let moments = moments.iter().map(moment).collect();
        let mut history = History { state: StateKind::Velocity2d, moments, counts: Counts::default() };
        history.tell_moving(min_travel);
        history
    }

    #[test]
    fn a_track_moves_once_confirmed_and_away_from_its_birth() {
        use Status::{Coasting, Confirmed, Tentative};
        let history = history(
            &[
                (0, 0, &[(1, Tentative, 0.0, 0.0), (2, Tentative, 50.0, 0.0)]),
                (1, 1, &[(1, Tentative, 0.0, 12.0), (2, Confirmed, 53.0, 4.0)]),
                (2, 2, &[(1, Confirmed, 0.0, 4.0), (2, Coasting, 56.0, 8.0)]),
            ],
            10.0,
        );
        let moving: Vec<_> = history.tracks().filter(|track| track.moving).map(|track| (track.id, track.mean[2])).collect();
        assert_eq!(moving, [(1, 4.0), (2, 8.0)]);
    }
}
