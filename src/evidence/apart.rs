//! Evidence that plain sums do not serve: detections with a noise of their own, noise that is sharp, or all far from every mode.
//!
//! Those with a noise of their own have their own S_jr = H P H' + R_j. Far from every mode, where all densities underflow,
//! what is relative is all that counts once no miss is possible: likelihoods are taken by their logarithms,
//!
//! ```text
//! relative    L_jr e^{−ρ_j},  ρ_j = max_r ln L_jr over the modes that are possible
//! score       ln M_j = ρ_j + ln Σ_r c_r L_jr e^{−ρ_j};   h_j e^{−ρ},  m e^{−ρ},  ρ = max_j ln M_j, at least −60 where m > 0
//! absorb      p_jr = β_j L_jr e^{−ρ_j} / Σ_s c_s L_js e^{−ρ_j}
//! sharp       P ← (m (P + d_0 d_0') + Σ_j p_jr (P_jr + d_jr d_jr')) / e_r,   P_jr Joseph's form of Kalman's update by
//!             detection j, d the distances of the means, d_0 that of the prediction, from that of all
//! ```
//!
//! A common factor changes no association. Where a miss is possible, likelihoods far below e⁻⁶⁰ are zero beside it, and
//! single precision holds e⁶⁰. All of it is out of line: plain detections pay for one look each.

use super::sums::{Found, Sums, correct};
use super::{Evidence, Innovations, Kind, Rate};
use crate::association::{Pda, SingleAssociator};
use crate::gaussian::{Gaussian, Innovation, ResidualDensity, dot, noise_is_sharp};
use crate::mode::{LEAST_PROBABILITY, ModeBank};
use crate::model::MeasurementModel;
use crate::scalar::{Real, exp, is_finite, ln};
use crate::scan::Detection;
use crate::sensor::Sensor;
use crate::time::Duration;
use nalgebra::SVector;

/// The least reference where a miss is possible.
const LEAST_REFERENCE: f64 = -60.0;

/// Likelihoods relative to the largest of a possible mode, zero in the others, and its logarithm; −∞ where there is none.
pub(super) fn relative<T: Real, const MODES: usize>(c: &[T; MODES], ln_likelihood: &[T; MODES]) -> ([T; MODES], T) {
    let possible = |r: usize| c[r] > T::lit(LEAST_PROBABILITY);
    let none = -T::ONE / T::ZERO;
    let reference = (0..MODES).filter(|r| possible(*r)).fold(none, |most, r| if ln_likelihood[r] > most { ln_likelihood[r] } else { most });
    let counts = |r: usize| possible(r) && reference.is_finite();
    (core::array::from_fn(|r| if counts(r) { exp(ln_likelihood[r] - reference) } else { T::ZERO }), reference)
}

impl<T: Real, const DETS: usize> Evidence<T, DETS> {
    /// Gates the detections numbered `candidates` by the mode `widest`, each with what it brings.
    #[inline(never)]
    pub(super) fn gate_apart<S: Sensor<T, NX, NZ>, const NX: usize, const NZ: usize, const MODES: usize>(
        &mut self,
        bank: &ModeBank<T, NX, MODES>,
        innovations: &Innovations<T, NX, NZ, MODES>,
        sensor: &S,
        detections: &[Detection<T, NZ>],
        candidates: &[u16],
        widest: usize,
    ) {
        self.gated.clear();
        let (model, threshold) = (sensor.model(), sensor.gate().threshold());
        let own_time = |number: &u16| detections.get(usize::from(*number)).is_some_and(|d| d.offset != Duration::ZERO);
        self.kind = if candidates.iter().any(own_time) { Kind::OwnTime } else { Kind::Apart };
        if self.kind == Kind::OwnTime {
            return self.gate_at_their_times(bank, innovations, sensor, detections, candidates, widest);
        }
        let Some(innovation) = innovations.get(widest) else { return };
        for &number in candidates {
            let Some(detection) = detections.get(usize::from(number)) else { break };
            let nu = model.residual(&detection.z, &innovation.z_hat);
            if density_of(innovation, detection).nis(&nu) <= threshold && self.gated.push(number).is_err() {
                break;
            }
        }
    }

    /// [`score`](Self::score) by logarithms.
    #[inline(never)]
    pub(super) fn score_apart<S: Sensor<T, NX, NZ>, const NX: usize, const NZ: usize, const MODES: usize>(
        &mut self,
        bank: &ModeBank<T, NX, MODES>,
        innovations: &Innovations<T, NX, NZ, MODES>,
        sensor: &S,
        detections: &[Detection<T, NZ>],
        mut rate: Rate<T>,
    ) {
        let model = sensor.model();
        let c = &bank.prob;
        let mut reference = if self.miss > T::ZERO { T::lit(LEAST_REFERENCE) } else { -T::ONE / T::ZERO };
        if self.kind == Kind::OwnTime {
            self.mixtures_at_their_times(bank, innovations, model, detections);
        } else {
            for (number, hit) in self.gated.iter().zip(&mut self.hit) {
                let Some(detection) = detections.get(usize::from(*number)) else { break };
                *hit = ln_mixture(c, &ln_likelihoods(model, innovations, detection));
            }
        }
        for (_, ln_m) in self.gated.iter().zip(&self.hit) {
            if *ln_m > reference {
                reference = *ln_m;
            }
        }
        let known = reference.is_finite();
        for (number, hit) in self.gated.iter().zip(&mut self.hit) {
            let Some(detection) = detections.get(usize::from(*number)) else { break };
            *hit = if known { exp(*hit - reference) * rate.at(sensor.clutter(&detection.z)) } else { T::ZERO };
        }
        self.miss = if known { self.miss * exp(-reference) } else { T::ONE };
    }

    /// [`absorb`](Self::absorb) by logarithms.
    #[inline(never)]
    pub(super) fn absorb_apart<M: MeasurementModel<T, NX, NZ>, const NX: usize, const NZ: usize, const MODES: usize>(
        &self,
        beta_0: T,
        bank: &mut ModeBank<T, NX, MODES>,
        innovations: &Innovations<T, NX, NZ, MODES>,
        model: &M,
        detections: &[Detection<T, NZ>],
    ) -> u16 {
        if self.kind == Kind::OwnTime {
            return self.absorb_at_their_times(beta_0, bank, innovations, model, detections);
        }
        let weighed = || {
            self.gated.iter().zip(&self.hit).filter_map(|(number, beta)| {
                let detection = detections.get(usize::from(*number))?;
                Some((detection, shares(&bank.prob, *beta, &ln_likelihoods(model, innovations, detection))))
            })
        };
        let mut resets = 0;
        let mut evidence = [beta_0; MODES];
        let mut corrected = bank.modes;
        for (r, (mode, innovation)) in corrected.iter_mut().zip(innovations).enumerate() {
            let mine = || weighed().map(|(detection, shares)| (detection, shares[r]));
            let (e, kept) = if mine().any(|(detection, _)| is_sharp(innovation, detection)) {
                correct_sharply(mode, model, innovation, beta_0, mine)
            } else {
                correct_apart(mode, model, innovation, beta_0, mine)
            };
            evidence[r] = e;
            resets += u16::from(!kept);
        }
        bank.modes = corrected;
        bank.weigh(&evidence);
        resets
    }

    /// [`pda`](Self::pda) by logarithms.
    #[inline(never)]
    pub(super) fn pda_apart<S: Sensor<T, NX, NZ>, const NX: usize, const NZ: usize, const MODES: usize>(
        &mut self,
        bank: &mut ModeBank<T, NX, MODES>,
        innovations: &Innovations<T, NX, NZ, MODES>,
        sensor: &S,
        detections: &[Detection<T, NZ>],
        doubt: T,
    ) -> Found<T> {
        self.score(bank, innovations, sensor, detections);
        let (miss, hits) = self.weights();
        let miss = Pda.associate(miss, hits);
        let resets = self.absorb_apart(miss * doubt, bank, innovations, sensor.model(), detections);
        Found { miss, hits: T::ONE - miss, resets }
    }
}

/// Corrects a mode by detections with their weights, where a miss weighs `miss`. Returns the evidence, and whether the correction
/// was kept.
fn correct_apart<'a, T: Real, M: MeasurementModel<T, NX, NZ>, I, const NX: usize, const NZ: usize>(
    mode: &mut Gaussian<T, NX>,
    model: &M,
    innovation: &Innovation<T, NX, NZ>,
    miss: T,
    weighed: impl Fn() -> I,
) -> (T, bool)
where
    I: Iterator<Item = (&'a Detection<T, NZ>, T)>,
{
    let mut sums = Sums::ZERO;
    for (detection, p) in weighed() {
        let s_inv = density_of(innovation, detection).s_inv;
        sums.add(p, &s_inv.times(&model.residual(&detection.z, &innovation.z_hat).data.0[0]));
        for k in 0..NZ {
            for l in k..NZ {
                sums.second.upper_mut()[k][l] += p * s_inv.upper()[k][l];
            }
        }
    }
    correct::<T, false, NX, NZ>(mode, innovation, &sums, miss)
}

/// The same as a sum of positive terms.
fn correct_sharply<'a, T: Real, M: MeasurementModel<T, NX, NZ>, I, const NX: usize, const NZ: usize>(
    mode: &mut Gaussian<T, NX>,
    model: &M,
    innovation: &Innovation<T, NX, NZ>,
    miss: T,
    weighed: impl Fn() -> I,
) -> (T, bool)
where
    I: Iterator<Item = (&'a Detection<T, NZ>, T)>,
{
    let evidence = weighed().fold(miss, |sum, (_, p)| sum + p);
    if evidence <= T::lit(LEAST_PROBABILITY) || !is_finite(evidence) {
        return (evidence, true);
    }
    let gain = |detection: &Detection<T, NZ>| innovation.cross * density_of(innovation, detection).s_inv.to_matrix();
    let moved = |detection: &Detection<T, NZ>| gain(detection) * model.residual(&detection.z, &innovation.z_hat);
    let mean = weighed().fold(SVector::zeros(), |sum, (detection, p)| sum + moved(detection) * (p / evidence));
    let (h, noise) = (model.jacobian(&mode.mean), model.noise(&mode.mean));
    let mut cov = (mode.cov.to_matrix() + mean * mean.transpose()) * (miss / evidence);
    for (detection, p) in weighed() {
        let d = moved(detection) - mean;
        let joseph = mode.joseph(&gain(detection), &h, detection.noise.as_ref().unwrap_or(&noise));
        cov += (joseph + d * d.transpose()) * (p / evidence);
    }
    (evidence, mode.replace(mode.mean + mean, &cov))
}

/// Whether the noise of a detection, its own or the sensor's, is sharp.
fn is_sharp<T: Real, const NX: usize, const NZ: usize>(innovation: &Innovation<T, NX, NZ>, detection: &Detection<T, NZ>) -> bool {
    match &detection.noise {
        Some(noise) => noise_is_sharp(&innovation.spread, noise),
        None => innovation.sharp,
    }
}

/// ln Σ_r c_r L_r
pub(super) fn ln_mixture<T: Real, const MODES: usize>(c: &[T; MODES], ln_likelihood: &[T; MODES]) -> T {
    let (likelihood, reference) = relative(c, ln_likelihood);
    if reference.is_finite() { reference + ln(dot(c, &likelihood)) } else { reference }
}

/// β L_r / Σ_s c_s L_s
pub(super) fn shares<T: Real, const MODES: usize>(c: &[T; MODES], beta: T, ln_likelihood: &[T; MODES]) -> [T; MODES] {
    let (likelihood, _) = relative(c, ln_likelihood);
    let mixture = dot(c, &likelihood);
    let factor = if mixture > T::lit(LEAST_PROBABILITY) { beta / mixture } else { T::ZERO };
    likelihood.map(|l| factor * l)
}

/// ln L_r of a detection with its own noise, or the sensor's.
fn ln_likelihoods<T: Real, M: MeasurementModel<T, NX, NZ>, const NX: usize, const NZ: usize, const MODES: usize>(
    model: &M,
    innovations: &Innovations<T, NX, NZ, MODES>,
    detection: &Detection<T, NZ>,
) -> [T; MODES] {
    innovations.each_ref().map(|innovation| {
        let nu = model.residual(&detection.z, &innovation.z_hat);
        density_of(innovation, detection).ln_at(&nu)
    })
}

/// The density of a detection in a mode: with its own noise, or the sensor's.
fn density_of<T: Real, const NX: usize, const NZ: usize>(
    innovation: &Innovation<T, NX, NZ>,
    detection: &Detection<T, NZ>,
) -> ResidualDensity<T, NZ> {
    match &detection.noise {
        Some(noise) => ResidualDensity::new(&innovation.spread.plus(noise)),
        None => innovation.density,
    }
}
