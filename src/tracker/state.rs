//! What a tracker remembers: one struct, all of its memory.

use super::picture::Picture;
use crate::association::AssociationMatrix;
use crate::bytes::Digest;
use crate::evidence::Evidence;
use crate::scalar::Real;
use crate::scan::Estimate;
use crate::time::Instant;
use crate::track::{Track, TrackId};

/// All that a tracker remembers, and its scratch. All zero bits when new: a `static` costs no flash.
///
/// `X` is what joint association needs besides, see [`JointState`](super::JointState); nothing for
/// [`ImmPdaf`](super::ImmPdaf).
#[derive(Clone, Debug)]
pub struct State<T, const NX: usize, const MODES: usize, const TRACKS: usize, const DETS: usize, X = ()> {
    pub(super) picture: Picture<T, NX, MODES, TRACKS, DETS>,
    pub(super) evidence: Evidence<T, DETS>,
    pub(super) scratch: X,
}

/// Memory beside tracks and evidence.
pub trait Scratch {
    /// All zero bits.
    const NEW: Self;
}

impl Scratch for () {
    const NEW: Self = ();
}

impl<T: Real, X: Scratch, const NX: usize, const MODES: usize, const TRACKS: usize, const DETS: usize>
    State<T, NX, MODES, TRACKS, DETS, X>
{
    /// No tracks.
    #[must_use]
    pub const fn new() -> Self {
        Self { picture: Picture::new(), evidence: Evidence::new(), scratch: X::NEW }
    }
}

impl<T: Real, X, const NX: usize, const MODES: usize, const TRACKS: usize, const DETS: usize> State<T, NX, MODES, TRACKS, DETS, X> {
    /// The live tracks, in slot order.
    pub fn tracks(&self) -> impl Iterator<Item = &Track<T, NX, MODES>> {
        self.picture.tracks.iter().filter(|t| !t.is_free())
    }

    /// The track `id`, if it lives.
    #[must_use]
    pub fn track(&self, id: TrackId) -> Option<&Track<T, NX, MODES>> {
        self.picture.tracks.iter().find(|t| t.id() == Some(id))
    }

    /// Deletes the track `id`. Returns whether it lived.
    pub fn remove(&mut self, id: TrackId) -> bool {
        match self.picture.tracks.iter_mut().find(|t| t.id() == Some(id)) {
            Some(track) => {
                *track = Track::FREE;
                true
            }
            None => false,
        }
    }

    /// The combined estimates of all live tracks, computed as they are asked for.
    pub fn estimates(&self) -> impl Iterator<Item = Estimate<T, NX>> {
        self.picture.tracks.iter().filter_map(Track::estimate)
    }

    /// The association probabilities that the last scan gave the track `id`, where all tracks are associated together: β_0, and
    /// those of the detections taken in. They mean nothing for a track that it started.
    pub fn association(&self, id: TrackId) -> Option<(T, &[T])>
    where
        X: AsRef<AssociationMatrix<T, TRACKS, DETS>>,
    {
        let slot = self.picture.tracks.iter().position(|t| t.id() == Some(id))?;
        self.scratch.as_ref().row(slot)
    }

    /// All that the next scan depends on, folded into one word: two states in single precision that differ in one number differ
    /// in it, and two that differ in more almost always. A few cycles a number of every live track.
    #[must_use]
    pub fn digest(&self) -> u32 {
        let Picture { time, ids, tracks, seeds, .. } = &self.picture;
        let mut digest = Digest::default();
        digest.wide(time.map_or(u64::MAX, Instant::as_micros));
        digest.word(ids.last());
        for (slot, track) in tracks.iter().enumerate().filter(|(_, track)| !track.is_free()) {
            digest.word(slot as u32);
            track.fold_into(&mut digest);
        }
        seeds.iter().for_each(|seed| seed.fold_into(&mut digest));
        digest.0
    }

    /// The time of the last scan.
    #[must_use]
    pub fn time(&self) -> Option<Instant> {
        self.picture.time
    }
}

impl<T: Real, X: Scratch, const NX: usize, const MODES: usize, const TRACKS: usize, const DETS: usize> Default
    for State<T, NX, MODES, TRACKS, DETS, X>
{
    fn default() -> Self {
        // As a constant: made at run time, its parts would pass through the stack.
        const { Self::new() }
    }
}
