//! The density of two targets over all pairs of motion modes, and the interacting multiple model cycle on it.
//!
//! ```text
//! jumps         π_IJ = π_{i1 j1} π_{i2 j2},   I = (i1, i2), J = (j1, j2)         the targets jump independently
//! interaction   c_J = Σ_I π_IJ μ_I,   d_I = x_I − x_0,   N_I = P_I − P_0 + d_I d_I',   x_0, P_0 those of the first pair
//!               x⁰_J = x_0 + d̄_J,   P⁰_J = P_0 + Σ_I π_IJ μ_I N_I / c_J − d̄_J d̄_J',   d̄_J = Σ_I π_IJ μ_I d_I / c_J
//! update        μ_J = c_J Λ_J / Σ c Λ
//! combination   the same with c_J = 1 and the weights μ_I
//! ```
//!
//! Since jumps are a product, every sum Σ_I π_IJ v_I is two sums over the modes of one target: 2 MODES³ products where MODES⁴ would
//! be needed. Deviations about the first pair of modes cancel nothing of weight, as in [`ModeBank`].

use super::gaussian::{CoupledGaussian, Coupling};
use crate::gaussian::Gaussian;
use crate::mode::{JumpMatrix, LEAST_PROBABILITY, ModeBank, ModeSet};
use crate::scalar::{Real, exp, is_finite};

/// One number for every pair of modes.
type Table<T, const MODES: usize> = [[T; MODES]; MODES];

/// Probabilities of all pairs of modes, and one density for each.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CoupledBank<T, const NX: usize, const MODES: usize, C> {
    /// μ: entry \[j1\]\[j2\] of the first target in mode j1 and the second in j2
    pub prob: Table<T, MODES>,
    /// x_J, P_J
    pub pairs: [[CoupledGaussian<T, NX, C>; MODES]; MODES],
}

/// What all sums of an interaction are made with.
struct Mixing<'a, T, const MODES: usize> {
    jump: &'a JumpMatrix<T, MODES>,
    /// μ
    prob: Table<T, MODES>,
    /// 1 / c, zero where no mode leads there
    scale: Table<T, MODES>,
    /// Whether there is such a pair
    unreachable: bool,
}

impl<T: Real, const MODES: usize> Mixing<'_, T, MODES> {
    /// Σ_I π_IJ μ_I v_I / c_J; where no mode leads to J, all modes by their probabilities.
    #[inline(always)]
    fn mix(&self, v: &Table<T, MODES>) -> Table<T, MODES> {
        let weighed: Table<T, MODES> = core::array::from_fn(|i| core::array::from_fn(|j| self.prob[i][j] * v[i][j]));
        let mut mixed = jumped(self.jump, &weighed);
        for (mixed, scale) in mixed.iter_mut().flatten().zip(self.scale.iter().flatten()) {
            *mixed *= *scale;
        }
        if self.unreachable {
            let all = sum(&weighed);
            for (mixed, _) in mixed.iter_mut().flatten().zip(self.scale.iter().flatten()).filter(|(_, scale)| **scale == T::ZERO) {
                *mixed = all;
            }
        }
        mixed
    }
}

/// Σ_I π_IJ v_I, first over the modes of the first target, then over those of the second.
#[inline(always)]
fn jumped<T: Real, const MODES: usize>(jump: &JumpMatrix<T, MODES>, v: &Table<T, MODES>) -> Table<T, MODES> {
    let mut half = [[T::ZERO; MODES]; MODES];
    for j in 0..MODES {
        for i in 0..MODES {
            for other in 0..MODES {
                half[j][other] += jump[i][j] * v[i][other];
            }
        }
    }
    let mut whole = [[T::ZERO; MODES]; MODES];
    for first in 0..MODES {
        for j in 0..MODES {
            for i in 0..MODES {
                whole[first][j] += jump[i][j] * half[first][i];
            }
        }
    }
    whole
}

fn sum<T: Real, const MODES: usize>(table: &Table<T, MODES>) -> T {
    table.iter().flatten().fold(T::ZERO, |sum, v| sum + *v)
}

impl<T: Real, C: Coupling<T, NX>, const NX: usize, const MODES: usize> CoupledBank<T, NX, MODES, C> {
    /// All zero bits.
    pub const ZERO: Self = Self { prob: [[T::ZERO; MODES]; MODES], pairs: [[CoupledGaussian::ZERO; MODES]; MODES] };

    /// Two targets with nothing in common, each with the mode probabilities `prob`.
    #[must_use]
    pub fn new(prob: &[T; MODES], targets: [Gaussian<T, NX>; 2]) -> Self {
        Self { prob: prob.map(|first| prob.map(|second| first * second)), pairs: [[CoupledGaussian::new(targets); MODES]; MODES] }
    }

    /// Mixes the pairs of modes by `jump`, the jump matrix of either target; `prob` becomes the predicted c. A pair that none can
    /// reach (c below 1e-30) gets zero and the combined estimate.
    ///
    /// Cost: about (4 MODES³ + 8 MODES²) NX (2 NX + 1) operations, half of that where the covariance between the targets is not
    /// kept.
    #[inline(always)]
    pub fn interact(&mut self, jump: &JumpMatrix<T, MODES>) {
        if MODES == 1 {
            return;
        }
        let mut c = jumped(jump, &self.prob);
        let mut mixing = Mixing { jump, prob: self.prob, scale: [[T::ZERO; MODES]; MODES], unreachable: false };
        for (c, scale) in c.iter_mut().flatten().zip(mixing.scale.iter_mut().flatten()) {
            if *c > T::lit(LEAST_PROBABILITY) {
                *scale = T::ONE / *c;
            } else {
                *c = T::ZERO;
                mixing.unreachable = true;
            }
        }
        self.mix(&mixing);
        let total = sum(&c);
        if total > T::ZERO {
            // Rows that sum to one but for rounding would let the probabilities drift while nothing is seen.
            let scale = T::ONE / total;
            self.prob = c.map(|row| row.map(|c| c * scale));
        }
    }

    #[inline(always)]
    fn mix(&mut self, mixing: &Mixing<'_, T, MODES>) {
        let Self { pairs, .. } = self;
        // Deviations of the means before, and those of the mixed means: by target, entry and pair.
        let mut d = [[[[T::ZERO; MODES]; MODES]; NX]; 2];
        let mut bar = d;
        for r in 0..2 {
            for k in 0..NX {
                let first = pairs[0][0].targets[r].mean.data.0[0][k];
                for (d, pair) in d[r][k].iter_mut().flatten().zip(pairs.iter().flatten()) {
                    *d = pair.targets[r].mean.data.0[0][k] - first;
                }
                bar[r][k] = mixing.mix(&d[r][k]);
                for (bar, pair) in bar[r][k].iter().flatten().zip(pairs.iter_mut().flatten()) {
                    pair.targets[r].mean.data.0[0][k] = first + *bar;
                }
            }
        }
        for r in 0..2 {
            for a in 0..NX {
                for b in a..NX {
                    let deviations = [[&d[r][a], &d[r][b]], [&bar[r][a], &bar[r][b]]];
                    let entry = |pair: &CoupledGaussian<T, NX, C>| pair.targets[r].cov.upper()[a][b];
                    mix_entry(pairs, mixing, deviations, entry, |pair, v| pair.targets[r].cov.upper_mut()[a][b] = v);
                }
            }
        }
        if pairs[0][0].cross.block().is_none() {
            return;
        }
        for b in 0..NX {
            for a in 0..NX {
                let deviations = [[&d[0][a], &d[1][b]], [&bar[0][a], &bar[1][b]]];
                let entry = |pair: &CoupledGaussian<T, NX, C>| pair.cross.block().map_or(T::ZERO, |c| c.data.0[b][a]);
                mix_entry(pairs, mixing, deviations, entry, |pair, v| {
                    if let Some(c) = pair.cross.block_mut() {
                        c.data.0[b][a] = v;
                    }
                });
            }
        }
    }

    /// Predicts every pair of modes by its models over `dt` \[s\].
    #[inline(always)]
    pub fn predict<M: ModeSet<T, NX, MODES>>(&mut self, set: &M, dt: T) {
        let steps = set.steps(dt);
        for (first, row) in self.pairs.iter_mut().enumerate() {
            for (second, pair) in row.iter_mut().enumerate() {
                pair.predict(set, [first, second], &steps, dt);
            }
        }
    }

    /// μ_J ∝ c_J Λ_J by the logarithms of Λ. Nothing changes where no pair of modes is left.
    pub fn weigh(&mut self, ln_evidence: &Table<T, MODES>) {
        let mut most = -T::ONE / T::ZERO;
        for (p, ln) in self.prob.iter().flatten().zip(ln_evidence.iter().flatten()) {
            if *p > T::ZERO && *ln > most {
                most = *ln;
            }
        }
        if !is_finite(most) {
            return;
        }
        let mut weighed = self.prob;
        for (p, ln) in weighed.iter_mut().flatten().zip(ln_evidence.iter().flatten()) {
            *p *= if *p > T::ZERO { exp(*ln - most) } else { T::ZERO };
        }
        let scale = T::ONE / sum(&weighed);
        if is_finite(scale) {
            self.prob = weighed.map(|row| row.map(|p| p * scale));
        }
    }

    /// The mode probabilities of the target `number`, 0 or 1.
    #[must_use]
    pub fn mode_probabilities(&self, number: usize) -> [T; MODES] {
        let prob = &self.prob;
        let other = |i: usize, j: usize| if number == 0 { prob[i][j] } else { prob[j][i] };
        core::array::from_fn(|i| (0..MODES).fold(T::ZERO, |sum, j| sum + other(i, j)))
    }

    /// The combined estimates of both targets, with what they have in common.
    #[must_use]
    pub fn combined(&self) -> CoupledGaussian<T, NX, C> {
        let pairs = || self.prob.iter().flatten().zip(self.pairs.iter().flatten());
        let first = Gaussian::moment_match(pairs().map(|(p, CoupledGaussian { targets: [first, _], .. })| (*p, first)));
        let second = Gaussian::moment_match(pairs().map(|(p, CoupledGaussian { targets: [_, second], .. })| (*p, second)));
        let mut out = CoupledGaussian::<T, NX, C>::new([first, second]);
        let CoupledGaussian { targets: [first, second], cross } = &mut out;
        if let Some(out) = cross.block_mut() {
            for (p, pair) in pairs() {
                let (d, e) = (pair.targets[0].mean - first.mean, pair.targets[1].mean - second.mean);
                if let Some(c) = pair.cross.block() {
                    *out += (c + d * e.transpose()) * *p;
                }
            }
        }
        out
    }

    /// Whether all densities are sound, each as [`ModeBank::is_valid`] has it.
    #[must_use]
    pub fn is_valid(&self) -> bool {
        let sound = |pair: &CoupledGaussian<T, NX, C>| {
            let common = pair.cross.block().is_none_or(|c| c.iter().all(|v| v.is_finite()));
            common && pair.targets.iter().all(|target| ModeBank::new([T::ONE], *target).is_valid())
        };
        self.prob.iter().flatten().all(|p| p.is_finite()) && self.pairs.iter().flatten().all(sound)
    }
}

/// Mixes one entry of the covariances, which `get` reads and `set` writes. `deviations` are d and then d̄ of its row and its column.
#[inline(always)]
fn mix_entry<T: Real, P, const MODES: usize>(
    pairs: &mut Table<P, MODES>,
    mixing: &Mixing<'_, T, MODES>,
    [[d_a, d_b], [bar_a, bar_b]]: [[&Table<T, MODES>; 2]; 2],
    get: impl Fn(&P) -> T,
    set: impl Fn(&mut P, T),
) {
    let first = get(&pairs[0][0]);
    let mut n = [[T::ZERO; MODES]; MODES];
    for i in 0..MODES {
        for j in 0..MODES {
            n[i][j] = get(&pairs[i][j]) - first + d_a[i][j] * d_b[i][j];
        }
    }
    let mixed = mixing.mix(&n);
    for i in 0..MODES {
        for j in 0..MODES {
            set(&mut pairs[i][j], first + mixed[i][j] - bar_a[i][j] * bar_b[i][j]);
        }
    }
}
