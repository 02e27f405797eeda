//! Evidence by logarithms, where plain sums do not serve: detections with a noise of their own, or far from every mode.
//!
//! Those with a noise of their own have their own S_jr = H P H' + R_j. Far from every mode, where all densities underflow,
//! what is relative is all that counts once no miss is possible: likelihoods are taken by their logarithms,
//!
//! ```text
//! relative    L_jr e^{−ρ_j},  ρ_j = max_r ln L_jr over the modes that are possible
//! score       ln M_j = ρ_j + ln Σ_r c_r L_jr e^{−ρ_j};   h_j e^{−ρ},  m e^{−ρ},  ρ = max_j ln M_j, at least −60 where m > 0
//! absorb      p_jr = β_j L_jr e^{−ρ_j} / Σ_s c_s L_js e^{−ρ_j}
//! ```
//!
//! A common factor changes no association. Where a miss is possible, likelihoods far below e⁻⁶⁰ are zero beside it, and
//! single precision holds e⁶⁰. Modes for which the noise is sharp are corrected by `joseph.rs`. All of it is out of line: plain detections pay for one look each.

use super::joseph::is_sharp;
use super::update::{Corrected, Found, Sums, correct};
use super::{Evidence, Kind, Predicted, Rate};
use crate::association::{Pda, SingleAssociator};
use crate::gaussian::{Innovation, ResidualDensity, dot};
use crate::mode::{LEAST_PROBABILITY, ModeBank};
use crate::model::MeasurementModel;
use crate::model::offset::Drift;
use crate::scalar::{Real, exp, ln};
use crate::scan::Detection;
use crate::sensor::Sensor;
use crate::symmetric::Symmetric;
use crate::time::Duration;
use nalgebra::SVector;

/// The least reference where a miss is possible.
const LEAST_REFERENCE: f64 = -60.0;

/// Likelihoods relative to the largest of a possible mode that weighs, zero in impossible modes, and its logarithm; −∞ where there
/// is none.
pub(super) fn relative<T: Real, I: Predicted<T, NX, NZ, MODES>, const NX: usize, const NZ: usize, const MODES: usize>(
    c: &[T; MODES],
    ln_likelihood: &[T; MODES],
    predicted: &I,
) -> ([T; MODES], T) {
    let possible = |r: usize| if predicted.weighs(r) { c[r] > T::lit(LEAST_PROBABILITY) } else { predicted.corrects(r) };
    let none = -T::ONE / T::ZERO;
    let weighing = (0..MODES).filter(|r| possible(*r) && predicted.weighs(*r));
    let reference = weighing.fold(none, |most, r| if ln_likelihood[r] > most { ln_likelihood[r] } else { most });
    let known = |r: usize| possible(r) && reference.is_finite();
    // A mode that does not weigh may be the likeliest by far.
    let above =
        |r: usize| if predicted.weighs(r) { ln_likelihood[r] } else { smaller(ln_likelihood[r], reference - T::lit(LEAST_REFERENCE)) };
    (core::array::from_fn(|r| if known(r) { exp(above(r) - reference) } else { T::ZERO }), reference)
}

/// The smaller of two numbers.
fn smaller<T: Real>(a: T, b: T) -> T {
    if b < a { b } else { a }
}

impl<T: Real, const DETS: usize> Evidence<T, DETS> {
    /// Gates the detections numbered `candidates` by the mode `widest`, each with what it brings.
    #[inline(never)]
    pub(super) fn gate_each<S: Sensor<T, NX, NZ>, I: Predicted<T, NX, NZ, MODES>, const NX: usize, const NZ: usize, const MODES: usize>(
        &mut self,
        bank: &ModeBank<T, NX, MODES>,
        predicted: &I,
        sensor: &S,
        detections: &[Detection<T, NZ>],
        candidates: &[u16],
        widest: usize,
    ) {
        self.gated.clear();
        let (model, threshold) = (sensor.model(), sensor.gate().threshold());
        let own_time = |number: &u16| detections.get(usize::from(*number)).is_some_and(|d| d.offset != Duration::ZERO);
        self.kind = if candidates.iter().any(own_time) { Kind::OwnTime } else { Kind::OwnNoise };
        if self.kind == Kind::OwnTime {
            return self.gate_at_their_times(bank, predicted, sensor, detections, candidates, widest);
        }
        let Some(innovation) = predicted.innovations().get(widest) else { return };
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
    pub(super) fn score_by_logarithms<
        S: Sensor<T, NX, NZ>,
        I: Predicted<T, NX, NZ, MODES>,
        const NX: usize,
        const NZ: usize,
        const MODES: usize,
    >(
        &mut self,
        bank: &ModeBank<T, NX, MODES>,
        predicted: &I,
        sensor: &S,
        detections: &[Detection<T, NZ>],
        mut rate: Rate<'_, T, NZ>,
    ) {
        let model = sensor.model();
        let c = &bank.prob;
        let mut reference = if self.miss > T::ZERO { T::lit(LEAST_REFERENCE) } else { -T::ONE / T::ZERO };
        if self.kind == Kind::OwnTime {
            self.mixtures_at_their_times(bank, predicted, model, detections);
        } else {
            for (number, hit) in self.gated.iter().zip(&mut self.hit) {
                let Some(detection) = detections.get(usize::from(*number)) else { break };
                *hit = ln_mixture(c, &ln_likelihoods(&seen(model, predicted, detection), predicted), predicted);
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

    /// [`correct`](Self::correct) by logarithms.
    #[inline(never)]
    pub(super) fn correct_by_logarithms<
        M: MeasurementModel<T, NX, NZ>,
        I: Predicted<T, NX, NZ, MODES>,
        const NX: usize,
        const NZ: usize,
        const MODES: usize,
    >(
        &self,
        beta_0: T,
        bank: &mut ModeBank<T, NX, MODES>,
        predicted: &I,
        model: &M,
        detections: &[Detection<T, NZ>],
    ) -> Corrected<T, MODES> {
        if self.kind == Kind::OwnTime {
            return self.correct_at_their_times(beta_0, bank, predicted, model, detections);
        }
        // The sums of every mode, and whether a detection is sharp in it.
        let mut sums = [(Sums::ZERO, false); MODES];
        for (detection, shares) in self.shared(bank, predicted, model, detections) {
            for r in 0..MODES {
                if !predicted.corrects(r) {
                    continue;
                }
                let (Share { p, s_inv, nu }, (sums, sharp)) = (&shares[r], &mut sums[r]);
                sums.add(*p, &s_inv.times(&nu.data.0[0]));
                for k in 0..NZ {
                    for l in k..NZ {
                        sums.second.upper_mut()[k][l] += *p * s_inv.upper()[k][l];
                    }
                }
                *sharp |= is_sharp(&predicted.innovations()[r], detection);
            }
        }
        let mut resets = 0;
        if sums.iter().any(|(_, sharp)| *sharp) {
            resets += self.correct_by_joseph(beta_0, &sums, bank, predicted, model, detections);
        }
        for r in 0..MODES {
            if !predicted.corrects(r) || sums[r].1 {
                continue;
            }
            let (_, kept) = correct::<T, false, NX, NZ>(&mut bank.modes[r], &predicted.innovations()[r], &sums[r].0, beta_0);
            resets += u16::from(!kept);
        }
        Corrected { evidence: sums.map(|(sums, _)| beta_0 + sums.evidence), resets }
    }

    /// The gated detections, each with its shares in the modes.
    pub(super) fn shared<
        'a,
        M: MeasurementModel<T, NX, NZ>,
        I: Predicted<T, NX, NZ, MODES>,
        const NX: usize,
        const NZ: usize,
        const MODES: usize,
    >(
        &'a self,
        bank: &ModeBank<T, NX, MODES>,
        predicted: &'a I,
        model: &'a M,
        detections: &'a [Detection<T, NZ>],
    ) -> impl Iterator<Item = (&'a Detection<T, NZ>, [Share<T, NZ>; MODES])> + use<'a, T, M, I, NX, NZ, MODES, DETS> {
        let c = bank.prob;
        self.gated.iter().zip(&self.hit).filter_map(move |(number, beta)| {
            let detection = detections.get(usize::from(*number))?;
            let seen = seen(model, predicted, detection);
            let p = shares(&c, *beta, &ln_likelihoods(&seen, predicted), predicted);
            Some((detection, core::array::from_fn(|r| Share { p: p[r], s_inv: seen[r].0.s_inv, nu: seen[r].1 })))
        })
    }

    /// Whether ν' S⁻¹ ν of the most probable detection is at most `nis` in any mode that weighs; false where none was taken.
    pub fn is_explained<
        M: MeasurementModel<T, NX, NZ>,
        I: Predicted<T, NX, NZ, MODES>,
        const NX: usize,
        const NZ: usize,
        const MODES: usize,
    >(
        &self,
        bank: &ModeBank<T, NX, MODES>,
        predicted: &I,
        model: &M,
        detections: &[Detection<T, NZ>],
        nis: T,
    ) -> bool {
        let most_probable = self.gated.iter().zip(&self.hit).reduce(|a, b| if b.1 > a.1 { b } else { a });
        let Some(detection) = most_probable.and_then(|(number, _)| detections.get(usize::from(*number))) else { return false };
        (0..MODES).filter(|r| predicted.weighs(*r)).any(|r| {
            let innovation = &predicted.innovations()[r];
            if detection.offset == Duration::ZERO {
                let nu = model.residual(&detection.z, &innovation.z_hat);
                return density_of(innovation, detection).nis(&nu) <= nis;
            }
            let drift = Drift::new(model, &bank.modes[r], innovation);
            let seen = drift.seen(innovation, detection.offset.as_secs(), detection.noise.as_ref());
            seen.density.nis(&model.residual(&detection.z, &seen.z_hat)) <= nis
        })
    }

    /// [`pda`](Self::pda) by logarithms.
    #[inline(never)]
    pub(super) fn pda_by_logarithms<
        S: Sensor<T, NX, NZ>,
        I: Predicted<T, NX, NZ, MODES>,
        const NX: usize,
        const NZ: usize,
        const MODES: usize,
    >(
        &mut self,
        bank: &mut ModeBank<T, NX, MODES>,
        predicted: &I,
        sensor: &S,
        detections: &[Detection<T, NZ>],
        doubt: T,
    ) -> Found<T> {
        self.score(bank, predicted, sensor, detections);
        let (miss, hits) = self.weights();
        let miss = Pda.associate(miss, hits);
        let Corrected { evidence, resets } = self.correct_by_logarithms(miss * doubt, bank, predicted, sensor.model(), detections);
        bank.weigh(&evidence);
        Found { miss, hits: T::ONE - miss, resets }
    }
}

/// What a detection gives to one mode.
pub(super) struct Share<T, const NZ: usize> {
    /// p
    pub p: T,
    /// S⁻¹
    pub s_inv: Symmetric<T, NZ>,
    /// ν
    pub nu: SVector<T, NZ>,
}

/// ln Σ_r c_r L_r over the modes that weigh
pub(super) fn ln_mixture<T: Real, I: Predicted<T, NX, NZ, MODES>, const NX: usize, const NZ: usize, const MODES: usize>(
    c: &[T; MODES],
    ln_likelihood: &[T; MODES],
    predicted: &I,
) -> T {
    let (likelihood, reference) = relative(c, ln_likelihood, predicted);
    if reference.is_finite() { reference + ln(mixture(c, &likelihood, predicted)) } else { reference }
}

/// Σ_r c_r L_r over the modes that weigh
fn mixture<T: Real, I: Predicted<T, NX, NZ, MODES>, const NX: usize, const NZ: usize, const MODES: usize>(
    c: &[T; MODES],
    likelihood: &[T; MODES],
    predicted: &I,
) -> T {
    dot(&core::array::from_fn(|r| if predicted.weighs(r) { c[r] } else { T::ZERO }), likelihood)
}

/// β L_r / Σ_s c_s L_s
pub(super) fn shares<T: Real, I: Predicted<T, NX, NZ, MODES>, const NX: usize, const NZ: usize, const MODES: usize>(
    c: &[T; MODES],
    beta: T,
    ln_likelihood: &[T; MODES],
    predicted: &I,
) -> [T; MODES] {
    let (likelihood, _) = relative(c, ln_likelihood, predicted);
    let mixture = mixture(c, &likelihood, predicted);
    let factor = if mixture > T::lit(LEAST_PROBABILITY) { beta / mixture } else { T::ZERO };
    likelihood.map(|l| factor * l)
}

/// The density of a detection in every mode that counts, with its own noise or the sensor's, and its residual.
fn seen<T: Real, M: MeasurementModel<T, NX, NZ>, I: Predicted<T, NX, NZ, MODES>, const NX: usize, const NZ: usize, const MODES: usize>(
    model: &M,
    predicted: &I,
    detection: &Detection<T, NZ>,
) -> [(ResidualDensity<T, NZ>, SVector<T, NZ>); MODES] {
    core::array::from_fn(|r| {
        let innovation = &predicted.innovations()[r];
        if predicted.counts(r) {
            (density_of(innovation, detection), model.residual(&detection.z, &innovation.z_hat))
        } else {
            (innovation.density, SVector::zeros())
        }
    })
}

/// ln L_r of what [`seen`] gives; −∞ in modes that do not count.
fn ln_likelihoods<T: Real, I: Predicted<T, NX, NZ, MODES>, const NX: usize, const NZ: usize, const MODES: usize>(
    seen: &[(ResidualDensity<T, NZ>, SVector<T, NZ>); MODES],
    predicted: &I,
) -> [T; MODES] {
    core::array::from_fn(|r| if predicted.counts(r) { seen[r].0.ln_at(&seen[r].1) } else { -T::ONE / T::ZERO })
}

/// The density of a detection in a mode: with its own noise, or the sensor's.
pub(crate) fn density_of<T: Real, const NX: usize, const NZ: usize>(
    innovation: &Innovation<T, NX, NZ>,
    detection: &Detection<T, NZ>,
) -> ResidualDensity<T, NZ> {
    match &detection.noise {
        Some(noise) => ResidualDensity::new(&innovation.spread.plus(noise)),
        None => innovation.density,
    }
}
