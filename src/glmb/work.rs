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
//! looks          p (B + ℓ (g + 1)(2 C + K) + 4 ℓ) + m s (2 g + 5)     at pairs and events, columns, places, detections of rows
//! sums           p (g² ℓ (ℓ − 1) / 2 + (11 g + 12) ℓ + 448 ℓ + 64)    for the weight of all events
//! comparisons    o (2 d + 1) + f (2 d + 5) h + (4 d + 6) h + d + 1    of hypotheses: offered, merged while there is no room, sorted
//! ```
//!
//! p ≤ h hypotheses go into a scan, each with K events at most, o = p K in all; B is what ranking costs, see
//! [`KBest`](crate::association::KBest), and d = log₂ h. A full pool is merged as long as that frees more than an eighth of it:
//! the first time after h offers, then after every h / 8 at most, f = 1 + 8 (o − h) / h times. Most of a scan is far below: events
//! end where they are lighter than what is kept.

#[cfg(feature = "count")]
use crate::association::take_operations;
use crate::counter::Counter;

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
    /// Looks at pairs and events in ranked assignment, and at rows and places in tables
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
    /// p
    pub parents: usize,
    pub labels: usize,
    pub gated: usize,
    pub detections: usize,
    /// c
    pub components: usize,
    /// K
    pub events: usize,
    /// C
    pub columns: usize,
    /// B
    pub ranking: u64,
}

impl GlmbWork {
    /// The most of a scan, by the formula of this file.
    pub(crate) const fn ranked(of: Capacities) -> Self {
        let (s, h, l, g) = (of.slots as u64, of.hypotheses as u64, of.labels as u64, of.gated as u64);
        let (m, c, k, columns) = (of.detections as u64, of.components as u64, of.events as u64, of.columns as u64);
        let p = if of.parents < of.hypotheses { of.parents as u64 } else { h };
        let (offers, depth) = (p * k, h.ilog2() as u64);
        let merges = if offers < h { 0 } else { 1 + 8 * (offers - h) / h };
        Self {
            predictions: (s + m) * c,
            innovations: (3 * s + m) * c,
            residuals: (s + m) * c * m + 2 * s * c,
            corrections: s * c,
            looks: p * (of.ranking + l * (g + 1) * (2 * columns + k) + 4 * l) + m * s * (2 * g + 5),
            sums: p * (g * g * l * (l - 1) / 2 + (11 * g + 12) * l + 448 * l + 64),
            comparisons: offers * (2 * depth + 1) + merges * (2 * depth + 5) * h + (4 * depth + 6) * h + depth + 1,
        }
    }

    /// All operations.
    #[must_use]
    pub const fn steps(&self) -> u64 {
        let Self { predictions, innovations, residuals, corrections, looks, sums, comparisons } = *self;
        predictions + innovations + residuals + corrections + looks + sums + comparisons
    }
}

/// What is counted in a build with the feature `count`.
pub(crate) struct Counters {
    pub looks: Counter,
    pub sums: Counter,
    pub comparisons: Counter,
}

pub(crate) static COUNTED: Counters = Counters { looks: Counter::new(), sums: Counter::new(), comparisons: Counter::new() };

/// Takes the looks, sums and comparisons that were counted since the last call, in all threads. What densities ask of their models
/// a model can count.
#[cfg(feature = "count")]
pub fn take_work() -> GlmbWork {
    let Counters { looks, sums, comparisons } = &COUNTED;
    GlmbWork {
        looks: (looks.take() + take_operations()) as u64,
        sums: sums.take() as u64,
        comparisons: comparisons.take() as u64,
        ..GlmbWork::default()
    }
}
