//! Evidence of detections with a time of their own, an offset from their scan ([`Detection::with_offset`]).
//!
//! Each is predicted at its time, with its own ẑ, G and S (`model/offset.rs`). The G differ then, and mode r is corrected by
//! one detection after the other, none first:
//!
//! ```text
//! P ← P − p_j G_j S_j⁻¹ G_j',   d = G_j S_j⁻¹ ν_j − m,   m ← m + p_j/(q + p_j) d,   P ← P + q p_j/(q + p_j) d d',   q ← q + p_j
//! ```
//!
//! from q = β_0 / e_r and m = 0, which ends in x + m: the same mixture, by terms that do not cancel. All of it is out of
//! line: scans without offsets pay for one look at their detections.

use super::logarithms::{ln_mixture, shares};
use super::{Corrected, Evidence, Predicted};
use crate::gaussian::{Correction, Gaussian, Innovation};
use crate::mode::{LEAST_PROBABILITY, ModeBank};
use crate::model::MeasurementModel;
use crate::model::offset::Drift;
use crate::scalar::Real;
use crate::scan::Detection;
use crate::sensor::Sensor;
use crate::symmetric::Symmetric;
use nalgebra::SVector;

/// How the predicted measurements of all modes move with time.
struct Drifts<'a, T, M, const NX: usize, const NZ: usize, const MODES: usize> {
    model: &'a M,
    modes: [(Drift<T, NX, NZ>, &'a Innovation<T, NX, NZ>); MODES],
}

impl<'a, T: Real, M: MeasurementModel<T, NX, NZ>, const NX: usize, const NZ: usize, const MODES: usize> Drifts<'a, T, M, NX, NZ, MODES> {
    fn new<I: Predicted<T, NX, NZ, MODES>>(model: &'a M, bank: &ModeBank<T, NX, MODES>, predicted: &'a I) -> Self {
        let drift = |r: usize| (Drift::new(model, &bank.modes[r], &predicted.innovations()[r]), &predicted.innovations()[r]);
        let first = drift(0);
        Self { model, modes: core::array::from_fn(|r| if r > 0 && predicted.counts(r) { drift(r) } else { first }) }
    }

    /// The predicted measurement of `mode` at the time of `detection`, with its own noise or the sensor's, and the residual.
    fn seen(
        &self,
        (drift, innovation): &(Drift<T, NX, NZ>, &Innovation<T, NX, NZ>),
        detection: &Detection<T, NZ>,
    ) -> (Innovation<T, NX, NZ>, SVector<T, NZ>) {
        let seen = drift.seen(innovation, detection.offset.as_secs(), detection.noise.as_ref());
        let nu = self.model.residual(&detection.z, &seen.z_hat);
        (seen, nu)
    }

    fn ln_likelihoods<I: Predicted<T, NX, NZ, MODES>>(&self, detection: &Detection<T, NZ>, predicted: &I) -> [T; MODES] {
        core::array::from_fn(|r| {
            if !predicted.counts(r) {
                return -T::ONE / T::ZERO;
            }
            let (seen, nu) = self.seen(&self.modes[r], detection);
            seen.density.ln_at(&nu)
        })
    }
}

impl<T: Real, const DETS: usize> Evidence<T, DETS> {
    /// Gates the detections numbered `candidates` by the mode `widest`.
    pub(super) fn gate_at_their_times<
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
        candidates: &[u16],
        widest: usize,
    ) {
        let drifts = Drifts::new(sensor.model(), bank, predicted);
        let Some(mode) = drifts.modes.get(widest) else { return };
        for &number in candidates {
            let Some(detection) = detections.get(usize::from(number)) else { break };
            let (seen, nu) = drifts.seen(mode, detection);
            let inside = seen.density.is_proper() && seen.density.nis(&nu) <= sensor.gate().threshold();
            if inside && self.gated.push(number).is_err() {
                break;
            }
        }
    }

    /// Writes ln M of the gated detections.
    pub(super) fn mixtures_at_their_times<
        M: MeasurementModel<T, NX, NZ>,
        I: Predicted<T, NX, NZ, MODES>,
        const NX: usize,
        const NZ: usize,
        const MODES: usize,
    >(
        &mut self,
        bank: &ModeBank<T, NX, MODES>,
        predicted: &I,
        model: &M,
        detections: &[Detection<T, NZ>],
    ) {
        let drifts = Drifts::new(model, bank, predicted);
        for (number, hit) in self.gated.iter().zip(&mut self.hit) {
            let Some(detection) = detections.get(usize::from(*number)) else { break };
            *hit = ln_mixture(&bank.prob, &drifts.ln_likelihoods(detection, predicted), predicted);
        }
    }

    /// Corrects the modes by one detection after the other.
    pub(super) fn correct_at_their_times<
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
        let drifts = Drifts::new(model, bank, predicted);
        let shares = |number: u16, beta: T| {
            let detection = detections.get(usize::from(number))?;
            Some((detection, shares(&bank.prob, beta, &drifts.ln_likelihoods(detection, predicted), predicted)))
        };
        let weighed = || self.gated.iter().zip(&self.hit).filter_map(|(number, beta)| shares(*number, *beta));
        let mut evidence = [beta_0; MODES];
        for (_, shares) in weighed() {
            for r in 0..MODES {
                evidence[r] += shares[r];
            }
        }
        let mut resets = 0;
        let mut corrected = bank.modes;
        for r in 0..MODES {
            if !predicted.corrects(r) {
                continue;
            }
            if !(evidence[r].is_finite() && evidence[r] > T::lit(LEAST_PROBABILITY)) {
                continue;
            }
            let mut mixture = Growing { g: corrected[r], q: beta_0 / evidence[r], m: SVector::zeros() };
            let kept = weighed().all(|(detection, shares)| {
                let (seen, nu) = drifts.seen(&drifts.modes[r], detection);
                mixture.add(shares[r] / evidence[r], &seen, &nu)
            });
            if kept {
                corrected[r] = mixture.g;
            }
            resets += u16::from(!kept);
        }
        bank.modes = corrected;
        Corrected { evidence, resets }
    }
}

/// A mixture of the prediction and of its updates by some detections, as one Gaussian but for its mean, which is m off.
struct Growing<T, const NX: usize> {
    g: Gaussian<T, NX>,
    q: T,
    m: SVector<T, NX>,
}

impl<T: Real, const NX: usize> Growing<T, NX> {
    /// One more detection of weight p. `false` where that would break the covariance.
    fn add<const NZ: usize>(&mut self, p: T, seen: &Innovation<T, NX, NZ>, nu: &SVector<T, NZ>) -> bool {
        if p <= T::ZERO {
            return true;
        }
        let s_inv = &seen.density.s_inv;
        let d = seen.cross * SVector::from(s_inv.times(&nu.data.0[0])) - self.m;
        let share = p / (self.q + p);
        let known = Correction { w: [T::ZERO; NZ], e: Symmetric::from_fn(|k, l| p * s_inv.upper()[k][l]) };
        let apart = Correction { w: [share], e: Symmetric::from_diagonal([-self.q * share]) };
        let kept = self.g.correct(&seen.cross, &known) && self.g.correct(&d, &apart);
        (self.q, self.m) = (self.q + p, self.m + d * share);
        kept
    }
}
