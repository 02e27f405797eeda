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
//! All by logarithms: the densities of one scan span e^{−1000} to e^{20}.
//!
//! Cost: with m candidates for either target m² hypotheses, each NZ² multiply-adds of a form and one power of e; three inverses of
//! one measurement and two of two measurements for all that bring no noise of their own.

use super::as_one::AsOne;
use super::blocks::{self, Blocks, Pair};
use super::gaussian::CoupledInnovation;
use crate::gaussian::{ResidualDensity, blunted, unit_peak};
use crate::model::MeasurementModel;
use crate::model::resolution::Resolution;
use crate::scalar::{Real, ln};
use crate::scan::Detection;
use crate::symmetric::Symmetric;

/// A detection that may be somebody's.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
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
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
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
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
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
pub(super) struct Density<M, T> {
    pub inverse: M,
    pub ln_peak: T,
}

impl<T: Real, const NX: usize, const NZ: usize> CoupledInnovation<T, NX, NZ> {
    /// Calls `visit` with every hypothesis on the `candidates`.
    #[inline(always)]
    pub fn hypotheses<M: MeasurementModel<T, NX, NZ>>(
        &self,
        model: &M,
        resolution: Option<&Resolution<T, NZ>>,
        odds: &Odds<T>,
        detections: &[Detection<T, NZ>],
        candidates: &[Candidate<T>],
        mut visit: impl FnMut(&Hypothesis<T, NZ>),
    ) {
        let detected = odds.p_detect.map(ln);
        let missed = odds.p_detect.map(|p| ln(T::ONE - p * odds.p_gate));
        let as_one = resolution.map(|resolution| AsOne::new(model, &self.z_hat, &self.spread, &self.noise[0], resolution, odds));
        let ln_resolved = as_one.as_ref().map_or(T::ZERO, |one| one.ln_resolved);
        let nothing = Hypothesis { event: Event::Nothing, ln_weight: T::ZERO, w: [[T::ZERO; NZ]; 2], e: Blocks::zeros() };
        visit(&Hypothesis { ln_weight: ln_resolved + missed[0] + missed[1], ..nothing });
        if let Some(one) = &as_one {
            visit(&one.unseen());
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
                let density = own.map_or(plain[r], |noise| density_of(&self.spread.own[r].plus(&blunted(noise, &self.spread.own[r]))));
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
                visit(&one.merged(model, detection, candidate.ln_rate, i));
            }
            if !candidate.gated[0] {
                continue;
            }
            for (j, other) in candidates.iter().enumerate().filter(|(j, other)| *j != i && other.gated[1]) {
                let Some(second) = detections.get(usize::from(other.number)) else { continue };
                let of_pair = |noise: [Option<&Symmetric<T, NZ>>; 2]| {
                    let noisy = |r: usize| {
                        let spread = &self.spread.own[r];
                        noise[r].map_or(spread.plus(&self.noise[r]), |noise| spread.plus(&blunted(noise, spread)))
                    };
                    density_of_pair(&Blocks { own: [noisy(0), noisy(1)], ..self.spread })
                };
                let density = match (own, second.noise.as_ref()) {
                    (None, None) => *plain_pair.get_or_insert_with(|| of_pair([None, None])),
                    (a, b) => of_pair([a, b]),
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
}

#[inline(always)]
pub(super) fn density_of<T: Real, const NZ: usize>(s: &Symmetric<T, NZ>) -> Density<Symmetric<T, NZ>, T> {
    let density = ResidualDensity::new(s);
    Density { inverse: density.s_inv, ln_peak: ln(density.peak) }
}

#[inline(always)]
pub(super) fn density_of_pair<T: Real, const NZ: usize>(s: &Blocks<T, NZ>) -> Density<Blocks<T, NZ>, T> {
    let (inverse, root) = s.inverse();
    let unit = unit_peak::<T, NZ>();
    Density { inverse, ln_peak: ln(root) + ln(unit * unit) }
}
