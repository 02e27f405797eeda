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
//! Both sums of all modes are taken about the mean of the first mode, d_i = x_i − x_1: with N_i = P_i − P_1 + d_i d_i' shared by
//! all targets of the mixing, P⁰_j = P_1 + Σ_i μ_i|j N_i − d̄_j d̄_j'. The terms have the size of the distances
//! between modes, which one interaction every scan keeps at about one gate, so that nothing of weight cancels; raw
//! second moments, of the size of the coordinates, would lose the covariance in single precision.
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

use super::{ActiveSet, Deviations, ModeSet};
use crate::error::ConfigError;
use crate::gaussian::Gaussian;
use crate::scalar::{Real, is_invertible, larger};

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
    /// Cost: about (3 (MODES − 1) + MODES (2 MODES − 1)) NX (NX + 1) / 2 operations.
    #[inline(always)]
    pub fn interact(&mut self, jump: &JumpMatrix<T, MODES>) {
        if MODES == 1 {
            return;
        }
        let mut weight = [[T::ZERO; MODES]; MODES];
        let mut c = [T::ZERO; MODES];
        let mut sum = T::ZERO;
        for j in 0..MODES {
            for i in 0..MODES {
                weight[j][i] = jump[i][j] * self.prob[i];
                c[j] += weight[j][i];
            }
            if c[j] > T::lit(LEAST_PROBABILITY) {
                let scale = T::ONE / c[j];
                for w in &mut weight[j] {
                    *w *= scale;
                }
                sum += c[j];
            } else {
                c[j] = T::ZERO;
                weight[j] = self.prob;
            }
        }
        self.mix_into(&weight);
        if sum > T::ZERO {
            // Rows that sum to one but for rounding would let the probabilities drift while a track coasts.
            let scale = T::ONE / sum;
            self.prob = c.map(|c| c * scale);
        }
    }

    /// Every mode j becomes the moment match of all modes i with the weights `weight[j][i]`.
    #[inline(always)]
    fn mix_into(&mut self, weight: &[[T; MODES]; MODES]) {
        let d = self.deviations();
        let mut bar = [[T::ZERO; NX]; MODES];
        for k in 0..NX {
            let first = self.modes[0].mean.data.0[0][k];
            for j in 0..MODES {
                for i in 1..MODES {
                    bar[j][k] += weight[j][i] * d[i][k];
                }
                self.modes[j].mean.data.0[0][k] = first + bar[j][k];
            }
        }
        for a in 0..NX {
            for b in a..NX {
                let first = self.modes[0].cov.upper()[a][b];
                // In stages, so that no result is used at once: the pipeline of a small core would wait. Loops, not closures: in
                // code for size, bounds checks would stay in those.
                let (mut n, mut v, mut wn) = ([T::ZERO; MODES], [T::ZERO; MODES], [T::ZERO; MODES]);
                for i in 0..MODES {
                    v[i] = d[i][a] * d[i][b];
                }
                for i in 0..MODES {
                    n[i] = self.modes[i].cov.upper()[a][b] - first;
                }
                for i in 0..MODES {
                    n[i] += v[i];
                }
                for j in 0..MODES {
                    v[j] = bar[j][a] * bar[j][b];
                }
                for j in 0..MODES {
                    v[j] = first - v[j];
                }
                for i in 1..MODES {
                    for j in 0..MODES {
                        wn[j] = weight[j][i] * n[i];
                    }
                    for j in 0..MODES {
                        v[j] += wn[j];
                    }
                }
                for j in 0..MODES {
                    self.modes[j].cov.upper_mut()[a][b] = v[j];
                }
            }
        }
    }

    /// d_i = x_i − x_1
    #[inline(always)]
    fn deviations(&self) -> [[T; NX]; MODES] {
        core::array::from_fn(|i| core::array::from_fn(|k| self.modes[i].mean.data.0[0][k] - self.modes[0].mean.data.0[0][k]))
    }

    /// Predicts every mode by its model over `dt` \[s\].
    #[inline(always)]
    pub fn predict<M: ModeSet<T, NX, MODES>>(&mut self, set: &M, dt: T) {
        self.advance(set, &set.steps(dt));
    }

    /// [`predict`](Self::predict) by steps that many targets share.
    #[inline(always)]
    pub fn advance<M: ModeSet<T, NX, MODES>>(&mut self, set: &M, steps: &M::Steps) {
        for (mode, g) in self.modes.iter_mut().enumerate() {
            set.advance(mode, g, steps);
        }
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
    /// Cost: about (4 MODES − 2) NX (NX + 1) / 2 operations; computed when asked for, not by a step.
    #[inline]
    #[must_use]
    pub fn combined(&self) -> Gaussian<T, NX> {
        let d = self.deviations();
        let mut out = Gaussian::ZERO;
        let mut bar = [T::ZERO; NX];
        for k in 0..NX {
            for i in 1..MODES {
                bar[k] += self.prob[i] * d[i][k];
            }
            out.mean.data.0[0][k] = self.modes[0].mean.data.0[0][k] + bar[k];
        }
        // All products, then all sums: no result is used at once, which the pipeline of a small core would wait for.
        unrolled!(for a in NX {
            let first = self.modes[0].cov.upper()[a];
            let (mut more, mut n, mut product) = ([T::ZERO; NX], [T::ZERO; NX], [T::ZERO; NX]);
            for b in a..NX {
                more[b] = -bar[a] * bar[b];
            }
            for i in 1..MODES {
                for b in a..NX {
                    product[b] = d[i][a] * d[i][b];
                }
                for b in a..NX {
                    n[b] = self.modes[i].cov.upper()[a][b] - first[b];
                }
                for b in a..NX {
                    n[b] += product[b];
                }
                for b in a..NX {
                    product[b] = self.prob[i] * n[b];
                }
                for b in a..NX {
                    more[b] += product[b];
                }
            }
            for b in a..NX {
                out.cov.upper_mut()[a][b] = first[b] + more[b];
            }
        });
        out
    }

    /// μ_r ∝ c_r e_r. Nothing changes where no mode is left, or what is left is not finite.
    #[inline(always)]
    pub(crate) fn weigh(&mut self, evidence: &[T; MODES]) {
        let weighed: [T; MODES] = core::array::from_fn(|r| self.prob[r] * evidence[r]);
        let sum = weighed.iter().fold(T::ZERO, |sum, p| sum + *p);
        if is_invertible(sum) {
            let scale = T::ONE / sum;
            self.prob = weighed.map(|p| p * scale);
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
