//! The most work that one scan of a GLMB tracker can make, by kinds of operation.
//!
//! With s = SLOTS, h = HYPS, ℓ = LABELS, g = GATED and m = DETS of the state, c Gaussians or points of a density, and truncation by
//! ranked assignment of K events over C columns:
//!
//! ```text
//! predictions    (s + m) c                       of one Gaussian or point, tracks and births from detections
//! innovations    (3 s + m) c                     for rows, and for the tracks that are kept: once, points twice
//! residuals      (s + m) c m + 2 s c             in rows, and in updates
//! corrections    s c
//! looks          h (3 K ℓ (ℓ + 2) max(ℓ, C) + K² ℓ)        at pairs of an assignment and at events before
//! sums           h (ℓ² g² + 448 ℓ)               for the weight of all events
//! comparisons    (h K + 2 h (8 K + 3)) (log₂ h + 1)        of hypotheses: offered, merged, sorted
//! ```
//!
//! A pool of h hypotheses is merged when it is full, as long as that frees an eighth: 8 K times, and three sorts end a scan. Most of
//! a scan is far below: events end where they are lighter than what is kept.

/// Numbers of operations.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct GlmbWork {
    /// Predictions of one Gaussian or point
    pub predictions: u64,
    /// Predicted measurements of one
    pub innovations: u64,
    /// Residuals with what is made of them
    pub residuals: u64,
    /// Corrections of one Gaussian or point
    pub corrections: u64,
    /// Looks at pairs and events in ranked assignment
    pub looks: u64,
    /// Terms of the weight of all events
    pub sums: u64,
    /// Comparisons of hypotheses
    pub comparisons: u64,
}

/// What the formula depends on, by the names of this file.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Capacities {
    pub slots: usize,
    pub hypotheses: usize,
    pub labels: usize,
    pub gated: usize,
    pub detections: usize,
    /// c
    pub components: usize,
    /// K
    pub events: usize,
    /// C
    pub columns: usize,
}

impl GlmbWork {
    /// The most of a scan, by the formula of this file.
    pub(crate) const fn ranked(of: Capacities) -> Self {
        let (s, h, l, g) = (of.slots as u64, of.hypotheses as u64, of.labels as u64, of.gated as u64);
        let (m, c, k) = (of.detections as u64, of.components as u64, of.events as u64);
        let across = if of.columns > of.labels { of.columns as u64 } else { l };
        let depth = h.ilog2() as u64 + 1;
        Self {
            predictions: (s + m) * c,
            innovations: (3 * s + m) * c,
            residuals: (s + m) * c * m + 2 * s * c,
            corrections: s * c,
            looks: h * (3 * k * l * (l + 2) * across + k * k * l),
            sums: h * (l * l * g * g + 448 * l),
            comparisons: (h * k + 2 * h * (8 * k + 3)) * depth,
        }
    }

    /// All operations.
    #[must_use]
    pub const fn steps(&self) -> u64 {
        let Self { predictions, innovations, residuals, corrections, looks, sums, comparisons } = *self;
        predictions + innovations + residuals + corrections + looks + sums + comparisons
    }
}
