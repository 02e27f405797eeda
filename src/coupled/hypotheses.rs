//! What the detections of a scan may be: clutter, of one target each, or one of both.
//!
//! ```text
//! hypothesis     weight, but for what all have in common                     A          R_A            ν
//! nothing        (1 − P_u) (1 − P_D1) (1 − P_D2)                             –          –              –
//! i of r         (1 − P_u) P_Dr (1 − P_Ds) / λ_i · N(ν; 0, S)                I_r        R              z_i − ẑ_r
//! i of 1, j of 2 (1 − P_u) P_D1 P_D2 / λ_i λ_j · N(ν; 0, S)                  I          diag(R, R)     (z_i − ẑ₁, z_j − ẑ₂)
//! i of both      P_Da / λ_i · √det 2πR_d · N(ν; 0, S)                        [s 1−s]    diag(R_a, R_d) (z_i − ẑ_a, −ẑ_d)
//!                                                                            [1  −1]
//! both missed    P_u (1 − P_Da)                                              [1 −1]     R_d            −ẑ_d
//! as one
//! S = A Σ A' + R_A,   ẑ_a = s ẑ₁ + (1 − s) ẑ₂,   ẑ_d = ẑ₁ − ẑ₂,   P_u = √det 2πR_d · N(ẑ_d; 0, H_d P H_d' + R_d)
//! ```
//!
//! The density of one detection of both is that of its place and of the targets' distance at once: P_u is in it and must not be
//! put beside it. P_D stands for P_D P_G where nothing is seen. With diffuse clutter φ! / V^φ of m detections, 1 / λ is V / m, and of
//! two detections together m / (m − 1) more.
//!
//! All by logarithms: the densities of one scan span e^{−1000} to e^{20}. The sums follow the largest weight met so far, so that
//! no list of hypotheses is kept.
//!
//! Cost: with m candidates for either target m² hypotheses, each NZ² multiply-adds of a form and one power of e; three inverses of
//! one measurement and two of two measurements for all that bring no noise of their own.

use super::blocks::{self, Blocks, Pair};
use super::gaussian::CoupledInnovation;
use crate::gaussian::{ResidualDensity, unit_peak};
use crate::model::MeasurementModel;
use crate::model::resolution::Resolution;
use crate::scalar::{Real, exp, is_finite, larger, ln};
use crate::scan::Detection;
use crate::symmetric::Symmetric;
use nalgebra::SVector;

/// A detection that may be somebody's.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Candidate<T> {
    /// Its number in the scan
    pub number: u16,
    /// Whether it lies in the gate of the first target, of the second
    pub gated: [bool; 2],
    /// Whether it lies in the gate of what both give as one
    pub merged: bool,
    /// ln 1/λ
    pub ln_rate: T,
}

/// What hypotheses are weighed by besides the detections.
#[derive(Clone, Copy, Debug)]
pub struct Odds<T> {
    /// P_D of either target
    pub p_detect: [T; 2],
    /// P_G
    pub p_gate: T,
    /// What two detections of two targets weigh more than the product of both: ln m / (m − 1) of diffuse clutter, else zero
    pub ln_pair: T,
}

/// What a hypothesis says.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Event {
    /// Neither was detected
    Nothing,
    /// Both are one to the sensor, and were not detected
    Unseen,
    /// The candidate of this index is that of the target of this index, the other was not detected
    One(usize, usize),
    /// The candidates of these indices are those of the targets
    Both(usize, usize),
    /// The candidate of this index is of both
    Merged(usize),
}

/// One hypothesis.
#[derive(Clone, Copy, Debug)]
pub struct Hypothesis<T, const NZ: usize> {
    /// What it says
    pub event: Event,
    /// The logarithm of its weight
    pub ln_weight: T,
    /// w = A' S⁻¹ ν
    pub w: Pair<T, NZ>,
    /// E = A' S⁻¹ A
    pub e: Blocks<T, NZ>,
}

/// The density of a residual by its logarithm at zero.
#[derive(Clone, Copy)]
struct Density<M, T> {
    inverse: M,
    ln_peak: T,
}

impl<T: Real, const NX: usize, const NZ: usize> CoupledInnovation<T, NX, NZ> {
    /// Calls `visit` with every hypothesis on the `candidates`. `noise` is R at either target.
    #[inline(always)]
    pub fn hypotheses<M: MeasurementModel<T, NX, NZ>>(
        &self,
        model: &M,
        noise: &[Symmetric<T, NZ>; 2],
        resolution: Option<&Resolution<T, NZ>>,
        odds: &Odds<T>,
        detections: &[Detection<T, NZ>],
        candidates: &[Candidate<T>],
        mut visit: impl FnMut(&Hypothesis<T, NZ>),
    ) {
        let detected = odds.p_detect.map(ln);
        let missed = odds.p_detect.map(|p| ln(T::ONE - p * odds.p_gate));
        let as_one = resolution.map(|resolution| self.as_one(model, &noise[0], resolution, odds));
        let ln_resolved = as_one.as_ref().map_or(T::ZERO, |one| one.ln_resolved);
        let nothing = Hypothesis { event: Event::Nothing, ln_weight: T::ZERO, w: [[T::ZERO; NZ]; 2], e: Blocks::zeros() };
        visit(&Hypothesis { ln_weight: ln_resolved + missed[0] + missed[1], ..nothing });
        if let Some(one) = &as_one {
            visit(&one.unseen);
        }
        let plain = self.density.map(|density| Density { inverse: density.s_inv, ln_peak: ln(density.peak) });
        let mut plain_pair = None;
        for (i, candidate) in candidates.iter().enumerate() {
            let Some(detection) = detections.get(usize::from(candidate.number)) else { continue };
            let own = detection.noise.as_ref();
            for r in 0..2 {
                if !candidate.gated[r] {
                    continue;
                }
                let density = own.map_or(plain[r], |noise| density_of(&self.spread.own[r].plus(noise)));
                let nu = model.residual(&detection.z, &self.z_hat[r]).data.0[0];
                let (mut w, mut e) = (nothing.w, nothing.e);
                (w[r], e.own[r]) = (density.inverse.times(&nu), density.inverse);
                let ln_weight = ln_resolved + detected[r] + missed[1 - r] + candidate.ln_rate + density.ln_peak
                    - T::lit(0.5) * crate::gaussian::dot(&nu, &w[r]);
                visit(&Hypothesis { event: Event::One(r, i), ln_weight, w, e });
            }
            if let Some(one) = &as_one
                && candidate.merged
            {
                visit(&one.merged::<NX, M>(model, detection, candidate, i));
            }
            if !candidate.gated[0] {
                continue;
            }
            for (j, other) in candidates.iter().enumerate().filter(|(j, other)| *j != i && other.gated[1]) {
                let Some(second) = detections.get(usize::from(other.number)) else { continue };
                let of_pair = |a: &Symmetric<T, NZ>, b: &Symmetric<T, NZ>| {
                    density_of_pair(&Blocks { own: [self.spread.own[0].plus(a), self.spread.own[1].plus(b)], ..self.spread })
                };
                let density = match (own, second.noise.as_ref()) {
                    (None, None) => *plain_pair.get_or_insert_with(|| of_pair(&noise[0], &noise[1])),
                    (a, b) => of_pair(a.unwrap_or(&noise[0]), b.unwrap_or(&noise[1])),
                };
                let nu = [model.residual(&detection.z, &self.z_hat[0]).data.0[0], model.residual(&second.z, &self.z_hat[1]).data.0[0]];
                let w = density.inverse.times(&nu);
                let ln_weight =
                    ln_resolved + detected[0] + detected[1] + candidate.ln_rate + other.ln_rate + odds.ln_pair + density.ln_peak
                        - T::lit(0.5) * blocks::dot(&nu, &w);
                visit(&Hypothesis { event: Event::Both(i, j), ln_weight, w, e: density.inverse });
            }
        }
    }

    /// What both would give as one: its predicted measurement and the density of its residual, with the noise `noise` unless the
    /// resolution states one.
    #[inline(always)]
    #[must_use]
    pub fn merged<M: MeasurementModel<T, NX, NZ>>(
        &self,
        model: &M,
        resolution: &Resolution<T, NZ>,
        noise: &Symmetric<T, NZ>,
    ) -> (SVector<T, NZ>, ResidualDensity<T, NZ>) {
        let share = [resolution.share, T::ONE - resolution.share];
        let spread = self.spread.combined([share, [T::ONE, -T::ONE]]);
        let density = ResidualDensity::new(&spread.own[0].plus(resolution.noise.as_ref().unwrap_or(noise)));
        (self.between(model, share[0]), density)
    }

    /// ẑ_a
    #[inline(always)]
    fn between<M: MeasurementModel<T, NX, NZ>>(&self, model: &M, share: T) -> SVector<T, NZ> {
        // From the second on, not the sum of both: angles may be a whole turn apart.
        self.z_hat[1] + model.difference(&self.z_hat[0], &self.z_hat[1]) * share
    }

    #[inline(always)]
    fn as_one<M: MeasurementModel<T, NX, NZ>>(
        &self,
        model: &M,
        noise: &Symmetric<T, NZ>,
        resolution: &Resolution<T, NZ>,
        odds: &Odds<T>,
    ) -> AsOne<T, NZ> {
        let share = [resolution.share, T::ONE - resolution.share];
        let spread = self.spread.combined([share, [T::ONE, -T::ONE]]);
        let own_noise = resolution.noise.as_ref().unwrap_or(noise);
        let apart = model.difference(&self.z_hat[0], &self.z_hat[1]);
        let distance = apart.data.0[0].map(|v| -v);
        let pair = Blocks { own: [spread.own[0].plus(own_noise), spread.own[1].plus(&resolution.cells)], cross: spread.cross };
        let together = density_of(&pair.own[1]);
        let u = together.inverse.times(&distance);
        // Where rounding leaves no difference to certainty, the least doubt that can be told.
        let ln_unresolved = resolution.ln_volume + together.ln_peak - T::lit(0.5) * crate::gaussian::dot(&distance, &u);
        let ln_resolved = ln(larger(T::ONE - exp(ln_unresolved), T::EPSILON));
        let p_detect = resolution.p_detect.unwrap_or(larger(odds.p_detect[0], odds.p_detect[1]));
        AsOne {
            ln_resolved,
            unseen: Hypothesis {
                event: Event::Unseen,
                ln_weight: ln_unresolved + ln(T::ONE - p_detect * odds.p_gate),
                w: [u, u.map(|v| -v)],
                e: Blocks {
                    own: [together.inverse; 2],
                    cross: core::array::from_fn(|k| core::array::from_fn(|l| -together.inverse.at(k, l))),
                },
            },
            share,
            z_hat: self.between(model, share[0]),
            distance,
            density: density_of_pair(&pair),
            spread: pair,
            ln_detected: ln(p_detect) + resolution.ln_volume,
            first_spread: spread.own[0],
        }
    }
}

/// Two targets as one to the sensor.
struct AsOne<T, const NZ: usize> {
    /// ln (1 − P_u)
    ln_resolved: T,
    unseen: Hypothesis<T, NZ>,
    /// (s, 1 − s)
    share: [T; 2],
    /// ẑ_a
    z_hat: SVector<T, NZ>,
    /// −ẑ_d
    distance: [T; NZ],
    /// S of detections without a noise of their own, and its density
    spread: Blocks<T, NZ>,
    density: Density<Blocks<T, NZ>, T>,
    /// The covariance of ẑ_a without noise
    first_spread: Symmetric<T, NZ>,
    /// ln (P_Da √det 2πR_d)
    ln_detected: T,
}

impl<T: Real, const NZ: usize> AsOne<T, NZ> {
    #[inline(always)]
    fn merged<const NX: usize, M: MeasurementModel<T, NX, NZ>>(
        &self,
        model: &M,
        detection: &Detection<T, NZ>,
        candidate: &Candidate<T>,
        index: usize,
    ) -> Hypothesis<T, NZ> {
        let density = match &detection.noise {
            None => self.density,
            Some(noise) => density_of_pair(&Blocks { own: [self.first_spread.plus(noise), self.spread.own[1]], ..self.spread }),
        };
        let nu = [model.residual(&detection.z, &self.z_hat).data.0[0], self.distance];
        let u = density.inverse.times(&nu);
        let ln_weight = self.ln_detected + candidate.ln_rate + density.ln_peak - T::lit(0.5) * blocks::dot(&nu, &u);
        let [first, second] = self.share;
        let w = [core::array::from_fn(|k| first * u[0][k] + u[1][k]), core::array::from_fn(|k| second * u[0][k] - u[1][k])];
        Hypothesis { event: Event::Merged(index), ln_weight, w, e: density.inverse.combined([[first, T::ONE], [second, -T::ONE]]) }
    }
}

#[inline(always)]
fn density_of<T: Real, const NZ: usize>(s: &Symmetric<T, NZ>) -> Density<Symmetric<T, NZ>, T> {
    let density = ResidualDensity::new(s);
    Density { inverse: density.s_inv, ln_peak: ln(density.peak) }
}

#[inline(always)]
fn density_of_pair<T: Real, const NZ: usize>(s: &Blocks<T, NZ>) -> Density<Blocks<T, NZ>, T> {
    let (inverse, root) = s.inverse();
    let unit = unit_peak::<T, NZ>();
    Density { inverse, ln_peak: ln(root) + ln(unit * unit) }
}

/// What hypotheses add up to in one pair of modes.
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
