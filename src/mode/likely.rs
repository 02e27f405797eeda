//! The likely-model set (LMS): which of many modes are worth running for a target.
//!
//! ```text
//! run M        mix, predict and weigh the modes of M by this scan: μ_r, summing to one over M
//! classify     principal μ_r > t₂,   unlikely μ_r < t₁,   significant between
//! activate     new = the modes that a principal one may switch to, but for M; they are mixed from the same modes of the last
//!              scan, predicted, and weighed by the same detections;  μ over M ∪ new, the estimate is that of the union
//! discard      of the unlikely modes to which no principal one may switch the least probable, but never so many that less
//!              than K stay: the rest is the M of the next scan
//! recall       instead of both, all modes run in this scan and the next, c ≥ t₁ for those that are new: where no detection is in
//!              the gate of a sensor that looks there, or the scan is a surprise, (ν' S⁻¹ ν − n) / √2n > s in every mode of M for
//!              the most probable detection, of n coordinates
//! ```
//!
//! Li and Zhang, *IEEE Trans. AES* 36(2), 2000, with "and" for what is discarded: both unlikely and not among the K most
//! probable. Gomes' overview of methods with multiple models gives the equations; in its table 3 the significant modes are
//! those with t₁ ≤ μ ≤ t₂. The jump matrix is that of all modes throughout and never renormalised. Recall is ours: the plain set
//! walks through adjacent modes, a step a scan, and loses targets that change their turn abruptly. A mode was discarded for a
//! probability below t₁, so that is the most it may have had; to come back by jumps alone it would have to walk, too.

use super::{ActiveSet, JumpMatrix, ModeBank};
use crate::error::ConfigError;
use crate::scalar::{Real, larger, sqrt};

/// How the set of likely modes is adapted.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct LikelyModes<T, const MODES: usize> {
    /// t₁
    unlikely: T,
    /// t₂
    principal: T,
    /// K
    least: usize,
    /// The modes that each may switch to, itself left out
    adjacent: [ActiveSet; MODES],
    /// s; infinite where only an empty gate recalls all modes, `None` where nothing does
    recall: Option<T>,
}

/// What the adaptation made of a scan.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Adaptation<T, const MODES: usize> {
    /// μ over the modes that ran first; zero in the others
    pub prob: [T; MODES],
    /// Those of them with μ < t₁
    pub unlikely: ActiveSet,
    /// Those of them with μ > t₂
    pub principal: ActiveSet,
    /// The modes that a principal one may switch to
    pub adjacent: ActiveSet,
    /// What was activated
    pub new: ActiveSet,
    /// What was discarded
    pub removed: ActiveSet,
    /// The modes of the next scan
    pub next: ActiveSet,
}

impl<T: Real, const MODES: usize> LikelyModes<T, MODES> {
    /// The default of [`with_recall`](Self::with_recall): ν' S⁻¹ ν > 8 for measurements of two coordinates, 2 % of the scans of a
    /// target that moves as it should.
    pub const SURPRISE: f64 = 3.0;

    /// Modes below `unlikely` (t₁) may be discarded, above `principal` (t₂) they activate those that `jump`, the tracker's, lets
    /// them switch to, and at least `least` (K) stay. All modes come back at a surprise of [`SURPRISE`](Self::SURPRISE).
    ///
    /// # Errors
    /// Unless 0 ≤ t₁ < t₂ ≤ 1 and 1 ≤ K ≤ `MODES`.
    pub fn new(jump: &JumpMatrix<T, MODES>, unlikely: T, principal: T, least: usize) -> Result<Self, ConfigError> {
        const { assert!(MODES >= 1 && MODES <= ActiveSet::MOST, "a set holds at most 32 modes") }
        let ordered = T::ZERO <= unlikely && unlikely < principal && principal <= T::ONE;
        if !ordered || least < 1 || least > MODES {
            return Err(ConfigError::BadLikelyModes);
        }
        let reachable = |from: usize| (0..MODES).filter(move |to| *to != from && jump[from][*to] != T::ZERO);
        let adjacent = core::array::from_fn(|from| reachable(from).collect());
        Ok(Self { unlikely, principal, least, adjacent, recall: Some(T::lit(Self::SURPRISE)) })
    }

    /// The same with the modes that each one activates given, instead of those that it may switch to.
    #[must_use]
    pub fn with_adjacency(self, adjacent: [ActiveSet; MODES]) -> Self {
        Self { adjacent, ..self }
    }

    /// The same with another surprise that recalls all modes; infinite leaves it to empty gates.
    ///
    /// # Errors
    /// Where it is not positive.
    pub fn with_recall(self, surprise: T) -> Result<Self, ConfigError> {
        if surprise > T::ZERO { Ok(Self { recall: Some(surprise), ..self }) } else { Err(ConfigError::NotPositive) }
    }

    /// The same without recall, as published: a target that changes its motion by more than one mode a scan may be lost.
    #[must_use]
    pub fn without_recall(self) -> Self {
        Self { recall: None, ..self }
    }

    /// Whether all modes come back. `explained` tells whether ν' S⁻¹ ν of the most probable detection, of `dimension` coordinates, is
    /// at most its argument in any of the modes that run; false where there was no detection.
    #[inline(always)]
    pub fn recalls(&self, dimension: usize, explained: impl FnOnce(T) -> bool) -> bool {
        let n = T::from_count(dimension);
        self.recall.is_some_and(|most| !explained(n + most * sqrt(n + n)))
    }

    /// Weighs the modes `run` of `bank`, whose probabilities are c, by the `evidence` of this scan, and finds those of the next
    /// scan. Modes to be activated go to `activate`, which mixes, predicts and corrects them and returns their evidence, with the
    /// factor that the other has, or `None` where none can be activated. Afterwards `bank` holds the union of both sets. With
    /// `recall` all modes come back, see [`recalls`](Self::recalls).
    #[inline(always)]
    pub fn adapt<const NX: usize>(
        &self,
        bank: &mut ModeBank<T, NX, MODES>,
        run: ActiveSet,
        mut evidence: [T; MODES],
        recall: bool,
        activate: impl FnOnce(&mut ModeBank<T, NX, MODES>, ActiveSet) -> Option<[T; MODES]>,
    ) -> Adaptation<T, MODES> {
        let all = ActiveSet::first(MODES);
        let weighed: [T; MODES] = core::array::from_fn(|r| if run.contains(r) { bank.prob[r] * evidence[r] } else { T::ZERO });
        let sum = weighed.iter().fold(T::ZERO, |sum, p| sum + *p);
        let [mut unlikely, mut principal, mut adjacent] = [ActiveSet::EMPTY; 3];
        for r in 0..MODES {
            if !run.contains(r) {
                continue;
            }
            if weighed[r] < self.unlikely * sum {
                unlikely = unlikely.with(ActiveSet::of(r));
            } else if weighed[r] > self.principal * sum {
                principal = principal.with(ActiveSet::of(r));
                adjacent = adjacent.with(self.adjacent[r]);
            }
        }
        let mut new = if recall { all } else { adjacent }.without(run);
        match if new.is_empty() { None } else { activate(bank, new) } {
            Some(more) => evidence = core::array::from_fn(|r| if new.contains(r) { more[r] } else { evidence[r] }),
            None => new = ActiveSet::EMPTY,
        }
        for r in 0..MODES {
            if !(recall && new.contains(r)) {
                continue;
            }
            bank.prob[r] = larger(bank.prob[r], self.unlikely);
        }
        let union = run.with(new);
        bank.weigh_active(&evidence, union);

        let next = if recall { all } else { self.discard(&bank.prob, union, unlikely.without(adjacent)) };
        let scale = T::ONE / sum;
        Adaptation { prob: weighed.map(|p| p * scale), unlikely, principal, adjacent, new, removed: union.without(next), next }
    }

    /// `union` without the least probable modes of `discardable`, K at least.
    #[inline(always)]
    fn discard(&self, prob: &[T; MODES], union: ActiveSet, mut discardable: ActiveSet) -> ActiveSet {
        let mut rest = union;
        while !discardable.is_empty() && rest.len() > self.least {
            let candidates = prob.iter().enumerate().filter(|(r, _)| discardable.contains(*r));
            let Some((least, _)) = candidates.reduce(|a, b| if b.1 < a.1 { b } else { a }) else { break };
            discardable = discardable.without(ActiveSet::of(least));
            rest = rest.without(ActiveSet::of(least));
        }
        rest
    }
}
