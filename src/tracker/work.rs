//! The most work that one scan can make, by kinds of operation: what a tracker's loops add up to.
//!
//! With t tracks, m detections and r modes, for detections without a noise or a time of their own:
//!
//! ```text
//!                   IMM-PDAF        IMM-JPDA
//! predictions       t r             t r               of one mode
//! innovations       t r             2 t r             of one mode: before the association, and after it
//! residuals         t m (2 + 3 r)   t m (2 + 3 r)     2 m for the gate, r m for likelihoods, r m for corrections, again where sharp
//! corrections       t r             t r               of one mode
//! association       t (m + 1)       A + 6 t m         weights, or the steps A of the joint association and its matrix
//! comparisons       t (t − 1) / 2   t (t − 1) / 2     of two tracks on one target
//! fixes             2 m             2 m             positions of detections: to be paired, and to be remembered
//! pairings          m²              m²                of two detections that may start a track
//! looks             m² (2 t + 1)    m² (2 t + 1)      at slots and remembered detections, for room
//! ```
//!
//! IMM-JPDA with [`Gnn`] likewise, A its looks at pairs.
//!
//! IMM-JPDA with room for p pairs of tracks that the sensor may not tell apart: as IMM-JPDA, but for
//!
//! ```text
//! innovations       2 t r + t                            each track's modes combined, too
//! residuals         t m (2 + 3 r) + 4 p m                of pairs: gate and weight, then one for each of its tracks
//! association       A' + 6 t m                           the steps A' of all that MergingJpda associates
//! as one            ⌊t / 2⌋ t (t − 1) / 2 + p (3 m + 2)  two tracks, to find the closest that are left; a pair and a detection, or none
//! ```
//!
//! LMS-JPDA as IMM-JPDA with r the modes of all, but for t (m (2 + 5 r) + r) residuals: a mode that is activated needs the
//! likelihoods of the others once more, and r tell whether the scan is a surprise.

use crate::association::{Gnn, Jpda, MergingJpda};

/// Numbers of operations.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Work {
    /// Predictions of one mode, mixing included
    pub predictions: u64,
    /// Predicted measurements of one mode
    pub innovations: u64,
    /// Residuals with what is made of them: a gate test, a likelihood, or a share of a correction
    pub residuals: u64,
    /// Corrections of one mode
    pub corrections: u64,
    /// Steps of the association
    pub association: u64,
    /// Comparisons of two tracks
    pub comparisons: u64,
    /// Positions that detections are traced back to
    pub fixes: u64,
    /// Pairings of two detections, each of which may give birth to a track
    pub pairings: u64,
    /// Looks at slots and remembered detections
    pub looks: u64,
    /// Looks at two targets as one to the sensor: whether they may be, or what a detection says of them
    pub as_one: u64,
}

impl Work {
    /// The most of an [`ImmPdaf`](super::ImmPdaf), by the formula of this file.
    #[must_use]
    pub const fn imm_pdaf(tracks: usize, detections: usize, modes: usize) -> Self {
        let (t, m, r) = (tracks as u64, detections as u64, modes as u64);
        Self {
            predictions: t * r,
            innovations: t * r,
            residuals: t * m * (2 + 3 * r),
            corrections: t * r,
            association: t * (m + 1),
            comparisons: t * t.saturating_sub(1) / 2,
            fixes: 2 * m,
            pairings: m * m,
            looks: m * m * (2 * t + 1),
            as_one: 0,
        }
    }

    /// The most of an [`ImmJpda`](super::ImmJpda) that associates by [`Jpda`], by the formula of this file.
    #[must_use]
    pub const fn imm_jpda<const NODES: usize>(tracks: usize, detections: usize, modes: usize) -> Self {
        Self::joint(tracks, detections, modes, Jpda::<NODES>::worst_case(tracks, detections))
    }

    /// The most of an [`ImmJpda`](super::ImmJpda) that associates by [`Gnn`], by the formula of this file.
    #[must_use]
    pub const fn imm_gnn(tracks: usize, detections: usize, modes: usize) -> Self {
        Self::joint(tracks, detections, modes, Gnn::worst_case(tracks, detections))
    }

    const fn joint(tracks: usize, detections: usize, modes: usize, association: u64) -> Self {
        let (t, m, r) = (tracks as u64, detections as u64, modes as u64);
        Self { innovations: 2 * t * r, association: association + 6 * t * m, ..Self::imm_pdaf(tracks, detections, modes) }
    }

    /// The most of an [`ImmJpda`](super::ImmJpda) that associates by [`MergingJpda`], by the formula of this file.
    #[must_use]
    pub const fn imm_jpda_merging<const NODES: usize, const PAIRS: usize>(tracks: usize, detections: usize, modes: usize) -> Self {
        let (t, m, p) = (tracks as u64, detections as u64, PAIRS as u64);
        let single = Self::imm_jpda::<NODES>(tracks, detections, modes);
        Self {
            innovations: single.innovations + t,
            residuals: single.residuals + 4 * p * m,
            association: MergingJpda::<NODES, PAIRS>::worst_case(tracks, detections) + 6 * t * m,
            as_one: t / 2 * (t * t.saturating_sub(1) / 2) + p * (3 * m + 2),
            ..single
        }
    }

    /// The most of an [`LmsJpda`](super::LmsJpda) that associates by [`Jpda`], by the formula of this file.
    #[must_use]
    pub const fn lms_jpda<const NODES: usize>(tracks: usize, detections: usize, modes: usize) -> Self {
        let (t, m, r) = (tracks as u64, detections as u64, modes as u64);
        Self { residuals: t * (m * (2 + 5 * r) + r), ..Self::imm_jpda::<NODES>(tracks, detections, modes) }
    }

    /// All operations.
    #[must_use]
    pub const fn steps(&self) -> u64 {
        let Self { predictions, innovations, residuals, corrections, association, comparisons, fixes, pairings, looks, as_one } = *self;
        predictions + innovations + residuals + corrections + association + comparisons + fixes + pairings + looks + as_one
    }
}
