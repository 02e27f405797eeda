//! What the fusion of track lists remembers: the last list of every sensor, and fused tracks with an identity each.
//!
//! ```text
//! list     of a sensor: its tracks, in the common frame, at one time
//! fused    identity;  members: of every sensor one track or none;  x, P;  mode probabilities
//! ```
//!
//! A fused track holds no knowledge of its own. It is made of its members, anew whenever they change, and lives as long as one of
//! them does: what a sensor has said is never counted twice.

use super::work::COUNTED;
use crate::association::Assignment;
use crate::gaussian::Gaussian;
use crate::mode::ModeBank;
use crate::scalar::Real;
use crate::time::Instant;
use crate::track::{Identities, TrackId};
use core::fmt;
use core::num::NonZeroU32;

/// Fused tracks and what they are made of, with room for `TRACKS` in the list of each of `SENSORS`, and for as many fused
/// ones. All zero bits when new: a `static` costs no flash.
#[derive(Clone, Debug)]
pub struct FusedPicture<T, const NX: usize, const MODES: usize, const SENSORS: usize, const TRACKS: usize> {
    pub(super) lists: [List<T, NX, MODES, TRACKS>; SENSORS],
    pub(super) fused: [FusedTrack<T, NX, MODES, SENSORS>; TRACKS],
    pub(super) ids: Identities,
    /// Tracks beyond the capacity, and refused ones, since the last update.
    pub(super) dropped: u16,
    pub(super) refused: u16,
    /// d² of a sensor's tracks, rows, and fused tracks. Scratch, as is the assignment.
    pub(super) squares: [[T; TRACKS]; TRACKS],
    pub(super) assignment: Assignment<T, TRACKS, TRACKS>,
}

/// One target: the tracks that follow it, and the estimate made of them.
#[derive(Clone, Copy, Debug)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct FusedTrack<T, const NX: usize, const MODES: usize, const SENSORS: usize> {
    pub(super) id: u32,
    /// The identity of every sensor's track, zero for none.
    pub(super) members: [u32; SENSORS],
    /// x and P, fused in the order of the sensors
    pub state: Gaussian<T, NX>,
    /// Mode probabilities, see [`fuse_probabilities`](super::fuse_probabilities)
    pub prob: [T; MODES],
}

/// What a sensor has sent last.
#[derive(Clone, Copy, Debug)]
pub(super) struct List<T, const NX: usize, const MODES: usize, const TRACKS: usize> {
    /// When it was sent, and the time that its tracks have been predicted to.
    pub sent: Option<Instant>,
    pub time: Instant,
    pub tracks: [LocalTrack<T, NX, MODES>; TRACKS],
}

/// A sensor's track in the common frame; identity zero where the slot is free.
#[derive(Clone, Copy, Debug)]
pub(super) struct LocalTrack<T, const NX: usize, const MODES: usize> {
    pub id: u32,
    pub bank: ModeBank<T, NX, MODES>,
}

/// Why a list of tracks is refused; the picture is as it was.
#[non_exhaustive]
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum ListError {
    /// There is no sensor of this number.
    UnknownSensor,
    /// The list is older than the last one of the same sensor.
    TimeReversed,
}

impl<T: Real, const NX: usize, const MODES: usize, const SENSORS: usize, const TRACKS: usize> FusedPicture<T, NX, MODES, SENSORS, TRACKS> {
    /// No lists, no tracks.
    #[must_use]
    pub const fn new() -> Self {
        const { assert!(SENSORS >= 1 && TRACKS >= 1 && TRACKS < 65535, "every capacity must be at least one") }
        Self {
            lists: [List::EMPTY; SENSORS],
            fused: [FusedTrack::FREE; TRACKS],
            ids: Identities::new(),
            dropped: 0,
            refused: 0,
            squares: [[T::ZERO; TRACKS]; TRACKS],
            assignment: Assignment::new(),
        }
    }

    /// The live fused tracks, as the last update has left them.
    pub fn tracks(&self) -> impl Iterator<Item = &FusedTrack<T, NX, MODES, SENSORS>> {
        self.fused.iter().filter(|fused| fused.id != 0)
    }

    /// The time of the latest list: that of the fused tracks after an update.
    #[must_use]
    pub fn time(&self) -> Option<Instant> {
        self.lists.iter().filter_map(|list| list.sent).max()
    }
}

impl<T: Real, const NX: usize, const MODES: usize, const SENSORS: usize, const TRACKS: usize> Default
    for FusedPicture<T, NX, MODES, SENSORS, TRACKS>
{
    fn default() -> Self {
        Self::new()
    }
}

impl<T: Real, const NX: usize, const MODES: usize, const SENSORS: usize> FusedTrack<T, NX, MODES, SENSORS> {
    pub(super) const FREE: Self = Self { id: 0, members: [0; SENSORS], state: Gaussian::ZERO, prob: [T::ZERO; MODES] };

    /// Its identity, the picture's own.
    #[must_use]
    pub fn id(&self) -> Option<TrackId> {
        NonZeroU32::new(self.id).map(TrackId)
    }

    /// The sensors that follow the target, each with the identity of its track.
    pub fn members(&self) -> impl Iterator<Item = (usize, TrackId)> {
        self.members.iter().enumerate().filter_map(|(sensor, id)| Some((sensor, TrackId(NonZeroU32::new(*id)?))))
    }

    /// Whether it has no members.
    pub(super) fn is_empty(&self) -> bool {
        self.members.iter().all(|id| *id == 0)
    }

    /// The identity of `sensor`'s track in it, zero for none.
    pub(super) fn member(&self, sensor: usize) -> u32 {
        self.members.get(sensor).copied().unwrap_or(0)
    }

    pub(super) fn set_member(&mut self, sensor: usize, id: u32) {
        self.members.iter_mut().skip(sensor).take(1).for_each(|member| *member = id);
    }

    /// The older one of two identities; zero is none yet.
    pub(super) fn take_older_id(&mut self, other: u32) {
        if other != 0 && (self.id == 0 || other < self.id) {
            self.id = other;
        }
    }
}

impl<T: Real, const NX: usize, const MODES: usize, const TRACKS: usize> List<T, NX, MODES, TRACKS> {
    pub(super) const EMPTY: Self = Self { sent: None, time: Instant::ZERO, tracks: [LocalTrack::FREE; TRACKS] };

    /// The track `id`, if the list has it; none for zero.
    pub fn find(&self, id: u32) -> Option<&LocalTrack<T, NX, MODES>> {
        if id == 0 {
            return None;
        }
        COUNTED.looks.add(TRACKS);
        self.tracks.iter().find(|track| track.id == id)
    }

    /// Takes in the next track; whether there was room.
    pub fn push(&mut self, track: LocalTrack<T, NX, MODES>) -> bool {
        let free = self.tracks.iter_mut().find(|slot| slot.id == 0);
        free.map(|slot| *slot = track).is_some()
    }
}

impl<T: Real, const NX: usize, const MODES: usize> LocalTrack<T, NX, MODES> {
    pub(super) const FREE: Self = Self { id: 0, bank: ModeBank::ZERO };
}

impl fmt::Display for ListError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            ListError::UnknownSensor => "there is no sensor of this number",
            ListError::TimeReversed => "the list is older than the last one of its sensor",
        })
    }
}

impl core::error::Error for ListError {}
