//! Track lists of several sensors made one picture: registered, brought to one time, associated, fused.
//!
//! One update:
//!
//! ```text
//! predict   lists older than the latest, by their modes, to its time;  those older than max_age go
//! keep      members of a fused track, in the order of the sensors, while d² from what the ones before make is ≤ part
//! join      sensor by sensor: its tracks that are alone, with fused tracks that have none of that sensor, by the assignment
//!           of the least Σ d² + join · (tracks left alone), pairs only with d² ≤ join
//! open      a fused track for every track that is left
//! fuse      members in the order of the sensors, by the rule; mode probabilities by their geometric mean
//! ```
//!
//! d² is that of [`distance`] on position and velocity, the fused estimate against the newcomer's.
//!
//! # Life and identity
//! With join < part, tracks that have been found together stay so while their distance wanders between the two. Of tracks that
//! part, the first in the order of the sensors keeps the identity; of fused tracks that join, the older identity stays. When a
//! sensor loses its track, or its list grows too old, the fused track lives on with the rest. The order of the tracks in a list
//! means nothing: they are known by their identities, which a tracker gives once. A list with the same identity twice keeps the
//! first.
//!
//! # Cost
//! What an update takes at most is in `work.rs`, and [`Combiner::worst_case`] has the numbers. Most updates take much less: lists of
//! the same time need no prediction, only tracks that are alone are tested and assigned, and a far pair costs a few operations. Two
//! lists of t tracks that stay paired take t tests and t fusions. What is received is registered, 2 MODES NX³ multiply-adds a
//! track, and looked for among the tracks of its list.
//!
//! Association with three sensors and more is one assignment after another, in the order of the sensors: all at once would be a
//! problem without a polynomial bound.

use super::correlated::{distance, is_beyond};
use super::picture::{FusedPicture, FusedTrack, List, ListError, LocalTrack};
use super::registration::Frame;
use super::rules::{Rule, fuse_probabilities};
use super::work::{COUNTED, FusionWork};
use crate::error::ConfigError;
use crate::gaussian::Gaussian;
use crate::mode::{JumpMatrix, ModeBank, ModeSet, check_distribution};
use crate::scalar::Real;
use crate::time::{Duration, Instant};
use crate::track::TrackId;

/// How track lists become one picture: the configuration, which no update changes.
///
/// `M` is the [`ModeSet`] of the trackers that send the lists.
#[derive(Clone, Copy, Debug)]
pub struct Combiner<T, M, const NX: usize, const MODES: usize> {
    modes: M,
    jump: JumpMatrix<T, MODES>,
    rule: Rule<T>,
    limits: Limits<T>,
}

/// When tracks are one target's.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Limits<T> {
    /// Tracks join where d² is at most this: a quantile of χ², with two degrees of freedom an axis
    pub join: T,
    /// Tracks part where d² is beyond this, not below `join`
    pub part: T,
    /// How long a list counts without a newer one of its sensor
    pub max_age: Duration,
}

/// What an update did, and what was given up for want of room. Nothing is lost that is not counted here.
#[non_exhaustive]
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct FusionReport {
    /// Fused tracks there are now
    pub tracks: u16,
    /// Fused tracks with a new identity
    pub created: u16,
    /// Fused tracks that no sensor follows any more
    pub ended: u16,
    /// Sensors' tracks that have joined a fused track of others
    pub joined: u16,
    /// Sensors' tracks that have parted from the others of their fused track
    pub parted: u16,
    /// Tracks beyond the capacity of a list
    pub tracks_dropped: u16,
    /// Tracks that are not sound, tell an identity twice, or found all fused tracks taken, or all identities given
    pub tracks_refused: u16,
    /// Lists that were too old
    pub lists_expired: u16,
    /// Tracks left out of an estimate because the rule had no result
    pub fusions_refused: u16,
}

impl FusionReport {
    /// Whether nothing was given up for want of room or precision.
    #[must_use]
    pub fn is_complete(&self) -> bool {
        self.tracks_dropped == 0 && self.tracks_refused == 0 && self.fusions_refused == 0
    }
}

impl<T: Real, M: ModeSet<T, NX, MODES>, const NX: usize, const MODES: usize> Combiner<T, M, NX, MODES> {
    /// The modes and jump matrix of the trackers, the rule to fuse by, and when tracks are one target's.
    ///
    /// # Errors
    /// Where a row of `jump` is no distribution, the weight of the rule none, 0 < `join` ≤ `part` does not hold, or the age is not
    /// positive.
    pub fn new(modes: M, jump: JumpMatrix<T, MODES>, rule: Rule<T>, limits: Limits<T>) -> Result<Self, ConfigError> {
        jump.iter().try_for_each(check_distribution)?;
        if !(limits.join.is_finite() && limits.part.is_finite()) {
            return Err(ConfigError::NotFinite);
        }
        if limits.join <= T::ZERO || limits.max_age <= Duration::ZERO {
            return Err(ConfigError::NotPositive);
        }
        if limits.part < limits.join {
            return Err(ConfigError::BadThresholds);
        }
        Ok(Self { modes, jump, rule: rule.check()?, limits })
    }

    /// The most work that an [`update`](Self::update) can make.
    #[must_use]
    pub const fn worst_case<const SENSORS: usize, const TRACKS: usize>() -> FusionWork {
        FusionWork::worst_case::<T>(SENSORS, TRACKS, MODES)
    }

    /// Takes in all tracks that `sensor` has at `time`, in its `frame`. They replace its list before; the fused tracks change
    /// with the next [`update`](Self::update). An empty list says that the sensor lives and follows nothing.
    ///
    /// # Errors
    /// A sensor that there is no room for, or a list older than its last.
    pub fn receive<'a, const SENSORS: usize, const TRACKS: usize>(
        &self,
        picture: &mut FusedPicture<T, NX, MODES, SENSORS, TRACKS>,
        sensor: usize,
        frame: &Frame<T>,
        time: Instant,
        tracks: impl IntoIterator<Item = (TrackId, &'a ModeBank<T, NX, MODES>)>,
    ) -> Result<(), ListError>
    where
        T: 'a,
    {
        const { assert!(M::LAYOUT.axes >= 1, "these models do not tell where positions stand") }
        let list = picture.lists.get_mut(sensor).ok_or(ListError::UnknownSensor)?;
        if list.sent.is_some_and(|sent| time < sent) {
            return Err(ListError::TimeReversed);
        }
        *list = List { sent: Some(time), time, ..List::EMPTY };
        for (id, bank) in tracks {
            let mut track = LocalTrack { id: id.number(), bank: *bank };
            frame.register_bank(&mut track.bank, M::LAYOUT);
            if !track.bank.is_valid() || list.find(track.id).is_some() {
                picture.refused = picture.refused.saturating_add(1);
            } else if !list.push(track) {
                picture.dropped = picture.dropped.saturating_add(1);
            }
        }
        Ok(())
    }

    /// Makes the fused tracks of all lists, at the time of the latest.
    pub fn update<const SENSORS: usize, const TRACKS: usize>(
        &self,
        picture: &mut FusedPicture<T, NX, MODES, SENSORS, TRACKS>,
    ) -> FusionReport {
        let mut report = FusionReport { tracks_dropped: picture.dropped, tracks_refused: picture.refused, ..FusionReport::default() };
        (picture.dropped, picture.refused) = (0, 0);
        self.synchronise(picture, &mut report);
        for fused in picture.fused.iter_mut().filter(|fused| !fused.is_empty()) {
            self.assemble(&picture.lists, fused, Some(self.limits.part), &mut report);
            if fused.is_empty() {
                *fused = FusedTrack::FREE;
                report.ended = report.ended.saturating_add(1);
            }
        }
        for sensor in 0..SENSORS {
            self.join(picture, sensor, &mut report);
            self.open(picture, sensor, &mut report);
        }
        conclude(picture, &mut report);
        report
    }

    /// Brings every list to the time of the latest.
    fn synchronise<const SENSORS: usize, const TRACKS: usize>(
        &self,
        picture: &mut FusedPicture<T, NX, MODES, SENSORS, TRACKS>,
        report: &mut FusionReport,
    ) {
        let Some(latest) = picture.time() else { return };
        for list in &mut picture.lists {
            let live = list.tracks.iter().any(|track| track.id != 0);
            if list.sent.is_some_and(|sent| latest.since(sent) > self.limits.max_age) {
                report.lists_expired = report.lists_expired.saturating_add(u16::from(live));
                list.tracks = List::EMPTY.tracks;
            }
            let gap = latest.since(list.time);
            list.time = latest;
            if gap <= Duration::ZERO {
                continue;
            }
            let steps = self.modes.steps(gap.as_secs());
            for track in list.tracks.iter_mut().filter(|track| track.id != 0) {
                COUNTED.predictions.add(MODES);
                track.bank.interact(&self.jump);
                track.bank.advance(&self.modes, &steps);
                if !track.bank.is_valid() {
                    *track = LocalTrack::FREE;
                    report.tracks_refused = report.tracks_refused.saturating_add(1);
                }
            }
        }
    }

    /// Fuses the members of a track in the order of the sensors. Those that are gone leave it, and those beyond `limit` from
    /// what the ones before make.
    fn assemble<const SENSORS: usize, const TRACKS: usize>(
        &self,
        lists: &[List<T, NX, MODES, TRACKS>; SENSORS],
        fused: &mut FusedTrack<T, NX, MODES, SENSORS>,
        limit: Option<T>,
        report: &mut FusionReport,
    ) {
        let (mut state, mut newcomer): (Option<Gaussian<T, NX>>, _) = (None, Gaussian::ZERO);
        for (list, member) in lists.iter().zip(&mut fused.members).filter(|(_, member)| **member != 0) {
            let Some(track) = list.find(*member) else {
                *member = 0;
                continue;
            };
            COUNTED.combinations.add(1);
            track.bank.combine(&mut newcomer);
            let Some(before) = &state else {
                state = Some(newcomer);
                continue;
            };
            let apart = |limit| distance(before, &newcomer, M::LAYOUT).is_none_or(|d| d.square > limit);
            if limit.is_some_and(apart) {
                *member = 0;
                report.parted = report.parted.saturating_add(1);
            } else if let Some(made) = self.rule.fuse(before, &newcomer) {
                state = Some(made);
            } else {
                report.fusions_refused = report.fusions_refused.saturating_add(1);
            }
        }
        fused.state = state.unwrap_or(Gaussian::ZERO);
        let members = lists.iter().zip(&fused.members).filter_map(|(list, member)| list.find(*member));
        fused.prob = fuse_probabilities(members.map(|track| &track.bank.prob));
    }

    /// The tracks of `sensor` that are alone, each with the fused track of others that it is assigned to.
    fn join<const SENSORS: usize, const TRACKS: usize>(
        &self,
        picture: &mut FusedPicture<T, NX, MODES, SENSORS, TRACKS>,
        sensor: usize,
        report: &mut FusionReport,
    ) {
        let FusedPicture { lists, fused, squares, assignment, .. } = picture;
        let Some(list) = lists.get(sensor) else { return };
        let (join, never) = (self.limits.join, T::ONE / T::ZERO);
        let (mut any, mut state) = (false, Gaussian::ZERO);
        for (track, row) in list.tracks.iter().zip(squares.iter_mut()) {
            *row = [never; TRACKS];
            COUNTED.looks.add(TRACKS);
            let accompanied = |f: &FusedTrack<T, NX, MODES, SENSORS>| f.member(sensor) == track.id && f.members().count() > 1;
            if track.id == 0 || fused.iter().any(accompanied) {
                continue;
            }
            COUNTED.combinations.add(1);
            COUNTED.looks.add(TRACKS);
            track.bank.combine(&mut state);
            let others = fused.iter().zip(row).filter(|(f, _)| !f.is_empty() && f.member(sensor) == 0);
            for (other, square) in others.filter(|(f, _)| !is_beyond(&f.state, &state, M::LAYOUT, join)) {
                if let Some(d) = distance(&other.state, &state, M::LAYOUT).filter(|d| d.square <= join) {
                    (*square, any) = (d.square, true);
                }
            }
        }
        let pair = |row, column| {
            COUNTED.pairs.add(1);
            -entry(squares, row, column)
        };
        if !any || !assignment.solve(TRACKS, TRACKS, |_| -join, pair) {
            return;
        }
        for (row, track) in list.tracks.iter().enumerate() {
            let Some(column) = assignment.column(row) else { continue };
            COUNTED.looks.add(TRACKS);
            // Where it was alone before, that fused track ends, and its identity goes with the track.
            let old = fused.iter_mut().find(|f| f.member(sensor) == track.id);
            let id = old.map_or(0, |old| core::mem::replace(old, FusedTrack::FREE).id);
            if let Some(target) = fused.get_mut(column) {
                target.take_older_id(id);
                target.set_member(sensor, track.id);
                self.assemble(lists, target, None, report);
                report.joined = report.joined.saturating_add(1);
            }
        }
    }

    /// A fused track for every track of `sensor` that is in none.
    fn open<const SENSORS: usize, const TRACKS: usize>(
        &self,
        picture: &mut FusedPicture<T, NX, MODES, SENSORS, TRACKS>,
        sensor: usize,
        report: &mut FusionReport,
    ) {
        let FusedPicture { lists, fused, .. } = picture;
        let homeless = |track: &&LocalTrack<T, NX, MODES>| track.id != 0;
        for track in lists.get(sensor).into_iter().flat_map(|list| &list.tracks).filter(homeless) {
            COUNTED.looks.add(2 * TRACKS);
            if fused.iter().any(|f| f.member(sensor) == track.id) {
                continue;
            }
            let Some(free) = fused.iter_mut().find(|f| f.is_empty()) else {
                report.tracks_refused = report.tracks_refused.saturating_add(1);
                continue;
            };
            free.set_member(sensor, track.id);
            self.assemble(lists, free, None, report);
        }
    }
}

/// Entry (`row`, `column`), infinite outside.
fn entry<T: Real, const N: usize>(matrix: &[[T; N]; N], row: usize, column: usize) -> T {
    matrix.get(row).and_then(|row| row.get(column)).copied().unwrap_or(T::ONE / T::ZERO)
}

/// Gives identities to what is new. When all have been given, nothing new is made.
fn conclude<T: Real, const NX: usize, const MODES: usize, const SENSORS: usize, const TRACKS: usize>(
    picture: &mut FusedPicture<T, NX, MODES, SENSORS, TRACKS>,
    report: &mut FusionReport,
) {
    let FusedPicture { fused, ids, .. } = picture;
    for fused in fused.iter_mut().filter(|fused| !fused.is_empty()) {
        if fused.id == 0 {
            let Some(id) = ids.next() else {
                *fused = FusedTrack::FREE;
                report.tracks_refused = report.tracks_refused.saturating_add(1);
                continue;
            };
            fused.id = id.number();
            report.created = report.created.saturating_add(1);
        }
        report.tracks = report.tracks.saturating_add(1);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::model::motion::{ConstantVelocity, ProcessNoise};
    use crate::symmetric::Symmetric;
    use crate::track::Identities;
    use nalgebra::SVector;

    #[test]
    fn without_identities_left_nothing_new_is_made_and_that_is_told() {
        let model = ConstantVelocity::<f32, 1>::new(ProcessNoise::Discrete(1.0));
        let limits = Limits { join: 9.0, part: 16.0, max_age: Duration::from_millis(5000) };
        let combiner = model.and_then(|model| Combiner::new([model], [[1.0]], Rule::NaiveConvex, limits));
        let mut picture = FusedPicture::<f32, 2, 1, 1, 4>::new();
        picture.ids = Identities::after(u32::MAX - 1);
        let at = |x: f32| ModeBank::new([1.0], Gaussian::new(SVector::from([x, 0.0]), Symmetric::from_diagonal([1.0; 2])));
        let (near, far) = (at(0.0), at(1000.0));
        let mut ids = Identities::new();
        let list = [&near, &far].map(|bank| (ids.next(), bank));
        let tracks = || list.iter().filter_map(|(id, bank)| Some(((*id)?, *bank)));
        for created in [1, 0] {
            let report = combiner.as_ref().ok().map(|combiner| {
                let taken = combiner.receive(&mut picture, 0, &Frame::COMMON, Instant::ZERO, tracks());
                (taken, combiner.update(&mut picture))
            });
            let seen = report.map(|(taken, r)| (taken, r.tracks, r.created, r.tracks_refused, r.is_complete()));
            assert_eq!(seen, Some((Ok(()), 1, created, 1, false)));
            assert_eq!(picture.tracks().count(), 1);
        }
    }
}
