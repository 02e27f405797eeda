//! What hypotheses add up to in one pair of modes, by weights relative to the largest met so far: no list of them is kept.
//!
//! ```text
//! p_k = e^{ln w_k − ρ},  ρ = max ln w_k;  where ρ grows, all sums shrink by e^{ρ − ρ'}
//! Λ = e^ρ Σ p,   w̄ = Σ p w / Σ p,   Ē = Σ p (E − w w') / Σ p + w̄ w̄'
//! ```

use super::blocks::{Blocks, Pair};
use super::hypotheses::{Event, Hypothesis};
use crate::scalar::{Real, exp, is_finite, ln};
use crate::symmetric::Symmetric;

/// The sums of one pair of modes.
#[derive(Clone, Copy, Debug)]
pub struct Sums<T, const NZ: usize> {
    /// The logarithm that all weights are relative to
    reference: T,
    total: T,
    /// Of hypotheses by which a target was detected
    seen: [T; 2],
    /// Of those by which both are one to the sensor
    unresolved: T,
    /// Σ p w
    w: Pair<T, NZ>,
    /// Σ p (E − w w')
    e: Blocks<T, NZ>,
}

impl<T: Real, const NZ: usize> Default for Sums<T, NZ> {
    fn default() -> Self {
        Self::new()
    }
}

impl<T: Real, const NZ: usize> Sums<T, NZ> {
    /// None yet.
    #[must_use]
    pub fn new() -> Self {
        let zero = T::ZERO;
        Self { reference: -T::ONE / zero, total: zero, seen: [zero; 2], unresolved: zero, w: [[zero; NZ]; 2], e: Blocks::zeros() }
    }

    /// One more. What is impossible, or no number, counts for nothing.
    #[inline(always)]
    pub fn take(&mut self, hypothesis: &Hypothesis<T, NZ>) {
        let Hypothesis { event, ln_weight, w, e } = hypothesis;
        if !is_finite(*ln_weight) {
            return;
        }
        if *ln_weight > self.reference {
            self.scale(exp(self.reference - *ln_weight));
            self.reference = *ln_weight;
        }
        let p = exp(*ln_weight - self.reference);
        self.total += p;
        let seen = match event {
            Event::Nothing => [false; 2],
            Event::Unseen | Event::Merged(_) => {
                self.unresolved += p;
                [*event != Event::Unseen; 2]
            }
            Event::One(target, _) => [*target == 0, *target == 1],
            Event::Both(..) => [true; 2],
        };
        if *event == Event::Nothing {
            return;
        }
        for r in 0..2 {
            self.seen[r] += if seen[r] { p } else { T::ZERO };
            for k in 0..NZ {
                self.w[r][k] += p * w[r][k];
            }
        }
        self.e.add(p, e);
        self.e.add_square(-p, w);
    }

    #[inline(always)]
    fn scale(&mut self, factor: T) {
        self.total *= factor;
        self.unresolved *= factor;
        self.seen = self.seen.map(|v| factor * v);
        self.w = self.w.map(|w| w.map(|v| factor * v));
        self.e = Blocks {
            own: self.e.own.map(|m| Symmetric::from_fn(|k, l| factor * m.upper()[k][l])),
            cross: self.e.cross.map(|row| row.map(|v| factor * v)),
        };
    }

    /// The logarithm of the sum of all weights, −∞ where nothing is possible.
    #[must_use]
    pub fn ln_evidence(&self) -> T {
        self.reference + ln(self.total)
    }

    /// The probabilities that either target was detected, and that both are one to the sensor.
    #[must_use]
    pub fn probabilities(&self) -> ([T; 2], T) {
        let share = |v: T| if self.total > T::ZERO { v / self.total } else { T::ZERO };
        (self.seen.map(share), share(self.unresolved))
    }

    /// w̄ and Ē; zero where nothing is possible.
    #[inline(always)]
    #[must_use]
    pub fn correction(mut self) -> (Pair<T, NZ>, Blocks<T, NZ>) {
        let scale = if self.total > T::ZERO { T::ONE / self.total } else { T::ZERO };
        self.scale(scale);
        self.e.add_square(T::ONE, &self.w);
        (self.w, self.e)
    }
}
