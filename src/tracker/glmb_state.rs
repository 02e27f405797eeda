//! What a jump-Markov GLMB tracker remembers, and what it knows of targets.
//!
//! ```text
//! cardinality   ρ(n) = Σ_{h with n targets} w_h
//! existence     r(ℓ) = Σ_{h with ℓ} w_h,   p(ℓ) = Σ_{h with ℓ} w_h p_{h,ℓ} / r(ℓ)
//! estimate      the targets of the heaviest hypothesis with n targets, n the most probable number
//! ```

use crate::association::KBest;
use crate::gaussian::Gaussian;
use crate::glmb::{Capacities, Density, Generation, GlmbWork, Hypothesis, Label, Pool, Ranked, Row, Slot, Truncation, Unexplained};
use crate::scalar::{Real, exp};
use crate::time::Instant;

/// What is known of one target.
#[derive(Clone, Copy, Debug)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct LabelledEstimate<T, const NX: usize, const MODES: usize> {
    /// Which target
    pub label: Label,
    /// r, the probability that it exists, over all hypotheses
    pub existence: T,
    /// The density over all modes
    pub state: Gaussian<T, NX>,
    /// μ, the mode probabilities
    pub modes: [T; MODES],
}

/// All that a [`JmsGlmb`](super::JmsGlmb) remembers, and its scratch. All zero bits when new: a `static` costs no flash.
///
/// `D` is the [`Density`] of a track, `A` the [`Truncation`]. There is room for `SLOTS` tracks and `HYPS` hypotheses, each of at most
/// `LABELS` targets, newborn ones included; a track takes its `GATED` most probable detections, a scan `DETS`. It holds 2
/// `SLOTS` densities and 2 `HYPS` `LABELS` indices of 16 bits.
#[derive(Clone, Debug)]
pub struct GlmbState<
    T: Real,
    D,
    A: Truncation<T, LABELS>,
    const SLOTS: usize,
    const HYPS: usize,
    const LABELS: usize,
    const GATED: usize,
    const DETS: usize,
> {
    pub(super) time: Option<Instant>,
    /// Scans so far that were not at the time of the one before
    pub(super) scans: u32,
    /// This scan's, and room for the next one's
    pub(super) generations: [Generation<T, D, SLOTS, HYPS, LABELS>; 2],
    /// Whether this scan's is the second
    pub(super) second: bool,
    pub(super) rows: [Row<T, GATED>; SLOTS],
    pub(super) memory: A::Memory,
    pub(super) unexplained: heapless::Vec<Unexplained<T>, DETS>,
}

impl<
    T: Real,
    D,
    A: Truncation<T, LABELS>,
    const SLOTS: usize,
    const HYPS: usize,
    const LABELS: usize,
    const GATED: usize,
    const DETS: usize,
> GlmbState<T, D, A, SLOTS, HYPS, LABELS, GATED, DETS>
{
    /// No targets.
    #[must_use]
    pub const fn new<const NX: usize, const MODES: usize>() -> Self
    where
        D: Density<T, NX, MODES>,
    {
        const {
            assert!(HYPS >= 1 && LABELS >= 1 && GATED >= 1 && DETS >= 1 && DETS <= 65535, "every capacity must be at least one");
            assert!(SLOTS * (GATED + 1) < 65535, "tracks and their choices are numbered by 16 bits");
        }
        Self {
            time: None,
            scans: 0,
            generations: [const {
                let slot = Slot { label: Label { birth_scan: 0, index: 0 }, weight: T::ZERO, origin: 0, density: D::ZERO };
                Generation { slots: [slot; SLOTS], count: 0, pool: Pool::NEW }
            }; 2],
            second: false,
            rows: [const { Row::ZERO }; SLOTS],
            memory: A::MEMORY,
            unexplained: heapless::Vec::new(),
        }
    }

    /// The time of the last scan.
    #[must_use]
    pub fn time(&self) -> Option<Instant> {
        self.time
    }

    fn now(&self) -> &Generation<T, D, SLOTS, HYPS, LABELS> {
        let [first, second] = &self.generations;
        if self.second { second } else { first }
    }

    fn slots(&self) -> &[Slot<T, D>] {
        self.now().tracks()
    }

    /// (weight, labels) of all hypotheses, heaviest first. The weights sum to one.
    pub fn hypotheses(&self) -> impl Iterator<Item = (T, impl Iterator<Item = Label>)> {
        self.now().pool.all().iter().map(|h| (exp(h.ln_weight), self.tracks_of(h).map(|slot| slot.label)))
    }

    fn tracks_of(&self, hypothesis: &Hypothesis<T, LABELS>) -> impl Iterator<Item = &Slot<T, D>> {
        hypothesis.tracks().iter().filter_map(|track| self.slots().get(usize::from(*track)))
    }

    /// Tracks in the table: pairs of a label and a history of detections.
    #[must_use]
    pub fn tracks(&self) -> usize {
        self.now().count
    }

    /// ρ(n), the probability of `n` targets.
    #[must_use]
    pub fn cardinality(&self, n: usize) -> T {
        let pool = self.now().pool.all();
        if pool.is_empty() {
            return if n == 0 { T::ONE } else { T::ZERO };
        }
        pool.iter().filter(|h| h.tracks().len() == n).fold(T::ZERO, |sum, h| sum + exp(h.ln_weight))
    }

    /// The most probable number of targets, of equals the smallest.
    #[must_use]
    pub fn most_probable_cardinality(&self) -> usize {
        (0..=LABELS).map(|n| (n, self.cardinality(n))).reduce(|a, b| if b.1 > a.1 { b } else { a }).map_or(0, |(n, _)| n)
    }

    /// r(ℓ)
    #[must_use]
    pub fn existence(&self, label: Label) -> T {
        let sum = self.slots().iter().filter(|slot| slot.label == label).fold(T::ZERO, |sum, slot| sum + slot.weight);
        if sum < T::ONE { sum } else { T::ONE }
    }

    /// The targets of the heaviest hypothesis with the most probable number of them.
    pub fn estimates<const NX: usize, const MODES: usize>(&self) -> impl Iterator<Item = LabelledEstimate<T, NX, MODES>>
    where
        D: Density<T, NX, MODES>,
    {
        let n = self.most_probable_cardinality();
        let best = self.now().pool.all().iter().find(|h| h.tracks().len() == n);
        best.into_iter().flat_map(|h| self.tracks_of(h)).map(|Slot { label, density, .. }| LabelledEstimate {
            label: *label,
            existence: self.existence(*label),
            state: density.combined(),
            modes: density.prob(),
        })
    }

    /// Every label of more than no probability, with what all hypotheses together know of it.
    pub fn labels<const NX: usize, const MODES: usize>(&self) -> impl Iterator<Item = LabelledEstimate<T, NX, MODES>>
    where
        D: Density<T, NX, MODES>,
    {
        let first = |place: usize, label: Label| self.slots().iter().take(place).all(|slot| slot.label != label);
        let known = move |(place, slot): (usize, &Slot<T, D>)| {
            let estimate = first(place, slot.label).then(|| self.merged(slot.label));
            estimate.filter(|estimate| estimate.existence > T::ZERO)
        };
        self.slots().iter().enumerate().filter_map(known)
    }

    /// The moments of all tracks of a label together.
    fn merged<const NX: usize, const MODES: usize>(&self, label: Label) -> LabelledEstimate<T, NX, MODES>
    where
        D: Density<T, NX, MODES>,
    {
        let existence = self.existence(label);
        let all = || self.slots().iter().filter(|slot| slot.label == label).map(|slot| (slot.weight / existence, &slot.density));
        let mut modes = [T::ZERO; MODES];
        for (weight, density) in all() {
            modes.iter_mut().zip(density.prob()).for_each(|(sum, p)| *sum += weight * p);
        }
        let state = Gaussian::moment_match(all().map(|(weight, density)| (weight, density.combined())));
        LabelledEstimate { label, existence, state, modes }
    }
}

impl<
    T: Real,
    D,
    const EVENTS: usize,
    const COLUMNS: usize,
    const SLOTS: usize,
    const HYPS: usize,
    const LABELS: usize,
    const GATED: usize,
    const DETS: usize,
> GlmbState<T, D, Ranked<EVENTS, COLUMNS>, SLOTS, HYPS, LABELS, GATED, DETS>
{
    /// The most work that a scan can make after scans of a tracker that keeps `most` hypotheses
    /// ([`with_limits`](super::JmsGlmb::with_limits)), none of its detections with a noise or a time of its own.
    #[must_use]
    pub const fn worst_case<const NX: usize, const MODES: usize>(most: usize) -> GlmbWork
    where
        D: Density<T, NX, MODES>,
    {
        GlmbWork::ranked(Capacities {
            slots: SLOTS,
            hypotheses: HYPS,
            parents: most,
            labels: LABELS,
            gated: GATED,
            detections: DETS,
            components: D::COMPONENTS,
            events: EVENTS,
            columns: COLUMNS,
            ranking: KBest::<T, LABELS, COLUMNS, EVENTS>::worst_case(),
        })
    }
}
