//! What the gated detections add up to in every mode, and the update of the modes by it.
//!
//! ```text
//! f_j             β_j / M_j, or P_D / λ_j in PDA
//! sums            e_r = Σ_j f_j L_jr,   a_r = Σ_j f_j L_jr u_jr,   A_r = Σ_j f_j L_jr u_jr u_jr',   u_jr = S_r⁻¹ ν_jr
//! with the miss   e_r ← m + e_r;   the evidence of PDA is m + Σ_r c_r e_r,   β_0 = m / (m + Σ_r c_r e_r)
//! update          w = a_r / e_r,   E = ((e_r − m) S_r⁻¹ − A_r) / e_r + w w',   μ_r ∝ c_r e_r
//! ```
//!
//! One pass over the detections serves all modes, and a factor common to m and all f_j changes nothing. Kalman's update by
//! one detection is the same with m = 0.

use super::logarithms::relative;
use super::{Evidence, Innovations, Kind, Predicted, SomeInnovations};
use crate::gaussian::{Correction, Gaussian, Innovation, ResidualDensity, dot};
use crate::mode::{LEAST_PROBABILITY, ModeBank};
use crate::model::MeasurementModel;
use crate::scalar::{Real, is_invertible};
use crate::scan::Detection;
use crate::sensor::Sensor;
use crate::symmetric::Symmetric;
use nalgebra::SVector;

/// The sums of one mode.
#[derive(Clone, Copy)]
pub(super) struct Sums<T, const NZ: usize> {
    /// e
    pub evidence: T,
    /// a
    pub first: [T; NZ],
    /// −A, with Σ p S⁻¹ of the detections that have their own
    pub second: Symmetric<T, NZ>,
}

impl<T: Real, const NZ: usize> Sums<T, NZ> {
    pub const ZERO: Self = Self { evidence: T::ZERO, first: [T::ZERO; NZ], second: Symmetric::zeros() };

    /// One more detection, f L = `p`.
    #[inline(always)]
    pub fn add(&mut self, p: T, u: &[T; NZ]) {
        // All products, then all sums: no result is used at once.
        let mut pu = [T::ZERO; NZ];
        each!(k in NZ {
            pu[k] = p * u[k];
        });
        let puu = Symmetric::<T, NZ>::from_fn(|k, l| pu[k] * u[l]);
        self.evidence += p;
        each!(k in NZ {
            self.first[k] += pu[k];
            each!(l in NZ {
                if k <= l {
                    self.second.upper_mut()[k][l] -= puu.upper()[k][l];
                }
            });
        });
    }

    /// The association update, where the sum with the miss is `evidence`; S⁻¹ is `s_inv`, zero where the second sum has it.
    #[inline(always)]
    fn correction(&self, evidence: T, s_inv: &Symmetric<T, NZ>) -> Correction<T, NZ> {
        let scale = T::ONE / evidence;
        let mut w = [T::ZERO; NZ];
        each!(k in NZ {
            w[k] = self.first[k] * scale;
        });
        let e = |k: usize, l: usize| (self.second.upper()[k][l] + self.evidence * s_inv.upper()[k][l]) * scale + w[k] * w[l];
        Correction { w, e: Symmetric::from_fn(e) }
    }
}

/// Corrects a mode by its sums, where a miss weighs `miss`. With `SHARED` all detections have the S of `innovation`.
/// Returns the evidence, and whether the correction was kept.
#[inline(always)]
pub(super) fn correct<T: Real, const SHARED: bool, const NX: usize, const NZ: usize>(
    mode: &mut Gaussian<T, NX>,
    innovation: &Innovation<T, NX, NZ>,
    sums: &Sums<T, NZ>,
    miss: T,
) -> (T, bool) {
    let evidence = miss + sums.evidence;
    let s_inv = if SHARED { innovation.density.s_inv } else { Symmetric::zeros() };
    // False for what is no number, too: there is nothing to correct by.
    let likely = evidence > T::lit(LEAST_PROBABILITY);
    (evidence, !likely || mode.correct(&innovation.cross, &sums.correction(evidence, &s_inv)))
}

impl<T: Real, const DETS: usize> Evidence<T, DETS> {
    /// Updates `bank` by the association probabilities: `beta_0`, and those that replaced the weights of the gated
    /// detections; a common factor does not matter. Returns how many corrections were refused because they would have
    /// broken a covariance.
    ///
    /// Cost: a gated detection what it costs in [`score`](Self::score) and about 3 NZ² + NZ operations a mode more; a mode
    /// one [`correct`](crate::gaussian::Gaussian::correct). Detections with a time of their own cost two corrections a mode
    /// each.
    #[inline(always)]
    pub fn absorb<M: MeasurementModel<T, NX, NZ>, I: Predicted<T, NX, NZ, MODES>, const NX: usize, const NZ: usize, const MODES: usize>(
        &self,
        beta_0: T,
        bank: &mut ModeBank<T, NX, MODES>,
        predicted: &I,
        model: &M,
        detections: &[Detection<T, NZ>],
    ) -> u16 {
        if self.gated.is_empty() {
            return 0;
        }
        let Corrected { evidence, resets } = self.correct(beta_0, bank, predicted, model, detections);
        bank.weigh(&evidence);
        resets
    }

    /// [`absorb`](Self::absorb) but for the mode probabilities.
    #[inline(always)]
    pub fn correct<M: MeasurementModel<T, NX, NZ>, I: Predicted<T, NX, NZ, MODES>, const NX: usize, const NZ: usize, const MODES: usize>(
        &self,
        beta_0: T,
        bank: &mut ModeBank<T, NX, MODES>,
        predicted: &I,
        model: &M,
        detections: &[Detection<T, NZ>],
    ) -> Corrected<T, MODES> {
        if self.gated.is_empty() {
            return Corrected { evidence: [T::ONE; MODES], resets: 0 };
        }
        if self.kind != Kind::Plain {
            return self.correct_by_logarithms(beta_0, bank, predicted, model, detections);
        }
        let mut sums = [Sums::ZERO; MODES];
        for (number, beta) in self.gated.iter().zip(&self.hit) {
            let Some(detection) = detections.get(usize::from(*number)) else { break };
            let seen: [_; MODES] = core::array::from_fn(|r| {
                if !predicted.counts(r) {
                    return (T::ZERO, [T::ZERO; NZ]);
                }
                let Innovation { z_hat, density, .. } = &predicted.innovations()[r];
                likelihood(density, &model.residual(&detection.z, z_hat))
            });
            let mixture = dot(&bank.prob, &core::array::from_fn(|r| if predicted.weighs(r) { seen[r].0 } else { T::ZERO }));
            if mixture > T::lit(LEAST_PROBABILITY) {
                let factor = *beta / mixture;
                for (r, (sums, (l, u))) in sums.iter_mut().zip(&seen).enumerate() {
                    if predicted.corrects(r) {
                        sums.add(factor * *l, u);
                    }
                }
            } else if *beta > T::ZERO {
                return self.correct_by_logarithms(beta_0, bank, predicted, model, detections);
            }
        }
        let mut resets = 0;
        let mut evidence = [T::ZERO; MODES];
        for r in 0..MODES {
            if !predicted.corrects(r) {
                continue;
            }
            let (e, kept) = correct::<T, true, NX, NZ>(&mut bank.modes[r], &predicted.innovations()[r], &sums[r], beta_0);
            evidence[r] = e;
            resets += u16::from(!kept);
        }
        Corrected { evidence, resets }
    }

    /// [`correct`](Self::correct) for modes that were activated after the association.
    // Out of line: few tracks activate modes in a scan.
    #[inline(never)]
    pub fn correct_activated<M: MeasurementModel<T, NX, NZ>, const NX: usize, const NZ: usize, const MODES: usize>(
        &self,
        beta_0: T,
        bank: &mut ModeBank<T, NX, MODES>,
        predicted: &SomeInnovations<'_, T, NX, NZ, MODES>,
        model: &M,
        detections: &[Detection<T, NZ>],
    ) -> Corrected<T, MODES> {
        self.correct(beta_0, bank, predicted, model, detections)
    }

    /// Scores, associates by PDA and absorbs in one pass over the gated detections. The modes are updated as if a miss weighed
    /// `doubt` times what it does.
    ///
    /// Cost: that of [`absorb`](Self::absorb), less a division a detection.
    #[inline(always)]
    pub fn pda<S: Sensor<T, NX, NZ>, const NX: usize, const NZ: usize, const MODES: usize>(
        &mut self,
        bank: &mut ModeBank<T, NX, MODES>,
        innovations: &Innovations<T, NX, NZ, MODES>,
        sensor: &S,
        detections: &[Detection<T, NZ>],
        doubt: T,
    ) -> Found<T> {
        if self.gated.is_empty() {
            return Found { miss: T::ONE, hits: T::ZERO, resets: 0 };
        }
        let found = if self.kind == Kind::Plain { self.pda_by_sums(bank, innovations, sensor, detections, doubt) } else { None };
        found.unwrap_or_else(|| self.pda_by_logarithms(bank, innovations, sensor, detections, doubt))
    }

    /// [`pda`](Self::pda) of plain detections; `None`, and no mode corrected, where none is likely in any.
    #[inline(always)]
    fn pda_by_sums<S: Sensor<T, NX, NZ>, const NX: usize, const NZ: usize, const MODES: usize>(
        &mut self,
        bank: &mut ModeBank<T, NX, MODES>,
        innovations: &Innovations<T, NX, NZ, MODES>,
        sensor: &S,
        detections: &[Detection<T, NZ>],
        doubt: T,
    ) -> Option<Found<T>> {
        let p_detect = sensor.p_detect(&bank.modes[0].mean);
        let mut miss = T::ONE - p_detect * sensor.gate().p_gate();
        let uniform = sensor.uniform_clutter();
        let mut rate = self.rate::<NZ>(sensor.gate(), p_detect);
        // Where λ is the same everywhere, it counts once, in the miss: all weights times λ, then.
        let mut share = T::ONE;
        if let Some(clutter) = uniform {
            (miss, share) = (miss * rate.density(clutter), p_detect);
        } else {
            for (number, hit) in self.gated.iter().zip(&mut self.hit) {
                let Some(detection) = detections.get(usize::from(*number)) else { break };
                *hit = rate.at(sensor.clutter(&detection.z));
            }
        }
        // Mode by mode: all of one fits into registers.
        let gated = self.gated.iter().zip(&self.hit);
        let (mut evidence, mut hits, mut likely, mut resets) = ([T::ZERO; MODES], T::ZERO, false, 0);
        for r in 0..MODES {
            // Copies: what is behind a reference would be loaded for every detection.
            let (z_hat, mut density) = (innovations[r].z_hat, innovations[r].density);
            density.peak *= share;
            let mut sums = Sums::ZERO;
            for (number, rate) in gated.clone() {
                let Some(detection) = detections.get(usize::from(*number)) else { break };
                let (l, u) = likelihood(&density, &sensor.model().residual(&detection.z, &z_hat));
                sums.add(if uniform.is_some() { l } else { *rate * l }, &u);
            }
            hits += bank.prob[r] * sums.evidence;
            evidence[r] = miss * doubt + sums.evidence;
            if is_invertible(evidence[r]) {
                likely = true;
                let by = sums.correction(evidence[r], &density.s_inv);
                resets += u16::from(!bank.modes[r].correct(&innovations[r].cross, &by));
            }
        }
        if !likely {
            return None;
        }
        bank.weigh(&evidence);
        Some(Found { miss, hits, resets })
    }
}

/// What the correction of some modes found.
#[derive(Clone, Copy, Debug)]
pub struct Corrected<T, const MODES: usize> {
    /// e_r of the modes that were corrected, with a common factor
    pub evidence: [T; MODES],
    /// Corrections refused because they would have broken a covariance
    pub resets: u16,
}

/// What PDA found, in weights with a common factor.
#[derive(Clone, Copy, Debug)]
pub struct Found<T> {
    /// The weight of no detection being the target's
    pub miss: T,
    /// The weights of all gated detections together
    pub hits: T,
    /// Corrections refused because they would have broken a covariance
    pub resets: u16,
}

/// L and u of a residual.
#[inline(always)]
fn likelihood<T: Real, const NZ: usize>(density: &ResidualDensity<T, NZ>, nu: &SVector<T, NZ>) -> (T, [T; NZ]) {
    let u = density.s_inv.times(&nu.data.0[0]);
    (density.of_square(dot(&nu.data.0[0], &u)), u)
}

/// Updates a bank by one measurement that is certainly the target's: the plain IMM update.
///
/// ```text
/// μ_r = c_r N(ν_r; 0, S_r) / Σ_s c_s N(ν_s; 0, S_s),   mode r takes the Kalman update by ν_r
/// ```
///
/// Returns how many corrections were refused.
pub fn update_by_one<T: Real, M: MeasurementModel<T, NX, NZ>, const NX: usize, const NZ: usize, const MODES: usize>(
    bank: &mut ModeBank<T, NX, MODES>,
    model: &M,
    z: &SVector<T, NZ>,
) -> u16 {
    let innovations = super::innovations(bank, model);
    let (ln_likelihood, resets) = correct_by_one(bank, &innovations, model, z);
    bank.weigh(&relative::<T, _, NX, NZ, MODES>(&bank.prob, &ln_likelihood, &innovations).0);
    resets
}

/// Corrects the modes of `predicted` by one measurement that is certainly the target's, each by Kalman's update. Returns ln N(ν_r;
/// 0, S_r), −∞ in other modes, and how many corrections were refused.
pub fn correct_by_one<T, M, I, const NX: usize, const NZ: usize, const MODES: usize>(
    bank: &mut ModeBank<T, NX, MODES>,
    predicted: &I,
    model: &M,
    z: &SVector<T, NZ>,
) -> ([T; MODES], u16)
where
    T: Real,
    M: MeasurementModel<T, NX, NZ>,
    I: Predicted<T, NX, NZ, MODES>,
{
    let mut ln_likelihood = [-T::ONE / T::ZERO; MODES];
    let mut resets = 0;
    for r in 0..MODES {
        if !predicted.corrects(r) {
            continue;
        }
        let (mode, innovation) = (&mut bank.modes[r], &predicted.innovations()[r]);
        let nu = model.residual(z, &innovation.z_hat);
        ln_likelihood[r] = innovation.density.ln_at(&nu);
        let kept = if innovation.sharp {
            mode.update_joseph(innovation, &model.jacobian(&mode.mean), &model.noise(&mode.mean), &nu)
        } else {
            mode.update(innovation, &nu)
        };
        resets += u16::from(!kept);
    }
    (ln_likelihood, resets)
}
