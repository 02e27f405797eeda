//! The density of one target over motion modes, and the interacting multiple model cycle on it.
//!
//! ```text
//! interaction   c_j = Σ_i π_ij μ_i,   μ_i|j = π_ij μ_i / c_j
//!               x⁰_j = Σ_i μ_i|j x_i,  P⁰_j = Σ_i μ_i|j (P_i + (x_i − x⁰_j)(x_i − x⁰_j)')
//! combination   x = Σ_j μ_j x_j,       P = Σ_j μ_j (P_j + (x_j − x)(x_j − x)')
//! ```
//!
//! Blom and Bar-Shalom, *IEEE Trans. AC* 33(8), 1988; Bar-Shalom, Li and Kirubarajan 2001, section 11.6.6.
//!
//! Both sums are taken about the mean of the first mode, see `mixing.rs`. The terms have the size of the distances between
//! modes, which one interaction every scan keeps at about one gate, so that nothing of weight cancels; raw second moments, of
//! the size of the coordinates, would lose the covariance in single precision.
//!
//! # Variable structure
//! A bank may hold some of its modes only (VS-IMM; Li and Bar-Shalom, *IEEE Trans. AC* 41(4), 1996). Into the set `to`, from
//! the modes i that had a probability at the last scan,
//!
//! ```text
//! c_j = Σ_i π_ij μ_i / Σ_{s ∈ run} Σ_i π_is μ_i,   j in `to`
//! ```
//!
//! where π is that of all modes: probability that jumps out of the set is shared out in proportion. What a mode that is not
//! active holds means nothing, but for the first: it stands for the place of the target, see [`anchor`](ModeBank::anchor).
//! Such a bank is mixed from its [`Deviations`], which the scan keeps for modes that are activated later in it.

use super::{ActiveSet, Deviations, ModeSet, mixing};
use crate::error::ConfigError;
use crate::gaussian::{self, Gaussian};
use crate::scalar::{Real, is_invertible, larger};
use core::hint::cold_path;

/// π: `rows[from][to]` is the probability of the mode `to` after one scan in the mode `from`.
pub type JumpMatrix<T, const MODES: usize> = [[T; MODES]; MODES];

/// Mode probabilities below this count as zero: their reciprocals still fit single precision.
pub(crate) const LEAST_PROBABILITY: f64 = 1e-30;

/// Checks that `probabilities` are such and sum to one.
pub(crate) fn check_distribution<T: Real, const N: usize>(probabilities: &[T; N]) -> Result<(), ConfigError> {
    let mut sum = T::ZERO;
    for p in probabilities {
        if !p.is_finite() {
            return Err(ConfigError::NotFinite);
        }
        if *p < T::ZERO || *p > T::ONE {
            return Err(ConfigError::NotAProbability);
        }
        sum += *p;
    }
    if (sum - T::ONE).abs() > T::lit(1e-5) { Err(ConfigError::NotNormalised) } else { Ok(()) }
}

/// Mode probabilities and one Gaussian per mode: the density of one target.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ModeBank<T, const NX: usize, const MODES: usize> {
    /// μ, the mode probabilities: after [`interact`](Self::interact) and before the update, the predicted c.
    pub prob: [T; MODES],
    /// x_j, P_j
    pub modes: [Gaussian<T, NX>; MODES],
}

impl<T: Real, const NX: usize, const MODES: usize> ModeBank<T, NX, MODES> {
    /// All zero bits: what a free track slot holds.
    pub const ZERO: Self = Self { prob: [T::ZERO; MODES], modes: [Gaussian::ZERO; MODES] };

    /// Every mode with the density `g`, mode probabilities `prob`.
    #[must_use]
    pub const fn new(prob: [T; MODES], g: Gaussian<T, NX>) -> Self {
        Self { prob, modes: [g; MODES] }
    }

    /// Mixes the modes by the jump matrix; `prob` becomes the predicted c. A mode that none can reach (c_j below
    /// 1e-30) gets c_j = 0 and the combined estimate, so that it stays sound until it can be reached again.
    ///
    /// Cost: about (3 (MODES − 1) + MODES 2 MODES) NX (NX + 1) / 2 operations, 10 instead of 11 for two modes.
    #[inline(always)]
    pub fn interact(&mut self, jump: &JumpMatrix<T, MODES>) {
        if MODES == 1 {
            return;
        }
        let before = self.prob;
        let mut weight = [before; MODES];
        for j in 0..MODES {
            let mut possible = before;
            each!(i in MODES {
                possible[i] *= jump[i][j];
            });
            self.prob[j] = gaussian::sum(&possible);
            if self.prob[j] > T::lit(LEAST_PROBABILITY) {
                let scale = T::ONE / self.prob[j];
                each!(i in MODES {
                    weight[j][i] = possible[i] * scale;
                });
            } else {
                cold_path();
                self.prob[j] = T::ZERO;
            }
        }
        mixing::mix(&mut self.modes, &weight);
        // Rows that sum to one but for rounding would let the probabilities drift while a track coasts.
        let sum = gaussian::sum(&self.prob);
        if sum > T::lit(LEAST_PROBABILITY) {
            let scale = T::ONE / sum;
            each!(j in MODES {
                self.prob[j] *= scale;
            });
        }
    }

    /// Predicts every mode by its model over `dt` \[s\].
    #[inline(always)]
    pub fn predict<M: ModeSet<T, NX, MODES>>(&mut self, set: &M, dt: T) {
        self.advance(set, &set.steps(dt));
    }

    /// [`predict`](Self::predict) by steps that many targets share.
    #[inline(always)]
    pub fn advance<M: ModeSet<T, NX, MODES>>(&mut self, set: &M, steps: &M::Steps) {
        set.advance_all(&mut self.modes, steps);
    }

    /// The modes that have a probability: all, unless the structure is variable.
    #[inline(always)]
    #[must_use]
    pub fn active(&self) -> ActiveSet {
        (0..MODES).filter(|r| self.prob[*r] > T::ZERO).collect()
    }

    /// Mixes the modes of `before` into the modes `to` of this bank. Their probabilities become c, which sums to one over `run`; all
    /// others stay as they are. A mode that none can reach (c below 1e-30) gets c = 0 and the combined estimate.
    ///
    /// Cost: for every mode of `to` about (2 + 2 J) NX (NX + 1) / 2 operations, where J modes can jump to it.
    #[inline(always)]
    pub fn interact_from(&mut self, before: &Deviations<T, NX, MODES>, jump: &JumpMatrix<T, MODES>, run: ActiveSet, to: ActiveSet) {
        let (mut c, mut sum) = ([T::ZERO; MODES], T::ZERO);
        for j in 0..MODES {
            if !run.with(to).contains(j) {
                continue;
            }
            for i in 0..MODES {
                c[j] += jump[i][j] * before.prob()[i];
            }
            sum += if run.contains(j) { c[j] } else { T::ZERO };
        }
        let share = if sum > T::lit(LEAST_PROBABILITY) { T::ONE / sum } else { T::ZERO };
        for j in 0..MODES {
            if !to.contains(j) {
                continue;
            }
            let possible = c[j] > T::lit(LEAST_PROBABILITY);
            let scale = T::ONE / c[j];
            let weight = |i: usize| if possible { jump[i][j] * scale * before.prob()[i] } else { before.prob()[i] };
            before.mix(&core::array::from_fn(weight), &mut self.modes[j]);
            self.prob[j] = if possible { c[j] * share } else { T::ZERO };
        }
    }

    /// Predicts the modes of `active` by their steps.
    #[inline(always)]
    pub fn advance_active<M: ModeSet<T, NX, MODES>>(&mut self, set: &M, active: ActiveSet, steps: &M::Steps) {
        for (mode, g) in self.modes.iter_mut().enumerate() {
            if active.contains(mode) {
                set.advance(mode, g, steps);
            }
        }
    }

    /// Where the first mode is not of `active`, it takes the density of one that is: sensors ask it where the target is, and
    /// the combined estimate is computed about it.
    #[inline(always)]
    pub fn anchor(&mut self, active: ActiveSet) {
        if !active.contains(0)
            && let Some(g) = (1..MODES).find(|r| active.contains(*r)).map(|r| self.modes[r])
        {
            self.modes[0] = g;
        }
    }

    /// The combined estimate: one Gaussian with the moments of the mixture.
    ///
    /// Cost: about 5 (MODES − 1) NX (NX + 1) / 2 operations; computed when asked for, not by a step.
    #[inline]
    #[must_use]
    pub fn combined(&self) -> Gaussian<T, NX> {
        let mut out = Gaussian::ZERO;
        self.combine(&mut out);
        out
    }

    /// [`combined`](Self::combined), in place.
    #[inline(always)]
    pub fn combine(&self, out: &mut Gaussian<T, NX>) {
        mixing::combine(&self.modes, &self.prob, out);
    }

    /// μ_r ∝ c_r e_r. Nothing changes where no mode is left, or what is left is not finite.
    #[inline(always)]
    pub(crate) fn weigh(&mut self, evidence: &[T; MODES]) {
        let mut weighed = self.prob;
        each!(r in MODES {
            weighed[r] *= evidence[r];
        });
        let sum = gaussian::sum(&weighed);
        if is_invertible(sum) {
            let scale = T::ONE / sum;
            each!(r in MODES {
                self.prob[r] = weighed[r] * scale;
            });
        }
    }

    /// μ_r ∝ c_r e_r over the modes of `active`; the others get zero, and these at least 1e-30: a probability tells that a mode
    /// is active.
    #[inline(always)]
    pub(crate) fn weigh_active(&mut self, evidence: &[T; MODES], active: ActiveSet) {
        let of_active = |r: usize, value: T| if active.contains(r) { value } else { T::ZERO };
        self.prob = core::array::from_fn(|r| of_active(r, self.prob[r]));
        self.weigh(evidence);
        self.prob = core::array::from_fn(|r| of_active(r, larger(self.prob[r], T::lit(LEAST_PROBABILITY))));
    }

    /// The most probable mode.
    #[must_use]
    pub fn most_probable(&self) -> usize {
        let mut best = (0, T::ZERO);
        for (mode, p) in self.prob.iter().enumerate() {
            if *p > best.1 {
                best = (mode, *p);
            }
        }
        best.0
    }

    /// Whether all densities are sound: finite, variances not negative, and nothing so large (1e15 for the means of a mode together,
    /// 1e30 for its variances) that combining the modes could overflow single precision.
    #[must_use]
    pub fn is_valid(&self) -> bool {
        let limit = T::lit(1e15);
        self.prob.iter().all(|p| p.is_finite())
            && self.modes.iter().all(|g| {
                let (mut size, mut spread) = (T::ZERO, T::ZERO);
                for k in 0..NX {
                    size += g.mean.data.0[0][k].abs();
                    spread += g.cov.upper()[k][k];
                }
                size <= limit && spread <= limit * limit && g.cov.has_valid_variances()
            })
    }
}
